"""Porter governor: balls of 6 kg, a sleeve of 18 kg, all arms 0.3 m and pivoted on the axis."""

from __future__ import annotations

import math

import numpy as np

import mbody
from mbody.engineering import equilibrium_curve
from mbody.model.loads import CentrifugalField
from validation.case import Row, Source
from validation.spinning import AXIS, SOLVED, balanced, rpm

__all__ = ["build", "rows"]

CASE = "porter_governor"
EXACT = Source(CASE, "statics of ball and sleeve: ω² = (m + M) g / (m h), h² = l² − r²")
CURVE = Source(CASE, "the same at every point of a curve")

m, M, l, g = 6.0, 18.0, 0.3, 9.81  # kg, m, m/s²

NEWTON = 1e-11, "Newton ends at 1e-13 of a radian, times a few for the slope of the curve"

#: Radius of the balls [m] and speed [rpm].
REFERENCE = {0.2: 126.5008315355888, 0.25: 146.89354367518698}


def build(
    r: float = 0.2, *, sleeve: float = M, arm: float = l, held: bool = True
) -> mbody.Mechanism:
    """Arms O-B with the balls at B, links B-A, a sleeve that slides on the axis.

    A driver may hold the balls at radius r; θ leans the right arm outwards.
    """
    theta = math.asin(r / arm)
    machine = mbody.Mechanism("Porter governor")
    machine.add(mbody.Body("sleeve", mass=sleeve, spread="point"))
    for side, sense in (("l", -1.0), ("r", 1.0)):
        machine.add(
            mbody.Body(
                f"arm_{side}",
                mass=m,
                spread="point",
                cg=(0.0, -arm),
                points={"B": (0.0, -arm)},
                guess=sense * theta,
            ),
            mbody.Body(f"link_{side}", points={"A": (0.0, -arm)}, guess=-sense * theta),
            mbody.Revolute(f"O_{side}", "ground", f"arm_{side}"),
            mbody.Revolute(f"B_{side}", f"arm_{side}.B", f"link_{side}"),
            mbody.Revolute(f"A_{side}", f"link_{side}.A", "sleeve"),
        )
    upright = mbody.Marker("sleeve", (0.0, 0.0), math.pi / 2)
    machine.add(
        mbody.Prismatic("guide", AXIS, upright),
        mbody.Gravity("gravity", y=-g),
        CentrifugalField("field", AXIS, speed=12.0),
    )
    if held:
        machine.add(mbody.AngleDriver("theta", "arm_r", theta))
    return machine


def rows() -> list[Row]:
    lifts = math.sqrt((m + M) * g / (m * l))
    return [*speeds(), *hanging(lifts), *curve(lifts)]


def speeds() -> list[Row]:
    """At which the balls stay at their radius, and where they stay at that speed."""
    found = []
    for r, turns in REFERENCE.items():
        speed = balanced(build(r))
        found.append(EXACT.relative(f"speed at r = {r:g} m", rpm(speed), turns, *SOLVED, "rpm"))
        free = mbody.assemble(build(r, held=False)).with_values({"field.speed": speed})
        rest = mbody.equilibrium(free).stable[0]
        there = abs(float(rest.solution.point("arm_r.B").x[0]))
        found.append(EXACT.relative(f"radius at {turns:.1f} rpm", there, r, *NEWTON, "m"))
    return found


def hanging(lifts: float) -> list[Row]:
    """Below the least speed the arms hang; the speed from which they lift is given."""
    slow = mbody.assemble(build(held=False)).with_values({"field.speed": 0.9 * lifts})
    rest = mbody.equilibrium(slow).stable
    (told,) = [note for note in rest[0].notes if "lifts above" in note]
    speed = float(told.partition("lifts above ")[2].split()[0])
    return [
        EXACT.absolute(
            "stable positions below that speed", len(rest), 1, 0.0, "a count: hanging, no other"
        ),
        EXACT.relative(
            "speed from which it lifts, as told",
            speed,
            lifts,
            5e-6,
            "told with six digits",
            "rad/s",
        ),
    ]


def curve(lifts: float) -> list[Row]:
    """From a high speed down to where the arms hang, and up again on the other side."""
    path = equilibrium_curve(build(0.25, held=False), "field.speed", (20.0, 5.0))
    h = -path.point("arm_r.B").y
    n = path.crossings[0]
    away = np.abs(path["arm_r"].angle) > 1e-3
    small = 1e-9, "relative corrections of 1e-12, over the least slope of the curve"
    square = (m + M) * g / (m * h)
    return [
        CURVE.relative("ω² along the curve", path.values**2, square, *small, "rad²/s²"),
        CURVE.relative(
            "where the hanging position crosses it",
            path.values[n],
            lifts,
            1e-8,
            "between points at which the stiffness is told from zero; quadratic in their distance",
            "rad/s",
        ),
        CURVE.absolute(
            "points of it that are not stable",
            (~path.stable[away]).sum(),
            0,
            0.0,
            "0 or 1 a point; at the crossing it is neutral",
        ),
    ]
