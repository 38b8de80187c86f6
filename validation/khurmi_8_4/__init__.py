"""Four-bar PQRS, speeds and accelerations: Khurmi and Gupta, *Theory of Machines*, example 8.4."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import mbody
from mbody.quantities import deg
from validation.case import Row, Source
from validation.slider_crank import AT_ONCE, ON_THE_WAY

__all__ = ["build", "rows"]

BOOK = Source("khurmi_8_4", "Khurmi and Gupta, Theory of Machines, ex. 8.4, print")
EXACT = Source("khurmi_8_4", "Khurmi ex. 8.4, closed form in quadruple precision")
CLOSED_FORM = Source("khurmi_8_4", "closed form of the loop, in complex numbers")

PQ, QR, RS, PS = 62.5, 175.0, 112.5, 200.0  # mm
START, OMEGA = deg(60.0), -10.0

REFERENCE = {  # θ [deg], ω [rad/s], α [rad/s²]
    "QR": (19.46342317351269, 1.9800260174879891, 23.367569844067802),
    "RS": (91.91045806925771, -3.7870723433279547, 46.1434599004326),
}
PRINT = {"QR": ("1.9", "23.43"), "RS": ("3.79", "47.1")}  # |ω|, |α|
UNITS = ("deg", "rad/s", "rad/s²")


class Motion(NamedTuple):
    """θ [deg], ω [rad/s] and α [rad/s²] of QR and of RS."""

    QR: tuple[Any, Any, Any]
    RS: tuple[Any, Any, Any]


def build() -> mbody.Mechanism:
    """PQ at 60° from PS turns at 10 rad/s clockwise."""
    return mbody.makers.four_bar(PQ, QR, RS, PS, start=START, speed=OMEGA, units="mm-N-s")


def closed_form(theta: Any, book_speeds: tuple[float, float] | None = None) -> Motion:
    """The open branch; accelerations from the speeds of QR and RS, or from other ones."""
    q = PQ * np.exp(1j * np.asarray(theta))
    diagonal = np.abs(PS - q)
    opening = np.arccos((QR**2 + diagonal**2 - RS**2) / (2.0 * QR * diagonal))
    qr = QR * np.exp(1j * (np.angle(PS - q) + opening))
    rs = q + qr - PS
    # i ω_PQ q + i ω_QR qr = i ω_RS rs: the part across rs has no ω_RS, that across qr no ω_QR
    across = (qr * rs.conj()).imag
    w_qr = -OMEGA * (q * rs.conj()).imag / across
    w_rs = OMEGA * (q * qr.conj()).imag / -across
    if book_speeds:
        w_qr, w_rs = book_speeds
    # i α_QR qr − i α_RS rs = k, the normal accelerations
    k = OMEGA**2 * q + w_qr**2 * qr - w_rs**2 * rs
    a_qr, a_rs = -(k * rs.conj()).real / across, -(k * qr.conj()).real / across
    angles = np.degrees(np.angle(qr)), np.degrees(np.angle(rs))
    return Motion((angles[0], w_qr, a_qr), (angles[1], w_rs, a_rs))


def measured(run: mbody.Solution) -> Motion:
    """What mbody finds."""
    links = run["coupler"], run["rocker"]
    return Motion(*((np.degrees(link.angle), link.omega, link.alpha) for link in links))


def rows() -> list[Row]:
    ours = measured(mbody.kinematics(build()))
    found = [
        EXACT.relative(f"{letter} of {name}", value, exact, *AT_ONCE, unit)
        for name, link in zip(Motion._fields, ours)
        for letter, value, exact, unit in zip("θωα", link, REFERENCE[name], UNITS)
    ]
    return [*found, *whole_turn(), *printed(ours)]


def whole_turn() -> list[Row]:
    """361 positions beside the closed form."""
    run = mbody.kinematics(build(), turn="motor", instants=361)
    ours, exact = measured(run), closed_form(START - np.linspace(0.0, 2.0 * np.pi, 361))
    return [
        CLOSED_FORM.relative(f"{letter} of {name}, whole turn", mine, right, *ON_THE_WAY, unit)
        for name, link, hand in zip(Motion._fields, ours, exact)
        for letter, mine, right, unit in zip("θωα", link, hand, UNITS)
    ]


def printed(ours: Motion) -> list[Row]:
    """The print is drawn, and gives magnitudes only: α is a length read off to 0.1 m/s²."""
    exact, drawn = closed_form(START), closed_form(START, (1.9, -3.79))
    speeds = "graphical: speeds are lengths read off a drawn polygon"
    accelerations = "graphical, too, and its polygon starts from ω = 1.9 and 3.79"
    found = []
    for name, length in zip(Motion._fields, (QR, RS)):
        (_, w, a), (omega, alpha) = getattr(ours, name), PRINT[name]
        found.append(BOOK.printed(f"ω of {name}", np.abs(w), omega, "rad/s", cause=speeds))
        moved = abs(getattr(drawn, name)[2] - getattr(exact, name)[2])
        found.append(
            BOOK.printed(
                f"α of {name}",
                np.abs(a),
                alpha,
                "rad/s²",
                tolerance=0.1 / (length / 1e3) + moved,
                reason="a reading to 0.1 m/s², by the length, and what ω = 1.9 and 3.79 change",
                cause=accelerations,
            )
        )
    return found
