"""The one table of first derivatives: partial derivatives of NumPy's functions, in their terms.

A rule computes by operators and by NumPy's functions alone. So it holds for all numbers that know
these: floats and arrays (`mbody.core.lanes.DualNumber`), compiled floats
(`mbody.compiler.numba_duals`), recorded steps (`mbody.system.formula_steps`) and intervals
(`mbody.laws.steep_places`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np


def weighted(factor: Any, other: Any) -> Any:
    """A product: of floats 0 where the factor is, also where the other is infinite."""
    found = factor * other
    floats = isinstance(found, np.floating | np.ndarray)
    return np.where(factor == 0.0, 0.0, found) if floats else found


def before(x: Any, y: Any) -> Any:
    """1 where x < y, else 0."""
    return -np.minimum(np.sign(x - y), 0.0)


#: By the name of a function, its partial derivatives: g its value, then its arguments. One that is
#: always the same number is that number.
SLOPES: dict[str, tuple[float | Callable[..., Any], ...]] = {
    "positive": (1.0,),
    "negative": (-1.0,),
    "reciprocal": (lambda g, x: -g * g,),
    "square": (lambda g, x: 2.0 * x,),
    "sqrt": (lambda g, x: 0.5 / g,),
    "absolute": (lambda g, x: 1.0 - 2.0 * before(x, 0.0),),
    "sin": (lambda g, x: np.cos(x),),
    "cos": (lambda g, x: -np.sin(x),),
    "tan": (lambda g, x: 1.0 + g * g,),
    "arcsin": (lambda g, x: 1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
    "arccos": (lambda g, x: -1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
    "arctan": (lambda g, x: 1.0 / (1.0 + x * x),),
    "tanh": (lambda g, x: 1.0 - g * g,),
    "exp": (lambda g, x: g,),
    "log": (lambda g, x: 1.0 / x,),
    "sign": (0.0,),
    "floor": (0.0,),
    "deg2rad": (math.pi / 180.0,),
    "rad2deg": (180.0 / math.pi,),
    "add": (1.0, 1.0),
    "subtract": (1.0, -1.0),
    "multiply": (lambda g, x, y: y, lambda g, x, y: x),
    "divide": (lambda g, x, y: 1.0 / y, lambda g, x, y: -g / y),
    "power": (
        lambda g, x, y: weighted(y, np.power(x, y - 1.0)),
        lambda g, x, y: weighted(g, np.log(x)),
    ),
    # the compiler tells functions apart by their lines
    "hypot": (
        lambda g, x, y: x / g,
        lambda g, x, y: y / g,
    ),
    "arctan2": (
        lambda g, x, y: y / (x * x + y * y),
        lambda g, x, y: -x / (x * x + y * y),
    ),
    # of equal ones the second
    "minimum": (lambda g, x, y: before(x, y), lambda g, x, y: 1.0 - before(x, y)),
    "maximum": (lambda g, x, y: before(y, x), lambda g, x, y: 1.0 - before(y, x)),
    "remainder": (1.0, lambda g, x, y: -np.floor_divide(x, y)),
}
for _name, _same in (
    ("fabs", "absolute"),
    ("float_power", "power"),
    ("radians", "deg2rad"),
    ("degrees", "rad2deg"),
):
    SLOPES[_name] = SLOPES[_same]


def slope(rule: float | Callable[..., Any], g: Any, given: Sequence[Any]) -> Any:
    """The partial derivative that a rule gives of a value g at its arguments."""
    return rule(g, *given) if callable(rule) else rule


def change(name: str, g: Any, given: Sequence[Any], rates: Sequence[Any]) -> Any:
    """The rate of g, which a function gives of numbers that have rates; None where they have none.

    >>> change("multiply", 6.0, [2.0, 3.0], [10.0, None])
    30.0
    """
    found: Any = None
    for rule, rate in zip(SLOPES[name], rates, strict=True):
        if rate is not None and rule != 0.0:
            part = rate if rule == 1.0 else slope(rule, g, given) * rate
            found = part if found is None else found + part
    return found
