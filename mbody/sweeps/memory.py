"""Results of a sweep in memory."""

from __future__ import annotations

import numpy as np

from mbody.solution.doubts import Doubt
from mbody.sweeps.job import Job, PieceResult

__all__ = ["ResultsInMemory"]


class ResultsInMemory:
    """Columns of all designs."""

    def __init__(self, job: Job, designs: int) -> None:
        self.columns = job.empty(designs)
        self.failures: dict[int, str] = {}
        self.doubts: dict[int, tuple[Doubt, ...]] = {}
        self.done = np.zeros(designs, dtype=bool)

    def missing(self, pieces: list[int]) -> list[int]:
        """First designs of the pieces that are not done."""
        return pieces

    def keep(self, low: int, part: PieceResult) -> None:
        """Store the results of the designs from `low` on."""
        count = len(part.columns[0])
        for whole, piece in zip(self.columns, part.columns, strict=True):
            whole[low : low + count] = piece
        self.failures |= {low + design: message for design, message in part.failures.items()}
        self.doubts |= {low + design: message for design, message in part.doubts.items()}
        self.done[low : low + count] = True

    def column(self, index: int) -> np.ndarray:
        """One column."""
        return self.columns[index]
