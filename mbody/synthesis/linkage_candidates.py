"""Four-bars and slider-cranks as candidates: how they are followed and measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.synthesis.following import Followed, Positions, followed

__all__ = ["LinkageCandidate"]


@dataclass(frozen=True, eq=False)
class LinkageCandidate:
    """A candidate of a kind in closed form.

    Attributes
    ----------
    positions : Positions
    misses : array (points,)
        By the closed form.
    measure : function
        The same of a result of the assembled mechanism.
    zeros : (float, float)
        What is added to the given input and output of a function.
    with_cognate : bool
        Whether the other mechanism of the same path is wanted.
    """

    positions: Positions
    misses: np.ndarray
    measure: Callable[[Any], np.ndarray]
    zeros: tuple[float, float] | None = None
    with_cognate: bool = False

    @property
    def row(self) -> np.ndarray:
        """The numbers of the kind."""
        return self.positions.x

    @property
    def described(self) -> str:
        """Which links turn round, in words."""
        return self.positions.kind.described(self.positions.x)

    def turns(self) -> bool:
        """Whether the crank turns round."""
        return self.positions.kind.turns(self.positions.x)

    def follow(self, units: str, full_turn: bool) -> Followed:
        """Drive the crank through the points; a crank that turns round does in any case."""
        return followed(self.positions, units)

    def measured(self, run: Any) -> np.ndarray:
        """The misses of a result of the assembled mechanism."""
        return self.measure(run)

    def values(self, found: Followed) -> dict[str, float]:
        """The numbers by the names of the description."""
        kind = self.positions.kind
        values = {n: float(x) for n, x in zip(kind.numbers, self.positions.x, strict=True)}
        if self.zeros is not None:
            output = "output.zero.angle" if kind.name == "four_bar" else "output.zero.x"
            values = {k: v for k, v in values.items() if not k.startswith(f"{kind.carrier}.P")}
            return values | {"input.zero.angle": self.zeros[0], output: self.zeros[1]}
        if self.positions.plane is None:
            return values
        own = [f"{kind.carrier}.{point}.{axis}" for point in "AB" for axis in "xy"]
        others = {k: v for k, v in values.items() if not k.startswith(f"{kind.carrier}.")}
        return others | {name: float(found.system.values[name]) for name in own}

    def transmission(self, found: Followed) -> float:
        """Least transmission angle of the motion; NaN where it was not followed."""
        if found.motion is None:
            return math.nan
        return float(self.positions.kind.transmission(found.motion).min())

    def cognate(self) -> LinkageCandidate | None:
        """Roberts' cognate with the same turn of the crank, where it is wanted and there is one."""
        at = self.positions
        other = at.kind.cognate(at.x, at.theta, at.senses[0]) if self.with_cognate else None
        if other is None:
            return None
        x, theta, sense = other
        same = replace(at, x=x, theta=theta, senses=np.full(len(theta), sense))
        return replace(self, positions=same, with_cognate=False)
