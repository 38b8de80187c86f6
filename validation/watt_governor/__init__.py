"""Watt governor: balls on arms pivoted on the axis, a sleeve without mass."""

from __future__ import annotations

import math

import mbody
from validation import porter_governor
from validation.case import Row, Source
from validation.spinning import SOLVED, balanced, rpm

__all__ = ["build", "rows"]

CASE = "watt_governor"
BOOK = Source(CASE, "the textbooks' formula ω² = g/h, g = 9.81 m/s²")

l = 0.4  # m, any length from the greatest height on

#: Height of the cone below the pivot [m] and speed [rpm].
REFERENCE = {
    0.1: 94.58143213010682,
    0.2: 66.87917203353373,
    0.3: 54.60661530065749,
    0.3464101615137755: 50.81718153791091,
    0.3264101615137755: 52.35088772892697,
}


def build(h: float = 0.3, *, held: bool = True) -> mbody.Mechanism:
    """Porter's without the mass of the sleeve."""
    return porter_governor.build(math.sqrt(l * l - h * h), sleeve=0.0, arm=l, held=held)


def rows() -> list[Row]:
    found = []
    for h, turns in REFERENCE.items():
        speed = balanced(build(h))
        found.append(BOOK.relative(f"speed at h = {h:.5g} m", rpm(speed), turns, *SOLVED, "rpm"))
    speed = REFERENCE[0.2] * math.pi / 30.0
    free = mbody.assemble(build(0.2, held=False)).with_values({"field.speed": speed})
    rest = mbody.equilibrium(free).stable[0]
    height = -float(rest.solution.point("arm_r.B").y[0])
    return [
        *found,
        BOOK.relative(
            f"height at {REFERENCE[0.2]:.2f} rpm", height, 0.2, *porter_governor.NEWTON, "m"
        ),
    ]
