"""The interface of a kernel, from its annotations: bundles, arrays and numbers.

``def follow(L: Layout, W: Work, path: DrivenPath, found: PathOutput) -> int`` is all that a
compiler and a loader need to know. Arrays are annotated by their kinds (`mbody.core.bundle.KINDS`),
results as `int`, `float`, `bool`, a tuple of these, or None.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from mbody.core.bundle import KINDS, Bundle

#: What a compiler may do: fuse a multiplication and an addition, ignore the sign of a zero.
#: Sums keep their order, and NaN and infinity keep their meaning: the kernels rely on both.
FASTMATH = frozenset({"contract", "nsz"})


#: Every kernel that was loaded, by its name: the function as it was written.
KERNELS: dict[str, Callable[..., Any]] = {}

#: Libraries of machine code, with the modules of their kernels: what kernels share is compiled once
#: in each. Those of a module that is not listed are one by themselves. In the order in which they
#: are built, in two processes by turns.
LIBRARIES = {
    "motion_lanes": "kernels.runge_kutta_lanes",
    "motion": "kernels.advance kernels.contact_guards kernels.contact_impacts "
    "kernels.force_programs kernels.image_calls kernels.methods kernels.mode_problem "
    "kernels.moreau kernels.runge_kutta kernels.state_derivative",
    "motion_duals": "kernels.motion_duals",
    "positions": "kernels.contact_rows kernels.continuation kernels.finished_instants "
    "kernels.forces kernels.held_forces kernels.loop_closure",
    "positions_lanes": "kernels.continuation_lanes",
    "numbers": "kernels.complementarity kernels.layout kernels.linear_program "
    "kernels.number_program kernels.square_lu laws.kernels laws.smooth_contour",
}


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


def by_library(functions: Iterable[Callable[..., Any]]) -> dict[str, list[Callable[..., Any]]]:
    """Kernels by the libraries that they are in, which are in the order of `LIBRARIES`."""
    homes = {module: name for name, modules in LIBRARIES.items() for module in modules.split()}
    found: dict[str, list[Callable[..., Any]]] = {name: [] for name in LIBRARIES}
    for function in functions:
        module = function.__module__.partition(".")[2]
        found.setdefault(homes.get(module, module), []).append(function)
    return {name: members for name, members in found.items() if members}


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
