"""The sizes of friction of rough pairs, for the multipliers of what presses them.

See `mbody.kernels.friction` for the equations that they stand in.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.lanes import count, larger, ld, select_le

__all__ = [
    "APART",
    "BY_RATES",
    "COUPLE",
    "FRICTION_KINDS",
    "IMPENDING",
    "PIN",
    "SLIDING",
    "TORQUE",
    "coefficients",
    "greatest_slope",
    "size_of",
]

#: Kinds of rough pairs; the number of a kind is its place.
FRICTION_KINDS = ("pin", "guide", "pressed", "couple", "follower", "apart", "torque", "force")
PIN, GUIDE, _, COUPLE, FOLLOWER, APART, TORQUE, FORCE = range(8)
#: What `Layout.senses` means: the rates decide the senses; they are in W.sense, of pairs that
#: slide; the same, and pairs of the rate zero are about to slide: their coefficient is the static
#: one.
BY_RATES, SLIDING, IMPENDING = 0, 1, 2


@njit
def coefficients(L, W, w):
    """W.coefficient ← the coefficient of friction of every pair at its rate of sliding."""
    for f in range(L.friction_kind.shape[0]):
        o = L.friction_par[f]
        for lane in range(count(w)):
            kinetic, static, speed = W.par[o, lane], W.par[o + 1, lane], W.par[o + 2, lane]
            mu = kinetic
            if L.senses == IMPENDING and W.rate[f, lane] == 0.0:
                mu = static
            elif speed > 0.0:
                mu += (static - kinetic) * math.exp(-((W.rate[f, lane] / speed) ** 2))
            W.coefficient[f, lane] = mu


@inline
def pin_arm(L, W, w, f):
    """ρ of pin f: the radius of its friction circle."""
    mu = ld(W.coefficient, f, w)
    return mu * ld(W.par, L.friction_par[f] + 4, w) / np.sqrt(1.0 + mu * mu)


@inline
def guide_arms(L, W, w, f):
    """2 μ/ℓ of guide f, zero where it has no length, and μ σ h/2."""
    mu, o = ld(W.coefficient, f, w), L.friction_par[f]
    length = ld(W.par, o + 4, w)
    zero = 0.0 * length
    per_length = select_le(length, zero, zero, 2.0 / select_le(length, zero, zero + 1.0, length))
    return mu * per_length, 0.5 * mu * ld(W.sense, f, w) * ld(W.par, o + 5, w)


@inline
def size_of(L, W, w, f, x, y):
    """φ of pair f for multipliers (x, y) of what presses it, and ∂φ by both."""
    zero = 0.0 * x
    if L.friction_kind[f] in (TORQUE, FORCE):
        given = ld(W.coefficient, f, w) * ld(W.signal, L.friction_signal[f], w)
        return larger(zero, given), zero, zero
    if L.friction_kind[f] == PIN:
        arm, whole = pin_arm(L, W, w, f), np.sqrt(x * x + y * y)
        per = arm / select_le(whole, zero, zero + 1.0, whole)
        return arm * whole, per * x, per * y
    mu = ld(W.coefficient, f, w)
    sign = select_le(x, zero, zero - 1.0, zero + 1.0)
    if L.friction_kind[f] == GUIDE:
        per_length, tilt = guide_arms(L, W, w, f)
        moment = y + tilt * x
        turn = select_le(moment, zero, zero - 1.0, zero + 1.0)
        one, two = mu * sign * x, per_length * turn * moment
        first = select_le(two, one, zero + 1.0, zero)
        second = 1.0 - first
        by_x = first * mu * sign + second * per_length * turn * tilt
        return first * one + second * two, by_x, second * per_length * turn
    if L.friction_kind[f] == FOLLOWER:
        mu = on_cam(L, W, w, f)
    uneven = zero
    if L.friction_kind[f] == COUPLE:
        uneven = ld(W.par, L.friction_par[f] + 5, w) * ld(W.sense, f, w)
    return mu * sign * x + uneven * x, mu * sign + uneven, zero


@inline
def on_cam(L, W, w, f):
    """Friction of follower f on its cam by the multiplier. A roller turns on a pin of some part of
    its radius: the force on it passes the pin at the radius of the friction circle, so that the
    part along the cam is to that across it as the sides of that triangle.
    """
    o = 12 * L.friction_node[f] + 6
    x, y = ld(W.block, o, w), ld(W.block, o + 1, w)
    mu, part = ld(W.coefficient, f, w), ld(W.par, L.friction_par[f] + 4, w)
    sine = part * mu / np.sqrt(1.0 + mu * mu)
    rolls = sine / np.sqrt(1.0 - sine * sine)
    return select_le(part, 0.0 * mu, mu, rolls) * np.sqrt(x * x + y * y)


@inline
def greatest_slope(L, W, w, f, x, y):
    """The Lipschitz constant of φ of pair f along the direction (x, y) of its multipliers."""
    if L.friction_kind[f] in (TORQUE, FORCE):
        return 0.0 * x
    if L.friction_kind[f] == PIN:
        return pin_arm(L, W, w, f) * np.sqrt(x * x + y * y)
    one = ld(W.coefficient, f, w) * larger(x, -x)
    if L.friction_kind[f] == GUIDE:
        per_length, tilt = guide_arms(L, W, w, f)
        moment = y + tilt * x
        return larger(one, per_length * larger(moment, -moment))
    if L.friction_kind[f] == FOLLOWER:
        return on_cam(L, W, w, f) * larger(x, -x)
    if L.friction_kind[f] == COUPLE:
        uneven = ld(W.par, L.friction_par[f] + 5, w)
        return one + larger(uneven, -uneven) * larger(x, -x)
    return one
