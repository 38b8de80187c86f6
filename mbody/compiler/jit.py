"""Compilation of the kernels: decorators, and a count of what was compiled.

Every compiled function of the package has the decorator ``@njit``, ``@inline`` or ``@kernel`` of
this module.  Compiled code is stored on disk (`mbody.compiler.cache`) and loaded by later
processes.  Two environment variables matter:

``MBODY_CACHE_DIR``  the folder for compiled kernels,
``MBODY_QUIET``      any text but "0": do not announce a compilation.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable
from typing import Any

from mbody.compiler.cache import attach_cache, numba_folder
from mbody.core.interface import FASTMATH

Entry: Any
Inner: Any
try:
    from mbody.compiler.linking import Entry, Inner
except Exception:  # an interface of numba has changed: every function gets its own machine code
    from numba.core.registry import CPUDispatcher

    Entry = Inner = CPUDispatcher


# ---------------------------------------------------------------------------------------------
# The decorators


def _compile(function: Callable[..., Any], kind: Any, options: dict[str, Any]) -> Any:
    options = dict(options)
    cached = options.pop("cache", True)
    settings: dict[str, Any] = {
        "nopython": True,
        "nogil": True,
        "error_model": "numpy",
        "fastmath": set(FASTMATH),
        "boundscheck": None,
        "_nrt": False,
        **options,
    }
    dispatcher = kind(function, targetoptions=settings)
    if cached:
        attach_cache(dispatcher, function)
    return dispatcher


def njit(function: Any = None, /, **options: Any) -> Any:
    """Compile a function of kernels: ``@njit`` or ``@njit(forceinline=True, ...)``.

    The options are those of ``numba.njit``; here ``cache`` and ``nogil`` are on, a division
    by zero gives an infinity instead of an exception, and ``fastmath`` is ``FASTMATH``. The
    function has no machine code of its own (`mbody.compiler.linking`) and allocates no arrays.
    """
    if function is None:
        return lambda function: _compile(function, Inner, options)
    return _compile(function, Inner, options)


def inline(function: Any, /) -> Any:
    """Compile a small function so that its code is always copied into the caller."""
    return _compile(function, Inner, {"forceinline": True})


def kernel(function: Any, /) -> Any:
    """Compile an entry point, which Python calls.

    It allocates and returns no arrays, and neither do the functions that it calls: they work
    in the arrays of their arguments. So reference counting is switched off in all functions of
    the package. With it, each ``fields.rows`` of a named tuple would be an atomic addition,
    which costs a scalar kernel 40 % and makes threads wait for each other.
    """
    return _compile(function, Entry, {})


# ---------------------------------------------------------------------------------------------
# What has been compiled

_compiled = 0


def compilations() -> int:
    """Number of functions of the package compiled, not loaded from disk, in this process."""
    return _compiled


def _announce() -> None:
    if os.environ.get("MBODY_QUIET", "0") not in ("", "0") or sys.stderr is None:
        return
    if numba_folder() is not None:
        detail = "once, up to a minute"
    else:
        detail = "no folder to store them, see MBODY_CACHE_DIR"
    with contextlib.suppress(OSError, ValueError):
        print(f"mbody: compiling kernels for this machine ({detail}) ...", file=sys.stderr)


def _count(dispatcher: Any) -> None:
    global _compiled
    module = getattr(getattr(dispatcher, "py_func", None), "__module__", None) or ""
    if module.partition(".")[0] == __name__.partition(".")[0]:
        _compiled += 1
        if _compiled == 1:
            _announce()


def _listen() -> None:
    """Count numba's compile events; functions loaded from disk cause none."""
    try:
        from numba.core import event

        class Compilations(event.Listener):
            def on_start(self, event: Any) -> None:
                _count(event.data.get("dispatcher"))

            def on_end(self, event: Any) -> None:
                pass

        event.register("numba:compile", Compilations())
    except Exception:
        return  # an interface of numba has changed: compilations are not counted


_listen()
