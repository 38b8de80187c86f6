"""Slider-crank at 45° and 300 rpm: Khurmi and Gupta, *Theory of Machines*, example 8.1."""

from __future__ import annotations

import math

import mbody
from mbody.quantities import deg, rpm
from validation import slider_crank
from validation.case import Row, Source
from validation.slider_crank import Motion

__all__ = ["build", "rows"]

BOOK = Source("khurmi_8_1", "Khurmi and Gupta, Theory of Machines, ex. 8.1, print")
EXACT = Source("khurmi_8_1", "Khurmi ex. 8.1, closed form in quadruple precision")
CLOSED_FORM = Source("khurmi_8_1", "closed form of the loop, validation/slider_crank.py")

r, l = 0.15, 0.6  # m
theta, omega = deg(45.0), rpm(300.0)

REFERENCE = Motion(
    psi=10.182067403158902,
    psi1=5.642466973930921,
    psi2=-171.54515606539752,
    x=0.6966166077288679,
    v=-3.930636202601928,
    a=-105.28946671025093,
)


def build() -> mbody.Mechanism:
    """Crank 150 mm, rod 600 mm, 45° from the dead centre, 300 rpm."""
    return mbody.makers.slider_crank(r, l, start=theta, speed=omega)


def rows() -> list[Row]:
    run = mbody.kinematics(build())
    middle = math.hypot(run["rod"].ax[0], run["rod"].ay[0])
    return [
        BOOK.printed("acceleration of the rod's middle", middle, "117", "m/s²"),
        *slider_crank.compare(EXACT, run, REFERENCE),
        *slider_crank.whole_turn(CLOSED_FORM, build(), r, l, theta, omega),
    ]
