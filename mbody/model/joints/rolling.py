"""Rolling: a wheel that touches a line or another wheel and does not slip."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.driver import refuse_static, refuse_static_of_designs
from mbody.model.element import number_field
from mbody.model.joints._base import Flank, StrikingJoint
from mbody.model.joints.gear import pitch_point, signed, turns_of_wheels, without_slip
from mbody.model.joints.rack import along_line, below, turns_on_line
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive, Signal
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.driver import PoseReader, TurnRow
    from mbody.model.element import Numbers, Value


@dataclass(frozen=True)
class Rolling(StrikingJoint):
    """Wheel on a line, or on another wheel, rolling without slip: the circle about the place on j
    touches the x axis of the marker on i, on its left, or a circle about the place on i.

    On a line Φ = [n_i · d − r,  u_i · d + r (θ_j − θ_i) − offset] = 0; on a wheel Φ = [|d| − R,
    n(ψ) · d] = 0, as of a `Gear`: two rows. The reaction is the force on the wheel at the point of
    contact: its part along the line keeps the wheel from slipping, that across it presses. Both
    are kept whatever their size and sign; a note says where the contact would have to pull. With
    `one_sided`, `simulate` lets the wheel lift off, strike, and slip beyond its friction.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        A place on the line, the marker's `angle` being its direction; or the centre of the wheel
        that is rolled upon.
    j : Marker or str
        The centre of the wheel.
    radius : float
        Of the wheel [length].
    on_radius : float, optional
        Of the wheel that it rolls upon [length]; without it, it rolls on a line.
    internal : bool
        Whether the smaller wheel rolls inside the greater one.
    offset : float
        On a line: how far along it the wheel is when its angle from the line's is 0 [length].
    phase : float
        On a wheel: direction of the line of centres when both wheels are at 0 [rad].
    resistance : float, optional
        Arm of rolling resistance [length]: with N, which presses, rolling takes the torque
        N · resistance between both bodies, and a wheel at rest holds up to that.
    one_sided : bool
        Whether the wheel may lift off, in `simulate`; it needs `friction`, without which nothing
        would make it roll again.
    friction, static : float, optional
        With `one_sided`: coefficient of what slides, and of what rolls, at least the same.
    restitution : float, optional
        e of impacts of the wheel, with `one_sided`.

    Examples
    --------
    >>> Rolling("road", "ground", "wheel", radius=0.3).rows
    'll'
    """

    radius: NumberField = number_field("length", 0.0, sign="positive")
    on_radius: OptionalNumberField = number_field("length", None, sign="positive")
    internal: bool = False
    offset: NumberField = number_field("length", 0.0)
    phase: NumberField = number_field("angle", 0.0)
    resistance: OptionalNumberField = number_field("length", None, sign="not negative")
    one_sided: bool = field(default=False, kw_only=True)
    friction: OptionalNumberField = number_field("number", None, sign="not negative")
    static: OptionalNumberField = number_field("number", None, sign="not negative")
    rows = "ll"
    counts_turns = True

    def _check(self) -> None:
        super()._check()
        self._check_switches("internal", "one_sided")
        if self.one_sided:
            self._refuse_beside("one_sided", "resistance")
        if self.one_sided != (self.friction is not None) or (
            self.static is not None and self.friction is None
        ):
            raise ModelError(
                f"'{self.name}': friction and one_sided go together: a wheel that may lift off "
                "rolls as far as its friction lets it, one that may not never slips; give both, or "
                "neither",
                self.name,
            )
        if self.friction is not None and self.static is not None:
            refuse_static(self.name, float(self.friction), float(self.static))
        line = self.on_radius is None
        if self.internal and (line or self.on_radius == self.radius):
            raise ModelError(
                f"'{self.name}': a wheel rolls inside a greater one: give on_radius another value "
                "than the radius",
                self.name,
            )
        if (self.phase and line) or (self.offset and not line):
            raise ModelError(
                f"'{self.name}': offset goes with a line, phase with another wheel: leave out "
                f"{'phase' if line else 'offset'}",
                self.name,
            )

    def radii(self, at: Any) -> tuple[Value, Value]:
        """Signed radii of two wheels [length], as of a gear pair."""
        return signed(at[f"{self.name}.on_radius"], at[f"{self.name}.radius"], self.internal)

    def apart(self, at: Any) -> Any:
        """The radius on a line, the distance of the centres on a wheel."""
        return at[f"{self.name}.radius"] if self.on_radius is None else sum(self.radii(at))

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """One row across the contact and one along it."""
        arms = [*at.arm(self, "i"), *at.arm(self, "j")]
        bodies = self.i.body, self.j.body
        if self.on_radius is not None:
            ri, rj = self.radii(at)
            apart = Signal(Constant(0.0), [ri + rj])
            across = ConstraintPrimitive("distance", *bodies, "l", arms, apart)
            return [across, without_slip(self, at, ri, rj)]
        # the radius counts to the arm on i, so that the centre stays on the shifted line
        radius, beta = at[f"{self.name}.radius"], at.angle(self, "i")
        nx, ny = -np.sin(beta), np.cos(beta)
        arms[0], arms[1] = arms[0] + radius * nx, arms[1] + radius * ny
        return [
            ConstraintPrimitive("coordinate", *bodies, "l", [*arms, nx, ny]),
            along_line(self, at),
        ]

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse what sticks less than it slides, of any design."""
        super().refuse(at, unit)
        if self.static is not None:
            numbers = at[f"{self.name}.friction"], at[f"{self.name}.static"]
            refuse_static_of_designs(self.name, *numbers)

    @property
    def can_separate(self) -> bool:
        """Whether the wheel may lift off."""
        return self.one_sided

    def flanks(self, at: Numbers) -> list[Flank]:
        """The road, or the other wheel, from outside or from within."""
        across, _ = (replace(row, active_set=True) for row in self.primitives(at))
        if self.on_radius is None:
            return [Flank(across, 1.0, replace(along_line(self, at), active_set=True))]
        ri, rj = self.radii(at)
        row = replace(across, kind="clearance")
        numbers = [*at.arm(self, "i"), *at.arm(self, "j"), ri / (ri + rj), rj / (ri + rj), 0.0]
        bodies = self.i.body, self.j.body
        slides = ConstraintPrimitive("slipping", *bodies, "l", numbers, active_set=True)
        return [Flank(row, -1.0 if self.internal else 1.0, slides)]

    @property
    def has_friction(self) -> bool:
        """Whether rolling is resisted."""
        return self.resistance is not None

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """Rolling resistance on the angle of the wheel from the other body."""
        if self.resistance is None:
            return []
        arm = at[f"{self.name}.resistance"]
        turning = ConstraintPrimitive(
            "angle", self.i.body, self.j.body, "a", [0.0], active_set=True
        )
        return [FrictionPrimitive("couple", turning, 0, [arm, arm, 0.0, 0.0, 0.0, 0.0])]

    def turn_row(self, at: Numbers, pose: PoseReader) -> TurnRow:
        """Count of whole revolutions: of a rack and pinion on a line, of a gear pair on a wheel."""
        counted = turns_of_wheels if self.meshes else turns_on_line
        return counted(self, at, pose)

    @property
    def meshes(self) -> bool:
        """Where it rolls on a wheel."""
        return self.on_radius is not None

    def lets_turn(self, body: str) -> bool:
        """The wheel, and what it rolls on if that is another wheel."""
        return self.meshes or body == self.j.body

    def reaction_point(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> Any:
        """The point of contact, from the centre on j."""
        if self.on_radius is not None:
            return pitch_point(self.radii(at)[1], d)
        return below(at[f"{self.name}.radius"], angle_i)

    def normal(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> Any:
        """Across the line, or along the line of centres: inwards in a ring, else outwards."""
        if self.on_radius is None:
            return -np.sin(angle_i), np.cos(angle_i)
        sign = -1.0 if self.internal else 1.0
        return tuple(sign * part / np.hypot(*d) for part in d)
