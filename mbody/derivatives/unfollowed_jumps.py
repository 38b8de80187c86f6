"""Laws and loads that may jump along a motion: those that are followed as formulas of the instant,
and those that are not.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from mbody.core.dual_number import DualNumber
from mbody.laws import Expression, Law, MeasuredFormula, Table
from mbody.laws.postfix import OPERATIONS, VARIABLE
from mbody.model.changed_elements import with_changed
from mbody.model.loads import Damper, Spring, TorsionDamper, TorsionSpring
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.system import System

__all__ = ["unfollowed_jumps", "with_formulas_of_the_instant"]

Array = np.ndarray

#: Functions of formulas that jump.
JUMPING = re.compile(r"\b(?:sign|step)\s*\(")
#: Functions of formulas with corners, at which accelerations of what is driven jump.
CORNERED = re.compile(r"\b(?:sign|step|abs|min|max|clamp|deadband)\s*\(")
#: Loads whose own law is of a stretch, an angle or a rate that formulas of the instant have.
OF_STRETCH = (Spring, Damper, TorsionSpring, TorsionDamper)


def with_formulas_of_the_instant(system: System) -> System:
    """The system in which laws of loads that jump are formulas of the instant, whose jumps are
    followed; the same where there are none.
    """
    changed = []
    for load in system.mechanism.loads:
        made: dict[str, Any] = {}
        for name, law in _laws(load).items():
            of_time = load.__dataclass_fields__[name].metadata.get("of") == "time"
            known = of_time or isinstance(load, OF_STRETCH)
            if known and isinstance(law, Expression) and JUMPING.search(law.text):
                made[name] = _of_the_instant(law, "t" if of_time else "x")
        if made:
            changed.append(replace(load, **made))
    if not changed:
        return system
    return with_numbers_of(assemble(with_changed(system.mechanism, changed, ())), system.values)


def _of_the_instant(law: Expression, variable: str) -> MeasuredFormula:
    names = tuple(OPERATIONS[code] for code in law.program)
    taken = (variable,) * sum(code == VARIABLE for code in law.program)
    return MeasuredFormula(law.text, names, taken, law.constants)


def _laws(element: Any) -> dict[str, Law]:
    """The laws of an element by field."""
    found = {part.name: getattr(element, part.name) for part in fields(element)}
    return {name: law for name, law in found.items() if isinstance(law, Law)}


def unfollowed_jumps(system: System, values: Mapping[str, Any]) -> dict[str, Array | bool]:
    """Why derivatives lack what a jump adds, and by which of the numbers: (numbers,), or all.
    `values`: of the description by dotted name, dual ones among them.

    A law of time jumps at a time of its own, which only its own numbers move.
    """
    machine, found = system.mechanism, dict[str, Array | bool]()
    for element in (*machine.inputs, *machine.drivers):
        for law in _laws(element).values():
            if not (isinstance(law, Expression) and CORNERED.search(law.text)):
                continue
            own = [x for name, x in values.items() if name.startswith(f"{element.name}.")]
            moving = [one.tangents != 0.0 for one in own if isinstance(one, DualNumber)]
            if moving:
                why = f"'{element.name}' jumps, or has a corner, at a time that they may move"
                found[why] = np.any(moving, axis=0)
    for load in machine.loads:
        for name, law in _laws(load).items():
            if load.__dataclass_fields__[name].metadata.get("of") == "time":
                continue
            jumps = isinstance(law, Expression) and JUMPING.search(law.text)
            if jumps or _holds(law):
                found[f"the law of '{load.name}' jumps, which is not followed"] = True
    # as they are written: what a formula calls has no other list
    written = repr((*machine.loads, *machine.states, *machine.drivers))
    for name, curve in machine.curves.items():
        if _holds(curve.law) and re.search(rf"\b{name}\s*\(", written):
            found[f"the curve '{name}' jumps, which is not followed"] = True
    return found


def _holds(law: Any) -> bool:
    return isinstance(law, Table) and law.interpolation == "hold"
