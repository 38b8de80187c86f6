"""The operations and functions of formulas on numbers and arrays, by NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["COMPUTE", "ONE", "TWO"]

#: Functions of one number, and of two, by their names in formulas.
OF_ONE: dict[str, Callable[[Any], Any]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "exp": np.exp,
    "log": np.log,
    "sign": np.sign,
    # by a comparison that traced numbers record
    "step": lambda x: 1.0 - np.less(x, 0.0),
}
OF_TWO: dict[str, Callable[[Any, Any], Any]] = {
    "atan2": np.arctan2,
    "hypot": np.hypot,
    "min": np.minimum,
    "max": np.maximum,
}
#: All functions, those that are written by others of them too.
COMPUTE: dict[str, Callable[..., Any]] = {
    **OF_ONE,
    **OF_TWO,
    "clamp": lambda x, low, high: np.maximum(np.minimum(x, high), low),
    "deadband": lambda x, width: x - np.maximum(np.minimum(x, width), -width),
}
#: Operations of compiled formulas (`mbody.laws.postfix`) on one number, and on two.
ONE: dict[str, Callable[[Any], Any]] = {"negative": np.negative, **OF_ONE}
TWO: dict[str, Callable[[Any, Any], Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "^": np.power,
    **OF_TWO,
}
