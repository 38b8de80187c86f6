"""From candidates to designs: each is followed, measured, and kept or left out with a reason."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from mbody.errors import ModelError, SolveError
from mbody.solution.measures import found_by
from mbody.synthesis.demands import conditions
from mbody.synthesis.design import Design
from mbody.synthesis.following import Followed

__all__ = ["EXACT", "Candidate", "Judge"]

#: Share of the size of a motion by which designs are one.
SAME = 1e-4
#: Share of it by which a point is met.
EXACT = 1e-9
#: What part of the size of a path a design may be off before it is said.
FAR = 0.1


class Candidate(Protocol):
    """A design that is to be judged."""

    @property
    def row(self) -> np.ndarray:
        """Its numbers."""
        ...

    @property
    def misses(self) -> np.ndarray:
        """How far it is from the points, as it was found (points,)."""
        ...

    @property
    def zeros(self) -> tuple[float, float] | None:
        """Of a function: what is added to the given input and output."""
        ...

    @property
    def described(self) -> str:
        """Which links turn round, in words."""
        ...

    def turns(self) -> bool:
        """Whether the crank may turn round."""
        ...

    def follow(self, units: str, full_turn: bool) -> Followed:
        """The assembled mechanism goes through the points."""
        ...

    def measured(self, run: Any) -> np.ndarray:
        """The misses of a result of the assembled mechanism."""
        ...

    def values(self, found: Followed) -> dict[str, float]:
        """The numbers by the names of the description."""
        ...

    def transmission(self, found: Followed) -> float:
        """Least transmission angle of the motion; NaN where it is not known."""
        ...

    def cognate(self) -> Candidate | None:
        """The other mechanism of the same path and the same crank, where it is wanted."""
        ...


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
        if any(self._alike(candidate.row, other) for other in self._seen):
            return
        self._seen.append(candidate.row)
        if self.full_turn and not candidate.turns():
            self.refused["a crank that does not turn round"] += 1
            return
        design, why = self._design(candidate)
        if other := candidate.cognate():
            self._seen.append(other.row)
            design = replace(design, cognates=(self._design(other)[0],))
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
        found = candidate.follow(self.units, self.full_turn)
        misses = candidate.misses if found.run is None else candidate.measured(found.run)
        margins, why = {}, ""
        if found.defects and not self.defective:
            why = f"{found.defects[0].partition(':')[0]} defects"
        if misses.max() > self.tolerance and not why:
            why = "misses beyond the tolerance"
        if found.motion is not None:
            for condition in conditions(self.subject_to, found.system.mechanism):
                if not found_by(found.motion, condition.column.measure):
                    raise ModelError(
                        f"synthesize: '{condition.text}' is about a force, and a "
                        f"{found.system.mechanism.name} that is sought by its lengths has neither "
                        "masses nor loads: give a model that has them"
                    )
                margins[condition.text] = margin = condition.margin(found.motion)
                if margin < 0.0 and not why:
                    why = condition.text
        design = Design(
            mechanism=found.system.mechanism,
            values=candidate.values(found),
            error=float(np.square(misses).sum()),
            misses=tuple(float(one) for one in misses),
            driven=[float(one) for one in found.theta],
            defects=found.defects,
            order=found.order,
            grashof=candidate.described,
            transmission_min=candidate.transmission(found),
            margins=margins,
            zeros=candidate.zeros,
        )
        return design, why

    def best(self, count: int, exact: float) -> list[Design]:
        """The best of the kept ones by their errors, of exact ones by their transmission angles."""
        self.kept.sort(key=lambda one: (max(one.error, exact), -_certain(one.transmission_min)))
        return self.kept[:count]

    def far(self) -> list[str]:
        """A note where even the first of the kept designs is far from a point."""
        misses = self.kept[0].misses
        worst = int(np.argmax(misses))
        if misses[worst] <= FAR * self.size:
            return []
        return [
            f"no design is near all points: the first is off by {misses[worst]:.3g} {self.unit} at "
            f"point {worst + 1}; widen the bounds or try more designs (search); tolerance leaves "
            "out what is off by more"
        ]

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
