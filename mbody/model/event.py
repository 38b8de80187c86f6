"""Events along a motion: zero crossings of measured quantities, stops that are hit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from mbody.errors import ModelError, brief
from mbody.quantities import Formula, FormulaError, read
from mbody.quantities.number import float_or_formula
from mbody.quantities.types import NumberField, default

__all__ = ["Event", "Stop", "as_events", "check_restitution"]


@dataclass(frozen=True)
class Event:
    """Zero crossing of a measured quantity, found along a motion and recorded.

    Parameters
    ----------
    of : str
        What is to be zero: a formula of histories as of `Measure`, such as ``"crank.omega"``,
        ``"A.fy"`` or ``"ball.y - 0.5 m"``, or one of the mechanism's measures by its name.
    direction : int
        1 where it rises through zero only, −1 where it falls, 0 either way.
    stop : bool
        Whether the motion ends there.
    name : str
        By default `of`.

    Notes
    -----
    Watching does not change the motion, to the last bit, as long as it does not end it.

    Examples
    --------
    >>> Event("bob.omega", direction=-1).name
    'bob.omega'
    """

    of: str
    direction: int = 0
    stop: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        _named(self, "event")
        if self.direction not in (-1, 0, 1) or isinstance(self.direction, bool):
            raise ModelError(
                f"event '{self.name}': direction is {brief(self.direction)}: give 1 (rising), -1 "
                "(falling) or 0 (both)",
                self.name,
            )
        if not isinstance(self.stop, bool):
            raise ModelError(
                f"event '{self.name}': stop must be true or false, not {brief(self.stop)}",
                self.name,
            )


@dataclass(frozen=True)
class Stop:
    """A unilateral stop with restitution: a coordinate that cannot fall below zero (impact).

    v⁺ = v⁻ − (1 + e) ġ⁻ u / (c u), c = ∂g/∂q, u the part of M⁻¹ cᵀ that the joints allow, so that
    ġ⁺ = −e ġ⁻ (Newton's restitution) and Φ_q v = ν on both sides.

    Parameters
    ----------
    of : str
        The coordinate g ≥ 0: a formula of x, y and angle of bodies and points, and of t where the
        stop moves, such as ``"ball.y - 20 mm"`` or ``"1 rad - arm.angle"``.
    restitution : float or str
        e, from 0 (no rebound) to 1 (no loss).
    name : str
        By default `of`.

    Notes
    -----
    Impacts are frictionless and last no time. Where they come faster than can be resolved what
    strikes comes to rest on the stop, and the motion ends there.

    Examples
    --------
    >>> Stop("ball.y", restitution=0.8, name="floor").restitution
    0.8
    """

    of: str
    restitution: NumberField = default(0.0)
    name: str = ""

    def __post_init__(self) -> None:
        _named(self, "stop")
        try:
            given = float_or_formula(self.restitution, None)
        except FormulaError as error:
            raise ModelError(f"stop '{self.name}': restitution: {error}", self.name) from None
        if not isinstance(given, Formula):
            check_restitution(given, self.name)
        object.__setattr__(self, "restitution", given)


def _named(event: Event | Stop, what: str) -> None:
    """Refuse texts that are none, and formulas that cannot be read."""
    for key in ("of", "name"):
        if not isinstance(getattr(event, key), str):
            raise ModelError(f"{what}: {key} must be text, not {brief(getattr(event, key))}")
    try:
        read(event.of, None)
    except FormulaError as error:
        raise ModelError(f"{what} '{event.name or event.of}': {error}") from None
    object.__setattr__(event, "name", event.name or event.of)


def check_restitution(value: float, name: str) -> None:
    """Refuse a coefficient that gives energy, or turns the rebound round.

    Raises
    ------
    ModelError
    """
    if not 0.0 <= value <= 1.0:
        raise ModelError(f"stop '{name}': restitution is {value:g}: give 0 to 1", name)


def as_events(given: Any) -> tuple[Event | Stop, ...]:
    """Events and stops as a tuple, each name once.

    Raises
    ------
    ModelError
        For what is none, or a name given twice.
    """
    found = tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    for one in found:
        if not isinstance(one, Event | Stop):
            raise ModelError(f"events takes a list of Event and Stop, not {brief(one)}")
    names = [one.name for one in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ModelError(f"'{twice[0]}' names two events: give each its own name")
    return found
