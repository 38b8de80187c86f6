"""The cross-check of a result by another engine: rows of numbers, with the expected difference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from mbody.core.presentation import Presented
from mbody.solution.solution import Solution
from mbody.system.system import System

AGREES, DIFFERS = "agrees", "differs"


@dataclass(frozen=True)
class Row(Presented):
    """One quantity, by both engines.

    `quantity`: ``"motor.effort"``, ``"A.force"``, ``"crank.angle"``, at the instant of the greatest
      difference.
    `ours`, `theirs`: Its values there, in the units of the mechanism.
    `difference`: Relative to the greatest value of its kind (forces, torques, angles) over all
      instants.
    `expected`: The greatest difference that still agrees for this engine.
    `reason`: Why this difference is expected.
    """

    quantity: str
    ours: float
    theirs: float
    difference: float
    expected: float
    reason: str

    declared = ("quantity", "ours", "theirs", "difference", "expected", "reason", "verdict")

    @property
    def verdict(self) -> str:
        """``"agrees"`` or ``"differs"``; NaN differs."""
        return AGREES if self.difference <= self.expected else DIFFERS


@dataclass(frozen=True)
class Inexpressible(Presented):
    """An element that an engine cannot model, and why."""

    element: str
    why: str


@dataclass(frozen=True)
class CrosscheckResult(Presented):
    """The cross-check of one result by one engine.

    `engine`: With its version.
    `not_expressible`: What this engine could not check: elements, or the whole model.
    `notes`: How the check was made.
    `adopted`: Elements whose forces it took from the result, by formulas of mbody.
    """

    engine: str
    rows: tuple[Row, ...]
    not_expressible: tuple[Inexpressible, ...] = ()
    notes: tuple[str, ...] = ()
    adopted: tuple[str, ...] = ()

    declared = ("engine", "rows", "not_expressible", "notes")

    @property
    def agrees(self) -> bool:
        """Whether no row differs."""
        return all(row.verdict == AGREES for row in self.rows)

    @property
    def verdict(self) -> str:
        """``"agrees"``, ``"differs"``, or ``"compared nothing"``."""
        if not self.rows:
            return "compared nothing"
        return AGREES if self.agrees else DIFFERS


class Engine(Protocol):
    """The function `crosscheck_result` of an engine; each engine is a module of `mbody.engines`."""

    def __call__(self, system: System, run: Solution) -> CrosscheckResult:
        """Check a result, of kinetostatics, statics or simulate, against this engine's own.

        The other engine models `system`. The run may be of another system with the same names, as
        in tests with a planted fault.
        """


# -- Rows of a cross-check from the histories of both engines -------------------------------------

Array = np.ndarray


@dataclass
class Comparison:
    """Collects histories of quantities and makes a row of each.

    Differences are relative to the greatest value of their kind (all forces, all torques …) over
    all instants. A row has the instant at which the difference is greatest relative to the expected
    one.
    """

    kinds: dict[str, list[tuple[str, Array, Array]]] = field(default_factory=dict)
    sizes: dict[str, float] = field(default_factory=dict)

    def add(self, kind: str, quantity: str, ours: Any, theirs: Any) -> None:
        """Histories (instants,) of one quantity."""
        pair = np.atleast_1d(np.asarray(ours, dtype=float)), np.atleast_1d(theirs)
        self.kinds.setdefault(kind, []).append((quantity, *pair))

    def size(self, kind: str, values: Any) -> None:
        """Set the least reference value of a kind, as a length of the mechanism."""
        top = float(np.abs(values).max(initial=0.0))
        self.sizes[kind] = max(self.sizes.get(kind, 0.0), top)

    def top(self, kind: str) -> float:
        """The greatest value of a kind over all instants; 1 where all are zero."""
        parts = [part for _, *both in self.kinds.get(kind, []) for part in both]
        tops = [float(np.abs(part[np.isfinite(part)]).max(initial=0.0)) for part in parts]
        return max([*tops, self.sizes.get(kind, 0.0)]) or 1.0

    def rows(self, expected: dict[str, Array | float], reasons: dict[str, str]) -> list[Row]:
        """A row for each quantity; the expected differences are by kind, one number or one
        per instant.
        """
        found = []
        for kind, quantities in self.kinds.items():
            top = self.top(kind)
            for quantity, ours, theirs in quantities:
                part = np.abs(theirs - ours) / top
                # NaN differs most
                part = np.where(np.isnan(part), np.inf, part)
                limit = np.broadcast_to(expected[kind], part.shape)
                if not part.size:
                    continue
                k = int(np.argmax(part / limit))
                found.append(
                    Row(
                        quantity,
                        float(ours[k]),
                        float(theirs[k]),
                        float(part[k]),
                        float(limit[k]),
                        reasons[kind],
                    )
                )
        return found
