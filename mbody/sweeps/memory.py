"""Answers of a sweep that are kept in memory."""

from __future__ import annotations

import numpy as np

from mbody.solution.doubts import Doubt
from mbody.sweeps.job import Job, Part

__all__ = ["Memory"]


class Memory:
    """Columns of all designs."""

    def __init__(self, job: Job, designs: int) -> None:
        self.columns = job.empty(designs)
        self.failures: dict[int, str] = {}
        self.doubts: dict[int, tuple[Doubt, ...]] = {}
        self.done = np.zeros(designs, dtype=bool)

    def missing(self, pieces: list[int]) -> list[int]:
        """First designs of the pieces that are still to be done."""
        return pieces

    def keep(self, low: int, part: Part) -> None:
        """Keep the answers of the designs from `low` on."""
        count = len(part.columns[0])
        for whole, piece in zip(self.columns, part.columns, strict=True):
            whole[low : low + count] = piece
        self.failures |= {low + design: told for design, told in part.failures.items()}
        self.doubts |= {low + design: told for design, told in part.doubts.items()}
        self.done[low : low + count] = True

    def column(self, index: int) -> np.ndarray:
        """One column."""
        return self.columns[index]
