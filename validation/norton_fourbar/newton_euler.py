"""Norton's example 11-3 by hand: closed-form kinematics, then nine equations in nine unknowns.

Nothing here comes from mbody. Letters are the book's: links a, b, c, d; θ₂, θ₃, θ₄; R₁₂ the place
of the joint of links 1 and 2 from the mass centre of link 2, in axes that do not turn (LNCS).
Everything is an array over positions (n,).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

Array = np.ndarray

a, b, c, d = 5.0, 15.0, 10.0, 19.0  # in
G = 386.0  # in/s²
#: Of links 2, 3, 4 [blob]: their weights in lbf by g, and as the book rounds them.
MASS = {"exact": (1.5 / G, 7.7 / G, 5.8 / G), "printed": (0.004, 0.020, 0.015)}
INERTIA = (0.4, 1.5, 0.8)  # lbf·in·s²
CG = ((3.0, 30.0), (9.0, 45.0), (5.0, 0.0))  # in @ deg, link axes
RP, FP, T4 = (3.0, 100.0), (80.0, 330.0), 120.0  # in @ deg, lbf @ deg, lbf·in

#: The nine unknowns, in the order of eq. 11.9.
UNKNOWNS = ("F12x", "F12y", "F32x", "F32y", "F43x", "F43y", "F14x", "F14y", "T12")


class Motion(NamedTuple):
    """Angles, speeds and accelerations of links 2, 3, 4, and of their mass centres (x, y)."""

    theta: tuple[Array, Array, Array]
    omega: tuple[Array, Array, Array]
    alpha: tuple[Array, Array, Array]
    acceleration: tuple[Array, Array, Array]


def direction(angle: Array) -> Array:
    """Unit vectors (2, n)."""
    return np.array([np.cos(angle), np.sin(angle)])


def place(u: Array, length: float, degrees: float) -> Array:
    """(2, n) at length @ degrees from the unit vectors u (2, n) of a link."""
    x, y = length * math.cos(math.radians(degrees)), length * math.sin(math.radians(degrees))
    return np.array([x * u[0] - y * u[1], y * u[0] + x * u[1]])


def motion(theta2: Array, omega2: Array, alpha2: Array) -> Motion:
    """Freudenstein's equation for the angles of the open branch, then the loop differentiated."""
    t2, w2, p2 = np.broadcast_arrays(*np.atleast_1d(theta2, omega2, alpha2))
    cos2, sin2 = np.cos(t2), np.sin(t2)

    # eq. 4.10: θ₄ from A, B, C
    k1, k2, k3 = d / a, d / c, (a * a - b * b + c * c + d * d) / (2.0 * a * c)
    A, B, C = cos2 - k1 - k2 * cos2 + k3, -2.0 * sin2, k1 - (k2 + 1.0) * cos2 + k3
    t4 = 2.0 * np.arctan2(-B - np.sqrt(B * B - 4.0 * A * C), 2.0 * A)
    # eq. 4.13: θ₃ from D, E, F
    k4, k5 = d / b, (c * c - d * d - a * a - b * b) / (2.0 * a * b)
    D, E, F = cos2 - k1 + k4 * cos2 + k5, -2.0 * sin2, k1 + (k4 - 1.0) * cos2 + k5
    t3 = 2.0 * np.arctan2(-E - np.sqrt(E * E - 4.0 * D * F), 2.0 * D)

    # eq. 6.18: speeds
    w3 = a * w2 / b * np.sin(t4 - t2) / np.sin(t3 - t4)
    w4 = a * w2 / c * np.sin(t2 - t3) / np.sin(t4 - t3)

    # eq. 7.12: accelerations
    A, B, D, E = c * np.sin(t4), b * np.sin(t3), c * np.cos(t4), b * np.cos(t3)
    C = a * p2 * sin2 + a * w2**2 * cos2 + w3**2 * E - w4**2 * D
    F = a * p2 * cos2 - a * w2**2 * sin2 - w3**2 * B + w4**2 * A
    p3 = (C * D - A * F) / (A * E - B * D)
    p4 = (C * E - B * F) / (A * E - B * D)

    def turning(r: Array, omega: Array, alpha: Array) -> Array:
        return alpha * np.array([-r[1], r[0]]) - omega**2 * r

    u2, u3, u4 = direction(t2), direction(t3), direction(t4)
    G2, G3, G4 = (place(u, *at) for u, at in zip((u2, u3, u4), CG))
    a2, a4 = turning(G2, w2, p2), turning(G4, w4, p4)
    a3 = turning(a * u2, w2, p2) + turning(G3, w3, p3)
    return Motion((t2, t3, t4), (w2, w3, w4), (p2, p3, p4), (a2, a3, a4))


def equations(m: Motion, masses: str = "exact") -> tuple[Array, Array]:
    """A (n, 9, 9) and b (n, 9) of eq. 11.9, A x = b."""
    u2, u3, u4 = (direction(t) for t in m.theta)
    G2, G3, G4 = (place(u, *at) for u, at in zip((u2, u3, u4), CG))
    R12, R32 = -G2, a * u2 - G2
    R23, R43 = -G3, b * u3 - G3
    R34, R14 = c * u4 - G4, -G4
    P = place(u3, *RP)
    force = place(np.array([[1.0], [0.0]]), *FP)
    (m2, m3, m4), (I2, I3, I4) = MASS[masses], INERTIA
    a2, a3, a4 = m.acceleration
    p2, p3, p4 = m.alpha

    n = len(m.theta[0])
    A, right = np.zeros((n, 9, 9)), np.zeros((n, 9))
    F12, F32, F43, F14, T12 = 0, 2, 4, 6, 8

    # link 2: F12 + F32 = m2 a2;  T12 + R12 × F12 + R32 × F32 = I2 α2
    for F, R in ((F12, R12), (F32, R32)):
        put(A, 0, F, R, +1.0)
    A[:, 2, T12] = 1.0
    right[:, 0:3] = np.array([*(m2 * a2), I2 * p2]).T

    # link 3: F43 − F32 + FP = m3 a3;  R43 × F43 − R23 × F32 + RP × FP = I3 α3
    put(A, 3, F43, R43, +1.0)
    put(A, 3, F32, R23, -1.0)
    moment = P[0] * force[1] - P[1] * force[0]
    right[:, 3:6] = np.array([*(m3 * a3 - force), I3 * p3 - moment]).T

    # link 4: F14 − F43 = m4 a4;  R14 × F14 − R34 × F43 + T4 = I4 α4
    put(A, 6, F14, R14, +1.0)
    put(A, 6, F43, R34, -1.0)
    right[:, 6:9] = np.array([*(m4 * a4), I4 * p4 - T4]).T
    return A, right


def put(A: Array, row: int, column: int, R: Array, sign: float) -> None:
    """A force at R in the three equations of a link: x, y, and R × F = Rx Fy − Ry Fx."""
    A[:, row, column] = A[:, row + 1, column + 1] = sign
    A[:, row + 2, column], A[:, row + 2, column + 1] = -sign * R[1], sign * R[0]


def forces(m: Motion, masses: str = "exact") -> Array:
    """The nine unknowns (9, n)."""
    A, right = equations(m, masses)
    return np.linalg.solve(A, right[..., None])[..., 0].T
