"""The in-line slider-crank in closed form, and the series of two terms that textbooks use for it.

The crank r turns about O at constant ω and the rod l leads the slider along x. θ is the crank's
angle from the dead centre with the slider farthest away, ψ the angle by which the rod leans below
the line of stroke: l sin ψ = r sin θ. Nothing here comes from mbody but `measured`, which reads it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import mbody
from validation.case import EPS, Row, Source

#: Of the loop's equations without units, all round the turn: 4.6 with the rods of these cases.
CONDITION = 6
AT_ONCE = (20 * CONDITION * EPS, "20 roundings of 2.2e-16 × condition of the loop, below 6")
#: The last correction of the positions is not in Φ_q any more: rates and forces are off by it.
ON_THE_WAY = (
    CONDITION * 1e-12,
    "of the peak; a whole turn accepts a last correction of 1e-12 × condition of the loop, below 6",
)


class Motion(NamedTuple):
    """The rod's angle ψ [deg] and its rates, the slider's place, speed and acceleration along x."""

    psi: Any
    psi1: Any
    psi2: Any
    x: Any
    v: Any
    a: Any


LETTERS = ("ψ", "ψ′", "ψ″", "x", "v", "a")
UNITS = ("deg", "rad/s", "rad/s²", "m", "m/s", "m/s²")


def exact(r: float, l: float, theta: Any, omega: float) -> Motion:
    """The loop r sin θ = l sin ψ, x = r cos θ + l cos ψ, differentiated twice."""
    sine, cosine = np.sin(theta), np.cos(theta)
    s = r / l * sine
    c = np.sqrt(1.0 - s * s)
    psi1 = r / l * omega * cosine / c
    psi2 = (psi1**2 * s - r / l * omega**2 * sine) / c
    x = r * cosine + l * c
    v = -r * omega * sine - l * psi1 * s
    a = -r * omega**2 * cosine - l * (psi2 * s + psi1**2 * c)
    return Motion(np.degrees(np.arcsin(s)), psi1, psi2, x, v, a)


def two_terms(r: float, l: float, theta: float, omega: float) -> tuple[float, float]:
    """The books' v and a: cos ψ = √(1 − u) is taken as 1 − u/2, u = (sin θ / n)², n = l/r."""
    n = l / r
    v = -omega * r * (np.sin(theta) + np.sin(2.0 * theta) / (2.0 * n))
    a = -(omega**2) * r * (np.cos(theta) + np.cos(2.0 * theta) / n)
    return v, a


def left_out(r: float, l: float, theta: float, omega: float) -> tuple[float, float]:
    """Bounds of what `two_terms` lacks in v and a.

    √(1 − u) goes on with −u²/8 − u³/16 − … The first one decides, or where its derivative
    vanishes, as that of a at 60°, the second one. At the angles of our cases each later one is less
    than 2u of the one before.
    """
    s, c, n = np.sin(theta), np.cos(theta), l / r

    def term(k: int, coefficient: float) -> np.ndarray:
        """|d/dt| and |d²/dt²| of l × coefficient × u^k."""
        rate = 2 * k * omega * s ** (2 * k - 1) * c
        second = 2 * k * omega**2 * ((2 * k - 1) * s ** (2 * k - 2) * c**2 - s ** (2 * k))
        return np.abs([rate, second]) * l * coefficient / n ** (2 * k)

    v, a = np.maximum(term(2, 1 / 8), term(3, 1 / 16)) / (1.0 - 2.0 * (s / n) ** 2)
    return v, a


def measured(run: mbody.Solution) -> Motion:
    """The same of mbody's `slider_crank`."""
    rod, slider = run["rod"], run["slider"]
    return Motion(-np.degrees(rod.angle), -rod.omega, -rod.alpha, slider.x, slider.vx, slider.ax)


def compare(
    source: Source,
    run: mbody.Solution,
    reference: Motion,
    where: str = "",
    allowed: tuple[float, str] = AT_ONCE,
) -> list[Row]:
    """A row for each letter."""
    return [
        source.relative(f"{letter}{where}", ours, right, *allowed, unit)
        for letter, ours, right, unit in zip(LETTERS, measured(run), reference, UNITS)
    ]


def whole_turn(
    source: Source, machine: mbody.Mechanism, r: float, l: float, start: float, omega: float
) -> list[Row]:
    """361 positions beside the closed form."""
    run = mbody.kinematics(machine, turn="motor", instants=361)
    theta = start + np.linspace(0.0, 2.0 * np.pi, 361)
    return compare(source, run, exact(r, l, theta, omega), ", whole turn", ON_THE_WAY)
