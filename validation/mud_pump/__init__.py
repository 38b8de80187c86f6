"""Drilling mud pump: a duplex of double-acting cylinders, cranks at 90 deg (Ferdowsi lecture)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

import mbody
from mbody import engineering
from mbody.quantities import rpm
from validation import slider_crank
from validation.case import EPS, Row, Source
from validation.indicator import BAR, Liquid, nodes, reached
from validation.slider_crank import CONDITION

__all__ = ["build", "rows"]

BY_HAND = Source("mud_pump", "statics of each ram, rod and crank with −m a, recomputed here")
WORK = Source("mud_pump", "work of the crank = work on the liquid, over a turn")
FLOW = Source("mud_pump", "volumes between the valves' openings")
FRAME = Source("mud_pump", "shaking force = −Σ m a_G, weights and frame in equilibrium")
ENERGY = Source("mud_pump", "turning moment by hand, integrated between its crossings")

# inches, pounds force, seconds
r, l, omega = 6.0, 18.0, rpm(65.0)
face = math.pi / 4.0 * 6.5**2
back = face - math.pi / 4.0 * 2.5**2
g = 9.80665 / 0.0254
ROD, RAM, SHAFT = 330.0 / g, 260.0 / g, 2500.0 / g  # blob
I_ROD, CG = 40.0, l / 3.0
MUD = Liquid(2.0 * BAR, 150.0 * BAR, 2.2e4 * BAR, 4.0, 2.0 * r)
#: Head end beyond the ram, rod end towards the crank: area, and the sense in which h falls with x.
ENDS = ((face, -1.0), (back, 1.0))
BEHIND = (0.0, math.pi / 2.0)  # the second crank

#: An error of x makes K/h of it in the pressure.
STIFF = CONDITION * (l + r) * MUD.K / MUD.c / MUD.delivery
ON_THE_WAY = (
    STIFF * 1e-12,
    "of the peak; a whole turn accepts a last correction of 1e-12 × condition of the loop, below 6 "
    "× (l + r)/clearance × K/delivery, as stiff as the liquid is",
)
QUADRATURE = (
    10.0 * STIFF * EPS,
    "10 roundings of 2.2e-16 × stiffness of the liquid as above; Gauss's rule of 20 between all "
    "openings of valves and dead centres leaves less",
)


def build() -> mbody.Mechanism:
    """The model of the gallery."""
    return mbody.gallery.load("mud_pump")


class Unit(NamedTuple):
    """One cylinder with its ram and rod: place of the ram; forces on it by the rod B, on the rod by
    the crank A, on the ram by the guide; the torque that the crank needs for it; the flow
    delivered; −m a.
    """

    x: Any
    B: tuple[Any, Any]
    A: tuple[Any, Any]
    guide: Any
    torque: Any
    flow: Any
    shaking: tuple[Any, Any]


def unit(theta: Any) -> Unit:
    """One cylinder with its crank at θ, as the statics of each link."""
    _, psi1, psi2, x, v, a = slider_crank.exact(r, l, theta, omega)
    sine = r / l * np.sin(theta)
    c, s = np.sqrt(1.0 - sine**2), -sine  # of the rod's angle, −ψ
    ax, ay = r * np.cos(theta), r * np.sin(theta)
    gx, gy = CG * c, CG * s
    agx = -(omega**2) * ax + psi2 * gy - psi1**2 * gx
    agy = -(omega**2) * ay - psi2 * gx - psi1**2 * gy
    push, flow = 0.0, 0.0
    for area, sense in ENDS:
        h = MUD.c + r + sense * (x - l)
        p = MUD.pressure(h, sense * v > 0.0)
        push = push + sense * area * p
        flow = flow + np.where((p == MUD.delivery) & (sense * v < 0.0), -area * sense * v, 0.0)
    bx = RAM * a - push
    # moments on the rod about A
    turning = -I_ROD * psi2 + ROD * (gx * agy - gy * agx) + gx * ROD * g
    by = (l * s * bx - turning) / (l * c)
    fx, fy = ROD * agx + bx, ROD * (agy + g) + by
    torque = ax * fy - ay * fx
    shaking = -RAM * a - ROD * agx, -ROD * agy
    return Unit(x, (bx, by), (fx, fy), RAM * g - by, torque, flow, shaking)


def together(theta: Any) -> tuple[Unit, Unit]:
    """Both cylinders with the first crank at θ."""
    first, second = (unit(theta - behind) for behind in BEHIND)
    return first, second


def torque(theta: Any) -> Any:
    """What the crankshaft needs."""
    return sum(each.torque for each in together(theta))


def place(theta: float) -> float:
    """x of a ram."""
    return r * math.cos(theta) + math.sqrt(l * l - (r * math.sin(theta)) ** 2)


def instants() -> np.ndarray:
    """Angles of a turn at which a valve opens or a ram turns back, both ends included [rad]."""
    found = [0.0, math.pi]
    halves = (0.0, math.pi), (math.pi, 2.0 * math.pi)  # x falls in the first
    for _, sense in ENDS:
        for h, half in zip(MUD.opens, halves if sense > 0.0 else halves[::-1]):
            found.append(reached(place, l + sense * (h - MUD.c - r), *half))
    every = np.concatenate([np.array(found) + behind for behind in BEHIND]) % (2.0 * math.pi)
    return np.append(np.unique(every), 2.0 * math.pi)


def rows() -> list[Row]:
    return [*whole_turn(), *balance(), *frame(), *flywheel()]


def whole_turn() -> list[Row]:
    """Forces at every pin over the turn, 361 positions."""
    run = mbody.kinetostatics(build(), turn="motor", instants=361)
    both = together(np.linspace(0.0, 2.0 * math.pi, 361))
    found = []
    for n, hand in enumerate(both, 1):
        wrist, crank = run.reaction(f"B{n}", on=f"ram{n}"), run.reaction(f"A{n}", on=f"rod{n}")
        pairs = [
            ("wrist pin, x", wrist.fx, hand.B[0]),
            ("wrist pin, y", wrist.fy, hand.B[1]),
            ("crank pin, x", crank.fx, hand.A[0]),
            ("crank pin, y", crank.fy, hand.A[1]),
            ("crosshead", run.reaction(f"guide{n}", on=f"ram{n}").fy, hand.guide),
        ]
        found += [BY_HAND.relative(f"{what} {n}", a, b, *ON_THE_WAY, "lbf") for what, a, b in pairs]
    main = run.reaction("O", on="crank")
    x, y = (sum(hand.A[k] for hand in both) for k in (0, 1))
    found += [
        BY_HAND.relative("main bearing, x", main.fx, x, *ON_THE_WAY, "lbf"),
        BY_HAND.relative("main bearing, y", main.fy, y + SHAFT * g, *ON_THE_WAY, "lbf"),
        BY_HAND.relative(
            "turning moment",
            run.effort("motor"),
            sum(hand.torque for hand in both),
            *ON_THE_WAY,
            "lbf·in",
        ),
    ]
    return [*found, *flow(run, sum(hand.flow for hand in both))]


def diagrams(run: mbody.Solution) -> list[engineering.Indicator]:
    """Of the four chambers."""
    sides = [(f"cylinder{n}", side) for n in (1, 2) for side in (False, True)]
    return [engineering.indicator(run, name, opposite=side) for name, side in sides]


def flow(run: mbody.Solution, hand: np.ndarray) -> list[Row]:
    """What all chambers deliver, and by how much it pulsates."""
    ours = sum(diagram.delivery for diagram in diagrams(run))
    mean = 2.0 * (face + back) * (MUD.opens[0] - MUD.c) * omega / (2.0 * math.pi)
    pulsation = [float(np.ptp(part)) / mean for part in (ours, hand)]
    return [
        FLOW.relative("flow", ours, hand, *ON_THE_WAY, "in³/s"),
        FLOW.relative("pulsation, (max − min)/mean", *pulsation, *ON_THE_WAY),
    ]


def balance() -> list[Row]:
    """Work and flow of a turn: at Gauss's places between all openings of valves."""
    angle, weight = nodes(instants())
    run = mbody.kinetostatics(build(), drive={"motor": (angle, omega)})
    crank = float(weight @ run.effort("motor"))
    areas = 2.0 * (face + back)
    liquid = areas * MUD.work()
    power = float(weight @ sum(diagram.power for diagram in diagrams(run))) / omega
    volume = float(weight @ sum(diagram.delivery for diagram in diagrams(run))) / omega
    delivered = areas * (MUD.opens[0] - MUD.c)
    reason = "1e-9 of the work; above, why it is less"
    return [
        WORK.relative("work of the crank, a turn", crank, liquid, *QUADRATURE, "lbf·in"),
        WORK.relative("∮ p dV by mbody's indicator", power, liquid, *QUADRATURE, "lbf·in"),
        WORK.relative(
            "∮ p dV by Gauss's rule in V", liquid, areas * MUD.work_exact(), *QUADRATURE, "lbf·in"
        ),
        WORK.absolute("difference", crank - liquid, 0.0, 1e-9 * liquid, reason, "lbf·in"),
        FLOW.relative("delivered in a turn", volume, delivered, *QUADRATURE, "in³"),
    ]


def frame() -> list[Row]:
    """Shaking force by the reactions, beside the accelerations by hand."""
    run = mbody.kinetostatics(build(), turn="motor", instants=73)
    found = engineering.shaking_force(run, "ground.O")
    both = together(np.linspace(0.0, 2.0 * math.pi, 73))
    x, y = (sum(hand.shaking[k] for hand in both) for k in (0, 1))
    weight = (SHAFT + 2.0 * (ROD + RAM)) * g
    # the rams press on their guides, the motor turns against the frame
    moment = sum(-hand.x * hand.guide - hand.torque for hand in both)
    allowed = 1e-11 * float(run.reaction("O").magnitude.max())
    reason = (
        "1e-11 of the greatest reaction, what a sweep accepts of equilibrium; pressures cancel in "
        "the frame, whatever they are"
    )
    return [
        FRAME.absolute("shaking force, x", found.fx, x, allowed, reason, "lbf"),
        FRAME.absolute("shaking force and weight, y", found.fy, y - weight, allowed, reason, "lbf"),
        FRAME.absolute(
            "shaking moment",
            found.moment,
            moment,
            allowed * (l + r),
            f"{reason}; × the way to the wrist pins",
            "lbf·in",
        ),
    ]


def flywheel() -> list[Row]:
    """Fluctuation of energy of the turn, and the flywheel for 2 % of the speed."""
    count = 1441
    run = mbody.kinetostatics(build(), turn="motor", instants=count)
    found = engineering.fluctuation(run)
    work = 2.0 * (face + back) * MUD.work_exact()
    mean = work / (2.0 * math.pi)
    kinks = instants()
    fine = np.unique(np.concatenate([kinks, np.linspace(0.0, 2.0 * math.pi, 2001)]))
    over = torque(fine) - mean
    at = np.flatnonzero(over[:-1] * over[1:] < 0.0)
    crossed = [reached(torque, mean, fine[k], fine[k + 1]) for k in at]
    ends = np.unique(np.concatenate([kinks, crossed]))
    angle, weight = nodes(ends)
    parts = (weight * (torque(angle) - mean)).reshape(len(ends) - 1, -1).sum(axis=1)
    energy = np.concatenate([[0.0], np.cumsum(parts)])
    span = float(np.ptp(energy))
    step = 2.0 * math.pi / (count - 1)
    before, after = torque(kinks[1:-1] - 1e-6), torque(kinks[1:-1] + 1e-6)
    here = torque(kinks[1:-1])
    jumps = np.abs(before - 2.0 * here + after) / 1e-6
    allowed = float(jumps.sum()) * step**2 / 8.0
    reason = (
        "spacing² / 8 × jumps of the slope where valves open: what a corner costs the trapezoidal "
        "rule, and a spline no more"
    )
    return [
        ENERGY.absolute("mean torque", found.mean, mean, allowed, reason, "lbf·in"),
        ENERGY.absolute(
            "fluctuation of energy", found.fluctuation, span, allowed, reason, "lbf·in"
        ),
        ENERGY.absolute(
            "flywheel for C_s = 0.02",
            engineering.flywheel(run, 0.02),
            span / (0.02 * omega**2),
            allowed / (0.02 * omega**2),
            f"{reason}, by C_s ω²",
            "lbf·in·s²",
        ),
    ]
