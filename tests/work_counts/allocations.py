"""What compiled kernels call, read from the code that LLVM was given, and what they allocate."""

import re
import sys
from collections import defaultdict

from mbody.compiler.linking import Entry

#: Functions of C's library that a kernel may call: of numbers, without memory of their own.
MATHEMATICS = {
    *("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "erf"),
    *("exp", "expm1", "fabs", "floor", "fmod", "hypot", "ldexp", "log", "log10", "log1p", "pow"),
    *("sin", "sincos", "sinh", "sqrt", "tan", "tanh", "memset", "memcpy", "memmove"),
}
#: The door to functions of the user.
DOOR = "mbody_call_user"
_DEFINED = re.compile(r'^define .*?@("[^"]+"|[\w.$-]+)\(')
_CALLED = re.compile(r'@("[^"]+"|[\w.$-]+)\(')
#: What takes a kernel's arguments out of Python's objects, once a call of it.
_WRAPPER = re.compile(r"^(cfunc\.|_ZN7cpython)")


def kernels():
    """{name: dispatcher} of all entry points of modules that are loaded."""
    return {
        part.py_func.__name__: part
        for name, module in list(sys.modules.items())
        if name.startswith(("mbody.kernels", "mbody.laws"))
        for part in list(vars(module).values())
        if type(part) is Entry
    }


def text_of(dispatcher):
    """LLVM's text of all that was compiled of a kernel, with the functions that it calls."""
    return "\n".join(
        str(found.library._get_module_for_linking()) for found in dispatcher.overloads.values()
    )


def calls(text):
    """{function: names that it calls} of a module's text, without what takes arguments apart."""
    found, inside = defaultdict(set), None
    for line in text.splitlines():
        defined = _DEFINED.match(line)
        if defined:
            inside = defined[1].strip('"')
        elif line == "}":
            inside = None
        elif inside and not _WRAPPER.match(inside) and " call " in f" {line}":
            called = line.partition("call ")[2]
            name = _CALLED.search(called)
            found[inside].add(name[1].strip('"') if name else f"a pointer: {called.strip()}")
    return found


def strangers(text):
    """Names that are called and neither defined nor allowed."""
    found = calls(text)
    defined = {m[1].strip('"') for m in map(_DEFINED.match, text.splitlines()) if m}
    everything = set().union(*found.values())
    known = defined | MATHEMATICS | {DOOR}
    return {name for name in everything - known if not name.startswith("llvm.")}


def counted(task):
    """Allocations by numba's runtime while a task runs."""
    from numba.core.runtime import _nrt_python, rtsys

    _nrt_python.memsys_enable_stats()
    try:
        before = rtsys.get_allocation_stats()
        task()
        after = rtsys.get_allocation_stats()
    finally:
        _nrt_python.memsys_disable_stats()
    return after.alloc - before.alloc
