"""Refinement of a path: least squares with exact derivatives, from a candidate of the search."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.synthesis.curve_search import PathDemand, PlacedCurve
from mbody.synthesis.linkage_kinds import Kind

__all__ = ["misses", "refined"]

#: Share of the width of bounds by which a start stays within them.
WITHIN = 1e-9
#: Relative changes of the sum of squares, the numbers and the gradient at which it ends: those of
#: rounding, since exact designs are to be found exactly.
ENDS = 1e-15
EVALUATIONS = 200


def misses(kind: Kind, x: np.ndarray, theta: np.ndarray, sense: float, points: np.ndarray) -> Any:
    """P minus the points, complex (points,); NaN where the loop does not close."""
    carrier, _ = kind.poses(x, theta, sense)
    return _point(kind, x, np.exp(1j * theta), carrier) - points


def refined(kind: Kind, demand: PathDemand, start: PlacedCurve) -> PlacedCurve | None:
    """The nearest design whose sum of squared distances is least; None where the start does not
    close within the bounds.
    """
    from scipy.optimize import least_squares

    size = len(kind.numbers)
    # what is small in the gradient is so beside the path, whatever the unit
    extent = float(np.abs(demand.points - demand.points.mean()).max()) or 1.0
    free = demand.timing is None
    extra = start.theta if free else start.theta[:1]
    width = WITHIN * np.minimum(demand.high - demand.low, 1.0)
    begin = np.concatenate([np.clip(start.x, demand.low + width, demand.high - width), extra])
    endless = np.full(len(extra), np.inf)
    steps = np.zeros(1) if free else _steps(demand)

    def residual(y: np.ndarray) -> np.ndarray:
        miss = misses(kind, y[:size], y[size:] + steps, start.sense, demand.points)
        return np.concatenate([miss.real, miss.imag]) / extent

    def jacobian(y: np.ndarray) -> np.ndarray:
        return _jacobian(kind, y[:size], y[size:] + steps, start.sense, free) / extent

    if not np.isfinite(residual(begin)).all():
        return None
    found = least_squares(
        residual,
        begin,
        jacobian,
        bounds=(
            np.concatenate([demand.low, -endless]),
            np.concatenate([demand.high, endless]),
        ),
        x_scale="jac",
        ftol=ENDS,
        xtol=ENDS,
        gtol=ENDS,
        max_nfev=EVALUATIONS,
    )
    theta = found.x[size:] + steps
    return PlacedCurve(2.0 * float(found.cost) * extent**2, found.x[:size], theta, start.sense)


def _steps(demand: PathDemand) -> np.ndarray:
    """Crank angles after the first."""
    timing = np.asarray(demand.timing)
    return timing - timing[0]


def _point(kind: Kind, x: np.ndarray, crank: np.ndarray, carrier: np.ndarray) -> Any:
    arm = complex(x[kind.point_number], x[kind.point_number + 1])
    return complex(x[0], x[1]) + x[kind.crank_number] * crank + arm * carrier


def _jacobian(kind: Kind, x: np.ndarray, theta: np.ndarray, sense: float, free: bool) -> np.ndarray:
    """Derivatives of the misses by the numbers and by the first angle, or by all angles."""
    phi, by, by_angle = kind.direction(x, theta, sense)
    crank, carrier = np.exp(1j * theta), np.exp(1j * phi)
    arm = complex(x[kind.point_number], x[kind.point_number + 1])
    whole = 1j * (arm * carrier)[:, None] * by
    whole[:, 0] += 1.0
    whole[:, 1] += 1j
    whole[:, kind.crank_number] += crank
    whole[:, kind.point_number] += carrier
    whole[:, kind.point_number + 1] += 1j * carrier
    turned = 1j * x[kind.crank_number] * crank + 1j * arm * carrier * by_angle
    whole = np.column_stack([whole, np.diag(turned) if free else turned])
    return np.vstack([whole.real, whole.imag])
