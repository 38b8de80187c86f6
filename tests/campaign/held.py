"""Statics and kinetostatics of bodies on contacts, pins and ropes, against a linear program.

A driver holds or leads what the contacts leave free. Balance, cones, ropes that pull make a set of
forces that is convex: its extremes are the bands of efforts and reactions, and what has none is
unique. The programs read the description of the scene and printed motions, nothing of mbody.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog

import mbody
from mbody import AngleDriver, CoordinateDriver, Marker
from mbody.errors import ModelWarning
from mbody.laws import ConstantSpeed
from tests.campaign.analyses import Finding
from tests.campaign.scene_checks import CLOSED, Checks, Fault, State, cross
from tests.campaign.scenes import (
    GROUND,
    MASSES,
    SIZES,
    TIMES,
    Drawing,
    Pinned,
    Scene,
    Tied,
    Touching,
    laid,
    stacked,
    wedged,
)

__all__ = ["HELD", "Hand", "examine_held", "random_held", "random_mechanism"]

Array = Any
#: Of the greatest force: how far a bound may be from that of the program, which forces are equal.
BOUND, EQUAL = 1e-6, 1e-5


@dataclass
class Hand:
    """A driver: of a point of a body along a direction, or of its angle (`point` empty)."""

    name: str
    body: str
    point: str = ""
    angle: float = 0.0
    value: float = 0.0
    speed: float = 0.0


def along(scene: Scene, hand: Hand) -> float:
    """Where a hand is at the start."""
    part = scene.parts[hand.body]
    x, y, a = part.pose
    if not hand.point:
        return a
    px, py = part.points[hand.point]
    wx = x + math.cos(a) * px - math.sin(a) * py
    wy = y + math.sin(a) * px + math.cos(a) * py
    return wx * math.cos(hand.angle) + wy * math.sin(hand.angle)


# -- what is drawn ----------------------------------------------------------------------------


def feet(draw: Drawing) -> list[Hand]:
    """A rod or a box on two to four places of a slope."""
    shape = "box" if draw.chance(0.3) else "rod"
    count = int(draw.rng.integers(2, 5)) if shape == "rod" else 0
    part = draw.part("a", shape, [0.0, 0.0, 0.0], count)
    angle = draw.floor(0.6)
    laid(draw, part, angle)
    draw.contacts(part, "floor")
    draw.push(part)
    return [Hand("hand", "a", "C", angle)]


def groove(draw: Drawing) -> list[Hand]:
    """A disc in a groove, or a ladder."""
    wedged(draw)
    part = draw.scene.parts["a"]
    if part.radius:
        return [Hand("hand", "a")]
    return [Hand("hand", "a", "P1", draw.scene.lines["floor"][1])]


def hung(draw: Drawing) -> list[Hand]:
    """A rod on two ropes that are taut, or on three that are parallel."""
    count = int(draw.rng.integers(2, 4))
    part = draw.part("a", "rod", [0.0, 0.0, draw.between(-0.3, 0.3)], count)
    x, y, a = part.pose
    lean = draw.between(-0.3, 0.3)
    for k in range(count):
        px, py = part.points[f"P{k}"]
        here = (x + math.cos(a) * px - math.sin(a) * py, y + math.sin(a) * px + math.cos(a) * py)
        length = draw.between(0.5, 1.5)
        lean += draw.between(-0.2, 0.2) if count == 2 else 0.0
        top = (here[0] + length * math.sin(lean), here[1] + length * math.cos(lean))
        draw.scene.ground[f"R{k}"] = top
        far = math.dist(top, here)
        draw.scene.ropes.append(Tied(f"rope {k}", (GROUND, f"R{k}"), ("a", f"P{k}"), far))
    if draw.chance(0.5):
        draw.push(part, 0.4)
    return [Hand("hand", "a", "C", 0.0)]


def hinged(draw: Drawing) -> list[Hand]:
    """A rod on a pin, smooth or with friction, that lies on one to three places of a floor."""
    count = int(draw.rng.integers(2, 5))
    part = draw.part("a", "rod", [0.0, 0.0, 0.0], count)
    angle = draw.floor(0.4)
    laid(draw, part, angle)
    draw.contacts(part, "floor")
    draw.scene.touching = draw.scene.touching[1:]
    x, y, a = part.pose
    px, py = part.points["P0"]
    draw.scene.ground["H"] = (
        x + math.cos(a) * px - math.sin(a) * py,
        y + math.sin(a) * px + math.cos(a) * py,
    )
    draw.scene.pins.append(Pinned("pin", (GROUND, "H"), ("a", "P0")))
    if draw.chance(0.5):
        draw.push(part)
    return []


def stood(draw: Drawing) -> list[Hand]:
    """Two or three boxes on each other, each held along the slope."""
    stacked(draw)
    angle = draw.scene.lines["floor"][1]
    return [Hand(f"hand {n}", n, "C", angle) for n in draw.scene.parts]


HELD = {
    "feet": (feet, 0.35),
    "groove": (groove, 0.25),
    "hung": (hung, 0.15),
    "hinged": (hinged, 0.1),
    "stood": (stood, 0.15),
}


def random_held(seed: int) -> tuple[Scene, list[Hand]]:
    """The scene of a seed, and what holds it."""
    rng = np.random.default_rng([seed, 0x4E1D])
    names = list(HELD)
    kind = str(rng.choice(names, p=[HELD[n][1] for n in names]))
    draw = Drawing(rng, kind)
    hands = HELD[kind][0](draw)
    scene = draw.scene
    for part in scene.parts.values():
        part.rates = [0.0, 0.0, 0.0]
    for hand in hands:
        hand.speed = draw.between(-1.0, 1.0) if draw.chance(0.5) else 0.0
    if not draw.chance(0.3):
        masses = [math.log10(p.mass) for p in scene.parts.values()]
        mass = draw.between(MASSES[0] - min(masses), MASSES[1] - max(masses))
        length, time = draw.between(*SIZES), draw.between(*TIMES)
        scene.scaled(10.0**length, 10.0**mass, 10.0**time)
        for hand in hands:
            hand.speed *= (10.0**length if hand.point else 1.0) / 10.0**time
    for hand in hands:
        hand.value = along(scene, hand)
    return scene, hands


def held(scene: Scene, hands: list[Hand], name: str) -> mbody.Mechanism:
    """The mechanism with its drivers."""
    made = scene.mechanism(name)
    for hand in hands:
        law = ConstantSpeed(hand.value, hand.speed)
        if hand.point:
            rail = Marker(GROUND, (0.0, 0.0), hand.angle)
            made.add(CoordinateDriver(hand.name, rail, f"{hand.body}.{hand.point}", law))
        else:
            made.add(AngleDriver(hand.name, hand.body, law))
    return made


def random_mechanism(seed: int, name: str) -> mbody.Mechanism:
    """The mechanism of a seed."""
    return held(*random_held(seed), name)


# -- the program ------------------------------------------------------------------------------


class Program:
    """Unknown forces of a scene at one instant, their balance and their limits."""

    def __init__(self, checks: Checks, hands: list[Hand], state: State, moving: bool) -> None:
        self.scene, self.state = checks.scene, state
        names = list(self.scene.parts)
        self.columns: list[Array] = []
        #: (name, force on j (fx, fy) of each unknown)
        self.owners: list[tuple[str, Array]] = []
        self.low: list[float | None] = []
        self.high: list[float | None] = []
        self.cones: list[tuple[dict[int, float], str]] = []
        reach = CLOSED * checks.length
        for one in self.scene.touching:
            for s in state.spots(one):
                if s.gap > reach:
                    continue
                slip = float(
                    (state.rate(one.j[0], s.place) - state.rate(one.i[0], s.place)) @ s.tangent
                )
                if moving and abs(slip) > 1e-9 * checks.swift:
                    f = s.normal - math.copysign(one.friction, slip) * s.tangent
                    self.unknown(one.name, checks.column(state, f, s.place, one), f, 0.0)
                    continue
                row = checks.column(state, s.normal, s.place, one)
                n = self.unknown(one.name, row, s.normal, 0.0)
                row = checks.column(state, s.tangent, s.place, one)
                t = self.unknown(one.name, row, s.tangent, None)
                for sign in (1.0, -1.0):
                    self.cones.append(({t: sign, n: -one.static}, one.name))
        for rope in self.scene.ropes:
            a, b = state.place(*rope.i), state.place(*rope.j)
            far = float(np.hypot(*(b - a)))
            if far > rope.length - reach:
                n = (a - b) / far
                row = checks.column(state, n, b, Touching("", (GROUND, ""), rope.j))
                row = row + checks.column(state, -n, a, Touching("", (GROUND, ""), rope.i))
                self.unknown(rope.name, row, n, 0.0)
        for pin in self.scene.pins:
            for way in np.eye(2):
                row = checks.column(state, way, state.place(*pin.j), Touching("", pin.i, pin.j))
                self.unknown(pin.name, row, way, None)
        for hand in hands:
            row = np.zeros(3 * len(names))
            k = 3 * names.index(hand.body)
            if hand.point:
                way = np.array([math.cos(hand.angle), math.sin(hand.angle)])
                arm = state.place(hand.body, hand.point) - state.q[hand.body][:2]
                row[k : k + 3] = [*way, cross(arm, way)]
            else:
                row[k + 2] = 1.0
            self.unknown(hand.name, row, np.zeros(2), None)
        load = []
        for name, part in self.scene.parts.items():
            fx, fy = self.scene.pushes.get(name, (0.0, 0.0))
            gx, gy = part.mass * self.scene.gravity * np.array(self.scene.down)
            a = state.a[name] if moving else np.zeros(3)
            load += [fx + gx - part.mass * a[0], fy + gy - part.mass * a[1], -part.inertia * a[2]]
        unit = np.tile([1.0, 1.0, 1.0 / checks.size], len(names))
        self.load = np.array(load) * unit
        self.A = np.array(self.columns).T * unit[:, None]
        # unknowns of the same size, also torques
        weights = [part.mass * self.scene.gravity for part in self.scene.parts.values()]
        self.scale = max(float(np.abs(self.load).max()), *weights)
        self.weights = 1.0 / np.maximum(np.abs(self.A).max(axis=0), 1e-300)

    def unknown(self, name: str, row: Array, force: Array, low: float | None) -> int:
        self.columns.append(row)
        self.owners.append((name, force))
        self.low.append(low)
        return len(self.columns) - 1

    def extreme(self, goal: Array) -> float | None:
        """The least value of a form of the unknowns; −inf, or None where nothing balances."""
        count = len(self.columns)
        upper = np.zeros((len(self.cones), count))
        for k, (row, _) in enumerate(self.cones):
            for i, part in row.items():
                upper[k, i] = part
        w = self.weights
        size = max(float(np.abs(goal * w).max()), 1e-300)
        done = linprog(
            goal * w / size,
            A_ub=upper * w if self.cones else None,
            b_ub=np.zeros(len(self.cones)) if self.cones else None,
            A_eq=self.A * w,
            b_eq=-self.load / self.scale,
            bounds=[(low, None) for low in self.low],
            method="highs",
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        if done.status == 3:
            return -math.inf
        return float(done.fun) * size * self.scale if done.status == 0 else None

    @property
    def feasible(self) -> bool:
        """Whether some forces balance."""
        return self.extreme(np.zeros(len(self.columns))) is not None

    def forms(self, name: str) -> list[Array]:
        """fx and fy of what has this name, or the effort."""
        rows = [np.zeros(len(self.columns)) for _ in range(2)]
        for k, (owner, force) in enumerate(self.owners):
            if owner == name:
                for row, part in zip(rows, force, strict=True):
                    row[k] = part
        return rows

    def effort(self, name: str) -> Array:
        return np.array([float(owner == name) for owner, _ in self.owners])

    def band(self, form: Array) -> tuple[float, float] | None:
        low, high = self.extreme(form), self.extreme(-form)
        return None if low is None or high is None else (low, -high)


def program_of(scene: Scene, hands: list[Hand], run: Any, moving: bool) -> tuple[Checks, Program]:
    """The checks of a run of one instant, and its program; of statics without rates."""
    checks = Checks(scene, run)
    state = checks.states[0]
    if not moving:
        for name in (*scene.parts, GROUND):
            state.a[name] = state.v[name] = np.zeros(3)
    return checks, Program(checks, hands, state, moving)


def has_forces(scene: Scene, hands: list[Hand], run: Any, moving: bool) -> bool:
    """Whether some forces are admissible."""
    return program_of(scene, hands, run, moving)[1].feasible


def faults_of_held(scene: Scene, hands: list[Hand], run: Any, moving: bool) -> list[Fault]:
    """Forces that break a law, and bands and marks that are not those of the program."""
    checks, program = program_of(scene, hands, run, moving)
    state = checks.states[0]
    checks.forces(state, 0, {hand.name: hand for hand in hands})
    if not program.feasible:  # the forces that are printed break some law, which is to be said
        checks.faults.clear()
        said = any("would have to" in note for note in run.notes)
        if not said and all(doubt.kind != "inadmissible" for doubt in run.doubts):
            checks.fault("nothing balances", math.inf, "forces are printed, and nothing is said")
        return checks.faults
    unit = program.scale
    for hand in hands:
        band = program.band(program.effort(hand.name))
        length = 1.0 if hand.point else checks.size
        unique = run.unique_effort(hand.name)
        compare(checks, hand.name, band, unique, bounds(run, hand.name, None), unit * length)
    for one in (*scene.touching, *scene.ropes, *scene.pins):
        reaction = run.reaction(one.name)
        sign = 1.0 if reaction.on == one.j[0] else -1.0
        for k, (key, form) in enumerate(zip(("fx", "fy"), program.forms(one.name), strict=True)):
            band, said = program.band(sign * form), bounds(run, one.name, key)
            compare(checks, f"{one.name}.{key}", band, reaction.unique[k], said, unit)
    return checks.faults


def bounds(run: Any, name: str, key: str | None) -> tuple[float, float] | None:
    try:
        found = run.range(name)
    except mbody.ModelError:
        return None
    ends = (found.low, found.high)
    values = [getattr(end, key) if key else end for end in ends]
    return float(values[0][0]), float(values[1][0])


def compare(checks: Checks, name: str, band: Any, unique: Any, said: Any, unit: float) -> None:
    if band is None:
        return
    width = band[1] - band[0]
    if unique is not None and bool(np.all(unique)) and width > EQUAL * unit:
        told = f"{name} is marked unique: {band[0]:.6g} … {band[1]:.6g}"
        checks.fault("unique", width / unit, told)
    if said is not None and all(map(math.isfinite, (*band, *said))):
        off = max(abs(said[0] - band[0]), abs(said[1] - band[1]))
        if off > BOUND * unit:
            told = f"{name}: {said[0]:.6g} … {said[1]:.6g}, right {band[0]:.6g} … {band[1]:.6g}"
            checks.fault("range", off / unit, told)


def examine_held(seed: int) -> Finding:
    """Draw the scene of a seed, hold it or lead it, and judge the forces."""
    scene, hands = random_held(seed)
    moving = any(hand.speed for hand in hands)
    analysis = mbody.kinetostatics if moving else mbody.statics
    model = held(scene, hands, f"held {seed}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        try:
            run = analysis(model, t=[0.0])
            if not np.isfinite([run.effort(hand.name)[0] for hand in hands]).all():
                return Finding(scene.kind, 1, refused=1, told=run.status, model=model)
            faults = faults_of_held(scene, hands, run, moving)
        except (mbody.ModelError, mbody.SolveError) as error:
            told = f"{type(error).__name__}: {error}"
            return Finding(scene.kind, 1, refused=1, told=told, model=model)
    counts = ", ".join(f"{n} {kind}" for kind, n in Counter(f.kind for f in faults).items())
    told = f"{counts}; {max(faults, key=lambda f: f.size)}" if faults else ""
    kinds = {doubt.kind for doubt in run.doubts}
    if kinds == {"inadmissible"} and not faults and not has_forces(scene, hands, run, moving):
        return Finding(scene.kind, 1)  # it says what is so
    if run.doubts or run.status != "completed":
        told = f"{told or 'nothing wrong'}; {run.status}"
        return Finding(scene.kind, 1, doubted=1, told=told, model=model)
    return Finding(scene.kind, 1, silent=int(bool(faults)), told=told, model=model)
