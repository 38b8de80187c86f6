"""The parts of a linkage: a crank or two, and link groups that circles and lines close.

Every group is placed by two intersecting circles, or by a circle and a line, with a sign that says
which of the two intersections it is: the assembly branch.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import mbody
from mbody.model.element import Marker
from tests.campaign.linkage import Array, Linkage, Pose, Poses, Unfit, Values


def crank(of: Linkage, x: float, y: float, length: float, speed: float, rise: float = 0.0) -> str:
    """A driven link on the ground; returns its far point."""
    name, start = of.name(), float(of.rng.uniform(-math.pi, math.pi))
    ground = of.point("ground", f"O{len(of.points['ground'])}", x, y)
    of.link(name, A=(length, 0.0))
    driver = f"motor{len(of.drivers)}" if of.drivers else "motor"
    of.drivers.append((driver, name, start, speed, rise))
    of.joints.append(mbody.Revolute(f"{name}_O", ground, name))

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
        of.joints.append(mbody.Distance(f"{second}_rod", p, f"{second}.C", length=l1))
        of.values[number] = l1
    else:
        of.joints += [
            mbody.Revolute(f"{first}_P", p, first),
            mbody.Revolute(f"{first}_C", f"{first}.C", f"{second}.C"),
        ]
    of.joints.append(mbody.Revolute(f"{second}_Q", q, second))
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
        mbody.Revolute(f"{rod}_P", p, rod),
        mbody.Revolute(f"{rod}_C", f"{rod}.C", block),
        mbody.Prismatic(f"{block}_guide", Marker("ground", key, angle), block),
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
    of.joints.append(mbody.Revolute(f"{bar}_Q", q, bar))
    stone = ""
    if block:
        stone = of.name()
        of.link(stone)
        of.joints += [
            mbody.Revolute(f"{stone}_P", p, stone),
            mbody.Prismatic(f"{stone}_slot", bar, stone),
        ]
    else:
        of.joints.append(mbody.PinSlot(f"{bar}_slot", bar, p))

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
        mbody.Revolute(f"{name}_A", host, name),
        mbody.Revolute(f"{name}_B", f"{host}.{far}", f"{name}.B"),
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
    of.joints.append(mbody.Fixed(f"{name}_weld", Marker(host, far, turn), name))
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
    of.joints.append(mbody.Revolute(f"{name}_O", place, name))
    if kind == "gear":
        of.joints.append(
            mbody.Gear(f"{name}_mesh", body, name, radius_i=float(r1), radius_j=float(r2))
        )
    else:
        value = float(rng.uniform(-1.0, 1.0))
        of.joints.append(
            mbody.AngleCoupling(
                f"{name}_belt",
                terms=[
                    mbody.CouplingTerm(float(r1), angle=body),
                    mbody.CouplingTerm(float(r2), angle=name),
                ],
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
    # the pinion is on the left of the rack
    gx, gy = ox + radius * uy, oy - radius * ux
    key = f"R{len(of.points['ground'])}"
    of.point("ground", key, gx, gy)
    of.link(name)
    of.joints += [
        mbody.Prismatic(f"{name}_guide", Marker("ground", key, turn), name),
        mbody.RackPinion(f"{name}_mesh", name, body, radius=radius),
    ]
    other, small = "", float(rng.uniform(0.2, 0.5))
    if rolling:
        other = of.name()
        of.turns[other] = turn - radius * (_angle(of, 0.0) - turn) / small
        of.link(other)
        of.point("ground", f"{key}L", gx + small * uy, gy - small * ux)
        of.joints += [
            mbody.Revolute(f"{other}_O", name, other),
            mbody.Rolling(f"{other}_road", Marker("ground", f"{key}L", turn), other, radius=small),
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
