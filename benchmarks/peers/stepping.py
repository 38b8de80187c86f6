"""Steps for slopes in Python: scipy's DOP853, less a step than `solve_ivp`, and RK4."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["TOLERANCES", "dop853", "rk4"]

#: Seconds after which a run that stalls is given up.
LONGEST = 20.0

TOLERANCES = tuple(float(f"{10.0 ** (-0.5 * n):.2g}") for n in range(6, 28))


def dop853(
    slope: Callable[[float, np.ndarray], np.ndarray],
    y0: np.ndarray,
    until: float,
    rtol: float,
    project: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """The state at the end; `project` moves the end of each step onto the constraints."""
    from scipy.integrate import DOP853

    begin = time.perf_counter()
    solver: Any = DOP853(slope, 0.0, y0, until, rtol=max(rtol, 3e-14), atol=rtol)
    while solver.status == "running":
        solver.step()
        if solver.status == "failed" or not np.isfinite(solver.y).all():
            raise ArithmeticError(f"DOP853 stops at t = {solver.t:.3g}")
        if project is not None:
            solver.y = project(solver.y)
            solver.f = slope(solver.t, solver.y)
        if time.perf_counter() - begin > LONGEST:
            raise TimeoutError(f"at t = {solver.t:.3g} after {LONGEST:g} s")
    return solver.y


def rk4(
    slope: Callable[[float, np.ndarray], np.ndarray], y0: np.ndarray, until: float, count: int
) -> np.ndarray:
    """The state at the end after so many steps of the classical method of order 4."""
    h, y = until / count, y0
    for n in range(count):
        t = n * h
        k1 = slope(t, y)
        k2 = slope(t + 0.5 * h, y + 0.5 * h * k1)
        k3 = slope(t + 0.5 * h, y + 0.5 * h * k2)
        k4 = slope(t + h, y + h * k3)
        y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return y
