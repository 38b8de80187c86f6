"""Base class of the laws: checked numbers, the kernel's parameters, and evaluation."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cached_property
from numbers import Real
from typing import Any, ClassVar, TypeAlias, overload

import numpy as np

from mbody.errors import ModelError
from mbody.laws.kernels import LAW_KINDS, FloatArray, evaluate
from mbody.quantities import Formula, FormulaError
from mbody.quantities.formula import (
    NotANumber,
    NotFinite,
    float_or_formula,
    is_pending,
    substituted,
    verified,
)
from mbody.quantities.units import DIMENSIONS, Dimension

Value: TypeAlias = float | FloatArray


def finite(value: Any, owner: str, field: str) -> float:
    """The value as a finite float; ModelError naming `owner` and `field` when it is not one.

    >>> finite(3, "Constant", "value")
    3.0
    """
    if isinstance(value, Real) and not isinstance(value, bool | np.bool_):
        result = float(value)
        if math.isfinite(result):
            return result
    raise ModelError(f"{owner}: {field} must be a finite number, it is {value!r}")


def law_number(value: Any, owner: str, field: str) -> Any:
    """The value as a finite float, or as a formula if it is text or a quantity.

    >>> law_number("60 deg", "Constant", "value").text
    '60 deg'
    """
    try:
        return float_or_formula(value, None)
    except (NotANumber, NotFinite):
        return finite(value, owner, field)
    except FormulaError as error:
        raise ModelError(f"{owner}: {field}: {error}") from None


def law_numbers(values: Any, owner: str, field: str) -> tuple[Any, ...]:
    """One row of numbers, each converted by `law_number`."""
    if hasattr(values, "dimensionality") and np.ndim(values.magnitude) == 1:
        values = list(values)  # of pint: each number has its unit
    if isinstance(values, (tuple, list)) and any(map(_is_text, values)):
        return tuple(law_number(v, owner, f"{field}[{n}]") for n, v in enumerate(values))
    return tuple(finite_array(values, owner, field).tolist())


def _is_text(value: Any) -> bool:
    """Whether the value is text, a formula or a quantity."""
    return isinstance(value, (str, Formula)) or hasattr(value, "dimensionality")


def law_field(value: int = 0, argument: int = 0, angle: int = 0, *, default: Any = MISSING) -> Any:
    """Dataclass field for a number of a law. Its dimension is given by the powers of the law's
    value, of its argument and of an angle: a speed is ``law_field(1, -1)``.
    """
    return field(default=default, metadata={"powers": (value, argument, angle)})


def finite_array(values: Any, owner: str, field: str) -> FloatArray:
    """The values as a 1-D array of finite floats; ModelError naming the first that is not finite.

    >>> finite_array([1, 2], "Table", "x")
    array([1., 2.])
    """
    try:
        result = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(f"{owner}: {field} must be numbers, not {values!r}") from None
    if result.ndim != 1:
        raise ModelError(
            f"{owner}: {field} must be one row of numbers, it has the shape {result.shape}"
        )
    bad = np.flatnonzero(~np.isfinite(result))
    if bad.size:
        raise ModelError(
            f"{owner}: {field}[{bad[0]}] must be a finite number, it is {result[bad[0]]}"
        )
    return result


def dimension_by(powers: tuple[int, int, int], value: Dimension, argument: Dimension) -> Dimension:
    """The dimension of a number of a law from the powers of its `law_field`.

    >>> from mbody.quantities.units import name_of
    >>> name_of(dimension_by((1, -1, 0), DIMENSIONS["angle"], DIMENSIONS["time"]))
    'angular velocity'
    """
    return value ** powers[0] * argument ** powers[1] * DIMENSIONS["angle"] ** powers[2]


def with_dimension(part: Any, dimension: Dimension, name: str) -> Any:
    """Numbers of a law whose formulas get that dimension; FormulaError if their units do not
    fit.
    """
    try:
        return substituted(part, lambda formula: verified(formula.of(dimension)))
    except FormulaError as error:
        raise FormulaError(f"{name}: {error}") from None


@dataclass(frozen=True)
class Law:
    """A scalar function f(x) with f′ and f″: a motion of time, a force of deflection or rate.

    Laws are frozen, compare by their fields, and pickle. ``law(x)`` returns f and
    ``law.derivatives(x)`` returns (f, f′, f″), for a float or an array. Both use the same compiled
    code as the kernels.

    >>> from mbody.laws import ConstantSpeed
    >>> ConstantSpeed(1.0, 2.0)(3.0)
    7.0
    """

    kind: ClassVar[str] = ""

    def __post_init__(self) -> None:
        self._read_numbers()
        if not self.pending:
            self._check()

    @cached_property
    def pending(self) -> bool:
        """Whether some of its numbers are text, which a mechanism converts to floats."""
        return is_pending(self)

    def _read_numbers(self) -> None:
        """Read every number: a float or a formula."""
        for part in fields(self):
            if "powers" in part.metadata:
                value = law_number(getattr(self, part.name), type(self).__name__, part.name)
                object.__setattr__(self, part.name, value)

    def _check(self) -> None:
        """Raise ModelError if the numbers do not fit together; all are floats here."""

    def dimensioned(self, value: Dimension, argument: Dimension) -> Law:
        """A copy with the units of its text checked against the dimensions of its numbers.

        Raises
        ------
        FormulaError
            For a unit that does not fit.
        """
        changed: dict[str, Any] = {}
        for part in fields(self):
            powers, own = part.metadata.get("powers"), getattr(self, part.name)
            if powers and is_pending(own):
                changed[part.name] = with_dimension(
                    own, dimension_by(powers, value, argument), part.name
                )
        return replace(self, **changed) if changed else self

    @property
    def code(self) -> int:
        """The kernel's integer code of this law: the index of its kind in `LAW_KINDS`."""
        return LAW_KINDS.index(self.kind)

    def numbers(self) -> dict[str, float]:
        """The numbers that can change without a new law, by field name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def with_numbers(self, numbers: Mapping[str, Any]) -> Law:
        """A copy with other numbers, named as in `numbers`."""
        return replace(self, **numbers) if numbers else self

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """The kernel's parameters from such numbers, each a float or an array (batch,)."""
        return [numbers[field.name] for field in fields(self)]

    def table(self) -> FloatArray:
        """Fixed data for the kernel, (m,); empty for most laws."""
        return np.empty(0)

    def hook(self, derivatives: bool = True) -> Callable[[FloatArray, FloatArray], None] | None:
        """The Python function to register for a law of kind "user": fills y (3,) from x (1,), the
        derivatives only where they are wanted.
        """
        return None

    @property
    def may_have_corners(self) -> bool:
        """Whether there may be places in `corners_between`."""
        return False

    def corners_between(self, first: float, last: float) -> FloatArray:
        """Where it jumps, or its rate or second derivative does, between two values of x,
        ascending, (k,): steps of motions that follow it end there.
        """
        return np.empty(0)

    def rate_jumps(self, first: float, last: float) -> FloatArray:
        """Where its rate may jump between two values of x, ascending, (k,)."""
        return np.empty(0)

    def turns(self, x: float) -> FloatArray:
        """Ascending places after x, (k,), between which the law is monotonic.

        Beyond the last place the law is constant or repeats itself; the last place is inf where the
        law is monotonic without end.
        """
        raise NotImplementedError

    @overload
    def __call__(self, x: float) -> float: ...
    @overload
    def __call__(self, x: FloatArray) -> FloatArray: ...
    def __call__(self, x: Value) -> Value:
        """The value f at x, a float or an array of any shape; errors as `derivatives`."""
        return self._values(x, 1)[0]

    @overload
    def derivatives(self, x: float) -> tuple[float, float, float]: ...
    @overload
    def derivatives(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]: ...
    def derivatives(self, x: Value) -> tuple[Value, Value, Value]:
        """(f, f′, f″) at x, each a float or an array of the shape of x.

        Raises
        ------
        ModelError
            x is not finite, outside the range of a table, or where a formula has no value.
        """
        f, f1, f2 = self._values(x, 3)
        return f, f1, f2

    def _values(self, x: Value, orders: int) -> Any:
        """The first `orders` of f, f′, f″ at x, checked for NaN."""
        if self.pending:
            raise ModelError(
                f"{type(self).__name__}: its numbers are text, which has a value only in a "
                "mechanism: add the element with this law to one and evaluate it there"
            )
        xs = np.asarray(x, dtype=float)
        flat = np.ascontiguousarray(xs).reshape(-1)
        if not np.isfinite(flat).all():
            bad = flat[~np.isfinite(flat)][0]
            raise ModelError(f"{type(self).__name__}: evaluated at x = {bad}; x must be finite")
        out = self.raw(flat)
        self._check_values(flat, out[:, :orders])
        columns = out[:, :orders].T
        return columns[:, 0].tolist() if xs.ndim == 0 else [f.reshape(xs.shape) for f in columns]

    def _check_values(self, xs: FloatArray, out: FloatArray) -> None:
        """Raise ModelError if the law has no value at one of xs (N,); out is (N, orders)."""

    def raw(self, xs: FloatArray) -> FloatArray:
        """f, f′, f″, (N, 3), at finite xs (N,); NaN where the law has no value."""
        out = np.empty((xs.size, 3))
        par = np.array(self.parameters(self.numbers()), dtype=float).reshape(-1, 1)
        tab = self.table()
        evaluate(self.code, par, 0, par.shape[0], 0, tab, 0, xs, out)
        return out


class FixedLaw(Law):
    """A law without numbers that can change: points of a table, a program, a function."""

    def numbers(self) -> dict[str, float]:
        """None: they are fixed."""
        return {}

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """None."""
        return []


class FormulaLaw(Law):
    """A law of a compiled formula: its numbers are the formula's constants."""

    constants: tuple[float, ...]

    def numbers(self) -> dict[str, float]:
        """{"c0": …, "c1": …, …}."""
        return {f"c{n}": value for n, value in enumerate(self.constants)}

    def with_numbers(self, numbers: Mapping[str, Any]) -> Law:
        """A copy with these constants."""
        changed: Any = {"constants": tuple(self.parameters(numbers))}
        return replace(self, **changed)

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """The constants in their order."""
        return [numbers[f"c{n}"] for n in range(len(self.constants))]
