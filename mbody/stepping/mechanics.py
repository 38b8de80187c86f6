"""The mechanics of one instant as arrays: masses, constraints, loads, minimal coordinates.

All coordinates are those of the bodies in the order of the description, (x, y) of the mass centre
and the angle of each: with the masses M, the constraints Φ(q, t) = 0 and the loads f,

    M a + Φ_qᵀ λ + h = 0,   h = −f,   Φ_q a = γ.

Minimal coordinates are what the leaders of the free motions do (their angles, or the ways that they
slide), v = N v_min at drivers that rest; the leaders are those of `mbody.engineering.linearize`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.diagnosis import load_forces
from mbody.analysis.freedom.free_motions import free_motions, leading, rates_of
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.errors import SolveError
from mbody.kernels.loop_closure import laws_of_time
from mbody.model.loads import Gravity
from mbody.system.rank import jacobian, rank_of, too_large
from mbody.system.system import System

__all__ = ["InstantMechanics", "Minimal"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Minimal:
    """Minimal coordinates at an instant.

    Attributes
    ----------
    leaders : tuple of str
        The bodies whose motions they are.
    N : array (coordinates, free)
        Rates of all coordinates for unit rates of the leaders.
    P : array (free, coordinates)
        The leaders' parts of the coordinates: q_min = P q, v_min = P v, P N = 1.
    """

    leaders: tuple[str, ...]
    N: Array
    P: Array


class InstantMechanics:
    """The arrays of one instant.

    Parameters
    ----------
    system : System
    t : float
    q, v : arrays (coordinates,)
    own : array (own states + inputs,)
    """

    def __init__(self, system: System, t: float, q: Array, v: Array, own: Array) -> None:
        self.system, self.t, self.q, self.v, self.own = system, t, q, v, own
        n = system.coordinates
        work = self.work = system.work()
        work.time[:] = t
        laws_of_time(system.runtime(), work)
        work.q[:n, 0], work.v[:n, 0] = q, v
        self.phi, self.jacobian = jacobian(system, work)
        raise_user_error(system)
        primitive, row, _ = system.row_table
        self._row = 2 * system.layout.primitive_node[primitive] + row

    @property
    def mass(self) -> Array:
        """M (coordinates, coordinates), diagonal: mass, mass and inertia about the mass centre of
        every body.
        """
        return np.diag(self.system.mass[: self.system.coordinates, 0])

    @property
    def gamma(self) -> Array:
        """γ (rows,): what Φ_q a must be."""
        return np.asarray(self.work.gamma[self._row, 0])

    def loads(self, gravity: bool = False) -> Array:
        """Sum of all loads, or of gravity alone, on the coordinates: (coordinates,)."""
        every = load_forces(self.system, self.system.work(), self.t, self.q, self.v, self.own)
        if gravity:
            loads = self.system.mechanism.loads
            every = every[[isinstance(load, Gravity) for load in loads]]
        return np.asarray(every.sum(axis=0))

    def minimal(self) -> Minimal:
        """Minimal coordinates.

        Raises
        ------
        SolveError
            For a system that is too large for dense matrices.
        """
        system = self.system
        if too_large(system):
            raise SolveError(
                f"minimal coordinates of '{system.mechanism.name}': {system.rows} rows of "
                f"{system.coordinates} coordinates are too many for dense matrices; use the arrays "
                "of all coordinates"
            )
        scale = system.coordinate_units
        G = system.row_units[:, None] * self.jacobian * scale
        motions = free_motions(system, np.append(self.q, np.zeros(3)), rank_of(G).motions)
        rates = rates_of(system, motions).reshape(len(motions), system.coordinates)
        parts = leading(system, motions, rates / scale) if len(motions) else rates
        return Minimal(tuple(motion.leader for motion in motions), rates.T, parts / scale)

    def reduced_bias(self, own: Minimal) -> Array:
        """h_min (free,) of Nᵀ M N a_min + h_min = 0: loads, and what velocities and drivers do.

        Accelerations are a = N a_min + c with P c = 0 and Φ_q c = γ.
        """
        G = np.vstack([self.jacobian, own.P])
        c = np.linalg.lstsq(G, np.append(self.gamma, np.zeros(len(own.P))), rcond=1e-9)[0]
        return np.asarray(own.N.T @ (self.mass @ c - self.loads()))
