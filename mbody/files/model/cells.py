"""Numbers and words as a model file has them: as people write them, and back to the last digit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

__all__ = ["alike", "plain", "short_angle", "word"]


def alike(value: Any, default: Any) -> bool:
    """Whether a value may be left out for a default; −0 is not 0, to the last bit."""
    return value == default and repr(value) == repr(default)


def word(value: Any) -> Any:
    """A word or a truth as files have it."""
    return bool(value) if isinstance(value, np.bool_) else value


def plain(value: float) -> Any:
    """A number as people write it; it reads back the same."""
    whole = value.is_integer() and abs(value) < 1e15 and not (value == 0 and str(value)[0] == "-")
    return int(value) if whole else float(value)


def short_angle(value: float) -> Any:
    """An angle [rad] in degrees where few digits give it exactly, else in radians."""
    degrees = math.degrees(value)
    for digits in range(14):
        short = round(degrees, digits)
        if math.radians(short) == value:
            return plain(short)
    return f"{value!r} rad"
