"""Rows of an opinion from the histories of both engines."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.engines.opinion import Row

__all__ = ["Comparison"]

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
