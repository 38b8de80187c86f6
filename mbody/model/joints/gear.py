"""Gear pair: two wheels that turn without slip where their pitch circles touch."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.decorators import inline
from mbody.core.lanes import select_le, sincos
from mbody.errors import ModelError
from mbody.model.driver import TurnRow
from mbody.model.element import number_field
from mbody.model.joints._teeth import ToothedJoint
from mbody.model.primitives import ConstraintPrimitive, between, constraint_physics
from mbody.quantities.formula import NumberField

if TYPE_CHECKING:
    from mbody.model.driver import PoseReader
    from mbody.model.element import Numbers, Value


@dataclass(frozen=True)
class Gear(ToothedJoint):
    """Gear pair, external or internal, on any carrier: pitch circles about the places on i and j
    roll on each other.

    Other joints keep the distance of the centres, on the ground or on a carrier that turns itself;
    no more data is needed. With signed radii, R = R_i + R_j, the line of centres has the direction
    ψ = (R_i θ_i + R_j θ_j)/R + phase, so that Φ = n(ψ) · d = 0, d from the centre on i to that on
    j: one row. The reaction is the tangential tooth force on j at the pitch point.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The centres; their `angle` fields count to the angles of the wheels.
    radius_i, radius_j : float
        Of the pitch circles [length].
    internal : bool
        Whether the greater one is a ring with teeth inside.
    phase : float
        Direction of the line of centres, from i to j, when both wheels are at 0 [rad]. It sets
        which teeth meet; 0 will do, and the wheels take their angles accordingly.

    efficiency, friction, pressure_angle, module : float, optional
        What the teeth lose, and how they press the wheels apart, or a wheel to the middle of its
        ring; see `ToothedJoint`.
    backlash, restitution : float, optional
        Play between the teeth, and e of their impacts; see `ToothedJoint`.

    Notes
    -----
    The reaction of a gear with a pressure angle has the radial part F tan α. It does no work, and
    bearings carry it beside the rest.

    Examples
    --------
    >>> Gear("mesh", "sun", "planet", radius_i=2.0, radius_j=1.0).rows
    'l'
    """

    radius_i: NumberField = number_field("length", 0.0, sign="positive")
    radius_j: NumberField = number_field("length", 0.0, sign="positive")
    internal: bool = False
    phase: NumberField = number_field("angle", 0.0)
    rows = "l"
    spaced = True
    counts_turns = True

    def _check(self) -> None:
        super()._check()
        self._check_switches("internal")
        if self.internal and self.radius_i == self.radius_j:
            raise ModelError(
                f"'{self.name}': a ring of {self.radius_i:g} and a wheel of {self.radius_j:g} "
                "cannot mesh: the ring must be the greater one",
                self.name,
            )

    def radii(self, at: Any) -> tuple[Value, Value]:
        """Signed radii (R_i, R_j) [length]."""
        return signed(at[f"{self.name}.radius_i"], at[f"{self.name}.radius_j"], self.internal)

    def apart(self, at: Any) -> Any:
        """The distance of the centres of wheels that mesh."""
        return sum(self.radii(at))

    def curvatures(self, at: Any) -> tuple[Value, Value]:
        """Inverses of the signed radii [1/length]."""
        ri, rj = self.radii(at)
        return 1.0 / ri, 1.0 / rj

    def radial(self, at: Numbers) -> tuple[ConstraintPrimitive, float]:
        """The distance of the centres: wheels press apart, a wheel in a ring to its middle."""
        arms = [*at.arm(self, "i"), *at.arm(self, "j")]
        row = ConstraintPrimitive("distance", self.i.body, self.j.body, "l", arms, active_set=True)
        return row, 1.0 if self.internal else -1.0

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; see `without_slip`."""
        return [without_slip(self, at, *self.radii(at))]

    def shifted(self, at: Numbers, by: Value) -> ConstraintPrimitive:
        """The row of `without_slip`, the phase turned by that arc."""
        ri, rj = self.radii(at)
        row = without_slip(self, at, ri, rj)
        *others, phase = row.parameters
        return replace(row, parameters=[*others, phase + by / (ri + rj)])

    def turn_row(self, at: Numbers, pose: PoseReader) -> TurnRow:
        """Count of whole revolutions, by `turns_of_wheels`."""
        return turns_of_wheels(self, at, pose)

    @property
    def meshes(self) -> bool:
        """Always."""
        return True

    def lets_turn(self, body: str) -> bool:
        """Either wheel."""
        return True

    def reaction_point(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> Any:
        """The pitch point, from the centre on j."""
        return pitch_point(self.radii(at)[1], d)


def signed(ri: Value, rj: Value, internal: bool) -> tuple[Value, Value]:
    """Radii (R_i, R_j) from each centre towards the other wheel's: that of a wheel in a ring is
    negative, for it is touched on the far side.

    >>> [float(radius) for radius in signed(3.0, 1.0, True)]
    [3.0, -1.0]
    """
    if not internal:
        return ri, rj
    ring = 2.0 * np.greater(ri, rj) - 1.0
    return ring * ri, -ring * rj


def without_slip(element: Any, at: Numbers, ri: Value, rj: Value) -> ConstraintPrimitive:
    """The row of two wheels that do not slip; parameters are both arms, the parts of both angles in
    the direction of the line of centres, and the phase.
    """
    i, j = ri / (ri + rj), rj / (ri + rj)
    phase = at[f"{element.name}.phase"] + i * at.angle(element, "i") + j * at.angle(element, "j")
    parameters = [*at.arm(element, "i"), *at.arm(element, "j"), i, j, phase]
    return ConstraintPrimitive("gear", element.i.body, element.j.body, "l", parameters)


def turns_of_wheels(wheels: Any, at: Numbers, pose: PoseReader) -> TurnRow:
    """R_i/R θ_i + R_j/R θ_j + phase − ψ, with signed radii."""
    (ix, iy), (jx, jy) = (pose.place(wheels, side) for side in "ij")
    i, j = wheels.bodies
    beta_i, beta_j = float(at.angle(wheels, "i")), float(at.angle(wheels, "j"))
    ri, rj = (float(radius) for radius in wheels.radii(at))
    ci, cj = ri / (ri + rj), rj / (ri + rj)
    phase = float(at[f"{wheels.name}.phase"])
    direction = math.atan2(jy - iy, jx - ix)
    # the line of centres by less than half a turn from where it is when both wheels are at 0
    direction = phase + math.remainder(direction - phase, 2.0 * math.pi)
    left = ci * (pose.angle(i) + beta_i) + cj * (pose.angle(j) + beta_j) + phase - direction
    return TurnRow({i: ci, j: cj}, left)


def pitch_point(rj: Value, d: Any) -> Any:
    """From the centre on j to where the wheels touch."""
    return tuple(-rj * part / np.hypot(*d) for part in d)


@constraint_physics()
@inline
def gear(i, j, p, f):
    """Φ = n·d, n normal to ψ = p₄θ_i + p₅θ_j + p₆, turning at w = p₄ω_i + p₅ω_j."""
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    s, c = sincos(p[4] * i[2] + p[5] * j[2] + p[6])
    w = p[4] * i[7] + p[5] * j[7]
    # half a turn of ψ further other teeth meet; this sign keeps λ the same force there
    facing = select_le(c * dx + s * dy, 0.0, -1.0, 1.0)
    c, s = facing * c, facing * s
    across, along = c * dy - s * dx, c * dx + s * dy
    # ∂Φ/∂θ = n·∂d/∂θ − (u·d) ∂ψ/∂θ
    block_i = (s, -c, -s * piy - c * pix - p[4] * along, 0.0, 0.0, 0.0)
    block_j = (-s, c, s * pjy + c * pjx - p[5] * along, 0.0, 0.0, 0.0)
    # Φ̈ = n·d̈ − 2w u·ḋ − w² n·d − ẇ u·d
    gamma = w * w * across + 2.0 * w * (c * dvx + s * dvy) - (c * day - s * dax)
    return (across, 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)
