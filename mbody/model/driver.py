"""Drivers: one coordinate of the mechanism follows a law of time; its effort is an answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.constraint import Constraint, TurnRow
from mbody.model.element import (
    BodyName,
    LawLike,
    Place,
    body_field,
    law_field,
    place_field,
    two_bodies,
)
from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.constraint import PoseReader
    from mbody.model.element import Numbers


#: Parts of the motion of a driver: its coordinate and the two derivatives.
DRIVEN = ("value", "rate", "acceleration")


@dataclass(frozen=True)
class Driver(Constraint):
    """Base of all drivers: one row Φ = coordinate − f(t), or − f(q, t) of a formula of positions.

    The effort (a torque for an angle, else a force) times the driven rate is the power that the
    driver supplies to the mechanism; of a formula of positions times ∂f/∂t.
    """

    role: ClassVar[str] = "driver"

    @property
    def bodies(self) -> tuple[str, str]:
        """Names of the body that the coordinate is measured from and of the driven one."""
        raise NotImplementedError

    @property
    def coordinate(self) -> str:
        """The driven coordinate, in words."""
        raise NotImplementedError

    @property
    def motion(self) -> dict[str, str]:
        """Dimensions of the driven coordinate and of its derivatives."""
        if self.angular:
            names = ("angle", "angular velocity", "angular acceleration")
        else:
            names = ("length", "velocity", "acceleration")
        return dict(zip(DRIVEN, names, strict=True))

    def quantities(self) -> dict[str, str]:
        """The effort, its power, and the driven motion."""
        return {"effort": self.effort_dimension, "power": "power"} | self.motion


@dataclass(frozen=True)
class AngleDriver(Driver):
    """Motor: the angle of a body, or its angle from another body, follows a law of time.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    body : str
        Name of the driven body.
    law : Law, float, str or callable
        Angle of the body's x axis [rad] as a function of time; text may be a formula of inputs, own
        states and positions too.
    relative_to : str
        The body that the angle is measured from, by default the ground.

    Examples
    --------
    >>> from mbody.laws import ConstantSpeed
    >>> AngleDriver("motor", "crank", ConstantSpeed(0.0, 25.0)).bodies
    ('ground', 'crank')

    The arm follows the crank and an input:

    >>> follower = AngleDriver("follower", "arm", "0.5*crank.angle + u")
    """

    main: ClassVar[tuple[str, ...]] = ("body",)

    body: BodyName = body_field()
    law: LawLike = law_field("angle", 0.0)
    relative_to: BodyName = body_field("ground")
    rows = "a"
    counts_turns = True

    def _check(self) -> None:
        super()._check()
        if self.body == self.relative_to:
            raise ModelError(
                f"'{self.name}' would drive '{self.body}' relative to itself: name two bodies",
                self.name,
            )

    @property
    def bodies(self) -> tuple[str, str]:
        """(reference body, driven body)."""
        return self.relative_to, self.body

    @property
    def coordinate(self) -> str:
        """Words such as "angle of arm from crank", or "angle of arm" of one from the ground."""
        suffix = "" if self.relative_to == "ground" else f" from {self.relative_to}"
        return f"angle of {self.body}{suffix}"

    def turn_row(self, at: Numbers, pose: PoseReader) -> TurnRow | None:
        """The driven angle, where its value is known."""
        if self.name not in pose.given:
            return None
        i, j = self.bodies
        return TurnRow({i: -1.0, j: 1.0}, pose.angle(j) - pose.angle(i) - pose.given[self.name])

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """Φ = θ_j − θ_i − f."""
        return [ConstraintPrimitive("angle", *self.bodies, self.rows, [0.0], at.law(self, "law"))]


@dataclass(frozen=True)
class DistanceDriver(Driver):
    """Hydraulic cylinder, linear actuator: the distance of two places follows a law of time.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two ends.
    law : Law, float, str or callable
        Distance [length] as a function of time, always positive; or a formula as of an
        `AngleDriver`.

    Examples
    --------
    >>> import mbody
    >>> crane = mbody.Mechanism("crane", ground={"O": (0.0, 0.0), "C": (0.0, -3.0)})
    >>> crane.add(mbody.Body("jib", points={"P": (4.0, 0.0)}, guess=0.0))
    >>> crane.add(mbody.Revolute("O", "ground.O", "jib"))
    >>> crane.add(DistanceDriver("cylinder", "ground.C", "jib.P", "5 m + 0.1 m/s*t"))
    >>> round(float(mbody.kinematics(crane)["jib"].omega[0]), 9)  # 5 m · 0.1 m/s / (3 m · 4 m)
    0.041666667
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: Place = place_field()
    j: Place = place_field()
    law: LawLike = law_field("length")

    def _check(self) -> None:
        super()._check()
        two_bodies(self)
        if isinstance(self.law, Constant) and self.law.value <= 0.0:
            raise ModelError(
                f"'{self.name}': law is {self.law.value:g}, a distance must be positive; a "
                "CoordinateDriver takes a signed displacement",
                self.name,
            )

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.body, self.j.body

    @property
    def coordinate(self) -> str:
        """Words such as "distance of jib.P from ground.C"."""
        return f"distance of {self.j} from {self.i}"

    def distances(self) -> tuple[tuple[str, str], ...]:
        """That of the two places."""
        return (("i", "j"),)

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """Φ = |d| − f."""
        parameters = [*at.arm(self, "i"), *at.arm(self, "j")]
        return [
            ConstraintPrimitive(
                "distance", *self.bodies, self.rows, parameters, at.law(self, "law")
            )
        ]


@dataclass(frozen=True)
class CoordinateDriver(Driver):
    """Slider actuator: the displacement of a place on j along the x axis of a marker on i follows
    a law of time; with i on the ground it drives a coordinate of a point.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i : Marker or str
        Origin and direction (the marker's `angle`) of the coordinate.
    j : Marker or str
        The driven place.
    law : Law, float, str or callable
        Displacement [length] as a function of time; or a formula as of an `AngleDriver`.

    Examples
    --------
    >>> import mbody
    >>> press = mbody.Mechanism("press", ground={"O": (0.0, 0.0)})
    >>> press.add(mbody.Body("ram", mass=10.0), mbody.Prismatic("guide", "ground.O", "ram"))
    >>> press.add(CoordinateDriver("screw", "ground.O", "ram", "0.1 m + 0.02 m/s*t"))
    >>> round(float(mbody.kinematics(press, t=[0.0, 5.0])["ram"].x[1]), 9)
    0.2
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")

    i: Place = place_field()
    j: Place = place_field()
    law: LawLike = law_field("length")

    def _check(self) -> None:
        super()._check()
        two_bodies(self)

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.body, self.j.body

    @property
    def coordinate(self) -> str:
        """Words such as "displacement of ram from base", without "from" of one from the ground."""
        suffix = "" if self.i.body == "ground" else f" from {self.i}"
        return f"displacement of {self.j}{suffix}"

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """Φ = u_i · d − f."""
        angle = at.angle(self, "i")
        parameters = [*at.arm(self, "i"), *at.arm(self, "j"), np.cos(angle), np.sin(angle)]
        return [
            ConstraintPrimitive(
                "coordinate", *self.bodies, self.rows, parameters, at.law(self, "law")
            )
        ]
