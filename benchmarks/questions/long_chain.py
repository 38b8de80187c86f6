"""A chain of a thousand rods falls for a second: time, and how well its energy is kept."""

from __future__ import annotations

import numpy as np

import mbody
from benchmarks import models
from benchmarks.frame import OURS, Row, Scope, timed

__all__ = ["TITLE", "measure"]

TITLE = "A chain of 1000 rods released level, for 1 s at rtol 1e-8: energy lost, as a part"


def measure(scope: Scope) -> list[Row]:
    """Of mbody alone; no peer gave an answer in the time that it takes (see `bodies`)."""
    count, runs = (100, 1) if scope.short else (1000, 3)
    system = mbody.assemble(models.chain(count))
    mbody.simulate(system, 1e-3, instants=2)
    found = [timed(lambda: mbody.simulate(system, 1.0, rtol=1e-8, instants=2)) for _ in range(runs)]
    run = found[-1][1]
    # two readings: the account of work and the sum of both energies, which is constant here
    total = run.energy.kinetic + run.energy.potential
    lost = max(np.abs(run.energy.balance).max(), np.ptp(total)) / run.energy.size
    seconds = float(np.median([spent for spent, _ in found]))
    return [
        Row(
            "long_chain",
            f"chain of {count} for 1 s at rtol 1e-8",
            OURS,
            error=float(lost),
            median_s=seconds,
            runs=runs,
            ratio_to_mbody=1.0,
            setting=f"{run.stats['steps']} steps",
        )
    ]
