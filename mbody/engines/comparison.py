"""Rows of an opinion from histories of both sides: the instant that is told, and the difference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.engines.opinion import Row

__all__ = ["Comparison"]

Array = np.ndarray


@dataclass
class Comparison:
    """Collects histories of quantities, and makes a row of each in the end.

    A difference is a part of the greatest of its kind (all forces, all torques …) over all
    instants. A row tells the instant at which it is the greatest part of what is expected there.
    """

    kinds: dict[str, list[tuple[str, Array, Array]]] = field(default_factory=dict)
    sizes: dict[str, float] = field(default_factory=dict)

    def add(self, kind: str, quantity: str, ours: Any, theirs: Any) -> None:
        """Histories (instants,) of one quantity."""
        pair = np.atleast_1d(np.asarray(ours, dtype=float)), np.atleast_1d(theirs)
        self.kinds.setdefault(kind, []).append((quantity, *pair))

    def size(self, kind: str, values: Any) -> None:
        """What differences of a kind are a part of at least, as a length of the mechanism."""
        top = float(np.abs(values).max(initial=0.0))
        self.sizes[kind] = max(self.sizes.get(kind, 0.0), top)

    def top(self, kind: str) -> float:
        """The greatest of a kind over all instants; 1 where all is zero."""
        parts = [part for _, *both in self.kinds.get(kind, []) for part in both]
        tops = [float(np.abs(part[np.isfinite(part)]).max(initial=0.0)) for part in parts]
        return max([*tops, self.sizes.get(kind, 0.0)]) or 1.0

    def rows(self, expected: dict[str, Array | float], reasons: dict[str, str]) -> list[Row]:
        """A row each; what is expected by kind, one number or one an instant."""
        found = []
        for kind, quantities in self.kinds.items():
            top = self.top(kind)
            for quantity, ours, theirs in quantities:
                part = np.abs(theirs - ours) / top
                # what is no number differs most
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
