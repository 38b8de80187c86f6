"""What ends the modes of contacts, as SciPy's integrators take it."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["ModeGuard"]

Array = np.ndarray

#: What begins within this part of the size of its terms begins at zero; it is this part above it.
ROUNDED, HARDLY = 1e-10, 1e-13


class ModeGuard:
    """A function whose zero ends the modes, as the integrator takes it."""

    terminal, direction = True, -1.0
    next: tuple[int, str] = (0, "")
    #: What is added, so that what begins at zero, or by rounding below it, falls through zero.
    shift = 0.0

    def __init__(self, function: Any, *more: Any) -> None:
        self.function, self.more = function, more

    def __call__(self, t: float, y: Array) -> float:
        """Its value at a state."""
        return float(self.function(t, y, *self.more)) + self.shift

    def begin(self, t: float, y: Array, size: float) -> None:
        """Set the shift of what begins at a state, `size` being that of its terms."""
        value = self(t, y)
        self.shift = HARDLY * size - value if abs(value) <= ROUNDED * size else 0.0
