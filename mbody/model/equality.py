"""Equality of mechanisms: all that one describes."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import Any

from mbody.quantities import Formula, FormulaError
from mbody.quantities.units import DIMENSIONS, Dimension

__all__ = ["whole"]


def _stated(machine: Any, value: Any) -> Any:
    """A number or formula; the unit of plain angles only where it is one."""
    if not isinstance(value, Formula):
        return value
    scope = machine.parameters.scope()
    angle = value.dimension == DIMENSIONS["angle"] and not value.has_units(scope)
    return value if angle else replace(value, angle="")


def _worth(machine: Any, value: Any, dimension: Dimension | None) -> Any:
    """The same, as a number where it follows no parameters."""
    if not isinstance(value, Formula):
        return value
    own = replace(value, dimension=dimension)
    with contextlib.suppress(FormulaError):
        if not machine.parameters.used_by(own):
            return own.value(machine.parameters.scope())
    return _stated(machine, own)


def _simulated(machine: Any) -> Any:
    """The motion that `simulate` is set to."""
    settings = machine.simulation
    if settings is None:
        return None
    angle = DIMENSIONS["angle"]
    start = {
        body: {k: _worth(machine, v, angle if k == "angle" else None) for k, v in given.items()}
        for body, given in settings.start.items()
    }
    until = _worth(machine, settings.until, None)
    return settings.rtol, settings.instants, until, start, settings.events


def whole(machine: Any) -> tuple[Any, ...]:
    """All that a `Mechanism` describes: every number to the last digit, what follows parameters,
    the order.
    """
    following = {
        name: _stated(machine, formula)
        for name, formula in machine.formulas.items()
        if machine.parameters.used_by(formula)
    }
    turning = [d for d in machine.drivers if d.angular]
    angles = {name for d in turning for name in (d.name, getattr(d, "body", d.name))}
    given = [machine.ask.at if machine.ask else {}]
    given += [question.at for question in machine.questions.values()]
    positions = [
        {
            name: [_worth(machine, v, DIMENSIONS["angle"] if name in angles else None) for v in row]
            for name, row in at.items()
        }
        for at in given
    ]
    sought = {
        name: [
            (one.name, one.unit, [_worth(machine, p, None) for p in (one.start, one.low, one.high)])
            for one in question.unknowns
        ]
        for name, question in machine.questions.items()
    }
    title = machine.name, machine.units, machine.g, machine.ground, machine.source, machine.note
    elements = machine.bodies, machine.joints, machine.couplings, machine.drivers, machine.loads
    signals = machine.inputs, machine.described_states, machine.controllers, machine.curves
    parameters = {name: _stated(machine, value) for name, value in machine.parameters.items()}
    instants = machine.ask and replace(machine.ask, at={})
    questions = {n: replace(q, unknowns="x", at={}) for n, q in machine.questions.items()}
    studies = machine.measures, instants, positions, sought, _simulated(machine), questions
    contacts = machine.contacts, machine.groups
    return (*title, *elements, *signals, *contacts, parameters, following, *studies)
