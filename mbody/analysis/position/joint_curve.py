"""The curve of positions that the joints allow where one driver is released."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mbody.core import arclength
from mbody.core import tolerances as tol
from mbody.kernels.layout import Work
from mbody.model.driver import Driver
from mbody.system.rank import ClosedRows, close_rows, dense, side_of
from mbody.system.system import System

Array = np.ndarray

PACE = arclength.Pace(
    tol.CIRCUIT_STEP_FIRST,
    tol.CIRCUIT_STEP_LONGEST,
    tol.CIRCUIT_STEP_SHORTEST,
    math.acos(tol.CIRCUIT_STEP_COSINE),
    leap=100.0 * tol.WALK_STEP_SHORTEST * tol.WALK_STEP,
)
#: A bracket of a dead centre, as a part of a step.
BRACKET = 0.5**50


@dataclass(frozen=True, eq=False)
class JointPoint(arclength.CurvePoint):
    """A position of the curve.

    `value`, `rate`: Of the driver; the rate is without units: zero at a dead centre.
    `regularity`: The least singular value of the other rows by the greatest: zero where branches
      meet.
    """

    odd = ("rate",)
    value: float
    rate: float
    regularity: float


class JointCurve:
    """Positions of a system whose one driver is released; others are where the workspace says."""

    def __init__(self, system: System, work: Work, driver: Driver) -> None:
        self.system, self.work = system, work
        which = [d.name for d in system.drivers].index(driver.name)
        self.n, self.row = system.coordinates, system.rows - len(system.drivers) + which
        self.unit = driver.unit(system.length)
        self.requested = float(work.signal[system.layout.driver_row[which], 0])
        self.others = np.arange(system.rows) != self.row

    def point(
        self, x: Array, ahead: Array | None = None, here: JointPoint | None = None
    ) -> JointPoint:
        """A closed position, near another; its tangent goes on in a direction, or to where the
        driver's value grows.
        """
        phi, G = dense(self.system, self.work, x)
        others = G[self.others]
        _, sizes, vt = np.linalg.svd(others)
        along = vt[-1]
        rate = float(G[self.row] @ along)
        if (rate if ahead is None else along @ ahead) < 0.0:
            along, rate = -along, -rate
        value = self.requested + float(phi[self.row]) * self.unit
        regularity = float(sizes[: self.n - 1][-1] / sizes[0])
        side, frame = side_of(others, along, here.frame if here else None)
        return JointPoint(x, along, side, frame, value, rate, regularity)

    def close(self, here: JointPoint | None, x: Array, ahead: Array | None) -> JointPoint | None:
        """The nearest position of the curve."""
        found = self._closed(x, self.others, 0.0)
        return self.point(found.x, ahead, here) if found.good else None

    def at_value(self, x: Array, value: float) -> Array:
        """The position near x at a value of the driver, with the units of coordinates."""
        every = np.full(len(self.others), True)
        return self._closed(x, every, value).x * self.system.coordinate_units

    def _closed(self, x: Array, chosen: Array, value: float) -> ClosedRows:
        """Where chosen rows vanish, the driver's at a value of it."""
        off = (value - self.requested) / self.unit * ~self.others

        def rows(x: Array) -> tuple[Array, Array]:
            phi, G = dense(self.system, self.work, x)
            return (phi - off)[chosen], G[chosen]

        return close_rows(rows, x)

    def leaps(self, here: JointPoint, there: JointPoint) -> bool:
        """Whether another branch lies between two neighbours, or two dead centres: the parabola
        through both rates whose mean is that of the value changes its sign twice.
        """
        length = arclength.norm(there.x - here.x)
        mean, r = (there.value - here.value) / (self.unit * length), here.rate
        a, b = 3.0 * (r + there.rate) - 6.0 * mean, -4.0 * r - 2.0 * there.rate + 6.0 * mean
        extremum = -0.5 * b / a if a else 0.0
        twice = 0.0 < extremum < 1.0 and r * (r + 0.5 * b * extremum) < 0.0 < r * there.rate
        return twice or here.crosses(there)

    def dead_centre(self, here: JointPoint, there: JointPoint) -> JointPoint:
        """The position between two at which the driver's value turns back."""

        def rate(point: JointPoint) -> float:
            return point.rate if abs(point.rate) > tol.PATH_DERIVATIVE_NONE else 0.0

        return arclength.zero_on(self.close, here, there, rate, BRACKET)[0]
