"""The predictor of the continuation: Hermite polynomials through the places behind.

The path parameter s is time, or the value of the one driver. Of the last three places q, q′ and q″
are stored (derivatives by s), so a new place is predicted by Hermite's polynomial through two of
them (degree 5) or all three (degree 8), see Hairer, Nørsett & Wanner, *Solving Ordinary
Differential Equations I*, II.6. The places take turns in W.past; `last` is the first row of the
latest.
"""

from __future__ import annotations

from mbody.core.decorators import inline, njit
from mbody.core.lanes import larger, ld, smaller, st

__all__ = ["compare_step", "next_place", "predict", "predict_by_three", "store_place"]


@njit
def store_place(L, W, w, last):
    """Store q, v, a as the last place; returns its first row."""
    size = W.q.shape[0]
    o = next_place(W, last)
    for n in range(3 * L.bodies):
        st(W.past, o + n, ld(W.q, n, w), w)
        st(W.past, o + size + n, ld(W.v, n, w), w)
        st(W.past, o + 2 * size + n, ld(W.a, n, w), w)
    return o


@njit
def predict(L, W, w, h, back, quintic, last):
    """q at h beyond the last place, the place before being `back` behind it.

    Quintic through both places with both derivatives, or (quintic = 0) the Taylor polynomial of
    the last one. With x = h/back the last place is at x = 0, the one before at x = −1, and

        q = f₀ + α (f₁ − f₀) + β f₀′ + β₁ f₁′ + γ f₀″ + γ₁ f₁″.

    The weights of the place before have a triple zero at x = 0 and are the Hermite basis at −1:
    α = −x³ (10 + 15 x + 6 x²), β₁ = −back x³ (1 + x) (4 + 3 x), γ₁ = −back² x³ (1 + x)²/2. Those of
    the last place follow, as polynomials of degree 0, 1 and 2 must be exact.
    """
    size = W.q.shape[0]
    before = place_before(W, last)
    x = h / back
    y = 1.0 + x
    cubic = x * x * x * quintic
    alpha = -cubic * (10.0 + x * (15.0 + 6.0 * x))
    slope = -cubic * y * (4.0 + 3.0 * x)
    bend = -0.5 * cubic * y * y
    beta, beta1 = back * (x + alpha - slope), back * slope
    gamma = back * back * (0.5 * (x * x - alpha) + slope - bend)
    gamma1 = back * back * bend
    for n in range(3 * L.bodies):
        f, o, o1 = ld(W.past, last + n, w), last + size + n, before + size + n
        near = beta * ld(W.past, o, w) + gamma * ld(W.past, o + size, w)
        far = beta1 * ld(W.past, o1, w) + gamma1 * ld(W.past, o1 + size, w)
        st(W.q, n, f + (alpha * (ld(W.past, before + n, w) - f) + near + far), w)


@njit
def predict_by_three(L, W, w, h, back, longer, last):
    """q at h beyond the last place by three places, the others `back` and `longer` behind it.

    Hermite's polynomial of degree 8: each place adds Lᵢ³ (…), Lᵢ being Lagrange's polynomial of
    the place, which makes value, slope and curvature vanish at the two others. Its terms are some
    hundred times their sum, so that rounding is greater than that of `predict`.
    """
    size = W.q.shape[0]
    one = place_before(W, last)
    two = place_before(W, one)
    a, b, c = 1.0 / back, 1.0 / longer, 1.0 / (longer - back)
    d1, d2 = h + back, h + longer
    _, v0, a0 = hermite_weights(d1 * d2 * a * b, a + b, a * b, h)
    f1, v1, a1 = hermite_weights(-h * d2 * a * c, c - a, -a * c, d1)
    f2, v2, a2 = hermite_weights(h * d1 * b * c, -(b + c), b * c, d2)
    for n in range(3 * L.bodies):
        f, o = ld(W.past, last + n, w), size + n
        d = f1 * (ld(W.past, one + n, w) - f) + f2 * (ld(W.past, two + n, w) - f)
        d = d + v0 * ld(W.past, last + o, w) + a0 * ld(W.past, last + size + o, w)
        d = d + v1 * ld(W.past, one + o, w) + a1 * ld(W.past, one + size + o, w)
        d = d + v2 * ld(W.past, two + o, w) + a2 * ld(W.past, two + size + o, w)
        st(W.q, n, f + d, w)


@inline
def hermite_weights(part, slope, bend, d):
    """Weights of f, f′ and f″ of one of three places, d before the new one.

    Lagrange's polynomial of the place, L(d) = 1 + slope d + bend d², is `part` at the new one. The
    weights are L³ times the Taylor polynomials of degree 2 of 1/L³, d/L³ and d²/(2 L³):
    1/L³ = 1 − 3 slope d + (6 slope² − 3 bend) d² + … .
    """
    cube = part * part * part
    x = slope * d
    f = cube * (1.0 - 3.0 * x + (6.0 * x * x - 3.0 * bend * d * d))
    return f, cube * d * (1.0 - 3.0 * x), 0.5 * cube * d * d


@inline
def next_place(W, place):
    """First row of the place after."""
    size = 3 * W.q.shape[0]
    return place + size if place < 2 * size else 0


@inline
def place_before(W, place):
    """First row of the place before."""
    size = 3 * W.q.shape[0]
    return place - size if place > 0 else 2 * size


@njit
def compare_step(L, W, w, h, last):
    """Squares of the step from the last place to q, and of how far the derivative at q (in W.v)
    lies from the predicted one, q′₀ + h q″₀, with the size of its terms: a step onto another branch
    turns the derivative. In model lengths and radians. And the most by which one body turns from
    another, the ground among them.
    """
    per_length = 1.0 / ld(W.size, 0, w)
    size = W.q.shape[0]
    moved, off, terms = 0.0 * per_length, 0.0 * per_length, 0.0 * per_length
    turned, turned_off, turned_terms = moved, off, terms
    most, least = moved, moved
    for b in range(L.bodies):
        for n in range(3):
            o = 3 * b + n
            way = ld(W.q, o, w) - ld(W.past, last + o, w)
            now, before = ld(W.v, o, w), ld(W.past, last + size + o, w)
            bend = h * ld(W.past, last + 2 * size + o, w)
            d = now - before - bend
            whole = now * now + before * before + bend * bend
            if n == 2:
                turned = turned + way * way
                most, least = larger(most, way), smaller(least, way)
                turned_off = turned_off + d * d
                turned_terms = turned_terms + whole
            else:
                moved = moved + way * way
                off = off + d * d
                terms = terms + whole
    square = per_length * per_length
    far, off, terms = (
        square * moved + turned,
        square * off + turned_off,
        square * terms + turned_terms,
    )
    return far, off, terms, most - least
