"""Slider-crank at 45° and 300 rpm: Khurmi and Gupta, *Theory of Machines*, example 8.1."""

from __future__ import annotations

import math

import mbody
from validation.case import Row, Source

__all__ = ["build", "rows"]

BOOK = Source("khurmi_8_1", "Khurmi and Gupta, Theory of Machines, ex. 8.1, print")
EXACT = Source("khurmi_8_1", "Khurmi ex. 8.1, closed form in quadruple precision")

REFERENCE = {  # ψ is the angle that the rod leans below the line of stroke
    "ψ": (10.182067403158902, "deg"),
    "ψ′": (5.642466973930921, "rad/s"),
    "ψ″": (-171.54515606539752, "rad/s²"),
    "x": (0.6966166077288679, "m"),
    "v": (-3.930636202601928, "m/s"),
    "a": (-105.28946671025093, "m/s²"),
}


def build() -> mbody.Mechanism:
    """Crank 150 mm, rod 600 mm, 45° from the dead centre, 300 rpm."""
    return mbody.makers.slider_crank(0.15, 0.6, start=mbody.deg(45.0), speed=mbody.rpm(300.0))


def rows() -> list[Row]:
    run = mbody.kinematics(build())
    rod, slider = run["rod"], run["slider"]
    ours = {
        "ψ": -math.degrees(rod.angle[0]),
        "ψ′": -rod.omega,
        "ψ″": -rod.alpha,
        "x": slider.x,
        "v": slider.vx,
        "a": slider.ax,
    }
    reason = "rounding 2.2e-16 × condition of the loop, below 100"
    middle = math.hypot(rod.ax[0], rod.ay[0])
    return [
        BOOK.printed("acceleration of the rod's middle", middle, "117", "m/s²"),
        *(
            EXACT.relative(name, ours[name], exact, 1e-13, reason, unit)
            for name, (exact, unit) in REFERENCE.items()
        ),
    ]
