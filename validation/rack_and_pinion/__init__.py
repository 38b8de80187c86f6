"""A pinion drives a rack against a cutting force: motion, tooth force and torque."""

from __future__ import annotations

import math

import numpy as np

import mbody
from validation.case import Row, Source

__all__ = ["build", "rows"]

CLOSED_FORM = Source("rack_and_pinion", "x = r θ; F = m r α + F_cut; T = F r + I α")
STEERED = Source("rack_and_pinion", "a rack held still: the pinion rolls along it, v = r ω")

r, mass, inertia = 0.03, 4.0, 2e-3  # m, kg, kg·m²
cut = 150.0  # N
swing, rate = 0.8, 9.0  # rad, rad/s
ROUNDING = (
    1e-12,
    "of the peak; a position accepts a last correction of 1e-12 × condition, below 6",
)


def build() -> mbody.Mechanism:
    """The pinion is above the rack and swings; the rack slides on the ground."""
    machine = mbody.Mechanism("rack and pinion", ground={"O": (0.0, r)})
    machine.add(
        mbody.Body("rack", mass=mass),
        mbody.Body("pinion", mass=1.0, inertia=inertia),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Prismatic("guide", "ground", "rack"),
        mbody.RackPinion("mesh", "rack", "pinion", radius=r),
        mbody.AngleDriver("motor", "pinion", mbody.laws.Harmonic(0.0, swing, rate)),
        mbody.Force("cut", "rack", cut, angle=math.pi),
    )
    return machine


def rolling() -> mbody.Mechanism:
    """The rack is the ground; a carriage guides the pinion along it."""
    machine = mbody.Mechanism("pinion on a fixed rack")
    machine.add(
        mbody.Body("carriage", mass=mass),
        mbody.Body("pinion", mass=1.0, inertia=inertia),
        mbody.Prismatic("guide", mbody.Marker("ground", (0.0, r)), "carriage"),
        mbody.Revolute("O", "carriage", "pinion"),
        mbody.RackPinion("mesh", "ground", "pinion", radius=r),
        mbody.AngleDriver("motor", "pinion", mbody.laws.Harmonic(0.0, swing, rate)),
        mbody.Force("cut", "carriage", cut, angle=math.pi),
    )
    return machine


def rows() -> list[Row]:
    t = np.linspace(0.0, 2.0 * math.pi / rate, 181)
    angle, alpha = swing * np.sin(rate * t), -swing * rate**2 * np.sin(rate * t)
    run = mbody.kinetostatics(build(), t=t)
    tooth = mass * r * alpha + cut
    other = mbody.kinetostatics(rolling(), t=t)
    # seen from the rack the pinion turns the other way along: what it pushes is itself and the
    # carriage, x = −r θ
    push = (mass + 1.0) * -r * alpha + cut
    return [
        CLOSED_FORM.relative("travel of the rack", run["rack"].x, r * angle, *ROUNDING, "m"),
        CLOSED_FORM.relative("its acceleration", run["rack"].ax, r * alpha, *ROUNDING, "m/s²"),
        CLOSED_FORM.relative(
            "tooth force on the rack", run.reaction("mesh", on="rack").fx, tooth, *ROUNDING, "N"
        ),
        CLOSED_FORM.relative(
            "torque", run.effort("motor"), r * tooth + inertia * alpha, *ROUNDING, "N·m"
        ),
        STEERED.relative("travel of the pinion", other["pinion"].x, -r * angle, *ROUNDING, "m"),
        STEERED.relative("tooth force", other.reaction("mesh").fx, push, *ROUNDING, "N"),
        STEERED.relative(
            "torque", other.effort("motor"), -r * push + inertia * alpha, *ROUNDING, "N·m"
        ),
    ]
