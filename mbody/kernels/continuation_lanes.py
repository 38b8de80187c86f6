"""Lane continuation: many motions, or many pieces of one, side by side with fixed steps.

Every lane starts from its own closed position and predicts, corrects and tests like the scalar path
(`mbody.kernels.continuation`), the signs of its Assur groups included, but cannot halve its step: a
lane that fails a test is marked and left to `follow`.

The linear algebra is that of `mbody.kernels.constraints` by another factor, and so are four
functions here: one LU of the square Φ_q an instant serves position, velocity, acceleration and
reactions. LDLᵀ of S = G W⁻¹ Gᵀ, which the scalar path needs for redundant rows and any position,
takes 130 ns a position of a four-bar on lanes where the LU takes 100, and its multipliers need a
refinement.
"""

from __future__ import annotations

from mbody.core.bundle import Bundle, Floats, Ints, Rows, Stacks, Tables
from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import highest, larger, ld, lowest, select_le, st, wide
from mbody.core.tolerances import (
    FRICTION_RADIUS_UNIQUE,
    LOOP_CLOSURE_LANES,
    PATH_CORRECTION_SQUARE,
    PATH_SLIGHT_SQUARE,
    PATH_SPREAD,
    PATH_TURNED_SQUARE,
    PIVOT_GROWTH_LARGE,
    PIVOT_GROWTH_LOST,
    PIVOT_VANISHED,
    RESIDUAL_LANES_SQUARE,
)
from mbody.kernels.constraints import (
    applied_share,
    body_rotations,
    clear,
    columns_to_bodies,
    put_column,
    rates_of_rows,
    rows,
    set_rates,
    size_square,
    take_off,
)
from mbody.kernels.continuation import (
    BY_DRIVER,
    compare_step,
    next_place,
    predict,
    predict_by_three,
    signs_kept,
    store_parts,
    store_place,
)
from mbody.kernels.forces import forces, signals
from mbody.kernels.friction import (
    BY_RATES,
    CERTIFICATE,
    add_sliding,
    friction_error,
    friction_sizes,
    list_sliding,
    load_columns,
    number_sliding,
    pair_sliding,
    slip_signs_by_rates,
    store_sliding,
    viscous_friction,
)
from mbody.kernels.layout import PER_PRIMITIVE, Layout, Work, keep, keep_primitive, keep_some
from mbody.kernels.schur_ldl import factor
from mbody.kernels.square_lu import (
    Square,
    SquareWork,
    factor_square,
    solve_both,
    solve_both_transposed,
    solve_square,
    solve_transposed,
)

ITERATIONS = 6
#: Places by which one is predicted: two; two until a second Newton step is needed; three, which
#: spares that step and costs figures (forces to 1e-12 of their peak instead of 1e-13).
TWO, TWO_AT_FIRST, THREE = 0, 1, 2
#: Rows of `LanesOutput.found`: one where a lane must not be trusted; the greatest inverse
#: determinant of a block; the instant of it. And how many they are.
FAILED, GREATEST, GREATEST_AT = 0, 1, 2
FOUND = 3
#: Numbers of `LanesOutput.shared`: first row of the last place in W.past; places by which the
#: next one is predicted; whether the pivots are the second choice. And how many they are.
LAST, PLACES, SECOND = 0, 1, 2
SHARED = 3


class LanePath(Bundle):
    """Prescribed driver values in every lane."""

    mode: int  # BY_TIME or BY_DRIVER
    s: Rows  # (steps, lanes) path parameter
    t: Rows  # (steps, lanes) time
    given: Rows  # (2·steps, lanes): rate and acceleration of the one driver, by driver only
    position_norm: float  # greatest coordinate in model lengths and radians
    with_forces: int  # whether reactions are computed
    at_rest: int  # whether velocities and accelerations are zero (statics)


class LanesOutput(Bundle):
    """Where the kernels put what they find."""

    output: Stacks  # (steps, rows, lanes) of lanes, (rows, designs, steps) of designs
    found: Rows  # (FOUND, lanes)
    shared: Ints  # (SHARED,): what all lanes share


class Designs(Bundle):
    """Numbers of all designs of a batch, and which rows of them are kept."""

    par: Rows  # (parameters, designs)
    mass: Rows  # (masses, designs)
    q: Rows  # (coordinates, designs): first positions
    wanted: Ints  # rows that are kept, as `keep_some` takes them
    record: Rows  # (kept + those of a primitive, lanes): workspace for one instant
    failed: Floats  # (designs,): set to one where a design must not be trusted


@kernel
def follow_lanes(
    L: Layout, P: Square, Q: Square, W: Work, F: SquareWork, path: LanePath, followed: LanesOutput
) -> None:
    """Follow all lanes from W.q through all instants, and keep all rows. P, Q: two choices of
    pivots.
    """
    begin(L, W, followed, TWO)
    worst, when = 0.0 * wide(), 0.0 * wide()
    for k in range(path.s.shape[0]):
        most = advance(L, P, Q, W, F, path, followed, k)
        when = select_le(most, worst, when, 0.0 * wide() + k)
        worst = larger(most, worst)
        keep(L, W, wide(), followed.output[k])
    st(followed.found, GREATEST, worst, wide())
    st(followed.found, GREATEST_AT, when, wide())


@kernel
def follow_designs(
    L: Layout,
    P: Square,
    Q: Square,
    W: Work,
    F: SquareWork,
    path: LanePath,
    followed: LanesOutput,
    designs: Designs,
) -> None:
    """Follow all designs, as many at a time as there are lanes, and keep only some rows of each
    instant. The last lanes repeat the last design.
    """
    count, lanes = designs.par.shape[1], designs.record.shape[1]
    output, record = followed.output, designs.record
    for low in range(0, count, lanes):
        for lane in range(lanes):
            design = min(low + lane, count - 1)
            put_column(designs.par, design, W.par, lane)
            put_column(designs.mass, design, W.mass, lane)
            put_column(designs.q, design, W.q, lane)
        many = min(lanes, count - low)
        begin(L, W, followed, TWO_AT_FIRST)
        for k in range(path.s.shape[0]):
            advance(L, P, Q, W, F, path, followed, k)
            keep_some(L, W, wide(), designs.wanted, record)
            for n in range(designs.wanted.shape[0]):
                for lane in range(many):
                    output[n, low + lane, k] = record[n, lane]
        for lane in range(many):
            designs.failed[low + lane] = followed.found[FAILED, lane]


@inline
def begin(L, W, followed, places):
    """Constant signals, and nothing found yet; the next place is predicted by so many `places`.

    No place is behind: a NaN of a design that failed in the same lane before would spoil the first
    prediction, where it has the weight zero.
    """
    signals(L, W, wide(), L.signal_law.shape[0])
    clear(W.past, wide())
    st(followed.found, FAILED, 0.0 * wide(), wide())
    followed.shared[LAST], followed.shared[PLACES], followed.shared[SECOND] = 0, places, 0


@njit
def advance(L, P, Q, W, F, path, followed, k):
    """Go to instant k, motion and reactions in W; marks lanes that must not be trusted, and returns
    the greatest inverse determinant of a block.
    """
    w = wide()
    zero = 0.0 * w
    shared = followed.shared
    failed = ld(followed.found, FAILED, w)
    last, places, second = shared[LAST], shared[PLACES], shared[SECOND] != 0
    here = ld(path.s, k, w)
    h, back = zero, zero
    st(W.time, 0, ld(path.t, k, w), w)
    if k > 0:
        h = here - ld(path.s, k - 1, w)
        if k > 1:
            back = ld(path.s, k - 1, w) - ld(path.s, k - 2, w)
        predict_instant(L, W, w, path, k, last, places)
    prescribe(L, W, w, path, here)
    first, rest, growth = zero, zero, zero
    small = smallest(path.position_norm)
    for iteration in range(ITERATIONS):
        body_rotations(L, W, w)
        rows(L, W, w, True, None)
        growth, second = factored(P, Q, W, w, F, second, failed)
        S = Q if second else P
        rest = newton_square(L, S, W, w, F)
        if iteration == 0:
            first = rest
        if highest_of(rest, failed) <= small:
            break
        if iteration == 0 and k > 2 and places == TWO_AT_FIRST:
            places = THREE
    newton = first, rest, growth, small, failed
    spacing = h, back, 1.0 if k > 0 else 0.0, 1.0 if k > 1 else 0.0
    rates = zero, zero
    if path.mode == BY_DRIVER:
        rates = ld(path.given, 2 * k, w), ld(path.given, 2 * k + 1, w)
    failed, most = conclude(L, S, W, w, F, path, (spacing, rates, last), newton)
    st(followed.found, FAILED, failed, w)
    shared[LAST] = next_place(W, last)
    shared[PLACES], shared[SECOND] = places, 1 if second else 0
    return most


@inline
def smallest(position_norm):
    """Square of the accepted correction."""
    return LOOP_CLOSURE_LANES * LOOP_CLOSURE_LANES * position_norm * position_norm


@njit
def prescribe(L, W, w, path, here):
    """Signals at the path parameter `here`, the time being in W.time."""
    signals(L, W, w, L.varying)
    if path.mode == BY_DRIVER:
        o = L.driver_row[0]
        st(W.signal, o, here, w)
        st(W.signal, o + 1, 1.0, w)
        st(W.signal, o + 2, 0.0, w)


@njit
def conclude(L, S, W, w, F, path, step, newton):
    """Judge a position after Newton's last step, and compute all else there; it becomes the last
    place. Returns `failed`, set to one in lanes that must not be trusted, and the greatest inverse
    determinant of a block.

    S, F: the LU and its workspace; step: the last step and the one before, and whether there are
    such, one or zero; rate and acceleration of the one driver; first row of the last place in
    W.past; newton: squares of the first and the last correction, the growth, square of the accepted
    correction, and which lanes have failed.
    """
    spacing, rates, last = step
    first, rest, growth, small, failed = newton
    one, zero = 0.0 * failed + 1.0, 0.0 * failed
    h, _, seen, _ = spacing
    failed = larger(failed, select_le(rest, zero + small, zero, one))
    failed = larger(failed, select_le(growth, zero + PIVOT_GROWTH_LOST, zero, one))
    failed, most = signs_kept(S, W, w, F, spacing, failed)
    accelerations_square(L, S, W, w, F)
    moved, off, terms, spread = compare_step(L, W, w, h, last)
    wrong = select_le(spread, zero + PATH_SPREAD, zero, one)
    wrong = larger(
        wrong, select_le(first, PATH_CORRECTION_SQUARE * moved + PATH_SLIGHT_SQUARE, zero, one)
    )
    wrong = larger(
        wrong, select_le(off, PATH_TURNED_SQUARE * terms + PATH_SLIGHT_SQUARE, zero, one)
    )
    failed = larger(failed, seen * wrong)
    store_place(L, W, w, last)
    if path.mode == BY_DRIVER and not path.at_rest:
        set_rates(L, W, w, 0, rates[0], rates[1])
        motion_square(L, S, W, w, F, W.nu, W.v)
        accelerations_square(L, S, W, w, F)
    if path.at_rest:
        for n in range(3 * L.bodies):
            st(W.v, n, 0.0, w)
            st(W.a, n, 0.0, w)
    if path.with_forces:
        if L.action_kind.shape[0] > 0 or L.friction_kind.shape[0] > 0:
            forces(L, W, w, -1)
        if L.friction_kind.shape[0] > 0:
            residual = friction_multipliers_square(L, S, W, w, F)
        else:
            residual = multipliers_square(L, S, W, w, F)
    else:
        residual = rate_residual(L, S, W, w)
    return larger(failed, select_le(residual, zero, zero, one)), most


@njit
def predict_instant(L, W, w, path, k, last, places):
    """Predict instant k from the places behind. A step of length zero leaves the place before it
    useless: after it by Taylor's polynomial.
    """
    zero = 0.0 * w
    one = zero + 1.0
    h = ld(path.s, k, w) - ld(path.s, k - 1, w)
    back, longer = one, one
    length, before = zero, zero
    if k > 1:
        back = ld(path.s, k - 1, w) - ld(path.s, k - 2, w)
        length = larger(back, -back)
    if k > 2:
        longer = ld(path.s, k - 1, w) - ld(path.s, k - 3, w)
        before = larger(longer - back, back - longer)
    if places == THREE and lowest(length) > 0.0 and lowest(before) > 0.0:
        predict_by_three(L, W, w, h, back, longer, last)
        return
    quintic = select_le(length, zero, zero, one)
    predict(L, W, w, h, select_le(length, zero, one, back), quintic, last)


@njit
def factored(P, Q, W, w, F, second, failed):
    """Factor Φ_q by P, or by Q if `second`; by the other of them where that one loses figures.
    Returns the growth, and whether it is Q.
    """
    growth = factor_square(Q if second else P, W, w, F)
    worst = highest_of(growth, failed)
    if worst <= PIVOT_GROWTH_LARGE:
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
def newton_square(L, P, W, w, F):
    """One Newton step, Φ_q Δq = −Φ, by the present factor, and v from Φ_q v = ν; returns the square
    of the step's size (in model lengths and radians).
    """
    if L.slots == L.bodies:
        solve_both(P, W, w, F, W.phi, W.u, W.nu, W.v)
    else:
        solve_both(P, W, w, F, W.phi, W.u, W.nu, W.r)
        columns_to_bodies(L, w, W.r, W.v)
    size = size_square(L, W, w)
    take_off(L, w, W.u, W.q)
    return size


@inline
def motion_square(L, P, W, w, F, c, target):
    """target ← Φ_q⁻¹ c, on coordinates."""
    if L.slots == L.bodies:
        solve_square(P, W, w, F, c, target)
    else:
        solve_square(P, W, w, F, c, W.u)
        columns_to_bodies(L, w, W.u, target)


@njit
def accelerations_square(L, P, W, w, F):
    """a from Φ_q a = γ."""
    rows(L, W, w, None, True)
    motion_square(L, P, W, w, F, W.gamma, W.a)


@njit
def rate_residual(L, P, W, w):
    """Square of the residual Φ_q v − ν by the blocks, beyond what is allowed."""
    rates_of_rows(L, W, w)
    rest, terms = 0.0 * ld(W.size, 0, w), 0.0 * ld(W.size, 0, w)
    for k in range(P.row.shape[0]):
        x, y = ld(W.x, P.row[k], w), ld(W.nu, P.row[k], w)
        rest = rest + (x - y) * (x - y) * P.row_unit[k]
        terms = terms + (x * x + y * y) * P.row_unit[k]
    return rest - RESIDUAL_LANES_SQUARE * terms


@njit
def balance_square(L, P, W, w, F):
    """λ from Φ_qᵀ λ = f − M a, the right-hand side being in W.r."""
    for k in range(P.column.shape[0]):
        c = P.column[k]
        st(W.r, c, applied_share(L, W, w, c // 3, c % 3), w)
    solve_transposed(P, W, w, F, W.r, W.lam)


@njit
def multipliers_square(L, P, W, w, F):
    """Multipliers of the square system; returns the square of the residual by the blocks, beyond
    what is allowed, NaN where a load has no value.
    """
    balance_square(L, P, W, w, F)
    rest = 0.0 * ld(W.size, 0, w)
    terms = rest
    for k in range(P.column.shape[0]):
        f, g = ld(W.r, P.column[k], w), 0.0 * rest
        for n in range(P.entry_start[k], P.entry_start[k + 1]):
            g = g + ld(W.block, P.entry[n], w) * ld(W.lam, P.entry_row[n], w)
        unit = ld(W.weight, P.column[k], w)
        terms = terms + (f * f + g * g) * unit
        rest = rest + (f - g) * (f - g) * unit
    return rest - RESIDUAL_LANES_SQUARE * terms


@njit
def friction_multipliers_square(L, P, W, w, F):
    """Multipliers of the square system with friction; returns the square of the residual. Beyond
    what is allowed are lanes, too, in which friction is not certain to be unique, or has not
    converged.
    """
    viscous_friction(L, W, w)
    balance_square(L, P, W, w, F)
    if L.slip_signs == BY_RATES:
        slip_signs_by_rates(L, W, w)
    responses_square(L, P, W, w, F)
    friction_sizes(L, W, w)
    add_sliding(L, W, w)
    residual = multipliers_square(L, P, W, w, F)
    off = friction_error(L, W, w)
    store_sliding(L, W, w)
    radius = ld(W.friction, CERTIFICATE, w)
    return larger(larger(residual, off), radius - FRICTION_RADIUS_UNIQUE)


@njit
def responses_square(L, P, W, w, F):
    """W.response ← λ by the friction of each pair that slides, two at a time."""
    list_sliding(L, W, w)
    size, pairs = 2 * L.nodes, number_sliding(W, w)
    for s in range(0, pairs - 1, 2):
        load_columns(L, W, w, pair_sliding(W, w, s), W.u)
        load_columns(L, W, w, pair_sliding(W, w, s + 1), W.r)
        first = W.response[size * s : size * (s + 1)]
        second = W.response[size * (s + 1) : size * (s + 2)]
        solve_both_transposed(P, W, w, F, W.u, first, W.r, second)
    if pairs % 2 == 1:
        s = pairs - 1
        load_columns(L, W, w, pair_sliding(W, w, s), W.u)
        solve_transposed(P, W, w, F, W.u, W.response[size * s : size * (s + 1)])


# -- Linkages of one topology on lanes, a piece of motion in each ------------------------------
#
# The motion is that of `mbody.kernels.continuation_lanes`; what is kept goes where a user reads it.


class LinkageBatch(Bundle):
    """Linkages of one topology, the pieces of their motions, and what is kept of them."""

    par: Rows  # (parameters, linkages)
    mass: Rows  # (masses, linkages)
    arm: Rows  # (2·nodes, linkages): nodes from the mass centres of their bodies, in link axes
    node: Ints  # (nodes,): the body of each
    force_at: Tables  # (primitives, 2): places that the force on i and that on j belong to, or −1
    driver: Ints  # the primitives of the drivers
    length: Floats  # (linkages,): of a unit of length of each in what is kept
    # pieces: linkage, first instant, how many instants, first position, which becomes the last
    member: Ints
    first: Ints
    count: Ints
    q: Rows  # (coordinates + 3, pieces)
    # found: one where a piece must not be trusted; the greatest inverse determinant of a block, and
    # the position there
    failed: Floats
    greatest: Floats
    nearest: Rows  # (coordinates + 3, pieces)
    # workspace: the arms and the lengths of all lanes, what is kept of an instant
    arms: Rows  # (2·nodes, lanes)
    lengths: Rows  # (1, lanes)
    record: Rows  # (numbers + those of a primitive, lanes)
    # results of all linkages, (all, instants, columns): the row of each linkage, and the column of
    # each of its numbers, which are as `linkage_rows` numbers them
    output: Stacks
    row: Ints
    column: Tables  # (linkages, numbers)


def linkage_rows(nodes: int, places: int, drivers: int) -> int:
    """Numbers that are kept of an instant: (x, y) of each node, (x, y) of the force on each place
    of a link, the torque of each driver.
    """
    return 2 * nodes + 2 * places + drivers


@kernel
def follow_linkages(
    L: Layout,
    P: Square,
    Q: Square,
    W: Work,
    F: SquareWork,
    path: LanePath,
    followed: LanesOutput,
    batch: LinkageBatch,
) -> None:
    """Follow all pieces, as many at a time as there are lanes, the path the same for each time. The
    last lanes repeat the last piece.
    """
    w = wide()
    pieces, lanes = batch.member.shape[0], batch.record.shape[1]
    for low in range(0, pieces, lanes):
        put_pieces(W, batch, low)
        begin(L, W, followed, TWO)
        worst = 0.0 * w
        for k in range(path.s.shape[0]):
            most = advance(L, P, Q, W, F, path, followed, k)
            # the position where a determinant is least; W.base is no part of the motion
            for n in range(3 * L.bodies):
                st(W.base, n, select_le(most, worst, ld(W.base, n, w), ld(W.q, n, w)), w)
            worst = larger(worst, most)
            keep_linkage(L, W, w, batch)
            store_instant(batch, low, min(lanes, pieces - low), k)
        st(batch.record, 0, worst, w)
        store_ends(L, W, followed, batch, low)


@njit
def put_pieces(W, batch, low):
    """Numbers and first positions of the pieces from `low` on, one a lane."""
    pieces, lanes = batch.member.shape[0], batch.record.shape[1]
    for lane in range(lanes):
        piece = min(low + lane, pieces - 1)
        member = batch.member[piece]
        put_column(batch.par, member, W.par, lane)
        put_column(batch.mass, member, W.mass, lane)
        put_column(batch.arm, member, batch.arms, lane)
        batch.lengths[0, lane] = batch.length[member]
        put_column(batch.q, piece, W.q, lane)


@njit
def store_ends(L, W, followed, batch, low):
    """How the pieces in the lanes ended; the record has the greatest growth of each."""
    for lane in range(min(batch.record.shape[1], batch.member.shape[0] - low)):
        batch.failed[low + lane] = followed.found[FAILED, lane]
        batch.greatest[low + lane] = batch.record[0, lane]
        for n in range(3 * L.bodies):
            batch.nearest[n, low + lane] = W.base[n, lane]
            batch.q[n, low + lane] = W.q[n, lane]


@njit
def keep_linkage(L, W, w, batch):
    """Positions of nodes, forces on places, torques of drivers, into the record of this instant."""
    record, nodes, drivers = batch.record, batch.node.shape[0], batch.driver.shape[0]
    spare = record.shape[0] - PER_PRIMITIVE
    zero, length = 0.0 * w, ld(batch.lengths, 0, w)
    for n in range(nodes):
        b = batch.node[n]
        c, s = ld(W.turn, 2 * b, w), ld(W.turn, 2 * b + 1, w)
        x, y = ld(batch.arms, 2 * n, w), ld(batch.arms, 2 * n + 1, w)
        st(record, 2 * n, length * (ld(W.q, 3 * b, w) + c * x - s * y), w)
        st(record, 2 * n + 1, length * (ld(W.q, 3 * b + 1, w) + s * x + c * y), w)
    for n in range(2 * nodes, spare):
        st(record, n, zero, w)
    for e in range(batch.force_at.shape[0]):
        keep_primitive(L, W, w, e, record, spare)
        driven = -1
        for k in range(drivers):
            if e == batch.driver[k]:
                driven = k
        if driven >= 0:
            st(record, spare - drivers + driven, length * ld(record, spare + 4, w), w)
            continue
        fx, fy = ld(record, spare + 2, w), ld(record, spare + 3, w)
        i, j = batch.force_at[e, 0], batch.force_at[e, 1]
        if i >= 0:
            add_force(record, 2 * (nodes + i), zero - fx, zero - fy, w)
        if j >= 0:
            add_force(record, 2 * (nodes + j), fx, fy, w)


@inline
def add_force(record, row, fx, fy, w):
    """Add a force to that of a place."""
    st(record, row, ld(record, row, w) + fx, w)
    st(record, row + 1, ld(record, row + 1, w) + fy, w)


@inline
def store_instant(batch, low, many, k):
    """The record of step k into the results of the linkages."""
    for lane in range(many):
        if k >= batch.count[low + lane]:
            continue
        member, instant = batch.member[low + lane], batch.first[low + lane] + k
        row = batch.row[member]
        for n in range(batch.column.shape[1]):
            batch.output[row, instant, batch.column[member, n]] = batch.record[n, lane]


@kernel
def branch_distances(L: Layout, W: Work, batch: LinkageBatch, distances: Floats) -> None:
    """The square of the distance from other branches of every piece at its nearest position:
    distances (pieces,).
    """
    for piece in range(batch.member.shape[0]):
        member = batch.member[piece]
        put_column(batch.par, member, W.par, 0)
        put_column(batch.nearest, piece, W.q, 0)
        body_rotations(L, W, 0.0)
        rows(L, W, 0.0, True, None)
        factor(L, W, 0.0, 0.0, PIVOT_VANISHED)
        distances[piece] = 1.0 / store_parts(L, W, 1, 0.0)
