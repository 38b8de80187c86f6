"""The base of all joints."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.model.driver import Constraint, TurnRow, refuse_static, refuse_static_of_designs
from mbody.model.element import (
    ENDS,
    InheritedPlace,
    LimitsField,
    limits_field,
    number_field,
    place_field,
    two_bodies,
)
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive
from mbody.quantities.formula import NumberField, OptionalNumberField

if TYPE_CHECKING:
    from mbody.model.driver import PoseReader
    from mbody.model.element import Numbers


#: Coordinates of a turning and of a sliding pair, with the dimension of each.
TURNING_PAIR = {"angle": "angle", "rate": "angular velocity"}
SLIDING_PAIR = {"travel": "length", "rate": "velocity"}


@dataclass(frozen=True)
class Joint(Constraint):
    """A constraint between a place on body i and a place on body j.

    The reaction of a joint is the force on body j by body i, at the place on j.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        Places such as ``crank.at("A")`` or ``"crank.A"``.
    """

    main: ClassVar[tuple[str, ...]] = ("i", "j")
    role: ClassVar[str] = "joint"
    #: Whether the two places coincide.
    coincident: ClassVar[bool] = False
    #: Whether the two markers keep one direction.
    parallel: ClassVar[bool] = False
    #: Whether other joints must keep the places `apart` from each other, as those of gears.
    spaced: ClassVar[bool] = False
    #: Whether a body on a guide is moved along it until the places are `apart`, as a follower is.
    lifts: ClassVar[bool] = False
    #: Parts of the reaction on paper: its components "x" and "y", "N" normal to the x axis of the
    #: marker on i, "T" the torque, "F" along the line between the places. Without them the
    #: multipliers of the rows are the unknowns.
    unknowns: ClassVar[tuple[str, ...]] = ()
    #: What measures its freedom, with the dimension of each: the angle of the marker on j from that
    #: on i and its rate, or the travel of the place on j along the x axis of the marker on i and
    #: its rate.
    coordinates: ClassVar[dict[str, str]] = {}

    i: InheritedPlace = place_field()
    j: InheritedPlace = place_field()

    def _check(self) -> None:
        super()._check()
        two_bodies(self)

    def _check_switches(self, *fields: str) -> None:
        """Refuse what is neither true nor false."""
        for field in fields:
            value = getattr(self, field)
            if not isinstance(value, (bool, np.bool_)):
                raise ModelError(
                    f"'{self.name}': {field} must be True or False, not {value!r}", self.name
                )

    @property
    def bodies(self) -> tuple[str, str]:
        """(body of i, body of j)."""
        return self.i.body, self.j.body

    @property
    def pin(self) -> bool:
        """Whether the places coincide and the bodies turn about them."""
        return self.coincident and not self.parallel

    @property
    def slide(self) -> bool:
        """Whether the markers keep one direction and the places move apart."""
        return self.parallel and not self.coincident

    @property
    def has_friction(self) -> bool:
        """Whether friction or damping is given, be it 0."""
        return False

    @property
    def can_separate(self) -> bool:
        """Whether it holds in one direction only, or has play: `simulate` has contacts in its
        place.
        """
        return False

    @property
    def limited(self) -> tuple[str, ...]:
        """The ends at which its free coordinate has a limit, "low" and "high"."""
        return ()

    def free_row(self, at: Numbers) -> ConstraintPrimitive:
        """The row of its free coordinate, of the active set."""
        raise NotImplementedError

    def quantities(self) -> dict[str, str]:
        """The reaction: components, magnitude of the force, and torque; its coordinates; where it
        rubs the power that it takes.
        """
        reaction = {"fx": "force", "fy": "force", "force": "force", "torque": "torque"}
        return reaction | self.coordinates | ({"loss": "power"} if self.has_friction else {})

    def turn_row(self, at: Numbers, pose: PoseReader) -> TurnRow | None:
        """Of markers that keep one direction their angle; else None."""
        if not self.parallel:
            return None
        i, j = self.bodies
        return TurnRow({i: -1.0, j: 1.0}, relative_angle(self, at, pose))

    def equations(self, i: Any, j: Any) -> list[Any]:
        """Φ once more, as a book writes it: the dense oracle of `crosscheck` takes derivatives of
        it, of a joint that it has no equations of its own for.

        Parameters
        ----------
        i, j : tuple
            (x, y, direction) of each marker in world axes: floats, complex numbers or Taylor
            series, so use NumPy's functions.

        Returns
        -------
        list
            One number a row.
        """
        raise NotImplementedError(f"the oracle has no {type(self).__name__}")

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse numbers, of one design or of a batch, that do not fit together.

        Raises
        ------
        ModelError
            With the number in the unit of length given.
        """

    def reaction_point(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> tuple[Any, Any] | None:
        """Point that the reaction is reported at, from the place on j: None for that place itself.

        Parameters
        ----------
        at : mapping
            Numbers by dotted name.
        d : pair of arrays (instants,)
            From the place on i to the place on j, world axes [length].
        angle_i, angle_j : arrays (instants,)
            Directions of the markers from the world's x axis [rad].

        Returns
        -------
        pair of arrays (instants,), or None
            World axes [length]: a point of contact.
        """
        return None

    def normal(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> tuple[Any, Any] | None:
        """The unit normal of a contact from body i into body j, world axes; None where nothing
        presses. Parameters as of `reaction_point`.
        """
        return None

    def fit(self, at: Any, d: Any, angle_i: Any, angle_j: Any) -> tuple[Any, Any]:
        """Distance of the places, and the one they must have by other joints [length]. Parameters
        as of `reaction_point`.
        """
        return np.hypot(*d), self.apart(at)

    def misfit(self, found: float, wanted: float, unit: str) -> tuple[str, str]:
        """Sentence on lengths that do not `fit`, and its remedy."""
        return (
            f"by its radii the centres must be {wanted:.6g} {unit} apart, they are {found:.6g} "
            f"{unit}",
            "move them, or change the radii",
        )

    def apart(self, at: Any) -> Any:
        """How far apart the two places are where the joint lets them be [length]: a rough start."""
        return 0.0


def relative_angle(joint: Joint, at: Numbers, pose: PoseReader) -> float:
    """Angle of the marker on j from that on i at a pose [rad], whole turns included."""
    i, j = joint.bodies
    beta_i, beta_j = float(at.angle(joint, "i")), float(at.angle(joint, "j"))
    return pose.angle(j) + beta_j - pose.angle(i) - beta_i


# -- The coefficients of friction that joints have as attributes, and how they fit together ----


@dataclass(frozen=True, kw_only=True)
class FrictionalJoint(Joint):
    """Base of joints with Coulomb friction between two surfaces.

    The coefficient is `friction` while the surfaces slide and at most `static` while they stick;
    with a Stribeck speed v_s it falls with the sliding speed v from the one to the other,

        μ(v) = μ_k + (μ_s − μ_k) exp(−(v/v_s)²).

    Parameters
    ----------
    friction : float, optional
        Kinetic coefficient. Without it, nor `viscous`, the joint is without friction; with 0 the
        coefficient can be given another value later.
    static : float, optional
        Static coefficient, at least `friction`; by default the same.
    stribeck : float, optional
        Speed of the Stribeck curve [velocity], of the surfaces on each other.
    """

    friction: OptionalNumberField = number_field("number", None, sign="not negative")
    static: OptionalNumberField = number_field("number", None, sign="not negative")
    stribeck: OptionalNumberField = number_field("velocity", None, sign="positive")

    def _check(self) -> None:
        super()._check()
        if self.friction is None and self.static is not None:
            raise ModelError(
                f"'{self.name}': static is {self.static:g}, but there is no friction while it "
                "slides: give friction too, at most as much",
                self.name,
            )
        if self.stribeck is not None and self.static is None:
            raise ModelError(
                f"'{self.name}': a stribeck speed is how fast friction falls from static to "
                "friction: give both, or leave it out",
                self.name,
            )
        if self.friction is not None and self.static is not None:
            refuse_static(self.name, float(self.friction), float(self.static))

    @property
    def has_friction(self) -> bool:
        """Whether friction or damping is given, be it 0."""
        return self.friction is not None or getattr(self, "viscous", None) is not None

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse a static coefficient below the kinetic one, of any design."""
        super().refuse(at, unit)
        if self.static is not None and self.friction is not None:
            name = self.name
            refuse_static_of_designs(name, at[f"{name}.friction"], at[f"{name}.static"])

    def coefficients(self, at: Numbers, radius: Any = 1.0) -> list[Any]:
        """(μ_k, μ_s, Stribeck speed, viscous) as the kernels take them, of a rate that is `radius`
        times smaller than the sliding speed, as the angular velocity of a pin is by its radius.
        """
        name = self.name
        kinetic = 0.0 if self.friction is None else at[f"{name}.friction"]
        static = kinetic if self.static is None else at[f"{name}.static"]
        stribeck = 0.0 if self.stribeck is None else at[f"{name}.stribeck"] / radius
        viscous = 0.0 if getattr(self, "viscous", None) is None else at[f"{name}.viscous"]
        return [kinetic, static, stribeck, viscous]


# -- Friction of a given size between two bodies: what clutches, brakes, packings and seals have


@dataclass(frozen=True)
class GivenFriction(Joint):
    """Base of joints without rows whose friction follows a law, not a reaction.

    Where it slips it acts with the value of the law against the relative rate; where it sticks it
    holds as long as no more than that, times `static`, is needed.

    Parameters
    ----------
    static : float
        How many times as much it holds while it sticks, at least 1.
    stribeck : float, optional
        Relative rate over which it falls from what sticks to what slips.
    """

    static: NumberField = number_field("number", 1.0, sign="positive")
    stribeck: OptionalNumberField = number_field("velocity", None, sign="positive")
    rows = ""
    follows_formulas = True
    #: The kind of the pair, "torque" or "force", and the field of the law if that is another one.
    size: ClassVar[str]
    law: ClassVar[str] = ""

    def _check(self) -> None:
        super()._check()
        self._refuse_static(float(self.static))
        if self.stribeck is not None and self.static == 1.0:
            raise ModelError(
                f"'{self.name}': a stribeck rate is how fast friction falls from what sticks to "
                "what slips: give static too, above 1, or leave it out",
                self.name,
            )

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse that it holds less than it slips with, in any design."""
        super().refuse(at, unit)
        for static in np.ravel(at[f"{self.name}.static"]):
            self._refuse_static(float(static))

    def _refuse_static(self, static: float) -> None:
        if static < 1.0:
            raise ModelError(
                f"'{self.name}': static is {static:g} times what slips: what rests is not easier "
                "to move than what slides; give 1 or more",
                self.name,
            )

    @property
    def has_friction(self) -> bool:
        """That is all it does."""
        return True

    def primitives(self, at: Numbers) -> list[ConstraintPrimitive]:
        """None: it takes no freedom."""
        return []

    def equations(self, i: Any, j: Any) -> list[Any]:
        """No rows."""
        return []

    def tangent(self, at: Numbers) -> ConstraintPrimitive:
        """The row whose rate is the rate of slipping."""
        raise NotImplementedError

    def per_value(self, at: Numbers) -> tuple[Any, Any]:
        """The friction for a law of the value 1, and by which part of it there is more where it
        slips in the positive direction, and less in the other.
        """
        return 1.0, 0.0

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """One pair, of the size that the law gives."""
        stribeck: Any = 0.0 if self.stribeck is None else at[f"{self.name}.stribeck"]
        part, uneven = self.per_value(at)
        numbers = [part, part * at[f"{self.name}.static"], stribeck, 0.0, 0.0, uneven]
        law = at.law(self, self.law or self.size)
        return [FrictionPrimitive(self.size, self.tangent(at), 0, numbers, law)]


# -- Joints in which something may strike: at the ends of their travel, or where they separate -


@dataclass(frozen=True)
class Flank:
    """Where a joint holds in one direction.

    Attributes
    ----------
    normal : ConstraintPrimitive
        `sign` times its row is the gap.
    sign : float
    tangent : ConstraintPrimitive or None
        Its rate is that of sliding, where there is friction.
    """

    normal: ConstraintPrimitive
    sign: float
    tangent: ConstraintPrimitive | None = None


@dataclass(frozen=True, kw_only=True)
class StrikingJoint(Joint):
    """Base of joints with impacts.

    A joint that can separate holds its bodies in one direction only, or between two flanks: in
    `simulate` contacts stand in its place, under its name. All other analyses keep it as an
    ordinary joint, and a note says where it would have to pull. A motion begins with the joint
    closed, unless what is given of its bodies at the beginning says otherwise.

    Parameters
    ----------
    restitution : float, optional
        e of impacts, from 0, the default, to 1.
    """

    restitution: OptionalNumberField = number_field("number", None, sign="not negative")

    #: By which fields it strikes.
    strikes_by: ClassVar[str] = "one_sided"

    def _check(self) -> None:
        super()._check()
        if self.restitution is None:
            return
        if not self.can_separate and not self.limited:
            raise ModelError(
                f"'{self.name}': restitution is {self.restitution:g}, but nothing strikes in it: "
                f"give {self.strikes_by} too, or leave it out",
                self.name,
            )
        self._refuse_restitution(float(self.restitution))

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse a restitution above one, of any design."""
        super().refuse(at, unit)
        if self.restitution is not None:
            for value in np.ravel(at[f"{self.name}.restitution"]):
                self._refuse_restitution(float(value))

    def _refuse_restitution(self, value: float) -> None:
        if value > 1.0:
            raise ModelError(
                f"'{self.name}': restitution is {value:g}, which would gain energy: give 0 to 1",
                self.name,
            )

    def _refuse_beside(self, what: str, *fields: str) -> None:
        """Refuse fields that do not go with what lets the joint go."""
        for field in fields:
            if getattr(self, field) is not None:
                raise ModelError(
                    f"'{self.name}': {field} goes with a joint that always holds, not with "
                    f"{what}: leave out one of them",
                    self.name,
                )

    def flanks(self, at: Numbers) -> list[Flank]:
        """Where it holds, each in one direction, of a joint that can separate."""
        raise NotImplementedError


# -- Limits of the free coordinate of a joint --------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class LimitedJoint(FrictionalJoint, StrikingJoint):
    """Base of joints whose free coordinate may have limits: the angle of the marker on j from that
    on i, or the travel of the place on j along the x axis of the marker on i.

    Parameters
    ----------
    limits : pair of float, optional
        The least and the greatest value of the coordinate [rad or length], None for none on that
        side. At either end is a stop, as of a `Stop`: it acts in `simulate`, and in other analyses
        where it is met and nothing else determines the position.
    restitution : float, optional
        e of impacts at the limits, from 0, the default, to 1.
    """

    limits: LimitsField = limits_field()

    def _check(self) -> None:
        super()._check()
        if self.limits is not None and None not in self.limits:
            low, high = map(float, self.limits)
            self._refuse_limits(low, high, "")

    def refuse(self, at: Numbers, unit: str) -> None:
        """Refuse limits in the wrong order, of any design."""
        super().refuse(at, unit)
        if self.limits is not None and None not in self.limits:
            pair = (at[f"{self.name}.limits.{end}"] for end in ENDS)
            for low, high in zip(*map(np.ravel, np.broadcast_arrays(*pair)), strict=True):
                self._refuse_limits(float(low), float(high), f" {unit}")

    def _refuse_limits(self, low: float, high: float, length: str) -> None:
        if not low < high:
            (field,) = (one for one in dataclasses.fields(self) if one.name == "limits")
            angular = field.metadata["limits"] == "angle"
            unit = " rad" if angular else length
            raise ModelError(
                f"'{self.name}': limits are {low:g} and {high:g}{unit}: give the lesser first, and "
                "two that differ",
                self.name,
            )

    @property
    def limited(self) -> tuple[str, ...]:
        """The ends at which there is a limit."""
        ends = zip(ENDS, self.limits or (None, None), strict=True)
        return tuple(end for end, one in ends if one is not None)
