"""Equations written for one mechanism by hand, as a careful user of NumPy and scipy would.

The functions are plain scalar Python or NumPy; numba compiles the first two as they stand, for the
rows that say so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from benchmarks.frame import Engine, available
from benchmarks.peers.stepping import TOLERANCES, dop853

__all__ = ["andrews", "chain", "engine", "engines", "four_bar", "sundials"]

Slope = Callable[[float, np.ndarray], np.ndarray]


def engine(name: str, slope: Slope, start: np.ndarray, until: float, state: Any) -> Engine:
    """Scipy's DOP853 over a slope."""

    def prepare(rtol: float) -> Callable[[], np.ndarray]:
        return lambda: dop853(slope, start, until, rtol)

    return Engine(name, TOLERANCES, prepare, state)


def engines(
    equation: Slope, plain: str, compiled: str, start: np.ndarray, until: float, state: Any
) -> list[Engine]:
    """DOP853 over an equation in plain Python and compiled by numba, and SUNDIALS, where it is
    there, over the compiled one; `plain` and `compiled` tell of it in their names.
    """
    fast = numba.njit(equation)
    fast(0.0, start)
    found = [
        engine(f"scipy DOP853, {plain}", equation, start, until, state),
        engine(f"scipy DOP853, {compiled}", fast, start, until, state),
    ]
    if available("sksundae"):
        found.append(sundials(f"SUNDIALS CVODE Adams, {compiled}", fast, start, until, state))
    return found


def sundials(name: str, slope: Slope, start: np.ndarray, until: float, state: Any) -> Engine:
    """CVODE of SUNDIALS over a slope: Adams' methods, which its manual advises where not stiff."""
    from sksundae.cvode import CVODE

    def fill(t: float, y: np.ndarray, out: np.ndarray) -> None:
        out[:] = slope(t, y)

    def prepare(rtol: float) -> Callable[[], np.ndarray]:
        solver = CVODE(fill, method="Adams", rtol=rtol, atol=rtol, max_num_steps=1_000_000)

        def run() -> np.ndarray:
            found = solver.solve(np.array([0.0, until]), start)
            if not found.success:
                raise ArithmeticError(found.message)
            return found.y[-1]

        return run

    return Engine(name, TOLERANCES, prepare, state)


def four_bar(t: float, y: np.ndarray) -> np.ndarray:
    """Norton's four-bar released: M(θ) θ'' + ½ M'(θ) θ'² + V'(θ) = 0 of the crank alone.

    Open closure; lengths, weights and mass centres of example 11-3, g = 386 in/s².
    """
    a, b, c, d, g = 5.0, 15.0, 10.0, 19.0, 386.0
    theta, w = y[0], y[1]
    x2, y2 = math.cos(theta), math.sin(theta)
    vx, vy = d - a * x2, -a * y2
    l2 = vx * vx + vy * vy
    length = math.sqrt(l2)
    ca = (b * b + l2 - c * c) / (2.0 * b * length)
    sa = math.sqrt(1.0 - ca * ca)
    x3, y3 = (vx * ca - vy * sa) / length, (vy * ca + vx * sa) / length
    x4, y4 = (a * x2 + b * x3 - d) / c, (a * y2 + b * y3) / c
    # sines and cosines of the differences of the links' angles
    s24, c24 = y2 * x4 - x2 * y4, x2 * x4 + y2 * y4
    s23, c23 = y2 * x3 - x2 * y3, x2 * x3 + y2 * y3
    s34, c34 = y3 * x4 - x3 * y4, x3 * x4 + y3 * y4
    k3, k4 = -a * s24 / (b * s34), -a * s23 / (c * s34)
    k3p = (c * k4 * k4 - a * c24 - b * k3 * k3 * c34) / (b * s34)
    k4p = -(a * c23 + b * k3 * k3 - c * k4 * k4 * c34) / (c * s34)
    # mass centres in link axes: 3 @ 30°, 9 @ 45°, 5 @ 0°
    p2, q2 = 2.598076211353316, 1.5
    p3 = q3 = 6.363961030678928
    p4 = 5.0
    rx2, ry2 = p2 * x2 - q2 * y2, p2 * y2 + q2 * x2
    rx3, ry3 = p3 * x3 - q3 * y3, p3 * y3 + q3 * x3
    rx4, ry4 = p4 * x4, p4 * y4
    m2, m3, m4 = 1.5 / g, 7.7 / g, 5.8 / g
    ux2, uy2, hx2, hy2 = -ry2, rx2, -rx2, -ry2
    ux3, uy3 = -a * y2 - k3 * ry3, a * x2 + k3 * rx3
    hx3 = -a * x2 - k3p * ry3 - k3 * k3 * rx3
    hy3 = -a * y2 + k3p * rx3 - k3 * k3 * ry3
    ux4, uy4 = -k4 * ry4, k4 * rx4
    hx4, hy4 = -k4p * ry4 - k4 * k4 * rx4, k4p * rx4 - k4 * k4 * ry4
    mass = (
        m2 * (ux2 * ux2 + uy2 * uy2)
        + m3 * (ux3 * ux3 + uy3 * uy3)
        + m4 * (ux4 * ux4 + uy4 * uy4)
        + 0.4
        + 1.5 * k3 * k3
        + 0.8 * k4 * k4
    )
    half = (
        m2 * (ux2 * hx2 + uy2 * hy2)
        + m3 * (ux3 * hx3 + uy3 * hy3)
        + m4 * (ux4 * hx4 + uy4 * hy4)
        + 1.5 * k3 * k3p
        + 0.8 * k4 * k4p
    )
    pull = g * (m2 * uy2 + m3 * uy3 + m4 * uy4)
    return np.array([w, -(half * w * w + pull) / mass])


def andrews(t: float, y: np.ndarray) -> np.ndarray:
    """Andrews' mechanism in the seven angles of the Bari test set: 13 equations by LAPACK.

    Hairer and Wanner, Solving Ordinary Differential Equations II, section VII.7.
    """
    m1, m2, m3, m4, m5, m6, m7 = 0.04325, 0.00365, 0.02373, 0.00706, 0.0705, 0.00706, 0.05498
    i1, i2, i3, i4 = 2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7
    i5, i6, i7 = 1.169e-5, 5.667e-7, 1.912e-5
    xb, yb, xc, yc, c0, l0 = -0.03635, 0.03273, 0.014, 0.072, 4530.0, 0.07785
    d, da, e, ea, zf, fa, rr, ra = 28e-3, 115e-4, 2e-2, 1421e-5, 2e-2, 1421e-5, 7e-3, 92e-5
    ss, sa, sb, sc, sd, zt, ta = 35e-3, 1874e-5, 1043e-5, 18e-3, 2e-2, 4e-2, 2308e-5
    tb, u, ua, ub, motor = 916e-5, 4e-2, 1228e-5, 449e-5, 0.033
    be, th, ga, ph, de, om, ep = y[0], y[1], y[2], y[3], y[4], y[5], y[6]
    vb, vt, vg, vp, vd, vo, ve = y[7], y[8], y[9], y[10], y[11], y[12], y[13]
    sth, cth, sph, cph = math.sin(th), math.cos(th), math.sin(ph), math.cos(ph)
    som, com, sga, cga = math.sin(om), math.cos(om), math.sin(ga), math.cos(ga)
    sde, cde, sep, cep = math.sin(de), math.cos(de), math.sin(ep), math.cos(ep)
    sbe, cbe, sbt, cbt = math.sin(be), math.cos(be), math.sin(be + th), math.cos(be + th)
    spd, cpd, soe, coe = math.sin(ph + de), math.cos(ph + de), math.sin(om + ep), math.cos(om + ep)
    big, right = np.zeros((13, 13)), np.zeros(13)
    big[0, 0] = m1 * ra**2 + m2 * (rr**2 - 2.0 * da * rr * cth + da**2) + i1 + i2
    big[1, 0] = big[0, 1] = m2 * (da**2 - da * rr * cth) + i2
    big[1, 1] = m2 * da**2 + i2
    big[2, 2] = m3 * (sa**2 + sb**2) + i3
    big[3, 3] = m4 * (e - ea) ** 2 + i4
    big[4, 3] = big[3, 4] = m4 * ((e - ea) ** 2 + zt * (e - ea) * sph) + i4
    big[4, 4] = (
        m4 * (zt**2 + 2.0 * zt * (e - ea) * sph + (e - ea) ** 2) + m5 * (ta**2 + tb**2) + i4 + i5
    )
    big[5, 5] = m6 * (zf - fa) ** 2 + i6
    big[6, 5] = big[5, 6] = m6 * ((zf - fa) ** 2 - u * (zf - fa) * som) + i6
    big[6, 6] = (
        m6 * ((zf - fa) ** 2 - 2.0 * u * (zf - fa) * som + u**2) + m7 * (ua**2 + ub**2) + i6 + i7
    )
    xd, yd = sd * cga + sc * sga + xb, sd * sga - sc * cga + yb
    length = math.hypot(xd - xc, yd - yc)
    force = -c0 * (length - l0) / length
    fx, fy = force * (xd - xc), force * (yd - yc)
    right[0] = motor - m2 * da * rr * vt * (vt + 2.0 * vb) * sth
    right[1] = m2 * da * rr * vb**2 * sth
    right[2] = fx * (sc * cga - sd * sga) + fy * (sd * cga + sc * sga)
    right[3] = m4 * zt * (e - ea) * vd**2 * cph
    right[4] = -m4 * zt * (e - ea) * vp * (vp + 2.0 * vd) * cph
    right[5] = -m6 * u * (zf - fa) * ve**2 * com
    right[6] = m6 * u * (zf - fa) * vo * (vo + 2.0 * ve) * com
    for row, values in (
        (7, (-rr * sbe + d * sbt, d * sbt, -ss * cga, 0.0, 0.0, 0.0, 0.0)),
        (8, (rr * cbe - d * cbt, -d * cbt, -ss * sga, 0.0, 0.0, 0.0, 0.0)),
        (9, (-rr * sbe + d * sbt, d * sbt, 0.0, -e * cpd, -e * cpd + zt * sde, 0.0, 0.0)),
        (10, (rr * cbe - d * cbt, -d * cbt, 0.0, -e * spd, -e * spd - zt * cde, 0.0, 0.0)),
        (11, (-rr * sbe + d * sbt, d * sbt, 0.0, 0.0, 0.0, zf * soe, zf * soe - u * cep)),
        (12, (rr * cbe - d * cbt, -d * cbt, 0.0, 0.0, 0.0, -zf * coe, -zf * coe - u * sep)),
    ):
        for column in range(7):
            big[row, column] = big[column, row] = values[column]
    bt2, pd2, oe2 = (vb + vt) ** 2, (vp + vd) ** 2, (vo + ve) ** 2
    crank_x, crank_y = rr * cbe * vb**2 - d * cbt * bt2, rr * sbe * vb**2 - d * sbt * bt2
    right[7] = crank_x - ss * sga * vg**2
    right[8] = crank_y + ss * cga * vg**2
    right[9] = crank_x - e * spd * pd2 - zt * cde * vd**2
    right[10] = crank_y + e * cpd * pd2 - zt * sde * vd**2
    right[11] = crank_x - zf * coe * oe2 - u * sep * ve**2
    right[12] = crank_y - zf * soe * oe2 + u * cep * ve**2
    out = np.empty(14)
    out[:7] = y[7:]
    out[7:] = np.linalg.solve(big, right)[:7]
    return out


def chain(count: int, length: float, mass: float, g: float) -> Slope:
    """Uniform rods in a row, by their angles: a dense mass matrix, factored by LAPACK."""
    n = np.arange(count)
    reach = count - np.maximum(n[:, None], n[None, :]) - 0.5
    reach[n, n] = count - n - 2.0 / 3.0
    reach *= mass * length**2
    pull = mass * g * length * (count - n - 0.5)

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        angle, rate = y[:count], y[count:]
        c, s = np.cos(angle), np.sin(angle)
        inertia = reach * (np.outer(c, c) + np.outer(s, s))
        turned = reach * (np.outer(s, c) - np.outer(c, s))
        out = np.empty(2 * count)
        out[:count] = rate
        out[count:] = np.linalg.solve(inertia, -turned @ (rate * rate) - pull * c)
        return out

    return slope
