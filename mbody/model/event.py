"""Events along a motion: zero crossings of measured quantities."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from mbody.errors import ModelError, brief
from mbody.quantities import FormulaError, read

__all__ = ["Event", "as_events"]


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
        _named(self)
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


def _named(event: Event) -> None:
    """Refuse texts that are none, and formulas that cannot be read."""
    for key in ("of", "name"):
        if not isinstance(getattr(event, key), str):
            raise ModelError(f"event: {key} must be text, not {brief(getattr(event, key))}")
    try:
        read(event.of, None)
    except FormulaError as error:
        raise ModelError(f"event '{event.name or event.of}': {error}") from None
    object.__setattr__(event, "name", event.name or event.of)


def as_events(given: Any) -> tuple[Event, ...]:
    """Events as a tuple, each name once.

    Raises
    ------
    ModelError
        For what is none, or a name given twice.
    """
    found = tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    for one in found:
        if not isinstance(one, Event):
            raise ModelError(f"events takes a list of Event, not {brief(one)}")
    names = [one.name for one in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ModelError(f"'{twice[0]}' names two events: give each its own name")
    return found
