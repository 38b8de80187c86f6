"""Losses and radial forces of the teeth of gears and racks: efficiency or friction, pressure
angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.lanes import DualNumber, where
from mbody.errors import ModelError
from mbody.model.element import number_field
from mbody.model.joints._base import Flank, StrikingJoint
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive
from mbody.quantities.formula import OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.element import Numbers, Value


@dataclass(frozen=True, kw_only=True)
class ToothedJoint(StrikingJoint):
    """Base of joints with involute teeth.

    Parameters
    ----------
    efficiency : float, optional
        Power that the driven side gets, as a part of what the driving side gives, both seen from
        the carrier of the centres: above 0, at most 1.
    friction : float, optional
        Mean coefficient between the teeth, instead of `efficiency`. Needs `pressure_angle`.
    pressure_angle : float, optional
        α of the working pitch circles [rad]: teeth press each other apart with F tan α, which the
        bearings carry.
    module : float, optional
        Height of the teeth above the pitch circles [length], with `friction`; by default that of
        the fewest teeth which are not undercut, r sin²α of the smaller wheel.
    backlash : float, optional
        Play between the teeth along the pitch lines [length], half of it on both sides: in
        `simulate` either flank separates, and strikes; without losses and pressure angle.
    restitution : float, optional
        e of impacts of the teeth, with `backlash`.

    Notes
    -----
    The loss is a torque x between the wheels against their relative rate: x = F μ e/cos α with e
    the mean distance of the contact from the pitch point, (g_i² + g_j²)/(2 (g_i + g_j)) for paths
    of approach and recess g (Buckingham, *Analytical Mechanics of Gears*, chapter 19), or as much
    as the efficiency says.
    """

    efficiency: OptionalNumberField = number_field("number", None, sign="positive")
    friction: OptionalNumberField = number_field("number", None, sign="not negative")
    pressure_angle: OptionalNumberField = number_field("angle", None, sign="positive")
    module: OptionalNumberField = number_field("length", None, sign="positive")
    backlash: OptionalNumberField = number_field("length", None, sign="positive")
    strikes_by = "backlash"

    def _check(self) -> None:
        super()._check()
        if self.can_separate:
            self._refuse_beside("backlash", "efficiency", "friction", "pressure_angle")
        if self.efficiency is not None and self.friction is not None:
            raise ModelError(
                f"'{self.name}': efficiency = {self.efficiency:g} and friction = "
                f"{self.friction:g} both say what the teeth lose: give one of them",
                self.name,
            )
        if self.friction is not None and self.pressure_angle is None:
            raise ModelError(
                f"'{self.name}': friction of teeth is {self.friction:g}, but how far they slide "
                'follows from their pressure angle: give pressure_angle, as in "20 deg"',
                self.name,
            )
        if self.module is not None and self.friction is None:
            raise ModelError(
                f"'{self.name}': a module is how far teeth with friction slide on each other: give "
                "friction too, or leave out module",
                self.name,
            )
        if self.efficiency is not None:
            self._refuse_efficiency(float(self.efficiency))
        if self.pressure_angle is not None:
            self._refuse_angle(float(self.pressure_angle))

    @property
    def can_separate(self) -> bool:
        """Whether the teeth have play."""
        return self.backlash is not None

    def flanks(self, at: Numbers) -> list[Flank]:
        """Both flanks, by half the play to either side."""
        half = 0.5 * at[f"{self.name}.backlash"]
        return [
            Flank(replace(self.shifted(at, -sign * half), active_set=True), sign)
            for sign in (1.0, -1.0)
        ]

    def shifted(self, at: Numbers, by: Value) -> ConstraintPrimitive:
        """The row of teeth that are by so much further along the pitch lines: it grows with what
        the row without it measures, less that.
        """
        raise NotImplementedError

    @property
    def has_friction(self) -> bool:
        """Whether the teeth lose power."""
        return self.efficiency is not None or self.friction is not None

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse efficiencies that there are not, of any design."""
        super().refuse(at, unit)
        if self.efficiency is not None:
            for efficiency in np.ravel(at[f"{self.name}.efficiency"]):
                self._refuse_efficiency(float(efficiency))
            self._refuse_low(at)
        if self.pressure_angle is not None:
            for angle in np.ravel(at[f"{self.name}.pressure_angle"]):
                self._refuse_angle(float(angle))

    def _refuse_efficiency(self, efficiency: float) -> None:
        if efficiency > 1.0:
            raise ModelError(
                f"'{self.name}': efficiency is {efficiency:g}, teeth give no more than they get: "
                "give at most 1, as in 0.98",
                self.name,
            )

    def _refuse_angle(self, angle: float) -> None:
        if angle >= 0.25 * math.pi:
            raise ModelError(
                f"'{self.name}': pressure_angle is {math.degrees(angle):g} deg, it must be less "
                'than 45 deg: most gears have "20 deg"',
                self.name,
            )

    def _refuse_low(self, at: Numbers) -> None:
        """A wheel in a ring hardly turns against it: what it loses there has a limit."""
        given = *self.curvatures(at), at[f"{self.name}.efficiency"]
        bi, bj, efficiency = (np.ravel(one) for one in np.broadcast_arrays(*given))
        sizes = np.abs(bi), np.abs(bj)
        # in a ring the ratio of the radii decides
        least = np.where(bi * bj < 0.0, np.minimum(*sizes) / np.maximum(*sizes), 0.0)
        for n in np.flatnonzero(efficiency <= least):
            raise ModelError(
                f"'{self.name}': efficiency is {efficiency[n]:g}: with these radii the wheels "
                f"turn too little against each other to lose more than leaves {least[n]:.4g}: give "
                "more than that",
                self.name,
            )

    def curvatures(self, at: Any) -> tuple[Value, Value]:
        """Inverses of the signed radii of both pitch lines, 0 of a rack [1/length]."""
        raise NotImplementedError

    def radial(self, at: Numbers) -> tuple[ConstraintPrimitive, float]:
        """The row of the distance along which teeth press; −1 where they lengthen it, else 1."""
        raise NotImplementedError

    #: Sign of the tooth force for a multiplier, along the normal of the line of centres.
    _sign_of_force = 1.0

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """Friction of the teeth against the relative rate, and their radial force on the wheels."""
        name, found = self.name, []
        if self.has_friction:
            turning = ConstraintPrimitive(
                "angle", self.i.body, self.j.body, "a", [0.0], active_set=True
            )
            mean, uneven = self._loss(at)
            found.append(
                FrictionPrimitive("couple", turning, 0, [mean, mean, 0.0, 0.0, 0.0, uneven])
            )
        if self.pressure_angle is not None:
            row, sign = self.radial(at)
            slope = np.tan(at[f"{name}.pressure_angle"])
            found.append(FrictionPrimitive("apart", row, 0, [slope, slope, 0.0, 0.0, sign, 0.0]))
        return found

    def _loss(self, at: Numbers) -> tuple[Value, Value]:
        """Torque of loss by the tooth force [length], and by how much it is more where the
        direction of rotation and the multiplier have one sign than where they have not, halved.
        """
        bi, bj = self.curvatures(at)
        if self.efficiency is None:
            angle = at[f"{self.name}.pressure_angle"]
            arm = self._mean_path(at, bi, bj, angle)
            loss: Value = at[f"{self.name}.friction"] * arm / np.cos(angle)
            return loss, 0.0
        efficiency = at[f"{self.name}.efficiency"]
        sign = np.sign(bi + bj)
        # as i or j drives
        of_i = (1.0 - efficiency) / (sign * (bj + efficiency * bi))
        of_j = (1.0 - efficiency) / (sign * (bi + efficiency * bj))
        return 0.5 * (of_i + of_j), 0.5 * self._sign_of_force * sign * (of_i - of_j)

    def _mean_path(self, at: Numbers, bi: Value, bj: Value, angle: Value) -> Value:
        """Mean distance of the contact from the pitch point along the line of action [length]."""
        curvature = np.maximum(np.abs(bi), np.abs(bj))
        least = np.sin(angle) ** 2 / curvature
        module = least if self.module is None else at[f"{self.name}.module"]
        gi, gj = (_path(one, other, module, angle) for one, other in ((bi, bj), (bj, bi)))
        return 0.5 * (gi * gi + gj * gj) / (gi + gj)


def _path(own: Value, other: Value, module: Value, angle: Value) -> Value:
    """Length of the part of the line of action on which the tips of a wheel of that bend touch,
    from the pitch point to its tip circle, but not past the base circle of the other wheel.
    """
    s, c = np.sin(angle), np.cos(angle)
    own, other = (x if isinstance(x, DualNumber) else np.asarray(x, float) for x in (own, other))
    inside = own * other < 0.0
    ring = (own == 0.0) | (np.abs(own) < np.abs(other)) & inside
    with np.errstate(divide="ignore", invalid="ignore"):
        r = np.abs(1.0 / own)
        tip = where(ring, r - module, r + module)
        reached = np.sqrt(np.maximum(tip * tip - (r * c) ** 2, 0.0))
        path = where(ring, r * s - reached, reached - r * s)
        path = where(own == 0.0, module / s, path)
        # a ring or a rack has no base circle that could be passed
        end = where((other == 0.0) | inside & ~ring, np.inf, np.abs(1.0 / other) * s)
    found: Value = np.minimum(path, end)[()]
    return found
