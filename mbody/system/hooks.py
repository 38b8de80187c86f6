"""Users' plain Python as the kernels call it: functions of arrays (x, y) that fill y.

A number that is not finite is an error of the user's function, and raised at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.laws import Law
from mbody.model.primitives import ConstraintPrimitive, ForcePrimitive

__all__ = ["action_hook", "primitive_hook", "law_hook"]

Hook = Callable[[np.ndarray, np.ndarray], None]


def primitive_hook(primitive: ConstraintPrimitive) -> Hook | None:
    """Rows of a user's joint: y = (Φ, blocks, ν, γ)."""
    return None if primitive.function is None else _Hook(primitive.function, 18)


def action_hook(action: ForcePrimitive) -> Hook | None:
    """Forces of a user's load: y = (Fx, Fy, T on i, then on j)."""
    return None if action.function is None else _Hook(action.function, 6)


def law_hook(law: Law, derivatives: bool) -> Hook | None:
    """A law that is a Python function: y = (f, f′, f″)."""
    return law.hook(derivatives)


class _Hook:
    """Unpacks (t, side i, side j, parameters) for a user's physics, checks what it returns."""

    def __init__(self, function: Callable[..., Any], size: int) -> None:
        self.function = function
        self.size = size

    def __call__(self, x: np.ndarray, y: np.ndarray) -> None:
        sides = tuple(x[1:9].tolist()), tuple(x[9:17].tolist())
        result = self.function(*sides, x[17:].copy(), float(x[0]))
        if result is None:
            raise ValueError("physics returned nothing")
        values = np.concatenate([np.ravel(part) for part in result]).astype(np.float64)
        if values.shape != (self.size,):
            raise ValueError(f"physics gave {values.size} numbers, {self.size} are wanted")
        if not np.isfinite(values).all():
            raise ValueError(f"physics gave a number that is not finite at t = {x[0]:g}")
        y[:] = values
