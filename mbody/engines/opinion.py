"""What another engine says of a result: rows of numbers, with the difference that is expected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["AGREES", "DIFFERS", "Engine", "Inexpressible", "Opinion", "Row"]

AGREES, DIFFERS = "agrees", "differs"


@dataclass(frozen=True)
class Row:
    """One quantity, by both engines.

    Attributes
    ----------
    quantity : str
        ``"motor.effort"``, ``"A.force"``, ``"crank.angle"``: of all instants, the one at which both
        differ most.
    ours, theirs : float
        Its values there, in the units of the mechanism.
    difference : float
        As a part of the greatest of its kind (forces, torques, angles) over all instants.
    expected : float
        The greatest difference that this engine may show.
    reason : str
        Why so much.
    """

    quantity: str
    ours: float
    theirs: float
    difference: float
    expected: float
    reason: str

    @property
    def verdict(self) -> str:
        """``"agrees"`` or ``"differs"``; what is no number differs."""
        return AGREES if self.difference <= self.expected else DIFFERS

    def data(self) -> dict[str, Any]:
        """The same, ready for JSON."""
        told = {key: getattr(self, key) for key in ("quantity", "ours", "theirs", "difference")}
        return told | {"expected": self.expected, "reason": self.reason, "verdict": self.verdict}


@dataclass(frozen=True)
class Inexpressible:
    """An element that an engine cannot express, and why."""

    element: str
    why: str

    def data(self) -> dict[str, str]:
        """The same, ready for JSON."""
        return {"element": self.element, "why": self.why}


@dataclass(frozen=True)
class Opinion:
    """What one engine says of one result.

    Attributes
    ----------
    engine : str
        With its version.
    rows : tuple of Row
    not_expressible : tuple of Inexpressible
        What this engine could not check, whole elements or, where that ends the matter, the model.
    notes : tuple of str
        Sentences: how it was asked.
    """

    engine: str
    rows: tuple[Row, ...]
    not_expressible: tuple[Inexpressible, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether no row differs."""
        return all(row.verdict == AGREES for row in self.rows)

    def data(self) -> dict[str, Any]:
        """The same, ready for JSON."""
        return {
            "engine": self.engine,
            "rows": [row.data() for row in self.rows],
            "not_expressible": [one.data() for one in self.not_expressible],
            "notes": list(self.notes),
        }


class Engine(Protocol):
    """A second opinion: one file of `mbody.engines` each, with a function of this kind."""

    def __call__(self, system: System, run: Solution) -> Opinion:
        """Check a result, of kinetostatics, statics or simulate, against this engine's own.

        `system` says what the other engine is to build; the run may be of another one of the same
        names (as where a fault is to be found).
        """
