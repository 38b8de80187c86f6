"""What is located along a motion, and all that a step begins with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mbody.analysis.dynamics.branch_passage import KnownCrossings
from mbody.model.event import Event

__all__ = ["Guard", "LocatedZero", "Saved"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Saved:
    """All that a step begins with."""

    y: Array
    K: Array
    P: Array
    state: Array
    page: Array
    total: Array
    near: Array
    own: tuple[Array, ...]
    passage: KnownCrossings


@dataclass(frozen=True)
class Guard:
    """What is positive as long as a mode of a contact holds.

    Attributes
    ----------
    kind : str
        "close", "lock", "open", "edge", "enter", "slip", "share", "stop" or "paradox".
    number : int
        Of what it guards.
    """

    kind: str
    number: int = 0
    direction: ClassVar[int] = -1
    stop: ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class LocatedZero:
    """A zero that was located, and the motion there."""

    t: float
    event: Event | Guard
    saved: Saved
