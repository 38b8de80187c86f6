"""The base of all loads: what acts on the bodies besides joints and drivers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from mbody.errors import ModelError
from mbody.laws import Constant, Polynomial
from mbody.model.element import Element, InheritedPlace, body_field, place_field, two_bodies
from mbody.model.primitives import ForcePrimitive

if TYPE_CHECKING:
    from mbody.model.element import AccountedEnergy, Numbers


# the law of every linear spring and damper: its two coefficients are the kernel's parameters
LINE = Polynomial((0.0, 0.0))

#: Histories of a force.
FORCES = {"fx": "force", "fy": "force", "force": "force"}


class LoadSummary(Protocol):
    """Interface through which a load writes its line: its numbers and laws at an instant, as
    text.
    """

    def value(self, load: Load, field: str) -> str:
        """Value of a law."""

    def degrees(self, load: Load, field: str) -> str:
        """An angle."""

    def unit(self, dimension: str) -> str:
        """Unit of a dimension."""


@dataclass(frozen=True)
class Load(Element):
    """Base of all loads.

    Parameters
    ----------
    name : str
        Unique in the mechanism; the breakdown of reactions by cause goes by it.
    """

    role: ClassVar[str] = "load"
    #: Whether its work at a fixed time depends on the position alone, not on the path.
    conservative: ClassVar[bool] = False
    #: Whether it only takes power.
    dissipative: ClassVar[bool] = False
    #: Whether it pulls along the line between the places i and j, by their distance or its rate.
    along_line: ClassVar[bool] = False
    #: Whether it goes by the motion of the place j, and of its body, beside the x axis of i.
    on_line: ClassVar[bool] = False
    #: Whether it turns by the angle between two bodies, or by its rate.
    by_angle: ClassVar[bool] = False
    #: Whether what acts on the ground is part of it.
    acts_on_ground: ClassVar[bool] = True
    #: The length or the angle from which a law of the distance or of the angle counts.
    free: ClassVar[str] = ""

    def _check(self) -> None:
        super()._check()
        if self.name == "inertia":
            raise ModelError(
                "a load may not be named 'inertia', which is a cause of its own in the breakdown "
                "of forces: choose another name",
                self.name,
            )

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that the load acts between."""
        return tuple(marker.body for marker in self.places().values())

    @property
    def potential(self) -> bool:
        """Whether its work depends on the position alone: conservative, and of no time."""
        laws = (getattr(self, f.name) for f in fields(self) if f.metadata.get("of") == "time")
        return self.conservative and all(law is None or isinstance(law, Constant) for law in laws)

    @property
    def quadratic_in(self) -> str:
        """The field of a constant number whose square it is proportional to; else none."""
        return ""

    def sides(self) -> dict[str, str | None]:
        """The bodies on which it acts with the field of its place there, last the one on which its
        history is reported by default; none where it acts on every body.
        """
        places = self.places()
        if "j" in places:
            return {places["i"].body: "i", places["j"].body: "j"}
        return {places["at"].body: "at"} if "at" in places else {}

    def quantities(self) -> dict[str, str]:
        """The histories that a result has of it, with the dimension of each; none where it acts on
        every body.
        """
        if self.along_line:
            return {**FORCES, "length": "length", "rate": "velocity"}
        return {**FORCES, "torque": "torque"} if self.sides() else {}

    def line(self, summary: LoadSummary) -> str:
        """One line of a summary at an instant; where it is empty, the summary lists the fields."""
        return ""

    def wrenches(self, i: Any, j: Any, t: float, law: Any) -> tuple[Any, Any]:
        """Wrenches as a textbook writes them, for the dense oracle of `crosscheck`, of a load that
        the oracle does not know.

        Parameters
        ----------
        i, j : tuple
            (x, y, direction, vx, vy, ω) of its places i and j in world axes.
        t : float
            Time.
        law : callable
            ``law(field, x)`` is the value of one of its laws.

        Returns
        -------
        pair of tuples
            (Fx, Fy, T) at the place on i, then at the place on j.
        """
        raise NotImplementedError(f"the oracle has no {type(self).__name__}")

    def outputs(self) -> dict[str, tuple[str, str]]:
        """Quantities that follow from its numbers, its rate and its states: the formula of each, by
        names of its own, and what it measures.
        """
        return {}

    def energies(
        self, own: Mapping[str, Any], numbers: Mapping[str, Any]
    ) -> dict[str, AccountedEnergy]:
        """Parts of the account of energy beside its work, which then passes within it: what it
        takes from outside, loses and stores.

        own: histories of its states by their last name; numbers: the system's, by dotted name.
        """
        return {}

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """The load's actions with their numbers."""
        raise NotImplementedError


@dataclass(frozen=True)
class BetweenPlaces(Load):
    """Base of loads between two places, on two bodies.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    i, j : Marker or str
        The two places.
    """

    i: InheritedPlace = place_field()
    j: InheritedPlace = place_field()

    def _check(self) -> None:
        super()._check()
        two_bodies(self)


@dataclass(frozen=True)
class Turning(Load):
    """Base of loads between the angles of two bodies.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    body : str
        Name of the body that it acts on.
    by : str
        The body that carries the opposite torque, by default the ground.
    """

    main: ClassVar[tuple[str, ...]] = ("body",)

    body: Any = body_field()
    by: Any = body_field("ground")

    def _check(self) -> None:
        super()._check()
        if self.body == self.by:
            raise ModelError(
                f"'{self.name}' would turn '{self.body}' against itself: name two bodies", self.name
            )

    @property
    def bodies(self) -> tuple[str, ...]:
        """(carrier of the opposite torque, body)."""
        return self.by, self.body

    def sides(self) -> dict[str, str | None]:
        """(carrier of the opposite torque, body), without places."""
        return {self.by: None, self.body: None}

    def quantities(self) -> dict[str, str]:
        """The torque, and the angle and the rate that it goes by."""
        turned = {"angle": "angle", "rate": "angular velocity"} if self.by_angle else {}
        return {"torque": "torque"} | turned


def one_of(load: Any, number: str) -> None:
    """A spring or damper has its number or a law, and not both."""
    if (getattr(load, number) is None) == (load.law is None):
        what = "neither" if load.law is None else "both"
        joined = "nor" if load.law is None else "and"
        raise ModelError(
            f"'{load.name}' has {what} {number} {joined} law: give one of them", load.name
        )
