"""Loops of a mechanism as vectors from joint to joint, with their motion at one instant."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbody.model.driver import DistanceDriver
from mbody.model.element import Marker
from mbody.model.joints import Distance, Rolling

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = [
    "LoopVector",
    "VectorLoop",
    "edges",
    "loops_of_instants",
    "relative_motion",
    "vector_loops",
]

Array = np.ndarray

#: A vector that is no longer than this part of the model length is none.
NONE = 1e-12


@dataclass(frozen=True)
class LoopVector:
    """A vector of a loop: r e^{iθ} with its derivatives.

    Attributes
    ----------
    kind : str
        "link", between two joints of a body; "slide", the displacement along a guide; "offset",
        across it; "rod", between two places.
    index : tuple of str
        Of its symbols.
    body : str
        The body that it turns with, of a slide that of the guide; empty for a rod.
    r, r_rate, r_second : float
        Length, of a slide a displacement of either sign, and its derivatives.
    angle, rate, second : float
        θ [rad] and its derivatives.
    varies : bool
        Whether the length does.
    """

    kind: str
    index: tuple[str, ...]
    body: str
    r: float
    angle: float
    rate: float
    second: float
    r_rate: float = 0.0
    r_second: float = 0.0
    varies: bool = False


@dataclass(frozen=True)
class VectorLoop:
    """A closed chain of bodies; the signed vectors from joint to joint sum to zero.

    Attributes
    ----------
    bodies, joints : tuples of str
        In the order in which they are passed, a joint leading to the next body.
    vectors : tuple of (sign, LoopVector)
    """

    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    vectors: tuple[tuple[int, LoopVector], ...]


class _Step(NamedTuple):
    """A joint passed from one of its bodies to the other."""

    joint: Any
    left: str
    entered: str

    def back(self) -> _Step:
        return _Step(self.joint, self.entered, self.left)


def edges(solution: Solution) -> list[Any]:
    """The joints, and drivers of a distance, that vectors go through: pins, welds, slides, slots,
    rods, rolling wheels; in a free motion without those that have play.
    """
    machine, found = solution.mechanism, []
    for joint in machine.joints:
        rolls = isinstance(joint, Rolling)
        known = joint.coincident or "travel" in joint.coordinates or isinstance(joint, Distance)
        loose = solution.analysis == "simulate" and joint.can_separate
        if (known or rolls) and not loose:
            found.append(joint)
    return [*found, *(one for one in machine.drivers if isinstance(one, DistanceDriver))]


def vector_loops(solution: Solution, instant: int = 0) -> list[VectorLoop]:
    """The fundamental loops of a mechanism, shortest first: as many as joints close chains.

    Parameters
    ----------
    solution : Solution
        Of one design.
    instant : int
        Which of its instants.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> [(sign, "".join(v.index)) for sign, v in vector_loops(run)[0].vectors]
    [(1, 'O2A'), (1, 'AB'), (-1, 'O4B'), (-1, 'O2O4')]
    """
    (found,) = loops_of_instants(solution, [instant])
    return found


def loops_of_instants(solution: Solution, instants: Iterable[int]) -> Iterable[list[VectorLoop]]:
    """`vector_loops` at instants in turn; what holds for all of them is found once."""
    chains, histories = _chains(solution), _LoopHistories(solution)
    for instant in instants:
        walk = _Walk(histories, instant, chains)
        yield [
            VectorLoop(
                tuple(step.left for step in chain),
                tuple(step.joint.name for step in chain),
                tuple(walk.vectors(chain)),
            )
            for chain in chains
        ]


def _chains(solution: Solution) -> list[list[_Step]]:
    """Fundamental cycles of the graph of bodies and joints, by a tree of shortest ways."""
    joints = edges(solution)
    ways: dict[str, list[_Step]] = {}
    used: set[str] = set()
    for root in ("ground", *(body.name for body in solution.mechanism.bodies)):
        if root in ways:
            continue
        ways[root], waiting = [], [root]
        for body in waiting:
            for step in _steps_from(body, joints):
                if step.entered not in ways:
                    ways[step.entered] = [*ways[body], step]
                    waiting.append(step.entered)
                    used.add(step.joint.name)
    found = []
    for joint in joints:
        if joint.name not in used:
            i, j = joint.bodies
            there, back = ways[i], ways[j]
            while there and back and there[0] == back[0]:
                there, back = there[1:], back[1:]
            found.append([*there, _Step(joint, i, j), *(step.back() for step in reversed(back))])
    return sorted(found, key=len)


def _steps_from(body: str, joints: Sequence[Any]) -> Iterable[_Step]:
    for joint in joints:
        i, j = joint.bodies
        if body == i:
            yield _Step(joint, i, j)
        elif body == j:
            yield _Step(joint, j, i)


class Relative(NamedTuple):
    """From a place on i to one on j: the way and its derivatives (2,), world axes."""

    d: Array
    rate: Array
    second: Array


class _LoopHistories:
    """The histories of places and bodies of a solution over all its instants, each made once."""

    def __init__(self, solution: Solution) -> None:
        self.system = solution.system
        self.point = functools.cache(solution.point)
        self.body = functools.cache(solution.__getitem__)


def relative_motion(
    solution: Solution | _LoopHistories, i: Marker, j: Marker, instant: int
) -> Relative:
    """Motion of the place on j from that on i at one instant."""
    p, q = solution.point(i), solution.point(j)
    parts = [
        np.array([getattr(q, x)[instant] - getattr(p, x)[instant] for x in pair])
        for pair in (("x", "y"), ("vx", "vy"), ("ax", "ay"))
    ]
    return Relative(*parts)


class _Walk:
    """Finds vectors of the loops at one instant."""

    def __init__(self, histories: _LoopHistories, instant: int, chains: list[list[_Step]]) -> None:
        self.run, self.k = histories, instant
        self.order = self._order(chains)
        # two bodies may be between the same two joints
        corners = {
            (frozenset((a.joint.name, b.joint.name)), a.entered)
            for chain in chains
            for a, b in zip(chain, [*chain[1:], chain[0]], strict=True)
        }
        self.shared = Counter(pair for pair, _ in corners)

    def _order(self, chains: list[list[_Step]]) -> dict[str, tuple[bool, int]]:
        """Vectors go from joints at the ground, then in the order in which loops pass them."""
        found: dict[str, tuple[bool, int]] = {}
        for chain in chains:
            for step in chain:
                grounded = "ground" in step.joint.bodies
                found.setdefault(step.joint.name, (not grounded, len(found)))
        return found

    def vectors(self, chain: list[_Step]) -> Iterable[tuple[int, LoopVector]]:
        """The signed vectors of one loop."""
        for n, step in enumerate(chain):
            sign = 1 if step.entered == step.joint.bodies[1] else -1
            for own in self._own(step.joint):
                yield sign, own
            link = self._link(step, chain[(n + 1) % len(chain)])
            if link:
                yield link

    def _link(self, step: _Step, after: _Step) -> tuple[int, LoopVector] | None:
        """On the body between two joints."""
        here, there = step.joint, after.joint
        forward = self.order[here.name] <= self.order[there.name]
        first, last = (here, there) if forward else (there, here)
        body = step.entered
        p, q = (one.i if one.i.body == body else one.j for one in (first, last))
        way = relative_motion(self.run, p, q, self.k).d
        if np.hypot(*way) <= NONE * self.run.system.length:
            return None
        index: tuple[str, ...] = (first.name, last.name)
        if self.shared[frozenset(index)] > 1:
            index = (*index, body)
        angle = float(np.arctan2(way[1], way[0]))
        vector = LoopVector("link", index, body, float(np.hypot(*way)), angle, *self._turning(body))
        return (1 if forward else -1), vector

    def _turning(self, body: str) -> tuple[float, float]:
        at = self.run.body(body)
        return float(at.omega[self.k]), float(at.alpha[self.k])

    def _own(self, joint: Any) -> Iterable[LoopVector]:
        """Of a joint itself, from its place on i to that on j."""
        if joint.role == "joint" and joint.coincident:
            return
        way = relative_motion(self.run, joint.i, joint.j, self.k)
        on_line = isinstance(joint, Rolling) and joint.on_radius is None
        if "travel" in joint_coordinates(joint) or on_line:
            yield from self._slide(joint, way)
        else:
            yield self._rod(joint, way)

    def _slide(self, joint: Any, way: Relative) -> Iterable[LoopVector]:
        body = joint.i.body
        angle = float(self.run.body(body).angle[self.k] + self.run.system.numbers.angle(joint, "i"))
        u = np.array([np.cos(angle), np.sin(angle)])
        n = np.array([-u[1], u[0]])
        omega, alpha = self._turning(body)
        s, across = float(u @ way.d), float(n @ way.d)
        yield LoopVector(
            "slide",
            (joint.name,),
            body,
            s,
            angle,
            omega,
            alpha,
            r_rate=float(u @ way.rate + omega * across),
            r_second=float(
                u @ way.second + 2.0 * omega * (n @ way.rate) + alpha * across - omega**2 * s
            ),
            varies=True,
        )
        if isinstance(joint, Rolling):
            radius = float(self.run.system.numbers[f"{joint.name}.radius"])
            yield LoopVector(
                "offset", (joint.name, "n"), body, radius, angle + 0.5 * np.pi, omega, alpha
            )

    def _rod(self, joint: Any, way: Relative) -> LoopVector:
        r = float(np.hypot(*way.d))
        u = way.d / r
        n = np.array([-u[1], u[0]])
        r_rate, omega = float(u @ way.rate), float(n @ way.rate) / r
        varies = isinstance(joint, DistanceDriver)
        return LoopVector(
            "rod",
            (joint.name,),
            "",
            r,
            float(np.arctan2(u[1], u[0])),
            omega,
            second=(float(n @ way.second) - 2.0 * r_rate * omega) / r,
            r_rate=r_rate if varies else 0.0,
            r_second=float(u @ way.second) + r * omega**2 if varies else 0.0,
            varies=varies,
        )


def joint_coordinates(joint: Any) -> tuple[str, ...]:
    """Names of the free coordinates of a joint; a driver has none."""
    return tuple(joint.coordinates) if joint.role == "joint" else ()
