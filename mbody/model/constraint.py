"""The base of joints, couplings and drivers: rows Φ(q, t) = 0 between bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import Element
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers


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
