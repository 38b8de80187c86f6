"""A linkage with a closed form: its bodies' places at an instant, and its description.

Angles are unit vectors (c, s), and all is plain arithmetic of analytic functions, so that a complex
step in time gives exact rates. Nothing of mbody takes part in it but the description that it
writes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbody
from mbody import AngleDriver, Body, Mechanism
from mbody.model.body import Guess

Array = Any
#: Imaginary step of the complex step, and of central differences of its rates, as parts of a turn.
TINY, SMALL = 1e-30, 1e-5
#: Places of a turn at which a group must close when it is drawn.
PLACES = 720


class Unfit(Exception):
    """The numbers that were drawn make no linkage: draw anew."""


@dataclass
class Pose:
    """Origin and x axis of a link in the world, arrays of any shape, complex under a step."""

    x: Array
    y: Array
    c: Array
    s: Array

    def at(self, px: Any, py: Any) -> tuple[Array, Array]:
        """World place of a point of the link."""
        return self.x + self.c * px - self.s * py, self.y + self.s * px + self.c * py


Values = dict[str, Any]
Poses = dict[str, Pose]


@dataclass
class Linkage:
    """What was drawn: bodies with points, joints, drivers, and how every pose follows from t.

    Attributes
    ----------
    values : dict
        Numbers by the dotted names of mbody (``"L2.B.x"``), floats or arrays over designs (n, 1).
    steps : list of functions (poses, values, t) -> None
        Each adds the poses of its links.
    ties : dict
        Numbers that must be those of another: of a twin those of its host.
    turns : dict
        Angle at t = 0 of links whose whole turns matter, as of a wheel among gears.
    margins : list of float
        Of every group: how far it stays from closing otherwise, as a part of its size.
    """

    rng: np.random.Generator
    values: Values = field(default_factory=dict)
    points: dict[str, list[str]] = field(default_factory=lambda: {"ground": []})
    steps: list[Callable[[Poses, Values, Array], None]] = field(default_factory=list)
    joints: list[Any] = field(default_factory=list)
    drivers: list[tuple[str, str, float, float, float]] = field(default_factory=list)
    margins: list[float] = field(default_factory=list)
    kinds: list[str] = field(default_factory=list)
    ties: dict[str, str] = field(default_factory=dict)
    turns: dict[str, float] = field(default_factory=dict)
    redundant: bool = False
    span: float = 0.0

    # -- truth --------------------------------------------------------------------------------

    def poses(self, t: Array, values: Values | None = None) -> Poses:
        """Poses of all links at times t (…, instants)."""
        found: Poses = {"ground": Pose(0.0 * t, 0.0 * t, 1.0 + 0.0 * t, 0.0 * t)}
        for step in self.steps:
            step(found, self.values if values is None else values, t)
        return found

    def motion(self, t: Array, values: Values | None = None) -> dict[str, Array]:
        """By link (9, …): x, y of the mass centre, angle; their rates; their accelerations.

        Rates by a complex step, accelerations by central differences of these: right to some 1e-10.
        """
        h = SMALL * self.span / (2.0 * math.pi)
        found: dict[str, Array] = {}
        parts = []
        for shift in (0.0, h, -h):
            parts.append(self.poses(t + shift + 1j * TINY, values))
        for name in parts[0]:
            if name == "ground":
                continue
            cx, cy = (self._number(f"{name}.cg.{k}", values) for k in "xy")
            rows = []
            for one in (part[name] for part in parts):
                x, y = one.at(cx, cy)
                turn = one.c.real * one.s.imag - one.s.real * one.c.imag
                rows.append([x.real, y.real, np.arctan2(one.s.real, one.c.real)])
                rows.append([x.imag / TINY, y.imag / TINY, turn / TINY])
            here, rate, (_, ahead), (_, back) = rows[0], rows[1], rows[2:4], rows[4:6]
            change = [(a - b) / (2.0 * h) for a, b in zip(ahead, back, strict=True)]
            found[name] = np.array(np.broadcast_arrays(*here, *rate, *change))
        given = (self.values if values is None else values).values()
        wide = np.broadcast_shapes(*(np.shape(value) for value in given))
        shape = np.broadcast_shapes(*(rows.shape for rows in found.values()), wide)
        return {name: np.broadcast_to(rows, shape).copy() for name, rows in found.items()}

    def _number(self, name: str, values: Values | None) -> Any:
        return (self.values if values is None else values).get(name, 0.0)

    # -- drawing ------------------------------------------------------------------------------

    @property
    def times(self) -> Array:
        """Times over the whole span, close together."""
        return np.linspace(0.0, self.span, PLACES + 1)

    def link(self, name: str, **points: tuple[float, float]) -> None:
        """A body with named points in its axes."""
        self.points[name] = []
        for key, place in points.items():
            self.point(name, key, *place)

    def point(self, body: str, key: str, x: float, y: float) -> str:
        """A named point; returns its dotted name."""
        self.points[body].append(key)
        self.values[f"{body}.{key}.x"], self.values[f"{body}.{key}.y"] = x, y
        return f"{body}.{key}"

    def world(self, poses: Poses, values: Values, place: str) -> tuple[Array, Array]:
        """World place of a named point."""
        body = place.partition(".")[0]
        return poses[body].at(values[f"{place}.x"], values[f"{place}.y"])

    def name(self) -> str:
        """A new link's name."""
        return f"L{len(self.points)}"

    # -- description --------------------------------------------------------------------------

    def mechanism(self, title: str, *, driven: bool = True) -> Mechanism:
        """The same for mbody, with guesses that are off by less than half way to another branch."""
        here = self.poses(np.array(0.0))
        rough = min(0.03, 0.2 * math.sqrt(min(self.margins)))
        ground = {k: self._xy(f"ground.{k}") for k in self.points["ground"]}
        made = Mechanism(title, ground=ground)
        for name, keys in self.points.items():
            if name == "ground":
                continue
            pose = here[name]
            off = rough * self.rng.uniform(-1.0, 1.0, 3)
            made.add(
                Body(
                    name,
                    mass=self.values.get(f"{name}.mass", 0.0),
                    inertia=self.values.get(f"{name}.inertia", 0.0),
                    cg=self._xy(f"{name}.cg"),
                    points={k: self._xy(f"{name}.{k}") for k in keys},
                    guess=Guess(
                        angle=self.turns.get(name, math.atan2(float(pose.s), float(pose.c)))
                        + off[2],
                        x=float(pose.x) + off[0],
                        y=float(pose.y) + off[1],
                    ),
                )
            )
        made.add(*self.joints)
        if driven:
            for name, body, start, speed, rise in self.drivers:
                made.add(
                    AngleDriver(name, body, mbody.laws.ConstantAcceleration(start, speed, rise))
                )
        return made

    def _xy(self, place: str) -> tuple[float, float]:
        return float(self.values.get(f"{place}.x", 0.0)), float(self.values.get(f"{place}.y", 0.0))
