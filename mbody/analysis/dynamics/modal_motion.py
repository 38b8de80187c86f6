"""What the decision of modes and their guards need of a motion: a protocol, and what events say."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral
from mbody.analysis.dynamics.located import Guard
from mbody.kernels.layout import Layout, Work
from mbody.system.system import System

__all__ = ["Closing", "ModalMotion", "Reserve", "SharedForces"]

Array = np.ndarray


@dataclass
class Closing:
    """What an event has just decided, where complementarity is at its limit.

    Attributes
    ----------
    closed : set of int
        Touches that are closed, though their gap is rounding.
    opened : set of int
        Touches that open.
    sliding : dict
        Senses of what begins to slide, by the number of the touch or, after these, of the rough
        joint.
    stopped : set of int
        What ceases to slide, likewise.
    """

    closed: set[int] = field(default_factory=set)
    opened: set[int] = field(default_factory=set)
    sliding: dict[int, float] = field(default_factory=dict)
    stopped: set[int] = field(default_factory=set)


@dataclass(frozen=True)
class Reserve:
    """How far forces that no equation decides are from their limits.

    Attributes
    ----------
    least : float
        The greatest reserve that all can have [force].
    sliding : dict
        The senses in which what has no more would slide, by the number of the touch or, after
        these, of the rough joint.
    opened : set of int
        Touches that would open.
    """

    least: float
    sliding: dict[int, float]
    opened: set[int]


class SharedForces(Protocol):
    """Forces of what sticks that no equation decides (`mbody.analysis.dynamics.shared_friction`).

    Attributes
    ----------
    members : frozenset of int
        What sticks, touches and, after these, rough joints, whose forces are open.
    pressing : frozenset of int
        Touches whose normal forces are open.
    """

    @property
    def pressing(self) -> frozenset[int]:
        """See above."""

    @property
    def parts(self) -> tuple[tuple[int, ...], ...]:
        """All of it, to be kept."""

    @property
    def members(self) -> frozenset[int]:
        """See above."""

    def reserve(self, motion: ModalMotion, page: Array, work: Work) -> Reserve:
        """The greatest reserve by a page (rows,), with the rows of that position."""


class ModalMotion(Protocol):
    """A motion with rows that can be on or off.

    Attributes
    ----------
    uni : Unilateral
        Its touches and rough joints.
    modes, pairs : lists of str
        Their modes.
    closing : Closing
    groups : dict
        Touches that stick by the row of one of them, by its number.
    shared : SharedForces, optional
        What sticks with forces that no equation decides.
    beyond : set of int
        Open touches that have left their edge over its end.
    guards : list of Guard
        What is watched.
    fresh : dict
        What is rounding of guards that began at zero.
    y, K, page, scale : arrays
        State, derivatives, what is kept of the instant, sizes of the coordinates.
    work, probe : Work
        That of the steps, and one to look at other positions.
    """

    system: System
    layout: Layout
    uni: Unilateral
    modes: list[str]
    pairs: list[str]
    closing: Closing
    groups: dict[int, list[int]]
    shared: SharedForces | None
    beyond: set[int]
    guards: list[Guard]
    fresh: dict[Guard, float]
    y: Array
    K: Array
    page: Array
    scale: Array
    work: Work
    probe: Work

    @property
    def speed(self) -> float:
        """The swiftest motion in model lengths a time."""

    @property
    def near(self) -> float:
        """Gaps up to this are none [length]."""

    def load(self) -> None:
        """The present state into the workspace."""

    def evaluate(self) -> bool:
        """Project the state, evaluate its derivative and its page."""

    def set_modes(self, modes: list[str], pairs: list[str], on: Array, held: Array) -> None:
        """Set the modes, and which rows of touches and rough joints are on."""
