"""An optimization as a description asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mbody.errors import ModelError, brief

__all__ = ["OptimizationTask"]


@dataclass(frozen=True)
class OptimizationTask:
    """What is to be least or greatest, by which numbers, within which limits.

    Parameters
    ----------
    minimize, maximize : tuple of str
        One aim, or two in all.
    by : mapping
        (low, high) by number.
    subject_to : tuple of str
    analysis : str
    over : str
        ``"turn"`` or a driver, as of `Instants`; empty: the instants of the mechanism.
    instants, turns : int, optional
    until : float or str, optional
        The last time, of ``analysis="simulate"``.
    start : mapping, optional
    starts, seed, points : int, optional
        As of `mbody.optimize`.
    note : str
        The task in words.

    >>> OptimizationTask(minimize="peak(motor.effort)", by={"crank.A.x": (1, 2)}).minimize
    ('peak(motor.effort)',)
    """

    minimize: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    by: Mapping[str, Any] | None = None
    subject_to: tuple[str, ...] = ()
    analysis: str = "kinetostatics"
    over: str = ""
    instants: int | None = None
    turns: int | None = None
    until: Any = None
    start: Mapping[str, Any] | None = None
    starts: int | None = None
    seed: int | None = None
    points: int | None = None
    note: str = ""

    def __post_init__(self) -> None:
        for key in ("minimize", "maximize", "subject_to"):
            given = getattr(self, key)
            several = (given,) if isinstance(given, str) else tuple(given)
            for text in several:
                if not isinstance(text, str):
                    raise ModelError(f"optimization: {key} takes texts, not {brief(text)}")
            object.__setattr__(self, key, several)

    def arguments(self) -> dict[str, Any]:
        """The arguments of `mbody.optimize`."""
        found: dict[str, Any] = {
            "minimize": list(self.minimize) or None,
            "maximize": list(self.maximize) or None,
            "by": self.by,
            "subject_to": self.subject_to,
            "analysis": self.analysis,
            "start": self.start,
        }
        for key in ("starts", "seed", "points", "instants", "turns", "until"):
            if getattr(self, key) is not None:
                found[key] = getattr(self, key)
        if self.over:
            found["over"] = self.over
        return found
