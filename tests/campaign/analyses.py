"""The analyses of the campaign, each with its truth: what agrees, is doubted, or is silent."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import mbody
from mbody import Mechanism, ModelError, SolveError
from mbody.engineering import close_loops
from mbody.errors import ModelWarning
from tests.campaign.drawing import random_linkage
from tests.campaign.linkage import Linkage
from tests.campaign.loads import Acting, random_loads

__all__ = ["ANALYSES", "Finding", "examine"]

Array = Any

#: How far numbers may be apart, as parts of the greatest of their kind over the run. Positions and
#: rates are exact to rounding on both sides, times the condition of the groups, 1/√margin each;
#: accelerations of the truth are differences of step 1e-5, which round at 1e-16/1e-5.
POSITION, RATE, CHANGE, FORCE = 1e-10, 1e-9, 1e-6, 1e-6
#: Designs of one topology that are analysed side by side, and how much their numbers differ.
DESIGNS, SPREAD = 60, 0.02
#: Places of a turn at which a design must close.
FINE = 5761


@dataclass(frozen=True)
class Finding:
    """One mechanism, or the designs of one topology, in one analysis.

    Attributes
    ----------
    count : int
        Mechanisms that were looked at.
    doubted, refused : int
        Of these, results that carry a doubt or that are wrong with a note, and those that ended in
        an error with a sentence.
    silent : int
        Wrong results that say nothing.
    told : str
        What was wrong, or why it was refused.
    model : Mechanism or None
        The mechanism, where something was wrong.
    """

    analysis: str
    count: int
    doubted: int = 0
    refused: int = 0
    silent: int = 0
    told: str = ""
    model: Mechanism | None = None


def apart(ours: Array, truth: Array) -> Array:
    """Greatest difference over the instants, as a part of the greatest of the truth, at least 1."""
    size = np.maximum(1.0, np.abs(truth).max(axis=(0, -1), keepdims=True))
    return (np.abs(ours - truth) / size).max(axis=(0, -1))


def conditions(of: Linkage) -> float:
    """How much rounding may grow: the product of 1/sin of the flattest angle of three groups."""
    worst = sorted(of.margins)[:3]
    return float(np.prod([1.0 / math.sqrt(min(1.0, margin)) for margin in worst]))


def of_positions(of: Linkage, run: Any, truth: dict[str, Array]) -> dict[str, Array]:
    """Differences of positions, rates and accelerations, arrays (designs,) or numbers."""
    worst: dict[str, Array] = {"position": 0.0, "rate": 0.0, "acceleration": 0.0}
    for name, rows in truth.items():
        body = run[name]
        turn = np.exp(1j * body.angle) - np.exp(1j * rows[2])
        place = np.array([body.x - rows[0], body.y - rows[1], np.abs(turn)])
        size = max(1.0, float(np.abs(rows[:2]).max()))
        worst["position"] = np.maximum(worst["position"], np.abs(place).max(axis=(0, -1)) / size)
        rates = np.array([body.vx, body.vy, body.omega])
        worst["rate"] = np.maximum(worst["rate"], apart(rates, rows[3:6]))
        changes = np.array([body.ax, body.ay, body.alpha])
        worst["acceleration"] = np.maximum(worst["acceleration"], apart(changes, rows[6:9]))
    return worst


def of_forces(of: Linkage, acting: Acting, run: Any, truth: Any, values: Any) -> dict[str, Array]:
    """Newton and Euler of every body, and the power of the drivers, with the true motion."""
    wrenches = acting.wrenches(truth, values)
    left, size = {}, 0.0
    for name, rows in truth.items():
        m, inertia = values.get(f"{name}.mass", 0.0), values.get(f"{name}.inertia", 0.0)
        forces = np.array([m * rows[6], m * rows[7], inertia * rows[8]])
        left[name] = wrenches[name] - forces
        size = np.maximum(size, np.abs(forces).max(axis=(0, -1)))
        size = np.maximum(size, np.abs(wrenches[name]).max(axis=(0, -1)))
    power = sum((part * truth[name][3:6]).sum(axis=0) for name, part in left.items())
    for joint in run.mechanism.joints:
        one, (px, py) = run.reaction(joint.name), run.reaction_point(joint.name)
        size = np.maximum(size, one.magnitude.max(axis=-1))
        for body, sign in ((joint.j.body, 1.0), (joint.i.body, -1.0)):
            if body != "ground":
                rx, ry = px - truth[body][0], py - truth[body][1]
                torque = one.torque + rx * one.fy - ry * one.fx
                left[body] = left[body] + sign * np.array([one.fx, one.fy, torque])
    for coupling in run.mechanism.couplings:
        effort = run.effort(coupling.name)
        for term in coupling.parts:
            left[term.angle][2] += term.factor * effort
    for name, body, *_ in of.drivers:
        effort = run.effort(name)
        size = np.maximum(size, np.abs(effort).max(axis=-1))
        left[body][2] += effort
        power = power + effort * truth[body][5]
    size = np.maximum(size, 1e-6)
    balance = np.max([np.abs(part).max(axis=(0, -1)) for part in left.values()], axis=0)
    fastest = max(np.abs(rows[3:6]).max() for rows in truth.values())
    return {"balance": balance / size, "power": np.abs(power).max(axis=-1) / (size * fastest)}


LIMITS = {
    "position": POSITION,
    "rate": RATE,
    "acceleration": CHANGE,
    "balance": FORCE,
    "power": FORCE,
}


def broken(of: Linkage, found: dict[str, Array]) -> tuple[Array, str]:
    """Which designs are wrong, and a sentence of the greatest differences."""
    condition = conditions(of)
    wrong: Array = False
    for key, value in found.items():
        power = 1 if key == "position" else 3
        wrong = wrong | ~(np.asarray(value) <= LIMITS[key] * condition**power)
    return wrong, ", ".join(f"{key} {np.max(value):.1e}" for key, value in found.items())


# -- the analyses -----------------------------------------------------------------------------


def turn(of: Linkage, rng: np.random.Generator) -> Finding:
    """Inverse dynamics of one mechanism over a turn, at few or many instants."""
    acting = random_loads(of)
    machine = of.mechanism("turn")
    machine.add(*acting.elements)
    count = int(rng.choice([2, 5, 13, 37, 121]))
    t = np.linspace(0.0, of.span, count)
    run = mbody.kinetostatics(machine, t=t)
    truth = of.motion(t)
    found = of_positions(of, run, truth)
    found |= of_forces(of, acting, run, truth, of.values)
    wrong, told = broken(of, found)
    return finding("turn", machine, run, bool(wrong), told)


def designs(of: Linkage, rng: np.random.Generator) -> Finding:
    """Inverse dynamics of many designs of one topology side by side."""
    acting = random_loads(of)
    machine = of.mechanism("designs")
    machine.add(*acting.elements)
    changed: dict[str, Array] = dict(of.values)
    # numbers that differ by more could open a group between the places that are looked at
    spread = min(SPREAD, 0.02 * min(of.margins))
    for key in [key for key in of.values if key.endswith((".C.x", ".mass", "_rod.length"))]:
        part = 1.0 + spread * rng.uniform(-1.0, 1.0, (DESIGNS, 1))
        part[0] = 1.0
        changed[key] = of.values[key] * part
    for key, source in of.ties.items():
        changed[key] = changed[source]
    fine = np.linspace(0.0, of.span, FINE)
    with np.errstate(invalid="ignore"):
        whole = of.poses(fine[None, :], changed)
    good = np.isfinite(sum((pose.c + pose.s).sum(axis=-1) for pose in whole.values()))
    good = np.broadcast_to(good, (DESIGNS,))
    changed = {k: v[good] if np.ndim(v) else v for k, v in changed.items()}
    count = int(good.sum())
    t = np.linspace(0.0, of.span, int(rng.choice([5, 13, 25])))
    values = {key: value[:, 0] for key, value in changed.items() if np.ndim(value)}
    if not values or count < 2:
        return Finding("designs", 0)
    system = mbody.assemble(machine).with_values(values)
    run = mbody.kinetostatics(system, t=t)
    truth = of.motion(t[None, :], changed)
    found = of_positions(of, run, truth)
    found |= of_forces(of, acting, run, truth, changed)
    wrong, told = broken(of, found)
    number = int(np.sum(np.broadcast_to(wrong, (count,))))
    return finding("designs", machine, run, number, told, count)


def released(of: Linkage, rng: np.random.Generator) -> Finding:
    """Free motion of the same linkage from the crank's angle and rate: energy and branch."""
    if len(of.drivers) > 1 or of.drivers[0][4]:
        return Finding("free", 0)
    acting = random_loads(of, conservative=True)
    machine = of.mechanism("free", driven=False)
    machine.add(*acting.elements)
    _, crank, start, speed, _ = of.drivers[0]
    rtol = float(rng.choice([1e-4, 1e-6, 1e-8, 1e-10]))
    begin = close_loops(machine, guess={crank: start}, rates={crank: speed})
    until = float(rng.uniform(0.2, 1.5)) * of.span
    run = mbody.simulate(machine, until, start=begin, rtol=rtol, instants=9)
    # where the crank is, and how fast, all else follows from the closed form
    t = (run[crank].angle - start) / speed
    truth = of.motion(t)
    worst: dict[str, Array] = {"position": 0.0}
    for name, rows in truth.items():
        body = run[name]
        turned = np.abs(np.exp(1j * body.angle) - np.exp(1j * rows[2])).max()
        size = max(1.0, float(np.abs(rows[:2]).max()))
        off = max(np.abs(body.x - rows[0]).max(), np.abs(body.y - rows[1]).max()) / size
        worst["position"] = max(worst["position"], float(turned), float(off))
    kinetic = energy(of, truth) * (run[crank].omega / speed) ** 2
    whole = kinetic + acting.potential(truth)
    size = max(float(np.abs(kinetic).max()), float(np.ptp(acting.potential(truth))), 1e-9)
    drift = float(np.abs(whole - whole[0]).max()) / size
    condition = conditions(of)
    # ten steps' errors for every unit of time that the fastest link takes, at most
    wrong = not (worst["position"] <= POSITION * condition and drift <= 1e3 * rtol * condition)
    told = f"position {worst['position']:.1e}, energy {drift:.1e} at rtol {rtol:g}"
    return finding("free", machine, run, wrong, told)


def energy(of: Linkage, motion: dict[str, Array]) -> Array:
    """Kinetic energy of a motion."""
    total: Array = 0.0
    for name, rows in motion.items():
        m, inertia = of.values.get(f"{name}.mass", 0.0), of.values.get(f"{name}.inertia", 0.0)
        total = total + 0.5 * m * (rows[3] ** 2 + rows[4] ** 2) + 0.5 * inertia * rows[5] ** 2
    return total


def held(of: Linkage, rng: np.random.Generator) -> Finding:
    """Statics over a turn: efforts by the change of the potential."""
    if len(of.drivers) > 1:
        return Finding("statics", 0)
    acting = random_loads(of, conservative=True)
    machine = of.mechanism("statics")
    machine.add(*acting.elements)
    t = np.linspace(0.0, of.span, 7)
    run = mbody.statics(machine, t=t)
    truth = of.motion(t)
    found = of_positions(of, run, truth)
    found = {"position": found["position"]}
    wrenches = acting.wrenches(
        {k: v * np.r_[1, 1, 1, 0 * np.ones(6)][:, None] for k, v in truth.items()}
    )
    power = sum((w * truth[name][3:6]).sum(axis=0) for name, w in wrenches.items())
    effort = run.effort(of.drivers[0][0])
    size = max(
        1e-6, float(np.abs(effort).max()), *(float(np.abs(w).max()) for w in wrenches.values())
    )
    fastest = max(np.abs(rows[3:6]).max() for rows in truth.values())
    whole = effort * truth[of.drivers[0][1]][5] + power
    found["power"] = float(np.abs(whole).max()) / (size * fastest)
    wrong, told = broken(of, found)
    return finding("statics", machine, run, bool(wrong), told)


def rests(of: Linkage, rng: np.random.Generator) -> Finding:
    """Rest positions of the linkage without its driver, by a scan of the potential's slope."""
    if len(of.drivers) > 1 or of.drivers[0][4] or len(of.points) > 8:
        return Finding("equilibrium", 0)
    acting = random_loads(of, conservative=True)
    machine = of.mechanism("rest", driven=False)
    machine.add(*acting.elements)
    _, crank, start, speed, _ = of.drivers[0]
    angles = np.linspace(0.0, 2.0 * math.pi, 2881)[:-1]
    slope = potential_slope(of, acting, (angles - start) / speed)
    scale = float(np.abs(slope).max())
    if scale < 1e-9:
        return Finding("equilibrium", 0)
    there = np.flatnonzero((slope > 0.0) != (np.roll(slope, -1) > 0.0))
    wanted = np.array([root(of, acting, angles[k], angles[1], start, speed) for k in there])
    # two rests closer than the scan sees, or a slope that only touches zero, are no clear truth
    bend = np.abs(np.diff(np.append(slope, slope[:2]), 2)).max()
    if (np.abs(slope) < bend).any() and tangent(slope, bend):
        return Finding("equilibrium", 0)
    found = mbody.equilibrium(machine)
    got = []
    for rest in found:
        rows = of.motion(np.array([(float(rest[crank].angle[0]) - start) / speed]))
        off = max(
            float(np.abs(np.exp(1j * rest[n].angle) - np.exp(1j * r[2])).max())
            for n, r in rows.items()
        )
        if off < 1e-6:  # on this branch; others are found from starts on them
            got.append(float(rest[crank].angle[0]) % (2.0 * math.pi))
    missing = [w for w in wanted if not any(near(w, g) for g in got)]
    extra = [g for g in got if not any(near(w, g) for w in wanted)]
    told = f"{len(wanted)} rests, missing at {missing}, too many at {extra}"
    return finding("equilibrium", machine, found, bool(missing or extra), told)


def near(a: float, b: float) -> bool:
    """Whether two angles are the same turn apart, to what a flat slope leaves open."""
    return abs(math.remainder(a - b, 2.0 * math.pi)) < 1e-5


def tangent(slope: Array, bend: float) -> bool:
    """Whether the slope comes near zero without a clear crossing."""
    around = np.array([np.roll(slope, k) for k in (-1, 0, 1)])
    low = np.abs(slope) <= 2.0 * bend
    return bool((low & ((around > 0).all(axis=0) | (around < 0).all(axis=0))).any())


def potential_slope(of: Linkage, acting: Acting, t: Array) -> Array:
    """Power of the loads along the motion: minus the slope of the potential."""
    motion = of.motion(t)
    still = {k: v * np.r_[1, 1, 1, np.zeros(6)][:, None] for k, v in motion.items()}
    wrenches = acting.wrenches(still)
    total: Array = sum((w * motion[name][3:6]).sum(axis=0) for name, w in wrenches.items())
    return total


def root(of: Linkage, acting: Acting, a: float, step: float, start: float, speed: float) -> float:
    """A zero of the slope by bisection."""
    low, high = a, a + step

    def at(x: float) -> float:
        return float(potential_slope(of, acting, np.array([(x - start) / speed]))[0])

    sign = at(low) > 0.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        if (at(middle) > 0.0) == sign:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def crosschecks(of: Linkage, rng: np.random.Generator) -> Finding:
    """The dense oracle and the balance on a result of inverse or forward dynamics."""
    acting = random_loads(of)
    machine = of.mechanism("crosscheck")
    machine.add(*acting.elements)
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 0.3 * of.span, 3))
    engines = "pinocchio" if rng.random() < 0.3 else ()
    second = mbody.crosscheck(machine, engines, ours=run)
    told = "; ".join(
        f"{name}: {row.quantity} {row.ours:.6g} {row.theirs:.6g}"
        for name, result in second.opinions.items()
        for row in result.rows
        if row.verdict == "differs"
    )
    return finding("crosscheck", machine, run, second.agrees is False, told)


def written(of: Linkage, rng: np.random.Generator) -> Finding:
    """A model file brings back every number."""
    acting = random_loads(of)
    machine = of.mechanism("file")
    machine.add(*acting.elements)
    again = mbody.from_toml(mbody.to_toml(machine))
    t = np.linspace(0.0, of.span, 3)
    ours, theirs = mbody.kinetostatics(machine, t=t), mbody.kinetostatics(again, t=t)
    same = all(
        np.array_equal(getattr(ours[n], k), getattr(theirs[n], k))
        for n in ours
        for k in ("x", "y", "angle", "alpha")
    )
    return finding("file", machine, theirs, not same, "numbers differ after writing and reading")


def finding(
    analysis: str, model: Mechanism, run: Any, wrong: int, told: str, count: int = 1
) -> Finding:
    """The finding of a result: silent only where nothing in it says that it may be wrong."""
    doubts, notes = tuple(run.doubts), [n for n in run.notes if not _fact(n)]
    if wrong:
        if doubts or notes:
            return Finding(analysis, count, doubted=int(wrong), told=told, model=model)
        return Finding(analysis, count, silent=int(wrong), told=told, model=model)
    if doubts:
        return Finding(
            analysis, count, doubted=1, told=f"doubted: {doubts[0].message}", model=model
        )
    return Finding(analysis, count)


#: Notes that say nothing about the correctness of a result.
FACTS = ("not unique", "least norm", "redundant", "pull", "push")


def _fact(note: str) -> bool:
    return any(part in note for part in FACTS)


#: Analyses with how often each is drawn.
ANALYSES: dict[str, tuple[Callable[[Linkage, np.random.Generator], Finding], float]] = {
    "turn": (turn, 0.25),
    "designs": (designs, 0.45),
    "free": (released, 0.12),
    "statics": (held, 0.06),
    "equilibrium": (rests, 0.05),
    "crosscheck": (crosschecks, 0.03),
    "file": (written, 0.04),
}


def examine(seed: int, margin: float | None = None) -> Finding:
    """Draw the linkage and the analysis of a seed, and judge it."""
    rng = np.random.default_rng([seed, 0xC0FFEE])
    if margin is None and rng.random() < 0.25:
        margin = float(10.0 ** rng.uniform(-8.0, -2.0))
    names = list(ANALYSES)
    name = str(rng.choice(names, p=[ANALYSES[n][1] for n in names]))
    of = random_linkage(seed, margin=margin)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        try:
            return ANALYSES[name][0](of, rng)
        except (ModelError, SolveError) as error:
            told = f"{type(error).__name__}: {error}"
            return Finding(name, 1, refused=1, told=told, model=of.mechanism(name))
