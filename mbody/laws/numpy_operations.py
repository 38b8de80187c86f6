"""The operations of formulas on arrays, by NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["ONE", "TWO"]

#: Operations of `mbody.laws.postfix` on one number, and on two.
ONE: dict[str, Callable[[Any], Any]] = {
    "negative": np.negative,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "exp": np.exp,
    "sign": np.sign,
    "step": lambda x: np.where(np.asarray(x) >= 0.0, 1.0, 0.0),
    "log": np.log,
}
TWO: dict[str, Callable[[Any, Any], Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "^": np.power,
    "atan2": np.arctan2,
    "hypot": np.hypot,
    "min": np.minimum,
    "max": np.maximum,
}
