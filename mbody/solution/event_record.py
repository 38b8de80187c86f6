"""Events of a motion: what happened, and when."""

from __future__ import annotations

from dataclasses import dataclass, field

from mbody.solution.result import Result

__all__ = ["EventRecord"]


@dataclass(frozen=True, eq=False)
class EventRecord:
    """What has happened along a motion, and when.

    Attributes
    ----------
    name : str
        Of the event or stop.
    t : float
        When.
    state : Solution
        The one instant, of an impact just before it.
    after : Solution or None
        Of an impact, the same instant just after it.
    """

    name: str
    t: float
    state: Result = field(repr=False)
    after: Result | None = field(default=None, repr=False)
