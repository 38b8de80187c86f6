"""Columns of numbers: of one description a number a row, of a batch of designs an array."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

__all__ = ["designs_of", "stacked"]


def designs_of(numbers: Mapping[str, Any]) -> int:
    """How many designs there are in numbers by name, floats or arrays (designs,).

    >>> designs_of({"a": 1.0, "b": np.zeros(3)})
    3
    """
    arrays = [value for value in numbers.values() if type(value) is not float]
    return max((np.size(value) for value in arrays if np.ndim(value)), default=1)


def stacked(rows: list[Any], designs: int) -> np.ndarray:
    """Numbers and arrays (designs,) as rows of one array (rows, designs)."""
    if designs == 1 and all(isinstance(row, float) for row in rows):
        return np.array(rows, dtype=np.float64).reshape(-1, 1)
    found = np.empty((len(rows), designs))
    for n, row in enumerate(rows):
        found[n] = row
    return found
