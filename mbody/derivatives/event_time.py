"""When something happens in a motion, with derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["EventTime"]


@dataclass(frozen=True, eq=False)
class EventTime:
    """When something happens in a motion, with derivatives.

    Attributes
    ----------
    name, contact : str
        As of `EventRecord`.
    t : float
    row : array (numbers,)
        NaN where there is none.
    """

    name: str
    contact: str
    t: float
    row: np.ndarray
