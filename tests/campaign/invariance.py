"""What must not matter: units, size, mass, frame, mirror image, order, which side is i.

A random scene, a random linkage or a model of the gallery is described anew, and its results are
taken back. Powers of two in length and mass leave all digits; all else agrees to rounding, times
what steps and impacts make of it.
"""

from __future__ import annotations

import copy
import itertools
import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

import mbody
from mbody import Mechanism, gallery
from mbody.errors import ModelWarning
from mbody.files.model import in_units
from mbody.files.model.read import built
from mbody.files.model.write import Writer
from mbody.quantities.units import DIMENSIONS, SYMBOLS, Unit, UnitSystem, unit_system
from tests.campaign.analyses import Finding
from tests.campaign.drawing import random_linkage
from tests.campaign.loads import random_loads
from tests.campaign.scenes import Scene, random_scene
from tests.support.gallery_runs import asked

__all__ = ["CHANGES", "UNITS", "examine_invariance"]

Array = Any
#: Accuracy that is asked of motions, and by how many times of it two may differ before impacts.
RTOL, TIMES = 1e-9, 100.0
#: How far from the end of a motion the next may begin: rounding of loops that are closed again.
RESTARTED = 1e-12
#: To which steps with impulses find these.
IMPULSES = 1e-8
#: An impact may magnify a difference so many times; after so many of them only effects compare.
MAGNIFIED, COUNTED = 10.0, 3


@dataclass
class Change:
    """What is done to a scene, and how results are taken back; `swapped`: low limits are high."""

    apply: Callable[[Scene], Scene]
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    angle: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    mirror: bool = False
    swapped: bool = False
    exact: bool = False


def powers_of_two(rng: np.random.Generator) -> Change:
    length, mass = (2.0 ** int(rng.integers(-20, 21)) for _ in range(2))
    return Change(lambda s: s.scaled(length, mass, 1.0), length, mass, exact=True)


def other_scale(rng: np.random.Generator) -> Change:
    length, mass, time = (float(10.0 ** rng.uniform(-6.0, 6.0)) for _ in range(3))
    return Change(lambda s: s.scaled(length, mass, time), length, mass, time)


def rotated(rng: np.random.Generator) -> Change:
    angle = float(rng.uniform(-math.pi, math.pi))
    return Change(lambda s: s.moved(angle, (0.0, 0.0)), angle=angle)


def translated(rng: np.random.Generator) -> Change:
    x, y = (float(part) for part in rng.uniform(-3.0, 3.0, 2))

    def shift(scene: Scene) -> Scene:
        size = max(part.size for part in scene.parts.values())
        change.shift = (x * size, y * size)
        return scene.moved(0.0, change.shift)

    change = Change(shift)
    return change


def mirrored(_: np.random.Generator) -> Change:
    return Change(lambda s: s.mirrored(), mirror=True, swapped=True)


def reordered(rng: np.random.Generator) -> Change:
    return Change(lambda s: s.reordered(rng))


def exchanged(_: np.random.Generator) -> Change:
    return Change(lambda s: s.exchanged(), swapped=True)


CHANGES: dict[str, Callable[[np.random.Generator], Change]] = {
    "powers of two": powers_of_two,
    "scale": other_scale,
    "rotated": rotated,
    "translated": translated,
    "mirrored": mirrored,
    "order": reordered,
    "i and j": exchanged,
}


def states(run: Any, names: list[str], change: Change) -> tuple[Array, Array]:
    """(places and angles, rates) of all bodies, (bodies, 3, instants), taken back."""
    places, rates = [], []
    c, s = math.cos(change.angle), math.sin(change.angle)
    sign = -1.0 if change.mirror else 1.0
    for name in names:
        body = run[name]
        x, y = body.x - change.shift[0], body.y - change.shift[1]
        vx, vy = body.vx, body.vy
        if change.angle:
            x, y, vx, vy = c * x + s * y, c * y - s * x, c * vx + s * vy, c * vy - s * vx
        length, time = change.length, change.time
        places.append([x / length, sign * y / length, sign * body.angle - change.angle])
        rates.append([vx * time / length, sign * vy * time / length, sign * body.omega * time])
    return np.array(places), np.array(rates)


def of_scene(seed: int, name: str, rng: np.random.Generator) -> Finding:
    """A scene and the scene described anew."""
    scene = random_scene(seed)
    scene.rtol = RTOL
    change = CHANGES[name](rng)
    other = change.apply(copy.deepcopy(scene))
    model, again = scene.mechanism(f"scene {seed}"), other.mechanism(f"scene {seed} {name}")
    runs, told = [], []
    for one, machine in ((scene, model), (other, again)):
        try:
            run = mbody.simulate(machine, one.until, rtol=one.rtol, instants=one.instants)
            runs.append(run)
        except (mbody.ModelError, mbody.SolveError) as error:
            told.append(f"{type(error).__name__}: {error}")
    if told:
        if len(told) == 2:
            return Finding(name, 1, refused=1, told=told[0], model=model)
        return Finding(name, 1, silent=1, told=f"only one is refused: {told[0]}", model=again)
    names = list(scene.parts)
    ours, theirs = states(runs[0], names, Change(lambda s: s)), states(runs[1], names, change)
    doubted = bool(runs[0].doubts or runs[1].doubts)
    told = difference(scene, runs, ours, theirs, change)
    if not told:
        same = not change.exact or same_digits(runs, ours, theirs)
        return Finding(name, 1, told="" if same else "other digits")
    if doubted:
        told = f"{told}; {[run.status[:120] for run in runs]}"
    return Finding(name, 1, doubted=int(doubted), silent=int(not doubted), told=told, model=again)


def of_restart(seed: int) -> Finding:
    """A motion, and the same in two parts: the second goes on from the end of the first."""
    scene = random_scene(seed)
    scene.rtol = RTOL
    model = scene.mechanism(f"scene {seed} in two parts")
    told, runs = [], []
    try:
        for until in (scene.until, 0.5 * scene.until):
            runs.append(mbody.simulate(model, until, rtol=RTOL, instants=2))
    except (mbody.ModelError, mbody.SolveError) as error:
        told.append(f"{type(error).__name__}: {error}")
    if told or any(run.status != "completed" for run in runs):
        return Finding("restart", 1, refused=1, told=(told or [runs[0].status])[0], model=model)
    before = runs[1]
    try:
        runs[1] = mbody.simulate(model, scene.until, start=before, rtol=RTOL, instants=2)
    except (mbody.ModelError, mbody.SolveError) as error:
        told.append(f"its own end is refused: {error}")
        return Finding("restart", 1, silent=1, told=told[0], model=model)
    names, same = list(scene.parts), Change(lambda s: s)
    end, begin = (
        [x[..., k : k + 1 or None] for x in states(run, names, same)]
        for run, k in ((before, -1), (runs[1], 0))
    )
    ours, theirs = ([x[..., -1:] for x in states(run, names, same)] for run in runs)
    off = most(scene, ours, theirs)
    impacts = sum(event.after is not None for event in runs[0].events)
    wrong = off > 0.1 * TIMES * RTOL * MAGNIFIED ** min(impacts, 2 * COUNTED)
    more = set(runs[1].notes) - {*runs[0].notes, *before.notes}
    told = [f"goes on otherwise by {off:.2g} after {impacts} impacts"] if wrong else []
    jump = most(scene, end, begin)
    modes = {name for name, words in runs[1].modes.items() if words[0] != before.modes[name][-1]}
    told += [f"begins elsewhere, by {jump:.2g}, {modes}"] if jump > RESTARTED or modes else []
    told += [f"notes {more}"] if more else []
    return Finding("restart", 1, silent=int(bool(told)), told="; ".join(told), model=model)


def same_digits(runs: list[Any], ours: Any, theirs: Any) -> bool:
    """Whether all states and events of two runs are equal, times taken to be in one unit."""
    events = [[(e.t, e.name, e.contact) for e in run.events] for run in runs]
    return events[0] == events[1] and all(map(np.array_equal, ours, theirs))


def difference(scene: Scene, runs: list[Any], ours: Any, theirs: Any, change: Change) -> str:
    """What differs between two runs, or nothing."""
    events = [[(e.name, e.contact) for e in run.events] for run in runs]
    if change.swapped:
        swap = {"_low": "_high", "_high": "_low"}
        pins = {pin.name + end: pin.name + swap[end] for pin in scene.pins for end in swap}
        events[1] = [(name, pins.get(contact, contact)) for name, contact in events[1]]
    impacts = [float(e.t) for e in runs[0].events if e.name in ("impact", "rest", "inconsistent")]
    # nothing compares beyond rest, nor at a pole of Painlevé's, where forces have no bound
    rests = [float(e.t) for e in runs[0].events if e.name in ("rest", "paradox")]
    end = min([scene.until * 2.0, *rests[:1], *impacts[COUNTED : COUNTED + 1]])
    t = np.asarray(runs[0].t)
    count = min(len(t), ours[0].shape[-1], theirs[0].shape[-1])
    for k in range(count):
        before = sum(x < t[k] for x in impacts)
        if t[k] >= end - RTOL * scene.until:
            break
        off = most(scene, [x[..., : k + 1] for x in ours], [x[..., : k + 1] for x in theirs])
        if off > TIMES * RTOL * MAGNIFIED**before:
            return f"differs by {off:.2g} at {t[k]:.6g} s after {before} impacts"
    # what happens at one instant may be told in any order
    few = len(impacts) <= COUNTED and not rests
    if few and sorted(events[0]) != sorted(events[1]):
        return f"events {events[0][:6]} and {events[1][:6]}"
    if runs[0].status.split(":")[0] != runs[1].status.split(":")[0]:
        return f"{runs[0].status[:100]} and {runs[1].status[:100]}"
    return ""


def most(scene: Scene, ours: Any, theirs: Any) -> float:
    """Greatest difference of places, in sizes, of angles, and of rates, of the greatest."""
    size = max(part.size for part in scene.parts.values())
    weights = np.array([1.0 / size, 1.0 / size, 1.0])[None, :, None]
    place, rate = (
        np.abs((a[..., : b.shape[-1]] - b[..., : a.shape[-1]]) * weights)
        for a, b in zip(ours, theirs, strict=True)
    )
    swift = max(float((np.abs(ours[1]) * weights).max()), math.sqrt(scene.gravity / size))
    return max(float(place.max()), float(rate.max()) / swift)


# -- models of the gallery and linkages, in other units and orders ------------------------------


#: Numbers of unit systems, which are remembered by their names.
NUMBERS = itertools.count()


@contextmanager
def own_units(
    base: UnitSystem, length: Fraction, mass: Fraction, time: Fraction = Fraction(1)
) -> Iterator[UnitSystem]:
    """A system of units so many times those of another one, with as many seconds."""
    length, mass = length * base.unit("length").ratio, mass * base.unit("mass").ratio
    n = next(NUMBERS)
    units = {f"lu{n}": (length, "length"), f"fu{n}": (mass * length / time**2, "force")}
    units[f"tu{n}"] = time, "time"
    added = {k: Unit(k, ratio, 0, DIMENSIONS[kind]) for k, (ratio, kind) in units.items()}
    SYMBOLS.update(added)
    try:
        yield unit_system(f"lu{n}-fu{n}-tu{n}")
    finally:
        for key in added:
            del SYMBOLS[key]


def of_model(machine: Mechanism, name: str, rng: np.random.Generator, run: Any) -> Finding:
    """A mechanism and the same in other units, or in another order; `run` analyses one."""
    if name == "order":
        return compared(name, run, machine, shuffled(machine, rng), 1.0, 1.0)
    if name == "unit systems":
        systems = [u for u in ("SI", "mm-N-s", "in-lbf-s", "ft-lbf-s") if u != machine.units.name]
        units = unit_system(str(rng.choice(systems)))
        return in_other(name, machine, units, run)
    if name == "powers of two":
        length, mass = (Fraction(2) ** int(rng.integers(-20, 21)) for _ in range(2))
    else:
        length, mass = (Fraction(float(10.0 ** rng.uniform(-6.0, 6.0))) for _ in range(2))
    one, base = Fraction(1), machine.units
    with own_units(base, one, one) as same, own_units(base, length, mass) as units:
        try:
            machine = in_units(machine, same)
        except mbody.ModelError as error:
            return Finding(name, 0, told=str(error))
        return in_other(name, machine, units, run)


def in_other(name: str, machine: Mechanism, units: UnitSystem, run: Any) -> Finding:
    try:
        other = in_units(machine, units)
    except mbody.ModelError as error:
        return Finding(name, 0, told=str(error))
    length, mass = (
        float(machine.units.unit(kind).ratio / units.unit(kind).ratio)
        for kind in ("length", "mass")
    )
    return compared(name, run, machine, other, length, mass)


def shuffled(machine: Mechanism, rng: np.random.Generator) -> Mechanism:
    """The mechanism with its bodies, joints and loads in another order."""
    data = Writer(machine).whole()
    for key in ("bodies", "joints", "loads", "contacts"):
        if isinstance(data.get(key), dict):
            names = list(data[key])
            data[key] = {names[k]: data[key][names[k]] for k in rng.permutation(len(names))}
    return built(data)


def compared(
    name: str, run: Any, machine: Mechanism, other: Mechanism, length: float, mass: float
) -> Finding:
    """The results of both, and how far they are apart, of the greatest of each sort."""
    runs, told = [], []
    for one in (machine, other):
        try:
            runs.append(run(one))
        except (mbody.ModelError, mbody.SolveError) as error:
            told.append(f"{type(error).__name__}: {error}")
    if len(told) == 1:
        return Finding(name, 1, silent=1, told=f"only one is refused: {told[0]}", model=other)
    if told:
        return Finding(name, 1, refused=1, told=told[0], model=other)
    exact = name == "powers of two"
    worst, what = 0.0, ""
    sorts = histories(*runs, length, mass)
    sizes = {
        sort: max(float(np.nanmax(np.abs(ours), initial=0.0)) for _, ours, _ in rows)
        for sort, rows in sorts.items()
    }
    # what may be rounding alone, by what the others make of it
    extent = max(float(np.ptp(ours)) for _, ours, _ in sorts["x"]) or 1.0
    sizes["angle"] = max(1.0, sizes["angle"])
    if any(isinstance(load, mbody.Gravity) for load in machine.loads) and len(runs[0].t) > 1:
        # of what rests under gravity all velocities are rounding, or what steps leave of it
        fallen = machine.g * float(runs[0].t[-1] - runs[0].t[0])
        sizes["vx"] = max(sizes["vx"], fallen)
    sizes["omega"] = max(sizes["omega"], sizes["vx"] / extent)
    sizes["alpha"] = max(sizes["alpha"], sizes["omega"] ** 2)
    for sort, of in (("vx", "omega"), ("ax", "alpha"), ("torque", "fx")):
        sizes[sort] = max(sizes.get(sort, 0.0), extent * sizes.get(of, 0.0))
    for sort, rows in sorts.items():
        size = sizes[sort]
        for key, ours, theirs in rows:
            if ours.shape != theirs.shape:
                return Finding(name, 1, silent=1, told=f"instants of {key} differ", model=other)
            off = float(np.nanmax(np.abs(ours - theirs), initial=0.0)) / max(size, 1e-300)
            worst, what = max((worst, what), (off, f"{key} ({sort})"))
    count = len(getattr(runs[0], "events", ()) or ())
    # a step with impulses finds them to its own tolerance, which the run says
    stepped = getattr(machine.simulation, "method", None) == "moreau"
    limit = TIMES * (IMPULSES if stepped else RTOL) * MAGNIFIED ** min(count, COUNTED)
    told = f"{machine.name}: {what} differs by {worst:.2g}"
    if worst > limit:
        doubted = bool(runs[0].doubts or runs[1].doubts)
        return Finding(
            name, 1, doubted=int(doubted), silent=int(not doubted), told=told, model=other
        )
    return Finding(name, 1, told=told if exact and worst else "")


def histories(
    one: Any, two: Any, length: float, mass: float
) -> dict[str, list[tuple[str, Array, Array]]]:
    """By sort: (name, ours, theirs taken back) of bodies and joints."""
    found: dict[str, list[tuple[str, Array, Array]]] = {}
    sorts = {"x": length, "y": length, "angle": 1.0, "vx": length, "vy": length, "omega": 1.0}
    sorts |= {"ax": length, "ay": length, "alpha": 1.0}
    groups = {"y": "x", "vy": "vx", "ay": "ax", "fy": "fx"}
    for body in one:
        for key, unit in sorts.items():
            ours, theirs = (np.asarray(getattr(run[body], key)) for run in (one, two))
            found.setdefault(groups.get(key, key), []).append((body, ours, theirs / unit))
    if one.has_forces and two.has_forces:
        force = {"fx": mass * length, "fy": mass * length, "torque": mass * length**2}
        for joint in one.mechanism.joints:
            parts = one.reaction(joint.name), two.reaction(joint.name)
            if not all(np.all(np.asarray(part.unique, float) == 1.0) for part in parts):
                continue
            for key, unit in force.items():
                ours, theirs = (np.asarray(getattr(part, key)) for part in parts)
                row = (joint.name, ours, theirs / unit)
                found.setdefault(groups.get(key, key), []).append(row)
    return found


#: What is done to models that are no scenes.
UNITS = ("powers of two", "scale", "unit systems", "order", "restart")


def of_gallery(model: str, name: str, rng: np.random.Generator) -> Finding:
    """A model of the gallery at the instants that it asks for."""
    return of_model(gallery.load(model), name, rng, asked)


def of_linkage(seed: int, name: str, rng: np.random.Generator) -> Finding:
    """A random linkage over part of a turn."""
    of = random_linkage(seed)
    machine = of.mechanism(f"linkage {seed}")
    machine.add(*random_loads(of).elements)
    t = np.linspace(0.0, 0.4 * of.span, 5)
    return of_model(machine, name, rng, lambda one: mbody.kinetostatics(one, t=t))


def examine_invariance(seed: int) -> Finding:
    """Draw what is described anew, and how: of five seeds three scenes, a linkage, a model of the
    gallery.
    """
    rng = np.random.default_rng([seed, 0x1A7])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        turn, kind = divmod(seed, 5)
        if kind < 3:
            name = (*CHANGES, "restart")[int(rng.integers(len(CHANGES) + 1))]
            return of_restart(seed) if name == "restart" else of_scene(seed, name, rng)
        name = UNITS[int(rng.integers(len(UNITS) - 1))]
        if kind == 3:
            return of_linkage(seed, name, rng)
        names = gallery.names()
        return of_gallery(names[turn % len(names)], name, rng)
