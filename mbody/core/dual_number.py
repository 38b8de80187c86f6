"""Dual numbers in plain Python: a number, or an array of them, with derivatives by parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np


class DualNumber:
    """A number, or an array of them, with derivatives by parameters. tangents (…, parameters).

    Examples
    --------
    >>> x = DualNumber(2.0, [1.0, 0.0])
    >>> (x * x + np.sin(x)).tangents.round(6).tolist()
    [3.583853, 0.0]
    """

    __slots__ = ("tangents", "value")
    # none can be a key: equality compares values, and two equal ones may have other tangents
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, value: Any, tangents: Any) -> None:
        self.value, self.tangents = value, np.asarray(tangents, dtype=np.float64)

    def __repr__(self) -> str:
        return f"DualNumber({self.value!r}, {self.tangents!r})"

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the value."""
        return np.shape(self.value)

    @property
    def ndim(self) -> int:
        """Axes of the value."""
        return np.ndim(self.value)

    def __len__(self) -> int:
        return len(self.value)

    def __getitem__(self, place: Any) -> DualNumber:
        return DualNumber(self.value[place], self.tangents[place])

    def __float__(self) -> float:
        raise TypeError("float() of a dual number would lose its derivatives")

    def __bool__(self) -> bool:
        return bool(self.value)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method == "reduce" and ufunc.__name__ in _ABOUT:  # `numpy.any` and `numpy.all`
            return ufunc.reduce(value(inputs[0]), **options)
        if method != "__call__" or options:
            return NotImplemented
        return _applied(ufunc, inputs)

    def __add__(self, other: Any) -> Any:
        return _applied(np.add, (self, other))

    def __radd__(self, other: Any) -> Any:
        return _applied(np.add, (other, self))

    def __sub__(self, other: Any) -> Any:
        return _applied(np.subtract, (self, other))

    def __rsub__(self, other: Any) -> Any:
        return _applied(np.subtract, (other, self))

    def __mul__(self, other: Any) -> Any:
        return _applied(np.multiply, (self, other))

    def __rmul__(self, other: Any) -> Any:
        return _applied(np.multiply, (other, self))

    def __truediv__(self, other: Any) -> Any:
        return _applied(np.divide, (self, other))

    def __rtruediv__(self, other: Any) -> Any:
        return _applied(np.divide, (other, self))

    def __pow__(self, other: Any) -> Any:
        return _applied(np.power, (self, other))

    def __rpow__(self, other: Any) -> Any:
        return _applied(np.power, (other, self))

    def __mod__(self, other: Any) -> Any:
        return _applied(np.mod, (self, other))

    def __neg__(self) -> Any:
        return DualNumber(-self.value, -self.tangents)

    def __pos__(self) -> DualNumber:
        return self

    def __abs__(self) -> Any:
        return _applied(np.absolute, (self,))

    def __eq__(self, other: Any) -> Any:
        return self.value == value(other)

    def __ne__(self, other: Any) -> Any:
        return self.value != value(other)

    def __lt__(self, other: Any) -> Any:
        return self.value < value(other)

    def __le__(self, other: Any) -> Any:
        return self.value <= value(other)

    def __gt__(self, other: Any) -> Any:
        return self.value > value(other)

    def __ge__(self, other: Any) -> Any:
        return self.value >= value(other)


#: Where functions were evaluated that have no derivative there, as |x| at 0: names of functions.
_corners: ContextVar[set[str] | None] = ContextVar("corners", default=None)


@contextmanager
def corners() -> Iterator[set[str]]:
    """Collect the names of functions that were evaluated where they have no derivative.

    >>> with corners() as found:
    ...     x = np.abs(DualNumber(0.0, [1.0]))
    >>> found
    {'absolute'}
    """
    found: set[str] = set()
    token = _corners.set(found)
    try:
        yield found
    finally:
        _corners.reset(token)


def _at_corner(name: str, values: list[Any], inputs: tuple[Any, ...]) -> bool:
    """Whether a function is evaluated where it has no derivative, of numbers that change."""
    if name in ("absolute", "fabs", "sign", "sqrt"):
        at = np.equal(values[0], 0.0)
    elif name == "hypot":
        at = np.equal(values[0], 0.0) & np.equal(values[1], 0.0)
    elif name in ("minimum", "maximum"):
        at = np.equal(values[0], values[1])
    else:
        return False
    if not at.any():
        return False
    if name == "sqrt":
        return True
    changes = [one.tangents if isinstance(one, DualNumber) else np.zeros(1) for one in inputs]
    change = changes[0] if len(changes) == 1 or name == "hypot" else changes[0] - changes[1]
    return bool((np.abs(change).max(axis=-1, initial=0.0) * at).any())


#: Functions by whose derivative the chain rule goes: g′(x), or both partial derivatives.
_DERIVATIVES: dict[str, Any] = {
    "positive": lambda x: (1.0,),
    "negative": lambda x: (-1.0,),
    "add": lambda x, y: (1.0, 1.0),
    "subtract": lambda x, y: (1.0, -1.0),
    "multiply": lambda x, y: (y, x),
    "divide": lambda x, y: (1.0 / y, -x / y / y),
    "reciprocal": lambda x: (-1.0 / (x * x),),
    "square": lambda x: (2.0 * x,),
    "sqrt": lambda x: (0.5 / np.sqrt(x),),
    "absolute": lambda x: (np.where(np.less(x, 0.0), -1.0, 1.0),),
    "fabs": lambda x: (np.where(np.less(x, 0.0), -1.0, 1.0),),
    "sin": lambda x: (np.cos(x),),
    "cos": lambda x: (-np.sin(x),),
    "tan": lambda x: (1.0 + np.tan(x) ** 2,),
    "arcsin": lambda x: (1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
    "arccos": lambda x: (-1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
    "arctan": lambda x: (1.0 / (1.0 + x * x),),
    "tanh": lambda x: (1.0 - np.tanh(x) ** 2,),
    "exp": lambda x: (np.exp(x),),
    "log": lambda x: (1.0 / x,),
    "sign": lambda x: (0.0,),
    "floor": lambda x: (0.0,),
    "deg2rad": lambda x: (math.pi / 180.0,),
    "radians": lambda x: (math.pi / 180.0,),
    "rad2deg": lambda x: (180.0 / math.pi,),
    "degrees": lambda x: (180.0 / math.pi,),
    "hypot": lambda x, y: (x / np.hypot(x, y), y / np.hypot(x, y)),
    "arctan2": lambda x, y: (y / (x * x + y * y), -x / (x * x + y * y)),
    "remainder": lambda x, y: (1.0, -np.floor_divide(x, y)),
}


def _power(x: Any, y: Any) -> tuple[Any, Any]:
    """y x^(y−1) and x^y log x: 0 where the factor before is, also where the other is infinite."""
    f = np.power(x, y)
    by_x = np.where(y == 0.0, 0.0, y * np.power(x, y - 1.0))
    return by_x, np.where(f == 0.0, 0.0, f * np.log(x))


def _first(x: Any, y: Any, before: Any) -> Any:
    """Where the first of two is taken, as of `mbody.core.lanes.smaller`."""
    return np.isnan(x) | before(x, y)


def _smaller(x: Any, y: Any) -> tuple[Any, Any]:
    first = np.where(_first(x, y, np.less), 1.0, 0.0)
    return first, 1.0 - first


def _larger(x: Any, y: Any) -> tuple[Any, Any]:
    first = np.where(_first(x, y, np.greater), 1.0, 0.0)
    return first, 1.0 - first


_DERIVATIVES["minimum"], _DERIVATIVES["maximum"] = _smaller, _larger
_DERIVATIVES["power"] = _DERIVATIVES["float_power"] = _power
#: Functions that ask about values.
_ABOUT = {
    "less",
    "less_equal",
    "greater",
    "greater_equal",
    "equal",
    "not_equal",
    "isfinite",
    "isnan",
    "signbit",
    "logical_not",
    "logical_and",
    "logical_or",
}


def _applied(ufunc: Any, inputs: tuple[Any, ...]) -> Any:
    """A function of NumPy of numbers of which one at least is dual."""
    name = ufunc.__name__
    values = [value(one) for one in inputs]
    noted = _corners.get()
    if noted is not None and _at_corner(name, values, inputs):
        noted.add(name)
    with np.errstate(all="ignore"):
        found = ufunc(*values)
        if name in _ABOUT:
            return found
        if name not in _DERIVATIVES:
            raise TypeError(f"numpy.{name} has no derivative here")
        change: Any = 0.0
        # Python's own floats would stop at 1/0, where NumPy's go on
        slopes = _DERIVATIVES[name](*(np.asarray(each)[()] for each in values))
        for one, slope in zip(inputs, slopes, strict=True):
            if isinstance(one, DualNumber):
                tangents = one.tangents
                if one.ndim < np.ndim(found):
                    missing = (1,) * (np.ndim(found) - one.ndim)
                    tangents = tangents.reshape(missing + tangents.shape)
                # what does not change leaves no trace where a slope is infinite
                part = np.multiply(np.asarray(slope)[..., None], tangents)
                change = change + np.where(tangents == 0.0, 0.0, part)
    return DualNumber(found, np.broadcast_to(change, (*np.shape(found), change.shape[-1])))


def where(choice: Any, x: Any, y: Any) -> Any:
    """`numpy.where` of numbers of which some may be dual.

    >>> where(True, DualNumber(2.0, [1.0]), 3.0).tangents
    array([1.])
    """
    both = x, y
    duals = [one for one in both if isinstance(one, DualNumber)]
    if not duals:
        return np.where(choice, x, y)
    width = duals[0].tangents.shape[-1]
    changes = [one.tangents if isinstance(one, DualNumber) else np.zeros(width) for one in both]
    found = np.where(choice, value(x), value(y))
    return DualNumber(found, np.where(np.asarray(choice)[..., None], *changes))


def value(x: Any) -> Any:
    """The value of a dual number; any other number as it is."""
    return x.value if isinstance(x, DualNumber) else x
