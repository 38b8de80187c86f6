"""Work–precision of a free four-bar: ten seconds under gravity, which end after many swings."""

from __future__ import annotations

import numpy as np

import mbody
from benchmarks.frame import Engine, Row, Scope, available, race
from benchmarks.peers import by_hand, exudyn, mujoco, ours, pinocchio, pymunk
from benchmarks.planar import planar
from validation import free_fourbar

__all__ = ["TITLE", "measure"]

TITLE = "Four-bar released at 60°, to 10 s: error of the crank's angle and rate at the end"
UNTIL = 10.0
WORKLOAD = "free_fourbar to 10 s"


def error(angle: np.ndarray, rate: np.ndarray) -> float:
    """Of the crank: angle [rad], or rate as a part of the greatest."""
    size = abs(free_fourbar.OMEGA)
    off = abs(angle[0] - free_fourbar.THETA), abs(rate[0] - free_fourbar.OMEGA) / size
    return max(float(value) for value in off)


def measure(scope: Scope) -> list[Row]:
    """All engines that are installed."""
    system = mbody.assemble(mbody.gallery.load("free_fourbar"))
    machine = planar(system)
    engines: list[Engine] = [ours.engine(system, UNTIL), ours.engine(system, UNTIL, given=True)]
    if available("scipy"):
        start, state = np.array([np.pi / 3.0, 0.0]), lambda y: (y[:1], y[1:])
        names = "one equation", "one equation in numba"
        engines += by_hand.engines(by_hand.four_bar, *names, start, UNTIL, state)
        if available("pinocchio"):
            engines.append(pinocchio.engine(machine, UNTIL))
            engines.append(pinocchio.engine(machine, UNTIL, project=True))
    if available("mujoco"):
        counts = (2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000)
        engines.append(mujoco.engine(machine, UNTIL, counts))
    if available("pymunk") and not scope.short:
        engines.append(pymunk.engine(machine, UNTIL, (10_000, 100_000, 1_000_000)))
    if available("exudyn"):
        engines.append(exudyn.engine(machine, UNTIL, (5000, 20_000, 100_000, 500_000)))
    return race("fourbar", WORKLOAD, engines, error, scope)
