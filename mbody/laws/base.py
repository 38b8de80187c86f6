"""What every law shares: checked numbers, the kernel's view of them, and evaluation by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Any, ClassVar, TypeAlias, overload

import numpy as np

from mbody.errors import ModelError
from mbody.laws.kernels import LAW_KINDS, FloatArray, evaluate

__all__ = ["FloatArray", "Law", "Value", "finite", "finite_array"]

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


@dataclass(frozen=True)
class Law:
    """A scalar function f(x) with f′ and f″: a motion of time, a force of deflection or rate.

    Laws are frozen, compare by their fields, and pickle. ``law(x)`` gives f, ``law.derivatives(x)``
    gives (f, f′, f″), both by the compiled code that the core runs, for a float or an array.

    >>> from mbody.laws import ConstantSpeed
    >>> ConstantSpeed(1.0, 2.0)(3.0)
    7.0
    """

    kind: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = finite(getattr(self, field.name), type(self).__name__, field.name)
            object.__setattr__(self, field.name, value)

    @property
    def code(self) -> int:
        """The kernel's integer code of this law: the index of its kind in `LAW_KINDS`."""
        return LAW_KINDS.index(self.kind)

    def numbers(self) -> dict[str, float]:
        """The numbers that may be changed without making a new law, by field name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def with_numbers(self, numbers: Mapping[str, Any]) -> Law:
        """The same law with other numbers, named as in `numbers`."""
        return replace(self, **numbers) if numbers else self

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """The kernel's parameters from such numbers, each a float or an array (batch,)."""
        return [numbers[field.name] for field in fields(self)]

    def table(self) -> FloatArray:
        """Fixed data for the kernel, (m,); empty for most laws."""
        return np.empty(0)

    def hook(self) -> Callable[[FloatArray, FloatArray], None] | None:
        """The Python function to register for a law of kind "user": fills y (3,) from x (1,)."""
        return None

    def turns(self, x: float) -> FloatArray:
        """Ascending places after x, (k,), between which the law is monotonic.

        Beyond the last one the law is constant or has shown that it repeats itself; it is inf
        where the law runs on for ever.
        """
        raise NotImplementedError

    @overload
    def __call__(self, x: float) -> float: ...
    @overload
    def __call__(self, x: FloatArray) -> FloatArray: ...
    def __call__(self, x: Value) -> Value:
        """The value f at x, a float or an array of any shape; errors as `derivatives`."""
        return self.derivatives(x)[0]

    @overload
    def derivatives(self, x: float) -> tuple[float, float, float]: ...
    @overload
    def derivatives(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]: ...
    def derivatives(self, x: Value) -> tuple[Value, Value, Value]:
        """(f, f′, f″) at x, each a float or an array of the shape of x.

        Raises
        ------
        ModelError
            x is not finite, or outside the range of a table.
        """
        xs = np.asarray(x, dtype=float)
        flat = np.ascontiguousarray(xs).reshape(-1)
        if not np.isfinite(flat).all():
            bad = flat[~np.isfinite(flat)][0]
            raise ModelError(f"{type(self).__name__}: asked at x = {bad}; x must be finite")
        out = self._evaluate(flat)
        if xs.ndim == 0:
            return float(out[0, 0]), float(out[0, 1]), float(out[0, 2])
        return out[:, 0].reshape(xs.shape), out[:, 1].reshape(xs.shape), out[:, 2].reshape(xs.shape)

    def _evaluate(self, xs: FloatArray) -> FloatArray:
        """f, f′, f″, (N, 3), at finite xs (N,)."""
        out = np.empty((xs.size, 3))
        par = np.array(self.parameters(self.numbers()), dtype=float).reshape(-1, 1)
        tab = self.table()
        evaluate(self.code, par, 0, par.shape[0], 0, tab, 0, -1, xs, out)
        return out
