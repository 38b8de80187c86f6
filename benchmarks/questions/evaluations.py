"""Nanoseconds an evaluation of the compiled core alone: accelerations and all multipliers.

Of five blocks a round the fastest counts: what interrupts a block of a millisecond is not the core.
"""

from __future__ import annotations

import functools
import statistics
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

import mbody
from benchmarks import models
from benchmarks.frame import OURS, Row, Scope, timed
from benchmarks.peers import by_hand
from benchmarks.planar import planar
from benchmarks.questions import bodies
from mbody.kernels.forces import free_motion, repeat

__all__ = ["TITLE", "measure"]

#: So many evaluations in a block, and what makes a block of so many.
Block = tuple[int, Callable[[int], Any]]
TITLE = "One evaluation of the compiled core, no Python around it"


def measure(scope: Scope) -> list[Row]:
    """A four-bar with equations by hand beside it, Andrews' mechanism, chains and hubs."""
    gallery = [mbody.gallery.load(name) for name in ("free_fourbar", "andrews_squeezer")]
    sizes = (10, 100) if scope.short else (10, 100, 1000)
    machines = [*gallery, *map(models.chain, sizes), *map(models.hub, sizes[1:])]
    beside: dict[str, dict[str, Block]] = {
        gallery[0].name: floors(mbody.assemble(gallery[0])),
        gallery[1].name: {"by hand in numba, 13 equations by LAPACK": looped(by_hand.andrews, 14)},
    }
    return [row for one in machines for row in rows_of(one, beside.get(one.name, {}), scope)]


def rows_of(machine: mbody.Mechanism, beside: dict[str, Block], scope: Scope) -> list[Row]:
    """A mechanism, and the equations by hand beside it."""
    system = mbody.assemble(machine)
    work, runtime = system.work(masses=True), system.runtime()
    start = mbody.simulate(system, 1e-9, instants=2).take([0])
    n = system.coordinates
    work.q[:n, 0] = start.record.table(slice(0, n))[0]
    work.v[:n, 0] = np.random.default_rng(0).normal(size=n)
    free_motion(runtime, work, 0.0, 0)
    own = max(5, 100_000 // n)
    tasks: dict[str, Block] = {OURS: (own, lambda times: repeat(runtime, work, times)), **beside}
    for _, task in tasks.values():
        task(5)
    found: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(scope.runs):
        for name, (times, task) in tasks.items():
            call = functools.partial(task, times)
            found[name].append(timed(call, times=5)[0] / times)
    workload = f"{machine.name}, one evaluation in the core"
    rows = []
    for name, times in found.items():
        median = statistics.median(times)
        ratio = statistics.median(a / b for a, b in zip(times, found[OURS]))
        rows.append(Row("evaluations", workload, name, None, median, len(times), ratio))
        scope.progress(f"  {workload}, {name}: {1e9 * median:.0f} ns")
    return rows


def looped(slope: Callable[[float, np.ndarray], np.ndarray], size: int) -> Block:
    """An equation by hand, compiled, in a compiled loop."""
    compiled = numba.njit(slope)

    @numba.njit
    def loop(times: int, y: np.ndarray) -> float:
        total = 0.0
        for _ in range(times):
            y[0] += 1e-12  # else it is done once
            total += compiled(0.0, y)[1]
        return total

    y = np.linspace(1.0, 0.0, size)
    return 2000, lambda times: loop(times, y)


def floors(system: mbody.System) -> dict[str, Block]:
    """Of the four-bar: its one equation, and [M Φ_qᵀ; Φ_q 0] as a dense matrix by LAPACK."""
    y, (matrix, right) = np.array([1.0, 0.0]), bodies.equations(planar(system))
    dense = matrix.toarray()

    @numba.njit
    def solved(times: int, dense: np.ndarray, right: np.ndarray) -> float:
        total = 0.0
        for _ in range(times):
            total += np.linalg.solve(dense, right)[0]
        return total

    def plain(times: int) -> None:
        for _ in range(times):
            by_hand.four_bar(0.0, y)

    return {
        "one equation by hand, in numba": looped(by_hand.four_bar, 2),
        "the 17 equations by LAPACK, solved alone": (2000, lambda n: solved(n, dense, right)),
        "one equation by hand, plain Python": (200, plain),
    }
