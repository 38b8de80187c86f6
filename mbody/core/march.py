"""Lane continuation: many motions, or many pieces of one, side by side with fixed steps.

Every lane starts from its own closed position and predicts, corrects and checks like the scalar
path, but cannot halve its step: a lane that fails a check is marked and left to `follow`. One LU of
the square Φ_q an instant serves position, velocity, acceleration and reactions.
"""

from __future__ import annotations

from mbody._jit import inline, kernel, njit
from mbody._lanes import highest, larger, ld, select_le, st, wide
from mbody._reference import by_reference
from mbody.core.factor import apply_g
from mbody.core.follow import CORRECTION, TURNED
from mbody.core.forces import forces, signals
from mbody.core.instant import acting, rates, reach, unbalanced
from mbody.core.output import keep
from mbody.core.path import behind, predict, step_size, strayed
from mbody.core.rows import rows, turns
from mbody.core.square import factor_square, solve_square, solve_transposed

__all__ = ["march", "march_designs"]

ITERATIONS = 6
#: Accepted correction, in parts of the greatest coordinate.
TOLERANCE = 1e-12
#: Square of what Φ_q v − ν, or f − M a − Φ_qᵀ λ, may be of its terms.
RESIDUAL = 1e-11**2
#: Sum of squares of the multipliers above which the fixed pivots are no longer good: at 1e6
#: accelerations lost five digits (1e-11 of the peak), at 1e4 they keep 1e-14.
GROWTH = 1e4


@njit
def newton(L, P, W, w, F, x):
    """One Newton step on Φ; returns its size (in model lengths and radians) and the growth."""
    turns(L, W, w)
    rows(L, W, w, True, None)
    growth = factor_square(P, W, w, F)
    least_motion(L, P, W, w, F, x, W.phi, W.u)
    size = reach(L, W, w)
    for b in range(L.bodies):
        for n in range(3):
            o = 3 * b + n
            st(W.q, o, ld(W.q, o, w) - ld(W.u, 3 * L.body_slot[b] + n, w), w)
    return size, growth


@inline
def least_motion(L, P, W, w, F, x, c, u):
    """u on columns with Φ_q u = c."""
    for k in range(P.row.shape[0]):
        st(x, k, ld(c, P.row[k], w), w)
    solve_square(P, W, w, F, x)
    for k in range(P.row.shape[0]):
        st(u, P.column[k], ld(x, k, w), w)


@inline
def to_bodies(L, W, w, u, target):
    """Columns to coordinates: a body moves as its first slot."""
    for b in range(L.bodies):
        o, s = 3 * b, 3 * L.body_slot[b]
        st(target, o, ld(u, s, w), w)
        st(target, o + 1, ld(u, s + 1, w), w)
        st(target, o + 2, ld(u, s + 2, w), w)


@njit
def velocities(L, P, W, w, F, x):
    """v from Φ_q v = ν."""
    least_motion(L, P, W, w, F, x, W.nu, W.u)
    to_bodies(L, W, w, W.u, W.v)


@njit
def accelerations(L, P, W, w, F, x):
    """a from Φ_q a = γ."""
    rows(L, W, w, None, True)
    least_motion(L, P, W, w, F, x, W.gamma, W.u)
    to_bodies(L, W, w, W.u, W.a)


@njit
def moving(L, W, w):
    """Whether Φ_q v = ν holds by the blocks: the residual's square beyond what is allowed."""
    for s in range(L.slots):
        for n in range(3):
            st(W.u, 3 * s + n, ld(W.v, 3 * L.slot_body[s] + n, w), w)
    apply_g(L, W, w, W.u, W.x)
    rest, terms = 0.0 * ld(W.size, 0, w), 0.0 * ld(W.size, 0, w)
    for n in range(2 * L.nodes):
        x, y = ld(W.x, n, w), ld(W.nu, n, w)
        rest = rest + (x - y) * (x - y)
        terms = terms + x * x + y * y
    return rest - RESIDUAL * terms


@njit
def multipliers(L, P, W, w, F, x):
    """λ from Φ_qᵀ λ = f − M a; returns the residual's square beyond what is allowed, by the blocks,
    NaN where a load has no value."""
    for k in range(P.row.shape[0]):
        c = P.column[k]
        st(x, k, acting(L, W, w, c // 3, c % 3), w)
    solve_transposed(P, W, w, F, x)
    for k in range(P.row.shape[0]):
        st(W.lam, P.row[k], ld(x, k, w), w)
    rest, terms = unbalanced(L, W, w)
    return rest - RESIDUAL * terms


@kernel
def march(L, P, W, F, x, mode, s, t, given, far, with_loads, still, output, bad):
    """Fill output (steps, rows, lanes) as `keep` says.

    F, x: numbers of the LU and of one right-hand side; s, t (steps, lanes): path parameter and
    time; given (2·steps, lanes): rate and acceleration of the one driver in mode 1; far: greatest
    coordinate; bad (1, lanes): set to one where a lane must not be trusted.
    """
    L, P, W = by_reference(L), by_reference(P), by_reference(W)
    begin(L, W)
    back, quintic = 1.0 + 0.0 * wide(), 0.0 * wide()
    failed = 0.0 * wide()
    for k in range(s.shape[0]):
        back, quintic, failed = advance(
            L, P, W, F, x, mode, s, t, given, far, with_loads, still, k, back, quintic, failed
        )
        keep(L, W, wide(), output[k])
    st(bad, 0, failed, wide())


@kernel
def march_designs(
    L,
    P,
    W,
    F,
    x,
    mode,
    s,
    t,
    given,
    far,
    with_loads,
    still,
    par,
    mass,
    q,
    wanted,
    page,
    output,
    bad,
):
    """Follow all designs, `LANES` of them at a time, and keep only some rows of each instant.

    par, mass, q (rows, designs): numbers and first positions; wanted (kept,): rows that are kept,
    numbered as in `keep`; page (rows, lanes): room for one instant; output (kept, designs,
    instants); bad (designs,): set to one where a design must not be trusted. The last lanes repeat
    the last design. Else as `march`.
    """
    L, P, W = by_reference(L), by_reference(P), by_reference(W)
    designs, lanes = par.shape[1], page.shape[1]
    for low in range(0, designs, lanes):
        for lane in range(lanes):
            design = min(low + lane, designs - 1)
            for n in range(par.shape[0]):
                W.par[n, lane] = par[n, design]
            for n in range(mass.shape[0]):
                W.mass[n, lane] = mass[n, design]
            for n in range(q.shape[0]):
                W.q[n, lane] = q[n, design]
        many = min(lanes, designs - low)
        begin(L, W)
        back, quintic = 1.0 + 0.0 * wide(), 0.0 * wide()
        failed = 0.0 * wide()
        for k in range(s.shape[0]):
            back, quintic, failed = advance(
                L, P, W, F, x, mode, s, t, given, far, with_loads, still, k, back, quintic, failed
            )
            keep(L, W, wide(), page)
            for n in range(wanted.shape[0]):
                for lane in range(many):
                    output[n, low + lane, k] = page[wanted[n], lane]
        st(page, 0, failed, wide())
        for lane in range(many):
            bad[low + lane] = page[0, lane]


@inline
def begin(L, W):
    """Set the signals of all laws, also of those that do not depend on time."""
    signals(L, W, wide(), L.signal_law.shape[0])


@njit
def advance(L, P, W, F, x, mode, s, t, given, far, with_loads, still, k, back, quintic, failed):
    """Go to instant k, motion and reactions in W; returns the step behind, whether a quintic may
    predict the next, and `failed`, one in lanes that must not be trusted.
    """
    w = wide()
    one = 0.0 * w + 1.0
    zero = 0.0 * w
    here = ld(s, k, w)
    h = zero
    st(W.time, 0, ld(t, k, w), w)
    if k > 0:
        h = here - ld(s, k - 1, w)
        predict(L, W, w, h, back, quintic)
    signals(L, W, w, L.varying)
    if mode == 1:
        o = L.driver_row[0]
        st(W.signal, o, here, w)
        st(W.signal, o + 1, 1.0, w)
        st(W.signal, o + 2, 0.0, w)
    first, last, growth = zero, zero, zero
    for iteration in range(ITERATIONS):
        last, growth = newton(L, P, W, w, F, x)
        if iteration == 0:
            first = last
        if highest(last) <= TOLERANCE * far:
            break
    failed = larger(failed, select_le(last, zero + TOLERANCE * far, zero, one))
    failed = larger(failed, select_le(growth, zero + GROWTH, zero, one))
    velocities(L, P, W, w, F, x)
    accelerations(L, P, W, w, F, x)
    if k > 0:
        off, size = strayed(L, W, w, h)
        moved = step_size(L, W, w)
        failed = larger(failed, select_le(first, CORRECTION * moved + 1e-9, zero, one))
        failed = larger(failed, select_le(off, TURNED * size + 1e-9, zero, one))
    behind(W, w)
    # a step of length zero leaves the history useless: predict by Taylor after it
    length = larger(h, -h)
    back = select_le(length, zero, one, h)
    quintic = select_le(length, zero, zero, one)
    if mode == 1 and not still:
        rates(L, W, w, 0, ld(given, 2 * k, w), ld(given, 2 * k + 1, w))
        velocities(L, P, W, w, F, x)
        accelerations(L, P, W, w, F, x)
    if still:
        for n in range(3 * L.bodies):
            st(W.v, n, 0.0, w)
            st(W.a, n, 0.0, w)
    if with_loads:
        forces(L, W, w, -1)
        beyond = multipliers(L, P, W, w, F, x)
    else:
        beyond = moving(L, W, w)
    failed = larger(failed, select_le(beyond, zero, zero, one))
    return back, quintic, failed
