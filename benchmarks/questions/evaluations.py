"""Nanoseconds an evaluation of the compiled core alone: accelerations and all multipliers.

Of five blocks a round the fastest counts: what interrupts a block of a millisecond is not the core.
"""

from __future__ import annotations

import statistics

import numpy as np

import mbody
from benchmarks import models
from benchmarks.frame import OURS, Asked, Row, timed
from benchmarks.peers import by_hand
from mbody.core.motion import free_motion, repeat

__all__ = ["TITLE", "measure"]

TITLE = "One evaluation of the compiled core, no Python around it"


def measure(asked: Asked) -> list[Row]:
    """A four-bar with NumPy's 9-coordinate solution beside it, Andrews, chains and hubs."""
    gallery = [mbody.gallery.load(name) for name in ("free_fourbar", "andrews_squeezer")]
    sizes = (10, 100) if asked.short else (10, 100, 1000)
    machines = [*gallery, *map(models.chain, sizes), *map(models.hub, sizes[1:])]
    return [row for machine in machines for row in one(machine, asked)]


def one(machine: mbody.Mechanism, asked: Asked) -> list[Row]:
    """A mechanism; beside the four-bar its one equation by hand."""
    system = mbody.assemble(machine)
    work = system.work(masses=True)
    start = mbody.simulate(system, 1e-9, instants=2).take([0])
    n = system.coordinates
    work.q[:n, 0] = start.record.table(slice(0, n))[0]
    work.v[:n, 0] = np.random.default_rng(0).normal(size=n)
    free_motion(system.runtime(), work, 0.0, 0)
    times = max(5, 100_000 // n)
    repeat(system.runtime(), work, 5)
    ours, theirs = [], []
    for _ in range(asked.runs):
        blocks = [timed(lambda: repeat(system.runtime(), work, times))[0] for _ in range(5)]
        ours.append(min(blocks) / times)
        if machine.name.startswith("Four-bar"):
            theirs.append(minimal())
    workload = f"{machine.name}, one evaluation in the core"
    median = statistics.median(ours)
    rows = [Row("evaluations", workload, OURS, None, median, len(ours), 1.0)]
    asked.progress(f"  {workload}: {1e9 * median:.0f} ns")
    if theirs:
        ratio = statistics.median(a / b for a, b in zip(theirs, ours))
        told, median = "one equation by hand, plain Python", statistics.median(theirs)
        rows.append(Row("evaluations", workload, told, None, median, len(theirs), ratio))
    return rows


def minimal() -> float:
    """Seconds of the four-bar's one equation."""
    y = np.array([1.0, 0.0])
    blocks = [timed(lambda: [by_hand.four_bar(0.0, y) for _ in range(200)])[0] for _ in range(5)]
    return min(blocks) / 200
