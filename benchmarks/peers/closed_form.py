"""Peak pin forces of many designs by NumPy: closed forms written by hand for one mechanism.

Arrays are (designs, instants), a few designs at a time so that they stay in the cache. But in what
is named after the book no sine is taken except the crank's: links are vectors, a of the crank, b of
the coupler, r of the rocker; × is the plane's cross product, and ω, α are found by projecting the
loop a + b = d + r onto b and r.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from validation.norton_fourbar import newton_euler as book

__all__ = [
    "Crank",
    "all_of_four_bars",
    "book_four_bars",
    "book_numbers",
    "four_bars",
    "nine_equations",
    "on_threads",
    "peaks",
    "slider_cranks",
]

Array = np.ndarray
Numbers = Mapping[str, Array]
Force = Callable[[Numbers, "Crank"], tuple[Array, ...]]
#: Designs at a time, the fastest of 5 to 200 where 360 instants are asked for.
CHUNK = 50


class Crank(NamedTuple):
    """What the driver says of every instant: angle, speed, acceleration (instants,)."""

    theta: Array
    omega: Array
    alpha: Array


def peaks(force: Force, numbers: Numbers, crank: Crank) -> Array:
    """The greatest force of every design (designs,); `force` gives its components first."""
    count = len(next(iter(numbers.values())))
    found = np.empty(count)
    for low in range(0, count, CHUNK):
        part = {name: values[low : low + CHUNK, None] for name, values in numbers.items()}
        fx, fy = force(part, crank)[:2]
        found[low : low + CHUNK] = np.sqrt((fx * fx + fy * fy).max(axis=1))
    return found


def on_threads(threads: int, force: Force, numbers: Numbers, crank: Crank) -> Array:
    """The same, the designs shared out among threads."""
    count = len(next(iter(numbers.values())))
    cuts = [count * n // threads for n in range(threads + 1)]
    shares = [{k: v[low:high] for k, v in numbers.items()} for low, high in pairwise(cuts)]
    with ThreadPoolExecutor(threads) as pool:
        return np.concatenate([*pool.map(lambda share: peaks(force, share, crank), shares)])


def cross(ax: Array, ay: Array, bx: Array, by: Array) -> Array:
    """a × b = ax by − ay bx."""
    return ax * by - ay * bx


# -- Norton's four-bar ------------------------------------------------------------------------


def book_numbers(**varied: Array) -> dict[str, Array]:
    """Lengths, masses and inertias of the book, of which some differ between the designs."""
    count = len(next(iter(varied.values())))
    given = {"a": book.a, "b": book.b, "c": book.c, "d": book.d}
    given |= dict(zip(("m2", "m3", "m4"), book.MASS["exact"]))
    given |= dict(zip(("i2", "i3", "i4"), book.INERTIA))
    return {name: varied.get(name, np.full(count, value)) for name, value in given.items()}


def local(length: float, degrees: float) -> tuple[float, float]:
    """Components of length @ degrees."""
    angle = math.radians(degrees)
    return length * math.cos(angle), length * math.sin(angle)


G2, G3, G4 = (local(*at) for at in book.CG)
P3 = tuple(g + p for g, p in zip(G3, local(*book.RP)))
FX, FY = local(*book.FP)


def four_bars(n: Numbers, crank: Crank, *, everything: bool = False) -> tuple[Array, ...]:
    """Force of the crank on the coupler at A; with `everything` the other pins' and the torque.

    The open branch. B divides the line from A to O4 by h = (b² + l² − c²)/2l², and stands off it by
    √(b²/l² − h²), both times its length l.
    """
    a, b, c, d = n["a"], n["b"], n["c"], n["d"]
    w2, p2 = crank.omega, crank.alpha
    x2, y2 = np.cos(crank.theta), np.sin(crank.theta)
    ax, ay = a * x2, a * y2
    vx = d - ax
    square = a * a + d * d - (2.0 * a * d) * x2
    h = 0.5 + (0.5 * (b * b - c * c)) / square
    off = np.sqrt(b * b / square - h * h)
    bx, by = vx * h + ay * off, vx * off - ay * h
    rx, ry = bx - vx, by + ay
    inverse = 1.0 / cross(bx, by, rx, ry)
    ar, ab = cross(ax, ay, rx, ry), cross(ax, ay, bx, by)
    w3, w4 = -w2 * ar * inverse, -w2 * ab * inverse
    s2, s3, s4 = w2 * w2, w3 * w3, w4 * w4
    br = bx * rx + by * ry
    p3 = (s2 * (ax * rx + ay * ry) - p2 * ar + s3 * br - (c * c) * s4) * inverse
    p4 = (s2 * (ax * bx + ay * by) - p2 * ab + (b * b) * s3 - s4 * br) * inverse
    # place and force of the load by the coupler's unit vector, moments about A and O4
    gx, gy = (G3[0] / b) * bx - (G3[1] / b) * by, (G3[0] / b) * by + (G3[1] / b) * bx
    px, py = (P3[0] / b) * bx - (P3[1] / b) * by, (P3[0] / b) * by + (P3[1] / b) * bx
    accx, accy = -p2 * ay - s2 * ax, p2 * ax - s2 * ay
    m3, own3 = n["m3"], G3[0] ** 2 + G3[1] ** 2
    k3 = (n["i3"] + m3 * own3) * p3 + m3 * cross(gx, gy, accx, accy) - (px * FY - py * FX)
    k4 = book.T4 - (n["i4"] + n["m4"] * (G4[0] ** 2 + G4[1] ** 2)) * p4
    # b × F = k₃ and r × F = k₄ of the rocker's force on the coupler at B
    fx, fy = (k3 * rx - k4 * bx) * inverse, (k3 * ry - k4 * by) * inverse
    atx = m3 * (accx - p3 * gy - s3 * gx) - fx - FX
    aty = m3 * (accy + p3 * gx - s3 * gy) - fy - FY
    if not everything:
        return atx, aty
    m2, m4 = n["m2"], n["m4"]
    ux, uy = G2[0] * x2 - G2[1] * y2, G2[0] * y2 + G2[1] * x2
    ox, oy = m2 * (-p2 * uy - s2 * ux) + atx, m2 * (p2 * ux - s2 * uy) + aty
    hx, hy = (G4[0] / c) * rx - (G4[1] / c) * ry, (G4[0] / c) * ry + (G4[1] / c) * rx
    qx, qy = m4 * (-p4 * hy - s4 * hx) + fx, m4 * (p4 * hx - s4 * hy) + fy
    torque = (n["i2"] + m2 * (G2[0] ** 2 + G2[1] ** 2)) * p2 + cross(ax, ay, atx, aty)
    return atx, aty, ox, oy, fx, fy, qx, qy, torque


def all_of_four_bars(n: Numbers, crank: Crank) -> tuple[Array, ...]:
    """The force at A, and beside it those at O2, B and O4, and the torque."""
    return four_bars(n, crank, everything=True)


class Motion(NamedTuple):
    """Of links 2, 3, 4: places (2, …) from their first pins, accelerations, and α."""

    centre: tuple[Array, Array, Array]
    end: tuple[Array, Array, Array]
    load: Array
    acceleration: tuple[Array, Array, Array]
    alpha: tuple[Array, Array, Array]


def book_motion(n: Numbers, crank: Crank) -> Motion:
    """Freudenstein's equation (4.10, 4.13) by arctangents, then the loop differentiated (6.18,
    7.12), as `validation.norton_fourbar.newton_euler` does it for one design.
    """
    a, b, c, d = n["a"], n["b"], n["c"], n["d"]
    w2, p2 = crank.omega, crank.alpha
    cos2, sin2 = np.cos(crank.theta), np.sin(crank.theta)
    k1, k2, k3 = d / a, d / c, (a * a - b * b + c * c + d * d) / (2.0 * a * c)
    A, B, C = cos2 - k1 - k2 * cos2 + k3, -2.0 * sin2, k1 - (k2 + 1.0) * cos2 + k3
    t4 = 2.0 * np.arctan2(-B - np.sqrt(B * B - 4.0 * A * C), 2.0 * A)
    k4, k5 = d / b, (c * c - d * d - a * a - b * b) / (2.0 * a * b)
    D, E, F = cos2 - k1 + k4 * cos2 + k5, -2.0 * sin2, k1 + (k4 - 1.0) * cos2 + k5
    t3 = 2.0 * np.arctan2(-E - np.sqrt(E * E - 4.0 * D * F), 2.0 * D)
    t2 = np.broadcast_to(crank.theta, t3.shape)
    w3 = a * w2 / b * np.sin(t4 - t2) / np.sin(t3 - t4)
    w4 = a * w2 / c * np.sin(t2 - t3) / np.sin(t4 - t3)
    u2, u3, u4 = (np.array([np.cos(t), np.sin(t)]) for t in (t2, t3, t4))
    A, B, D, E = c * u4[1], b * u3[1], c * u4[0], b * u3[0]
    C = a * p2 * sin2 + a * w2**2 * cos2 + w3**2 * E - w4**2 * D
    F = a * p2 * cos2 - a * w2**2 * sin2 - w3**2 * B + w4**2 * A
    p3, p4 = (C * D - A * F) / (A * E - B * D), (C * E - B * F) / (A * E - B * D)

    def turned(u: Array, x: float, y: float) -> Array:
        return np.array([x * u[0] - y * u[1], x * u[1] + y * u[0]])

    def turning(r: Array, omega: Array, alpha: Array) -> Array:
        return alpha * np.array([-r[1], r[0]]) - omega**2 * r

    g2, g3, g4 = turned(u2, *G2), turned(u3, *G3), turned(u4, *G4)
    a3 = turning(a * u2, w2, p2) + turning(g3, w3, p3)
    accelerations = (turning(g2, w2, p2), a3, turning(g4, w4, p4))
    ends = (a * u2, b * u3, c * u4)
    return Motion((g2, g3, g4), ends, turned(u3, *P3), accelerations, (p2, p3, p4))


def book_four_bars(n: Numbers, crank: Crank) -> tuple[Array, ...]:
    """All pins and the torque as `all_of_four_bars`, from the book's angles."""
    (g2, g3, g4), (a, b, r), load, (a2, a3, a4), (p2, p3, p4) = book_motion(n, crank)
    m2, m3, m4 = n["m2"], n["m3"], n["m4"]
    k3 = n["i3"] * p3 + m3 * cross(*g3, *a3) - (load[0] * FY - load[1] * FX)
    k4 = book.T4 - n["i4"] * p4 - m4 * cross(*g4, *a4)
    area = cross(*b, *r)
    at_b = np.array([(k3 * r[0] - k4 * b[0]) / area, (k3 * r[1] - k4 * b[1]) / area])
    at_a = m3 * a3 - at_b - np.array([FX, FY]).reshape(2, 1, 1)
    torque = n["i2"] * p2 + m2 * cross(*g2, *a2) + cross(*a, *at_a)
    return (*at_a, *(m2 * a2 + at_a), *at_b, *(m4 * a4 + at_b), torque)


def nine_equations(n: Numbers, crank: Crank) -> tuple[Array, Array]:
    """The force at A by LAPACK on Norton's nine equations (11.9)."""
    (g2, g3, g4), (a, b, r), load, (a2, a3, a4), (p2, p3, p4) = book_motion(n, crank)
    matrix, right = np.zeros((*p3.shape, 9, 9)), np.zeros((*p3.shape, 9))

    def put(row: int, column: int, arm: Array, sign: float) -> None:
        matrix[..., row, column] = matrix[..., row + 1, column + 1] = sign
        matrix[..., row + 2, column] = -sign * arm[1]
        matrix[..., row + 2, column + 1] = sign * arm[0]

    for row, column, arm, sign in (
        (0, 0, -g2, 1.0),
        (0, 2, a - g2, 1.0),
        (3, 4, b - g3, 1.0),
        (3, 2, -g3, -1.0),
        (6, 6, -g4, 1.0),
        (6, 4, r - g4, -1.0),
    ):
        put(row, column, arm, sign)
    matrix[..., 2, 8] = 1.0
    moment = (load - g3)[0] * FY - (load - g3)[1] * FX
    columns = [*(n["m2"] * a2), n["i2"] * p2]
    columns += [n["m3"] * a3[0] - FX, n["m3"] * a3[1] - FY, n["i3"] * p3 - moment]
    columns += [*(n["m4"] * a4), n["i4"] * p4 - book.T4]
    for row, values in enumerate(columns):
        right[..., row] = values
    found = np.linalg.solve(matrix, right[..., None])[..., 0]
    return -found[..., 2], -found[..., 3]


# -- slider-crank -----------------------------------------------------------------------------


def slider_cranks(n: Numbers, crank: Crank) -> tuple[Array, Array]:
    """Force of the crank on the rod at A, in axes along and across the guide; constant speed.

    Crank r, rod l, mass centre of the rod (gx, gy) in its axes; the guide leans by β and passes the
    crank's pin at e, so that the rod's height is e cos β − r sin(θ − β).
    """
    r, l, m, w = n["r"], n["l"], n["m3"], crank.omega
    psi = crank.theta - n["beta"]
    ax, ay = r * np.cos(psi), r * np.sin(psi)
    by = n["e"] * np.cos(n["beta"]) - ay
    bx = np.sqrt(l * l - by * by)
    w3 = -w * ax / bx
    s2, s3 = w * w, w3 * w3
    p3 = (s2 * ay + s3 * by) / bx
    gx, gy = (n["gx"] / l) * bx - (n["gy"] / l) * by, (n["gx"] / l) * by + (n["gy"] / l) * bx
    accx, accy = -s2 * ax, -s2 * ay
    fx = n["m4"] * (p3 * by + s3 * bx - accx)
    own = n["i3"] + m * (n["gx"] ** 2 + n["gy"] ** 2)
    fy = (own * p3 + m * cross(gx, gy, accx, accy) + by * fx) / bx
    return m * (accx - p3 * gy - s3 * gx) - fx, m * (accy + p3 * gx - s3 * gy) - fy
