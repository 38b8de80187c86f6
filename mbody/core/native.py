"""Kernels as machine code, called by ctypes with the interpreter's lock released.

A kernel takes bundles by their addresses, arrays as NumPy has them, and numbers. It is looked up in
the library of the package; where there is none, the library that it is in is built when one of its
kernels is first called, by a process of its own, and kept in the cache folder.
"""

from __future__ import annotations

import contextlib
import ctypes
import itertools
import os
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np

from mbody.core import registered, selection
from mbody.core.interface import KERNELS, LIBRARIES, Array, Signature, by_library, signature
from mbody.core.selection import PACKAGE, Library, LibraryError, open_library, source_hash

_KINDS = {int: ctypes.c_int64, bool: ctypes.c_int64, float: ctypes.c_double}
_lock = threading.Lock()
_built = 0


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
        build([function])
    return open_library(file, sources)


def file_of(function: Callable[..., Any]) -> Path:
    """The library in the cache folder that has, or is to have, a kernel."""
    folder = selection.chosen().file
    assert folder is not None
    return folder / f"{next(iter(by_library([function])))}.so"


def built() -> int:
    """Number of kernels built in this process."""
    return _built


def build(
    functions: list[Callable[..., Any]],
    processes: int = 1,
    say: Callable[[str], None] | None = None,
) -> None:
    """Build the libraries of some kernels for this machine, in processes of their own.

    `say` gets the name of each library when it is begun; without it one line on stderr names all.
    """
    global _built
    from concurrent.futures import ThreadPoolExecutor

    wanted = by_library(functions)
    for name in wanted:
        for module in LIBRARIES.get(name, ()):
            import_module(f"{PACKAGE.name}.{module}")
    libraries = [one for name, one in by_library(KERNELS.values()).items() if name in wanted]
    if say is None and (tell := _stderr()):
        what = ", ".join(repr(name) for name in wanted)
        tell(f"building kernels of {what} for this machine (once) ...")
    count = min(processes, len(libraries))
    shares = [list(itertools.chain(*libraries[n::count])) for n in range(count)]
    with ThreadPoolExecutor(count) as pool:
        list(pool.map(lambda share: _build(share, say), shares))
    _built += sum(map(len, shares))


def _stderr() -> Callable[[str], None] | None:
    """Prints a line of mbody on stderr; None where MBODY_QUIET is set."""
    if os.environ.get("MBODY_QUIET", "0") not in ("", "0") or sys.stderr is None:
        return None

    def tell(text: str) -> None:
        with contextlib.suppress(OSError, ValueError):
            print(f"mbody: {text}", file=sys.stderr, flush=True)

    return tell


def builder_command(
    names: list[str], target: str, folder: Path, *options: str
) -> tuple[list[str], dict[str, str]]:
    """The program that builds kernels (``module:name``) into a folder, and its environment."""
    path = os.pathsep.join(filter(None, [str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")]))
    settings = os.environ | {"MBODY_CORE": "numba", "MBODY_QUIET": "1", "PYTHONPATH": path}
    command = [sys.executable, "-m", registered.builder, "--target", target, *options]
    command += ["--out", str(folder), "--sources", source_hash() or "", *names]
    return command, settings


def place(function: Callable[..., Any]) -> str:
    """Where the builder finds a kernel."""
    return f"{function.__module__}:{function.__name__}"


def run_builder(
    command: list[str],
    settings: dict[str, str],
    say: Callable[[str], None] | None = None,
    errors: IO[str] | None = None,
) -> int:
    """Run the builder: its exit status. `say` gets each name when that part is begun; what it says
    of errors goes to a file, by default to where those of this process go.
    """
    import subprocess

    with subprocess.Popen(
        command,
        env=settings,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=errors,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                if say is not None:
                    say(line.strip())
        except BaseException:
            process.kill()
            raise
    return process.returncode


def builder_fails(
    command: list[str], settings: dict[str, str], say: Callable[[str], None] | None, most: int = 6
) -> str | None:
    """Run the builder: None, or the last lines of its errors where it could not build."""
    import tempfile

    # a file, not a pipe: a full one would stop the builder while its names are read
    with tempfile.TemporaryFile("w+", encoding="utf-8") as said:
        if not run_builder(command, settings, say, said):
            return None
        said.seek(0)
        return "\n".join(said.read().strip().splitlines()[-most:])


def progress(what: str, count: int) -> Callable[[str], None] | None:
    """Announce on stderr that something is built, in so many steps; gives what names the step that
    is under way, as "building positions, 4 of 7". None where MBODY_QUIET is set.
    """
    tell = _stderr()
    if tell is None:
        return None
    tell(f"building {what} (once) ...")
    begun = itertools.count(1)
    return lambda name: tell(f"building {name}, {next(begun)} of {count}")


def _build(functions: list[Callable[..., Any]], say: Callable[[str], None] | None) -> None:
    choice = selection.chosen()
    assert choice.file is not None and choice.level is not None
    names = [place(function) for function in functions]
    command, settings = builder_command(names, choice.level, choice.file)
    last = builder_fails(command, settings, say, 12)
    if last is not None:
        raise RuntimeError(
            f"the machine code of {', '.join(names)} could not be built; MBODY_CORE=numba does "
            f"without it. The builder said:\n{last}"
        )


def missing() -> list[Callable[..., Any]]:
    """The loaded kernels that are not built yet."""
    choice = selection.chosen()
    if choice.library is not None or choice.file is None:
        return []
    return [one for one in KERNELS.values() if not file_of(one).exists()]
