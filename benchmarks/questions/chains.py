"""Work–precision of chains released level: half a second of 10 and of 100 rods of 0.1 m."""

from __future__ import annotations

import numpy as np

import mbody
from benchmarks import models
from benchmarks.frame import Engine, Row, Scope, available, race
from benchmarks.peers import by_hand, exudyn, mujoco, ours, pinocchio, pymunk
from benchmarks.peers.stepping import dop853
from benchmarks.planar import planar

__all__ = ["TITLE", "measure"]

TITLE = "Chains released level, to 0.5 s: greatest error of an angle [rad]"
UNTIL = 0.5


def measure(scope: Scope) -> list[Row]:
    """10 rods, and in the full form 100."""
    counts = (10,) if scope.short else (10, 100)
    return [row for count in counts for row in chain(count, scope)]


def chain(count: int, scope: Scope) -> list[Row]:
    """The reference is the equation by hand, dense, at DOP853's least tolerance."""
    system = mbody.assemble(models.chain(count))
    machine = planar(system)
    slope = by_hand.chain(count, models.LENGTH, models.MASS, models.G)
    start = np.zeros(2 * count)
    reference = dop853(slope, start, UNTIL, 3e-14)[:count]

    def error(angle: np.ndarray, rate: np.ndarray) -> float:
        return float(np.abs(angle - reference).max())

    def state(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return y[:count], y[count:]

    engines: list[Engine] = [ours.engine(system, UNTIL), ours.engine(system, UNTIL, given=True)]
    engines.append(by_hand.engine("scipy DOP853, NumPy by hand", slope, start, UNTIL, state))
    if available("pinocchio"):
        engines.append(pinocchio.engine(machine, UNTIL))
    if available("mujoco"):
        engines.append(mujoco.engine(machine, UNTIL, (25, 50, 100, 250, 500, 1000, 2500, 5000)))
    if available("pymunk"):
        engines.append(pymunk.engine(machine, UNTIL, (500, 5000, 50_000)))
    if available("exudyn"):
        engines.append(exudyn.engine(machine, UNTIL, (150, 500, 1500, 5000, 15_000)))
    return race("chains", f"chain of {count} to 0.5 s", engines, error, scope)
