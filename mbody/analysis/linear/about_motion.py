"""Accelerations near an instant of a motion, and their derivatives, by what the leaders do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.position.tangent_space import STEP, Array, Manifold, Place
from mbody.errors import SolveError
from mbody.kernels.loop_closure import laws_of_time
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.rank import dense, dense_rates

__all__ = ["Moving"]


def _difference(function: Callable[[Array], Array], steps: Array) -> Array:
    """∂f/∂x at 0 by central differences of fourth order: (rows, steps)."""
    columns = []
    for step, way in zip(steps, np.diag(steps), strict=True):
        near = function(way) - function(-way)
        far = function(2.0 * way) - function(-2.0 * way)
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.array(columns).T


class Moving:
    """Accelerations of the leaders at ways y and rates w of theirs near those of an instant: with
    P their parts of the coordinates y = P (q − q₀) and w = P v, exactly.
    """

    def __init__(
        self,
        manifold: Manifold,
        here: Place,
        v: Array,
        regularization: float,
        ways: Array,
        parts: Array,
    ) -> None:
        self.manifold, self.here, self.v, self.regularization = manifold, here, v, regularization
        self.system, self.ways, self.parts = manifold.system, ways, parts
        self.t = float(manifold.time[0])
        # drivers move here: their rates are those of their laws
        self.work = self.system.work()
        self.work.time[:] = self.t
        laws_of_time(self.system.runtime(), self.work)

    def matrices(self, mass: Array) -> tuple[Array, Array, Array]:
        """C, K and what drives the leaders; mass (free, free) is theirs."""
        still = np.zeros(len(self.parts))
        v = self.v / self.manifold.scale
        rate = self.parts @ v
        first = self.along(still, rate)
        # where a body moves fast beside its leader, the leader's step is short
        steps = STEP / np.abs(self.ways).max(axis=1)
        pull = np.abs(first @ self.ways).max(initial=0.0)
        swift = max(float(np.abs(v).max()), float(np.sqrt(pull))) or 1.0
        by_way = _difference(lambda y: self.along(y, rate), steps)
        by_rate = _difference(lambda w: self.along(still, rate + w), swift * steps)
        return -mass @ by_rate, -mass @ by_way, mass @ first

    def along(self, y: Array, w: Array) -> Array:
        """Accelerations of the leaders at their ways and rates."""
        n, scale = self.system.coordinates, self.manifold.scale
        q, G = self.position(y)
        nu = dense_rates(self.system, self.work)
        v = scale * _solved(np.vstack([G, self.parts]), np.append(nu, w))
        page = np.concatenate([q, v, np.zeros(n)])[None, :, None]
        record, t = Record([page], 1, batch=False), np.array([self.t])
        start = Solution(self.system, "close_loops", t, record, None, self.regularization)
        run = simulate(self.system, self.t + 1.0, start=start, times=t)
        a = run.record.table(slice(2 * n, 3 * n))[0]
        return np.asarray(self.parts @ (a / scale))

    def position(self, y: Array) -> tuple[Array, Array]:
        """The closed position (coordinates,) at ways of the leaders, and Φ_q there."""
        n, scale = self.system.coordinates, self.manifold.scale
        q = self.here.q + scale * (y @ self.ways)
        for _ in range(8):
            self.work.q[:n, 0] = q
            phi, G = dense(self.system, self.work)
            off = np.append(phi, self.parts @ ((q - self.here.q) / scale) - y)
            step = _solved(np.vstack([G, self.parts]), off)
            q = q - scale * step
            if np.abs(step).max() < 1e-14:
                break
        if np.abs(off).max() > 1e-10 * (1.0 + float(np.abs(q / scale).max())):
            raise SolveError(
                f"the position of '{self.system.mechanism.name}' at t = {self.t:.6g} "
                f"{self.system.mechanism.units.time} is singular: branches of its motion meet, so "
                "that it has no linear equations; take an instant beside it"
            )
        return q, G


def _solved(A: Array, b: Array) -> Array:
    """Least squares; rows that depend on others, as of redundant joints, have no say."""
    return np.asarray(np.linalg.lstsq(A, b, rcond=1e-9)[0])
