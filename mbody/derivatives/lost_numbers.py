"""Numbers by which a motion has no derivatives from some time on, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mbody.model.element import listed

__all__ = ["LostNumbers"]

Array = np.ndarray


class LostNumbers:
    """Numbers by which there is no derivative from some time on.

    Parameters
    ----------
    names : sequence of str
        All numbers.
    first : float
        When the motion begins.
    why : mapping
        Numbers that have none from there on, and why.
    """

    def __init__(self, names: Sequence[str], first: float, why: Mapping[str, str]) -> None:
        self.names = list(names)
        self.why = {name: (first, one) for name, one in why.items()}

    @property
    def gone(self) -> Array:
        """Which of them these are, (names,)."""
        return np.array([name in self.why for name in self.names], dtype=bool)

    def lose(self, which: Array | bool, t: float, why: str) -> None:
        """There are no derivatives by some numbers, or by any, any more."""
        some = np.broadcast_to(which, len(self.names))
        for name, gone in zip(self.names, some, strict=True):
            if gone:
                self.why.setdefault(name, (t, why))

    def without(self, changes: Array, instants: Array) -> None:
        """NaN by these numbers in changes (instants, rows, names), at some instants."""
        gone = np.flatnonzero(self.gone)
        changes[np.ix_(instants, np.arange(changes.shape[1]), gone)] = np.nan

    def notes(self, unit: str) -> list[str]:
        """Sentences; times have the unit."""
        found = []
        for t, why in dict.fromkeys(self.why.values()):
            names = [name for name, one in self.why.items() if one == (t, why)]
            by = "" if len(names) == len(self.names) else f" by {listed(names)}"
            found.append(f"from t = {t:.6g} {unit} on there is no derivative{by}: {why}")
        return found
