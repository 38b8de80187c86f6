"""The oracle: planar mechanisms with dense matrices, slow and simple, as in the textbook.

Haug, Computer-Aided Kinematics and Dynamics (1989). It reads the description (`Mechanism`, frozen
elements) and shares no numerical code with mbody: only laws are evaluated by their public
`derivatives`. Coordinates are (x, y, θ) of every body's mass centre, bodies in the order of the
description; rows are those of the joints in the order of the description, then those of the
drivers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbody.engines.oracle.friction import DenseFriction, rubs
from mbody.engines.oracle.mechanics import Loads


class Reference(Loads):
    """The oracle of one mechanism: forces of a motion, and accelerations by forces."""

    def kinetostatics(
        self, q: Any, v: Any, a: Any, t: float, drive: Iterable[str] | None = None
    ) -> dict[str, Any]:
        """Forces of a known motion: Φ_qᵀ λ = f − M a by least squares.

        Parameters
        ----------
        q, v, a : arrays (3n,)
            The motion at time t.
        drive : names, optional
            The drivers that act, by default all (a mapping, as in analyses, means all too).

        Returns
        -------
        dict
            "lam" (m,), zero in rows of idle drivers; "reactions" {joint: (Fx, Fy, T)}, force on
            body j by body i in world axes and torque at the marker on j; "unique" {joint: (3,)
            bool}; "efforts" {driver: effort}; "residual", the largest |Φ_qᵀ λ − f + M a|.
        """
        rows = self.active_rows(drive)
        rough = any(rubs(joint) for joint in self.mechanism.joints)
        if rough and len(rows) == self.m == 3 * self.n:
            return self._with_friction(q, v, a, t)
        if rough:
            raise NotImplementedError("it solves for friction where the reactions are unique")
        g = self.phi_q(q, t)[rows]
        right = self.applied(q, v, t) - self.mass_matrix() @ np.asarray(a)
        lam = np.zeros(self.m)
        lam[rows] = np.linalg.lstsq(g.T, right, rcond=1e-12)[0]
        free = np.zeros((self.m, len(rows)))  # columns: multipliers without effect (null space)
        _, s, vt = np.linalg.svd(g.T)
        rank = int((s > 1e-10 * s.max(initial=0.0)).sum())
        free[rows] = np.hstack([vt[rank:].T, np.zeros((len(rows), rank))])
        unique = {
            name: np.abs(matrix @ free).max(axis=1) < 1e-8 * (1.0 + np.abs(matrix).max())
            for name, matrix in self.reaction_matrices(q, t).items()
        }
        return {
            "lam": lam,
            "reactions": self.reactions(q, t, lam),
            "unique": unique,
            "efforts": {
                e.name: -float(lam[self.rows[e.name]][0])
                for e in (*self.mechanism.couplings, *self.mechanism.drivers)
            },
            "residual": float(np.abs(g.T @ lam[rows] - right).max(initial=0.0)),
        }

    def _with_friction(self, q: Any, v: Any, a: Any, t: float) -> dict[str, Any]:
        """The same with friction in joints, none in those at rest; no numbers where it jams."""
        found = DenseFriction(self, q, v, a, t).solve()
        lam = np.full(self.m, np.nan) if found is None else found.lam
        reactions = self.reactions(q, t, lam)
        if found is not None:
            reactions = {name: r + found.wrench.get(name, 0.0) for name, r in reactions.items()}
        efforts = (*self.mechanism.couplings, *self.mechanism.drivers)
        return {
            "lam": lam,
            "reactions": reactions,
            "unique": {joint.name: np.ones(3, dtype=bool) for joint in self.mechanism.joints},
            "efforts": {e.name: -float(lam[self.rows[e.name]][0]) for e in efforts},
            "residual": 0.0,
        }

    def reaction_matrices(self, q: Any, t: float) -> dict[str, np.ndarray]:
        """(3, m) of every joint: its (Fx, Fy, T) at the reaction point is that matrix times λ."""
        q_all, g = self.with_ground(q), self.phi_q_all(q, t)
        found = {}
        for joint in self.mechanism.joints:
            k = 3 * self.index[joint.j.body]
            matrix = np.zeros((3, self.m))
            rows = self.rows[joint.name]
            matrix[:, rows] = -g[rows, k : k + 3].T
            (px, py), (x, y, _) = self.reaction_point(q_all, joint), self.pose(q_all, joint.j.body)
            matrix[2] -= (px - x) * matrix[1] - (py - y) * matrix[0]
            found[joint.name] = matrix
        return found

    def reactions(self, q: Any, t: float, lam: Any) -> dict[str, np.ndarray]:
        """(Fx, Fy, T) of every joint: on body j by body i, at the marker on j."""
        return {name: matrix @ lam for name, matrix in self.reaction_matrices(q, t).items()}

    def dynamics(
        self,
        q: Any,
        v: Any,
        t: float,
        drive: Iterable[str] | None = (),
        efforts: Mapping[str, float] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """(a (3n,), λ (m,)) from [M Φ_qᵀ; Φ_q 0]: forward dynamics.

        Drivers that are not in `drive` are free, with their `efforts` or none.
        """
        if any(rubs(joint) for joint in self.mechanism.joints):
            raise NotImplementedError("it has no friction of joints in motions over time")
        rows, size = self.active_rows(drive), 3 * self.n
        every = self.phi_q(q, t)
        f = self.applied(q, v, t)
        for name, effort in (efforts or {}).items():
            f += effort * every[self.rows[name]][0]
        g = every[rows]
        matrix = np.block([[self.mass_matrix(), g.T], [g, np.zeros((len(rows), len(rows)))]])
        right = np.concatenate([f, self.gamma(q, v, t)[rows]])
        solution = np.linalg.lstsq(matrix, right, rcond=1e-13)[0]
        lam = np.zeros(self.m)
        lam[rows] = solution[size:]
        return solution[:size], lam

    def residual_power(self, q: Any, v: Any, a: Any, t: float) -> float:
        """Virtual work Σ (f − M a)·v + Σ effort · driven rate: zero for a correct result."""
        every = self.kinetostatics(q, v, a, t)["efforts"]
        efforts = {d.name: every[d.name] for d in self.mechanism.drivers}
        g = self.phi_q(q, t)
        power = (self.applied(q, v, t) - self.mass_matrix() @ a) @ v
        return float(power + sum(efforts[n] * (g[self.rows[n]][0] @ v) for n in efforts))
