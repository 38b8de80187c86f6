"""Rack and pinion: a wheel that turns without slip along a straight line of another body."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.decorators import inline
from mbody.model.driver import TurnRow
from mbody.model.element import number_field
from mbody.model.joints._base import relative_angle
from mbody.model.joints._teeth import ToothedJoint
from mbody.model.primitives import ConstraintPrimitive, between, constraint_physics, turned
from mbody.quantities.formula import NumberField

if TYPE_CHECKING:
    from mbody.model.driver import PoseReader
    from mbody.model.element import Numbers, Value


@dataclass(frozen=True)
class RackPinion(ToothedJoint):
    """Rack and pinion: the pitch circle about the place on j rolls on a line of i.

    Other joints keep the pinion at its distance: its centre is by the radius to the left of the
    pitch line, which goes through the place on i in the direction of its marker, the marker's y
    axis pointing to the pinion. Φ = u · d + r (θ_j − θ_i) − offset,
    one row. The reaction is the tangential tooth force on the pinion at the pitch point.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        A place on the rack's pitch line; the marker's `angle` is the direction of the rack.
    j : Marker or str
        The centre of the pinion.
    radius : float
        Of the pitch circle [length].
    offset : float
        How far along the rack the pinion is when its angle from the rack's is 0 [length].
    efficiency, friction, pressure_angle, module : float, optional
        What the teeth lose, and how they press the pinion off the rack; see `ToothedJoint`.
    backlash, restitution : float, optional
        Play between the teeth, and e of their impacts; see `ToothedJoint`.

    Examples
    --------
    >>> RackPinion("mesh", "rack", "pinion", radius=2.0).rows
    'l'
    """

    radius: NumberField = number_field("length", 0.0, sign="positive")
    offset: NumberField = number_field("length", 0.0)
    rows = "l"
    spaced = True
    counts_turns = True
    _sign_of_force = -1.0

    def curvatures(self, at: Any) -> tuple[Value, Value]:
        """That of the rack is straight [1/length]."""
        radius = at[f"{self.name}.radius"]
        return 0.0 * radius, 1.0 / radius

    def radial(self, at: Numbers) -> tuple[ConstraintPrimitive, float]:
        """Across the rack, on which the pinion is to the left."""
        beta = at.angle(self, "i")
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), -np.sin(beta), np.cos(beta)]
        bodies = self.i.body, self.j.body
        return ConstraintPrimitive("coordinate", *bodies, "l", parameters, active_set=True), -1.0

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row; see `along_line`."""
        return [along_line(self, at)]

    def shifted(self, at: Numbers, by: Value) -> ConstraintPrimitive:
        """The row of `along_line`, the rack moved by that."""
        row = along_line(self, at)
        x, y, *others = row.parameters
        ux, uy = others[2:4]
        return replace(row, parameters=[x + by * ux, y + by * uy, *others])

    def turn_row(self, at: Numbers, pose: PoseReader) -> TurnRow:
        """Count of whole revolutions, by `turns_on_line`."""
        return turns_on_line(self, at, pose)

    def reaction_point(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> Any:
        """The pitch point, from the centre on j."""
        return below(at[f"{self.name}.radius"], angle_i)

    def fit(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> tuple[Any, Any]:
        """How far to the left of the line the centre is, and the radius."""
        return np.cos(angle_i) * d[1] - np.sin(angle_i) * d[0], at[f"{self.name}.radius"]

    def misfit(self, found: float, wanted: float, unit: str) -> tuple[str, str]:
        """On which side of the line the centre is, and how far."""
        side = "left" if found >= 0.0 else "right"
        turn = "" if found >= 0.0 else "turn the marker on the rack by 180 deg, "
        return (
            f"by its radius the centre must be {wanted:.6g} {unit} to the left of the rack's line, "
            f"it is {abs(found):.6g} {unit} to the {side}",
            f"{turn}move it, or change the radius",
        )


def along_line(element: Any, at: Numbers) -> ConstraintPrimitive:
    """The row of a wheel that does not slip on a line; the offset is counted to the arm on i."""
    radius = at[f"{element.name}.radius"]
    beta_i, beta_j = at.angle(element, "i"), at.angle(element, "j")
    ux, uy = np.cos(beta_i), np.sin(beta_i)
    offset = at[f"{element.name}.offset"] - radius * (beta_j - beta_i)
    ix, iy = at.arm(element, "i")
    parameters = [ix + offset * ux, iy + offset * uy, *at.arm(element, "j"), ux, uy, radius]
    return ConstraintPrimitive("rack", element.i.body, element.j.body, "l", parameters)


def turns_on_line(wheel: Any, at: Numbers, pose: PoseReader) -> TurnRow:
    """The row of `along_line` at a pose."""
    (ix, iy), (jx, jy) = (pose.place(wheel, side) for side in "ij")
    i, j = wheel.bodies
    radius = float(at[f"{wheel.name}.radius"])
    line = pose.angle(i) + float(at.angle(wheel, "i"))
    along = math.cos(line) * (jx - ix) + math.sin(line) * (jy - iy)
    left = along + radius * relative_angle(wheel, at, pose) - float(at[f"{wheel.name}.offset"])
    return TurnRow({i: -radius, j: radius}, left)


def below(radius: Any, angle: Any) -> Any:
    """From the centre of a wheel to where it touches a line of that direction on its right."""
    return radius * np.sin(angle), -radius * np.cos(angle)


@constraint_physics()
@inline
def rack(i, j, p, f):
    """Φ = u·d + r (θ_j − θ_i);  γ = ω² u·d − 2ω (k×u)·ḋ − u·(rest of d̈), u fixed in i."""
    (pix, piy, pjx, pjy), (dx, dy), (dvx, dvy), (dax, day) = between(i, j, p[0], p[1], p[2], p[3])
    ux, uy = turned(i[3], i[4], p[4], p[5])
    w, r = i[7], p[6]
    block_i = (-ux, -uy, ux * dy - uy * dx + ux * piy - uy * pix - r, 0.0, 0.0, 0.0)
    block_j = (ux, uy, uy * pjx - ux * pjy + r, 0.0, 0.0, 0.0)
    along = ux * dx + uy * dy
    gamma = w * w * along - 2.0 * w * (ux * dvy - uy * dvx) - (ux * dax + uy * day)
    return (along + r * (j[2] - i[2]), 0.0), (*block_i, *block_j), (0.0, 0.0), (gamma, 0.0)
