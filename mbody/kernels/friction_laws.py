"""The sizes of friction of rough pairs, for the multipliers of what presses them.

See `mbody.kernels.friction` for the equations that they stand in.
"""

from __future__ import annotations

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.duals import entry, lane_at, put_entry, rounds
from mbody.core.lanes import highest, larger, ld, select_le, smaller, st

__all__ = [
    "APART",
    "ARMS",
    "BY_RATES",
    "COUPLE",
    "FRICTION_KINDS",
    "IMPENDING",
    "LASTING",
    "PIN",
    "PULL",
    "SLIDING",
    "TORQUE",
    "arms",
    "coefficients",
    "greatest_slope",
    "size_of",
]

#: Kinds of rough pairs; the number of a kind is its place.
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
#: Kinds whose sense lasts, and which lose nothing.
LASTING = ("apart", "pull")
#: What `Layout.senses` means: the rates decide the senses; they are in W.sense, of pairs that
#: slide; the same, and pairs of the rate zero are about to slide: their coefficient is the static
#: one.
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
        if L.senses == IMPENDING or highest(ld(W.par, o + 2, w)) > 0.0:
            for n in range(rounds(W.rate, w)):
                at_rate(L, W, f, o, lane_at(n, w))


@inline
def at_rate(L, W, f, o, lane):
    """The coefficient of pair f, parameters from o on, by its rate in one lane."""
    kinetic, static = entry(W.par, o, lane), entry(W.par, o + 1, lane)
    speed, rate = entry(W.par, o + 2, lane), entry(W.rate, f, lane)
    if L.senses == IMPENDING and rate == 0.0:
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
    one sign alone counts where a pair is pressed in one sense. That teeth press apart and belts
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
        third = 0.5 * mu * ld(W.sense, f, w) * ld(W.par, o + 5, w)
    elif kind == PRESSED:
        one_way = ld(W.par, o + 4, w)
        first = mu * (1.0 - 0.5 * one_way * one_way)
        second = -0.5 * one_way * mu
    elif kind == FOLLOWER:
        first = on_cam(L, W, w, f, mu)
    elif kind == COUPLE:
        second = part * ld(W.par, o + 5, w) * ld(W.sense, f, w)
    elif kind in (TORQUE, FORCE, PULL):
        uneven = 1.0 + ld(W.par, o + 5, w) * ld(W.sense, f, w)
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
    zero = 0.0 * x
    arm, kind = ld(W.arm, ARMS * f, w), L.friction_kind[f]
    if kind in (TORQUE, FORCE, PULL):
        return arm, zero, zero
    if kind == PIN:
        whole = np.sqrt(x * x + y * y)
        per = arm / select_le(whole, zero, zero + 1.0, whole)
        return arm * whole, per * x, per * y
    sign = select_le(x, zero, zero - 1.0, zero + 1.0)
    if kind == GUIDE:
        per_length, tilt = ld(W.arm, ARMS * f + 1, w), ld(W.arm, ARMS * f + 2, w)
        moment = y + tilt * x
        turn = select_le(moment, zero, zero - 1.0, zero + 1.0)
        one, two = arm * sign * x, per_length * turn * moment
        first = select_le(two, one, zero + 1.0, zero)
        second = 1.0 - first
        by_x = first * arm * sign + second * per_length * turn * tilt
        return first * one + second * two, by_x, second * per_length * turn
    by_x = arm * sign + ld(W.arm, ARMS * f + 1, w)
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
