"""Random linkages as models, and as closed forms of their potential energy.

A linkage is described twice: as a model, and by the positions of its bodies as functions of one or
two coordinates. Derivatives of the energy are taken by complex steps, exact to rounding.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody import Body, Gravity, Marker, Mechanism, Prismatic, Revolute, Spring

Array = np.ndarray
Poses = Callable[..., dict[str, tuple[Array, Array, Array]]]

#: Step of complex differentiation, and of the differences of such gradients.
TINY, STEP = 1e-30, 1e-6
g = 9.81


@dataclass
class Linkage:
    """A model and its closed forms.

    Attributes
    ----------
    poses : callable
        (x, y, angle) of the link axes of every body at coordinates, arrays of complex numbers; x
        and y of a place on it follow from the cosine and the sine, which it gives for the angle.
    weights : dict
        By body: mass and its place (x, y) on the body.
    springs : list
        Two ends (body or "ground", x, y), stiffness and free length.
    start : array
        The coordinates that the guesses of the model have.
    """

    machine: Mechanism
    poses: Poses
    start: Array
    weights: dict[str, tuple[float, tuple[float, float]]] = field(default_factory=dict)
    springs: list[tuple[Any, Any, float, float]] = field(default_factory=list)
    slides: bool = False

    def energy(self, *u: Array) -> Array:
        """Potential energy at coordinates, real or complex."""
        poses = self.poses(*u)
        total: Any = 0.0 * u[0]
        for body, (mass, (x, y)) in self.weights.items():
            total = total + mass * g * _point(poses, body, x, y)[1]
        for length, (*_, k, l0) in zip(self._lengths(poses), self.springs, strict=True):
            total = total + 0.5 * k * (length - l0) ** 2
        return np.asarray(total)

    def lengths(self, *u: Array) -> Array:
        """Of the springs at coordinates: (springs, …)."""
        return np.array([length + 0.0 * u[0] for length in self._lengths(self.poses(*u))])

    def _lengths(self, poses: dict[str, Any]) -> list[Any]:
        found = []
        for one, other, *_ in self.springs:
            (ax, ay), (bx, by) = _point(poses, *one), _point(poses, *other)
            found.append(np.sqrt((ax - bx) ** 2 + (ay - by) ** 2))
        return found

    def slopes(self, *u: Array) -> Array:
        """∂V/∂u: (coordinates, …)."""
        return np.array(
            [
                self.energy(*(v + 1j * TINY * (n == k) for n, v in enumerate(u))).imag / TINY
                for k in range(len(u))
            ]
        )

    def curvature(self, *u: Array) -> Array:
        """∂²V/∂u²: (coordinates, coordinates, …)."""
        columns = []
        for k in range(len(u)):
            high = self.slopes(*(v + STEP * (n == k) for n, v in enumerate(u)))
            low = self.slopes(*(v - STEP * (n == k) for n, v in enumerate(u)))
            columns.append((high - low) / (2.0 * STEP))
        found = np.array(columns)
        return 0.5 * (found + np.swapaxes(found, 0, 1))

    def angles(self, *u: float) -> dict[str, float]:
        """Angles of the bodies [rad] at coordinates, and what slides."""
        poses = self.poses(*(np.asarray(v) for v in u))
        found = {name: math.atan2(float(s), float(c)) for name, (_, _, (c, s)) in poses.items()}
        return found | {f"{name}.x": float(x) for name, (x, _, _) in poses.items()}


def _point(poses: dict[str, Any], body: str, x: float, y: float) -> tuple[Any, Any]:
    """Where a place of a body, or of the ground, is."""
    if body == "ground":
        return x, y
    ox, oy, (c, s) = poses[body]
    return ox + c * x - s * y, oy + s * x + c * y


def _end(rng: np.random.Generator, body: str, reach: float) -> tuple[str, float, float]:
    x, y = rng.uniform(-0.3, 1.2) * reach, rng.uniform(-0.5, 0.5) * reach
    return body, float(x), float(y)


def _loads(rng: np.random.Generator, made: Linkage, lengths: dict[str, float]) -> None:
    """Gravity, masses anywhere on the links, and one to three springs."""
    names = list(lengths)
    heavy = sum(mass for mass, _ in made.weights.values())
    size = max(lengths.values())
    for n in range(int(rng.integers(1, 4))):
        body = names[int(rng.integers(len(names)))]
        one = _end(rng, body, lengths[body])
        other = ("ground", *(float(v) for v in rng.uniform(-1.5, 1.5, 2) * size))
        if len(names) > 2 and rng.random() < 0.2:
            second = names[(names.index(body) + 2) % len(names)]
            other = _end(rng, second, lengths[second])
        k = float(10.0 ** rng.uniform(-0.5, 1.0) * heavy * g / size)
        l0 = float(rng.choice([0.0, 0.3, 1.0, 1.5]) * rng.uniform(0.5, 1.0) * size)
        made.springs.append((one, other, k, l0))
        ends = [Marker(b, (x, y)) for b, x, y in (one, other)]
        made.machine.add(Spring(f"s{n}", *ends, stiffness=k, free_length=l0))
    made.machine.add(Gravity("gravity", y=-g))


def _mass(rng: np.random.Generator, made: Linkage, body: str, length: float) -> dict[str, Any]:
    """Mass, mass centre and inertia of a body."""
    mass = float(10.0 ** rng.uniform(-1.0, 0.5))
    cg = (float(rng.uniform(-0.2, 1.2) * length), float(rng.uniform(-0.4, 0.4) * length))
    made.weights[body] = (mass, cg)
    return {"mass": mass, "cg": cg, "inertia": 0.1 * mass * length**2}


def _dyad(ax: Any, ay: Any, bx: Any, by: Any, p: float, q: float, side: Any) -> tuple[Any, Any]:
    """Where links of lengths p from A and q from B meet, on the side ±1 of A to B."""
    dx, dy = bx - ax, by - ay
    square = dx**2 + dy**2
    along = 0.5 * (square + p**2 - q**2) / square
    across = side * np.sqrt((p**2 - along**2 * square) / square)
    return ax + along * dx - across * dy, ay + along * dy + across * dx


def _circuit(rng: np.random.Generator, a: float, b: float, c: float, d: float) -> Any:
    """A smooth closed parameter of one circuit: (crank angle, side) at u."""
    low = (a * a + d * d - (b + c) ** 2) / (2.0 * a * d)
    high = (a * a + d * d - (b - c) ** 2) / (2.0 * a * d)
    if low <= -1.0 and high >= 1.0:
        side = float(rng.choice([-1.0, 1.0]))
        return lambda u: (u, side)
    if low <= -1.0:
        ends = (math.acos(high), 2.0 * math.pi - math.acos(high))
    elif high >= 1.0:
        ends = (-math.acos(low), math.acos(low))
    else:
        sign = float(rng.choice([-1.0, 1.0]))
        ends = (sign * math.acos(high), sign * math.acos(low))
    middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
    return lambda u: (middle + half * np.sin(u), np.where(np.real(np.cos(u)) < 0.0, -1.0, 1.0))


def _four_bar_lengths(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Of crank, coupler, rocker and ground: they close, and fold flat nowhere by 1e-3."""
    while True:
        a, b, c, d = (float(v) for v in 10.0 ** rng.uniform(-0.5, 0.5, 4))
        signs = itertools.product((-1.0, 1.0), repeat=3)
        margin = min(abs(a + s * b + t * c + r * d) for s, t, r in signs)
        if 2.0 * max(a, b, c, d) < a + b + c + d and margin > 1e-3 * (a + b + c + d):
            return a, b, c, d


def four_bar(rng: np.random.Generator, hanging: bool = False) -> Linkage:
    """A random four-bar with gravity and springs; `hanging` has a pendulum on its coupler."""
    a, b, c, d = _four_bar_lengths(rng)
    place = _circuit(rng, a, b, c, d)
    hook, rod = (float(v) for v in rng.uniform(-0.2, 1.0, 2) * b), float(rng.uniform(0.3, 1.0) * b)
    hx, hy = hook

    def poses(u: Array, *more: Array) -> dict[str, Any]:
        theta, side = place(u)
        ax, ay = a * np.cos(theta), a * np.sin(theta)
        bx, by = _dyad(ax, ay, d, 0.0, b, c, side)
        found = {
            "crank": (0.0 * u, 0.0 * u, (np.cos(theta), np.sin(theta))),
            "coupler": (ax, ay, ((bx - ax) / b, (by - ay) / b)),
            "rocker": (d + 0.0 * u, 0.0 * u, ((bx - d) / c, by / c)),
        }
        for psi in more:
            cos, sin = found["coupler"][2]
            x, y = ax + cos * hx - sin * hy, ay + sin * hx + cos * hy
            found["rod"] = (x, y, (np.cos(psi), np.sin(psi)))
        return found

    start = rng.uniform(0.0, 2.0 * math.pi, 1 + hanging)
    made = Linkage(Mechanism("random four-bar", ground={"D": (d, 0.0)}), poses, start)
    guess = made.angles(*start)
    lengths = {"crank": a, "coupler": b, "rocker": c}
    points: dict[str, dict[str, tuple[float, float]]] = {
        n: {"E": (v, 0.0)} for n, v in lengths.items()
    }
    if hanging:
        points["coupler"]["H"] = (hx, hy)
        lengths["rod"], points["rod"] = rod, {}
    for name, length in lengths.items():
        own = _mass(rng, made, name, length)
        made.machine.add(Body(name, points=points[name], guess=guess[name], **own))
    made.machine.add(
        Revolute("O", "ground", "crank"),
        Revolute("A", "crank.E", "coupler"),
        Revolute("B", "coupler.E", "rocker.E"),
        Revolute("D", "ground.D", "rocker"),
    )
    if hanging:
        made.machine.add(Revolute("H", "coupler.H", "rod"))
    _loads(rng, made, lengths)
    return made


def double_pendulum(rng: np.random.Generator) -> Linkage:
    """Two rods in a row."""
    a, b = (float(v) for v in 10.0 ** rng.uniform(-0.3, 0.3, 2))

    def poses(u: Array, v: Array) -> dict[str, Any]:
        cos, sin = np.cos(u), np.sin(u)
        return {
            "a": (0.0 * u, 0.0 * u, (cos, sin)),
            "b": (a * cos, a * sin, (np.cos(v), np.sin(v))),
        }

    start = rng.uniform(0.0, 2.0 * math.pi, 2)
    made = Linkage(Mechanism("random double pendulum"), poses, start)
    guess = made.angles(*start)
    made.machine.add(
        Body("a", points={"E": (a, 0.0)}, guess=guess["a"], **_mass(rng, made, "a", a)),
        Body("b", guess=guess["b"], **_mass(rng, made, "b", b)),
        Revolute("O", "ground", "a"),
        Revolute("A", "a.E", "b"),
    )
    _loads(rng, made, {"a": a, "b": b})
    return made


def trolley(rng: np.random.Generator) -> Linkage:
    """A pendulum on a block that a spring holds on a rail."""
    b, tilt = float(10.0 ** rng.uniform(-0.3, 0.3)), float(rng.uniform(-0.5, 0.5))
    along = np.array([math.cos(tilt), math.sin(tilt)])

    def poses(u: Array, v: Array) -> dict[str, Any]:
        one = 1.0 + 0.0 * u
        return {
            "block": (along[0] * u, along[1] * u, (along[0] * one, along[1] * one)),
            "rod": (along[0] * u, along[1] * u, (np.cos(v), np.sin(v))),
        }

    start = np.array([rng.uniform(-1.0, 1.0), rng.uniform(0.0, 2.0 * math.pi)])
    made = Linkage(Mechanism("random trolley"), poses, start)
    guess = made.angles(*start)
    x, y = (float(v) for v in start[0] * along)
    made.machine.add(
        Body("block", guess=(x, y, tilt), **_mass(rng, made, "block", b)),
        Body("rod", guess=(x, y, guess["rod"]), **_mass(rng, made, "rod", b)),
        Prismatic("rail", Marker("ground", (0.0, 0.0), tilt), Marker("block", (0.0, 0.0), 0.0)),
        Revolute("O", "block", "rod"),
    )
    heavy = sum(mass for mass, _ in made.weights.values())
    k, at = float(10.0 ** rng.uniform(0.0, 1.0) * heavy * g / b), rng.uniform(-1.0, 1.0) * along
    made.springs.append((("block", 0.0, 0.0), ("ground", *(float(v) for v in at)), k, 0.0))
    made.machine.add(
        Spring("held", Marker("block", (0.0, 0.0)), Marker("ground", made.springs[0][1][1:]), k)
    )
    _loads(rng, made, {"block": b, "rod": b})
    made.slides = True
    return made


FAMILIES = {1: [four_bar], 2: [double_pendulum, lambda rng: four_bar(rng, True), trolley]}
