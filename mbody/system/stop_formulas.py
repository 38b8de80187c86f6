"""Coordinates of stops with their derivatives, as rows over the bodies that they measure.

Of a coordinate g(q, t) the row is Φ = g, with Φ_q = g_q, ν = −∂g/∂t and γ = −d²g/dt² at a = 0.
"""

from __future__ import annotations

from mbody.errors import ModelError
from mbody.model.element import Numbers
from mbody.model.mechanism import Mechanism
from mbody.model.stop import Stop
from mbody.system.driver_formulas import DriverFormula
from mbody.system.formula_derivatives import (
    Differentiated,
    NotSmooth,
    along_motion,
    by_coordinate,
    by_time,
)
from mbody.system.formula_steps import Recorded, record_formula

__all__ = ["recorded_stop"]


def recorded_stop(stop: Stop, machine: Mechanism, at: Numbers) -> DriverFormula:
    """The coordinate of a stop, recorded.

    Raises
    ------
    ModelError
        For a coordinate that jumps, or has a corner without a second derivative.
    """
    signal = at.law(stop, "gap")
    steps = record_formula(signal.law, signal.parameters, machine, at)  # type: ignore[arg-type]
    gap = Recorded(steps, steps.value)
    read = {steps.steps[place] for place in steps.needed([gap.place])}
    named = {str(what[1]) for what in read if what[0] in ("position", "turn")}
    bodies = tuple(body.name for body in machine.bodies if body.name in named)

    def none(state: str) -> Recorded:
        raise AssertionError(stop.name, state)  # refused when it was described

    def zero_or(one: Recorded | None, factor: float) -> int:
        if one is None:
            return steps.number(0.0).place
        return (steps.number(factor) * one).place

    along, still = Differentiated(steps, along_motion(none)), Differentiated(steps, by_time(none))
    try:
        rate = still.of(gap)
        second = along.of(along.of(gap))
        gradient = {
            (body, axis): zero_or(Differentiated(steps, by_coordinate(body, axis)).of(gap), 1.0)
            for body in bodies
            for axis in range(3)
        }
    except NotSmooth as error:
        raise ModelError(
            f"stop '{stop.name}': '{stop.of}' has no second derivative by its {error}: use smooth "
            "functions, or Tables of one variable",
            stop.name,
        ) from None
    return DriverFormula(
        steps,
        gap.place,
        zero_or(rate, -1.0),
        zero_or(second, -1.0),
        follows=bodies,
        phi=gap.place,
        gradient=gradient,
        explicit=rate is not None,
    )
