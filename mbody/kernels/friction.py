"""Sliding friction from the real reaction, by the factor at hand.

A friction pair k has a tangent row g_k (the rate of sliding is g_k v − ν_k) and a size φ_k of
friction that the multipliers of what presses it decide. It slides in the direction σ_k = ±1, so
that the system gets the force −g_kᵀ λ_k with λ_k = σ_k x_k, x_k = φ_k(λ) ≥ 0. That enters the
equations as a load:

    Gᵀ λ = f − M a − Σ σ_k g_kᵀ x_k    ⇒    λ = λ₀ + B x,    x = φ(λ₀ + B x),

with one more solve by the same factor for each pair: column k of B. In free motion λ₀ and B are of
S = G M⁻¹ Gᵀ (`mbody.kernels.forces`), where drivers determine everything of the multipliers
alone. Newton's method with I − φ′ B, of one unknown a pair, converges in two to four passes, as
every φ_k is positively homogeneous:

    a pin of radius r        ρ |R|,  ρ = μ r/√(1 + μ²): the friction circle, R the whole reaction
    a guide of length ℓ      μ max(|N|, 2 |T + μ σ h N/2|/ℓ): two points at the ends press, h the
                             height between its rails; ℓ = 0: μ |N|
    a pair that is pressed   μ |N|, in one direction alone μ max(N, 0); of a cam's follower with
                             |N| = |λ| |g|, g the part of its row that pushes the follower
    a torque of wheels       μ |N| + b σ N: rolling resistance, and the loss of teeth, which may
                             depend on which wheel drives
    a clutch, a packing      the torque, or the force, of its law; of a band brake more one way

Teeth with a pressure angle press their wheels apart with μ |N|, μ = tan α, and the strands of a
belt pull its pulleys together: the same equation with a sign that never changes, and without a
loss, as the rate is zero.

With |B| the Lipschitz constants of φ_k along the columns of B, a spectral radius ϱ(|B|) < 1 means
that there is one solution: the certificate. Where it is not below 1 the solution is followed from
no friction, with s times all coefficients, s from 0 to 1; where det(I − φ′ B) vanishes on the way
the mechanism jams, from that part s of its coefficients on.

Pairs whose sign is 0 have no sliding friction: they are open, or stick by a row of their own. Of
many places where bodies may touch few slide: B and I − φ′ B are of those that do, in any lane.
Pfeiffer, Glocker: Multibody Dynamics with Unilateral Contacts (1996), 5.
"""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.lanes import (
    constant,
    count,
    entry,
    highest,
    lane_at,
    larger,
    ld,
    lowest,
    passes_more,
    put_entry,
    rounds,
    select_le,
    smaller,
    st,
)
from mbody.core.tolerances import (
    FINITE,
    FRICTION_CHANGE_AGAIN,
    FRICTION_CHANGE_LANES,
    FRICTION_CHANGE_NEARLY,
    FRICTION_CHANGE_ROUNDING,
    FRICTION_LEVEL_LEAST,
    FRICTION_RADIUS_CERTIFIED,
    FRICTION_RADIUS_POSITIVE,
    FRICTION_SIZE_NEGATIVE,
    RATE_NONE_FRICTION,
)
from mbody.kernels.schur_ldl import apply_g, solve

# -- The sizes of friction of friction pairs, for the multipliers of what presses them ------------
#
# See `mbody.kernels.friction` for the equations that they stand in.

#: Kinds of friction pairs; the number of a kind is its place.
FRICTION_KINDS = (
    "pin",
    "guide",
    "pressed",
    "couple",
    "follower",
    "apart",
    "torque",
    "force",
    "pull",
)
PIN, GUIDE, PRESSED, COUPLE, FOLLOWER, APART, TORQUE, FORCE, PULL = range(9)
TURNING = (PIN, COUPLE, TORQUE)  # Kinds whose sliding is an angle and whose size a torque.
#: Kinds whose sign lasts, and which lose nothing.
LASTING = ("apart", "pull")
#: What `Layout.slip_signs` means: the rates decide the signs; they are in W.slip_sign, of pairs
#: that slide; the same, and pairs of the rate zero are about to slide: their coefficient is the
#: static one.
BY_RATES, SLIDING, IMPENDING = 0, 1, 2
#: Numbers of a pair in W.arm.
ARMS = 3
#: √2 − 1: max(|x|, |y|) + that · min(|x|, |y|) is never less than √(x² + y²).
OCTAGON = 0.41421356237309515


@njit
def coefficients(L, W, w):
    """W.coefficient ← the coefficient of friction of every pair at its rate of sliding."""
    for f in range(L.friction_kind.shape[0]):
        o = L.friction_par[f]
        st(W.coefficient, f, ld(W.par, o, w), w)
        if L.slip_signs == IMPENDING or highest(ld(W.par, o + 2, w)) > 0.0:
            for n in range(rounds(W.rate, w)):
                at_rate(L, W, f, o, lane_at(n, w))


@inline
def at_rate(L, W, f, o, lane):
    """The coefficient of pair f, parameters from o on, by its rate in one lane."""
    kinetic, static = entry(W.par, o, lane), entry(W.par, o + 1, lane)
    speed, rate = entry(W.par, o + 2, lane), entry(W.rate, f, lane)
    if L.slip_signs == IMPENDING and rate == 0.0:
        put_entry(W.coefficient, f, static, lane)
    elif speed > 0.0:
        part = rate / speed
        falls = np.exp(-(part * part))
        put_entry(W.coefficient, f, kinetic + (static - kinetic) * falls, lane)


@njit
def arms(L, W, w, part):
    """W.arm ← by what the sizes of friction follow from multipliers, ARMS numbers a pair, all
    coefficients being multiplied by `part`.
    """
    for f in range(L.friction_kind.shape[0]):
        store_arms(L, W, w, f, part)


@inline
def store_arms(L, W, w, f, part):
    """W.arm of pair f: the radius ρ of a pin's friction circle; μ, 2 μ/ℓ (zero without a length)
    and μ σ h/2 of a guide; what a clutch or packing has; else what multiplies |λ| and λ, of which
    one sign alone counts where a pair is pressed in one direction. That teeth press apart and belts
    pull is no friction, of which there may be a part.
    """
    o, kind = L.friction_par[f], L.friction_kind[f]
    mu = ld(W.coefficient, f, w) * (1.0 if kind in (APART, PULL) else part)
    first, second, third = mu, 0.0 * mu, 0.0 * mu
    if kind == PIN:
        first = mu * ld(W.par, o + 4, w) / np.sqrt(1.0 + mu * mu)
    elif kind == GUIDE:
        length = ld(W.par, o + 4, w)
        long = select_le(length, third, third + 1.0, length)
        second = select_le(length, third, third, 2.0 * mu / long)
        third = 0.5 * mu * ld(W.slip_sign, f, w) * ld(W.par, o + 5, w)
    elif kind == PRESSED:
        one_way = ld(W.par, o + 4, w)
        first = mu * (1.0 - 0.5 * one_way * one_way)
        second = -0.5 * one_way * mu
    elif kind == FOLLOWER:
        first = on_cam(L, W, w, f, mu)
    elif kind == COUPLE:
        second = part * ld(W.par, o + 5, w) * ld(W.slip_sign, f, w)
    elif kind in (TORQUE, FORCE, PULL):
        uneven = 1.0 + ld(W.par, o + 5, w) * ld(W.slip_sign, f, w)
        first = larger(third, mu * uneven * ld(W.signal, L.friction_signal[f], w))
    st(W.arm, ARMS * f, first, w)
    st(W.arm, ARMS * f + 1, second, w)
    st(W.arm, ARMS * f + 2, third, w)


@inline
def on_cam(L, W, w, f, mu):
    """Friction of follower f on its cam by the multiplier, for a coefficient. A roller turns on a
    pin of some part of its radius: the force on it passes the pin at the radius of the friction
    circle, so that the part along the cam is to that across it as the sides of that triangle.
    """
    o = 12 * L.friction_node[f] + 6
    x, y = ld(W.block, o, w), ld(W.block, o + 1, w)
    part = ld(W.par, L.friction_par[f] + 4, w)
    sine = part * mu / np.sqrt(1.0 + mu * mu)
    rolls = sine / np.sqrt(1.0 - sine * sine)
    return select_le(part, 0.0 * mu, mu, rolls) * np.sqrt(x * x + y * y)


@inline
def size_of(L, W, w, f, x, y):
    """φ of pair f for multipliers (x, y) of what presses it, and ∂φ by both."""
    o = ARMS * f
    return law_size(
        L.friction_kind[f], ld(W.arm, o, w), ld(W.arm, o + 1, w), ld(W.arm, o + 2, w), x, y
    )


@inline
def law_size(kind, arm, second, third, x, y):
    """φ of a kind of friction by the three numbers of `store_arms`, and ∂φ by x and y."""
    zero = 0.0 * x
    if kind in (TORQUE, FORCE, PULL):
        return arm, zero, zero
    if kind == PIN:
        whole = np.sqrt(x * x + y * y)
        per = arm / select_le(whole, zero, zero + 1.0, whole)
        return arm * whole, per * x, per * y
    sign = select_le(x, zero, zero - 1.0, zero + 1.0)
    if kind == GUIDE:
        moment = y + third * x
        turn = select_le(moment, zero, zero - 1.0, zero + 1.0)
        one, two = arm * sign * x, second * turn * moment
        first = select_le(two, one, zero + 1.0, zero)
        other = 1.0 - first
        by_x = first * arm * sign + other * second * turn * third
        return first * one + other * two, by_x, other * second * turn
    by_x = arm * sign + second
    return by_x * x, by_x, zero


@inline
def greatest_slope(L, W, w, f, x, y, close):
    """The Lipschitz constant of φ of pair f along the direction (x, y) of its multipliers; unless
    it must be `close`, a bound up to 8 % above it that needs no root.
    """
    arm, kind = ld(W.arm, ARMS * f, w), L.friction_kind[f]
    if kind in (TORQUE, FORCE, PULL):
        return 0.0 * x
    along = larger(x, -x)
    if kind == PIN:
        across = larger(y, -y)
        octagon = larger(along, across) + OCTAGON * smaller(along, across)
        return arm * (np.sqrt(x * x + y * y) if close else octagon)
    other = ld(W.arm, ARMS * f + 1, w)
    if kind == GUIDE:
        moment = y + ld(W.arm, ARMS * f + 2, w) * x
        return larger(arm * along, other * larger(moment, -moment))
    return (arm + larger(other, -other)) * along


#: Numbers of W.friction: the spectral radius below which friction is unique; the part of friction
#: that was reached, less than 1 where the mechanism jams; det(I − φ′ B).
CERTIFICATE, REACHED_PART, DETERMINANT = 0, 1, 2
#: Newton's passes: each finds which of the two parts of a guide presses, and converges
#: quadratically for pins.
PASSES = 12
#: Steps from no friction to all of it, where the solution is not certain to be unique.
LEVELS = 40
#: Powers of |B| for the bound of its spectral radius.
POWERS = 12


@inline
def tangent(L, W, w, f):
    """Place of the row of pair f in the blocks, and both of its bodies."""
    e = L.active_set[L.friction_tangent[f]]
    return L.written_node[e], L.primitive_i[e], L.primitive_j[e]


@inline
def along_tangent(L, W, w, f, motion, known):
    """g · motion of pair f less what is known of its row: the rate of sliding from W.v and W.nu,
    its derivative from W.a and W.gamma.
    """
    k, i, j = tangent(L, W, w, f)
    found = -ld(known, 2 * k, w)
    for n in range(3):
        found = found + ld(W.block, 12 * k + n, w) * ld(motion, 3 * i + n, w)
        found = found + ld(W.block, 12 * k + 6 + n, w) * ld(motion, 3 * j + n, w)
    return found


@njit
def sliding_rates(L, W, w):
    """W.rate ← rates of sliding g v − ν of all friction pairs."""
    for f in range(L.friction_kind.shape[0]):
        st(W.rate, f, along_tangent(L, W, w, f, W.v, W.nu), w)


@njit
def slip_signs_by_rates(L, W, w):
    """W.slip_sign ← the signs of the rates; zero where a pair is at rest."""
    per_length = 1.0 / ld(W.size, 0, w)
    zero = 0.0 * per_length
    for f in range(L.friction_kind.shape[0]):
        unit = 1.0 + zero if L.friction_kind[f] in TURNING else per_length
        rate = ld(W.rate, f, w) * unit
        least = RATE_NONE_FRICTION * velocity_scale(L, W, w, f)
        still = select_le(larger(rate, -rate), least, zero, zero + 1.0)
        st(W.slip_sign, f, still * select_le(rate, zero, zero - 1.0, zero + 1.0), w)
    fixed_slip_signs(L, W, w)


@njit
def velocity_scale(L, W, w, f):
    """The greatest rate of what is joined to the bodies of pair f, in model lengths and radians."""
    _, i, j = tangent(L, W, w, f)
    per_length = 1.0 / ld(W.size, 0, w)
    scale = 0.0 * per_length
    for b in range(L.bodies):
        joined = (i < L.bodies and L.body_part[i] == L.body_part[b]) or (
            j < L.bodies and L.body_part[j] == L.body_part[b]
        )
        if not joined:
            continue
        for n in range(3):
            rate = ld(W.v, 3 * b + n, w) * (1.0 + 0.0 * per_length if n == 2 else per_length)
            scale = larger(scale, larger(rate, -rate))
    return scale


@njit
def fixed_slip_signs(L, W, w):
    """W.slip_sign ← that of teeth that press apart and of belts that pull, which no
    rate decides.
    """
    for f in range(L.friction_kind.shape[0]):
        if L.friction_kind[f] in (APART, PULL):
            st(W.slip_sign, f, ld(W.par, L.friction_par[f] + 4, w), w)


@njit
def list_sliding(L, W, w):
    """W.sliding ← how many pairs slide in a lane, and their numbers."""
    found = 0
    for f in range(L.friction_kind.shape[0]):
        slip_sign = ld(W.slip_sign, f, w)
        if highest(slip_sign * slip_sign) > 0.0:
            found += 1
            st(W.sliding, found, 0.0 * slip_sign + f, w)
    st(W.sliding, 0, 0.0 * ld(W.size, 0, w) + found, w)


@inline
def number_sliding(W, w):
    """How many pairs slide in a lane."""
    return int(highest(ld(W.sliding, 0, w)))


@inline
def pair_sliding(W, w, s):
    """The number of pair s of those that slide."""
    return int(highest(ld(W.sliding, s + 1, w)))


@njit
def any_sliding(L, W, w):
    """One in lanes where a pair slides, else zero; W.slip and W.friction as without sliding."""
    found = 0.0 * ld(W.size, 0, w)
    st(W.friction, CERTIFICATE, found, w)
    st(W.friction, REACHED_PART, found + 1.0, w)
    st(W.friction, DETERMINANT, found + 1.0, w)
    for f in range(L.friction_kind.shape[0]):
        slip_sign = ld(W.slip_sign, f, w)
        found = larger(found, slip_sign * slip_sign)
        st(W.slip, f, 0.0, w)
    return found


@njit
def load_columns(L, W, w, f, target):
    """target on columns ← the load −σ gᵀ of pair f, each slot taking its share of its body's."""
    k, i, j = tangent(L, W, w, f)
    slip_sign = ld(W.slip_sign, f, w)
    for n in range(target.shape[0]):
        st(target, n, 0.0, w)
    for s in range(L.slots):
        b = L.slot_body[s]
        if b in (i, j):
            o = 12 * k if b == i else 12 * k + 6
            share = -slip_sign * ld(W.share, s, w)
            for n in range(3):
                st(target, 3 * s + n, share * ld(W.block, o + n, w), w)


@njit
def responses(L, W, w):
    """W.response ← columns of B on nodes, by the present factor of S = G W⁻¹ Gᵀ."""
    size = 2 * L.nodes
    list_sliding(L, W, w)
    for s in range(number_sliding(W, w)):
        load_columns(L, W, w, pair_sliding(W, w, s), W.u)
        for n in range(W.u.shape[0]):
            st(W.u, n, ld(W.u, n, w) * ld(W.weight, n, w), w)
        apply_g(L, W, w, W.u, W.x)
        solve(L, W, w)
        for n in range(size):
            st(W.response, size * s + n, ld(W.x, n, w), w)


@inline
def per_size(L, W, w, f):
    """By what the size of a pair is multiplied to be a force: 1, of a torque 1 over the model
    length.
    """
    length = ld(W.size, 0, w)
    return 1.0 / length if L.friction_kind[f] in TURNING else 0.0 * length + 1.0


@njit
def certificate(L, W, w):
    """A bound of the spectral radius of the Lipschitz constants of φ along the columns of B: a
    loose one where that is below 1. What a lane gets does not depend on the others.
    """
    loose = spectral_bound(L, W, w, False)
    if highest(loose) <= FRICTION_RADIUS_CERTIFIED:
        return loose
    return select_le(
        loose, 0.0 * loose + FRICTION_RADIUS_CERTIFIED, loose, spectral_bound(L, W, w, True)
    )


@njit
def spectral_bound(L, W, w, close):
    """The first bound below 1, else the least, by the quotients of Collatz and Wielandt: of any
    positive vector the greatest quotient is a bound.
    """
    pairs = number_sliding(W, w)
    m = W.newton
    one = 0.0 * ld(W.size, 0, w) + 1.0
    for r in range(pairs):
        f = pair_sliding(W, w, r)
        node = 2 * L.friction_node[f]
        # what is at rest in a lane has no friction there that another pair could change
        slides = ld(W.slip_sign, f, w) * ld(W.slip_sign, f, w)
        for c in range(pairs):
            o = 2 * L.nodes * c + node
            x, y = ld(W.response, o, w), ld(W.response, o + 1, w)
            st(m, pairs * r + c, slides * greatest_slope(L, W, w, f, x, y, close), w)
        st(m, pairs * pairs + r, 1.0 / per_size(L, W, w, f), w)
    radius = FINITE * one
    for _ in range(POWERS):
        quotient, most = 0.0 * one, 0.0 * one
        for f in range(pairs):
            total = 0.0 * one
            for c in range(pairs):
                total = total + ld(m, pairs * f + c, w) * ld(m, pairs * pairs + c, w)
            quotient = larger(quotient, total / ld(m, pairs * pairs + f, w))
            st(m, pairs * (pairs + 1) + f, total, w)
            most = larger(most, per_size(L, W, w, pair_sliding(W, w, f)) * total)
        radius = select_le(
            radius, FRICTION_RADIUS_CERTIFIED * one, radius, smaller(radius, quotient)
        )
        if highest(radius) <= FRICTION_RADIUS_CERTIFIED:
            break
        scale = 1.0 / select_le(most, 0.0 * one, one, most)
        for f in range(pairs):
            grown = ld(m, pairs * (pairs + 1) + f, w) * scale
            floor = FRICTION_RADIUS_POSITIVE / per_size(L, W, w, pair_sliding(W, w, f))
            st(m, pairs * pairs + f, larger(grown, floor), w)
    return radius


@njit
def newton_pass(L, W, w, moving):
    """One pass of Newton's method for x = φ(λ + B (x − x′)), where W.lam is the solution with
    x′ = W.kept_slip among the loads; of lanes that are `moving`, 1 or 0. Returns the greatest
    change of x, the greatest x, both as forces, and det(I − φ′ B).
    """
    pairs = number_sliding(W, w)
    m = W.newton
    one = 0.0 * ld(W.size, 0, w) + 1.0
    right, ahead = pairs * pairs, pairs * (pairs + 1)
    for c in range(pairs):
        f = pair_sliding(W, w, c)
        st(m, ahead + c, ld(W.slip, f, w) - ld(W.kept_slip, f, w), w)
    for r in range(pairs):
        f = pair_sliding(W, w, r)
        node = 2 * L.friction_node[f]
        x, y = ld(W.lam, node, w), ld(W.lam, node + 1, w)
        for c in range(pairs):
            o, more = 2 * L.nodes * c + node, ld(m, ahead + c, w)
            x = x + ld(W.response, o, w) * more
            y = y + ld(W.response, o + 1, w) * more
        size, by_x, by_y = size_of(L, W, w, f, x, y)
        slides = ld(W.slip_sign, f, w) * ld(W.slip_sign, f, w)
        by_x, by_y = slides * by_x, slides * by_y
        for c in range(pairs):
            o = 2 * L.nodes * c + node
            slope = by_x * ld(W.response, o, w) + by_y * ld(W.response, o + 1, w)
            st(m, pairs * r + c, (one if r == c else 0.0 * one) - slope, w)
        st(m, right + r, slides * size - ld(W.slip, f, w), w)
    # elimination with the pivots of the diagonal: I − φ′ B is an H-matrix where the certificate
    # holds; elsewhere a vanishing pivot means that it jams, which the determinant shows
    determinant = one
    for k in range(pairs):
        pivot = ld(m, pairs * k + k, w)
        determinant = determinant * pivot
        pivot = pivot + select_le(pivot * pivot, 0.0 * one, one, 0.0 * one)
        st(m, pairs * k + k, pivot, w)
        inverse = 1.0 / pivot
        for f in range(k + 1, pairs):
            low = ld(m, pairs * f + k, w) * inverse
            for c in range(k + 1, pairs):
                st(m, pairs * f + c, ld(m, pairs * f + c, w) - low * ld(m, pairs * k + c, w), w)
            st(m, right + f, ld(m, right + f, w) - low * ld(m, right + k, w), w)
    change, greatest = 0.0 * one, 0.0 * one
    for n in range(pairs):
        k = pairs - 1 - n
        x = ld(m, right + k, w)
        for c in range(k + 1, pairs):
            x = x - ld(m, pairs * k + c, w) * ld(m, right + c, w)
        x = moving * x / ld(m, pairs * k + k, w)
        st(m, right + k, x, w)
        f = pair_sliding(W, w, k)
        per = per_size(L, W, w, f)
        change = larger(change, per * larger(x, -x))
        whole = ld(W.slip, f, w) + x
        st(W.slip, f, whole, w)
        greatest = larger(greatest, per * larger(whole, -whole))
    return change, greatest, determinant


@njit
def friction_sizes(L, W, w):
    """W.slip ← x = φ(λ₀ + B x), from W.lam = λ₀ and W.response = B; what is found of uniqueness and
    jamming into W.friction.
    """
    coefficients(L, W, w)
    arms(L, W, w, 1.0)
    zero = 0.0 * ld(W.size, 0, w)
    one = zero + 1.0
    radius = certificate(L, W, w)
    for f in range(L.friction_kind.shape[0]):
        st(W.slip, f, zero, w)
        st(W.kept_slip, f, zero, w)
    determinant, part = one, one
    if count(w) == 1 and highest(radius) >= 1.0:
        determinant, reached = by_levels(L, W, w)
        part = part * reached
    else:
        settled = FRICTION_CHANGE_ROUNDING if count(w) == 1 else FRICTION_CHANGE_NEARLY
        moving, left = select_le(radius, one, one, zero), passes_more(w)
        for _ in range(PASSES + left):
            change, greatest, determinant = newton_pass(L, W, w, moving)
            rest = select_le(change, settled * greatest, zero, moving)
            if highest(rest) > 0.0:
                moving = rest
            elif left == 0:
                break
            else:
                left -= 1
    st(W.friction, CERTIFICATE, radius, w)
    st(W.friction, REACHED_PART, part, w)
    st(W.friction, DETERMINANT, determinant, w)


@njit
def by_levels(L, W, w):
    """x = φ(λ₀ + B x) followed with s times all coefficients, from s = 0 to 1; returns the last
    determinant and the part s that was reached. W.slip is that of the last s. Of one motion: lanes
    would share s.
    """
    pairs = number_sliding(W, w)
    one = 0.0 * ld(W.size, 0, w) + 1.0
    determinant, reached, step = one, 0.0, 1.0 / LEVELS
    before = pairs * (pairs + 2)
    while reached < 1.0 and step > FRICTION_LEVEL_LEAST:
        level = min(1.0, reached + step)
        for s in range(pairs):
            st(W.newton, before + s, ld(W.slip, pair_sliding(W, w, s), w), w)
        arms(L, W, w, level)
        good, found, left = False, one, passes_more(w)
        for _ in range(PASSES + left):
            change, greatest, found = newton_pass(L, W, w, one)
            if not lowest(found) > 0.0:
                break
            # near where it jams rounding grows as the determinant falls
            if highest(smaller(found, one) * change - FRICTION_CHANGE_ROUNDING * greatest) <= 0.0:
                good = True
                if left == 0:
                    break
                left -= 1
        for s in range(pairs):
            f = pair_sliding(W, w, s)
            size = lowest(per_size(L, W, w, f) * ld(W.slip, f, w))
            good = good and size >= -FRICTION_SIZE_NEGATIVE * highest(greatest)
        if good:
            determinant, reached = found, level
            step = min(2.0 * step, 1.0 / LEVELS)
            continue
        for s in range(pairs):
            st(W.slip, pair_sliding(W, w, s), ld(W.newton, before + s, w), w)
        step = 0.5 * step
    return determinant, reached


@njit
def add_sliding(L, W, w):
    """W.force ← W.force − Σ σ gᵀ (x − what was there before): what slides as a load on the
    coordinates. W.kept_slip is what is there.
    """
    for s in range(number_sliding(W, w)):
        f = pair_sliding(W, w, s)
        k, i, j = tangent(L, W, w, f)
        change = ld(W.slip, f, w) - ld(W.kept_slip, f, w)
        add_row(W, w, k, i, j, ld(W.slip_sign, f, w) * change)
        st(W.kept_slip, f, ld(W.slip, f, w), w)


@njit
def friction_error(L, W, w):
    """By how much x and φ(λ) differ beyond what is allowed on lanes; negative or zero where they
    agree. An error of x is at most by 1 − ϱ greater than that.
    """
    off, greatest = 0.0 * ld(W.size, 0, w), 0.0 * ld(W.size, 0, w)
    for s in range(number_sliding(W, w)):
        f = pair_sliding(W, w, s)
        node = 2 * L.friction_node[f]
        size, _, _ = size_of(L, W, w, f, ld(W.lam, node, w), ld(W.lam, node + 1, w))
        slip, slides = ld(W.slip, f, w), ld(W.slip_sign, f, w) * ld(W.slip_sign, f, w)
        rest, per = slides * size - slip, per_size(L, W, w, f)
        off = larger(off, per * larger(rest, -rest))
        greatest = larger(greatest, per * larger(slip, -slip))
    return off - FRICTION_CHANGE_LANES * (1.0 - ld(W.friction, CERTIFICATE, w)) * greatest


@njit
def friction_changes(L, W, w):
    """Whether x = φ(λ) asks for another x where λ was solved with the friction as a load; it is in
    W.slip then.
    """
    if highest(ld(W.friction, REACHED_PART, w)) < 1.0:
        return False
    one = 0.0 * ld(W.size, 0, w) + 1.0
    change, greatest, _ = newton_pass(L, W, w, one)
    return highest(change - FRICTION_CHANGE_AGAIN * greatest) > 0.0


@njit
def viscous_friction(L, W, w):
    """W.force ← W.force − d ṡ gᵀ of all friction pairs, ṡ the rate of sliding, also into W.rate."""
    sliding_rates(L, W, w)
    for f in range(L.friction_kind.shape[0]):
        damping = ld(W.par, L.friction_par[f] + 3, w)
        if highest(damping) != 0.0 or not constant(damping):
            k, i, j = tangent(L, W, w, f)
            add_row(W, w, k, i, j, damping * ld(W.rate, f, w))
    fixed_slip_signs(L, W, w)


@inline
def add_row(W, w, k, i, j, size):
    """Subtract size · gᵀ from the force on both bodies of the row at node k."""
    for n in range(3):
        at = 3 * i + n
        st(W.force, at, ld(W.force, at, w) - size * ld(W.block, 12 * k + n, w), w)
    for n in range(3):
        at = 3 * j + n
        st(W.force, at, ld(W.force, at, w) - size * ld(W.block, 12 * k + 6 + n, w), w)


@njit
def store_sliding(L, W, w):
    """Multipliers of the tangent rows of pairs that are no row now ← σ x + d ṡ."""
    for f in range(L.friction_kind.shape[0]):
        s = L.friction_tangent[f]
        viscous = ld(W.par, L.friction_par[f] + 3, w) * ld(W.rate, f, w)
        sliding = ld(W.slip_sign, f, w) * ld(W.slip, f, w) + viscous
        node = 2 * L.primitive_node[L.active_set[s]]
        on = ld(W.on, s, w)
        st(W.lam, node, on * ld(W.lam, node, w) + (1.0 - on) * sliding, w)


@njit
def friction_loss(L, W, f):
    """The power that friction pair f takes: its multiplier times the rate of sliding."""
    s = L.friction_tangent[f]
    if W.on[s, 0] != 0.0:
        return 0.0
    return W.lam[2 * L.primitive_node[L.active_set[s]], 0] * W.rate[f, 0]
