"""Accelerations near an instant of a motion, and their derivatives, by what the leaders do."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from mbody.analysis.dynamics.initial_step import REFINEMENTS
from mbody.analysis.dynamics.integrators import stepping
from mbody.analysis.dynamics.interruptions import without_held
from mbody.analysis.linear.held_modes import HeldModes
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.tangent_space import STEP, Array, Manifold, Place
from mbody.errors import SolveError
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import TIME
from mbody.solution.energy import causes
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.rank import dense, dense_rates

__all__ = ["Moving"]

#: Steps of inputs and own states are lengthened by so much at most.
FARTHEST = 1e6


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
    P their parts of the coordinates y = P (q − q₀) and w = P v, exactly. `still`: drivers hold
    their values. `held`: what is closed, sticks and slides.
    """

    def __init__(
        self,
        manifold: Manifold,
        here: Place,
        v: Array,
        regularization: float,
        ways: Array,
        parts: Array,
        still: bool = False,
        held: HeldModes | None = None,
    ) -> None:
        self.manifold, self.here, self.v, self.regularization = manifold, here, v, regularization
        self.system, self.ways, self.parts = manifold.system, ways, parts
        self.t = float(manifold.time[0])
        # drivers move here, unless they hold: their rates are those of their laws
        self.work = self.system.work()
        self.work.time[:] = self.t
        laws_of_time(self.system.runtime(), self.work)
        L, system = self.system.layout, self.system
        rows = np.append(L.input_row, L.driver_row if still else []).astype(np.int64)
        self.runtime = without_held(system.runtime(), {str(row): int(row) for row in rows})
        if still:
            for more in (1, 2):
                self.work.signal[L.driver_row + more] = 0.0
        self.whole = system.work(masses=True)
        self.whole.signal[:] = self.work.signal
        self.held = held
        if held is not None:
            for work in (self.work, self.whole):
                held.enter(work)
        self.memory = stepping(system.state_count, len(causes(system)), regularization)
        own = self.work.signal[L.input_row, 0]
        self.own = (
            np.append(system.first_states[:, 0], own) if manifold.own is None else manifold.own
        )

    def matrices(self, mass: Array) -> tuple[Array, Array, Array]:
        """C, K and what drives the leaders; mass (free, free) is theirs."""
        by_way, by_rate = self.derivatives(self.along)
        return -mass @ by_rate, -mass @ by_way, mass @ self._first

    def derivatives(self, function: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
        """∂f/∂y and ∂f/∂w (rows, free) of a function of ways and rates of the leaders."""
        still, rate = np.zeros(len(self.parts)), self.rate
        # where a body moves fast beside its leader, the leader's step is short
        steps = STEP / np.abs(self.ways).max(axis=1)
        pull = np.abs(self._first @ self.ways).max(initial=0.0)
        v = self.v / self.manifold.scale
        swift = max(float(np.abs(v).max()), float(np.sqrt(pull))) or 1.0
        by_way = _difference(lambda y: function(y, rate), steps)
        return by_way, _difference(lambda w: function(still, rate + w), swift * steps)

    @functools.cached_property
    def rate(self) -> Array:
        """Rates of the leaders."""
        return np.asarray(self.parts @ (self.v / self.manifold.scale))

    @functools.cached_property
    def _first(self) -> Array:
        """Accelerations of the leaders."""
        return self.along(np.zeros(len(self.parts)), self.rate)

    def along(self, y: Array, w: Array) -> Array:
        """Accelerations of the leaders at their ways and rates."""
        return self.instant(y, w)[0]

    def instant(
        self, y: Array, w: Array, own: Array | None = None
    ) -> tuple[Array, Array, Solution]:
        """Accelerations of the leaders at their ways and rates, rates of own states, and the
        instant; `own`: own states, then inputs, by default those of the instant.
        """
        n, scale, L, S = self.system.coordinates, self.manifold.scale, self.runtime, self.memory
        q, G = self.position(y)
        nu = dense_rates(self.system, self.work)
        if self.held is not None:
            nu = np.append(nu, self.held.rows(self.work)[2])
        v = scale * _solved(np.vstack([G, self.parts]), np.append(nu, w))
        given = self.own if own is None else own
        S.y[:n], S.y[n : 2 * n], S.y[2 * n :] = q, v, given[: L.owns]
        self.whole.signal[L.input_row, 0] = given[L.owns :]
        S.state[TIME] = self.t
        page = np.empty((self.system.page_rows, 1))
        initial_derivative(L, self.whole, S, REFINEMENTS, page)
        raise_user_error(self.system)
        run = Solution(
            self.system,
            "simulate",
            np.array([self.t]),
            Record([page[None]], 1, batch=False),
            None,
            regularization=self.regularization,
        )
        return self.parts @ (page[2 * n : 3 * n, 0] / scale), S.K[0, 2 * n :].copy(), run

    def by_own(self, function: Callable[[Array], Array]) -> Array:
        """∂f/∂(own states, inputs) (rows, …) of a function of them."""
        first = function(self.own)
        size, columns = float(np.abs(first).max(initial=0.0)), []
        for n, value in enumerate(self.own):
            step, way = STEP * max(1.0, abs(float(value))), np.zeros(len(self.own))
            way[n] = step
            slope = float(np.abs(function(self.own + way) - first).max(initial=0.0)) / step
            # where what it changes is small beside the rest, a longer step is more exact
            way[n] = max(step, min(STEP * size / slope, FARTHEST * step)) if slope else step
            near = function(self.own + way) - function(self.own - way)
            far = function(self.own + 2.0 * way) - function(self.own - 2.0 * way)
            columns.append((8.0 * near - far) / (12.0 * way[n]))
        return np.array(columns).reshape(len(self.own), -1).T

    def position(self, y: Array) -> tuple[Array, Array]:
        """The closed position (coordinates,) at ways of the leaders, and Φ_q there."""
        n, scale = self.system.coordinates, self.manifold.scale
        q = self.here.q + scale * (y @ self.ways)
        for _ in range(8):
            self.work.q[:n, 0] = q
            phi, G = dense(self.system, self.work)
            if self.held is not None:
                more = self.held.rows(self.work)
                phi, G = np.append(phi, more[0]), np.vstack([G, more[1]])
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
