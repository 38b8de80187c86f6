"""The base of all loads: what acts on the bodies besides joints and drivers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from mbody.errors import ModelError
from mbody.laws import Polynomial
from mbody.model.element import Element, body_field
from mbody.model.primitives import ForcePrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["LINE", "Load", "Turning", "one_of"]

# the law of every linear spring and damper: its two coefficients are the kernel's parameters
LINE = Polynomial((0.0, 0.0))


@dataclass(frozen=True)
class Load(Element):
    """Base of all loads.

    Parameters
    ----------
    name : str
        Unique in the mechanism; the breakdown of reactions by cause goes by it.
    """

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

    def actions(self, at: Numbers) -> list[ForcePrimitive]:
        """The load's actions with their numbers."""
        raise NotImplementedError


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


def one_of(load: Any, number: str) -> None:
    """A spring or damper has its number or a law, and not both."""
    if (getattr(load, number) is None) == (load.law is None):
        what = "neither" if load.law is None else "both"
        joined = "nor" if load.law is None else "and"
        raise ModelError(
            f"'{load.name}' has {what} {number} {joined} law: give one of them", load.name
        )
