"""mbody itself: whole calls of `simulate`, loops closed and Python included, two instants kept."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import mbody
from benchmarks.frame import OURS, Engine

__all__ = ["engine"]

SETTINGS = tuple(float(f"{10.0 ** (-0.5 * n):.2g}") for n in range(6, 27))


def engine(system: mbody.System, until: float, *, given: bool = False) -> Engine:
    """`mbody.simulate` at rtol 1e-3 to 1e-13; `given` hands it the start, as peers have it."""
    start = mbody.simulate(system, 1e-9, instants=2).take([0]) if given else None

    def prepare(rtol: float) -> Callable[[], mbody.Solution]:
        return lambda: mbody.simulate(system, until, start=start, rtol=rtol, instants=2)

    def state(run: mbody.Solution) -> tuple[np.ndarray, np.ndarray]:
        names = [body.name for body in system.mechanism.bodies]
        histories = [run[name] for name in names]
        return (
            np.array([h.angle[-1] for h in histories]),
            np.array([h.omega[-1] for h in histories]),
        )

    return Engine(OURS + (", start given" if given else ""), SETTINGS, prepare, state)
