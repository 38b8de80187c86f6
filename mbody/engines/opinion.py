"""The opinion of another engine on a result: rows of numbers, with the expected difference."""

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
        ``"motor.effort"``, ``"A.force"``, ``"crank.angle"``, at the instant of the greatest
        difference.
    ours, theirs : float
        Its values there, in the units of the mechanism.
    difference : float
        Relative to the greatest value of its kind (forces, torques, angles) over all instants.
    expected : float
        The greatest difference that still agrees for this engine.
    reason : str
        Why this difference is expected.
    """

    quantity: str
    ours: float
    theirs: float
    difference: float
    expected: float
    reason: str

    @property
    def verdict(self) -> str:
        """``"agrees"`` or ``"differs"``; NaN differs."""
        return AGREES if self.difference <= self.expected else DIFFERS

    def data(self) -> dict[str, Any]:
        """The same, ready for JSON."""
        data = {key: getattr(self, key) for key in ("quantity", "ours", "theirs", "difference")}
        return data | {"expected": self.expected, "reason": self.reason, "verdict": self.verdict}


@dataclass(frozen=True)
class Inexpressible:
    """An element that an engine cannot model, and why."""

    element: str
    why: str

    def data(self) -> dict[str, str]:
        """The same, ready for JSON."""
        return {"element": self.element, "why": self.why}


@dataclass(frozen=True)
class Opinion:
    """The opinion of one engine on one result.

    Attributes
    ----------
    engine : str
        With its version.
    rows : tuple of Row
    not_expressible : tuple of Inexpressible
        What this engine could not check: elements, or the whole model.
    notes : tuple of str
        How the check was made.
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
    """The function `opinion` of an engine; each engine is a module of `mbody.engines`."""

    def __call__(self, system: System, run: Solution) -> Opinion:
        """Check a result, of kinetostatics, statics or simulate, against this engine's own.

        The other engine models `system`. The run may be of another system with the same names, as
        in tests with a planted fault.
        """
