"""Random linkages with a closed form: a crank or two, and link groups that circles and lines close.

Every group is placed by two intersecting circles, or by a circle and a line, with a sign that says
which of the two intersections it is: the assembly branch. Angles are unit vectors (c, s), and all
is plain arithmetic of analytic functions, so that a complex step in time gives exact rates. Nothing
of mbody takes part in it but the description that it writes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbody
from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CouplingTerm,
    Distance,
    Fixed,
    Gear,
    Mechanism,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
)
from mbody.model.body import Guess
from mbody.model.element import Marker

__all__ = ["Linkage", "Unfit", "random_linkage"]

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


# -- the parts of a linkage -------------------------------------------------------------------


def crank(of: Linkage, x: float, y: float, length: float, speed: float, rise: float = 0.0) -> str:
    """A driven link on the ground; returns its far point."""
    name, start = of.name(), float(of.rng.uniform(-math.pi, math.pi))
    ground = of.point("ground", f"O{len(of.points['ground'])}", x, y)
    of.link(name, A=(length, 0.0))
    driver = f"motor{len(of.drivers)}" if of.drivers else "motor"
    of.drivers.append((driver, name, start, speed, rise))
    of.joints.append(Revolute(f"{name}_O", ground, name))

    def step(poses: Poses, values: Values, t: Array) -> None:
        angle = start + speed * t + 0.5 * rise * t * t
        px, py = values[f"{ground}.x"], values[f"{ground}.y"]
        poses[name] = Pose(px + 0.0 * t, py + 0.0 * t, np.cos(angle), np.sin(angle))

    of.steps.append(step)
    return f"{name}.A"


def circles(p: Any, q: Any, l1: Any, l2: Any, sign: float) -> tuple[Array, Array]:
    """Where circles about p and q meet: on the left of p → q for sign 1."""
    dx, dy = q[0] - p[0], q[1] - p[1]
    square = dx * dx + dy * dy
    along = (l1 * l1 - l2 * l2 + square) / (2.0 * square)
    high = sign * np.sqrt(l1 * l1 / square - along * along)
    return p[0] + along * dx - high * dy, p[1] + along * dy + high * dx


def distances(of: Linkage, p: str, q: str) -> tuple[float, float]:
    """Least and greatest distance of two places over the span."""
    poses = of.poses(of.times)
    (px, py), (qx, qy) = (of.world(poses, of.values, place) for place in (p, q))
    d = np.hypot(qx - px, qy - py)
    # the greatest of a smooth curve lies at most this far beyond its samples
    slack = 0.5 * np.abs(np.diff(d, 2)).max(initial=0.0)
    return float(d.min() - slack), float(d.max() + slack)


def two_links(of: Linkage, p: str, q: str, margin: float, rod: bool = False) -> str:
    """RRR: two links from p and q, pinned together; with `rod` the first is a massless distance.

    `margin` is how far the triangle stays from being flat, as a part of its size; returns a point
    of the second link.
    """
    rng, sign = of.rng, float(of.rng.choice([-1.0, 1.0]))
    least, most = distances(of, p, q)
    if least < 0.15 or most > 8.0:
        raise Unfit
    # |l1 − l2| < least, l1 + l2 > most: one of them as narrowly as the margin says
    if rng.random() < 0.5:
        total, less = most * (1.0 + margin), least * rng.uniform(-0.8, 0.8)
        of.margins.append(min(margin, 0.2 * least / most))
    else:
        total = most * rng.uniform(1.15, 1.6)
        less = least * (1.0 - margin) * float(rng.choice([-1.0, 1.0]))
        of.margins.append(margin)
    l1, l2 = 0.5 * (total + less), 0.5 * (total - less)
    if min(l1, l2) < 0.1:
        raise Unfit
    if not rod:
        first = of.name()
        of.link(first, C=(l1, 0.0))
    second = of.name()
    of.link(second, C=(l2, 0.0), P=(l2 * rng.uniform(0.3, 1.3), l2 * rng.uniform(-0.5, 0.5)))
    number = f"{second}_rod.length"
    if rod:
        of.joints.append(Distance(f"{second}_rod", p, f"{second}.C", length=l1))
        of.values[number] = l1
    else:
        of.joints += [
            Revolute(f"{first}_P", p, first),
            Revolute(f"{first}_C", f"{first}.C", f"{second}.C"),
        ]
    of.joints.append(Revolute(f"{second}_Q", q, second))
    long = number if rod else f"{first}.C.x"

    def step(poses: Poses, values: Values, t: Array) -> None:
        a, b = of.world(poses, values, p), of.world(poses, values, q)
        x, y = circles(a, b, values[long], values[f"{second}.C.x"], sign)
        if not rod:
            poses[first] = pointing(a, (x, y), values[long])
        poses[second] = pointing(b, (x, y), values[f"{second}.C.x"])

    of.steps.append(step)
    return f"{second}.P"


def pointing(a: Any, b: Any, length: Any) -> Pose:
    """A link with its origin at a, its x axis towards b."""
    return Pose(a[0], a[1], (b[0] - a[0]) / length, (b[1] - a[1]) / length)


def slider(of: Linkage, p: str, margin: float) -> str:
    """RRP: a rod from p to a block on a guide of the ground; returns a point of the block."""
    rng, sign = of.rng, float(of.rng.choice([-1.0, 1.0]))
    angle = rng.uniform(-math.pi, math.pi)
    gx, gy = rng.uniform(-1.0, 1.0, 2)
    ux, uy = math.cos(angle), math.sin(angle)
    poses = of.poses(of.times)
    px, py = of.world(poses, of.values, p)
    high = -(px - gx) * uy + (py - gy) * ux
    length = float(np.abs(high).max() + 0.5 * np.abs(np.diff(high, 2)).max()) * (1.0 + margin)
    if not 0.15 < length < 6.0:
        raise Unfit
    of.margins.append(margin)
    guide = of.point("ground", f"G{len(of.points['ground'])}", gx, gy)
    rod = of.name()
    of.link(rod, C=(length, 0.0))
    block = of.name()
    of.link(block, P=(rng.uniform(-0.4, 0.4), rng.uniform(0.2, 0.6)))
    key = guide.partition(".")[2]
    of.joints += [
        Revolute(f"{rod}_P", p, rod),
        Revolute(f"{rod}_C", f"{rod}.C", block),
        Prismatic(f"{block}_guide", Marker("ground", key, angle), block),
    ]

    def step(poses: Poses, values: Values, t: Array) -> None:
        (x, y), (ox, oy) = of.world(poses, values, p), of.world(poses, values, guide)
        rise = -(x - ox) * uy + (y - oy) * ux
        along = (x - ox) * ux + (y - oy) * uy
        long = values[f"{rod}.C.x"]
        along = along + sign * np.sqrt(long * long - rise * rise)
        bx, by = ox + along * ux, oy + along * uy
        poses[block] = Pose(bx, by, ux + 0.0 * t, uy + 0.0 * t)
        poses[rod] = pointing((x, y), (bx, by), long)

    of.steps.append(step)
    return f"{block}.P"


def lever(of: Linkage, p: str, q: str, block: bool) -> str:
    """RPR: a lever about q whose slot guides the pin p, with or without a block."""
    rng = of.rng
    least, _ = distances(of, p, q)
    if least < 0.2:
        raise Unfit
    of.margins.append(1.0)
    bar = of.name()
    of.link(bar, P=(rng.uniform(0.5, 1.5), rng.uniform(-0.4, 0.4)))
    of.joints.append(Revolute(f"{bar}_Q", q, bar))
    stone = ""
    if block:
        stone = of.name()
        of.link(stone)
        of.joints += [Revolute(f"{stone}_P", p, stone), Prismatic(f"{stone}_slot", bar, stone)]
    else:
        of.joints.append(PinSlot(f"{bar}_slot", bar, p))

    def step(poses: Poses, values: Values, t: Array) -> None:
        a, b = of.world(poses, values, p), of.world(poses, values, q)
        poses[bar] = pointing(b, a, np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2))
        if block:
            poses[stone] = Pose(a[0], a[1], poses[bar].c, poses[bar].s)

    of.steps.append(step)
    return f"{bar}.P"


def twin(of: Linkage, host: str, far: str) -> None:
    """A copy of a link pinned to it at two places: redundant constraints."""
    name = of.name()
    of.link(name, B=(of.values[f"{host}.{far}.x"], of.values[f"{host}.{far}.y"]))
    of.joints += [
        Revolute(f"{name}_A", host, name),
        Revolute(f"{name}_B", f"{host}.{far}", f"{name}.B"),
    ]
    for axis in "xy":
        of.ties[f"{name}.B.{axis}"] = f"{host}.{far}.{axis}"
    of.redundant = True

    def step(poses: Poses, values: Values, t: Array) -> None:
        poses[name] = poses[host]

    of.steps.append(step)


def weld(of: Linkage, host: str, far: str) -> None:
    """A body welded to a link."""
    name, turn = of.name(), float(of.rng.uniform(-1.0, 1.0))
    of.link(name)
    of.joints.append(Fixed(f"{name}_weld", Marker(host, far, turn), name))
    c, s = math.cos(turn), math.sin(turn)

    def step(poses: Poses, values: Values, t: Array) -> None:
        on = poses[host]
        x, y = of.world(poses, values, f"{host}.{far}")
        poses[name] = Pose(x, y, on.c * c - on.s * s, on.s * c + on.c * s)

    of.steps.append(step)


def _driver(of: Linkage) -> tuple[str, str, float, float, float]:
    return of.drivers[0]


def _angle(of: Linkage, t: Array) -> Array:
    _, _, start, speed, rise = _driver(of)
    return start + speed * t + 0.5 * rise * t * t


def wheel(of: Linkage, kind: str) -> None:
    """A wheel on the ground that the first crank turns: a gear pair, or a coupling of angles."""
    rng, name, body = of.rng, of.name(), _driver(of)[1]
    centre = of.joints[0].i.point
    ox, oy = of.values[f"ground.{centre}.x"], of.values[f"ground.{centre}.y"]
    r1, r2 = rng.uniform(0.3, 0.8, 2)
    delta = float(rng.uniform(-math.pi, math.pi))
    away = r1 + r2
    place = of.point(
        "ground",
        f"W{len(of.points['ground'])}",
        ox + away * math.cos(delta),
        oy + away * math.sin(delta),
    )
    of.link(name)
    of.joints.append(Revolute(f"{name}_O", place, name))
    if kind == "gear":
        of.joints.append(Gear(f"{name}_mesh", body, name, radius_i=float(r1), radius_j=float(r2)))
    else:
        value = float(rng.uniform(-1.0, 1.0))
        of.joints.append(
            AngleCoupling(
                f"{name}_belt",
                terms=[CouplingTerm(float(r1), angle=body), CouplingTerm(float(r2), angle=name)],
                value=value,
            )
        )

    whole = away * delta if kind == "gear" else value
    of.turns[name] = (whole - r1 * _angle(of, 0.0)) / r2

    def step(poses: Poses, values: Values, t: Array) -> None:
        angle = (whole - r1 * _angle(of, t)) / r2
        x, y = values[f"{place}.x"], values[f"{place}.y"]
        poses[name] = Pose(x + 0.0 * t, y + 0.0 * t, np.cos(angle), np.sin(angle))

    of.steps.append(step)


def rack(of: Linkage, rolling: bool) -> None:
    """A rack below the first crank's pinion; or a carriage with a wheel on it that rolls."""
    rng, name, body = of.rng, of.name(), _driver(of)[1]
    centre = of.joints[0].i.point
    ox, oy = of.values[f"ground.{centre}.x"], of.values[f"ground.{centre}.y"]
    radius, turn = float(rng.uniform(0.2, 0.6)), float(rng.uniform(-math.pi, math.pi))
    ux, uy = math.cos(turn), math.sin(turn)
    # the pinion stands on the left of the rack
    gx, gy = ox + radius * uy, oy - radius * ux
    key = f"R{len(of.points['ground'])}"
    of.point("ground", key, gx, gy)
    of.link(name)
    of.joints += [
        Prismatic(f"{name}_guide", Marker("ground", key, turn), name),
        RackPinion(f"{name}_mesh", name, body, radius=radius),
    ]
    other, small = "", float(rng.uniform(0.2, 0.5))
    if rolling:
        other = of.name()
        of.turns[other] = turn - radius * (_angle(of, 0.0) - turn) / small
        of.link(other)
        of.point("ground", f"{key}L", gx + small * uy, gy - small * ux)
        of.joints += [
            Revolute(f"{other}_O", name, other),
            Rolling(f"{other}_road", Marker("ground", f"{key}L", turn), other, radius=small),
        ]

    def step(poses: Poses, values: Values, t: Array) -> None:
        # u·(O − rack) + r (θ − turn) = 0, the rack's origin on its line
        along = radius * (_angle(of, t) - turn)
        poses[name] = Pose(gx + along * ux, gy + along * uy, ux + 0.0 * t, uy + 0.0 * t)
        if rolling:
            # u·d + r (θ − turn) = 0 with d from the line's place to the wheel's centre
            angle = turn - along / small
            poses[other] = Pose(poses[name].x, poses[name].y, np.cos(angle), np.sin(angle))

    of.steps.append(step)


# -- random ones ------------------------------------------------------------------------------


def random_linkage(seed: int, *, margin: float | None = None, loops: int | None = None) -> Linkage:
    """A random linkage of one or two drivers; the same seed draws the same.

    Parameters
    ----------
    seed : int
    margin : float, optional
        How near groups come to being flat, as a part of their size; by default ordinary margins of
        0.03 … 0.3.
    loops : int, optional
        Groups, by default one to eight, small ones more often.
    """
    for attempt in range(1000):
        rng = np.random.default_rng([seed, attempt])
        try:
            return _drawn(rng, margin, loops)
        except Unfit:
            continue
    raise AssertionError(f"seed {seed}: nothing fits")


def _drawn(rng: np.random.Generator, margin: float | None, loops: int | None) -> Linkage:
    of = Linkage(rng)
    speed = float(rng.uniform(1.0, 10.0)) * float(rng.choice([-1.0, 1.0]))
    rise = float(rng.uniform(-0.05, 0.05)) * speed**2 * float(rng.random() < 0.3)
    of.span = 2.0 * math.pi / abs(speed)
    places = [crank(of, 0.0, 0.0, float(rng.uniform(0.3, 0.8)), speed, rise)]
    if rng.random() < 0.2:
        ratio = float(rng.choice([-2.0, -1.0, 0.5, 1.0, 2.0]))
        x, y = rng.uniform(-2.0, 2.0, 2)
        places.append(crank(of, float(x), float(y), float(rng.uniform(0.2, 0.6)), ratio * speed))
    if loops is None:
        loops = int(
            rng.choice([1, 2, 3, 4, 5, 6, 7, 8], p=[0.3, 0.3, 0.14, 0.1, 0.05, 0.04, 0.04, 0.03])
        )
    for _ in range(loops):
        group(of, places, margin)
    for _ in range(int(rng.integers(0, 3))):
        extra(of)
    masses(of)
    return of


def group(of: Linkage, places: list[str], margin: float | None) -> None:
    """One more group on places that are there."""
    rng = of.rng
    near = margin if margin is not None else float(10.0 ** rng.uniform(-1.5, -0.5))
    p = str(rng.choice(places))
    bodies = [place for place in places if place.partition(".")[0] != p.partition(".")[0]]
    if bodies and rng.random() < 0.5:
        q = str(rng.choice(bodies))
    else:
        x, y = rng.uniform(-2.5, 2.5, 2)
        q = of.point("ground", f"Q{len(of.points['ground'])}", float(x), float(y))
    kind = str(rng.choice(["RRR", "RRR", "RRR", "RRD", "RRP", "RPR", "pin in slot"]))
    of.kinds.append(kind)
    if kind in ("RRR", "RRD"):
        places.append(two_links(of, p, q, near, rod=kind == "RRD"))
    elif kind == "RRP":
        places.append(slider(of, p, near))
    else:
        places.append(lever(of, p, q, block=kind == "RPR"))


def extra(of: Linkage) -> None:
    """Something that hangs on: a weld, a twin, a gear, a belt, a rack, a wheel."""
    rng = of.rng
    kind = str(rng.choice(["weld", "twin", "gear", "belt", "rack", "wheel"]))
    of.kinds.append(kind)
    hosts = [(name, key) for name, keys in of.points.items() if name != "ground" for key in keys]
    host, far = hosts[int(rng.integers(len(hosts)))]
    if kind == "weld":
        weld(of, host, far)
    elif kind == "twin":
        twin(of, host, far)
    elif kind in ("gear", "belt"):
        wheel(of, kind)
    else:
        rack(of, rolling=kind == "wheel")


def masses(of: Linkage) -> None:
    """Masses, inertias and mass centres; some links have none."""
    rng = of.rng
    for name in of.points:
        if name == "ground":
            continue
        of.values[f"{name}.cg.x"], of.values[f"{name}.cg.y"] = rng.uniform(-0.4, 0.6, 2).tolist()
        if name != "L1" and rng.random() < 0.15:
            continue
        of.values[f"{name}.mass"] = float(rng.uniform(0.2, 4.0))
        of.values[f"{name}.inertia"] = float(rng.uniform(0.02, 0.5))
