"""Results of a sweep in memory."""

from __future__ import annotations

import numpy as np

from mbody.solution.doubts import Doubt
from mbody.sweeps.job import Job, PieceResult

__all__ = ["ResultsInMemory"]


class ResultsInMemory:
    """Columns of all designs."""

    def __init__(self, job: Job, designs: int) -> None:
        self.result = PieceResult(job.empty(designs))
        self.done = np.zeros(designs, dtype=bool)

    @property
    def failures(self) -> dict[int, str]:
        """Error message of each failed design."""
        return self.result.failures

    @property
    def doubts(self) -> dict[int, tuple[Doubt, ...]]:
        """Doubts of each design that has some."""
        return self.result.doubts

    def missing(self, pieces: list[int]) -> list[int]:
        """First designs of the pieces that are not done."""
        return pieces

    def keep(self, low: int, part: PieceResult) -> None:
        """Store the results of the designs from `low` on."""
        self.result.put(low, part)
        self.done[low : low + len(part.columns[0])] = True

    def column(self, index: int) -> np.ndarray:
        """One column."""
        return self.result.columns[index]
