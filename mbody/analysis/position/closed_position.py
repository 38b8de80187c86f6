"""A position in which all loops are closed, and what closing them showed."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import close_designs
from mbody.model.body import Guesses
from mbody.model.constraint import Constraint, TurnRow
from mbody.model.element import Element, Marker, Numbers
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.system.rank import Rank


# -- Whole revolutions of a first position: a guess chooses a branch, and not how often a body has
#    rotated ------------------------------------------------------------------------------------
# An angle and the same angle a revolution further are one direction, and a guess means a direction.
# Rows that count whole revolutions (gears, racks, couplings, slides, drivers of an angle) and
# torsion springs tell them apart, so these decide: rows before the loops are closed, springs at the
# closed position, where each is taken within half a revolution of its free angle. Whatever a driver
# or an exact start says is kept as it is said.
#
# The row of two wheels that mesh, n(ψ)·d = 0, is zero half a revolution of ψ further as well, where
# other teeth meet and the multiplier has the other sign. A wheel that only turns about its centre
# is turned to where ψ points from one centre to the other, before the loops are closed and again at
# the closed position: guesses of places may lie on the other side of where ψ is half a revolution
# from its phase, and steps near a singular position may be large.

REVOLUTION = 2.0 * math.pi


class _RotatingGroups:
    """Bodies that only turn together where a whole revolution is counted."""

    def __init__(self, names: list[str]) -> None:
        self.members = {name: {name} for name in names}

    def join(self, *names: str) -> None:
        whole: set[str] = set().union(*(self.members[name] for name in names))
        for name in whole:
            self.members[name] = whole

    def free(self, name: str) -> bool:
        """Whether nothing says how often that body has rotated."""
        return "ground" not in self.members[name]


class _Pose:
    """The guessed pose as elements read it."""

    def __init__(
        self, system: System, pose: np.ndarray, driver_values: Mapping[str, float], at: Numbers
    ) -> None:
        self.system, self.pose, self.given, self.at = system, pose, driver_values, at

    def angle(self, body: str) -> float:
        """Angle of a body [rad]."""
        return float(self.pose[3 * self.system.bodies[body] + 2])

    def place(self, element: Element, field: str) -> tuple[float, float]:
        """World place of an element's marker [length]."""
        x, y, angle = self.pose[3 * self.system.bodies[element.place(field).body] :][:3]
        ax, ay = (float(part) for part in self.at.arm(element, field))
        c, s = math.cos(angle), math.sin(angle)
        return float(x) + c * ax - s * ay, float(y) + s * ax + c * ay


def by_rows(
    system: System, pose: np.ndarray, driver_values: Mapping[str, float], at: Numbers
) -> None:
    """Give the bodies of a guessed pose (coordinates + 3,) the whole revolutions, in place, that
    come nearest to what rows between angles ask; `driver_values` by the name of the driver.
    """
    groups, read = _groups(system), _Pose(system, pose, driver_values, at)
    for element in _counting(system, groups):
        row = element.turn_row(at, read)
        if row is not None:
            _nearest(system, groups, pose, row)
        if element.meshes:
            _mesh(system, groups, read, element)


def other_teeth(
    system: System, pose: np.ndarray, driver_values: Mapping[str, float], at: Numbers
) -> bool:
    """Rotate the wheels of a closed pose, in place, at which other teeth meet than the phase means;
    returns whether there were such.
    """
    if not any(joint.meshes for joint in system.mechanism.joints):
        return False
    groups, read, before = _groups(system), _Pose(system, pose, driver_values, at), pose.copy()
    for element in _counting(system, groups):
        if element.meshes:
            _mesh(system, groups, read, element)
    return not np.array_equal(pose, before)


def by_springs(system: System, poses: np.ndarray) -> None:
    """Take every torsion spring of closed poses (designs, coordinates + 3) within half a revolution
    of its free angle, in place, where nothing else says how often its bodies have rotated.
    """
    for groups, spring in _springs(system):
        twist = _twist(system, spring, poses)
        revolutions = np.round(twist / REVOLUTION)
        if groups.free(spring.body):
            _rotate_group(system, groups, poses, spring.body, -REVOLUTION * revolutions)
        else:
            _rotate_group(system, groups, poses, spring.by, REVOLUTION * revolutions)


def ambiguous(system: System, pose: np.ndarray, driver_values: Mapping[str, float]) -> list[str]:
    """A sentence for each torsion spring whose turn the position does not tell for sure."""
    found = []
    beyond_revolution = [
        d.name
        for d in system.drivers
        if d.angular and abs(driver_values.get(d.name, 0.0)) > REVOLUTION
    ]
    for _, spring in _springs(system):
        twist = float(_twist(system, spring, pose[None])[0])
        if abs(twist) > math.pi - tol.SPRING_HALF_TURN:
            found.append(
                f"torsion spring '{spring.name}' is half a turn from its free angle, {twist:.6g} "
                "rad: whether it is wound up one way or the other is not certain; say the angle "
                "in simulate's start, or choose another free angle"
            )
        elif beyond_revolution:
            found.append(
                f"torsion spring '{spring.name}' is taken within half a turn of its free angle, "
                f"at a twist of {math.degrees(twist):.6g} deg, though '{beyond_revolution[0]}' has "
                "turned by "
                "more than a turn before: begin at t = 0 to have the turns counted"
            )
    return found


def _groups(system: System) -> _RotatingGroups:
    return _RotatingGroups([*(body.name for body in system.mechanism.bodies), "ground"])


def _counting(system: System, groups: _RotatingGroups) -> Iterator[Constraint]:
    """Elements whose rows count revolutions, those that bind two bodies to one angle first; each
    joins its bodies once it has been looked at.
    """
    machine = system.mechanism
    joints = sorted(machine.joints, key=lambda joint: not joint.parallel)
    for element in (*machine.drivers, *joints, *machine.couplings):
        if element.counts_turns:
            yield element
            groups.join(*element.turn_bodies())


def _springs(system: System) -> Iterator[tuple[_RotatingGroups, Any]]:
    """Torsion springs between bodies of which nothing says how often they have rotated, each with
    the groups as the springs before it leave them.
    """
    springs: list[Any] = [load for load in system.mechanism.loads if load.by_angle and load.free]
    if not springs:
        return
    groups = _groups(system)
    for _ in _counting(system, groups):
        pass  # each joins its bodies
    for spring in springs:
        if groups.members[spring.body] is not groups.members[spring.by]:
            yield groups, spring
            groups.join(spring.body, spring.by)


def _twist(system: System, spring: Any, poses: np.ndarray) -> np.ndarray:
    """θ − θ₀ of a spring, (designs,)."""
    free = np.asarray(system.values[f"{spring.name}.{spring.free}"])
    angle = poses[:, 3 * system.bodies[spring.body] + 2]
    twist: np.ndarray = angle - poses[:, 3 * system.bodies[spring.by] + 2] - free
    return twist


def _rotate_group(
    system: System, groups: _RotatingGroups, poses: np.ndarray, name: str, angle: Any
) -> None:
    """Rotate a whole group by angles (designs,) [rad]."""
    for body in groups.members[name]:
        poses[:, 3 * system.bodies[body] + 2] += angle


def _nearest(system: System, groups: _RotatingGroups, pose: np.ndarray, row: TurnRow) -> None:
    """Rotate the last free group of a row so that least is left of it."""
    for name in reversed(row.factors):
        if groups.free(name):
            own = [c for body, c in row.factors.items() if body in groups.members[name]]
            factor = float(sum(own))
            if abs(factor) > tol.FACTOR_CANCELS * sum(abs(float(c)) for c in own):
                revolutions = np.round(float(row.left) / (REVOLUTION * factor))
                _rotate_group(system, groups, pose[None], name, -REVOLUTION * revolutions)
            return


def _mesh(system: System, groups: _RotatingGroups, read: _Pose, pair: Constraint) -> None:
    """Rotate the last free wheel of a pair whose ψ is nearer to the opposite direction."""
    row = pair.turn_row(read.at, read)
    if row is None or abs(float(row.left)) <= 0.25 * REVOLUTION:
        return
    for name in reversed(row.factors):
        whole = groups.members[name]
        factor = float(sum(c for body, c in row.factors.items() if body in whole))
        if factor and groups.free(name) and all(_is_wheel(system, read.at, one) for one in whole):
            _rotate_group(system, groups, read.pose[None], name, -float(row.left) / factor)
            return


def _is_wheel(system: System, at: Numbers, body: str) -> bool:
    """Whether joints hold a body at one place only, about which it may turn in any position."""
    positions = []
    for joint in system.mechanism.joints:
        if body in joint.bodies and joint.rows:
            if not joint.lets_turn(body):
                return False
            side = "ij"[joint.bodies.index(body)]
            positions.append([float(part) for part in at.arm(joint, side)])
    return bool(np.ptp(positions, axis=0).max() <= tol.POINT_SAME * system.length)


@dataclass
class ClosedPosition:
    """A closed position with what was found on the way.

    `work`: Workspace at the position, its factor valid.
    `regularization`: Proximal term for the rows: zero unless some are redundant.
    `ratio`: Least pivot as a part of its diagonal.
    `straight`: Whether the path from the guess led straight there, without a singular position.
    `rank`: Rank report, where one was made.
    `notes`: Sentences for the user.
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
    if system.has_user_code:
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
# The numbers go λ of the way, 0 ≤ λ ≤ 1, and the closed position goes along (homotopy; Allgower and
# Georg, *Introduction to Numerical Continuation Methods*, 2003). A stage that moves a body far, or
# does not close, is halved, so that the branch is kept: a path that ends at a singular position has
# none for that design. All designs that are still on their way take a stage in one call.

#: The first stage, as a part of the way.
FIRST = 0.25


@dataclass(frozen=True, eq=False)
class ClosedDesigns:
    """First positions of many designs.

    `poses` (designs, coordinates + 3): Where they closed, or where their path ended.
    `good` (designs,): Whether they closed, away from singular positions.
    `progress` (designs,): How much of the path in the numbers closes, 1 of all.
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
    good &= system.extent(poses - pose) <= tol.BRANCH_LEAP
    progress = np.where(good, 1.0, 0.0)
    open_designs = np.flatnonzero(~good)
    if len(open_designs):
        stages = _Stages(system, t, values[open_designs], (origin, open_designs), small, least)
        poses[open_designs], progress[open_designs] = stages.all(pose)
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
        """Ends of the paths, (designs, coordinates + 3), and how far they come, (designs,)."""
        count = len(self.values)
        poses, progress, stage = np.tile(pose, (count, 1)), np.zeros(count), np.full(count, FIRST)
        derivative = np.zeros_like(poses)
        # of the first stage nothing foretells where it leads
        begun = np.zeros(count, dtype=bool)
        active = np.arange(count)
        while len(active):
            to = np.minimum(progress[active] + stage[active], 1.0)
            step = (to - progress[active])[:, None]
            found, closes = self._closed(active, to, poses[active])
            moved = found - poses[active]
            bent = self.system.extent(moved - step * derivative[active])
            straight = self.system.extent(moved) + self.system.extent(step * derivative[active])
            kept = closes & (self.system.extent(moved) <= tol.BRANCH_LEAP)
            kept &= (
                ~begun[active]
                | (bent <= tol.STAGE_BENT * straight)
                | (straight <= tol.STAGE_STRAIGHT)
            )
            on = active[kept]
            poses[on], derivative[on], begun[on] = found[kept], (moved / step)[kept], True
            progress[on] = to[kept]
            stage[on] *= 2.0
            stage[active[~kept]] *= 0.5
            active = active[(progress[active] < 1.0) & (stage[active] >= tol.STAGE_LEAST)]
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
    rotation = q[3 * system.bodies[marker.body] + 2]
    return float(rotation + system.numbers.angle(element, side))


# -- Distances that become zero: there a row of Φ_q, a unit vector along the distance, has none


def vanishing(
    system: System, q: np.ndarray, when: str, close: float = tol.DISTANCE_SMALL
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
