"""A position in which all loops are closed, and what closing them showed."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import close_designs, violation
from mbody.model.body import Body, Guess, Guesses, as_guess
from mbody.model.driver import Constraint, TurnRow
from mbody.model.element import Element, Marker, Numbers
from mbody.model.joints import Joint
from mbody.quantities.formula import evaluated
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.system.rank import Rank


#: Rows up to which the smallest gap of loops is looked for: a second or two in all.
SEARCHED = 60


def violations(system: System, work: Work) -> np.ndarray:
    """Size of every row of Φ at the position in the workspace, lengths by the model length."""
    primitive, row, is_angle = system.row_table
    violation(system.runtime(), work)
    phi = np.abs(work.phi[2 * system.layout.primitive_node[primitive] + row, 0])
    return np.where(is_angle, phi, phi / system.length)


# -- A first pose of every body: what a rough guess leaves out, neighbours and drivers fill in -

Pose = tuple[float, float, float]


def placed(
    system: System,
    guess: Guesses | None,
    driver_values: Mapping[str, float],
    shaken: np.random.Generator | None = None,
    numbers: Numbers | None = None,
    *,
    loose: np.random.Generator | None = None,
    oriented: bool = False,
) -> np.ndarray:
    """Poses of all mass centres, ground last: (3·bodies + 3,). `guess` by body: an angle [rad], (x,
    y, angle) or `Guess`.
    """
    own = system.numbers if numbers is None else numbers
    placing = _Placing(system, guess or {}, driver_values, shaken, own)
    placing.loose, placing.oriented = loose, oriented
    return placing.coordinates()


def unguessed(
    system: System, guess: Guesses | None, driver_values: Mapping[str, float]
) -> tuple[str, ...]:
    """Names of the bodies of whose angle neither a guess nor a driver nor a joint to a placed body
    says anything; `placed` leaves their link axes parallel to those of the ground.
    """
    machine = system.mechanism
    known = {name for driver in machine.drivers for name in driver.bodies} | set(guess or {})
    for joint in machine.joints:
        if joint.parallel:
            known |= {joint.i.body, joint.j.body}
    if all(body.guess.angle is not None or body.name in known for body in machine.bodies):
        return ()
    placing = _Placing(system, guess or {}, driver_values, None, system.numbers)
    placing.coordinates()
    return tuple(placing.unknown)


class _Placing:
    def __init__(
        self,
        system: System,
        guess: Guesses,
        driver_values: Mapping[str, float],
        shaken: np.random.Generator | None,
        numbers: Numbers,
    ) -> None:
        self.system = system
        self.shaken = shaken
        self.loose: np.random.Generator | None = None
        self.oriented = False
        # bodies of whose angle nothing is known
        self.unknown: list[str] = []
        self.mechanism = system.mechanism
        self.at = numbers
        for name in guess:
            if self.mechanism[name].role != "body":
                raise ModelError(f"a guess is for bodies, '{name}' is none", name)
        self.guess: dict[str, Guess] = {
            body.name: self._guess(body, guess[body.name]) if body.name in guess else body.guess
            for body in self.mechanism.bodies
        }
        self.poses: dict[str, Pose] = {"ground": (0.0, 0.0, 0.0)}
        # of every body: the other body of an angle driver, and its angle from it
        self.driven: dict[str, list[tuple[str, float, float]]] = {}
        for driver in self.mechanism.drivers:
            if driver.angular and driver.name in driver_values:
                i, j = driver.bodies
                self.driven.setdefault(j, []).append((i, 1.0, driver_values[driver.name]))
                self.driven.setdefault(i, []).append((j, -1.0, driver_values[driver.name]))

    def _guess(self, body: Body, value: Any) -> Guess:
        """The caller's guess of a body, with floats for text."""
        scope = self.mechanism.parameters.scope()
        made: Guess = evaluated(as_guess(value, body.name), scope, body.name, "guess")
        return made

    def coordinates(self) -> np.ndarray:
        bodies = self.mechanism.bodies
        touching: dict[str, list[Joint]] = {"ground": [], **{body.name: [] for body in bodies}}
        for joint in self.mechanism.joints:
            touching[joint.i.body].append(joint)
            touching[joint.j.body].append(joint)
        # bodies that hang on a placed one, pins and known angles first, else in order
        waiting = [(9, n, n, body.name) for n, body in enumerate(bodies)]
        heapq.heapify(waiting)
        hangs: dict[int, Joint] = {}
        count = len(bodies)
        newly = ["ground"]
        while waiting:
            for here in newly:
                for joint in touching[here]:
                    other = joint.j.body if joint.i.body == here else joint.i.body
                    if other not in self.poses:
                        count += 1
                        hangs[count] = joint
                        heapq.heappush(waiting, (self._rank(other, joint), count, count, other))
            _, _, key, name = heapq.heappop(waiting)
            newly = []
            if name not in self.poses:
                self.poses[name] = self._pose(name, hangs.get(key))
                newly = [name]
        result = np.zeros(3 * len(bodies) + 3)
        for n, body in enumerate(bodies):
            x, y, angle = self.poses[body.name]
            cx, cy = self.at.point(f"{body.name}.cg")
            c, s = math.cos(angle), math.sin(angle)
            result[3 * n : 3 * n + 3] = x + c * cx - s * cy, y + s * cx + c * cy, angle
        return result

    def _rank(self, name: str, joint: Joint) -> int:
        """Pins before slides, known angles before unknown ones."""
        rank = 0 if joint.coincident else 2
        return rank + (self._angle(name, joint) is None)

    def _angle(self, name: str, joint: Joint | None) -> float | None:
        """Angle of a body: driven, bound by the joint, guessed; None if nothing is known."""
        for other, sign, value in self.driven.get(name, ()):
            if other in self.poses:
                return self.poses[other][2] + sign * value
        if joint is not None and joint.parallel:
            beta = float(self.at.angle(joint, "j")) - float(self.at.angle(joint, "i"))
            if joint.j.body == name:
                return self.poses[joint.i.body][2] - beta
            return self.poses[joint.j.body][2] + beta
        return self.guess[name].angle

    def _pose(self, name: str, joint: Joint | None) -> Pose:
        guess = self.guess[name]
        known = self._angle(name, joint)
        angle = known or 0.0
        if known is None:
            self.unknown.append(name)
            random = self.shaken or self.loose
            if random is not None:
                angle = random.uniform(-math.pi, math.pi)
            elif self.oriented and joint is not None:
                angle = self._aim(name, joint, guess)
        x, y, angle = self._hung(name, joint, guess, angle)
        if self.shaken is None:
            return x, y, angle
        size = self.system.length * (1.0 if joint is not None and joint.slide else 0.1)
        off = self.shaken.normal(size=3)
        return x + size * off[0], y + size * off[1], angle + 0.3 * off[2]

    def _aim(self, name: str, joint: Joint, guess: Guess) -> float:
        """Angle at which a second pin of a body points to its place on a placed body; else 0."""
        own = "j" if joint.j.body == name else "i"
        x, y, _ = self._hung(name, joint, guess, 0.0)
        hx, hy = self._local(joint, own)
        for other in self.mechanism.joints:
            side, other_side = ("j", "i") if other.j.body == name else ("i", "j")
            if other is joint or not other.pin:
                continue
            if (
                getattr(other, side).body != name
                or getattr(other, other_side).body not in self.poses
            ):
                continue
            px, py = self._local(other, side)
            tx, ty = self._world(other, other_side)
            if math.hypot(px - hx, py - hy) > 0.0:
                rotation = math.atan2(ty - y - hy, tx - x - hx) - math.atan2(py - hy, px - hx)
                return math.remainder(rotation, 2.0 * math.pi)
        return 0.0

    def _hung(self, name: str, joint: Joint | None, guess: Guess, angle: float) -> Pose:
        """Pose of a body at that angle: where its guess says, else on its placed neighbour."""
        if guess.x is not None and guess.y is not None:
            return guess.x, guess.y, angle
        if joint is None:
            return guess.x or 0.0, guess.y or 0.0, angle
        own, other = ("j", "i") if joint.j.body == name else ("i", "j")
        x, y = self._world(joint, other)
        x += float(joint.apart(self.at))
        px, py = self._local(joint, own)
        c, s = math.cos(angle), math.sin(angle)
        pose = x - c * px + s * py, y - s * px - c * py, angle
        return self._lifted(name, joint, pose) if joint.slide else pose

    def _lifted(self, name: str, guide: Joint, pose: Pose) -> Pose:
        """A follower on its guide, moved along it to the radius of its cam: of the two places the
        one farther along the guide.
        """
        for cam in self.mechanism.joints:
            if cam.lifts and cam.j.body == name and cam.i.body in self.poses:
                x, y, angle = pose
                self.poses[name] = pose
                (px, py), (cx, cy) = self._world(cam, "j"), self._world(cam, "i")
                del self.poses[name]
                ux, uy = self._along(guide, name)
                length = float(cam.apart(self.at))
                across = ux * (py - cy) - uy * (px - cx)
                move = math.sqrt(max(length * length - across * across, 0.0))
                move -= ux * (px - cx) + uy * (py - cy)
                return x + move * ux, y + move * uy, angle
        return pose

    def _along(self, guide: Joint, name: str) -> tuple[float, float]:
        """Direction in which the body goes on its guide."""
        placed, own = ("i", "j") if guide.j.body == name else ("j", "i")
        rotation = self.poses[getattr(guide, placed).body][2] + float(self.at.angle(guide, placed))
        sign = 1.0 if own == "j" else -1.0
        return sign * math.cos(rotation), sign * math.sin(rotation)

    def _local(self, joint: Joint, field: str) -> tuple[float, float]:
        """Place of a joint's end in link axes."""
        x, y = self.at.place(joint, field)
        return float(x), float(y)

    def _world(self, joint: Joint, field: str) -> tuple[float, float]:
        marker: Marker = getattr(joint, field)
        x, y, angle = self.poses[marker.body]
        px, py = self._local(joint, field)
        c, s = math.cos(angle), math.sin(angle)
        return x + c * px - s * py, y + s * px + c * py


# -- Guesses that are missing: of the ways in which loops close, the one nearest to those given

Array = np.ndarray

#: By how much easier bodies without a guess move than the others while loops are closed.
EASE = 1e3
#: Starts that are tried, by the greatest number of coordinates.
TRIED = ((60, 8), (300, 2))


def nearest_to_guesses(
    system: System,
    result: ClosedPosition,
    starts: tuple[Array, Array],
    guess: Guesses | None,
    values: Mapping[str, float],
    close: Callable[[Array], ClosedPosition | None],
) -> ClosedPosition:
    """Where bodies have no guess: the closed position in which those that have one are nearest to
    it, with a note where another one is about as near. `starts` (coordinates + 3,) and (coordinates
    + 3, 1).
    """
    first, start = starts
    count = next((tries for size, tries in TRIED if system.coordinates <= size), 0)
    names = unguessed(system, guess, values) if count else ()
    work, n = result.work, system.coordinates
    own = _scaled(system, work.q[:n, 0])
    if not names or np.abs(own - _scaled(system, first[:n])).max() < tol.POSITION_SAME_LOOSE:
        return result
    fixed = _fixed(system, guess or {})
    found = [work.q[:, 0].copy()]
    more = [first, placed(system, guess, values, oriented=True)]
    loose = (np.random.default_rng(seed) for seed in range(count))
    more += [placed(system, guess, values, loose=random) for random in loose]
    weight = work.weight.copy()
    easy = [b for b, body in enumerate(system.mechanism.bodies) if body.name not in fixed]
    slots = np.flatnonzero(np.isin(system.layout.slot_body, easy))
    work.weight[(3 * slots[:, None] + np.arange(3)).ravel()] *= EASE
    for other in more:
        if close(other[:, None]) is not None:
            q = work.q[:, 0].copy()
            if all(_distance(system, q, known) > tol.POSITION_SAME_LOOSE for known in found):
                found.append(q)
    work.weight[:] = weight
    off = np.array([_off(system, guess or {}, first, q) for q in found])
    dead = not result.regularization and result.ratio < tol.PIVOT_SINGULAR and len(found) > 1
    off[0] += 2.0 * tol.POSITION_SAME_LOOSE * dead
    best = 0 if off[0] <= off.min() + tol.POSITION_SAME_LOOSE else int(off.argmin())
    again = None
    if best or not np.array_equal(start[:, 0], first):
        again = close(_unwound(system, found[best], names)[:, None])
        start = found[best][:, None]  # whole revolutions may matter
    result = again or close(start) or result
    _say_others(system, result, names, found, off, off[best])
    return result


def _fixed(system: System, guess: Guesses) -> set[str]:
    """Bodies whose angle is guessed, or driven against one of those or the ground."""
    machine = system.mechanism
    fixed = {"ground", *guess}
    fixed |= {body.name for body in machine.bodies if body.guess.angle is not None}
    before = 0
    while len(fixed) > before:
        before = len(fixed)
        for driver in machine.drivers:
            if driver.angular and fixed & set(driver.bodies):
                fixed |= set(driver.bodies)
    return fixed


def _scaled(system: System, q: Array) -> Array:
    """Coordinates in model lengths and radians: (bodies, 3)."""
    return (q[: system.coordinates] / system.coordinate_units).reshape(-1, 3)


def _difference(system: System, q: Array, other: Array) -> Array:
    """Dimensionless difference of two positions, (bodies, 3), without whole revolutions."""
    difference = _scaled(system, q) - _scaled(system, other)
    difference[:, 2] -= 2.0 * math.pi * np.round(difference[:, 2] / (2.0 * math.pi))
    return difference


def _distance(system: System, q: Array, other: Array) -> float:
    return float(np.abs(_difference(system, q, other)).max())


def _off(system: System, guess: Guesses, first: Array, q: Array) -> float:
    """By how much the bodies with a guess are off it, in radians and model lengths."""
    difference = _difference(system, q, first)
    total = 0.0
    for b, body in enumerate(system.mechanism.bodies):
        given = body.guess
        if body.name in guess or given.angle is not None:
            total += float(difference[b, 2] ** 2)
        if body.name not in guess and given.x is not None and given.y is not None:
            total += float(difference[b, 0] ** 2 + difference[b, 1] ** 2)
    return math.sqrt(total)


def _unwound(system: System, q: Array, names: tuple[str, ...]) -> Array:
    """A position with bodies without a guess at the revolution nearest to an angle of 0."""
    q = q.copy()
    for name in names:
        angle = 3 * system.bodies[name] + 2
        q[angle] = wrapped(q[angle])
    return q


def _say_others(
    system: System,
    result: ClosedPosition,
    names: tuple[str, ...],
    found: list[Array],
    off: Array,
    least: float,
) -> None:
    """Note another position in which the bodies with a guess are about as near to it."""
    here = result.work.q[:, 0]
    for q, offset in sorted(zip(found, off, strict=True), key=lambda pair: float(pair[1])):
        if (
            offset > tol.GUESS_NEAR_TIMES * least + tol.GUESS_NEAR_OTHER
            or _distance(system, q, here) <= tol.POSITION_SAME_LOOSE
        ):
            continue
        difference = np.abs(_difference(system, q, here))
        if _other_teeth(system, difference):
            continue
        angles = difference[:, 2]
        name = max(names, key=lambda name: float(angles[system.bodies[name]]))
        if angles[system.bodies[name]] <= tol.GUESS_WORTH_NOTE:
            continue
        now, then = (
            math.degrees(wrapped(float(p[3 * system.bodies[name] + 2]))) for p in (here, q)
        )
        result.notes.append(
            f"'{name}' has no guess and came out at {now:.1f} deg; the loops close with it at "
            f"{then:.1f} deg as well: a guess chooses between them"
        )
        return


def _other_teeth(system: System, difference: Array) -> bool:
    """Whether positions that differ by (bodies, 3) are one but for wheels, which turn about their
    mass centres while nothing else moves: other teeth mesh there, which no guess is needed for.
    """
    machine = system.mechanism
    wheels: set[str] = set()
    for one in (*machine.joints, *machine.couplings):
        if one.counts_turns and not getattr(one, "parallel", False):
            wheels.update(one.turn_bodies())
    others = [b for b, body in enumerate(machine.bodies) if body.name not in wheels]
    stay = difference[:, :2].max(initial=0.0) <= tol.POSITION_SAME_LOOSE
    return bool(stay and difference[others, 2].max(initial=0.0) <= tol.POSITION_SAME_LOOSE)


def wrapped(angle: float) -> float:
    """The angle [rad] within −π … π.

    >>> wrapped(2 * math.pi + 0.5)  # doctest: +ELLIPSIS
    0.5...
    """
    return math.remainder(angle, 2.0 * math.pi)


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
