"""A first pose of every body: what a rough guess leaves out, neighbours and drivers fill in."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.errors import ModelError
from mbody.model.body import Body, Guess, Guesses, as_guess
from mbody.model.element import Marker, Numbers
from mbody.model.joints import Joint
from mbody.quantities.formula import evaluated
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.analysis.position.closed_position import ClosedPosition


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
