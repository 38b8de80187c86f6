"""Four-bar PQRS, speeds and accelerations: Khurmi and Gupta, *Theory of Machines*, example 8.4."""

from __future__ import annotations

import math

import mbody
from validation.case import Row, Source

__all__ = ["build", "rows"]

BOOK = Source("khurmi_8_4", "Khurmi and Gupta, Theory of Machines, ex. 8.4, print")
EXACT = Source("khurmi_8_4", "Khurmi ex. 8.4, closed form in quadruple precision")

PQ, QR, RS, PS = 62.5, 175.0, 112.5, 200.0  # mm

REFERENCE = {  # θ [deg], ω [rad/s], α [rad/s²]
    "QR": (19.46342317351269, 1.9800260174879891, 23.367569844067802),
    "RS": (91.91045806925771, -3.7870723433279547, 46.1434599004326),
}


def build() -> mbody.Mechanism:
    """PQ at 60° from PS turns at 10 rad/s clockwise."""
    return mbody.makers.four_bar(PQ, QR, RS, PS, start=mbody.deg(60.0), speed=-10.0, units="mm-N-s")


def rows() -> list[Row]:
    run = mbody.kinematics(build())
    QR_, RS_ = run["coupler"], run["rocker"]
    found = []
    reason = "rounding 2.2e-16 × condition of the loop, below 100"
    for name, body in (("QR", QR_), ("RS", RS_)):
        ours = (math.degrees(body.angle[0]), body.omega[0], body.alpha[0])
        for letter, value, exact, unit in zip(
            "θωα", ours, REFERENCE[name], ("deg", "rad/s", "rad/s²")
        ):
            found.append(EXACT.relative(f"{letter} of {name}", value, exact, 1e-13, reason, unit))
    # the print is graphical, magnitudes only: α = (tangential acceleration read off) / length
    read = "graphical: {} m/s² read off a polygon to 0.1 m/s², divided by {} m; {} of it"
    return [
        *found,
        BOOK.printed("ω of QR", abs(QR_.omega), "1.9", "rad/s"),
        BOOK.printed("ω of RS", abs(RS_.omega), "3.79", "rad/s"),
        BOOK.printed(
            "α of QR",
            abs(QR_.alpha),
            "23.43",
            "rad/s²",
            tolerance=0.1 / 0.175,
            reason=read.format(4.1, 0.175, "one unit"),
        ),
        BOOK.printed(
            "α of RS",
            abs(RS_.alpha),
            "47.1",
            "rad/s²",
            tolerance=0.2 / 0.1125,
            reason=read.format(5.3, 0.1125, "two units, for the polygon starts from ω = 1.9 too,"),
        ),
    ]
