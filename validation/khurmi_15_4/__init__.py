"""Slider-crank at 40° and 180 rpm: Khurmi and Gupta, *Theory of Machines*, example 15.4."""

from __future__ import annotations

import mbody
from mbody.quantities import deg, rpm
from validation import slider_crank
from validation.case import Row, Source
from validation.slider_crank import Motion

__all__ = ["build", "rows"]

EXACT = Source("khurmi_15_4", "Khurmi ex. 15.4, closed form in quadruple precision")
CLOSED_FORM = Source("khurmi_15_4", "closed form of the loop, validation/slider_crank.py")
SERIES = Source("khurmi_15_4", "Khurmi ex. 15.4, the book's formula, computed here")

r, l = 0.3, 1.5  # m
theta, omega = deg(40.0), rpm(180.0)

REFERENCE = Motion(
    psi=7.386244977073661,
    psi1=2.912083828669266,
    psi2=-44.96010674060034,
    x=1.7173664136676088,
    v=-4.196433719368738,
    a=-85.59885626716209,
)


def build() -> mbody.Mechanism:
    """Crank 300 mm, rod 1.5 m, 40° from the inner dead centre, 180 rpm."""
    return mbody.makers.slider_crank(r, l, start=theta, speed=omega)


def rows() -> list[Row]:
    run = mbody.kinematics(build())
    return [
        *slider_crank.compare(EXACT, run, REFERENCE),
        *slider_crank.whole_turn(CLOSED_FORM, build(), r, l, theta, omega),
        *series(slider_crank.measured(run)),
    ]


def series(ours: Motion) -> list[Row]:
    """The book's two terms are too few: what they lack is the tolerance."""
    reason = "first term left out, (sin θ / n)⁴, over 1 − 2 (sin θ / n)² for all later ones"
    cause = "the book ends the series: v = −ω r (sin θ + sin 2θ / 2n), a likewise, n = l/r = 5"
    v, a = slider_crank.two_terms(r, l, theta, omega)
    lacks = slider_crank.left_out(r, l, theta, omega)
    return [
        SERIES.absolute("v, two terms", ours.v, v, lacks[0], reason, "m/s", cause),
        SERIES.absolute("a, two terms", ours.a, a, lacks[1], reason, "m/s²", cause),
    ]
