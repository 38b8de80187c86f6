"""Free motions in words: a readable basis of what constraints leave open, and a sentence of each.

Every motion of the basis has a leader, a body near the ground that turns (or slides) at unit rate
while the leaders of all others stand still.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.position.closed_position import place
from mbody.core.presentation import Presented
from mbody.core.tolerances import AXIS_DIRECTION, PARTICIPATION_INDEPENDENT, RATE_NONE_MOTION
from mbody.model.joints import Joint
from mbody.model.mechanism import Mechanism
from mbody.system.system import System

Array = np.ndarray

#: Bodies that a sentence names.
NAMED = 5
#: Motions that are put into words together.
AT_ONCE = 64
#: Multiplications of a product of matrices that stays on one thread of OpenBLAS: on a machine that
#: others use, waking a second one took twenty times as long as the product.
ONE_THREAD = 250_000


@dataclass(frozen=True, eq=False)
class FreeMotion(Presented):
    """One free motion: how the bodies move when its leader turns or slides at unit rate.

    `leader`: The body whose rate is one: 1 rad/time, or 1 length/time where it does not turn.
    `words`: The motion as a sentence.
    `rates`: (vx, vy, ω) of the mass centre of every moving body [length/time, rad/time].
    """

    leader: str
    words: str
    rates: dict[str, tuple[float, float, float]]

    @property
    def turns(self) -> bool:
        """Whether its leader turns; else it slides at unit rate."""
        return abs(self.rates[self.leader][2]) > 0.5


def rates_of(system: System, motions: Sequence[FreeMotion]) -> Array:
    """(vx, vy, ω) of every body for unit rates of the leaders: (free, bodies, 3)."""
    found = np.zeros((len(motions), system.layout.bodies, 3))
    for n, motion in enumerate(motions):
        for body, rate in motion.rates.items():
            found[n, system.bodies[body]] = rate
    return found


def leading(system: System, motions: Sequence[FreeMotion], directions: Array) -> Array:
    """Rates of leading bodies as parts of the dimensionless coordinates, (free, coordinates)."""
    parts = np.zeros_like(directions)
    for n, motion in enumerate(motions):
        first = 3 * system.bodies[motion.leader]
        rotates = motion.turns
        own = slice(first + 2, first + 3) if rotates else slice(first, first + 2)
        parts[n, own] = directions[n, own]
    return np.asarray(np.linalg.solve(parts @ directions.T, parts))


def components(mechanism: Mechanism) -> list[list[str]]:
    """Bodies that joints and couplings hold together, the ground and its part first; of each part
    those nearest to its first body first.
    """
    neighbours: dict[str, set[str]] = {"ground": set()}
    neighbours |= {body.name: set() for body in mechanism.bodies}
    for joint in mechanism.joints:
        neighbours[joint.i.body].add(joint.j.body)
        neighbours[joint.j.body].add(joint.i.body)
    for coupling in mechanism.couplings:
        for name in coupling.bodies:
            neighbours[name] |= set(coupling.bodies) - {name}
    place = {name: n for n, name in enumerate(neighbours)}
    found: list[list[str]] = []
    seen: set[str] = set()
    for first in neighbours:
        level = [] if first in seen else [first]
        if level:
            found.append([])
        while level:
            found[-1] += level
            seen.update(level)
            adjacent = set().union(*(neighbours[name] for name in level)) - seen
            level = sorted(adjacent, key=place.__getitem__)
    return found


def leading_order(system: System) -> list[str]:
    """Bodies in the order in which they lead: what is driven, then what is near the ground."""
    names = [name for part in components(system.mechanism) for name in part if name != "ground"]
    driven = {body for driver in system.drivers for body in driver.bodies[1:]}
    return sorted(names, key=lambda name: name not in driven)


class FreeMotions(Sequence[FreeMotion]):
    """Free motions of a large system: each is put into words when it is read. `q` (coordinates +
    3,); `rates` (motions, coordinates), lengths by the model length.
    """

    def __init__(
        self,
        system: System,
        q: Array,
        leaders: Sequence[str],
        rates: Callable[[Sequence[int]], Array],
    ) -> None:
        self._system, self._q, self._leaders, self._rates = system, q, leaders, rates

    def __len__(self) -> int:
        return len(self._leaders)

    # typing's overload would be taken for the compiler's
    def __getitem__(self, n: Any) -> Any:
        numbers = range(len(self))[n]
        if isinstance(numbers, int):
            return self._worded([numbers])[0]
        return self._worded(numbers)

    def __iter__(self) -> Iterator[FreeMotion]:
        for first in range(0, len(self), AT_ONCE):
            yield from self[first : first + AT_ONCE]

    def _worded(self, numbers: Sequence[int]) -> tuple[FreeMotion, ...]:
        leaders = [self._leaders[n] for n in numbers]
        return _worded(self._system, self._q, self._rates(numbers), leaders) if numbers else ()


def free_motions(system: System, q: Array, motions: Array) -> tuple[FreeMotion, ...]:
    """A readable basis of free motions. `q` (coordinates + 3,), `motions` (free, coordinates),
    lengths by those of the parts.
    """
    return _worded(system, q, *_echelon(system, motions, leading_order(system)))


def _worded(
    system: System, q: Array, basis: Array, leaders: Sequence[str]
) -> tuple[FreeMotion, ...]:
    """Motions with words; the basis (motions, coordinates) with lengths by those of the parts."""
    scale = system.coordinate_units.reshape(-1, 3)
    neighbours, found = _JointGraph(system), []
    for row, leader in zip(basis, leaders, strict=True):
        rates = row.reshape(-1, 3) * scale
        own = rates[system.bodies[leader]]
        rotates = abs(row[3 * system.bodies[leader] + 2]) >= RATE_NONE_MOTION
        unit = own[2] if rotates else np.hypot(own[0], own[1])
        found.append(_Words(system, q, neighbours, rates / unit, leader).motion())
    return tuple(found)


def _echelon(system: System, motions: Array, order: Sequence[str]) -> tuple[Array, list[str]]:
    """Reduced rows: each has one coordinate that all others lack, of a body as early in the order
    as can be, of it the angle first; and the bodies that lead.
    """
    basis, left = motions.copy(), np.arange(len(motions))
    found: list[tuple[int, str]] = []
    columns = [3 * system.bodies[name] + k for name in order for k in (2, 0, 1)]
    names = [name for name in order for _ in range(3)]
    top = np.abs(basis).max(axis=1)
    # a row has its greatest number somewhere, so that every pass finds a leader or more
    while left.size:
        for name, c in zip(names, columns, strict=True):
            if not left.size:
                break
            part = np.abs(basis[left, c]) / top[left]
            if part.max(initial=0.0) < PARTICIPATION_INDEPENDENT:
                continue
            n = int(left[part.argmax()])
            basis[n] /= basis[n, c]
            others = np.arange(len(basis)) != n
            basis[others] -= np.outer(basis[others, c], basis[n])
            left = left[left != n]
            top[left] = np.abs(basis[left]).max(axis=1)
            found.append((n, name))
    place = {name: n for n, name in enumerate(order)}
    found.sort(key=lambda pair: place[pair[1]])
    return basis[[n for n, _ in found]], [name for _, name in found]


def panel_echelon(system: System, motions: Array, order: Sequence[str]) -> tuple[Array, list[str]]:
    """Reduced rows and their leaders, as of a few motions, of many, of which each has a coordinate
    1 that is 0 in all others: these coordinates say how large a motion is, and other columns are
    reduced some at a time.
    """
    free, left = len(motions), np.arange(len(motions))
    columns = np.array([3 * system.bodies[name] + k for name in order for k in (2, 0, 1)])
    T, top, wide = np.eye(free), np.ones(free), max(3, ONE_THREAD // max(free**2, 1))
    found: list[tuple[int, int]] = []
    while left.size:
        for first in range(0, len(columns), wide):
            own = columns[first : first + wide]
            work, at = np.hstack([T, T @ motions[:, own]]), 0
            while left.size:
                part = np.abs(work[left, free + at :]) / top[left, None]
                large = np.flatnonzero(part.max(axis=0, initial=0.0) >= PARTICIPATION_INDEPENDENT)
                if not large.size:
                    break
                n, at = int(left[part[:, large[0]].argmax()]), at + int(large[0])
                work[n] /= work[n, free + at]
                others = np.arange(free) != n
                work[others] -= np.outer(work[others, free + at], work[n])
                left = left[left != n]
                top[left] = np.abs(work[left, :free]).max(axis=1)
                found.append((first + at, n))
            T = work[:, :free].copy()
            if not left.size:
                break
    found.sort()
    rows = [n for _, n in found]
    return T[rows] @ motions, [order[column // 3] for column, _ in found]


class _JointGraph:
    """The joints of every body."""

    def __init__(self, system: System) -> None:
        machine = system.mechanism
        self.names = [body.name for body in machine.bodies]
        self.joints: dict[str, list[Joint]] = {name: [] for name in self.names}
        for joint in machine.joints:
            for name in {joint.i.body, joint.j.body} - {"ground"}:
                self.joints[name].append(joint)
        self._free = np.array([not own for own in self.joints.values()], dtype=bool)
        slides = [(joint.i.body, joint.j.body) for joint in machine.joints if joint.slide]
        number = system.bodies
        self._slides = [(number[i], number[j]) for i, j in slides]

    def guided(self, moving: Array) -> Array:
        """Which bodies slide on one that does not move, or have no joints: (bodies,) of bool."""
        found, moves = self._free.copy(), np.append(moving, False)
        for i, j in self._slides:
            for own, other in ((i, j), (j, i)):
                if own < len(found) and not moves[other]:
                    found[own] = True
        return found


class _Words:
    """Finds the words for one motion; rates (bodies, 3) with their units."""

    def __init__(
        self, system: System, q: Array, neighbours: _JointGraph, rates: Array, leader: str
    ) -> None:
        self.system, self.q, self.neighbours, self.leader = system, q, neighbours, leader
        size = np.abs(rates / system.coordinate_units.reshape(-1, 3)).max(axis=1)
        self.small = RATE_NONE_MOTION * float(size.max())
        self.rates, self.names = rates, neighbours.names
        moving = size > self.small
        guided = neighbours.guided(moving)
        # the leader first
        first = system.bodies[leader]
        order = np.flatnonzero(moving)
        order = np.concatenate([order[order == first], order[order != first]])
        rotates = np.abs(rates[order, 2]) > self.small
        self.order, self.rotating, self.gliding = order, order[rotates], order[~rotates]
        self.guided = guided
        self.units = system.mechanism.units

    def motion(self) -> FreeMotion:
        """The sentence: what turns, then what moves without rotation; the leader first."""
        parts = [self._rotates(self._named(self.rotating))] if len(self.rotating) else []
        together = self._together()
        glides = [self._glides(bodies) for bodies in together[:NAMED]]
        if len(together) > NAMED:
            glides.append(f"{len(together) - NAMED} groups more move without turning")
        leads = len(self.rotating) > 0 and self.names[self.rotating[0]] == self.leader
        parts = [*parts, *glides] if leads else [*glides, *parts]
        values = zip(*self.rates[self.order].T.tolist(), strict=True)
        rates = dict(zip(self._named(self.order), values, strict=True))
        return FreeMotion(self.leader, "; ".join(parts), rates)

    def _named(self, bodies: Array) -> list[str]:
        return [self.names[b] for b in bodies.tolist()]

    def _together(self) -> list[Array]:
        """Bodies that do not turn, those with one velocity together."""
        found: list[Array] = []
        left = self.gliding
        velocity, guided = self.rates[left, :2], self.guided[left]
        while left.size:
            least = self.small * self.system.lengths[left]
            alike = np.abs(velocity - velocity[0]).max(axis=1) < least
            alike &= guided == guided[0]
            alike[0] = True
            found.append(left[alike])
            left, velocity, guided = left[~alike], velocity[~alike], guided[~alike]
        return found

    def _rotates(self, names: list[str]) -> str:
        """Such as "crank turns about O2, rocker follows (crank 1 : rocker -0.2 rad/s)"."""
        ratios = [f"{name} {_number(self._rate(name)[2])}" for name in names[:NAMED]]
        text = " : ".join(ratios) + (" …" if len(names) > NAMED else "")
        first, *others = names
        if first != self.leader:
            words = f"{_listed(names)} {'turns' if not others else 'turn'}"
        else:
            words = f"{first} turns about {self._centre(first)}"
            if others:
                words += f", {_listed(others)} {'follows' if len(others) == 1 else 'follow'}"
        if not others:
            text = _number(self._rate(first)[2])
        return f"{words} ({text} rad/{self.units.time})"

    def _rate(self, name: str) -> Array:
        return np.asarray(self.rates[self.system.bodies[name]])

    def _centre(self, name: str) -> str:
        """A pin that does not move, else where the instantaneous centre is."""
        x, y = self.q[3 * self.system.bodies[name] :][:2]
        vx, vy, w = self._rate(name)
        neighbours = self.neighbours.joints[name]
        tolerance = RATE_NONE_MOTION * self.system.lengths[self.system.bodies[name]] * 10.0
        for joint in neighbours:
            side = "i" if joint.i.body == name else "j"
            px, py = place(self.system, self.q, joint, side)
            speed = np.hypot(vx - w * (py - y), vy + w * (px - x))
            if joint.pin and speed < tolerance * abs(w):
                return joint.name
        where = f"({_number(x - vy / w)}, {_number(y + vx / w)})"
        if np.hypot(vx, vy) < tolerance * abs(w):
            where = f"its mass centre {where}"
        return f"{where} at this instant" if neighbours else where

    def _glides(self, bodies: Array) -> str:
        """Along which direction bodies move that do not turn."""
        names = self._named(bodies)
        vx, vy, _ = self.rates[bodies[0]]
        angle = float(np.degrees(np.arctan2(vy, vx))) % 180.0
        speed = float(np.hypot(vx, vy))
        along, sign = f"{angle:.4g}°", np.sign(vy)
        if min(angle, 180.0 - angle) < AXIS_DIRECTION:
            along, sign = "x", np.sign(vx)
        elif abs(angle - 90.0) < AXIS_DIRECTION:
            along = "y"
        rate = f"{_number(sign * speed)} {self.units.of('velocity')}"
        s = "s" if len(names) == 1 else ""
        if self.guided[bodies[0]]:
            return f"{_listed(names)} slide{s} along {along} ({rate})"
        return f"{_listed(names)} move{s} along {along} without turning ({rate})"


def _number(value: Any) -> str:
    return f"{round(float(value), 9) + 0.0:.4g}"


def _listed(names: list[str]) -> str:
    """Names as in "coupler and rocker"; of many the first."""
    if len(names) > NAMED:
        return f"{', '.join(names[: NAMED - 1])} and {len(names) - NAMED + 1} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
