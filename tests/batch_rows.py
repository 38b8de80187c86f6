"""Random batches, row by row against each design alone.

``python -m tests.batch_rows [--count N] [--seed S]`` prints what differs and the counts: linkages
of one to three loops with loads of every kind, with friction in all joints and a gear, a cam or a
pin in a slot, with redundant joints, and bodies that lie on each other; designs that differ in
masses, loads, coefficients and lengths, at times or driver values. As many again are free:
linkages with friction, and scenes of bodies that touch, are tied and are stopped, whose designs
move, rest and have linear equations.
"""

from __future__ import annotations

import argparse
import collections
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbody
from mbody import Mechanism, System
from mbody.core.lanes import LANES
from mbody.engineering import linearize
from mbody.solution.energy import PLAIN
from tests.campaign.drawing import random_linkage as campaign_linkage
from tests.campaign.loads import random_loads
from tests.campaign.scenes import random_scene
from tests.frictional_linkages import frictional_linkage
from tests.support import driven_contacts
from tests.support.frictional import with_changes
from tests.support.linkages import random_linkage, times_within

KINDS = ("linkage", "friction", "redundant", "contact")
FREE = ("swing", "scene", "steps", "rest", "linear")
#: What rounding may make of places and angles, of velocities, of all else, as parts of the
#: greatest: lanes and the scalar path end Newton's method by other corrections.
PLACES, RATES, FORCES = 1e-11, 1e-10, 1e-9
CONTACTS = (
    lambda u: driven_contacts.box(u(0.0, 0.5), u(0.1, 0.6), float(u() < 0.5) * 0.1),
    lambda u: driven_contacts.vehicle(u(0.5, 0.9), u(-3.0, 3.0)),
    lambda u: driven_contacts.lamp(),
    lambda u: driven_contacts.eccentric(u(0.0, 0.4)),
    lambda u: driven_contacts.yoke(bool(u() < 0.5), u(0.0, 0.3)),
    lambda u: driven_contacts.sledge(),
    lambda u: driven_contacts.crank_over_a_floor(),
)


@dataclass(frozen=True)
class Batch:
    """A random batch and how it is analysed."""

    seed: int
    kind: str
    system: System
    values: dict[str, np.ndarray]
    analysis: str
    how: dict[str, Any]

    @property
    def designs(self) -> System:
        """All of them."""
        return self.system.with_values(self.values)

    def analysed(self, system: System, **more: Any) -> Any:
        """The result, or the error, of all or of one."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                return getattr(mbody, self.analysis)(system, **self.how, **more)
            except (mbody.ModelError, mbody.SolveError) as error:
                return error


def random_batch(seed: int) -> Batch:
    """That of a seed."""
    rng = np.random.default_rng([seed, 47])
    kind = KINDS[seed % len(KINDS)]
    machine, times = _machine(kind, seed, rng)
    system = mbody.assemble(machine)
    count = int(rng.choice([1, 2, 3, 5, LANES, LANES + 3]))
    analysis = str(rng.choice(["kinetostatics", "kinetostatics", "statics", "kinematics"]))
    values = _values(system, kind, count, rng)
    return Batch(seed, kind, system, values, analysis, {"t": times})


def _machine(kind: str, seed: int, rng: np.random.Generator) -> tuple[Mechanism, np.ndarray]:
    instants = int(rng.choice([1, 2, 7, 40, 120]))
    if kind == "contact":
        machine = CONTACTS[int(rng.integers(len(CONTACTS)))](rng.uniform)
        return machine, np.linspace(0.0, float(rng.uniform(0.05, 0.9)), instants)
    if kind == "redundant":
        drawn = campaign_linkage(seed)
        return drawn.mechanism("redundant"), np.linspace(0.0, drawn.times[-1], instants)
    if kind == "friction":
        run = frictional_linkage(seed).run
        return run.mechanism, np.linspace(0.0, float(run.t[-1]), instants)
    loops = int(rng.integers(1, 4))
    chosen = {"sliders": bool(rng.integers(2)), "extras": bool(rng.integers(2))}
    machine, turn = random_linkage(seed, loops, **chosen)
    return machine, times_within(machine, turn, max(instants, 2))[:instants]


def _values(
    system: System, kind: str, count: int, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """Some numbers of the description and how designs differ in them, the first as it is."""
    plain = {
        name: float(value)
        for name, value in system.values.items()
        if "." in name and np.ndim(value) == 0 and not name.endswith(".efficiency")
    }
    lengths = [name for name in plain if name.endswith((".x", ".y", ".r", ".length"))]
    others = [name for name in plain if name not in lengths and "angle" not in name and plain[name]]
    if kind in FREE:  # coefficients that must fit each other stay as they are
        fixed = (".restitution", ".static", ".friction")
        others = [name for name in others if not name.endswith(fixed)]
    some = list(rng.choice(others, min(len(others), int(rng.integers(1, 5))), replace=False))
    spread = dict.fromkeys(map(str, some), 0.3)
    if rng.random() < {"redundant": 0.2, "contact": 0.3, "scene": 0.3, "steps": 0.3}.get(kind, 0.7):
        far = 0.3 if rng.random() < 0.1 else 0.03
        spread |= dict.fromkeys(map(str, rng.choice(lengths, min(3, len(lengths)))), far)
    values = {}
    for name, part in spread.items():
        size = abs(plain[name]) or system.length
        values[name] = plain[name] + part * size * rng.uniform(-1.0, 1.0, count)
        values[name][0] = plain[name]
    return values


@dataclass
class Comparison:
    """What was found of one batch: `wrong` sentences, and the greatest difference of numbers."""

    batch: Batch
    found: str = "equal"
    worst: float = 0.0
    wrong: list[str] = field(default_factory=list)
    status: set[str] = field(default_factory=set)


def compared(batch: Batch) -> Comparison:
    """Every row of a batch with the design alone."""
    found, whole = Comparison(batch), batch.designs
    run, count = batch.analysed(whole), int(whole.batch or 0)
    if isinstance(run, Exception):
        found.found = "refused"
        _refused(found, run, whole)
        return found
    sound = [n for n in range(count) if n not in run.failures]
    for n in range(count):
        alone = batch.analysed(whole.design(n))
        if n not in sound:
            found.status.add("failed")
            if not isinstance(alone, Exception):
                found.found = "failed from the first position of the batch"
                alone = batch.analysed(whole.design(n), guess=_guess(run.design(sound[0])))
            _failure(found, run, n, alone)
            continue
        row = run.design(n)
        if isinstance(alone, Exception) or not _same_place(row, alone):
            found.found = "equal from the first position of the batch"
            alone = batch.analysed(whole.design(n), guess=_guess(row))
        if isinstance(alone, Exception):
            found.wrong.append(f"design {n}: alone {alone}")
            continue
        _rows(found, n, row, alone)
        found.status.add(row.status.partition(":")[0])
    return found


def _refused(found: Comparison, error: Exception, whole: System) -> None:
    """What is refused where all designs fail."""
    every = [found.batch.analysed(whole.design(n)) for n in range(int(whole.batch or 0))]
    if not all(isinstance(alone, Exception) for alone in every):
        found.wrong.append(f"refused: {error}")
    elif str(error) not in (str(every[0]), f"design 0 of the batch: {every[0]}"):
        found.wrong.append(f"{error}\n    alone {every[0]}")


def _failure(found: Comparison, run: Any, n: int, alone: Any) -> None:
    """A design that failed: its error is that of the design alone, and it has no numbers."""
    error = _failing(lambda: run.design(n))
    if (type(error), str(error)) != (type(alone), str(alone)) or run.failures[n] != str(alone):
        found.wrong.append(f"design {n}: {error}\n    alone {alone}")
    # the notes say why the first did
    said = n != min(run.failures) or any(note.endswith(str(alone)) for note in run.notes)
    if not said or not run.status.startswith("failed:"):
        found.wrong.append(f"design {n} is not said to have failed: {run.status} {run.notes}")
    if isinstance(run, mbody.Solution) and np.isfinite(run.record.table(slice(None))[n]).any():
        found.wrong.append(f"design {n}: rows of what failed")


def _same_place(row: Any, alone: Any) -> bool:
    return all(
        abs(row[name].x[0] - alone[name].x[0]) < 1e-6 * row.system.length
        and abs(row[name].angle[0] - alone[name].angle[0]) < 1e-6
        for name in row
    )


def _guess(row: Any) -> dict[str, tuple[float, float, float]]:
    """Where the links of a result begin."""
    links = {}
    for name in row:
        origin, angle = row.point(mbody.Marker(name, (0.0, 0.0))), row[name].angle[0]
        links[name] = (float(origin.x[0]), float(origin.y[0]), float(angle))
    return links


def _rows(found: Comparison, n: int, row: Any, alone: Any) -> None:
    for key in ("status", "doubts", "notes", "regularization"):
        one, other = getattr(row, key), getattr(alone, key)
        if one != other:
            found.wrong.append(f"design {n}: {key}\n    row   {one}\n    alone {other}")
    if {k: list(v) for k, v in row.modes.items()} != {k: list(v) for k, v in alone.modes.items()}:
        found.wrong.append(f"design {n}: modes")
    for limit, pairs in _numbers(row, alone):
        size = max([float(np.nanmax(np.abs(b), initial=0.0)) for _, _, b in pairs], default=0.0)
        for name, a, b in pairs:
            if not np.array_equal(np.isnan(a), np.isnan(b)):
                found.wrong.append(f"design {n}: {name} NaN")
                continue
            if name.endswith(".angle"):  # how often a wheel has rolled round another may be a tie
                turn = 2.0 * np.pi * row.system.length
                a = a - turn * np.round((a[:1] - b[:1]) / turn)
            off = float(np.nanmax(np.abs(a - b), initial=0.0)) / (size or 1.0)
            found.worst = max(found.worst, off)
            if off > limit:
                found.wrong.append(f"design {n}: {name} off {off:.1e}")


def _numbers(row: Any, alone: Any) -> list[tuple[float, list[tuple[str, Any, Any]]]]:
    """Histories of one size, angles and torques by the model length: the limit, names and both."""
    length, groups = row.system.length, []
    motions = (PLACES, "x y angle"), (RATES, "vx vy omega"), (FORCES, "ax ay alpha")
    for limit, keys in motions:
        group = [
            (f"{name}.{key}", *(unit * getattr(run[name], key) for run in (row, alone)))
            for name in row
            for key, unit in zip(keys.split(), (1.0, 1.0, length), strict=True)
        ]
        groups.append((limit, group))
    # at a steady pace accelerations are rounding
    pace = max(np.abs(one).max(initial=0.0) for _, one, _ in groups[1][1]) ** 2 / length
    groups[2][1].append(("pace", pace, pace))
    if not row.has_forces:
        return groups
    machine, forces = row.mechanism, []
    for one in (*machine.joints, *(one for one in machine.contacts if one.closed)):
        if not one.bodies:
            continue
        a, b = row.reaction(one.name), alone.reaction(one.name)
        forces += [(f"{one.name}.{key}", getattr(a, key), getattr(b, key)) for key in ("fx", "fy")]
        forces.append((f"{one.name}.torque", a.torque / length, b.torque / length))
        if a.unique != b.unique:
            forces.append((f"{one.name}.unique", np.ones(1), np.zeros(1)))
    for one in (*machine.drivers, *machine.couplings):
        unit = 1.0 if one.effort_dimension == "force" else 1.0 / length
        forces.append((one.name, unit * row.effort(one.name), unit * alone.effort(one.name)))
    losses = [(name, loss, alone.losses[name]) for name, loss in row.losses.items()]
    return [*groups, (FORCES, forces), (FORCES, losses)]


# -- Free motions, rest positions and linear equations ------------------------------------------


def free_batch(seed: int) -> Batch:
    """That of a seed, of designs some of which may end early, or fail."""
    rng = np.random.default_rng([seed, 48])
    kind = FREE[seed % len(FREE)]
    if kind in ("swing", "rest") or (kind == "linear" and rng.random() < 0.5):
        # searches for rest positions go round the whole motion
        drawn = campaign_linkage(seed, loops=None if kind == "swing" else 1)
        machine, until, rtol = _swing(drawn, rng, rubs=kind == "swing"), 0.5 * drawn.span, 1e-8
    else:
        scene = random_scene(seed)
        machine, until, rtol = scene.mechanism("scene"), scene.until, scene.rtol
    system = mbody.assemble(machine)
    count = int(rng.choice([2, 3, 5]))
    values = _values(system, kind, count, rng)
    if kind == "rest":
        return Batch(seed, kind, system, values, "equilibrium", {})
    how: dict[str, Any] = {"until": until, "rtol": rtol, "instants": int(rng.integers(2, 30))}
    if kind == "steps":
        how |= {"method": "moreau", "step": until / 200.0, "rtol": None}
    elif rng.random() < 0.4:  # some designs end by it, at different times
        body = machine.bodies[int(rng.integers(len(machine.bodies)))]
        run = mbody.simulate(machine, **how)
        middle = float(run[body.name].angle[len(run) // 2])
        how["events"] = [
            mbody.Event(f"{body.name}.angle - {middle!r} rad", name="there", stop=True)
        ]
    return Batch(seed, kind, system, values, "simulate", how)


def _swing(drawn: Any, rng: np.random.Generator, *, rubs: bool) -> Mechanism:
    """A linkage without its drivers, under loads; half of those that may have friction in a pin."""
    machine = drawn.mechanism("swing", driven=False)
    pins = [one for one in machine.joints if isinstance(one, mbody.Revolute)]
    if rubs and pins and rng.random() < 0.5:
        pin = pins[int(rng.integers(len(pins)))]
        more = {"friction": 0.1, "pin_radius": 0.01}
        machine = with_changes(machine, lambda one: more if one is pin else {})
    machine.add(*random_loads(drawn, conservative=True).elements)
    return machine


def compared_free(batch: Batch) -> Comparison:
    """Every row of a batch with the design alone, to the last bit."""
    found, whole = Comparison(batch), batch.designs
    run, count = batch.analysed(whole), int(whole.batch or 0)
    every = [batch.analysed(whole.design(n)) for n in range(count)]
    if isinstance(run, Exception):
        found.found = "refused"
        _refused(found, run, whole)
        return found
    if batch.analysis == "equilibrium":
        _each(found, run, every)
        if any(not isinstance(alone, Exception) for alone in every):
            linear = linearize(whole, at=run)
            _each(found, linear, [_linear(whole.design(n), one) for n, one in enumerate(every)])
        return found
    for n, alone in enumerate(every):
        _motion(found, run, n, alone)
    if batch.kind == "linear":
        linear = _failing(lambda: linearize(whole, at=run))
        alone = [_linear(whole.design(n), one) for n, one in enumerate(every)]
        if isinstance(linear, Exception):
            if not all(isinstance(one, Exception) for one in alone):
                found.wrong.append(f"linearize: {linear}")
            return found
        _each(found, linear, alone)
    return found


def _failing(analysis: Any) -> Any:
    try:
        return analysis()
    except (mbody.ModelError, mbody.SolveError) as error:
        return error


def _linear(design: System, at: Any) -> Any:
    """Linear equations of a design at its first rest position, or at the end of its motion."""
    if isinstance(at, Exception):
        return at
    return _failing(lambda: linearize(design, at=at if isinstance(at, mbody.Solution) else at[0]))


def _each(found: Comparison, run: Any, every: list[Any]) -> None:
    """Results of designs that are no motions."""
    for n, alone in enumerate(every):
        if n in run.failures or isinstance(alone, Exception):
            _failure(found, run, n, alone)
            found.status.add("failed")
            continue
        row = run.design(n)
        found.status.add(row.status.partition(":")[0])
        if repr(row.data()) != repr(alone.data()):
            found.wrong.append(f"design {n}: {row.data()}\n    alone {alone.data()}")


def _motion(found: Comparison, run: Any, n: int, alone: Any) -> None:
    """A design of motions, and its rows of the batch: NaN where it has no instant."""
    if n in run.failures or isinstance(alone, Exception):
        _failure(found, run, n, alone)
        found.status.add("failed")
        return
    row = run.design(n)
    found.status.add(row.status.partition(":")[0])
    if (row.status, row.doubts, row.notes) != (alone.status, alone.doubts, alone.notes):
        found.wrong.append(f"design {n}: {row.notes}\n    alone {alone.notes}")
    events = [[(e.name, e.contact, e.t) for e in one.events] for one in (row, alone)]
    events.append([(e.name, e.contact, e.t) for e in run.events if e.design == n])
    if events[0] != events[1] or events[2] != events[1]:
        found.wrong.append(f"design {n}: events {events}")
    places = np.searchsorted(run.t, alone.t[np.isin(alone.t, run.t)])
    kept = np.flatnonzero(np.isin(alone.t, run.t))
    for name, ours, theirs in _histories(run, n, alone):
        expected = np.full(len(run.t), np.nan)
        expected[places] = theirs[kept]
        if not np.array_equal(ours, expected, equal_nan=True):
            size = np.nanmax(np.abs(expected), initial=0.0) or 1.0
            off = np.nanmax(np.abs(ours - expected), initial=0.0) / size
            same = np.array_equal(np.isnan(ours), np.isnan(expected))
            found.worst = max(found.worst, float(off))
            if not same or off > 1e-12:
                found.wrong.append(
                    f"design {n}: {name} off {off:.1e}, NaN {'' if same else 'not '}alike"
                )


def _histories(run: Any, n: int, alone: Any) -> Iterator[tuple[str, Any, Any]]:
    """Histories of a design by name: those of the batch and its own."""
    for name in run:
        for key in ["x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"]:
            yield f"{name}.{key}", getattr(run[name], key)[n], getattr(alone[name], key)
    for one in (*run.mechanism.joints, *run.mechanism.contacts):
        if one.role == "contact":
            yield f"{one.name}.contact", run.contact(one.name)[n], alone.contact(one.name)
        if getattr(one, "bodies", None):
            ours, theirs = run.reaction(one.name), alone.reaction(one.name)
            for key in ("fx", "fy", "torque"):
                yield f"{one.name}.{key}", getattr(ours, key)[n], getattr(theirs, key)
    for name, loss in alone.losses.items():
        yield f"{name}.loss", run.losses[name][n], loss
    for name in (*PLAIN, "by", "lost"):
        ours, theirs = getattr(run.energy, name), getattr(alone.energy, name)
        if isinstance(theirs, dict):
            yield from ((f"{name} {key}", ours[key][n], part) for key, part in theirs.items())
        else:
            yield name, ours[n], theirs


def main(arguments: list[str] | None = None) -> int:
    """Compare, print what differs and the counts; 1 where something does."""
    parser = argparse.ArgumentParser(prog="python -m tests.batch_rows", description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="batches")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    asked = parser.parse_args(arguments)
    counts: collections.Counter[str] = collections.Counter()
    worst, wrong = 0.0, []
    seeds = range(asked.seed, asked.seed + asked.count)
    drawn = [(random_batch, compared, seed) for seed in seeds]
    drawn += [(free_batch, compared_free, seed) for seed in seeds]
    for draw, compare, seed in drawn:
        found = compare(draw(seed))
        key = "different" if found.wrong else found.found
        counts[key] += 1
        counts[f"{key} ({found.batch.kind})"] += 1
        for status in found.status:
            counts[f"with designs that are {status}"] += 1
        worst = max(worst, found.worst)
        if found.wrong:
            wrong.append(seed)
            head = f"seed {seed}, {found.batch.kind}, {found.batch.analysis}"
            print(head, len(found.wrong), *found.wrong[:3], sep="\n  ", flush=True)
    for name, count in sorted(counts.items()):
        print(f"{count:6d} {name}")
    print(f"worst {worst:.1e}, different: {wrong}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
