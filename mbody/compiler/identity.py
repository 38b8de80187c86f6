"""What distinguishes one compiled function from every other, in every process alike."""

from __future__ import annotations

import hashlib
from typing import Any

__all__ = ["identity"]

_DIGITS = 15
_PLAIN = (bool, int, float, str, type(None))


def identity(function: Any, role: str = "") -> int:
    """A number made of the name and the place of a function and of the variables that it encloses,
    and of what its machine code is for.

    Functions that a factory makes differ in nothing but these variables.

    Raises
    ------
    TypeError
        Where an enclosed variable is neither a number, a text nor such a function.
    """
    text = f"{role} {_description(function)}"
    return int(hashlib.sha256(text.encode()).hexdigest()[:_DIGITS], 16)


def _description(function: Any) -> str:
    code = function.__code__
    cells = function.__closure__ or ()
    enclosed = [
        f"{name}={_value(cell.cell_contents, function, name)}"
        for name, cell in zip(code.co_freevars, cells, strict=True)
    ]
    where = f"{function.__module__}.{function.__qualname__}:{code.co_firstlineno}"
    return f"{where}({', '.join(enclosed)})"


def _value(value: Any, function: Any, name: str) -> str:
    value = getattr(value, "py_func", value)
    if isinstance(value, _PLAIN):
        return repr(value)
    if not hasattr(value, "__code__"):
        raise TypeError(
            f"{function.__qualname__} encloses {name}, a {type(value).__name__}: the name of its "
            "machine code cannot tell it from others; enclose numbers, texts and functions"
        )
    return _description(value)
