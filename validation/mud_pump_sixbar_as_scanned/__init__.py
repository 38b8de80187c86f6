"""The mud pump's six-bar as scanned, AE = 8 in: the crank cannot turn (Ferdowsi lecture)."""

from __future__ import annotations

import math
import re

import numpy as np

import mbody
from mbody.quantities import rpm
from validation.bell_crank import AB, BC, EC, ED, SixBar
from validation.case import EPS, Row, Source
from validation.indicator import BAR

__all__ = ["build", "rows"]

TRIANGLE = Source("mud_pump_sixbar_as_scanned", "triangle ABE with E–C–B folded: arccos(2/3)")
CIRCLES = Source("mud_pump_sixbar_as_scanned", "circles that meet, validation/bell_crank.py")
POWER = Source("mud_pump_sixbar_as_scanned", "power of inertia and pressure, by Chebyshev series")

AE = 8.0
omega = rpm(65.0)
THRUST = 100.0 * BAR * math.pi / 4.0 * 7.0**2  # lbf, against the x axis
SIX_BAR = SixBar(AE, math.radians(-120.0), -0.9 * ED)
TOGGLE = math.degrees(math.acos((AB**2 + AE**2 - (BC - EC) ** 2) / (2.0 * AB * AE)))

AT_ONCE = (200 * EPS, "20 roundings of 2.2e-16 × condition of the loops, below 10")
SERIES = (
    1e-10,
    "of a series of 80 terms over 60 deg, differentiated twice at its middle: 80² × 2.2e-16 × the "
    "square of 2 / 60 deg × condition of the loops, below 10",
)


def build() -> mbody.Mechanism:
    """The model of the gallery."""
    return mbody.gallery.load("mud_pump_sixbar_as_scanned")


def rows() -> list[Row]:
    return [*limits(), *one_instant()]


def limits() -> list[Row]:
    """Dead centres of the crank, from `reach` and as the error of a whole turn says them."""
    low, high = np.degrees(list(mbody.driver_range(build(), "crank")))
    rounding = 1e-10, "1e-10 deg: x is flat at its turning point, rounding of 360 deg remains"
    found = [
        TRIANGLE.absolute("lower dead centre", low, TOGGLE, *rounding, "deg"),
        TRIANGLE.absolute("upper dead centre", high - 360.0, -TOGGLE, *rounding, "deg"),
    ]
    try:
        mbody.kinetostatics(build(), turn="motor")
    except mbody.SolveError as error:
        said = re.search(r"from ([\d.]+) deg to [\d.]+ deg \((-[\d.]+) deg\)", str(error))
        told = [float(x) for x in said.groups()] if said else [math.nan, math.nan]
        for quantity, ours, right in zip(("lower", "upper"), told, (TOGGLE, -TOGGLE)):
            reason = "as the sentence prints it, to 1e-6 deg"
            found.append(
                TRIANGLE.absolute(f"{quantity} end in the error", ours, right, 1e-6, reason, "deg")
            )
    return found


def one_instant() -> list[Row]:
    """Points and torque with the crank at 90 deg."""
    run = mbody.kinetostatics(build())
    chebyshev = np.polynomial.chebyshev.Chebyshev
    size, half = 80, math.radians(30.0)
    theta = math.pi / 2.0 + half * np.cos(math.pi * (np.arange(size) + 0.5) / size)

    def rate(values: np.ndarray) -> np.ndarray:
        series = chebyshev.fit(
            theta, values, size - 1, domain=[math.pi / 2 - half, math.pi / 2 + half]
        )
        return np.asarray(series.deriv()(theta))

    p = SIX_BAR.places(theta)
    energy = SIX_BAR.energy(p, rate)
    middle = [math.pi / 2.0]
    domain = [math.pi / 2.0 - half, math.pi / 2.0 + half]
    by_angle, way = (
        float(chebyshev.fit(theta, values, size - 1, domain=domain).deriv()(middle)[0])
        for values in (energy, p.F.real)
    )
    torque = omega**2 * by_angle + THRUST * way
    here = SIX_BAR.places(np.array(middle))
    found = []
    for name, hand in (("coupler.C", here.C), ("bell.D", here.D), ("ram", here.F)):
        point = run.point(name)
        found += [
            CIRCLES.relative(f"{name}, x", point.x, hand.real, *AT_ONCE, "in"),
            CIRCLES.relative(f"{name}, y", point.y, hand.imag, *AT_ONCE, "in"),
        ]
    return [
        *found,
        POWER.relative("turning moment", run.effort("motor"), torque, *SERIES, "lbf·in"),
    ]
