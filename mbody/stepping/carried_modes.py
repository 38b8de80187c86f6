"""What a motion with contacts, ropes and rough joints carries on besides its state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.dynamics.located import Guard
from mbody.analysis.dynamics.modal_motion import SharedForces

__all__ = ["CarriedModes"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class CarriedModes:
    """What a motion with modes carries on besides its state.

    Attributes
    ----------
    modes, pairs : tuples of str
        Of the touches and of the rough joints.
    first : dict
        Mode of every contact and rough joint when the motion began, by name.
    rows : tuple of arrays
        Which rows are on, with what depends on it, their anchors, senses of sliding, and the
        numbers of the rows, among which are the phases of circles that stick.
    groups : dict
        Touches that stick by one row.
    shared : SharedForces or None
        What sticks with forces that no equation decides.
    struck : dict
        When touches were struck last.
    beyond : frozenset
        Open touches that have left their edge.
    closed : frozenset
        Touches that are closed.
    guards : tuple of Guard
        What is watched.
    fresh : dict
        Guards that begin at zero, and what is taken for a little more.
    changes : pair
        When modes changed last, and how often at that instant.
    notes : tuple of str
    lost : array (contacts,)
        Energy that impacts of each took.
    """

    modes: tuple[str, ...]
    pairs: tuple[str, ...]
    first: dict[str, str]
    rows: tuple[Array, ...]
    groups: dict[int, list[int]]
    shared: SharedForces | None
    struck: dict[int, float]
    beyond: frozenset[int]
    closed: frozenset[int]
    guards: tuple[Guard, ...]
    fresh: dict[Guard, float]
    changes: tuple[float, int]
    notes: tuple[str, ...]
    lost: Array
