"""Laws: scalar functions of one variable with first and second derivative.

Of time for drivers (position, rate, acceleration) and forces; of deflection or rate for springs
and dampers. Common laws are compiled; `Function` takes any Python function.

>>> from mbody.laws import Harmonic
>>> Harmonic(mean=1.0, amplitude=2.0, frequency=3.0)(0.0)
1.0
"""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import Law, finite
from mbody.laws.cams import Cam, Dwell, Rise
from mbody.laws.elementary import (
    Constant,
    ConstantAcceleration,
    ConstantSpeed,
    Harmonic,
    Polynomial,
)
from mbody.laws.function import Function
from mbody.laws.kernels import LAW_KINDS, SHAPES, evaluate, law
from mbody.laws.tables import Table
from mbody.laws.times import times_of

__all__ = [
    "LAW_KINDS",
    "SHAPES",
    "Law",
    "Constant",
    "ConstantSpeed",
    "ConstantAcceleration",
    "Polynomial",
    "Harmonic",
    "Table",
    "Rise",
    "Dwell",
    "Cam",
    "Function",
    "as_law",
    "law",
    "evaluate",
    "times_of",
]


def as_law(value: Any) -> Law:
    """The law that a value stands for: a number is a `Constant`, a Python function a `Function`.

    Raises
    ------
    ModelError
        Anything else.

    >>> as_law(3)
    Constant(value=3.0)
    """
    if isinstance(value, Law):
        return value
    if isinstance(value, Real) and not isinstance(value, bool | np.bool_):
        return Constant(finite(value, "law", "value"))
    if isinstance(value, type) and issubclass(value, Law):
        raise ModelError(
            f"a law is made from its numbers: {value.__name__}(...), not the class "
            f"{value.__name__} itself"
        )
    if callable(value) and not isinstance(value, type):
        return Function(value)
    raise ModelError(
        f"a law must be a number, a law such as ConstantSpeed(0, 10), or a function of "
        f"one number, not {value!r}; for points use Table(x, y)"
    )
