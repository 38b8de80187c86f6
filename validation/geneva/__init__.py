"""External Geneva wheels of 3 to 10 slots: peaks of velocity and acceleration of the wheel."""

from __future__ import annotations

import math

import numpy as np

import mbody
from validation.case import EPS, Row, Source

__all__ = ["build", "rows"]

TABLE = Source("geneva", "table of external Geneva wheels, printed to nine digits")
EXACT = Source("geneva", "closed form φ = atan(R sin θ / (1 − R cos θ)), R = sin(π/N)")

omega = 2.0  # rad/s
#: By number of slots: greatest velocity by ω, greatest acceleration by ω², the crank's angle there
#: from the line of centres [deg], acceleration by ω² where the pin enters.
REFERENCE = {
    3: ("6.464101615", "31.39242847", "4.758213635", "1.732050808"),
    4: ("2.414213562", "5.406981035", "11.463744883", "1.000000000"),
    5: ("1.425919998", "2.298828240", "17.571443887", "0.726542528"),
    6: ("1.000000000", "1.349637276", "22.903061873", "0.577350269"),
    8: ("0.619914404", "0.699756984", "31.642488390", "0.414213562"),
    10: ("0.447213595", "0.464843872", "38.491223222", "0.324919696"),
}
ROUNDING = (
    1e-11,
    "of the peak; a position accepts a last correction of 1e-12 × condition of the pin in its "
    "slot, below 10 where the wheel of three slots is fastest",
)
#: Where a computed function is greatest: within a rounding of the peak it is flat.
FLAT = (
    math.degrees(math.sqrt(2.0 * EPS)),
    "near its peak a function falls by half the square of the distance: two roundings of 2.2e-16 "
    "hide √(2 × 2.2e-16) rad",
)


def build(slots: int = 4) -> mbody.Mechanism:
    """A pin on a crank in the slot of a wheel, a unit apart; the crank begins on the line of
    centres.
    """
    machine = mbody.Mechanism(f"Geneva wheel of {slots} slots", ground={"W": (1.0, 0.0)})
    machine.add(
        mbody.Body("crank", points={"pin": (math.sin(math.pi / slots), 0.0)}),
        mbody.Body("wheel", mass=1.0, inertia=0.2, guess=math.pi),
        mbody.Revolute("O", "ground", "crank"),
        mbody.Revolute("W", "ground.W", "wheel"),
        mbody.PinSlot("slot", "wheel", "crank.pin"),
        mbody.AngleDriver("motor", "crank", mbody.laws.ConstantSpeed(0.0, omega)),
    )
    return machine


def by_formula(R: float, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity by ω and acceleration by ω² of the wheel, against the crank's sense."""
    below = 1.0 + R * R - 2.0 * R * np.cos(theta)
    return R * (np.cos(theta) - R) / below, R * (R * R - 1.0) * np.sin(theta) / below**2


def rows() -> list[Row]:
    return [row for slots in REFERENCE for row in of_wheel(slots)]


def of_wheel(slots: int) -> list[Row]:
    """All rows of one wheel."""
    system = mbody.assemble(build(slots))
    R = math.sin(math.pi / slots)
    enters = math.pi / 2.0 - math.pi / slots
    # cos θ where the acceleration is greatest: its derivative is zero
    half = (1.0 + R * R) / (4.0 * R)
    worst = math.acos(math.sqrt(half * half + 2.0) - half)
    theta = np.unique([*np.linspace(0.0, enters, 200), worst])
    run = mbody.kinetostatics(system, drive={"motor": (theta, omega, 0.0)})
    v, a = -run["wheel"].omega / omega, -run["wheel"].alpha / omega**2
    fast, most, where, entry = REFERENCE[slots]
    name = f"N = {slots}: "
    wanted = by_formula(R, theta)
    torque = 0.2 * run["wheel"].alpha * run["wheel"].omega / omega
    return [
        TABLE.printed(name + "greatest velocity", np.abs(v).max(), fast),
        TABLE.printed(name + "greatest acceleration", np.abs(a).max(), most),
        TABLE.printed(
            name + "crank there",
            np.degrees(theta[np.abs(a).argmax()]),
            where,
            "deg",
            tolerance=FLAT[0],
            reason=FLAT[1],
            cause="the table has the place of the greatest of computed values, not of the root",
        ),
        TABLE.printed(name + "acceleration at entry", abs(a[-1]), entry),
        EXACT.relative(name + "velocity", v, wanted[0], *ROUNDING),
        EXACT.relative(name + "acceleration", a, wanted[1], *ROUNDING),
        EXACT.relative(name + "torque by power", run.effort("motor"), torque, *ROUNDING, "N·m"),
    ]
