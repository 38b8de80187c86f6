"""A position in which all loops are closed, and what closing them showed."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.position.whole_turns import by_springs
from mbody.core.tolerances import (
    BRANCH_LEAP,
    DISTANCE_SMALL,
    STAGE_BENT,
    STAGE_LEAST,
    STAGE_STRAIGHT,
)
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import close_designs
from mbody.model.body import Guesses
from mbody.model.element import Element, Marker
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.system.rank import Rank


@dataclass
class ClosedPosition:
    """A closed position with what was found on the way.

    Attributes
    ----------
    work : Work
        Workspace at the position, its factor valid.
    regularization : float
        Proximal term for the rows: zero unless some are redundant.
    ratio : float
        Least pivot as a part of its diagonal.
    straight : bool
        Whether the path from the guess led straight there, without a singular position.
    rank : Rank or None
        Rank report, where one was made.
    notes : list of str
        Sentences for the user.
    """

    work: Work
    regularization: float = 0.0
    ratio: float = 1.0
    straight: bool = True
    rank: Rank | None = None
    notes: list[str] = field(default_factory=list)


# -- Kept first positions: equal numbers, guesses and driver values close alike ----------------
#    motion ------------------------------------------------------------------------------------

#: Positions that a system keeps, the last ones.
KEPT = 16


def position_key(
    system: System, t: float, driver_values: Mapping[str, float], guess: Guesses | None
) -> Hashable | None:
    """Key of a first position beside the system; None where the position may differ each time, with
    functions of the user, or cannot be compared.
    """
    if system.batch is not None or system.has_user_code:
        return None
    key = (t, *driver_values.items()), tuple((guess or {}).items())
    try:
        hash(key)
    except TypeError:  # a guess that is a list or an array
        return None
    return key


def kept_position(system: System, key: Hashable | None) -> ClosedPosition | None:
    """The position that was kept by that key, in a workspace of its own."""
    found = None if key is None else system.closed_positions.get(key)
    if found is None:
        return None
    return ClosedPosition(
        found.work.copied(), found.regularization, found.ratio, found.straight, found.rank
    )


def keep_position(system: System, key: Hashable | None, found: ClosedPosition) -> None:
    """Keep a position; one of which something was said is not kept, so that it is said again."""
    if key is None or found.notes:
        return
    positions = system.closed_positions
    # of a list, which is made at once: other threads may keep positions meanwhile
    for old in list(positions)[: max(len(positions) - KEPT + 1, 0)]:
        positions.pop(old, None)
    positions[key] = ClosedPosition(
        found.work.copied(), found.regularization, found.ratio, found.straight, found.rank
    )


# -- Many designs closed at once: in one call of the kernels, or in stages from a closed one ---


def close_batch(
    system: System, t: float, values: np.ndarray, poses: np.ndarray, small: Any, least: float
) -> np.ndarray:
    """Close every design of a batch at time t; which of them are closed, away from singular
    positions: (designs,). `values` (designs, drivers), NaN where a law gives them; `poses`
    (designs, coordinates + 3); `small` in model lengths and radians.
    """
    work, state = system.work(), np.empty((len(poses), 2))
    work.time[:] = t
    close_designs(system.layout, work, np.full(len(poses), small), system.par, values, poses, state)
    by_springs(system, poses)
    closes, pivot = state.T
    return np.asarray((closes > 0.0) & (pivot >= least))


# -- Designs far from a closed position, closed in stages: from its numbers straight to each
#    design's ----------------------------------------------------------------------------------
#
# The numbers go λ of the way, 0 ≤ λ ≤ 1, and the closed position goes along (homotopy; Allgower and
# Georg, *Introduction to Numerical Continuation Methods*, 2003). A stage that moves a body far, or
# does not close, is halved, so that the branch is kept: a path that ends at a singular position has
# none for that design. All designs that are still on their way take a stage in one call.

#: The first stage, as a part of the way.
FIRST = 0.25


@dataclass(frozen=True, eq=False)
class ClosedDesigns:
    """First positions of many designs.

    Attributes
    ----------
    poses : array (designs, coordinates + 3)
        Where they closed, or where their path ended.
    good : array (designs,)
        Whether they closed, away from singular positions.
    progress : array (designs,)
        How much of the path in the numbers closes, 1 of all.
    """

    poses: np.ndarray
    good: np.ndarray
    progress: np.ndarray


def close_in_stages(
    system: System,
    t: float,
    values: np.ndarray,
    pose: np.ndarray,
    origin: np.ndarray,
    small: float,
    least: float,
) -> ClosedDesigns:
    """Close every design of a batch at time t, on the branch of one closed position. `values`
    (designs, drivers), `pose` (coordinates + 3,), `origin` (parameters,).
    """
    poses = np.tile(pose, (len(values), 1))
    good = close_batch(system, t, values, poses, small, least)
    good &= system.extent(poses - pose) <= BRANCH_LEAP
    progress = np.where(good, 1.0, 0.0)
    far = np.flatnonzero(~good)
    if len(far):
        stages = _Stages(system, t, values[far], (origin, far), small, least)
        poses[far], progress[far] = stages.all(pose)
        by_springs(system, poses)
    return ClosedDesigns(poses, progress == 1.0, progress)


class _Stages:
    """Designs on their way from the same numbers."""

    def __init__(
        self,
        system: System,
        t: float,
        values: np.ndarray,
        numbers: tuple[np.ndarray, np.ndarray],
        small: float,
        least: float,
    ) -> None:
        origin, designs = numbers
        self.system, self.values, self.small, self.least = system, values, small, least
        self.origin, self.goal = origin[:, None], system.par[:, designs]
        self.work = system.work()
        self.work.time[:] = t

    def all(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the paths end, (designs, coordinates + 3), and how far they come, (designs,)."""
        count = len(self.values)
        poses, progress, stage = np.tile(pose, (count, 1)), np.zeros(count), np.full(count, FIRST)
        slope = np.zeros_like(poses)
        # of the first stage nothing foretells where it leads
        begun = np.zeros(count, dtype=bool)
        active = np.arange(count)
        while len(active):
            to = np.minimum(progress[active] + stage[active], 1.0)
            step = (to - progress[active])[:, None]
            found, closes = self._closed(active, to, poses[active])
            moved = found - poses[active]
            bent = self.system.extent(moved - step * slope[active])
            straight = self.system.extent(moved) + self.system.extent(step * slope[active])
            kept = closes & (self.system.extent(moved) <= BRANCH_LEAP)
            kept &= ~begun[active] | (bent <= STAGE_BENT * straight) | (straight <= STAGE_STRAIGHT)
            on = active[kept]
            poses[on], slope[on], begun[on] = found[kept], (moved / step)[kept], True
            progress[on] = to[kept]
            stage[on] *= 2.0
            stage[active[~kept]] *= 0.5
            active = active[(progress[active] < 1.0) & (stage[active] >= STAGE_LEAST)]
        return poses, progress

    def _closed(
        self, active: np.ndarray, to: np.ndarray, poses: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Some designs closed at their next stage, and which of them are."""
        goal = self.goal[:, active]
        between = np.where(to < 1.0, self.origin + to * (goal - self.origin), goal)
        par = np.ascontiguousarray(between)
        found, state = poses.copy(), np.empty((len(active), 2))
        small = np.full(len(active), self.small)
        values = np.ascontiguousarray(self.values[active])
        close_designs(self.system.layout, self.work, small, par, values, found, state)
        closes, pivot = state.T
        moved: Any = self.system.extent(found - poses)
        return found, (closes > 0.0) & (pivot >= self.least) & np.isfinite(moved)


# -- Positions of the points of joints, and directions of their axes ---------------------------


def place(system: System, q: np.ndarray, element: Element, side: str) -> np.ndarray:
    """World place (2,) of the end `side` ("i" or "j") of an element, by the system's numbers. `q`
    (coordinates + 3,), angles in rad.
    """
    marker = element.place(side)
    x, y, angle = q[3 * system.bodies[marker.body] :][:3]
    ax, ay = system.numbers.arm(element, side)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([x + c * ax - s * ay, y + s * ax + c * ay], dtype=float)


def direction(system: System, q: np.ndarray, element: Element, side: str) -> float:
    """Angle [rad] of the marker's x axis at the end `side` of an element, from the world's."""
    marker: Marker = getattr(element, side)
    turned = q[3 * system.bodies[marker.body] + 2]
    return float(turned + system.numbers.angle(element, side))


# -- Distances that become zero: there a row of Φ_q, a unit vector along the distance, has none


def vanishing(
    system: System, q: np.ndarray, when: str, close: float = DISTANCE_SMALL
) -> SolveError | None:
    """The sentence of a motion that cannot go on since a distance becomes zero; None where none
    does. `q` (coordinates,).

    Such as "t = 2 s".
    """
    whole = np.append(q[: system.coordinates], np.zeros(3))
    found = [
        (
            math.dist(place(system, whole, element, i), place(system, whole, element, j)),
            element,
            i,
            j,
        )
        for element, i, j in _distances(system)
    ]
    if not found:
        return None
    least, element, i, j = min(found, key=lambda one: one[0])
    if not least < close * system.length:
        return None
    bodies = " and ".join(f"'{element.place(side).body}'" for side in (i, j))
    unit = system.mechanism.units.length
    return SolveError(
        f"the motion cannot go on at {when}: the distance that '{element.name}' measures between "
        f"{bodies} comes down to {least:.2g} {unit}, and at 0 it has no direction; "
        "stop before, or move one of its places aside",
        element.name,
    )


def _distances(system: System) -> Iterator[tuple[Element, str, str]]:
    """Elements that keep or count distances, with the names of both ends."""
    machine = system.mechanism
    for element in (*machine.joints, *machine.drivers, *machine.couplings):
        for i, j in element.distances():
            yield element, i, j
