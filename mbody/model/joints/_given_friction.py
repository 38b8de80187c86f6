"""Friction of a given size between two bodies: what clutches, brakes, packings and seals have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import NumberField, OptionalNumberField, number_field
from mbody.model.joints._base import Joint
from mbody.model.primitives import ConstraintPrimitive, FrictionPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["GivenFriction"]


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
    def rubs(self) -> bool:
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
        slips in the positive sense, and less in the other.
        """
        return 1.0, 0.0

    def frictions(self, at: Numbers) -> list[FrictionPrimitive]:
        """One pair, of the size that the law gives."""
        stribeck: Any = 0.0 if self.stribeck is None else at[f"{self.name}.stribeck"]
        part, uneven = self.per_value(at)
        numbers = [part, part * at[f"{self.name}.static"], stribeck, 0.0, 0.0, uneven]
        law = at.law(self, self.law or self.size)
        return [FrictionPrimitive(self.size, self.tangent(at), 0, numbers, law)]
