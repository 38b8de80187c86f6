"""All that a mechanism says, for the question whether two say the same."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mbody.model.event import Stop
from mbody.quantities import Formula, FormulaError
from mbody.quantities.units import DIMENSIONS, Dimension

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism

__all__ = ["whole"]


def _said(machine: Mechanism, value: Any) -> Any:
    """A number or formula; the unit of plain angles only where it is one."""
    if not isinstance(value, Formula):
        return value
    angle = value.dimension == DIMENSIONS["angle"] and not value.has_units(machine.scope)
    return value if angle else replace(value, angle="")


def _worth(machine: Mechanism, value: Any, dimension: Dimension | None) -> Any:
    """The same, as a number where it follows no parameters."""
    if not isinstance(value, Formula):
        return value
    own = replace(value, dimension=dimension)
    with contextlib.suppress(FormulaError):
        if not machine.parameters.used_by(own):
            return own.value(machine.scope)
    return _said(machine, own)


def _begun(machine: Mechanism) -> Any:
    """The motion that is asked for."""
    asked = machine.simulation
    if asked is None:
        return None
    angle = DIMENSIONS["angle"]
    start = {
        body: {k: _worth(machine, v, angle if k == "angle" else None) for k, v in given.items()}
        for body, given in asked.start.items()
    }
    number = DIMENSIONS["number"]
    events = [
        replace(one, restitution=0.0) if isinstance(one, Stop) else one for one in asked.events
    ]
    # a file has two tables, whose order among each other says nothing
    watched = sorted(events, key=lambda one: isinstance(one, Stop))
    given = [
        _worth(machine, one.restitution, number) for one in asked.events if isinstance(one, Stop)
    ]
    until = _worth(machine, asked.until, None)
    return asked.rtol, asked.instants, until, start, watched, given


def whole(machine: Mechanism) -> tuple[Any, ...]:
    """All that it says: every number to the last digit, what follows parameters, the order."""
    following = {
        name: _said(machine, formula)
        for name, formula in machine.formulas.items()
        if machine.parameters.used_by(formula)
    }
    turning = [d for d in machine.drivers if d.angular]
    angles = {name for d in turning for name in (d.name, getattr(d, "body", d.name))}
    asked = [
        {
            name: [_worth(machine, v, DIMENSIONS["angle"] if name in angles else None) for v in row]
            for name, row in at.items()
        }
        for at in (
            machine.ask.at if machine.ask else {},
            *(question.at for question in machine.questions.values()),
        )
    ]
    sought = {
        name: [
            (
                one.name,
                one.unit,
                *(_worth(machine, p, None) for p in (one.start, one.low, one.high)),
            )
            for one in question.unknowns
        ]
        for name, question in machine.questions.items()
    }
    return (
        *(machine.name, machine.units, machine.g, machine.ground, machine.source, machine.note),
        *(machine.bodies, machine.joints, machine.couplings, machine.drivers, machine.loads),
        *({name: _said(machine, value) for name, value in machine.parameters.items()}, following),
        *(machine.measures, machine.ask and replace(machine.ask, at={}), asked, sought),
        _begun(machine),
        {n: replace(q, unknowns="x", at={}) for n, q in machine.questions.items()},
    )
