"""The foot of a place on a smooth contour of a body, a C² curve through points.

The contour is cubic pieces, each of which turns by little, with a binary tree of circles about
them, so that the nearest foot of a place costs what is near. Beyond its ends an open contour goes
straight on. With the unit tangent t, the normal n = k × t on its free side and the curvature κ at
the foot c of the place p, (p − c) · t = 0 and::

    D = n · (p − c)      Ḋ = n · ṗ      ṡ = t · ṗ / (1 − κ D)      φ̇ = κ ṡ

Eberly: Robust Computation of Distance (2015); Ericson: Real-Time Collision Detection (2005), 6.
"""

from __future__ import annotations

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False, disallow-untyped-calls=False
import math

import numpy as np

from mbody.core.decorators import inline, njit
from mbody.core.lanes import value
from mbody.core.tolerances import LENGTH_NONE

#: Numbers before the pieces: pieces, leaves of the tree, length, whether it is closed.
HEAD = 4
#: Numbers of a piece: coefficients of x and of y, its extent, length and angle at its beginning.
PIECE = 11
#: Numbers of a node of the tree.
NODE = 6
#: Nodes and weights of Gauss and Legendre on 0 … 1.
NODES = tuple((0.5 * (np.polynomial.legendre.leggauss(6)[0] + 1.0)).tolist())
WEIGHTS = tuple((0.5 * np.polynomial.legendre.leggauss(6)[1]).tolist())
#: Steps to a foot, at most: those of bisection.
MOST_STEPS = 60


# -- The foot of a place -----------------------------------------------------------------------


@inline
def piece_at(tab, c, w):
    """x, y and both derivatives of the piece at c."""
    return (
        tab[c] + w * (tab[c + 1] + w * (tab[c + 2] + w * tab[c + 3])),
        tab[c + 4] + w * (tab[c + 5] + w * (tab[c + 6] + w * tab[c + 7])),
        tab[c + 1] + w * (2.0 * tab[c + 2] + 3.0 * w * tab[c + 3]),
        tab[c + 5] + w * (2.0 * tab[c + 6] + 3.0 * w * tab[c + 7]),
        2.0 * tab[c + 2] + 6.0 * w * tab[c + 3],
        2.0 * tab[c + 6] + 6.0 * w * tab[c + 7],
    )


@inline
def away(tab, c, w, x, y):
    """(c − p) · c′ and its derivative at w: half of those of the squared distance."""
    px, py, dx, dy, ddx, ddy = piece_at(tab, c, w)
    ox, oy = px - x, py - y
    return ox * dx + oy * dy, dx * dx + dy * dy + ox * ddx + oy * ddy


@inline
def distance_to(tab, c, w, x, y):
    """From a place to that of the piece at c."""
    px, py, _, _, _, _ = piece_at(tab, c, w)
    return math.hypot(px - x, py - y)


@njit
def foot_on_piece(tab, c, x, y):
    """Where on the piece at c the place is nearest: at an end, or by Newton's method in between."""
    low, high = 0.0, tab[c + 8]
    first, _ = away(tab, c, low, x, y)
    last, _ = away(tab, c, high, x, y)
    if first >= 0.0 or last <= 0.0:
        if first < 0.0 or (
            last <= 0.0 and distance_to(tab, c, high, x, y) < distance_to(tab, c, low, x, y)
        ):
            return high
        return low
    w, least = high * first / (first - last), LENGTH_NONE * high
    for _ in range(MOST_STEPS):
        g, slope = away(tab, c, w, x, y)
        if g > 0.0:
            high = w
        else:
            low = w
        ahead = w - g / slope
        if not low < ahead < high:
            ahead = 0.5 * (low + high)
        step, w = abs(ahead - w), ahead
        if step <= least:
            break
    return w


@inline
def from_chord(tab, c, x, y):
    """Distance of a place from the chord of the node at c."""
    ox, oy, dx, dy = x - tab[c], y - tab[c + 1], tab[c + 2], tab[c + 3]
    part = min(max(ox * dx + oy * dy, 0.0), tab[c + 4])
    rx, ry = ox - part * dx, oy - part * dy
    return math.sqrt(rx * rx + ry * ry)


@njit
def nearest_piece(tab, k, x, y, last):
    """Number of the piece that is nearest to a place, and where on it the foot is: down the tree,
    the nearer side first, the other one where it may be nearer than what is found; or up from the
    piece `last`, where the place has a foot within it. Of equally near pieces the first.
    """
    count, leaves = int(tab[k]), int(tab[k + 1])
    o, node, begin, piece, w, best = k + HEAD + PIECE * count, 1, 0, 0, 0.0, math.inf
    if 0 <= last < count:
        c = k + HEAD + PIECE * last
        other = foot_on_piece(tab, c, x, y)
        if 0.0 < other < tab[c + 8]:
            piece, w, best = last, other, distance_to(tab, c, other, x, y)
            node = begin = leaves + last
    # a bit for every level: whether the other side was looked at
    both = 0
    while True:
        c = o + NODE * node
        # no piece is farther from the chord than that
        if node != begin and (best == math.inf or from_chord(tab, c, x, y) - tab[c + 5] < best):
            if node < leaves:
                c += NODE * node
                closer = from_chord(tab, c + NODE, x, y) < from_chord(tab, c, x, y)
                node, both = 2 * node + (1 if closer else 0), 2 * both
                continue
            near = min(node - leaves, count - 1)
            c = k + HEAD + PIECE * near
            other = foot_on_piece(tab, c, x, y)
            far = distance_to(tab, c, other, x, y)
            if far < best or (far == best and near < piece):
                piece, w, best = near, other, far
        while both % 2 == 1:
            node, both = node // 2, both // 2
        if node == 1:
            return piece, w
        node, both = node + 1 - 2 * (node % 2), both + 1


@njit
def foot(tab, k, x, y, last):
    """(D, s, φ, κ/(1 − κ D)) of the contour at tab[k] for a place (x, y) in its axes, and the piece
    of the foot: distance on its free side, length and angle up to the foot, curvature as seen from
    the place. The search begins at the piece `last`, if it is one.
    """
    px, py = value(x), value(y)
    piece, w = nearest_piece(tab, k, px, py, last)
    c = k + HEAD + PIECE * piece
    g, slope = away(tab, c, w, px, py)
    if tab[k + 3] == 0.0 and (
        (piece == 0 and w == 0.0 and g > 0.0)
        or (piece == int(tab[k]) - 1 and w == tab[c + 8] and g < 0.0)
    ):
        # beyond an end, along its tangent
        ex, ey, dx, dy, _, _ = piece_at(tab, c, w)
        size = math.hypot(dx, dy)
        dx, dy = dx / size, dy / size
        s, phi = travelled(tab, c, w)
        ox, oy = x - ex, y - ey
        return dx * oy - dy * ox, s + dx * ox + dy * oy, phi + 0.0 * ox, 0.0 * ox, piece
    # one step more, by which the foot follows a dual number
    g, slope = away(tab, c, w, x, y)
    at = w - g / slope
    ex, ey, dx, dy, ddx, ddy = piece_at(tab, c, at)
    _, slope = away(tab, c, at, x, y)
    size = np.sqrt(dx * dx + dy * dy)
    s, phi = travelled(tab, c, at)
    distance = (dx * (y - ey) - dy * (x - ex)) / size
    return distance, s, phi, (dx * ddy - dy * ddx) / (size * slope), piece


@inline
def travelled(tab, c, w):
    """Length and angle of the contour up to w on the piece at c."""
    s = tab[c + 9] + 0.0 * w
    for n in range(len(NODES)):
        _, _, dx, dy, _, _ = piece_at(tab, c, w * NODES[n])
        s = s + w * WEIGHTS[n] * np.sqrt(dx * dx + dy * dy)
    _, _, dx, dy, _, _ = piece_at(tab, c, w)
    bx, by = tab[c + 1], tab[c + 5]
    return s, tab[c + 10] + np.arctan2(bx * dy - by * dx, bx * dx + by * dy)
