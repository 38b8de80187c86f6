"""Names that users' programs and files may still have, each with the one that took its place.

No former name works: using one ends in a sentence that says the new one.
"""

from __future__ import annotations

import functools

from mbody.errors import ModelError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, ParamSpec, TypeVar

    P = ParamSpec("P")
    R = TypeVar("R")

#: Public names of the package that have moved, by the module that has them now.
_MOVED = {
    "laws": "Constant ConstantSpeed ConstantAcceleration Polynomial Harmonic Table Rise "
    "Dwell Cam Function",
    "engineering": "close_loops equilibrium_curve linearize momentum",
    "quantities": "deg rpm convert",
    "files.model": "in_units Limits",
    "model.loads": "PistonPressure",
    "model.body": "Guess SecondMoments",
    "makers": "polar",
    "model.element": "Polar",
    "model.simulation": "Measure Question Unknown",
    "engines.mjcf": "to_mjcf",
    "engines.crosscheck": "Crosscheck",
    "errors": "ModelWarning",
    "solution.energy": "Energy",
    "solution.histories": "BodyHistory",
    "analysis.equilibria.equilibrium": "Equilibria",
    "analysis.freedom.mobility": "Mobility",
    "analysis.inverse.conditions": "Answer",
    "analysis.linear.modes": "Modes",
}
_STOPS = (
    "stops are contacts of the mechanism, which are struck and rested on: {}; what only ends a "
    "motion is an event with stop = true"
)
#: What was written, and what is written now.
FORMER = {
    **{f"mbody.{name}": f"mbody.{home}.{name}" for home in _MOVED for name in _MOVED[home].split()},
    "mbody.Ask": "mbody.Instants",
    "mbody.reach": "mbody.driver_range",
    "mbody.members": "mbody.member_forces",
    "mbody.Occurrence": "mbody.EventRecord",
    "mbody.Slender": "mbody.SlenderRod",
    "mbody.RotatingField": "mbody.CentrifugalField",
    "mbody.rotating_field": "mbody.CentrifugalField",
    "mbody.ValvedCylinder": "mbody.ReciprocatingCylinder",
    "mbody.Term": "mbody.CouplingTerm",
    "mbody.Simulation": "mbody.SimulationSettings",
    "mbody.to_text": "mbody.to_toml",
    "mbody.from_text": "mbody.from_toml",
    "Mechanism(inputs=)": 'machine.add(mbody.Input("u", "0 N*m")), an element as others are',
    "simulate(stops=)": _STOPS.format('machine.add(mbody.Stop("floor", "ball.y - 20 mm"))'),
    "[simulate] stops": _STOPS.format('[contacts] floor = { stop = "ball.y - 20 mm" }'),
    "[loads] rotating_field": "centrifugal_field",
    "[loads] valved_cylinder": "reciprocating_cylinder",
}


def former(written: str) -> str | None:
    """The sentence about a former name as it is written in a program or a file; None of others.

    >>> former("mbody.ConstantSpeed")
    'mbody.ConstantSpeed is a former name: now it is mbody.laws.ConstantSpeed'
    """
    now = FORMER.get(written)
    return now and f"{written} is a former name: now it is {now}"


def refuses_former_arguments(call: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function that answers former names of its arguments, in `FORMER` as ``call(name=)``."""
    start = f"{call}("
    known = {key[len(start) : -2]: key for key in FORMER if key.startswith(start)}

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def answering(*args: Any, **options: Any) -> R:
            for name in known.keys() & options.keys():
                raise ModelError(former(known[name]) or name)
            return function(*args, **options)

        return answering

    return decorate
