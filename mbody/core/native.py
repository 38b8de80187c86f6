"""Kernels as machine code, called by ctypes with the interpreter's lock released.

A kernel takes bundles by their addresses, arrays as NumPy has them, and numbers. It is looked up in
the library of the package; where there is none, the library that it is in is built when one of its
kernels is first called, by a process of its own, and kept in the cache folder.
"""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mbody.core import selection
from mbody.core.interface import KERNELS, Array, Signature, signature
from mbody.core.libraries import by_library
from mbody.core.selection import Library, LibraryError, open_library, source_hash

_KINDS = {int: ctypes.c_int64, bool: ctypes.c_int64, float: ctypes.c_double}
_lock = threading.Lock()


def kernel(function: Callable[..., Any]) -> Any:
    """The machine code of a kernel as a function; loaded when it is first called."""
    name, interface = function.__name__, signature(function)
    kinds: list[Any] = [ctypes.c_void_p] if interface.results else []
    for kind in interface.arguments:
        kinds.append(
            _KINDS.get(kind) or (ctypes.py_object if isinstance(kind, Array) else ctypes.c_void_p)
        )

    def first(*values: Any) -> Any:
        found = _library(function).function(name, kinds)
        scope["function"] = found
        return found(*values)

    scope: dict[str, Any] = {"function": first}
    called = _caller(name, interface, scope)
    called.__module__, called.__doc__, called.__qualname__ = (
        function.__module__,
        function.__doc__,
        name,
    )
    called.py_func = function
    return called


def _caller(name: str, interface: Signature, scope: dict[str, Any]) -> Any:
    """The Python function that passes values on: its text is made once, so that a call costs no
    more than the conversions that it needs.
    """
    names, results = interface.names, interface.results
    values, checks = ["addressof(out)"] if results else [], []
    for argument, kind in zip(names, interface.arguments, strict=True):
        if isinstance(kind, Array):
            scope[f"{argument}_kind"] = kind
            scope[f"{argument}_dtype"] = np.dtype(kind.number)
            checks.append(
                f"    if not ({argument}.dtype == {argument}_dtype "
                f"and {argument}.ndim == {kind.axes} and {argument}.flags.c_contiguous):\n"
                f"        raise refused({name!r}, {argument!r}, {argument}, {argument}_kind)"
            )
            values.append(argument)
        elif kind in (int, bool):
            values.append(f"{kind.__name__}({argument})")
        else:
            values.append(argument if kind is float else f"{argument}.address")
    outputs = [f"bool(out.n{n})" if kind is bool else f"out.n{n}" for n, kind in enumerate(results)]
    lines = [f"def {name}({', '.join(names)}):", *checks]
    if results:
        lines.append("    out = Out()")
    lines += [f"    if function({', '.join(values)}):", f"        raise RuntimeError({name!r})"]
    if results:
        lines.append(f"    return {', '.join(outputs)}")
    fields = [(f"n{n}", _KINDS[kind]) for n, kind in enumerate(results)]
    scope |= {
        "Out": type("Out", (ctypes.Structure,), {"_fields_": fields}),
        "addressof": ctypes.addressof,
        "refused": _refused,
    }
    exec("\n".join(lines), scope)
    return scope[name]


def _refused(name: str, argument: str, array: np.ndarray, kind: Array) -> TypeError:
    order = "" if array.flags.c_contiguous else ", not contiguous"
    return TypeError(
        f"kernel {name}: {argument} is an array of {array.dtype} with {array.ndim} axes{order}; it "
        f"must be of {kind.number} with {kind.axes} axes, contiguous"
    )


# ---------------------------------------------------------------------------------------------
# Where the machine code is


def _library(function: Callable[..., Any]) -> Library:
    choice = selection.chosen()
    if choice.library is not None:
        return choice.library
    file, sources = file_of(function), source_hash()
    with _lock:
        if file.exists():
            try:
                return open_library(file, sources)
            except LibraryError:  # a damaged file is made again
                file.unlink(missing_ok=True)
        from mbody.core.native_builder import build

        build([function])
    return open_library(file, sources)


def file_of(function: Callable[..., Any]) -> Path:
    """The library in the cache folder that has, or is to have, a kernel."""
    folder = selection.chosen().file
    assert folder is not None
    return folder / f"{next(iter(by_library([function])))}.so"


def built() -> int:
    """Number of kernels built in this process."""
    builder: Any = sys.modules.get("mbody.core.native_builder")
    return 0 if builder is None else builder.built


def missing() -> list[Callable[..., Any]]:
    """The loaded kernels that are not built yet."""
    choice = selection.chosen()
    if choice.library is not None or choice.file is None:
        return []
    return [one for one in KERNELS.values() if not file_of(one).exists()]
