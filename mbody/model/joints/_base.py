"""The base of all joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.model.constraint import Constraint, TurnRow
from mbody.model.element import InheritedPlace, place_field, two_bodies

if TYPE_CHECKING:
    from mbody.model.constraint import PoseReader
    from mbody.model.element import Numbers
    from mbody.model.primitives import ConstraintPrimitive

__all__ = ["SLIDING_PAIR", "TURNING_PAIR", "Joint", "relative_angle"]


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
    def rubs(self) -> bool:
        """Whether friction or damping is given, be it 0."""
        return False

    @property
    def can_separate(self) -> bool:
        """Whether it holds in one sense only, or has play: `simulate` has contacts in its place."""
        return False

    @property
    def limited(self) -> tuple[str, ...]:
        """The ends at which its free coordinate has a limit, "low" and "high"."""
        return ()

    def free_row(self, at: Numbers) -> ConstraintPrimitive:
        """The row of its free coordinate, which can be on or off."""
        raise NotImplementedError

    def quantities(self) -> dict[str, str]:
        """The reaction: components, magnitude of the force, and torque; its coordinates; where it
        rubs the power that it takes.
        """
        reaction = {"fx": "force", "fy": "force", "force": "force", "torque": "torque"}
        return reaction | self.coordinates | ({"loss": "power"} if self.rubs else {})

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
        """What does not `fit`, and what to do."""
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
