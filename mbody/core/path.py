"""The path of a driven mechanism: prediction from the places behind, and the test of a step.

The path parameter s is time, or the value of the one driver. The motion behind is kept as q and its
two derivatives by s at the last two places, so a new place is predicted by a quintic.
"""

from __future__ import annotations

from mbody._jit import njit
from mbody._lanes import larger, ld, st

__all__ = ["behind", "predict", "step_size", "strayed"]


@njit
def behind(W, w):
    """Shift the history by one place: what is in q, v, a becomes the last place."""
    for n in range(W.q.shape[0]):
        st(W.q1, n, ld(W.q0, n, w), w)
        st(W.q1_s, n, ld(W.q0_s, n, w), w)
        st(W.q1_ss, n, ld(W.q0_ss, n, w), w)
        st(W.q0, n, ld(W.q, n, w), w)
        st(W.q0_s, n, ld(W.v, n, w), w)
        st(W.q0_ss, n, ld(W.a, n, w), w)


@njit
def predict(L, W, w, h, back, quintic):
    """q at h beyond the last place, the place before being `back` behind it.

    Quintic through both places with both derivatives, or (quintic = 0) the Taylor polynomial of
    the last one. On x = s/back, p = f₀ + f₀'x + f₀''x²/2 + x³ (A + B x + C x²).
    """
    x = h / back
    cubic = x * x * x * quintic
    for n in range(3 * L.bodies):
        f, d, c = ld(W.q0, n, w), back * ld(W.q0_s, n, w), back * back * ld(W.q0_ss, n, w)
        e0 = ld(W.q1, n, w) - f + d - 0.5 * c
        e1 = back * ld(W.q1_s, n, w) - d + c
        e2 = back * back * ld(W.q1_ss, n, w) - c
        A = -(10.0 * e0 + 4.0 * e1 + 0.5 * e2)
        B = 2.0 * A + e1 + 5.0 * e0
        C = A + e1 + 4.0 * e0
        st(W.q, n, f + x * (d + 0.5 * x * c) + cubic * (A + x * (B + x * C)), w)


@njit
def step_size(L, W, w):
    """Size of the step from the last place to q (in model lengths and radians)."""
    per_length = 1.0 / ld(W.size, 0, w)
    m = 0.0 * per_length
    for b in range(L.bodies):
        for n in range(3):
            d = ld(W.q, 3 * b + n, w) - ld(W.q0, 3 * b + n, w)
            if n < 2:
                d = d * per_length
            m = larger(m, larger(d, -d))
    return m


@njit
def strayed(L, W, w, h):
    """How far the derivative at q (in W.v) lies from the one foretold by the last place, and the
    size of both: a step onto another branch turns it round. In model lengths and radians.
    """
    per_length = 1.0 / ld(W.size, 0, w)
    off = 0.0 * per_length
    size = 0.0 * per_length
    for b in range(L.bodies):
        for n in range(3):
            o = 3 * b + n
            now, last, bend = ld(W.v, o, w), ld(W.q0_s, o, w), h * ld(W.q0_ss, o, w)
            d = now - last - bend
            if n < 2:
                d, now, bend = d * per_length, now * per_length, bend * per_length
                last = last * per_length
            off = larger(off, larger(d, -d))
            size = larger(size, larger(now, -now))
            size = larger(size, larger(last, -last))
            size = larger(size, larger(bend, -bend))
    return off, size
