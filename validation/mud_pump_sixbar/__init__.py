"""Drilling mud pump as a six-bar, AE = 18 in: the crank turns right round (Ferdowsi lecture)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import mbody
from mbody import engineering
from mbody.quantities import rpm
from validation.bell_crank import AB, BC, DF, EC, ED, SixBar
from validation.case import EPS, Row, Source
from validation.indicator import BAR, Liquid, nodes, reached

__all__ = ["build", "rows"]

CIRCLES = Source("mud_pump_sixbar", "circles that meet, validation/bell_crank.py")
TRIANGLES = Source("mud_pump_sixbar", "triangles AEC with crank and coupler in line")
POWER = Source("mud_pump_sixbar", "power of inertia and liquid, by Fourier series")
WORK = Source("mud_pump_sixbar", "work of the crank = work on the liquid, over a turn")

# inches, pounds force, seconds
AE = 18.0
omega = rpm(65.0)
face = math.pi / 4.0 * 7.0**2
back = face - math.pi / 4.0 * 2.5**2
ENDS = ((face, -1.0), (back, 1.0))  # area, and the sense in which h falls with x


def at_E(reach: float) -> float:
    """Angle AEC with AC given."""
    return math.acos((AE**2 + EC**2 - reach**2) / (2.0 * AE * EC))


OUT, IN = at_E(BC + AB), at_E(BC - AB)
HALF = ED * math.sin((OUT - IN) / 2.0)  # of the stroke
LIFT = ED * (1.0 - math.cos((OUT - IN) / 2.0)) / 2.0
REACH = math.sqrt(DF**2 - LIFT**2)
SIX_BAR = SixBar(AE, math.pi / 2.0 + (OUT + IN) / 2.0, LIFT - ED)
MUD = Liquid(2.0 * BAR, 100.0 * BAR, 2.2e4 * BAR, 3.0, 2.0 * HALF)

#: Of both loops, in their sizes: EC and BC meet at 41 deg at least, which loses 1/sin twice.
CONDITION = 10
STIFF = CONDITION * (AE + DF) * MUD.K / MUD.c / MUD.delivery
SWEEP = (
    CONDITION * 1e-12,
    "of the peak; a whole turn accepts a last correction of 1e-12 × condition of the loops, below "
    "10",
)
SERIES = (
    1e-9 + STIFF * 1e-12,
    "of the peak; two derivatives of a series of 720 × condition of the loops, 360² × 2.2e-16 × "
    "10, and the sweep's 1e-12 × condition × size/clearance × K/delivery",
)
QUADRATURE = (
    10.0 * STIFF * EPS,
    "10 roundings of 2.2e-16 × condition × size/clearance × K/delivery; Gauss's rule of 20 between "
    "all openings of valves and dead centres leaves less",
)


def build() -> mbody.Mechanism:
    """The model of the gallery."""
    return mbody.gallery.load("mud_pump_sixbar")


def rate(values: Any) -> Any:
    """Derivative by the crank angle of a periodic history over an even turn, by Fourier series."""
    waves = np.fft.rfft(values)
    return np.fft.irfft(1j * np.arange(waves.size) * waves, len(values))


def ram(theta: float) -> float:
    """x of the ram from E."""
    return float(SIX_BAR.places(np.array([theta])).F[0].real) - AE


def dead_centres() -> tuple[float, float]:
    """Crank angles with crank and coupler in one line: stretched, and folded [rad]."""
    stretched = math.acos((AE**2 + (BC + AB) ** 2 - EC**2) / (2.0 * AE * (BC + AB)))
    folded = math.acos((AE**2 + (BC - AB) ** 2 - EC**2) / (2.0 * AE * (BC - AB)))
    return stretched, math.pi + folded


def instants() -> np.ndarray:
    """Angles of a turn from one dead centre on at which a valve opens or the ram turns back."""
    begin, middle = dead_centres()
    end = begin + 2.0 * math.pi
    found = [begin, middle, end]
    falling, growing = (begin, middle), (middle, end)
    if ram(begin) < ram(middle):
        falling, growing = growing, falling
    for _, sense in ENDS:
        for h, half in zip(MUD.opens, (falling, growing) if sense > 0 else (growing, falling)):
            x = REACH + sense * (h - MUD.c - HALF)
            found.append(reached(ram, x, *half))
    return np.unique(found)


def push(x: Any, v: Any) -> Any:
    """Force of the liquid on the ram along x."""
    total = 0.0
    for area, sense in ENDS:
        h = MUD.c + HALF + sense * (x - REACH)
        # the ends of the stroke are reached to rounding
        p = MUD.pressure(np.clip(h, MUD.c, MUD.H), sense * v > 0.0)
        total = total + sense * area * p
    return total


def rows() -> list[Row]:
    return [*whole_turn(), *extremes(), *balance()]


def whole_turn() -> list[Row]:
    """Points and the turning moment, 720 positions."""
    run = mbody.kinetostatics(build(), turn="motor", instants=721)
    theta = 2.0 * math.pi * np.arange(720) / 720.0
    p = SIX_BAR.places(theta)
    found = []
    for name, hand in (("coupler.C", p.C), ("bell.D", p.D), ("ram", p.F)):
        point = run.point(name)
        pairs = ("x", point.x, hand.real), ("y", point.y, hand.imag)
        found += [
            CIRCLES.relative(f"{name}, {axis}", ours[:-1], right, *SWEEP, "in")
            for axis, ours, right in pairs
        ]
    x1 = rate(p.F.real)
    torque = omega**2 * rate(SIX_BAR.energy(p, rate)) - push(p.F.real - AE, x1) * x1
    effort = run.effort("motor")[:-1]
    return [*found, POWER.relative("turning moment", effort, torque, *SERIES, "lbf·in")]


def extremes() -> list[Row]:
    """Swing and stroke at the dead centres, and that the crank turns right round."""
    at = np.array(dead_centres())
    run = mbody.kinematics(build(), drive={"motor": (at, omega)})
    swing = float(np.ptp(run["bell"].angle))
    low, high = mbody.driver_range(build())
    return [
        TRIANGLES.relative("swing of the bell-crank", swing, OUT - IN, *SWEEP, "rad"),
        TRIANGLES.relative("stroke", float(np.ptp(run["ram"].x)), 2.0 * HALF, *SWEEP, "in"),
        TRIANGLES.absolute(
            "speed of the ram at both",
            run["ram"].vx,
            0.0,
            SWEEP[0] * AE * omega,
            f"of size × ω; {SWEEP[1]}",
            "in/s",
        ),
        TRIANGLES.absolute(
            "turns without a dead centre",
            float(math.isinf(low) and math.isinf(high)),
            1.0,
            0.0,
            "Grashof: 6 + 18 < 12 + 18, the crank is the shortest",
        ),
    ]


def balance() -> list[Row]:
    """Work and flow of a turn: at Gauss's places between all openings of valves."""
    angle, weight = nodes(instants())
    run = mbody.kinetostatics(build(), drive={"motor": (angle, omega)})
    crank = float(weight @ run.effort("motor"))
    liquid = (face + back) * MUD.work()
    diagrams = [engineering.indicator(run, "cylinder", opposite=side) for side in (False, True)]
    power = float(weight @ sum(diagram.power for diagram in diagrams)) / omega
    flow = float(weight @ sum(diagram.delivery for diagram in diagrams)) / omega
    delivered = (face + back) * (MUD.opens[0] - MUD.c)
    return [
        WORK.relative("work of the crank, a turn", crank, liquid, *QUADRATURE, "lbf·in"),
        WORK.relative("∮ p dV by mbody's indicator", power, liquid, *QUADRATURE, "lbf·in"),
        WORK.absolute(
            "difference",
            crank - liquid,
            0.0,
            1e-9 * liquid,
            "1e-9 of the work; above, why it is less",
            "lbf·in",
        ),
        WORK.relative("delivered in a turn", flow, delivered, *QUADRATURE, "in³"),
    ]
