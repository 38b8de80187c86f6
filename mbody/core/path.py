"""The path of a driven mechanism: prediction from the places behind, and the test of a step.

The path parameter s is time, or the value of the one driver. The motion behind is kept as q and its
two derivatives by s at the last two places, so a new place is predicted by a quintic.
"""

from __future__ import annotations

import numpy as np

from mbody._jit import njit
from mbody._lanes import ld, st

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
    far, turned = 0.0 * per_length, 0.0 * per_length
    for b in range(L.bodies):
        o = 3 * b
        x, y = ld(W.q, o, w) - ld(W.q0, o, w), ld(W.q, o + 1, w) - ld(W.q0, o + 1, w)
        t = ld(W.q, o + 2, w) - ld(W.q0, o + 2, w)
        far = far + x * x + y * y
        turned = turned + t * t
    return np.sqrt(far * per_length * per_length + turned)


@njit
def strayed(L, W, w, h):
    """How far the derivative at q (in W.v) lies from the one foretold by the last place.

    Returned with the size of the terms: a step onto another branch turns the derivative round.
    """
    square = ld(W.size, 0, w) * ld(W.size, 0, w)
    off, size = 0.0 * square, 0.0 * square
    for b in range(L.bodies):
        for n in range(3):
            o = 3 * b + n
            now, last, bend = ld(W.v, o, w), ld(W.q0_s, o, w), h * ld(W.q0_ss, o, w)
            d = now - last - bend
            part, whole = d * d, now * now + last * last + bend * bend
            if n == 2:
                part, whole = part * square, whole * square
            off = off + part
            size = size + whole
    return np.sqrt(off / square), np.sqrt(size / square)
