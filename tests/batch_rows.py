"""Random batches, row by row against each design alone.

``python -m tests.batch_rows [--count N] [--seed S]`` prints what differs and the counts: linkages
of one to three loops with loads of every kind, with friction in all joints and a gear, a cam or a
pin in a slot, with redundant joints, and bodies that lie on each other; designs that differ in
masses, loads, coefficients and lengths, at times or driver values.
"""

from __future__ import annotations

import argparse
import collections
import sys
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import mbody
from mbody import Mechanism, System
from mbody.core.lanes import LANES
from tests.campaign.drawing import random_linkage as campaign_linkage
from tests.frictional_linkages import frictional_linkage
from tests.support import driven_contacts
from tests.support.linkages import random_linkage, times_within

KINDS = ("linkage", "friction", "redundant", "contact")
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
    some = list(rng.choice(others, min(len(others), int(rng.integers(1, 5))), replace=False))
    spread = dict.fromkeys(map(str, some), 0.3)
    if rng.random() < {"redundant": 0.2, "contact": 0.3}.get(kind, 0.7):
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
    for n in range(count):
        row, alone = run.design(n), batch.analysed(whole.design(n))
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
    for n in range(int(whole.batch or 0)):
        alone = found.batch.analysed(whole.design(n))
        if isinstance(alone, Exception):
            if str(error) != f"design {n} of the batch: {alone}":
                found.wrong.append(f"{error}\n    alone {n}: {alone}")
            return
    found.wrong.append(f"{error}\n    none alone")


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


def main(arguments: list[str] | None = None) -> int:
    """Compare, print what differs and the counts; 1 where something does."""
    parser = argparse.ArgumentParser(prog="python -m tests.batch_rows", description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="batches")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    asked = parser.parse_args(arguments)
    counts: collections.Counter[str] = collections.Counter()
    worst, wrong = 0.0, []
    for seed in range(asked.seed, asked.seed + asked.count):
        found = compared(random_batch(seed))
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
