"""LLVM instructions of recorded numbers: of lanes, and of what all lanes share."""

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import Any

from llvmlite import ir

from mbody.compiler.numba_lanes import (
    extreme,
    if_odd,
    intrinsic,
    negate_if_two,
    select_ordered,
    sincos_near_zero,
)
from mbody.compiler.targets import Target
from mbody.core.interface import FASTMATH
from mbody.core.recorded_numbers import NumberRecording, Untraceable

SHARED = ir.DoubleType()

_BINARY = {"add": "fadd", "subtract": "fsub", "multiply": "fmul", "divide": "fdiv"}
_EXTREME = {"minimum": extreme("<"), "maximum": extreme(">")}
_UNARY = {"sqrt": intrinsic("sqrt"), "absolute": intrinsic("fabs")}
_FLAGS = tuple(FASTMATH)
#: Sine and cosine as the kernels have them, as plain Python.
sincos = sincos_near_zero.py_func


class _Emitted:
    """A number that writes instructions for what is computed with it."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _with(self, name: str, *operands: Any) -> _Emitted:
        values = [
            constant(self.value.type, one) if isinstance(one, float) else one.value
            for one in operands
        ]
        return _Emitted(self.builder, getattr(self.builder, name)(*values, flags=_FLAGS))

    def __add__(self, other: Any) -> _Emitted:
        return self._with("fadd", self, other)

    def __radd__(self, other: Any) -> _Emitted:
        return self._with("fadd", other, self)

    def __sub__(self, other: Any) -> _Emitted:
        return self._with("fsub", self, other)

    def __rsub__(self, other: Any) -> _Emitted:
        return self._with("fsub", other, self)

    def __mul__(self, other: Any) -> _Emitted:
        return self._with("fmul", self, other)

    def __rmul__(self, other: Any) -> _Emitted:
        return self._with("fmul", other, self)

    def if_odd(self, x: _Emitted, y: _Emitted) -> _Emitted:
        return _Emitted(self.builder, if_odd(self.builder, self.value, x.value, y.value))

    def negate_if_two(self, x: _Emitted) -> _Emitted:
        return _Emitted(self.builder, negate_if_two(self.builder, self.value, x.value))


def lanes_of(target: Target) -> int:
    """Number of lanes: numbers in the widest registers of a processor, four where these hold two or
    are not known.

    With more, a number takes several registers, of which there are too few: eight lanes in
    registers of four take up to a fifth longer than four.
    """
    return 8 if "+avx512f" in target.features or target.cpu == "x86-64-v4" else 4


def numbers_of(lanes: int) -> Any:
    """The type of numbers side by side, one of each lane."""
    return ir.VectorType(SHARED, lanes)


def constant(kind: Any, value: float) -> Any:
    """A constant of a type."""
    return ir.Constant(kind, [value] * kind.count if _of_lanes(kind) else value)


def in_all_lanes(builder: Any, value: Any, kind: Any) -> Any:
    """A shared number in every lane, as a number of that type."""
    if value.type == kind:
        return value
    place = ir.IntType(32)
    undefined = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(place, 0))
    same = ir.Constant(ir.VectorType(place, kind.count), [0] * kind.count)
    return builder.shuffle_vector(first, undefined, same)


def _of_lanes(kind: Any) -> bool:
    return isinstance(kind, ir.VectorType)


def instructions(
    builder: Any,
    recording: NumberRecording,
    targets: Iterable[Any],
    read: Callable[[Hashable], Any],
    kind: Any,
) -> Callable[[Any], Any]:
    """Instructions of all that these recorded numbers need; `read` gives the value of an input.

    Returns the function from a target to its value in all lanes, a number of the type `kind`.
    """
    values: dict[int, Any] = {}
    sines: dict[int, tuple[Any, Any]] = {}
    for place in recording.needed(list(targets)):
        name, *operands = recording.made[place]
        if name == "constant":
            values[place] = float(operands[0])
        elif name == "input":
            values[place] = read(operands[0])
        elif name in ("sin", "cos"):
            if operands[0] not in sines:
                angle = _Emitted(builder, values[operands[0]])
                sines[operands[0]] = tuple(one.value for one in sincos(angle))
            values[place] = sines[operands[0]][name == "cos"]
        else:
            values[place] = _operation(builder, name, [values[one] for one in operands])

    def of(target: Any) -> Any:
        value = values[recording.place_of(target)]
        return _in_lanes(builder, kind, value)

    return of


def _operation(builder: Any, name: str, operands: list[Any]) -> Any:
    kinds = (one.type for one in operands if not isinstance(one, float))
    kind = next(filter(_of_lanes, kinds), SHARED)
    values = [_in_lanes(builder, kind, one) for one in operands]
    if name in _BINARY:
        return getattr(builder, _BINARY[name])(*values, flags=_FLAGS)
    if name in _EXTREME:
        return _EXTREME[name](builder, *values)
    if name in _UNARY:
        return _UNARY[name](builder, *values)
    if name == "negative":
        return builder.fneg(*values)
    if name == "select_le":
        return select_ordered(builder, *values)
    raise Untraceable(f"{name} of lanes")


def _in_lanes(builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(value, float):
        return constant(kind, value)
    return in_all_lanes(builder, value, kind)
