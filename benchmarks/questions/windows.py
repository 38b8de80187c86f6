"""Work–precision of N windows: ten seconds through some forty singular positions."""

from __future__ import annotations

import numpy as np

import mbody
from benchmarks.frame import Engine, Row, Scope, available, race
from benchmarks.peers import mujoco, ours, pinocchio, pymunk
from benchmarks.planar import planar
from validation import iftomm_a02

__all__ = ["TITLE", "measure"]

TITLE = "N windows to 10 s, through every singular position: error of the posts' angle"
UNTIL = 10.0
LEVELS = (1e-3, 1e-6, 1e-8)


def measure(scope: Scope) -> list[Row]:
    """N = 2 and 40 in full, N = 2 in the short form."""
    counts = (2,) if scope.short else (2, 40)
    return [row for count in counts for row in windows(count, scope)]


def windows(count: int, scope: Scope) -> list[Row]:
    """All engines that are installed; the references are those of the validation case."""
    system = mbody.assemble(iftomm_a02.build(count))
    machine = planar(system)
    theta = iftomm_a02.THETA[count]

    def error(angle: np.ndarray, rate: np.ndarray) -> float:
        return abs(float(angle[0]) - theta)

    engines: list[Engine] = [ours.engine(system, UNTIL), ours.engine(system, UNTIL, given=True)]
    if available("scipy", "pinocchio"):
        engines.append(pinocchio.fixed(machine, UNTIL, (1000, 2000, 5000, 10_000), 20.0))
        engines.append(pinocchio.engine(machine, UNTIL, project=True))
    if available("mujoco"):
        steps = (2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000)
        engines.append(mujoco.engine(machine, UNTIL, steps))
    if available("pymunk") and not scope.short:
        engines.append(pymunk.engine(machine, UNTIL, (10_000, 100_000)))
    return race("windows", f"n_windows_{count} to 10 s", engines, error, scope, LEVELS)
