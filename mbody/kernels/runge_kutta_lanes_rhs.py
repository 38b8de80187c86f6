"""Right-hand side of free motion in many lanes, and the first states of a batch.

What a lane gets does not depend on its neighbours, bit for bit: a lane whose projection has
converged keeps its position while the others go on (`mbody.kernels.projection`).
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import ld, st, wide
from mbody.kernels.forces import signals
from mbody.kernels.layout import Layout, Work
from mbody.kernels.output import keep
from mbody.kernels.position_velocity import put_column
from mbody.kernels.projection import projected_accelerations
from mbody.kernels.singularity_monitor import sample_conditioning
from mbody.kernels.state_derivative import load_state, store_derivative, store_state

__all__ = ["Batch", "initial_derivatives", "not_finite", "projected_derivative", "put_numbers"]


class Batch(Bundle):
    """Designs, a column each, and what is kept of their motions.

    Attributes
    ----------
    par, mass, weight : arrays (parameters, designs), (coordinates + 3, designs), (columns, designs)
        Numbers of the designs.
    y, derivative, scale : arrays (2·coordinates, designs)
        First states, their derivatives, sizes of the coordinates.
    near : array (nodes, designs)
        Distances from singular positions at the first states.
    step, conditioning : arrays (designs,)
        First length of step; conditioning of the constraints at the first state.
    begin : float
        The first time.
    times : array (instants,)
        Output instants.
    rows : array (kept,)
        Which rows are kept (see `mbody.kernels.output`).
    output : array (kept, designs, instants)
        What is kept.
    bad : array (designs,)
        One where a design must go alone.
    """

    par: Rows
    mass: Rows
    weight: Rows
    y: Rows
    derivative: Rows
    scale: Rows
    near: Rows
    step: Floats
    conditioning: Floats
    begin: float
    times: Floats
    rows: Ints
    output: Stacks
    bad: Floats


@njit
def projected_derivative(L, W, y, K, refinements, among):
    """K ← the derivative of the projection of the states y, which they become, at W.time, in the
    lanes where `among` is one. Returns one in lanes where the projection did not converge, else
    zero.
    """
    w = wide()
    load_state(L, W, w, y)
    _, _, failed = projected_accelerations(L, W, w, 0.0, refinements, among)
    store_state(L, W, w, y)
    store_derivative(L, W, w, K)
    return failed


@njit
def not_finite(page, w):
    """Zero in lanes in which all rows of a page are finite, else NaN."""
    total = 0.0 * ld(page, 0, w)
    for n in range(1, page.shape[0]):
        total = total + 0.0 * ld(page, n, w)
    return total


@kernel
def initial_derivatives(L: Layout, W: Work, refinements: int, batch: Batch, page: Rows) -> None:
    """Project the first state of every design and evaluate its derivative: batch.y and
    batch.derivative, conditioning, near and bad; the first output instant is kept where it is the
    first time.

    page (rows, lanes): workspace. The last lanes repeat the last design.
    """
    w = wide()
    designs, lanes = batch.par.shape[1], page.shape[1]
    n3, t = 3 * L.bodies, batch.begin
    kept = batch.times[0] <= t
    for low in range(0, designs, lanes):
        for lane in range(lanes):
            design = min(low + lane, designs - 1)
            put_numbers(W, batch, lane, design)
            W.time[0, lane] = t
            for n in range(n3):
                W.q[n, lane], W.v[n, lane] = batch.y[n, design], batch.y[n3 + n, design]
            for n in range(L.owns):
                W.own[n, lane] = batch.y[2 * n3 + n, design]
        signals(L, W, w, L.signal_law.shape[0])
        _, _, failed = projected_accelerations(L, W, w, 0.0, refinements, 1.0 + 0.0 * wide())
        conditioning = sample_conditioning(L, W, w, 0)
        keep(L, W, w, page)
        failed = failed + not_finite(page, w)
        many = min(lanes, designs - low)
        if kept:
            for n in range(batch.rows.shape[0]):
                for lane in range(many):
                    batch.output[n, low + lane, 0] = page[batch.rows[n], lane]
        for lane in range(many):
            design = low + lane
            for n in range(n3):
                batch.y[n, design], batch.y[n3 + n, design] = W.q[n, lane], W.v[n, lane]
                batch.derivative[n, design] = W.v[n, lane]
                batch.derivative[n3 + n, design] = W.a[n, lane]
            for n in range(L.owns):
                batch.derivative[2 * n3 + n, design] = W.own_rate[n, lane]
        st(page, 0, conditioning, w)
        st(page, 1, failed, w)
        for lane in range(many):
            batch.conditioning[low + lane] = page[0, lane]
            for k in range(L.nodes):
                batch.near[k, low + lane] = W.near[k, lane]
            batch.bad[low + lane] = 0.0 if page[1, lane] == 0.0 else 1.0


@inline
def put_numbers(W, batch, lane, design):
    """The numbers of a design into a lane."""
    put_column(batch.par, design, W.par, lane)
    put_column(batch.mass, design, W.mass, lane)
    put_column(batch.weight, design, W.weight, lane)
