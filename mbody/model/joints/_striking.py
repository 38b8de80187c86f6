"""Joints in which something may strike: at the ends of their travel, or where they separate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import OptionalNumberField, number_field
from mbody.model.joints._base import Joint
from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["Flank", "StrikingJoint"]


@dataclass(frozen=True)
class Flank:
    """Where a joint holds in one sense.

    Attributes
    ----------
    normal : ConstraintPrimitive
        `sense` times its row is the gap.
    sense : float
    tangent : ConstraintPrimitive or None
        Its rate is that of sliding, where there is friction.
    """

    normal: ConstraintPrimitive
    sense: float
    tangent: ConstraintPrimitive | None = None


@dataclass(frozen=True, kw_only=True)
class StrikingJoint(Joint):
    """Base of joints with impacts.

    A joint that can separate holds its bodies in one sense only, or between two flanks: in
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
        """Where it holds, each in one sense, of a joint that can separate."""
        raise NotImplementedError
