"""Conversion of values from one unit to another."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.quantities.evaluate import Scope, dimension_text, evaluate
from mbody.quantities.parse import FormulaError, parse_unit

__all__ = ["convert", "deg", "degrees_of", "rpm", "short_degrees"]


def short_degrees(value: float) -> float:
    """An angle [rad] in degrees, with the fewest digits that mean the same angle.

    >>> short_degrees(math.radians(60.0)), math.degrees(math.radians(60.0))
    (60.0, 59.99999999999999)
    """
    degrees = math.degrees(value)
    for digits in range(14):
        short = round(degrees, digits)
        if math.radians(short) == value:
            return short
    return degrees


def degrees_of(values: Any) -> np.ndarray:
    """Angles [rad] in degrees, to fifteen digits: what follows is the rounding of the conversion,
    which shows as 59.99999999999999.

    >>> degrees_of([math.radians(60.0), math.nan]).tolist()
    [60.0, nan]
    """
    degrees = np.degrees(np.asarray(values, dtype=float))
    sizes = np.abs(degrees)
    plain = (sizes > 1e-7) & (sizes < 1e12)  # 10^k is exact up to k = 22
    scale = 10.0 ** (14 - np.floor(np.log10(np.where(plain, sizes, 1.0))))
    return np.where(plain, np.rint(degrees * scale) / scale, degrees)


def convert(values: Any, unit: str, to: str) -> Any:
    """Values in another unit: a float or an array of any shape.

    Parameters
    ----------
    values : float or array
        In `unit`.
    unit, to : str
        Such as ``"lbf in"``, ``"N*m"``, ``"rev/min"``.

    Raises
    ------
    ModelError
        For an unknown unit, or two units of different dimensions.

    >>> round(convert(243.2375907612, "lbf in", "N m"), 6)
    27.482158
    """
    try:
        old, new = (evaluate(parse_unit(name), Scope()) for name in (unit, to))
        if old.dimension != new.dimension or old.dimension is None or new.dimension is None:
            kinds = [dimension_text(v.dimension) if v.dimension else "no unit" for v in (old, new)]
            raise FormulaError(f"'{unit}' is {kinds[0]}, '{to}' is {kinds[1]}")
        if not (0.0 < abs(old.value) < math.inf and 0.0 < abs(new.value) < math.inf):
            raise FormulaError(f"'{unit}' or '{to}' is not a unit")
        return values * (old.value / new.value)
    except FormulaError as error:
        raise ModelError(f"cannot convert: {error}") from None


def deg(angle: float) -> float:
    """Degrees to radians.

    >>> deg(180.0) == math.pi
    True
    """
    return math.radians(angle)


def rpm(speed: float) -> float:
    """Revolutions a minute to rad/s.

    >>> round(rpm(60.0), 6)
    6.283185
    """
    return speed * (math.pi / 30.0)
