"""Linking: functions that only compiled functions call get no machine code of their own.

Numba optimises each compiled function together with all that it calls, turns that into machine code
and wraps it for Python. For a function that only kernels call, this work is wasted: each kernel
optimises the same source again as a part of itself. Here such a function remains LLVM code until it
is linked into a kernel, together with all functions that it calls, each once.

If such a function is called from Python, as in tests, it is compiled again in numba's usual way.
"""

from __future__ import annotations

import gc
import hashlib
from collections.abc import Callable
from typing import Any

from numba.core import codegen, registry, typed_passes
from numba.core.compiler import CR_FIELDS, CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.lowering import Lower

from mbody.compiler.cache import attach_cache

# -- Identity of a compiled function, equal in every process -----------------------------------

_DIGITS = 15
_PLAIN = (bool, int, float, str, type(None))


def identity(function: Any, role: str = "") -> int:
    """A number made of the name and the place of a function and of the variables that it encloses,
    and of what its machine code is for.

    Functions that a factory makes differ in nothing but these variables.
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
    where += f":{hashlib.sha256(code.co_code).hexdigest()[:_DIGITS]}"  # two lambdas of one line
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


# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False
# mypy: disable-error-code="assignment,attr-defined"


class InnerLibrary(codegen.JITCodeLibrary):
    """Code of one function, neither linked with what it calls nor optimised as a whole."""

    def finalize(self) -> None:
        """Nothing to do before the code is linked into a kernel."""
        self._raise_if_finalized()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: there is no machine code."""
        return 0

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        """The code with all that it calls."""
        module = self._get_module_for_linking().clone()
        link_into(module, called_libraries(self))
        return self.name, "inner", module.as_bitcode()

    @classmethod
    def restored(cls, home: Any, name: str, bitcode: bytes) -> InnerLibrary:
        """The library from what `serialize_using_object_code` returned."""
        from llvmlite import binding

        found = cls(home, name)
        found._final_module = found._shared_module = binding.parse_bitcode(bitcode)
        found._finalized = True
        return found


class EntryLibrary(codegen.JITCodeLibrary):
    """Code of a kernel, linked with that of all functions that it calls in turn, each once."""

    def finalize(self) -> None:
        """Link, optimise, make machine code."""
        libraries = called_libraries(self)
        link_into(self._final_module, libraries)
        for library in libraries:
            # numba before 0.63 keeps no such list
            getattr(self, "_reload_init", set()).update(getattr(library, "_reload_init", ()))
        self._linking_libraries = []
        super().finalize()


def link_into(module: Any, libraries: list[Any]) -> None:
    """Link the code of libraries into a module.

    LLVM leaves out functions that nothing has used so far, but a library linked later may use them.
    So linking is repeated for the symbols that are still undefined; otherwise a kernel would call
    an undefined address.
    """
    homes = {
        function.name: library
        for library in libraries
        for function in library._get_module_for_linking().functions
        if not function.is_declaration
    }
    pending = libraries
    while pending:
        for library in pending:
            module.link_in(library._get_module_for_linking(), preserve=True)
        undefined = {function.name for function in module.functions if function.is_declaration}
        left = list({homes[name]: None for name in sorted(undefined & homes.keys())})
        if left == pending:
            raise RuntimeError(f"{left[0].name} cannot be linked")
        pending = left


def called_libraries(library: Any) -> list[Any]:
    """Libraries of all functions that those called by a library call in turn."""
    found: dict[Any, None] = {}
    waiting = list(library._linking_libraries)
    while waiting:
        one = waiting.pop()
        if one not in found:
            found[one] = None
            if isinstance(one, InnerLibrary):
                waiting += one._linking_libraries
    return list(found)


def name_symbol(state: Any, role: str) -> None:
    """Give a function a symbol that depends on what it is.

    Numba numbers functions as they come in a process. Code from the cache has the numbers of
    another process, so that two branches of one factory could bear the same symbol, of which the
    linker keeps one: the other kind would be computed with its code.
    """
    function = state.func_ir.func_id
    function.unique_id = identity(function.func, role)
    function.unique_name = f"{function.func_qualname}${function.unique_id}"


@register_pass(mutates_CFG=True, analysis_only=False)
class InnerLowering(typed_passes.BaseNativeLowering):
    """Lowering into an `InnerLibrary`, without wrappers for Python and for C."""

    _name = "inner_lowering"
    lowering_class = Lower

    def run_pass(self, state: Any) -> bool:
        """Lowers a function into an inner library, in place of numba's `BaseNativeLowering`."""
        name_symbol(state, self._name)
        library = InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library = library
        flags = state.flags
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        super().run_pass(state)
        library._ensure_finalized()
        found = state["cr"]
        # numba looks compiled functions up by their entry points
        entry = _entry(found.fndesc.qualname)
        state["cr"] = found._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, found.fndesc, [library])
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class EntryLowering(typed_passes.BaseNativeLowering):
    """Lowering into an `EntryLibrary`, without a wrapper for C."""

    _name = "entry_lowering"
    lowering_class = Lower

    def run_pass(self, state: Any) -> bool:
        """Lowers an entry into a library that is kept, in place of numba's `BaseNativeLowering`."""
        name_symbol(state, self._name)
        library = EntryLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        library.enable_object_caching()
        state.library = library
        state.flags.no_cfunc_wrapper = True
        super().run_pass(state)
        return True


def _entry(name: str) -> Callable[..., Any]:
    def inner(*_: Any) -> None:
        raise TypeError(f"{name} has no machine code of its own")

    return inner


def _pipeline(lowering: Any) -> Any:
    """Numba's passes with another lowering."""

    class Pipeline(CompilerBase):
        def define_pipelines(self) -> list[Any]:
            whole = PassManager(lowering._name)
            builder = DefaultPassBuilder
            for part in (
                builder.define_untyped_pipeline(self.state),
                builder.define_typed_pipeline(self.state),
                builder.define_nopython_lowering_pipeline(self.state),
            ):
                for step, why in part.passes:
                    whole.add_pass(lowering if step is typed_passes.NativeLowering else step, why)
            whole.finalize()
            return [whole]

    return Pipeline


_INNER, _ENTRY = _pipeline(InnerLowering), _pipeline(EntryLowering)


class Entry(registry.CPUDispatcher):
    """A kernel, called from Python."""

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None) -> None:
        super().__init__(py_func, locals or {}, targetoptions, pipeline_class=_ENTRY)

    def compile(self, signature: Any) -> Any:
        """Compiles a signature, as numba's `Dispatcher`; garbage is collected once, at the end."""
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super().compile(signature)
        finally:
            if collecting:
                gc.enable()

    def add_overload(self, found: Any) -> None:
        """Store the compiled code, and register the environments of the functions within it."""
        home = found.target_context.codegen()
        for environment in found._find_referenced_environments():
            home.set_env(environment.env_name, environment)
        super().add_overload(found)


class Inner(registry.CPUDispatcher):
    """A function that compiled functions call; calls from Python go to an `Entry` made for them."""

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None) -> None:
        super().__init__(py_func, locals or {}, targetoptions, pipeline_class=_INNER)
        self._called: Entry | None = None

    def add_overload(self, found: Any) -> None:
        """Store the compiled code, without making it callable from Python."""
        self.overloads[tuple(found.signature.args)] = found

    def _compile_for_args(self, *arguments: Any, **named: Any) -> Any:
        if self._called is None:
            self._called = Entry(self.py_func, targetoptions=self.targetoptions)
            attach_cache(self._called, self.py_func, "called-")
        return self._called._compile_for_args(*arguments, **named)

    @staticmethod
    def rebuilt(context: Any, payload: Any) -> Any:
        """An `Inner` restored from the cache: `payload` is what `CompileResult._reduce`
        returned.
        """
        (name, _, bitcode), fndesc, environment, signature, *_, annotation, reload, _ = payload
        library = InnerLibrary.restored(context.codegen(), name, bitcode)
        parts = dict.fromkeys(CR_FIELDS) | {
            "typing_context": context.typing_context,
            "target_context": context,
            "library": library,
            "environment": environment,
            "entry_point": _entry(fndesc.qualname),
            "fndesc": fndesc,
            "type_annotation": annotation,
            "signature": signature,
            "objectmode": False,
            "lifted": (),
            "reload_init": reload,
            "referenced_envs": (),
        }
        return CompileResult(**parts)
