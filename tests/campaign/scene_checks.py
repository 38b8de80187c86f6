"""What the printed numbers of a motion with contacts must fulfil, by formulas of their own.

Every kept instant: places do not overlap, joints are closed, ropes not too long; every force keeps
its law (contacts press within their cones and against the sliding, ropes pull, friction of pins and
guides keeps its limit) and all are in balance with the printed accelerations. Every impact: the
change of momentum is made of impulses within the cones of what touches, and no energy comes of it;
of one place alone the rates are those of its law. Own energies close the account of energy.

All is compared in units of the scene: lengths by the bodies' sizes, forces by those that act there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.campaign.scenes import GROUND, Part, Scene, Touching
from tests.support.impact_cones import nearest_of_cone

Array = Any
#: Of lengths: what may be closed, what surely is, what overlaps.
CLOSED, TOUCHES, OVERLAP = 1e-7, 1e-12, 1e-6
#: Of the greatest rate: at rest, surely sliding.
AT_REST, SLIDES = 1e-9, 1e-6
#: Of the forces on the bodies of a contact or joint: what cones and balance may be off.
FORCE = 1e-7
#: Of the change of momentum at an impact; of the rates there; changes below this part of the
#: greatest momentum of the motion are rounding, or, where a series of impacts is taken to its end,
#: what the loads did in that time.
IMPULSE, RATE, NOTHING, SERIES = 1e-6, 1e-6, 1e-10, 1e-5
#: Of printed rates: their last digits.
ROUNDING = 1e-15


def cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def turned(v: Array, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


@dataclass
class Spot:
    """A place where two shapes touch or may: gap, place, direction from i to j."""

    gap: float
    place: Array
    normal: Array

    @property
    def tangent(self) -> Array:
        return np.array([self.normal[1], -self.normal[0]])


class State:
    """Poses, rates and accelerations of all bodies at one instant, from printed numbers."""

    def __init__(self, scene: Scene, run: Any, k: int) -> None:
        self.scene = scene
        self.q: dict[str, Array] = {}
        self.v: dict[str, Array] = {}
        self.a: dict[str, Array] = {}
        for name in scene.parts:
            body = run[name]
            self.q[name] = np.array([body.x[k], body.y[k], body.angle[k]])
            self.v[name] = np.array([body.vx[k], body.vy[k], body.omega[k]])
            self.a[name] = np.array([body.ax[k], body.ay[k], body.alpha[k]])
        self.q[GROUND] = self.v[GROUND] = self.a[GROUND] = np.zeros(3)

    def place(self, body: str, point: str) -> Array:
        if body == GROUND:
            return np.array(self.scene.ground[point])
        return self.q[body][:2] + turned(self.scene.parts[body].points[point], self.q[body][2])

    def rate(self, body: str, place: Array) -> Array:
        """Of what is at a place of a body."""
        vx, vy, w = self.v[body]
        rx, ry = place - self.q[body][:2]
        return np.array([vx - w * ry, vy + w * rx])

    def kinetic(self) -> float:
        total = 0.0
        for name, part in self.scene.parts.items():
            vx, vy, w = self.v[name]
            total += 0.5 * part.mass * (vx * vx + vy * vy) + 0.5 * part.inertia * w * w
        return total

    def energy(self) -> float:
        """Kinetic energy and the potential of weights and pushes."""
        total = self.kinetic()
        for name, part in self.scene.parts.items():
            load = np.array(self.scene.pushes.get(name, (0.0, 0.0)))
            load += part.mass * self.scene.gravity * np.array(self.scene.down)
            total -= float(load @ self.q[name][:2])
        return total

    # -- geometry ---------------------------------------------------------------------------

    def corners(self, part: Part) -> Array:
        return np.array([self.place(part.name, k) for k in part.polygon])

    def spots(self, one: Touching) -> list[Spot]:
        """Where two shapes may touch; the least gap of all is that of the shapes."""
        (i, spot_i), (j, spot_j) = one.i, one.j
        if i == GROUND:
            return self.on_line(spot_i, j, spot_j)
        if j == GROUND:
            return [Spot(s.gap, s.place, -s.normal) for s in self.on_line(spot_j, i, spot_i)]
        a, b = self.scene.parts[i], self.scene.parts[j]
        if spot_i == "rim" and spot_j == "rim":
            way = self.q[j][:2] - self.q[i][:2]
            far = float(np.hypot(*way))
            n = way / far
            return [Spot(far - a.radius - b.radius, self.q[i][:2] + a.radius * n, n)]
        if spot_i == "rim":
            return [Spot(s.gap, s.place, -s.normal) for s in self.disc_on_box(b, a)]
        if spot_j == "rim":
            return self.disc_on_box(a, b)
        return self.boxes(a, b)

    def on_line(self, line: str, body: str, spot: str) -> list[Spot]:
        point, angle = self.scene.lines[line]
        part, start = self.scene.parts[body], np.array(self.scene.ground[point])
        n = np.array([-math.sin(angle), math.cos(angle)])
        if spot == "rim":
            place = self.q[body][:2] - part.radius * n
            return [Spot(float((place - start) @ n), place, n)]
        names = part.polygon if spot == "box" else (spot,)
        places = [self.place(body, name) for name in names]
        return [Spot(float((p - start) @ n), p, n) for p in places]

    def disc_on_box(self, box: Part, disc: Part) -> list[Spot]:
        corners, centre = self.corners(box), self.q[disc.name][:2]
        best: Spot | None = None
        heights = []
        for k, (p, q) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
            way = (q - p) / np.hypot(*(q - p))
            n = np.array([way[1], -way[0]])
            heights.append((float((centre - p) @ n), n, k))
            nearest = p + way * min(max(float((centre - p) @ way), 0.0), float(np.hypot(*(q - p))))
            far = float(np.hypot(*(centre - nearest)))
            if far > 0.0 and (best is None or far - disc.radius < best.gap):
                best = Spot(far - disc.radius, nearest, (centre - nearest) / far)
        height, n, _ = max(heights, key=lambda row: row[0])
        if height < 0.0:  # the centre is within: far too deep
            return [Spot(height - disc.radius, centre - disc.radius * n, n)]
        assert best is not None
        return [best]

    def boxes(self, a: Part, b: Part) -> list[Spot]:
        """Corners of either on the face of the other that keeps them apart."""
        found, apart = [], -math.inf
        for one, two, sign in ((a, b, 1.0), (b, a, -1.0)):
            mine, theirs = self.corners(one), self.corners(two)
            for p, q in zip(mine, np.roll(mine, -1, axis=0), strict=True):
                length = float(np.hypot(*(q - p)))
                way = (q - p) / length
                n = np.array([way[1], -way[0]])
                heights = (theirs - p) @ n
                apart = max(apart, float(heights.min()))
                found.append((float(heights.min()), p, way, length, n, theirs, heights, sign))
        size = min(a.size, b.size)
        spots = []
        for least, p, way, length, n, theirs, heights, sign in found:
            if least < apart - CLOSED * size:
                continue
            for corner, height in zip(theirs, heights, strict=True):
                along = float((corner - p) @ way)
                if -CLOSED * size <= along <= length + CLOSED * size:
                    spots.append(Spot(float(height), corner, sign * n))
        # corner beside corner: apart by more than this
        return spots or [Spot(max(apart, 0.0), a_place(self, a), np.array([0.0, 1.0]))]


def a_place(state: State, part: Part) -> Array:
    return state.q[part.name][:2]


@dataclass
class Fault:
    """Something wrong: what it is of, when, by how much, and a sentence."""

    kind: str
    t: float
    size: float
    told: str

    def __str__(self) -> str:
        return f"{self.kind} at {self.t:.9g} s by {self.size:.2g}: {self.told}"


class Checks:
    """All checks of one run of a scene."""

    def __init__(self, scene: Scene, run: Any) -> None:
        self.scene, self.run = scene, run
        self.faults: list[Fault] = []
        self.t = 0.0
        self.series: set[float] = set()
        self.states = [State(scene, run, k) for k in range(len(run.t))]
        self.size = max(part.size for part in scene.parts.values())
        free = math.sqrt(scene.gravity * self.size)
        self.swift = max(
            [free]
            + [
                float(np.hypot(*s.v[n][:2])) + abs(s.v[n][2]) * part.size
                for s in self.states
                for n, part in scene.parts.items()
            ]
        )
        self.length = max(
            [self.size] + [float(np.hypot(*s.q[n][:2])) for s in self.states for n in scene.parts]
        )

    def fault(self, kind: str, size: float, told: str) -> None:
        self.faults.append(Fault(kind, self.t, size, told))

    def all(self) -> list[Fault]:
        for k, state in enumerate(self.states):
            self.t = float(self.run.t[k])
            if not all(np.isfinite(x).all() for x in (*state.q.values(), *state.v.values())):
                self.fault("numbers", math.inf, "not finite")
                return self.faults
            self.positions(state)
            # where a run says that forces have a pole they have no digits
            if k < len(self.states) - 1 or "grow without bound" not in self.run.status:
                self.forces(state, k)
        self.impacts()
        self.energies()
        return self.faults

    # -- positions --------------------------------------------------------------------------

    def positions(self, state: State) -> None:
        for one in self.scene.touching:
            gap = min(spot.gap for spot in state.spots(one))
            if gap < -OVERLAP * self.size:
                self.fault("overlap", -gap / self.size, one.name)
        for pin in self.scene.pins:
            off = float(np.hypot(*(state.place(*pin.j) - state.place(*pin.i))))
            if off > CLOSED * self.length:
                self.fault("joint open", off / self.size, pin.name)
            if pin.limits:
                turn = state.q[pin.j[0]][2] - state.q[pin.i[0]][2]
                past = max(pin.limits[0] - turn, turn - pin.limits[1])
                if past > OVERLAP:
                    self.fault("limit passed", past, pin.name)
        for guide in self.scene.guides:
            along, across = self.travel(state, guide)
            off = max(abs(across) / self.length, abs(state.q[guide.body][2] - guide.angle))
            if off > CLOSED:
                self.fault("joint open", off, guide.name)
            if guide.limits:
                past = max(guide.limits[0] - along, along - guide.limits[1])
                if past > OVERLAP * self.size:
                    self.fault("limit passed", past / self.size, guide.name)
        for rope in self.scene.ropes:
            far = math.dist(state.place(*rope.j), state.place(*rope.i))
            if far > rope.length + OVERLAP * self.size:
                self.fault("rope too long", (far - rope.length) / self.size, rope.name)

    def travel(self, state: State, guide: Any) -> tuple[float, float]:
        way = state.q[guide.body][:2] - np.array(self.scene.ground[guide.at])
        c, s = math.cos(guide.angle), math.sin(guide.angle)
        return float(way[0] * c + way[1] * s), float(way[1] * c - way[0] * s)

    # -- forces -----------------------------------------------------------------------------

    def forces(self, state: State, k: int, hands: dict[str, Any] | None = None) -> None:
        """Laws of all forces, and their balance; `hands` are drivers by name, which act as well."""
        scene, parts = self.scene, self.scene.parts
        total = {name: np.zeros(3) for name in (*parts, GROUND)}
        sizes = dict.fromkeys((*parts, GROUND), 0.0)
        for name, part in parts.items():
            fx, fy = scene.pushes.get(name, (0.0, 0.0))
            gx, gy = part.mass * scene.gravity * np.array(scene.down)
            total[name] += [fx + gx, fy + gy, 0.0]
            sizes[name] += part.mass * scene.gravity + math.hypot(fx, fy)
        wrenches: dict[str, tuple[Array, Array, str, str]] = {}
        limited = [one for one in (*scene.pins, *scene.guides) if one.limits]
        names = [one.name for one in (*scene.touching, *scene.ropes)]
        names += [f"{one.name}_{end}" for one in limited for end in ("low", "high")]
        for name in names:
            wrenches[name] = self.wrench(state, name, k, None)
        for joint in (*scene.pins, *scene.guides):
            wrenches[joint.name] = self.wrench(state, joint.name, k, self.run.reaction_point)
        for name, hand in (hands or {}).items():
            effort = float(self.run.effort(name)[k])
            way = np.array([math.cos(hand.angle), math.sin(hand.angle), 0.0])
            place = state.place(hand.body, hand.point or "C")
            force = effort * (way if hand.point else np.array([0.0, 0.0, 1.0]))
            wrenches[name] = (force, place, hand.body, GROUND)
        for force, about, on, by in wrenches.values():
            for body, sign in ((on, 1.0), (by, -1.0)):
                if body == GROUND:
                    continue
                arm = about - state.q[body][:2]
                torque = force[2] + cross(arm, force[:2])
                total[body] += sign * np.array([force[0], force[1], torque])
                size = parts[body].size
                sizes[body] += math.hypot(*force[:2]) + abs(torque) / size
        for name, part in parts.items():
            inertial = np.array([part.mass, part.mass, part.inertia]) * state.a[name]
            left = (total[name] - inertial) / [1.0, 1.0, part.size]
            scale = sizes[name] + abs(part.inertia * state.a[name][2]) / part.size
            off = float(np.abs(left).max()) / scale
            if not off < FORCE:
                self.fault("balance", off, f"{name}: {left} of {scale:.6g}")
        for one in scene.touching:
            force, about, on, by = wrenches[one.name]
            scale = min(sizes[b] for b in (on, by) if b != GROUND)
            self.contact(state, one, force, about, on, scale, k)
        for rope in scene.ropes:
            force, about, on, by = wrenches[rope.name]
            scale = min(sizes[b] for b in (on, by) if b != GROUND)
            self.rope(state, rope, force, on, scale)
        for pin in scene.pins:
            force, about, on, _ = wrenches[pin.name]
            sign = 1.0 if on == pin.j[0] else -1.0
            scale = min(sizes[b] for b in (pin.i[0], pin.j[0]) if b != GROUND)
            self.pin(state, pin, sign * force, scale)
        for guide in scene.guides:
            force, about, on, _ = wrenches[guide.name]
            arm = about - state.q[guide.body][:2]
            whole = np.array([*force[:2], force[2] + cross(arm, force[:2])])
            self.guide(state, guide, whole if on == guide.body else -whole, sizes[guide.body])
        for one in limited:
            for end, direction in (("low", 1.0), ("high", -1.0)):
                force, _, on, _ = wrenches[f"{one.name}_{end}"]
                self.limit(state, one, end, direction * force, on, sizes)

    def wrench(self, state: State, name: str, k: int, point: Any) -> tuple[Array, Array, str, str]:
        """(fx, fy, torque), the place that the torque is about, the body it acts on, by which."""
        one = self.run.reaction(name)
        force = np.array([float(one.fx[k]), float(one.fy[k]), float(one.torque[k])])
        if point is None:
            about = state.q[one.on][:2]
        else:
            px, py = point(name)
            about = np.array([float(px[k]), float(py[k])])
        return force, about, str(one.on), str(one.by)

    def contact(
        self, state: State, one: Touching, force: Array, about: Array, on: str, scale: float, k: int
    ) -> None:
        """Pressing forces at the touching places within their cones, against what slides."""
        sign = 1.0 if on == one.j[0] else -1.0
        size = float(np.hypot(*force[:2]))
        mode = self.run.mode(one.name)[k]
        if size <= FORCE * scale:
            return
        every = state.spots(one)
        spots = [s for s in every if s.gap < CLOSED * self.length]
        if not spots:
            gap = min(s.gap for s in every)
            self.fault("force of an open contact", gap / self.size, f"{one.name} {force}")
            return
        reach = min(self.scene.parts[b].size for b in (one.i[0], one.j[0]) if b != GROUND)
        columns, slips = [], []
        for s in spots:
            rate = state.rate(one.j[0], s.place) - state.rate(one.i[0], s.place)
            slips.append(float(rate @ s.tangent))
            options = [-math.copysign(one.friction, slips[-1])]
            if abs(slips[-1]) <= SLIDES * self.swift:
                options = [one.static, -one.static]
            for part in options:
                f = sign * (s.normal + part * s.tangent)
                columns.append([*f, cross(s.place - about, f) / reach])
        slides = min(map(abs, slips)) > SLIDES * self.swift
        if mode == "stick" and slides:
            self.fault("sticks in motion", min(map(abs, slips)) / self.swift, one.name)
        goal = np.array([force[0], force[1], force[2] / reach])
        off = nearest_of_cone(np.array(columns).T, goal / size)[1]
        if off * size > FORCE * scale:
            n, t = spots[0].normal, spots[0].tangent
            normal, along = sign * float(force[:2] @ n), sign * float(force[:2] @ t)
            inside = abs(along) <= one.static * normal * (1.0 + 1e-9)
            kind = "pulls" if normal < 0 else "sliding friction" if slides else "cone"
            kind = "cone of corners" if inside and not slides else kind
            told = f"{one.name} {mode}, slips {slips[0]:.3g}: N {normal:.6g}, T {along:.6g}, mu "
            told += f"{one.friction:.6g} {one.static:.6g}"
            self.fault(kind, max(-normal / scale, off * size / scale), told)
        if one.friction and mode.startswith("slip") and len(spots) == 1:
            self.creeping(state, one, spots[0], slips[0])

    def creeping(self, state: State, one: Touching, spot: Spot, slip: float) -> None:
        """What slides at no rate and does not begin to would stick."""
        if abs(slip) > AT_REST * self.swift:
            return
        acc = sum(
            sign * self.acceleration(state, body, spot)
            for body, sign in ((one.j[0], 1), (one.i[0], -1))
        )
        if abs(acc) < 1e-6 * max(self.scene.gravity, *(np.hypot(*state.a[b][:2]) for b in state.a)):
            self.fault("slides at rest", abs(slip) / self.swift, one.name)

    def acceleration(self, state: State, body: str, spot: Spot) -> float:
        rx, ry = spot.place - state.q[body][:2]
        ax, ay, alpha = state.a[body]
        w = state.v[body][2]
        return float(
            np.array([ax - alpha * ry - w * w * rx, ay + alpha * rx - w * w * ry]) @ spot.tangent
        )

    def rope(self, state: State, rope: Any, force: Array, on: str, scale: float) -> None:
        ends = state.place(*rope.i), state.place(*rope.j)
        way = ends[0] - ends[1] if on == rope.j[0] else ends[1] - ends[0]
        far = float(np.hypot(*way))
        pull, across = float(force[:2] @ way) / far, cross(way, force[:2]) / far
        if pull < -FORCE * scale:
            self.fault("rope pushes", -pull / scale, rope.name)
        if abs(across) > FORCE * scale:
            self.fault("rope bends", abs(across) / scale, rope.name)
        if abs(pull) > FORCE * scale and far < rope.length - CLOSED * self.length:
            self.fault("slack rope pulls", (rope.length - far) / self.size, rope.name)

    def pin(self, state: State, pin: Any, force: Array, scale: float) -> None:
        """Friction of a pin: the torque on j against its rotation, at most ρ |R|."""
        radius = pin.radius or self.size
        rate = state.v[pin.j[0]][2] - state.v[pin.i[0]][2]
        load, torque = float(np.hypot(*force[:2])), float(force[2])
        greatest = [m / math.sqrt(1.0 + m * m) * pin.radius for m in (pin.friction, pin.static)]
        if abs(rate) * self.size > SLIDES * self.swift:
            off = abs(torque + math.copysign(greatest[0] * load, rate))
        else:
            off = abs(torque) - greatest[1] * load
        if off > FORCE * scale * radius:
            self.fault(
                "pin",
                off / (scale * radius),
                f"{pin.name} rate {rate:.3g}: torque {torque:.6g}, "
                f"rho R {greatest[0] * load:.6g} {greatest[1] * load:.6g}",
            )

    def guide(self, state: State, guide: Any, force: Array, scale: float) -> None:
        """Friction of a guide: along it, at most μ max(|N|, 2|M|/length)."""
        c, s = math.cos(guide.angle), math.sin(guide.angle)
        along, across = force[0] * c + force[1] * s, force[1] * c - force[0] * s
        press = abs(across)
        if guide.length:
            press = max(press, 2.0 * abs(force[2]) / guide.length)
        vx, vy, _ = state.v[guide.body]
        rate = vx * c + vy * s
        if abs(rate) > SLIDES * self.swift:
            off = abs(along + math.copysign(guide.friction * press, rate))
        else:
            off = abs(along) - guide.static * press
        if off > FORCE * scale:
            told = f"{guide.name} rate {rate:.3g}: T {along:.6g}, press {press:.6g}"
            self.fault("guide", off / scale, f"{told}, mu {guide.friction:.6g}")

    def limit(
        self, state: State, one: Any, end: str, force: Array, on: str, sizes: dict[str, float]
    ) -> None:
        bound = one.limits[0 if end == "low" else 1]
        if hasattr(one, "angle"):
            c, s = math.cos(one.angle), math.sin(one.angle)
            value, unit, scale = self.travel(state, one)[0], self.length, sizes[one.body]
            push = force[0] * c + force[1] * s
            push = push if on == one.body else -push
        else:
            value = state.q[one.j[0]][2] - state.q[one.i[0]][2]
            bodies = [b for b in (one.i[0], one.j[0]) if b != GROUND]
            scale = min(sizes[b] * self.scene.parts[b].size for b in bodies)
            unit, push = 1.0, force[2] if on == one.j[0] else -force[2]
        if push < -FORCE * scale:
            self.fault("limit pulls", -push / scale, f"{one.name}_{end}")
        if abs(push) > FORCE * scale and abs(value - bound) > CLOSED * max(
            unit, self.length * (unit != 1.0)
        ):
            self.fault("force of an open limit", abs(value - bound) / unit, f"{one.name}_{end}")

    # -- impacts ----------------------------------------------------------------------------

    def impacts(self) -> None:
        # changes of modes that follow a series which is taken to its end have its jump as well
        self.series = {float(e.state.t[0]) for e in self.run.events if e.name == "rest"}
        for event in self.run.events:
            if event.after is None:
                continue
            self.t = float(event.t)
            self.impact(State(self.scene, event.state, 0), State(self.scene, event.after, 0), event)

    def impact(self, before: State, after: State, event: Any) -> None:
        parts = self.scene.parts
        names = list(parts)
        moved = max(float(np.hypot(*(after.q[n][:2] - before.q[n][:2]))) for n in names)
        if moved > CLOSED * self.size:
            self.fault("jump", moved / self.size, f"positions at {event.name} of {event.contact}")
        # one row for every momentum, by the roots of mass and inertia
        masses = np.array([[p.mass, p.mass, p.inertia] for p in parts.values()]).ravel()
        arms = np.array([[1.0, 1.0, p.size] for p in parts.values()]).ravel()
        roots = np.where(masses > 0.0, np.sqrt(masses), np.sqrt(np.repeat(masses[::3], 3)) * arms)
        change = np.concatenate([after.v[n] - before.v[n] for n in names]) * masses / roots
        columns, approach = self.impulses(before, after)
        size = float(np.abs(change).max())
        energy = before.kinetic()
        whole = sum(part.mass for part in parts.values())
        swift = math.sqrt(whole) * self.swift
        least = (SERIES if float(event.state.t[0]) in self.series else NOTHING) * swift
        if size > least:
            matrix = np.array(columns).T / roots[:, None] if columns else np.zeros((len(roots), 1))
            lengths = np.sqrt((matrix**2).sum(axis=0))
            matrix = matrix / np.where(lengths > 0.0, lengths, 1.0)
            off = nearest_of_cone(matrix, change / size)[1]
            if off > IMPULSE and off * size > least:
                told = f"{event.name} of {event.contact}"
                self.fault("impulse", off, f"{told}, change {size / swift:.2g} of the momentum")
        gain = after.kinetic() - energy
        if gain > 1e-9 * max(energy, after.kinetic()) and size > least:
            self.fault("impact gains", gain / energy, f"{event.name} of {event.contact}")
        if size > least and event.name == "impact":
            self.law(before, after, roots, event)
            self.given(before, after, event)
        for name, rate, scale in approach:
            if rate < -RATE * scale:
                self.fault(
                    "goes on in", -rate / scale, f"{name} after {event.name} of {event.contact}"
                )

    def law(self, before: State, after: State, roots: Array, event: Any) -> None:
        """The impact of one place alone: its rates after it by Newton's or Poisson's law."""
        scene, names = self.scene, list(self.scene.parts)
        struck = {n for n in names if not np.array_equal(before.v[n], after.v[n])}
        near = 1e3 * CLOSED * self.length
        places = [
            (one, s)
            for one in scene.touching
            if struck & {one.i[0], one.j[0]}
            for s in before.spots(one)
            if s.gap < near
        ]
        for rope in scene.ropes:
            far = math.dist(before.place(*rope.i), before.place(*rope.j))
            if struck & {rope.i[0], rope.j[0]} and far > rope.length - near:
                return
        if any(scene.parts[name].inertia == 0.0 for name in struck):
            return
        joints = (*scene.pins, *scene.guides)
        if len(places) != 1 or any(one.limits or one.friction > 0.0 for one in joints):
            return
        (one, spot) = places[0]
        rows = [self.column(before, w, spot.place, one) for w in (spot.normal, spot.tangent)]
        W = np.array(rows) / roots
        held = self.joint_rows(before, names) / roots
        if len(held):  # what is left of the directions that joints allow
            W = W - W @ np.linalg.pinv(held) @ held
        v = np.concatenate([before.v[n] for n in names]) * roots
        u = np.concatenate([after.v[n] for n in names]) * roots
        found = possible_impulses(W @ W.T, W @ v, one.friction, one.restitution, one.law)
        off = min((float(np.abs(v + W.T @ p - u).max()) for p in found), default=math.inf)
        scale = float(np.abs(v).max())
        if off > IMPULSE * scale:
            told = f"{one.name}: {one.law}, e {one.restitution:.3g}, {len(found)} solutions"
            self.fault("law of impact", off / scale, told)

    def given(self, before: State, after: State, event: Any) -> None:
        """What the event says that contacts gave: within cones, and what their bodies got."""
        scene, parts = self.scene, self.scene.parts
        every = {one.name: event.impulse(one.name) for one in scene.touching}
        every |= {rope.name: event.impulse(rope.name) for rope in scene.ropes}
        greatest = max((math.hypot(*p) for p in every.values()), default=0.0)
        tied = {one.body for one in scene.guides}
        tied |= {body for pin in scene.pins for body, _ in (pin.i, pin.j)}
        tied |= {body for r in scene.ropes if any(every[r.name]) for body, _ in (r.i, r.j)}
        for one in scene.touching:
            normal, along = every[one.name]
            past = max(-normal, abs(along) - one.friction * max(normal, 0.0))
            if past > IMPULSE * greatest:
                told = f"{one.name} gives {normal:.6g}, {along:.6g}, mu {one.friction:.6g}"
                self.fault("given impulse", past / greatest, told)
            for body, _ in (one.i, one.j):
                others = [
                    t.name for t in scene.touching if t is not one and body in (t.i[0], t.j[0])
                ]
                if body == GROUND or body in tied or any(any(every[k]) for k in others):
                    continue
                if not normal:
                    continue
                spot = min(before.spots(one), key=lambda s: s.gap)
                got = parts[body].mass * (after.v[body] - before.v[body])[:2]
                off = abs(abs(float(got @ spot.normal)) - normal)
                off = max(off, abs(abs(float(got @ spot.tangent)) - abs(along)))
                # a heavy body hardly changes its rates
                digits = ROUNDING * parts[body].mass * float(np.abs(before.v[body][:2]).max())
                if off > IMPULSE * greatest + digits:
                    told = f"{one.name} gives {normal:.6g}, {along:.6g}; {body} gets {got}"
                    self.fault("given impulse", off / greatest, told)

    def column(self, state: State, force: Array, place: Array, one: Touching) -> Array:
        """Generalized forces of a force on j and its reaction on i."""
        names = list(self.scene.parts)
        row = np.zeros(3 * len(names))
        for (body, _), sign in ((one.j, 1.0), (one.i, -1.0)):
            if body != GROUND:
                k = 3 * names.index(body)
                row[k : k + 3] = sign * np.array([*force, cross(place - state.q[body][:2], force)])
        return row

    def joint_rows(self, state: State, names: list[str]) -> Array:
        rows = [
            self.column(state, way, state.place(*pin.j), Touching("", pin.i, pin.j))
            for pin in self.scene.pins
            for way in np.eye(2)
        ]
        for guide in self.scene.guides:
            row = np.zeros((2, 3 * len(names)))
            k = 3 * names.index(guide.body)
            row[0, k : k + 2] = -math.sin(guide.angle), math.cos(guide.angle)
            row[1, k + 2] = 1.0
            rows += list(row)
        return np.array(rows).reshape(len(rows), 3 * len(names))

    def impulses(
        self, state: State, after: State
    ) -> tuple[list[Array], list[tuple[str, float, float]]]:
        """Generators of what may act at an impact, and rates after it that must not approach."""
        columns: list[Array] = []
        approach: list[tuple[str, float, float]] = []
        swift, near = self.swift, TOUCHES * self.length
        for one in self.scene.touching:
            for s in state.spots(one):
                if s.gap > CLOSED * self.length:
                    continue
                for part in (one.friction, -one.friction):
                    columns.append(self.column(state, s.normal + part * s.tangent, s.place, one))
                rate = (after.rate(one.j[0], s.place) - after.rate(one.i[0], s.place)) @ s.normal
                if s.gap < near:
                    approach.append((one.name, float(rate), swift))
        for rope in self.scene.ropes:
            a, b = state.place(*rope.i), state.place(*rope.j)
            far = float(np.hypot(*(b - a)))
            if far > rope.length - CLOSED * self.length:
                n = (a - b) / far
                columns.append(
                    self.column(state, n, b, Touching("", (GROUND, ""), rope.j))
                    + self.column(state, -n, a, Touching("", (GROUND, ""), rope.i))
                )
                rate = (after.rate(rope.j[0], b) - after.rate(rope.i[0], a)) @ n
                if far > rope.length - near:
                    approach.append((rope.name, float(rate), swift))
        joints = self.joint_rows(state, list(self.scene.parts))
        columns += [*joints, *-joints]
        for one in (*self.scene.pins, *self.scene.guides):
            if one.friction > 0.0:  # by how much the reaction lets it is a test of its own
                columns += [(row := self.sliding(one)), -row]
        for one in (*self.scene.pins, *self.scene.guides):
            for row, gap, unit in self.limited(state, one):
                if gap < CLOSED * unit:
                    columns.append(row)
                    rates = np.concatenate([after.v[n] for n in self.scene.parts])
                    scale = swift if hasattr(one, "angle") else swift / self.size
                    if gap < TOUCHES * unit:
                        approach.append((one.name, float(row @ rates), scale))
        return columns, approach

    def sliding(self, one: Any) -> Array:
        """The generalized force along the freedom of a joint."""
        names = list(self.scene.parts)
        row = np.zeros(3 * len(names))
        if hasattr(one, "angle"):
            k = 3 * names.index(one.body)
            row[k : k + 2] = math.cos(one.angle), math.sin(one.angle)
            return row
        for (body, _), sign in ((one.j, 1.0), (one.i, -1.0)):
            if body != GROUND:
                row[3 * names.index(body) + 2] = sign
        return row

    def limited(self, state: State, one: Any) -> list[tuple[Array, float, float]]:
        """Generalized forces of the limits of a joint, how far they are, and the unit of that."""
        if not one.limits:
            return []
        row = self.sliding(one)
        if hasattr(one, "angle"):
            unit, value = self.length, self.travel(state, one)[0]
        else:
            unit, value = 1.0, state.q[one.j[0]][2] - state.q[one.i[0]][2]
        low, high = one.limits
        return [(row, value - low, unit), (-row, high - value, unit)]

    # -- energy -----------------------------------------------------------------------------

    def energies(self) -> None:
        """E + what was lost = E at the start, with own energies; what is lost only grows."""
        run, scene = self.run, self.scene
        whole = np.array([s.energy() for s in self.states])
        lost = {k: np.asarray(v, float) for k, v in run.energy.lost.items()}
        total = whole + sum(lost.values(), np.zeros(len(whole)))
        kinetic = max(s.kinetic() for s in self.states)
        fall = sum(p.mass for p in scene.parts.values()) * scene.gravity * self.size
        scale = max(kinetic, fall, float(np.ptp(whole)))
        off = float(np.abs(total - total[0]).max()) / scale
        limit = max(1e-7, 1e3 * scene.rtol)
        if not off < limit:
            k = int(np.abs(total - total[0]).argmax())
            self.t = float(run.t[k])
            self.fault("energy", off, f"{total - total[0]}")
        # at an impact of several contacts one of them may give what the others take
        history = sum(lost.values(), np.zeros(len(whole)))
        back = float((-np.diff(history)).max(initial=0.0)) / scale
        if back > limit:
            self.t = float(run.t[int(np.diff(history).argmin()) + 1])
            self.fault("friction gives", back, ", ".join(lost))


def possible_impulses(G: Array, c: Array, mu: float, e: float, law: str) -> list[Array]:
    """Impulses (N, T) of one place with rates c before: all that the law allows, by trying modes.

    Newton: the normal rate after it is −e of that before. Poisson: compression up to no normal
    rate, then e of its impulse at least, friction within the cone of what acts in that phase.
    """
    if law == "newton" or e == 0.0:
        return phase(G, c + np.array([e * min(c[0], 0.0), 0.0]), mu, 0.0)
    return [
        one + two for one in phase(G, c, mu, 0.0) for two in phase(G, c + G @ one, mu, e * one[0])
    ]


def phase(G: Array, c: Array, mu: float, given: float) -> list[Array]:
    """(N, T), N ≥ given, with 0 ≤ w_N ⊥ N − given ≥ 0, T against w_T or sticking; w = c + G p."""
    found, size = [], 1e-9 * (float(np.abs(c).max()) + 1e-300)
    for presses in (False, True):
        for slip in (0.0, 1.0, -1.0):
            # N = given or w_N = 0; T = −slip μ N or w_T = 0
            rows = [G[0], G[1] if slip == 0.0 else np.array([slip * mu, 1.0])]
            right = [-c[0], -c[1] if slip == 0.0 else 0.0]
            if not presses:
                rows[0], right[0] = np.array([1.0, 0.0]), given
            if mu == 0.0:
                rows[1], right[1] = np.array([0.0, 1.0]), 0.0
            try:
                p = np.linalg.solve(np.array(rows), np.array(right))
            except np.linalg.LinAlgError:
                continue
            w = c + G @ p
            force = 1e-9 * (abs(p[0]) + given)
            if p[0] < given - force or w[0] < -size or abs(p[1]) > mu * p[0] + force:
                continue
            if mu and slip and slip * w[1] < -size:
                continue
            found.append(p)
    return found


def faults_of(scene: Scene, run: Any) -> list[Fault]:
    """What is wrong with a run of a scene."""
    return Checks(scene, run).all()
