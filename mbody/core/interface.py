"""The interface of a kernel, from its annotations: bundles, arrays and numbers.

``def follow(L: Layout, W: Work, path: DrivenPath, found: PathOutput) -> int`` is all that a
compiler and a loader need to know. Arrays are annotated by their kinds (`mbody.core.bundle.KINDS`),
results as `int`, `float`, `bool`, a tuple of these, or None.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mbody.core.bundle import KINDS, Bundle

#: What a compiler may do: fuse a multiplication and an addition, ignore the sign of a zero.
#: Sums keep their order, and NaN and infinity keep their meaning: the kernels rely on both.
FASTMATH = frozenset({"contract", "nsz"})


#: Every kernel that was loaded, by its name: the function as it was written.
KERNELS: dict[str, Callable[..., Any]] = {}


@dataclass(frozen=True)
class Array:
    """A C-contiguous array."""

    number: str
    axes: int


_ARRAYS = {name: Array(*kind) for name, kind in KINDS.items() if kind[1]}


@dataclass(frozen=True)
class Signature:
    """Names and kinds of the arguments, kinds of the results.

    A kind is `int`, `float`, `bool`, an `Array`, or a class of bundles.
    """

    names: tuple[str, ...]
    arguments: tuple[Any, ...]
    results: tuple[Any, ...]


def register(function: Callable[..., Any]) -> None:
    """Put a kernel among `KERNELS`; its name is its name in libraries too, so no two share one."""
    name = function.__name__
    if KERNELS.get(name, function).__module__ != function.__module__:
        raise TypeError(f"two kernels are named {name!r}")
    KERNELS[name] = function


def signature(function: Callable[..., Any]) -> Signature:
    """The interface of a kernel."""
    kinds = {
        name: _kind(function, annotation) for name, annotation in function.__annotations__.items()
    }
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    missing = [name for name in (*names, "return") if name not in kinds]
    if missing:
        raise TypeError(f"kernel {function.__name__}: {missing[0]!r} has no annotation")
    result = kinds.pop("return")
    if result is None:
        results: tuple[Any, ...] = ()
    else:
        results = getattr(result, "__args__", (result,))
    for name, kind in kinds.items():
        bundle = isinstance(kind, type) and issubclass(kind, Bundle)
        if not (bundle or isinstance(kind, Array) or kind in (int, float, bool)):
            raise TypeError(f"kernel {function.__name__}: {name!r} is annotated {kind!r}")
    if not all(kind in (int, float, bool) for kind in results):
        raise TypeError(f"kernel {function.__name__}: its result is annotated {result!r}")
    return Signature(names, tuple(kinds[name] for name in names), results)


def _kind(function: Callable[..., Any], annotation: Any) -> Any:
    """Kind that an annotation names; the kinds of arrays are one to type checkers."""
    if not isinstance(annotation, str):
        return annotation
    if annotation in _ARRAYS:
        return _ARRAYS[annotation]
    return eval(annotation, function.__globals__)
