"""Numbers that record what is computed with them, and the programs that repeat it.

A `Recording` hands out `Traced` numbers for its inputs. Python code that computes with them, by
operators or by NumPy's functions, leaves a list of operations, which `Recording.program` turns into
a `NumberProgram` for the compiled core. Constants are folded; an operation that was recorded before
is not recorded again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from mbody.kernels.number_program import NumberProgram
from mbody.laws.postfix import OPERATIONS

__all__ = ["Recording", "Rule", "Traced", "Untraceable"]

#: What the core evaluates, by NumPy's name: the operation and what folds constants.
FUNCTIONS = {
    "negative": "negative",
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "sqrt": "sqrt",
    "absolute": "abs",
    "exp": "exp",
    "log": "log",
    "add": "+",
    "subtract": "-",
    "multiply": "*",
    "divide": "/",
    "power": "^",
    "arctan2": "atan2",
    "hypot": "hypot",
    "minimum": "min",
    "maximum": "max",
}
CODES = {name: OPERATIONS.index(operation) for name, operation in FUNCTIONS.items()}
#: Operations whose operands may change places.
SYMMETRIC = ("add", "multiply", "minimum", "maximum", "hypot")
#: Twice this factor makes one of any positive difference, however small, at least.
GREAT = 1e300
#: What a rule requires of a number, as `mbody.model.element.number_field` names it: the lowest
#: value, and whether it is excluded.
LOWEST = {"positive": (0.0, 1), "not negative": (0.0, 0), "": (-1e300, 1)}


class Untraceable(Exception):
    """Python does with a recorded number what no list of operations repeats."""


@dataclass(frozen=True)
class Rule:
    """The value that an input has at first, and what is required of it: "positive",
    "not negative" or nothing.
    """

    value: float
    sign: str = ""


class Traced:
    """A number of a recording.

    Operators and NumPy's functions give further ones. What needs its value (a comparison that
    decides, `float`) raises `Untraceable`.
    """

    __slots__ = ("place", "recording")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, recording: Recording, place: int) -> None:
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
    """A function of NumPy, by its name, of numbers of which one at least is traced."""
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
        return np.True_  # programs look at what they give: `Recording.program`
    if name in MADE:
        return MADE[name](*(Traced(recording, place) for place in places))
    if name not in CODES:
        raise Untraceable(f"numpy.{name} of a changeable number")
    return Traced(recording, recording.operation(name, *places))


def _greater(a: Any, b: Any) -> Any:
    """1 where a > b, else 0: any difference is multiplied until it exceeds 1, and cut off."""
    return np.maximum(np.minimum((a - b) * GREAT * GREAT, 1.0), 0.0)


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
    "sign": lambda a: _greater(a, 0.0) - _greater(0.0, a),
}


class Recording:
    """Operations on named inputs.

    Parameters
    ----------
    inputs : dict
        First value and rule of every input, by name.

    Examples
    --------
    >>> recording = Recording({"a": Rule(3.0), "b": Rule(4.0)})
    >>> a, b = recording.inputs["a"], recording.inputs["b"]
    >>> program = recording.program([np.sqrt(a * a + b * b)])
    >>> len(program.operations)
    4
    """

    def __init__(self, inputs: dict[str, Rule]) -> None:
        self.rules = list(inputs.values())
        # of every place an operation with the places that it takes, a constant, or the input
        self.made: list[tuple[Any, ...]] = [("input", n) for n in range(len(inputs))]
        self.known: dict[tuple[Any, ...], int] = {}
        self.inputs = {name: Traced(self, n) for n, name in enumerate(inputs)}

    def place_of(self, value: Any) -> int:
        """Where a number is: a traced one of this recording, or a constant."""
        if isinstance(value, Traced):
            if value.recording is not self:
                raise Untraceable("numbers of two recordings")
            return value.place
        return self._place("constant", float(value))

    def constant(self, value: float) -> Traced:
        """A constant as a traced number."""
        return Traced(self, self.place_of(value))

    def operation(self, name: str, *operands: int) -> int:
        """Place of what an operation gives."""
        values = [self._value(place) for place in operands]
        if None not in values:
            with np.errstate(all="ignore"):
                return self._place("constant", float(getattr(np, name)(*values)))
        same = self._same(name, operands, values)
        if same is not None:
            return same
        if name in SYMMETRIC:
            operands = tuple(sorted(operands))
        return self._place(name, *operands)

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
        return None

    def _value(self, place: int) -> float | None:
        kind, *rest = self.made[place]
        return rest[0] if kind == "constant" else None

    def _place(self, *made: Any) -> int:
        key = made
        if made[0] == "constant":  # two zeros, and values that are no number, by their bits
            key = "constant", np.float64(made[1]).tobytes()
        if key not in self.known:
            self.known[key] = len(self.made)
            self.made.append(made)
        return self.known[key]

    def program(self, targets: Sequence[Any]) -> NumberProgram:
        """The program from the inputs to these numbers, traced ones or constants, with all that
        they need.
        """
        wanted = [self.place_of(target) for target in targets]
        needed = set(wanted)
        for place in range(len(self.made) - 1, -1, -1):
            if place in needed and self.made[place][0] in CODES:
                needed.update(self.made[place][1:])
        count = len(self.rules)
        kept = [place for place in sorted(needed) if place >= count]
        constants = [place for place in kept if self.made[place][0] == "constant"]
        steps = [place for place in kept if self.made[place][0] in CODES]
        order = [*range(count), *constants, *steps]
        slot = {place: n for n, place in enumerate(order)}
        slots = np.zeros(len(order))
        slots[:count] = [rule.value for rule in self.rules]
        slots[count : count + len(constants)] = [self.made[place][1] for place in constants]
        operations = np.zeros((len(steps), 4), dtype=np.int64)
        for row, place in zip(operations, steps, strict=True):
            name, first, *second = self.made[place]
            row[:] = CODES[name], slot[first], slot[(second or [first])[0]], slot[place]
        bounds = [LOWEST[rule.sign] for rule in self.rules]
        return NumberProgram(
            slots=slots,
            lowest=np.array([low for low, _ in bounds]),
            strict=np.array([strict for _, strict in bounds], dtype=np.int64),
            operations=operations,
            targets=np.array([slot[place] for place in wanted], dtype=np.int64),
        )
