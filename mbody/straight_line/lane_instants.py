"""The instants of all lanes, and what the drivers prescribe at them."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from mbody.kernels.continuation_lanes import LanePath


@dataclass(frozen=True, eq=False)
class LaneInstants:
    """The fields of `LanePath`; kernels take that one, which takes time to make."""

    mode: int
    s: np.ndarray
    t: np.ndarray
    given: np.ndarray
    reach: float
    with_forces: bool
    at_rest: bool

    @functools.cached_property
    def path(self) -> LanePath:
        """The same for kernels."""
        names = LanePath.fields
        return LanePath(**{name: getattr(self, name) for name in names})
