"""Random scenes of bodies that touch: boxes, discs, rods on points, frictional pins and guides,
ropes and limits, of all sizes and masses.

A scene is drawn in units of its own (a body is of size and mass 1 or so, and falls its size in a
time of 1) and then scaled. Its description here is what the checks read; nothing of mbody takes
part in it but the mechanism that it writes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbody
from mbody import Body, Contact, Force, Gravity, Marker, Mechanism, Prismatic, Revolute, Rope

Array = Any
Point = tuple[float, float]
#: Masses and sizes of all bodies lie between these powers of ten, time units too.
MASSES, SIZES, TIMES = (-9.0, 9.0), (-4.0, 4.0), (-2.0, 2.0)
GROUND = "ground"


@dataclass
class Part:
    """A rigid body: points from its mass centre, a polygon of some of them or a disc about one.

    `pose` and `rates` are x, y, angle of the mass centre at the start and their rates; `origin` is
    where the mass centre lies in the axes in which mbody is told the points.
    """

    name: str
    mass: float
    inertia: float
    points: dict[str, Point]
    pose: list[float]
    rates: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    polygon: tuple[str, ...] = ()
    radius: float = 0.0
    origin: Point = (0.0, 0.0)

    @property
    def size(self) -> float:
        """Greatest distance from the mass centre."""
        return max([self.radius, *(math.hypot(*p) for p in self.points.values())])


@dataclass
class Touching:
    """A contact of (body, shape) and another: a line of the ground, "box", "rim" or a point."""

    name: str
    i: tuple[str, str]
    j: tuple[str, str]
    friction: float = 0.0
    static: float = 0.0
    restitution: float = 0.0
    law: str = "poisson"


@dataclass
class Pinned:
    """A revolute joint of two points; `limits` of the relative angle."""

    name: str
    i: tuple[str, str]
    j: tuple[str, str]
    friction: float = 0.0
    static: float = 0.0
    radius: float = 0.0
    limits: tuple[float, float] | None = None
    restitution: float = 0.0


@dataclass
class Guided:
    """A slider on a guide of the ground through a point, at an angle."""

    name: str
    at: str
    angle: float
    body: str
    friction: float = 0.0
    static: float = 0.0
    length: float = 0.0
    limits: tuple[float, float] | None = None
    restitution: float = 0.0


@dataclass
class Tied:
    """A rope between two points."""

    name: str
    i: tuple[str, str]
    j: tuple[str, str]
    length: float


@dataclass
class Scene:
    """What was drawn. `lines` of the ground: a point and an angle each."""

    kind: str
    parts: dict[str, Part] = field(default_factory=dict)
    ground: dict[str, Point] = field(default_factory=dict)
    lines: dict[str, tuple[str, float]] = field(default_factory=dict)
    touching: list[Touching] = field(default_factory=list)
    pins: list[Pinned] = field(default_factory=list)
    guides: list[Guided] = field(default_factory=list)
    ropes: list[Tied] = field(default_factory=list)
    pushes: dict[str, Point] = field(default_factory=dict)
    gravity: float = 1.0
    down: Point = (0.0, -1.0)
    until: float = 1.0
    rtol: float = 1e-8
    instants: int = 13
    units: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def scaled(self, length: float, mass: float, time: float) -> Scene:
        """The scene in other units, in place."""
        self.units = (length, mass, time)
        for part in self.parts.values():
            part.mass *= mass
            part.inertia *= mass * length**2
            part.points = {k: (x * length, y * length) for k, (x, y) in part.points.items()}
            part.radius *= length
            part.origin = (part.origin[0] * length, part.origin[1] * length)
            part.pose = [part.pose[0] * length, part.pose[1] * length, part.pose[2]]
            vx, vy, w = part.rates
            part.rates = [vx * length / time, vy * length / time, w / time]
        self.ground = {k: (x * length, y * length) for k, (x, y) in self.ground.items()}
        for pin in self.pins:
            pin.radius *= length
        for guide in self.guides:
            guide.length *= length
            if guide.limits:
                guide.limits = (guide.limits[0] * length, guide.limits[1] * length)
        for rope in self.ropes:
            rope.length *= length
        force = mass * length / time**2
        self.pushes = {k: (x * force, y * force) for k, (x, y) in self.pushes.items()}
        self.gravity *= length / time**2
        self.until *= time
        return self

    def moved(self, angle: float, by: Point) -> Scene:
        """The scene rotated about the origin of the world, then shifted, in place."""
        c, s = math.cos(angle), math.sin(angle)

        def way(v: Point) -> Point:
            return c * v[0] - s * v[1], s * v[0] + c * v[1]

        def place(p: Point) -> Point:
            x, y = way(p)
            return x + by[0], y + by[1]

        self.down = way(self.down)
        self.ground = {k: place(p) for k, p in self.ground.items()}
        self.lines = {k: (p, a + angle) for k, (p, a) in self.lines.items()}
        self.pushes = {k: way(f) for k, f in self.pushes.items()}
        for part in self.parts.values():
            x, y, a = part.pose
            part.pose = [*place((x, y)), a + angle]
            part.rates = [*way((part.rates[0], part.rates[1])), part.rates[2]]
        for pin in self.pins:
            if pin.limits and pin.i[0] == GROUND:
                pin.limits = (pin.limits[0] + angle, pin.limits[1] + angle)
        for guide in self.guides:
            guide.angle += angle
        return self

    def mirrored(self) -> Scene:
        """The scene with y to −y, in place; lines and polygons keep what is on their left."""

        def place(p: Point) -> Point:
            return p[0], -p[1]

        self.down = place(self.down)
        self.ground = {k: place(p) for k, p in self.ground.items()}
        self.lines = {k: (p, math.pi - a) for k, (p, a) in self.lines.items()}
        self.pushes = {k: place(f) for k, f in self.pushes.items()}
        for part in self.parts.values():
            part.points = {k: place(p) for k, p in part.points.items()}
            part.origin = place(part.origin)
            part.polygon = part.polygon[::-1]
            part.pose = [part.pose[0], -part.pose[1], -part.pose[2]]
            part.rates = [part.rates[0], -part.rates[1], -part.rates[2]]
        for pin in self.pins:
            if pin.limits:
                pin.limits = (-pin.limits[1], -pin.limits[0])
        for guide in self.guides:
            guide.angle = -guide.angle
        return self

    def reordered(self, rng: np.random.Generator) -> Scene:
        """The scene with its bodies, joints and contacts in another order, in place."""
        names = list(self.parts)
        self.parts = {names[k]: self.parts[names[k]] for k in rng.permutation(len(names))}
        self.touching = [self.touching[k] for k in rng.permutation(len(self.touching))]
        self.pins = [self.pins[k] for k in rng.permutation(len(self.pins))]
        self.ropes = [self.ropes[k] for k in rng.permutation(len(self.ropes))]
        return self

    def exchanged(self) -> Scene:
        """The scene with i for j in all that has two ends, in place."""
        for one in (*self.touching, *self.pins, *self.ropes):
            one.i, one.j = one.j, one.i
        for pin in self.pins:
            if pin.limits:
                pin.limits = (-pin.limits[1], -pin.limits[0])
        return self

    def mechanism(self, name: str) -> Mechanism:
        """As mbody is told it, with its start and its duration."""
        lines = {k: {"line": {"point": p, "angle": a}} for k, (p, a) in self.lines.items()}
        made = Mechanism(name, ground=self.ground, ground_shapes=lines)
        start = {}
        for part in self.parts.values():
            ox, oy = part.origin
            shapes: dict[str, Any] = {}
            if part.polygon:
                shapes["box"] = {"polygon": list(part.polygon)}
            if part.radius:
                shapes["rim"] = {"disc": "C", "radius": part.radius}
            made.add(
                Body(
                    part.name,
                    mass=part.mass,
                    inertia=part.inertia,
                    cg=part.origin,
                    points={k: (x + ox, y + oy) for k, (x, y) in part.points.items()},
                    shapes=shapes,
                )
            )
            x, y, angle = part.pose
            vx, vy, omega = part.rates
            # a start is that of the origin of the axes of a body
            rx = math.cos(angle) * ox - math.sin(angle) * oy
            ry = math.sin(angle) * ox + math.cos(angle) * oy
            start[part.name] = {
                "x": x - rx,
                "y": y - ry,
                "angle": angle,
                "vx": vx + omega * ry,
                "vy": vy - omega * rx,
                "omega": omega,
            }
        for pin in self.pins:
            more: dict[str, Any] = {}
            if pin.friction:
                more = {"friction": pin.friction, "static": pin.static, "pin_radius": pin.radius}
            if pin.limits:
                more |= {"limits": pin.limits, "restitution": pin.restitution}
            made.add(Revolute(pin.name, ".".join(pin.i), ".".join(pin.j), **more))
        for guide in self.guides:
            more = {}
            if guide.friction:
                more = {"friction": guide.friction, "static": guide.static}
                more |= {"length": guide.length} if guide.length else {}
            if guide.limits:
                more |= {"limits": guide.limits, "restitution": guide.restitution}
            rail = Marker(GROUND, guide.at, guide.angle)
            made.add(Prismatic(guide.name, rail, Marker(guide.body, "C", 0.0), **more))
        for rope in self.ropes:
            made.add(Rope(rope.name, ".".join(rope.i), ".".join(rope.j), length=rope.length))
        for one in self.touching:
            made.add(
                Contact(
                    one.name,
                    ".".join(one.i),
                    ".".join(one.j),
                    friction=one.friction,
                    static=one.static,
                    restitution=one.restitution,
                    law=one.law,
                )
            )
        made.add(Gravity("gravity", *(self.gravity * part for part in self.down)))
        for body, (fx, fy) in self.pushes.items():
            at = f"{body}.C"
            made.add(Force(f"push {body}", at, math.hypot(fx, fy), angle=math.atan2(fy, fx)))
        made.simulation = mbody.SimulationSettings(until=self.until, start=start)
        return made


# -- the parts of a drawing -------------------------------------------------------------------


class Drawing:
    """A generator of random numbers, and the scene that it draws."""

    def __init__(self, rng: np.random.Generator, kind: str) -> None:
        self.rng, self.scene = rng, Scene(kind)

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def chance(self, part: float) -> bool:
        return bool(self.rng.random() < part)

    def coefficients(self) -> dict[str, float]:
        """Friction and static friction: none, or 0 to 1.5."""
        if self.chance(0.1):
            return {"friction": 0.0, "static": 0.0}
        mu = self.between(0.02, 1.5) if self.chance(0.5) else self.between(0.05, 0.6)
        return {"friction": mu, "static": mu * (1.0 if self.chance(0.4) else self.between(1, 1.4))}

    def impact(self) -> dict[str, Any]:
        """Restitution and its law."""
        e = float(self.rng.choice([0.0, 0.0, self.between(0.0, 1.0), self.between(0.2, 0.8), 1.0]))
        return {"restitution": e, "law": "poisson" if self.chance(0.6) else "newton"}

    def mass(self) -> float:
        return float(10.0 ** self.between(-0.7, 0.7))

    def line(self, name: str, x: float, y: float, angle: float) -> None:
        self.scene.ground[f"{name}0"] = (x, y)
        self.scene.lines[name] = (f"{name}0", angle)

    def floor(self, tilt: float) -> float:
        """A floor through the origin; its angle."""
        angle = self.between(-tilt, tilt) if self.chance(0.8) else 0.0
        self.line("floor", 0.0, 0.0, angle)
        return angle

    def wall(self, x: float, right: bool = True) -> None:
        lean = self.between(0.0, 0.35)
        angle = 0.5 * math.pi - lean if right else -0.5 * math.pi + lean
        self.line("wall" if right else "left", x, 0.0, angle)

    def part(self, name: str, shape: str, pose: list[float], corners: int = 0) -> Part:
        """A box, a disc or a rod with points on it."""
        m = self.mass()
        if shape == "disc":
            r = self.between(0.2, 0.5)
            made = Part(name, m, m * r * r * self.between(0.1, 1.0), {"C": (0.0, 0.0)}, pose)
            made.radius = r
        elif shape == "rod":
            half = self.between(0.4, 0.8)
            count = corners or 2
            along = np.linspace(-half, half, count)
            points = {f"P{k}": (float(x), 0.0) for k, x in enumerate(along)} | {"C": (0.0, 0.0)}
            shift = self.between(-0.3, 0.3) * half
            points = {k: (x - shift * (k != "C"), y) for k, (x, y) in points.items()}
            made = Part(name, m, m * half**2 * self.between(0.15, 0.6), points, pose)
        else:
            made = self.box(name, m, pose, corners or (4 if self.chance(0.7) else 3))
        if self.chance(0.3):
            made.origin = (self.between(-0.3, 0.3), self.between(-0.3, 0.3))
        self.scene.parts[name] = made
        return made

    def box(self, name: str, m: float, pose: list[float], corners: int) -> Part:
        w, h = self.between(0.2, 0.6), self.between(0.2, 0.6)
        if corners == 4:
            rows = [(-w, -h), (w, -h), (w, h), (-w, h)]
            keep = m * (w * w + h * h) / 3.0
        else:
            angles = np.sort(self.rng.uniform(0.0, 0.6, corners)) + np.linspace(
                0.0, 2.0 * math.pi, corners, endpoint=False
            )
            rows = [(w * math.cos(a), w * math.sin(a)) for a in angles]
            keep = m * w * w * self.between(0.15, 0.4)
        shift = (0.0, 0.0)
        if self.chance(0.5):
            shift = (self.between(-0.3, 0.3) * w, self.between(-0.3, 0.3) * w)
        points = {f"P{k}": (x - shift[0], y - shift[1]) for k, (x, y) in enumerate(rows)}
        made = Part(name, m, keep, points | {"C": (0.0, 0.0)}, pose)
        made.polygon = tuple(f"P{k}" for k in range(corners))
        return made

    def contacts(self, part: Part, line: str, same: dict[str, Any] | None = None) -> None:
        """The shapes of a body with a line of the ground, either of them first."""
        shape = {"box": bool(part.polygon), "rim": bool(part.radius)}
        spots = [k for k, v in shape.items() if v] or [k for k in part.points if k != "C"]
        numbers = {**self.coefficients(), **self.impact()} if same is None else same
        for spot in spots:
            ends = [(GROUND, line), (part.name, spot)]
            if self.chance(0.3):
                ends.reverse()
            name = f"{line} {part.name} {spot}"
            self.scene.touching.append(Touching(name, ends[0], ends[1], **numbers))

    def pair(self, one: Part, two: Part) -> None:
        """Two bodies with each other."""
        ends = [(p.name, "box" if p.polygon else "rim") for p in (one, two)]
        name = f"{one.name} {two.name}"
        numbers = {**self.coefficients(), **self.impact()}
        self.scene.touching.append(Touching(name, ends[0], ends[1], **numbers))

    def thrown(self, part: Part, fast: float = 2.0) -> None:
        part.rates = [self.between(-fast, fast), self.between(-fast, 0.5 * fast)]
        part.rates.append(self.between(-3.0, 3.0))

    def push(self, part: Part, most: float = 1.5) -> None:
        size = part.mass * self.between(0.0, most)
        angle = self.between(-math.pi, math.pi)
        self.scene.pushes[part.name] = (size * math.cos(angle), size * math.sin(angle))


def shape_of(draw: Drawing) -> str:
    return str(draw.rng.choice(["box", "box", "disc", "rod"]))


def tumbling(draw: Drawing) -> None:
    """One body thrown on a slope, between walls or not."""
    part = draw.part("a", shape_of(draw), [0.0, draw.between(1.1, 1.7), draw.between(-3.0, 3.0)])
    draw.floor(0.4)
    draw.contacts(part, "floor")
    if draw.chance(0.4):
        draw.wall(draw.between(1.2, 2.2))
        draw.contacts(part, "wall")
    if draw.chance(0.3):
        draw.wall(-draw.between(1.2, 2.2), right=False)
        draw.contacts(part, "left")
    draw.thrown(part)
    if draw.chance(0.3):
        draw.push(part, 0.8)


def laid(draw: Drawing, part: Part, angle: float) -> None:
    """The body on the floor, on its disc, its two lowest corners or all points of its rod."""
    up = (-math.sin(angle), math.cos(angle))
    if part.radius:
        part.pose = [part.radius * up[0], part.radius * up[1], draw.between(-3.0, 3.0)]
        return
    names = part.polygon or tuple(k for k in part.points if k != "C")
    (ax, ay), (bx, by) = part.points[names[0]], part.points[names[1]]
    turn = angle - math.atan2(by - ay, bx - ax)
    c, s = math.cos(turn), math.sin(turn)
    height = -(s * ax + c * ay) * math.cos(angle) + (c * ax - s * ay) * math.sin(angle)
    part.pose = [height * up[0], height * up[1], turn]


def resting(draw: Drawing) -> None:
    """One body that lies on a slope, with a push, at rest or sliding."""
    shape = shape_of(draw)
    part = draw.part(
        "a", shape, [0.0, 0.0, 0.0], int(draw.rng.integers(2, 5)) if shape == "rod" else 0
    )
    angle = draw.floor(0.7)
    laid(draw, part, angle)
    draw.contacts(part, "floor")
    if draw.chance(0.5):
        draw.push(part)
    if draw.chance(0.5):
        v = draw.between(-1.5, 1.5)
        part.rates = [v * math.cos(angle), v * math.sin(angle), 0.0]
        if part.radius and draw.chance(0.7):
            part.rates[2] = -v / part.radius if draw.chance(0.5) else draw.between(-4.0, 4.0)


def wedged(draw: Drawing) -> None:
    """A disc or a rod that touches two lines: a groove, a ladder on a wall."""
    one, two = draw.between(-0.9, 0.1), draw.between(0.7, 1.7)
    draw.line("floor", 0.0, 0.0, one)
    draw.line("wall", 0.0, 0.0, two)
    if draw.chance(0.5):
        part = draw.part("a", "disc", [0.0, 0.0, draw.between(-3.0, 3.0)])
        way, half = 0.5 * (one + two + math.pi), 0.5 * (math.pi - two + one)
        reach = part.radius / math.sin(half)
        part.pose[:2] = [reach * math.cos(way), reach * math.sin(way)]
    else:
        part = draw.part("a", "rod", [0.0, 0.0, 0.0])
        (ax, _), (bx, _) = part.points["P0"], part.points["P1"]
        # law of sines in the triangle of the two lines and the rod
        gap = math.pi - (two - one)
        tilt = draw.between(0.15, 0.85) * (math.pi - gap)
        length = bx - ax
        foot = length * math.sin(math.pi - gap - tilt) / math.sin(gap)
        top = length * math.sin(tilt) / math.sin(gap)
        # P1 lies down the first line, P0 up the second
        a = np.array([math.cos(two), math.sin(two)]) * top
        b = -np.array([math.cos(one), math.sin(one)]) * foot
        along = (b - a) / length
        part.pose = [*(float(x) for x in a - along * ax), math.atan2(along[1], along[0])]
    same = {**draw.coefficients(), **draw.impact()} if draw.chance(0.4) else None
    draw.contacts(part, "floor", same)
    draw.contacts(part, "wall", same)
    if draw.chance(0.6):
        draw.push(part, 2.0)
    if part.radius and draw.chance(0.4):
        part.rates[2] = draw.between(-4.0, 4.0)


def several(draw: Drawing) -> None:
    """Two or three boxes and discs on each other and on the floor."""
    count = int(draw.rng.integers(2, 4))
    draw.floor(0.3)
    height = 0.0
    for k in range(count):
        part = draw.part("abc"[k], "box" if draw.chance(0.5) else "disc", [0.0, 0.0, 0.0])
        height += part.size + draw.between(0.02, 0.2)
        part.pose = [draw.between(-0.3, 0.3), height + 0.2, draw.between(-3.0, 3.0)]
        height += part.size
        draw.contacts(part, "floor")
        draw.thrown(part, 0.5)
    parts = list(draw.scene.parts.values())
    for k, one in enumerate(parts):
        for two in parts[k + 1 :]:
            draw.pair(one, two)


def stacked(draw: Drawing) -> None:
    """Boxes that lie on each other, the lowest on the floor, and perhaps a push."""
    angle = draw.floor(0.4)
    c, s = math.cos(angle), math.sin(angle)
    height, here = 0.0, 0.0
    for k in range(int(draw.rng.integers(2, 4))):
        part = draw.part("abc"[k], "box", [0.0, 0.0, angle], 4)
        low = min(y for _, y in part.points.values())
        high = max(y for _, y in part.points.values())
        here += draw.between(-0.15, 0.15)
        y = height - low
        part.pose = [here * c - y * s, here * s + y * c, angle]
        height += high - low
        if not k:
            draw.contacts(part, "floor")
    parts = list(draw.scene.parts.values())
    for one, two in itertools.pairwise(parts):
        draw.pair(one, two)
    if draw.chance(0.6):
        draw.push(parts[int(draw.rng.integers(len(parts)))], 1.0)


def linked(draw: Drawing, count: int, x: float, y: float) -> list[Part]:
    """Rods in a row from a point of the ground, with pins, and their rates."""
    draw.scene.ground["H"] = (x, y)
    here, rate, before = np.array([x, y]), np.zeros(2), (GROUND, "H")
    made = []
    for k in range(count):
        part = draw.part("abc"[k], "rod", [0.0, 0.0, draw.between(-3.0, 0.0)])
        (ax, _), (bx, _) = part.points["P0"], part.points["P1"]
        angle, omega = part.pose[2], draw.between(-2.0, 2.0) * draw.chance(0.6)
        along = np.array([math.cos(angle), math.sin(angle)])
        across = np.array([-along[1], along[0]])
        centre, rates = here - along * ax, rate - across * ax * omega
        part.pose = [float(centre[0]), float(centre[1]), angle]
        part.rates = [float(rates[0]), float(rates[1]), omega]
        pin = Pinned(f"pin {part.name}", before, (part.name, "P0"))
        if draw.chance(0.7):
            mu = draw.coefficients()
            pin.friction, pin.static = mu["friction"], mu["static"]
            pin.radius = draw.between(0.02, 0.2)
        if draw.chance(0.3):
            turn = angle - (made[-1].pose[2] if made else 0.0)
            low, high = draw.between(0.0, 0.8), draw.between(0.0, 0.8)
            pin.limits = (turn - low, turn + high)
            pin.restitution = draw.impact()["restitution"]
        draw.scene.pins.append(pin)
        here, rate = centre + along * bx, rates + across * bx * omega
        before = (part.name, "P1")
        made.append(part)
    return made


def hanging(draw: Drawing) -> None:
    """One to three rods on frictional pins, with limits, perhaps above a floor."""
    parts = linked(draw, int(draw.rng.integers(1, 4)), 0.0, 0.0)
    lowest = min(p.pose[1] - p.size for p in parts)
    if draw.chance(0.5):
        draw.line("floor", 0.0, lowest - draw.between(0.1, 0.4), draw.between(-0.02, 0.02))
        draw.contacts(parts[-1], "floor")
    if draw.chance(0.3):
        draw.push(parts[-1], 1.0)


def roped(draw: Drawing) -> None:
    """A body on one or two ropes, or two bodies on one, above a floor."""
    part = draw.part("a", shape_of(draw), [0.0, draw.between(1.2, 2.0), draw.between(-3.0, 3.0)])
    spots = list(part.points)
    draw.thrown(part, 1.0)
    if draw.chance(0.7):
        draw.floor(0.2)
        draw.contacts(part, "floor")
    for k in range(int(draw.rng.integers(1, 3))):
        draw.scene.ground[f"R{k}"] = (draw.between(-1.0, 1.0), draw.between(1.5, 3.0))
        spot = spots[int(draw.rng.integers(len(spots)))]
        ends = [(GROUND, f"R{k}"), ("a", spot)]
        draw.scene.ropes.append(rope(draw, f"rope {k}", ends))
    if draw.chance(0.4):
        other = draw.part("b", shape_of(draw), [1.6, draw.between(1.2, 2.0), draw.between(-3, 3)])
        draw.thrown(other, 1.0)
        spot = list(other.points)[int(draw.rng.integers(len(other.points)))]
        draw.scene.ropes.append(rope(draw, "rope b", [("a", spots[0]), ("b", spot)]))
        if "floor" in draw.scene.lines:
            draw.contacts(other, "floor")


def rope(draw: Drawing, name: str, ends: list[tuple[str, str]]) -> Tied:
    """A rope that is slack at the start by up to a half."""
    places = []
    for body, point in ends:
        if body == GROUND:
            places.append(draw.scene.ground[point])
            continue
        (x, y, t), (px, py) = draw.scene.parts[body].pose, draw.scene.parts[body].points[point]
        c, s = math.cos(t), math.sin(t)
        places.append((x + c * px - s * py, y + s * px + c * py))
    far = math.dist(*places)
    return Tied(name, ends[0], ends[1], far * draw.between(1.001, 1.5))


def stopped(draw: Drawing) -> None:
    """A slider on a frictional guide between limits, alone or with a pendulum on it."""
    part = draw.part("a", "box", [0.0, 0.0, 0.0], 4)
    angle = draw.between(-0.8, 0.8)
    draw.scene.ground["G"] = (0.0, 0.0)
    guide = Guided("guide", "G", angle, "a")
    part.pose[2] = angle
    if draw.chance(0.8):
        mu = draw.coefficients()
        guide.friction, guide.static = mu["friction"], mu["static"]
        guide.length = draw.between(0.3, 1.0) if draw.chance(0.5) and mu["friction"] else 0.0
    if draw.chance(0.8):
        guide.limits = (-draw.between(0.05, 0.6), draw.between(0.05, 0.6))
        guide.restitution = draw.impact()["restitution"]
    draw.scene.guides.append(guide)
    v = draw.between(-1.5, 1.5) * draw.chance(0.7)
    part.rates = [v * math.cos(angle), v * math.sin(angle), 0.0]
    if draw.chance(0.5):
        draw.push(part, 2.0)
    if draw.chance(0.5):
        (rod,) = linked(
            draw, 1, 0.0, 0.0
        )  # named "a" as well: it takes the pin, the slider is made anew
        rod.name, pin = "b", draw.scene.pins[0]
        draw.scene.parts = {"a": part, "b": rod}
        pin.name, pin.i, pin.j = "pin", ("a", "C"), ("b", "P0")
        if pin.limits:
            pin.limits = (pin.limits[0] - angle, pin.limits[1] - angle)
        del draw.scene.ground["H"]
        rod.rates = [rod.rates[0] + part.rates[0], rod.rates[1] + part.rates[1], rod.rates[2]]


def apart(draw: Drawing) -> None:
    """Two or three bodies in the air, very light to very heavy, from far away or from nothing."""
    for k in range(int(draw.rng.integers(2, 4))):
        far = float(10.0 ** draw.rng.choice([-12.0, 0.0, 2.0]))
        height = [0.0, draw.between(2.0, 3.0) + 3.0 * k][far == 1.0] + (far > 1.0) * far
        part = draw.part("abc"[k], shape_of(draw), [draw.between(-1.0, 1.0) * far, height, 0.0])
        draw.thrown(part)
        factor = float(10.0 ** draw.between(-5.0, 5.0))
        part.mass *= factor
        part.inertia *= factor
        draw.push(part, 2.0)


def tilted(draw: Drawing) -> None:
    """A rod that stands on one end and slides, with much friction or little (Painlevé's)."""
    part = draw.part("a", "rod", [0.0, 0.0, draw.between(0.2, 2.9)])
    angle = draw.floor(0.3)
    turn = part.pose[2] = part.pose[2] + angle
    px, _ = part.points["P0"]
    arm = np.array([math.cos(turn), math.sin(turn)]) * -px
    part.pose[:2] = [float(arm[0]), float(arm[1])]
    v, omega = draw.between(-2.0, 2.0), draw.between(-2.0, 2.0)
    part.rates = [v * math.cos(angle) - omega * arm[1], v * math.sin(angle) + omega * arm[0], omega]
    mu = draw.between(0.1, 2.0)
    draw.contacts(part, "floor", {"friction": mu, "static": mu, **draw.impact()})


KINDS: dict[str, tuple[Callable[[Drawing], None], float]] = {
    "tumbling": (tumbling, 0.22),
    "resting": (resting, 0.15),
    "wedged": (wedged, 0.13),
    "several": (several, 0.1),
    "stacked": (stacked, 0.08),
    "hanging": (hanging, 0.12),
    "roped": (roped, 0.1),
    "stopped": (stopped, 0.05),
    "apart": (apart, 0.025),
    "tilted": (tilted, 0.025),
}


#: Parts of the scenes of several bodies whose masses differ greatly.
UNEVEN = {"several": 0.3, "stacked": 0.25, "hanging": 0.25, "roped": 0.2}


def uneven_scene(seed: int) -> Scene:
    """The scene of a seed in which every body has a mass of its own from `MASSES`."""
    scene = random_scene(seed, 0x3E16, UNEVEN)
    rng = np.random.default_rng([seed, 0x3E17])
    for part in scene.parts.values():
        factor = 10.0 ** float(rng.uniform(*MASSES)) / part.mass
        part.mass, part.inertia = part.mass * factor, part.inertia * factor
        if part.name in scene.pushes:
            fx, fy = scene.pushes[part.name]
            scene.pushes[part.name] = (fx * factor, fy * factor)
    return scene


def random_scene(
    seed: int, stream: int = 0x5CE7E, kinds: Mapping[str, float] | None = None
) -> Scene:
    """The scene of a seed, of kinds with their parts of the whole, by default those of `KINDS`."""
    rng = np.random.default_rng([seed, stream])
    parts = kinds or {name: part for name, (_, part) in KINDS.items()}
    kind = str(rng.choice(list(parts), p=list(parts.values())))
    draw = Drawing(rng, kind)
    KINDS[kind][0](draw)
    scene = draw.scene
    scene.until = draw.between(0.4, 1.6)
    scene.rtol = float(rng.choice([1e-6, 1e-8, 1e-10]))
    if draw.chance(0.2) and kind != "apart":  # one body much lighter or heavier than the others
        part = scene.parts[str(rng.choice(list(scene.parts)))]
        factor = 10.0 ** draw.between(-4.0, 4.0)
        part.mass *= factor
        part.inertia *= factor
    discs = [part for part in scene.parts.values() if part.radius]
    if discs and np.random.default_rng([seed, 0x0D15C]).random() < 0.05:
        discs[0].inertia = 0.0  # a rim without mass of its own
    if draw.chance(0.3):
        return scene.scaled(1.0, 1.0, 1.0)
    masses = [math.log10(p.mass) for p in scene.parts.values()]
    mass = draw.between(MASSES[0] - min(masses), MASSES[1] - max(masses))
    length, time = draw.between(*SIZES), draw.between(*TIMES)
    return scene.scaled(10.0**length, 10.0**mass, 10.0**time)
