"""The decorators of everything that runs in kernels: ``@kernel``, ``@njit`` and ``@inline``.

What they do depends on the core of the process (`mbody.core.selection`). In a library of machine
code only kernels are called from Python; the functions that they call stay plain Python functions,
which the builder reads. With numba each function is compiled when it is first needed; in plain
Python each stays as it was written.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar, overload

from mbody.core import selection
from mbody.core.interface import register

F = TypeVar("F", bound=Callable[..., Any])

_core = selection.chosen().name

#: True where functions run as the plain Python functions that they were written as.
PLAIN = _core == "plain"

if TYPE_CHECKING:

    @overload
    def njit(function: F, /) -> F: ...
    @overload
    def njit(**options: Any) -> Callable[[F], F]: ...
    def njit(function: Any = None, /, **options: Any) -> Any: ...

    def inline(function: F, /) -> F: ...

    def kernel(function: F, /) -> F: ...

    def compilations() -> int: ...

elif _core == "numba":
    _compiler = selection.compiler()
    njit, inline, _entry = _compiler.njit, _compiler.inline, _compiler.kernel
    compilations = _compiler.compilations

else:

    def njit(function=None, /, **options):
        """Mark a function that kernels call: ``@njit`` or ``@njit(forceinline=True)``.

        It allocates no arrays; a division by zero gives an infinity; the compiler may do what
        `mbody.core.interface.FASTMATH` says.
        """
        return (lambda function: function) if function is None else function

    def inline(function, /):
        """Mark a small function whose code is always copied into the caller."""
        return function

    if _core == "native":
        from mbody.core.native import built as compilations
        from mbody.core.native import kernel as _entry
    else:

        def _entry(function, /):
            return function

        def compilations() -> int:
            """Number of functions compiled in this process: none."""
            return 0


if not TYPE_CHECKING:

    def kernel(function, /):
        """Mark an entry point, which Python calls; its annotations are its interface."""
        register(function)
        return _entry(function)
