"""Forces in a horizontal engine: Khurmi and Gupta, *Theory of Machines*, example 15.7."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

import mbody
from mbody.quantities import deg, rpm
from validation import slider_crank
from validation.case import Row, Source
from validation.slider_crank import AT_ONCE, ON_THE_WAY

__all__ = ["build", "rows"]

BOOK = Source("khurmi_15_7", "Khurmi and Gupta, Theory of Machines, ex. 15.7, print")
EXACT = Source("khurmi_15_7", "Khurmi ex. 15.7, closed form in quadruple precision")
CLOSED_FORM = Source(
    "khurmi_15_7", "statics of piston and rod with −m a, validation/slider_crank.py"
)
SERIES = Source("khurmi_15_7", "Khurmi ex. 15.7, the book's formula, computed here")
NATURE = Source("khurmi_15_7", "principle of virtual work")

r, l = 0.3, 1.2  # m
theta = deg(60.0)
MASS = 250.0  # kg, of piston and crosshead
GAS = 0.35e6 * math.pi / 4.0 * 0.5**2  # N, pressure difference on the bore

#: Speed [rad/s] and gas load [N]: exact, and rounded as the printed answers are.
GIVEN = {"exact": (rpm(250.0), GAS), "printed": (26.2, 68730.0)}


class Forces(NamedTuple):
    """On the piston [N]; T is the turning moment on the crank [N·m]."""

    FL: Any
    FP: Any
    FN: Any
    FQ: Any
    FT: Any
    T: Any


NAMES = Forces(
    "gas load FL",
    "net force on the pin FP",
    "crosshead force FN",
    "thrust in the rod FQ",
    "force across the crank FT",
    "turning moment T",
)
UNITS = Forces("N", "N", "N", "N", "N", "N·m")

REFERENCE = {
    "FL": 68722.33929727672,
    "FP": 49440.03314215192,
    "FN": 10964.137240613323,
    "FQ": 50641.18069840082,
    "T": 14489.51798560644,
}
PRINT = {"FL": "68.73", "FQ": "50.62", "FT": "48.28", "T": "14.484"}  # kN, kN·m


def build(numbers: str = "exact") -> mbody.Mechanism:
    """Crank and rod without mass; the gas drives the piston towards the crank."""
    omega, gas = GIVEN[numbers]
    engine = mbody.makers.slider_crank(r, l, masses=(0.0, 0.0, MASS), start=theta, speed=omega)
    engine.add(mbody.Force("gas", "slider.B", gas, angle=math.pi))
    return engine


def measured(run: mbody.Solution) -> Forces:
    """What mbody finds; FL is the part of the pin's force that the gas makes."""
    pin, crank_pin = run.reaction("B", on="rod"), run.reaction("A", on="crank")
    angle = run["crank"].angle
    return Forces(
        FL=-run.breakdown("B", on="rod")["gas"].fx,
        FP=-pin.fx,
        FN=run.reaction("guide", on="slider").fy,
        FQ=pin.magnitude,
        FT=crank_pin.fy * np.cos(angle) - crank_pin.fx * np.sin(angle),
        T=-run.effort("motor"),
    )


def by_hand(gas: Any, a: Any, angle: Any) -> Forces:
    """The book's statics: FL and −m a act on the piston, the rod carries along itself only."""
    phi = np.arcsin(r / l * np.sin(angle))
    FP = gas + MASS * a  # a > 0 away from the crank
    FQ = FP / np.cos(phi)
    FT = FQ * np.sin(angle + phi)
    return Forces(gas, FP, FP * np.tan(phi), np.abs(FQ), FT, FT * r)


def rows() -> list[Row]:
    ours = measured(mbody.kinetostatics(build()))
    return [*quadruple(ours), *whole_turn(), *series(ours), *printed(ours)]


def quadruple(ours: Forces) -> list[Row]:
    """The exact numbers at 60°."""
    return [
        EXACT.relative(
            getattr(NAMES, name), getattr(ours, name), exact, *AT_ONCE, getattr(UNITS, name)
        )
        for name, exact in REFERENCE.items()
    ]


def whole_turn() -> list[Row]:
    """361 positions, with the same pressure all round."""
    run = mbody.kinetostatics(build(), turn="motor", instants=361)
    angle = theta + np.linspace(0.0, 2.0 * np.pi, 361)
    a = slider_crank.exact(r, l, angle, GIVEN["exact"][0]).a
    found = [
        CLOSED_FORM.relative(f"{name}, whole turn", ours, hand, *ON_THE_WAY, unit)
        for name, ours, hand, unit in zip(NAMES, measured(run), by_hand(GAS, a, angle), UNITS)
    ]
    tolerance, reason = ON_THE_WAY
    work = run.checks.virtual_work
    return [*found, NATURE.absolute("virtual work, whole turn", work, 0.0, tolerance, reason)]


def lacking(omega: float) -> Forces:
    """What the forces lack by the two terms of the book's acceleration: they are linear in it."""
    return by_hand(0.0, slider_crank.left_out(r, l, theta, omega)[1], theta)


def series(ours: Forces) -> list[Row]:
    """The book's two terms, with exact speed and gas load."""
    omega, gas = GIVEN["exact"]
    book = by_hand(gas, slider_crank.two_terms(r, l, theta, omega)[1], theta)
    reason = (
        "first term left out of the piston's acceleration, (sin θ / n)⁶ (the one before vanishes "
        "at 60°), over 1 − 2 (sin θ / n)² for all later ones"
    )
    cause = "the book ends the series: a = −ω² r (cos θ + cos 2θ / n), n = l/r = 4"
    every = zip(NAMES, ours, book, lacking(omega), UNITS)
    return [
        SERIES.absolute(f"{name}, two terms", mine, two, lacks, reason, unit, cause)
        for name, mine, two, lacks, unit in every
        if name != NAMES.FL
    ]


def printed(exact: Forces) -> list[Row]:
    """The print, beside mbody with the rounded speed and gas load that it fits."""
    gas = BOOK.printed(
        NAMES.FL,
        exact.FL / 1e3,
        PRINT["FL"],
        "kN",
        cause="0.35 × π/4 × 500² is 68 722 N, which the book has as 68.73 kN",
    )
    ours = measured(mbody.kinetostatics(build("printed")))
    lacks = lacking(GIVEN["printed"][0])
    reason = "one unit of the last digit printed, and what the book's two terms lack"
    cause = (
        "the print fits two terms with 26.2 rad/s for 26.18 and 68 730 N for 68 722 N; ours has "
        "this speed and gas load here, the exact ones above"
    )
    found = [gas]
    for name in ("FQ", "FT", "T"):
        text = PRINT[name]
        unit = "k" + getattr(UNITS, name)
        tolerance = 10.0 ** -len(text.partition(".")[2]) + getattr(lacks, name) / 1e3
        mine = getattr(ours, name) / 1e3
        found.append(
            BOOK.printed(
                f"{getattr(NAMES, name)}, book's numbers",
                mine,
                text,
                unit,
                tolerance=tolerance,
                reason=reason,
                cause=cause,
            )
        )
    return found
