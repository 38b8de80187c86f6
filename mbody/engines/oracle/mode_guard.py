"""What ends the modes of contacts, as SciPy's integrators take it."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["ModeGuard"]

Array = np.ndarray


class ModeGuard:
    """A function whose zero ends the modes, as the integrator takes it."""

    terminal, direction = True, -1.0
    next: tuple[int, str] = (0, "")

    def __init__(self, function: Any, *more: Any) -> None:
        self.function, self.more = function, more

    def __call__(self, t: float, y: Array) -> float:
        """Its value at a state."""
        return float(self.function(t, y, *self.more))
