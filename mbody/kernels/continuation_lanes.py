"""Lane continuation: many motions, or many pieces of one, side by side with fixed steps.

Every lane starts from its own closed position and predicts, corrects and checks like the scalar
path, the signs of its Assur groups among it, but cannot halve its step: a lane that fails a check
is marked and left to `follow`. One LU of the square Φ_q an instant serves position, velocity,
acceleration and reactions.
"""

from __future__ import annotations

from mbody.compiler.jit import inline, kernel, njit
from mbody.compiler.lanes import highest, larger, ld, lowest, select_le, st, wide
from mbody.kernels.branch_monitor import sides_kept
from mbody.kernels.constraints import rows, turns
from mbody.kernels.continuation import CORRECTION, SLIGHT, SPREAD, TURNED
from mbody.kernels.forces import forces, signals
from mbody.kernels.output import keep, keep_some
from mbody.kernels.position_velocity import (
    acting,
    put_column,
    rates,
    rates_of_rows,
    reach_square,
    take_off,
    to_bodies,
)
from mbody.kernels.predictor import behind, predict, predict_far, step
from mbody.kernels.square_lu import factor_square, solve_both, solve_square, solve_transposed

__all__ = ["march", "march_designs"]

ITERATIONS = 6
#: Accepted correction, in parts of the greatest coordinate.
TOLERANCE = 1e-13
#: Square of what Φ_q v − ν, or f − M a − Φ_qᵀ λ, may be of its terms.
RESIDUAL = 1e-11**2
#: Sum of squares of the multipliers above which the fixed pivots are no longer good: at 1e6
#: accelerations lost five digits (1e-11 of the peak), at 1e4 they keep 1e-14.
GROWTH = 1e4
#: The same above which the other choice of pivots is tried.
LARGE = 100.0
#: Places by which one is predicted: two; two until a second Newton step is needed; three, which
#: spares that step and costs figures (forces to 1e-12 of their peak instead of 1e-13).
NEAR, MAYBE, FAR = 0, 1, 2


@njit
def factored(P, Q, W, w, F, second, failed):
    """Factor Φ_q by P, or by Q if `second`; by the other of them where that one loses figures.
    Returns the growth, and whether it is Q.
    """
    growth = factor_square(Q if second else P, W, w, F)
    worst = highest_of(growth, failed)
    if worst <= LARGE:
        return growth, second
    other = factor_square(P if second else Q, W, w, F)
    if highest_of(other, failed) < worst:
        return other, not second
    return factor_square(Q if second else P, W, w, F), second


@inline
def highest_of(x, failed):
    """The greatest of the lanes that have not failed: they must not wait for those that have."""
    zero = 0.0 * failed
    return highest(select_le(failed, zero, x, zero))


@njit
def newton(L, P, W, w, F, x):
    """One Newton step on Φ by the present factor, and v, in W.v; returns the square of the step's
    size (in model lengths and radians).
    """
    if L.slots == L.bodies:
        solve_both(P, W, w, F, x, W.phi, W.u, W.nu, W.v)
    else:
        solve_both(P, W, w, F, x, W.phi, W.u, W.nu, W.r)
        to_bodies(L, w, W.r, W.v)
    size = reach_square(L, W, w)
    take_off(L, w, W.u, W.q)
    return size


@inline
def least_motion(L, P, W, w, F, x, c, target):
    """target ← Φ_q⁻¹ c, on coordinates."""
    if L.slots == L.bodies:
        solve_square(P, W, w, F, x, c, target)
    else:
        solve_square(P, W, w, F, x, c, W.u)
        to_bodies(L, w, W.u, target)


@njit
def accelerations(L, P, W, w, F, x):
    """a from Φ_q a = γ."""
    rows(L, W, w, None, True)
    least_motion(L, P, W, w, F, x, W.gamma, W.a)


@njit
def moving(L, W, w):
    """Whether Φ_q v = ν holds by the blocks: the residual's square beyond what is allowed."""
    rates_of_rows(L, W, w)
    rest, terms = 0.0 * ld(W.size, 0, w), 0.0 * ld(W.size, 0, w)
    for n in range(2 * L.nodes):
        x, y = ld(W.x, n, w), ld(W.nu, n, w)
        rest = rest + (x - y) * (x - y)
        terms = terms + x * x + y * y
    return rest - RESIDUAL * terms


@njit
def multipliers(L, P, W, w, F, x):
    """λ from Φ_qᵀ λ = f − M a; returns the residual's square beyond what is allowed, by the blocks,
    NaN where a load has no value.
    """
    for k in range(P.column.shape[0]):
        c = P.column[k]
        st(W.r, c, acting(L, W, w, c // 3, c % 3), w)
    solve_transposed(P, W, w, F, x, W.r, W.lam)
    rest = 0.0 * ld(W.size, 0, w)
    terms = rest
    for k in range(P.column.shape[0]):
        f, g = ld(W.r, P.column[k], w), 0.0 * rest
        for n in range(P.entry_start[k], P.entry_start[k + 1]):
            g = g + ld(W.block, P.entry[n], w) * ld(W.lam, P.entry_row[n], w)
        terms = terms + f * f + g * g
        rest = rest + (f - g) * (f - g)
    return rest - RESIDUAL * terms


@kernel
def march(L, P, Q, W, F, x, mode, s, t, given, far, with_loads, still, output, bad):
    """Fill output (steps, rows, lanes) as `keep` says.

    P, Q: two choices of pivots; F, x: numbers of the LU, and room for two right-hand sides; s, t
    (steps, lanes): path parameter and time; given (2·steps, lanes): rate and acceleration of the
    one driver in mode 1; far: greatest coordinate; bad (3, lanes): set to one where a lane must not
    be trusted, the greatest inverse determinant of a block, and the instant of it.
    """
    signals(L, W, wide(), L.signal_law.shape[0])
    failed, last, by_places, second = 0.0 * wide(), 0, NEAR, False
    worst, when = 0.0 * wide(), 0.0 * wide()
    for k in range(s.shape[0]):
        failed, last, by_places, second, most = advance(
            *(L, P, Q, W, F, x, mode, s, t, given, far, with_loads, still),
            *(k, failed, last, by_places, second),
        )
        when = select_le(most, worst, when, 0.0 * wide() + k)
        worst = larger(most, worst)
        keep(L, W, wide(), output[k])
    st(bad, 0, failed, wide())
    st(bad, 1, worst, wide())
    st(bad, 2, when, wide())


@kernel
def march_designs(
    L,
    P,
    Q,
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
    as `keep_some` takes them; page (kept + a primitive's, lanes): room for one instant; output
    (kept,
    designs, instants); bad (designs,): set to one where a design must not be trusted. The last
    lanes repeat the last design. Else as `march`.
    """
    designs, lanes = par.shape[1], page.shape[1]
    for low in range(0, designs, lanes):
        for lane in range(lanes):
            design = min(low + lane, designs - 1)
            put_column(par, design, W.par, lane)
            put_column(mass, design, W.mass, lane)
            put_column(q, design, W.q, lane)
        many = min(lanes, designs - low)
        signals(L, W, wide(), L.signal_law.shape[0])
        failed, last, by_places, second = 0.0 * wide(), 0, MAYBE, False
        for k in range(s.shape[0]):
            failed, last, by_places, second, _ = advance(
                *(L, P, Q, W, F, x, mode, s, t, given, far, with_loads, still),
                *(k, failed, last, by_places, second),
            )
            keep_some(L, W, wide(), wanted, page)
            for n in range(wanted.shape[0]):
                for lane in range(many):
                    output[n, low + lane, k] = page[n, lane]
        st(page, 0, failed, wide())
        for lane in range(many):
            bad[low + lane] = page[0, lane]


@njit
def advance(
    L, P, Q, W, F, x, mode, s, t, given, far, with_loads, still, k, failed, last, by_places, second
):
    """Go to instant k, motion and reactions in W; returns `failed`, one in lanes that must not be
    trusted, where the last place is, by how many places the next one is predicted, whether the
    pivots are those of Q, and the greatest inverse determinant of a block.
    """
    w = wide()
    one = 0.0 * w + 1.0
    zero = 0.0 * w
    here = ld(s, k, w)
    h, back = zero, zero
    st(W.time, 0, ld(t, k, w), w)
    if k > 0:
        h = here - ld(s, k - 1, w)
        if k > 1:
            back = ld(s, k - 1, w) - ld(s, k - 2, w)
        foretell(L, W, w, s, k, h, back, last, by_places)
    signals(L, W, w, L.varying)
    if mode == 1:
        o = L.driver_row[0]
        st(W.signal, o, here, w)
        st(W.signal, o + 1, 1.0, w)
        st(W.signal, o + 2, 0.0, w)
    first, rest, growth = zero, zero, zero
    small = TOLERANCE * TOLERANCE * far * far
    for iteration in range(ITERATIONS):
        turns(L, W, w)
        rows(L, W, w, True, None)
        growth, second = factored(P, Q, W, w, F, second, failed)
        S = Q if second else P
        rest = newton(L, S, W, w, F, x)
        if iteration == 0:
            first = rest
        if highest_of(rest, failed) <= small:
            break
        if iteration == 0 and k > 2 and by_places == MAYBE:
            by_places = FAR
    failed = larger(failed, select_le(rest, zero + small, zero, one))
    failed = larger(failed, select_le(growth, zero + GROWTH, zero, one))
    failed, most = sides_kept(S, W, w, F, k, h, back, failed)
    accelerations(L, S, W, w, F, x)
    if k > 0:
        moved, off, terms, spread = step(L, W, w, h, last)
        failed = larger(failed, select_le(spread, zero + SPREAD, zero, one))
        failed = larger(failed, select_le(first, CORRECTION * moved + SLIGHT, zero, one))
        failed = larger(failed, select_le(off, TURNED * terms + SLIGHT, zero, one))
    last = behind(L, W, w, last)
    if mode == 1 and not still:
        rates(L, W, w, 0, ld(given, 2 * k, w), ld(given, 2 * k + 1, w))
        least_motion(L, S, W, w, F, x, W.nu, W.v)
        accelerations(L, S, W, w, F, x)
    if still:
        for n in range(3 * L.bodies):
            st(W.v, n, 0.0, w)
            st(W.a, n, 0.0, w)
    if with_loads:
        if L.action_kind.shape[0] > 0:
            forces(L, W, w, -1)
        beyond = multipliers(L, S, W, w, F, x)
    else:
        beyond = moving(L, W, w)
    failed = larger(failed, select_le(beyond, zero, zero, one))
    return failed, last, by_places, second, most


@njit
def foretell(L, W, w, s, k, h, behind_it, last, by_places):
    """Predict instant k, h beyond the last, which is `behind_it` from the one before. A step of
    length zero leaves what is behind it useless: after it by Taylor's polynomial.
    """
    zero = 0.0 * w
    back, longer = zero + 1.0, zero + 1.0
    length, before = zero, zero
    if k > 1:
        back = behind_it
        length = larger(back, -back)
    if k > 2:
        longer = ld(s, k - 1, w) - ld(s, k - 3, w)
        before = larger(longer - back, back - longer)
    if by_places == FAR and lowest(length) > 0.0 and lowest(before) > 0.0:
        predict_far(L, W, w, h, back, longer, last)
        return
    one = zero + 1.0
    predict(
        *(L, W, w, h, select_le(length, zero, one, back)),
        *(select_le(length, zero, zero, one), last),
    )
