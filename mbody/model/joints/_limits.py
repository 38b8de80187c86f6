"""Limits of the free coordinate of a joint."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import ENDS, LimitsField, limits_field
from mbody.model.joints._friction import RubbingJoint
from mbody.model.joints._striking import StrikingJoint

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["LimitedJoint"]


@dataclass(frozen=True, kw_only=True)
class LimitedJoint(RubbingJoint, StrikingJoint):
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
