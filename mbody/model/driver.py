"""Drivers: one coordinate of the mechanism follows a law of time; its effort is an answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np

from mbody.errors import ModelError
from mbody.laws import Constant
from mbody.model.element import (
    BodyName,
    Element,
    LawLike,
    Place,
    body_field,
    law_field,
    place_field,
    two_bodies,
)
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers


# -- The base of joints, couplings and drivers: rows Φ(q, t) = 0 between bodies ----------------

# -- Static friction is at least kinetic friction ----------------------------------------------


def refuse_static(name: str, kinetic: float, static: float) -> None:
    """Refuse a static coefficient below the kinetic one."""
    if static < kinetic:
        raise ModelError(
            f"'{name}': friction is {kinetic:g}, more than static = {static:g}: what rests is not "
            "easier to move than what slides; exchange them, or leave out static",
            name,
        )


def refuse_static_of_designs(name: str, kinetic: Any, static: Any) -> None:
    """Refuses static friction below kinetic friction in any design: numbers, or arrays (batch,)."""
    for one, other in zip(*map(np.ravel, np.broadcast_arrays(kinetic, static)), strict=True):
        refuse_static(name, float(one), float(other))


#: What a row measures, by its letter.
DIMENSIONS = {"l": "length", "a": "angle"}


class TurnRow(NamedTuple):
    """A row that counts whole revolutions: the factors of the bodies' angles, and what is left of
    it.
    """

    factors: dict[str, Any]
    left: Any


class PoseReader(Protocol):
    """A pose of all bodies at the first instant, as `Constraint.turn_row` reads it."""

    #: Values of the drivers by name.
    given: Mapping[str, float]

    def angle(self, body: str) -> float:
        """Angle of a body [rad]."""

    def place(self, element: Element, field: str) -> tuple[float, float]:
        """World place of an element's marker [length]."""


@dataclass(frozen=True)
class Constraint(Element):
    """Rows between bodies; their multipliers are the reaction, or the effort.

    Attributes
    ----------
    rows : str
        What each row measures, a letter a row: ``"l"`` a length, ``"a"`` an angle.
    counts_turns : bool
        Whether a row distinguishes an angle from the same angle one revolution further, see
        `turn_row`.
    """

    rows: ClassVar[str] = "l"
    counts_turns: ClassVar[bool] = False

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies: first the one that is measured from, last the one measured."""
        raise NotImplementedError

    @property
    def measures(self) -> tuple[str, ...]:
        """Dimension of every row: "length" or "angle"."""
        return tuple(DIMENSIONS[letter] for letter in self.rows)

    @property
    def angular(self) -> bool:
        """Whether angles alone are measured; an effort is a torque then, else a force."""
        return set(self.rows) == {"a"}

    @property
    def effort_dimension(self) -> str:
        """Dimension of the effort: "torque" or "force"."""
        return "torque" if self.angular else "force"

    def unit(self, length: float) -> float:
        """Scale of a coordinate: 1 rad, or the model length [length]."""
        return 1.0 if self.angular else length

    def distances(self) -> tuple[tuple[str, str], ...]:
        """Fields of the pairs of places whose distance is measured: it must not vanish."""
        return ()

    def turn_bodies(self) -> tuple[str, ...]:
        """The bodies whose angles `turn_row` ties to each other."""
        return self.bodies

    def turn_row(self, at: Numbers, pose: PoseReader) -> TurnRow | None:
        """The row that counts revolutions, at a pose; None where there is none."""
        return None

    @property
    def meshes(self) -> bool:
        """Whether two wheels turn on each other: half a revolution further of the line of centres
        the row that counts revolutions is zero as well, and other teeth meet.
        """
        return False

    def lets_turn(self, body: str) -> bool:
        """Whether that body may turn about its place here, in any position: a pin or a wheel."""
        return False

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """The rows with their numbers, as the kernels take them."""
        raise NotImplementedError

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """Its friction pairs with their numbers; none of most elements."""
        return []


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
