"""Numbers that record what is computed with them.

A `NumberRecording` hands out `Traced` numbers for its inputs. Python code that computes with them,
by operators, by NumPy's functions or by those of `mbody.core.lanes`, leaves a list of operations.
Constants are folded; an operation that was recorded before is not recorded again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any, NoReturn

import numpy as np

#: Functions of NumPy that are recorded as they are, by their names. "select_le" is that of
#: `mbody.core.lanes`.
FUNCTIONS = (
    "negative",
    "sin",
    "cos",
    "tan",
    "arcsin",
    "arccos",
    "arctan",
    "sqrt",
    "absolute",
    "exp",
    "log",
    "sign",
    "add",
    "subtract",
    "multiply",
    "divide",
    "power",
    "arctan2",
    "hypot",
    "minimum",
    "maximum",
)
#: Operations whose operands may change places.
SYMMETRIC = ("add", "multiply", "minimum", "maximum", "hypot")


class Untraceable(Exception):
    """Python does with a recorded number what no list of operations repeats."""


class Traced:
    """A number of a recording.

    Operators and NumPy's functions give further ones. What needs its value (a comparison that
    decides, `float`) raises `Untraceable`.
    """

    __slots__ = ("place", "recording")
    # none can be a key: whether two are equal is known only when the list runs
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, recording: NumberRecording, place: int) -> None:
        self.recording, self.place = recording, place

    def __repr__(self) -> str:
        return f"Traced({self.place})"

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or options:
            raise Untraceable(f"numpy.{ufunc.__name__}.{method} of changeable numbers")
        return apply(ufunc.__name__, inputs)

    def __bool__(self) -> NoReturn:
        raise Untraceable("a comparison decides what is computed")

    def __float__(self) -> NoReturn:
        raise Untraceable("float() of a changeable number")

    __int__ = __index__ = __complex__ = __float__

    def __add__(self, other: Any) -> Any:
        return apply("add", (self, other))

    def __radd__(self, other: Any) -> Any:
        return apply("add", (other, self))

    def __sub__(self, other: Any) -> Any:
        return apply("subtract", (self, other))

    def __rsub__(self, other: Any) -> Any:
        return apply("subtract", (other, self))

    def __mul__(self, other: Any) -> Any:
        return apply("multiply", (self, other))

    def __rmul__(self, other: Any) -> Any:
        return apply("multiply", (other, self))

    def __truediv__(self, other: Any) -> Any:
        return apply("divide", (self, other))

    def __rtruediv__(self, other: Any) -> Any:
        return apply("divide", (other, self))

    def __pow__(self, other: Any) -> Any:
        return apply("power", (self, other))

    def __rpow__(self, other: Any) -> Any:
        return apply("power", (other, self))

    def __neg__(self) -> Any:
        return apply("negative", (self,))

    def __pos__(self) -> Traced:
        return self

    def __abs__(self) -> Any:
        return apply("absolute", (self,))

    def __gt__(self, other: Any) -> Any:
        return apply("greater", (self, other))

    def __lt__(self, other: Any) -> Any:
        return apply("less", (self, other))

    def _undecided(self, *_: Any) -> NoReturn:
        raise Untraceable("a comparison or a rounding of a changeable number")

    __eq__ = __ne__ = __ge__ = __le__ = _undecided
    __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = __round__ = _undecided


def _element(name: str) -> Callable[[Any, Any], Any]:
    def method(self: Traced, *others: Any) -> Any:
        return apply(name, (self, *others))

    return method


for _name in FUNCTIONS:  # NumPy calls them for the elements of arrays of objects
    setattr(Traced, _name, _element(_name))
del _name


def apply(name: str, given: tuple[Any, ...]) -> Any:
    """A function of NumPy, by its name, or "select_le", of numbers one of which is traced."""
    if any(isinstance(one, np.ndarray) and one.ndim for one in given):
        arrays = np.broadcast_arrays(*(np.asarray(one, dtype=object) for one in given))
        found = np.empty(arrays[0].shape, dtype=object)
        for place in np.ndindex(found.shape):
            found[place] = apply(name, tuple(array[place] for array in arrays))
        return found
    values = tuple(one[()] if isinstance(one, np.ndarray) else one for one in given)
    recording = next(one.recording for one in values if isinstance(one, Traced))
    places = [recording.place_of(one) for one in values]
    if name == "isfinite":
        return np.True_  # programs look at what they give: `NumberRecording.program`
    if name == "select_le":
        return Traced(recording, recording.operation(name, *places))
    if name in MADE:
        return MADE[name](*(Traced(recording, place) for place in places))
    if name not in FUNCTIONS:
        raise Untraceable(f"numpy.{name} of a changeable number")
    return Traced(recording, recording.operation(name, *places))


def _greater(a: Any, b: Any) -> Any:
    """1 where a > b, else 0; NaN where either is."""
    return np.maximum(np.sign(a - b), 0.0)


#: Functions that are made of others.
MADE: dict[str, Callable[..., Any]] = {
    "positive": lambda a: a,
    "square": lambda a: a * a,
    "tanh": lambda a: 1.0 - 2.0 / (np.exp(2.0 * a) + 1.0),
    "reciprocal": lambda a: 1.0 / a,
    "float_power": lambda a, b: a**b,
    "deg2rad": lambda a: a * (math.pi / 180.0),
    "rad2deg": lambda a: a * (180.0 / math.pi),
    "greater": _greater,
    "less": lambda a, b: _greater(b, a),
}


class NumberRecording:
    """Operations on inputs.

    `inputs`: Names of the inputs.
    `finite`: Whether all numbers are finite, so that zero times one of them is zero.

    `made`: Of every place ``("input", name)``, ``("constant", value)``, or an operation of
      `FUNCTIONS` or ``"select_le"`` with the places that it takes.
    `inputs`: The inputs as traced numbers, by name.

    Examples
    --------
    >>> recording = NumberRecording(["a", "b"])
    >>> a, b = recording.inputs["a"], recording.inputs["b"]
    >>> c = np.sqrt(a * a + b * b)
    >>> len(recording.needed([c]))
    6
    """

    def __init__(self, inputs: Iterable[Hashable], finite: bool = False) -> None:
        self.finite = finite
        self.made: list[tuple[Any, ...]] = []
        self.known: dict[tuple[Any, ...], int] = {}
        self.inputs: dict[Any, Traced] = {}
        self.inputs |= {name: Traced(self, self._slot("input", name)) for name in inputs}

    def place_of(self, value: Any) -> int:
        """Where a number is: a traced one of this recording, or a constant."""
        if isinstance(value, np.ndarray):  # of one number
            value = value[()]
        if isinstance(value, Traced):
            if value.recording is not self:
                raise Untraceable("numbers of two recordings")
            return value.place
        return self._slot("constant", float(value))

    def constant(self, value: float) -> Traced:
        """A constant as a traced number."""
        return Traced(self, self.place_of(value))

    def value_of(self, value: Any) -> float | None:
        """The value of a constant; None of what depends on inputs."""
        return self._constant(self.place_of(value))

    def operation(self, name: str, *operands: int) -> int:
        """Place of what an operation gives."""
        values = [self._constant(place) for place in operands]
        if name == "select_le":
            a, b, *_ = values
            if a is not None and b is not None:
                return operands[2] if a <= b else operands[3]
            if operands[2] == operands[3]:
                return operands[2]
        elif None not in values:
            with np.errstate(all="ignore"):
                return self._slot("constant", float(getattr(np, name)(*values)))
        same = self._same(name, operands, values)
        if same is not None:
            return same
        if name in SYMMETRIC:
            operands = tuple(sorted(operands))
        return self._slot(name, *operands)

    def needed(self, targets: Sequence[Any]) -> list[int]:
        """Places of all that these numbers need, themselves included, in the order of recording."""
        found = {self.place_of(target) for target in targets}
        for place in range(len(self.made) - 1, -1, -1):
            if place in found and self.made[place][0] not in ("input", "constant"):
                found.update(self.made[place][1:])
        return sorted(found)

    def _constant(self, place: int) -> float | None:
        kind, *rest = self.made[place]
        return rest[0] if kind == "constant" else None

    def _same(self, name: str, operands: Sequence[int], values: list[Any]) -> int | None:
        """The operand that an operation with a neutral constant gives."""
        if name in ("add", "subtract") and values[1] == 0.0:
            return operands[0]
        if name == "add" and values[0] == 0.0:
            return operands[1]
        if name in ("multiply", "divide", "power") and values[1] == 1.0:
            return operands[0]
        if name == "multiply" and values[0] == 1.0:
            return operands[1]
        if self.finite and name in ("multiply", "divide") and values[0] == 0.0:
            return operands[0]
        if self.finite and name == "multiply" and values[1] == 0.0:
            return operands[1]
        return None

    def _slot(self, *made: Any) -> int:
        key = made
        if made[0] == "constant":  # two zeros, and values that are no number, by their bits
            key = "constant", np.float64(made[1]).tobytes()
        if key not in self.known:
            self.known[key] = len(self.made)
            self.made.append(made)
        return self.known[key]
