"""The oracle's motion: Newton's method, and least squares for velocities and accelerations."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbody.engines.oracle.constraints import Constraints
from mbody.model.driver import Driver

__all__ = ["ReferenceMotion"]


class ReferenceMotion(Constraints):
    """Driven motion of one mechanism."""

    def active_rows(self, drive: Iterable[str] | None) -> np.ndarray:
        """Indices of rows of all joints and of the drivers named (None or a mapping: all)."""
        if drive is None or isinstance(drive, Mapping):
            active = {d.name for d in self.mechanism.drivers}
        else:
            active = set(drive)
        active |= {each.name for each in self.elements if not isinstance(each, Driver)}
        return np.array(
            [
                k
                for e in self.elements
                if e.name in active
                for k in range(self.rows[e.name].start, self.rows[e.name].stop)
            ],
            dtype=int,
        )

    def _changed(
        self, rows: np.ndarray, given: Mapping[str, float] | None, t: float, order: int
    ) -> np.ndarray:
        """Right-hand sides with other driven values (order 0), rates (1) or accelerations (2)."""
        for name, value in (given or {}).items():
            driver: Any = self.mechanism[name]
            rows[self.rows[name]] += value - driver.law.derivatives(t)[order]
        return rows

    def close(
        self, q0: Any, t: float, values: Mapping[str, float] | None = None, tol: float = 1e-15
    ) -> np.ndarray:
        """q (3n,) near q0 with Φ(q, t) = 0, by Newton's method until a step is below `tol`.

        `values` {driver: value} overrides the driven values; ArithmeticError where it fails.
        """
        q = np.array(q0, dtype=float)
        last = math.inf
        for _ in range(60):
            phi = -self._changed(-self.phi(q, t), values, t, 0)
            step = np.linalg.lstsq(self.phi_q(q, t), -phi, rcond=1e-13)[0]
            q += step
            size = float(np.abs(step).max(initial=0.0)) / (1.0 + float(np.abs(q).max(initial=0.0)))
            if size < tol or (size < 1e-12 and size > 0.5 * last):
                break
            last = size
        phi = self._changed(-self.phi(q, t), values, t, 0)
        if not np.abs(phi).max(initial=0.0) < 1e-11 * (1.0 + np.abs(q).max(initial=0.0)):
            raise ArithmeticError(f"loops do not close: {np.abs(phi).max():.2e}")
        return q

    def velocities(self, q: Any, t: float, rates: Mapping[str, float] | None = None) -> np.ndarray:
        """v (3n,) from Φ_q v = ν; `rates` {driver: rate} overrides the laws' rates."""
        nu = self._changed(self.nu(q, t), rates, t, 1)
        return np.linalg.lstsq(self.phi_q(q, t), nu, rcond=1e-13)[0]

    def accelerations(
        self, q: Any, v: Any, t: float, accelerations: Mapping[str, float] | None = None
    ) -> np.ndarray:
        """a (3n,) from Φ_q a = γ; `accelerations` {driver: value} overrides the laws'."""
        gamma = self._changed(self.gamma(q, v, t), accelerations, t, 2)
        return np.linalg.lstsq(self.phi_q(q, t), gamma, rcond=1e-13)[0]

    def motion(self, times: Any, q0: Any = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(q, v, a), each (len(times), 3n), one instant after the other on one branch.

        Instants should be close together: Newton's method starts each from the last q + v dt.
        """
        q = self.guess() if q0 is None else np.asarray(q0)
        found: list[Any] = []
        before: float | None = None
        v = np.zeros(3 * self.n)
        for t in map(float, times):
            q = self.close(q if before is None else q + v * (t - before), t)
            v = self.velocities(q, t)
            found.append((q, v, self.accelerations(q, v, t)))
            before = t
        q_t, v_t, a_t = (np.array(part) for part in zip(*found))
        return q_t, v_t, a_t
