"""Least squares: nonlinear ones within bounds, and linear ones without negative unknowns.

min |r(x)|², low ≤ x ≤ high, by steps of min |r + J s|² + λ |D s|² within the bounds (the method of
Levenberg and Marquardt; D: the greatest norms that the columns of J had, so that no unit has a
say; J. J. Moré 1978), to second order along the step where steps have failed (geodesic
acceleration; Transtrum and Sethna, arXiv:1201.5885).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Where a search ended: `x` (unknowns,), `cost`, the sum of squares there, and whether it is
    `settled`: no step would make it less.
    """

    x: Array
    cost: float
    settled: bool


def least_squares(
    residual: Callable[[Array], Array],
    jacobian: Callable[[Array], Array],
    start: Array,
    bounds: tuple[Array | float, Array | float] = (-np.inf, np.inf),
    *,
    most: int = 200,
    ends: float = tol.LEAST_SQUARES_ENDS,
    size: float = 0.0,
) -> LeastSquares:
    """The least sum of squares near a start, by so many steps at most.

    `bounds`: Equal ones hold a number. `ends`: Part of the sum that a last step promises. `size`:
    Of what residuals are differences of, beside which they are rounding. A residual beyond the
    start that is NaN, or refused by a ModelError or SolveError, makes the step shorter.
    """
    x = np.clip(start, *bounds)
    low, high = (np.broadcast_to(one, x.shape) for one in bounds)
    free = low < high
    low, high = low[free], high[free]
    left, J = residual(x), jacobian(x)[:, free]
    damping, failed, D, settled = tol.LEAST_SQUARES_DAMPING_FIRST, 2.0, np.zeros(J.shape[1]), False
    curved = False

    def moved(step: Array) -> Array:
        there = x.copy()
        there[free] = np.clip(x[free] + step, low, high)
        return there

    for _ in range(most):
        cost = float(left @ left)
        D = np.maximum(D, np.linalg.norm(J, axis=0))
        step = _bounded_step(J, left, D, damping, low - x[free], high - x[free])
        change = J @ step
        foreseen = -float((2.0 * left + change) @ change)
        rounding = tol.LEAST_SQUARES_ENDS * max(size, float(np.linalg.norm(D * x[free])))
        settled = foreseen <= ends * cost + rounding**2
        if foreseen <= 0.0:
            break
        try:
            if curved:
                h = tol.LEAST_SQUARES_BEND_STEP  # of a difference along the step
                bend = 2.0 / h * ((residual(moved(h * step)) - left) / h - change)
                if np.isfinite(bend).all():
                    more = _bounded_step(J, bend, D, damping, low - high, high - low)
                    if np.linalg.norm(D * more) <= np.linalg.norm(D * step):
                        step = step + 0.5 * more
            new = residual(moved(step))
            fall = cost - float(new @ new)
        except (SolveError, ModelError):
            fall = -math.inf
        if fall > tol.LEAST_SQUARES_FALLS * foreseen:
            x, left = moved(step), new
            # slowly up at first and fast down: the way along a narrow curved valley
            damping, failed = max(damping / 5.0, tol.LEAST_SQUARES_DAMPING_LEAST), 2.0
            if not settled:
                J = jacobian(x)[:, free]
        else:
            damping, failed, curved = damping * failed, 2.0 * failed, True
        if settled:
            break
    return LeastSquares(x, float(left @ left), settled)


def _bounded_step(
    J: Array, left: Array, D: Array, damping: float, low: Array, high: Array
) -> Array:
    """The step s between low and high with the least |r + J s|² + λ |D s|²."""
    unit = 1.0 / np.where(D > 0.0, D, 1.0)
    q, r = np.linalg.qr(np.concatenate([J * unit, math.sqrt(damping) * np.eye(len(unit))]))
    goal = -(q.T[:, : len(left)] @ left)
    step = np.linalg.solve(r, goal) * unit
    if (step < low).any() or (step > high).any():
        from scipy.optimize import lsq_linear

        step = lsq_linear(r, goal, (low / unit, high / unit), method="bvls").x * unit
    return np.asarray(step)


def nonnegative(columns: Array, goal: Array) -> Array:
    """The x ≥ 0 of least |columns x − goal| (Lawson and Hanson 1974); 0 of a column of zeros."""
    from scipy.optimize import nnls

    norms = np.maximum(np.linalg.norm(columns, axis=0), tol.TINY)
    scaled = columns / norms
    x = nnls(scaled, goal, maxiter=100 * (len(norms) + 10))[0]
    used = np.flatnonzero(x)
    if len(used):
        # once more: the last solve of nnls has half of the figures
        better, _, rank, _ = np.linalg.lstsq(scaled[:, used], goal, rcond=tol.SINGULAR_VALUE_ZERO)
        if rank == len(used) and (better >= 0.0).all():
            x[used] = better
    return np.asarray(x / norms)
