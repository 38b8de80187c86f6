"""From candidates to designs: each is followed, measured, and kept or left out with a reason."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.errors import SolveError
from mbody.synthesis.demands import conditions
from mbody.synthesis.design import Design
from mbody.synthesis.following import Followed, Positions, followed

__all__ = ["EXACT", "Candidate", "Judge"]

#: Share of the size of a motion by which designs are one.
SAME = 1e-4
#: Share of it by which a point is met.
EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class Candidate:
    """A candidate to be judged.

    Attributes
    ----------
    positions : Positions
    misses : array (points,)
        By the closed form.
    measured : function
        The same of a result of the assembled mechanism.
    zeros : (float, float)
        What is added to the given input and output of a function.
    cognate : bool
        Whether the other mechanism of the same path is wanted.
    """

    positions: Positions
    misses: np.ndarray
    measured: Callable[[Any], np.ndarray]
    zeros: tuple[float, float] | None = None
    cognate: bool = False


@dataclass
class Judge:
    """Judges candidates one after the other and keeps those that are wanted.

    Attributes
    ----------
    units : str
    size : float
        Of the motion, by which designs are compared.
    subject_to : tuple of str
    full_turn, defective : bool
        As of `synthesize`.
    tolerance : float
        Greatest miss of a point.
    unit : str
        Of misses.
    refused : Counter
        Why candidates were left out.
    nearest : Design or None
        The best of those that were left out.
    """

    units: str
    size: float
    subject_to: tuple[str, ...]
    full_turn: bool
    defective: bool
    tolerance: float
    unit: str
    kept: list[Design] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)
    nearest: Design | None = None

    def __post_init__(self) -> None:
        self._seen: list[np.ndarray] = []

    def take(self, candidates: Iterable[Candidate], count: int, exact: float) -> None:
        """Judge candidates in their order until `count` designs are kept, and all whose error is
        below `exact`, which are equals.
        """
        for one in candidates:
            if len(self.kept) >= count and float(np.square(one.misses).sum()) > exact:
                break
            self._one(one)

    def _one(self, candidate: Candidate) -> None:
        positions = candidate.positions
        if any(self._alike(positions.x, other) for other in self._seen):
            return
        self._seen.append(positions.x)
        if self.full_turn and not positions.kind.turns(positions.x):
            self.refused["a crank that does not turn round"] += 1
            return
        design, why = self._design(candidate)
        if candidate.cognate:
            design = replace(design, cognates=self._cognates(candidate))
        if not why:
            self.kept.append(design)
            return
        self.refused[why] += 1
        if self.nearest is None or design.error < self.nearest.error:
            self.nearest = design

    def _alike(self, x: np.ndarray, other: np.ndarray) -> bool:
        size = max(self.size, float(np.abs(x).max()))
        return bool(np.abs(x - other).max() < SAME * size)

    def _design(self, candidate: Candidate) -> tuple[Design, str]:
        """The design, and why it is left out."""
        positions = candidate.positions
        found = followed(positions, self.units)
        misses = candidate.misses if found.run is None else candidate.measured(found.run)
        margins, why = {}, ""
        if found.defects and not self.defective:
            why = f"{found.defects[0].partition(':')[0]} defects"
        if misses.max() > self.tolerance and not why:
            why = "misses beyond the tolerance"
        if found.motion is not None:
            for condition in conditions(self.subject_to, found.system.mechanism):
                margins[condition.text] = margin = condition.margin(found.motion)
                if margin < 0.0 and not why:
                    why = condition.text
        design = Design(
            mechanism=found.system.mechanism,
            values=_values(positions, found),
            error=float(np.square(misses).sum()),
            misses=tuple(float(one) for one in misses),
            driven=[float(one) for one in found.theta],
            defects=found.defects,
            order=found.order,
            grashof=positions.kind.described(positions.x),
            transmission_min=_transmission(positions, found),
            margins=margins,
            zeros=candidate.zeros,
        )
        return design, why

    def _cognates(self, candidate: Candidate) -> tuple[Design, ...]:
        """The cognate with the same turn of the crank, which counts as seen."""
        positions = candidate.positions
        other = positions.kind.cognate(positions.x, positions.theta, positions.senses[0])
        if other is None:
            return ()
        x, theta, sense = other
        self._seen.append(x)
        senses = np.full(len(theta), sense)
        same = replace(positions, x=x, theta=theta, senses=senses)
        return (self._design(replace(candidate, positions=same, cognate=False))[0],)

    def best(self, count: int, exact: float) -> list[Design]:
        """The best of the kept ones by their errors, of exact ones by their transmission angles."""
        self.kept.sort(key=lambda one: (max(one.error, exact), -_certain(one.transmission_min)))
        return self.kept[:count]

    def require(self, what: str) -> None:
        """Refuse to return nothing: say why candidates were left out, and which was nearest."""
        if self.kept:
            return
        message = f"synthesize: no {what}"
        if self.refused:
            reasons = (f"{count} for {why}" for why, count in self.refused.most_common(3))
            message += f"; left out were {', '.join(reasons)}"
        if self.nearest is not None:
            worst = int(np.argmax(self.nearest.misses))
            off = self.nearest.misses[worst]
            message += "; the nearest "
            if off > EXACT * self.size:
                message += f"is off by {off:.3g} {self.unit} at point {worst + 1}"
            else:
                message += "meets all points"
            if self.nearest.defects:
                message += f", with a defect of {self.nearest.defects[0].partition(':')[0]}"
        raise SolveError(
            f"{message}: change the points or widen the bounds, try more designs (search), or keep "
            "those with defects (defective=True)"
        )


def _certain(angle: float) -> float:
    return -1.0 if math.isnan(angle) else angle


def _values(positions: Positions, found: Followed) -> dict[str, float]:
    """The numbers by the names of the description."""
    names = positions.kind.numbers
    values = {name: float(value) for name, value in zip(names, positions.x, strict=True)}
    if positions.plane is None:
        return values
    carrier = positions.kind.carrier
    own = [f"{carrier}.{point}.{axis}" for point in "AB" for axis in "xy"]
    return {k: v for k, v in values.items() if not k.startswith(f"{carrier}.")} | {
        name: float(found.system.values[name]) for name in own
    }


def _transmission(positions: Positions, found: Followed) -> float:
    if found.motion is None:
        return math.nan
    return float(positions.kind.transmission(found.motion).min())
