"""The mechanics of a motion at its present instant, as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mbody.analysis.linear.linearize import linearize
from mbody.analysis.linear.state_matrices import StateMatrices
from mbody.kernels.output import PER_PRIMITIVE
from mbody.model.study import Measure
from mbody.stepping.input_values import Inputs
from mbody.stepping.mechanics import InstantMechanics, Minimal
from mbody.stepping.readings import Readings

__all__ = ["MechanicsNow"]

Array = np.ndarray


class MechanicsNow(Readings):
    """Arrays of the present instant; what steps is in `Simulator`."""

    inputs: Inputs

    def mass_matrix(self, *, minimal: bool = False) -> Array:
        """M (coordinates, coordinates) [mass, mass, mass·length²], diagonal; of minimal coordinates
        Nᵀ M N (free, free), with the units of the leaders.
        """
        here = self._mechanics()
        if not minimal:
            return here.mass
        N = here.minimal().N
        return np.asarray(N.T @ here.mass @ N)

    def jacobian(self) -> Array:
        """Φ_q (rows, coordinates): the rows of joints, couplings and drivers in the order of
        `row_names`, of lengths [1, 1, length] or angles [1/length, 1/length, 1].
        """
        return self._mechanics().jacobian

    def gamma(self) -> Array:
        """γ (rows,) of Φ_q a = γ: what velocities and drivers make of the constraints
        [length/time², or rad/time²].
        """
        return self._mechanics().gamma

    def bias(self, *, minimal: bool = False) -> Array:
        """h (coordinates,) of M a + Φ_qᵀ λ + h = 0: the loads, negative [force, force,
        force·length]; of minimal coordinates h_min (free,) of Nᵀ M N a_min + h_min = 0, with what
        velocities and drivers do.
        """
        here = self._mechanics()
        return here.reduced_bias(here.minimal()) if minimal else -here.loads()

    def gravity(self, *, minimal: bool = False) -> Array:
        """Gravity on the coordinates (coordinates,) [force, force, force·length]; of minimal
        coordinates Nᵀ of it (free,).
        """
        here = self._mechanics()
        force = here.loads(gravity=True)
        return np.asarray(here.minimal().N.T @ force) if minimal else force

    def accelerations(
        self,
        u: Mapping[str, float] | Sequence[float] | Array | None = None,
        *,
        minimal: bool = False,
    ) -> Array:
        """Accelerations (coordinates,) [length/time², rad/time²]; of minimal coordinates (free,).

        Parameters
        ----------
        u : mapping or array (inputs,), optional
            Inputs in place of the present ones, for this evaluation alone.
        """
        n = self.system.coordinates
        page = self._page()
        if u is not None:
            page = memoryview(self._integration.instant(self.inputs.array(u)).reshape(-1).data)
            self._page_valid = False
        a = np.array(page[2 * n : 3 * n])
        return np.asarray(self._mechanics().minimal().P @ a) if minimal else a

    def multipliers(self) -> Array:
        """λ (rows,), in the order of `row_names`, of M a + Φ_qᵀ λ + h = 0 [force, or force·length].
        Redundant rows share theirs by the least norm.
        """
        primitive, row, _ = self.system.row_table
        first = 3 * self.system.coordinates
        return np.array(self._page())[first + PER_PRIMITIVE * primitive + row]

    @property
    def row_names(self) -> tuple[str, ...]:
        """The element of every row of the constraints: joints, couplings, drivers."""
        primitives = self.system.row_table[0]
        return tuple(self.system.owners[e][0].name for e in primitives)

    @property
    def minimal(self) -> Minimal:
        """Minimal coordinates at present: their leaders, N (coordinates, free) and P (free,
        coordinates).
        """
        return self._mechanics().minimal()

    @property
    def q_min(self) -> Array:
        """Minimal coordinates (free,): angles [rad] of the leaders that turn, and of others the
        ways along which they slide now [length].
        """
        return np.asarray(self.minimal.P @ self.q)

    @property
    def N(self) -> Array:
        """Rates of all coordinates for unit rates of the minimal ones: (coordinates, free)."""
        return self.minimal.N

    def state_matrices(
        self, measures: str | Measure | Sequence[str | Measure] = ()
    ) -> StateMatrices:
        """A, B, C, D of small changes about the present state: ẋ = A x + B u, y = C x + D u.

        x are small changes of the minimal coordinates and their rates, y those of measures; see
        `mbody.engineering.linearize`, whose code it is.
        """
        return linearize(self.system, at=self.solution()).state_matrices(measures)

    def _mechanics(self) -> InstantMechanics:
        own = np.array(self._page())[self.system.own_rows]
        return InstantMechanics(self.system, self.t, self.q, self.v, own)
