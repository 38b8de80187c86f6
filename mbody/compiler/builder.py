"""Building libraries of kernels ahead of time: a program, run in a process of its own.

    python -m mbody.compiler.builder --target host --out FOLDER --sources HASH MODULE:KERNEL ...

Each kernel is compiled for its one signature as numba compiles a function that others call: lowered
with no wrapper for Python, and linked with the others of its library (`mbody.core.libraries`) and
all that they reach, each function once. Then numba's own two passes of optimisation follow (the
same bits as with numba as the core) and wrappers of plain C. All else becomes internal. ``--whole``
puts all libraries into one file, and ``--also TARGET`` makes machine
code of the same module for another target with the same layout of data. ``--object`` makes an
object file for programs to link, and ``--with FILE`` compiles C sources into the library, which
then shows only what they show.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-calls=False

from __future__ import annotations

import argparse
import gc
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba import types
from numba.core import registry
from numba.core.codegen import CPUCodegen, JITCodeLibrary

from mbody.compiler import cache
from mbody.compiler.c_interface import FORMS, WORDS, common, wrapper
from mbody.compiler.linking import Inner, called_libraries, link_into
from mbody.compiler.numba_bundle import SYMBOL, number_type
from mbody.compiler.targets import TARGETS, Target, link
from mbody.core.interface import Array, signature
from mbody.core.libraries import by_library
from mbody.core.selection import seal, source_hash

_SEEN = ("mbody_user_door", "mbody_object_head", "mbody_sources", "mbody_entries")
#: Ending of an object file; all linkers know it.
OBJECT = ".o"
#: Endings of what a program without NumPy takes of a library.
_FOR_IMAGES = ("_words", "_sources", "_entries")
_PLAIN = {int: types.int64, float: types.float64, bool: types.boolean}


def machine_of(target: Target) -> Any:
    """LLVM's generator of machine code for a target."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, reloc=target.reloc, codemodel="default"
    )


class Build:
    """Machine code of kernels for one target: numba's code generator with its machine and layout.

    One target a process: numba's generator is changed for good. `forms`: which wrappers are made,
    of `mbody.compiler.c_interface`.
    """

    def __init__(self, target: Target, forms: Sequence[str] = FORMS) -> None:
        self.target = target
        self.forms = forms
        self.machine = machine_of(target)
        self.layout = str(self.machine.target_data)
        self.context = registry.cpu_target.target_context
        self.codegen = self.context.codegen()
        # The layout is part of lowering: sizes of structures, and offsets that passes fold.
        self.codegen._tm, self.codegen._data_layout = self.machine, self.layout
        self.codegen._target_data = self.machine.target_data
        self.codegen._create_empty_module = self._empty
        # Nothing is run here, so nothing goes into numba's engine.
        self.codegen._add_module = lambda module: None
        self.codegen._scan_and_fix_unresolved_refs = lambda module: None
        # numba looks functions up by their entry points: a new one for each
        self.context.get_executable = lambda library, description, environment: [].append
        library: Any = JITCodeLibrary
        library._finalize_specific = lambda library: None

    def _empty(self, name: str) -> ir.Module:
        module = ir.Module(name.replace("\\", "_"))
        module.triple, module.data_layout = self.target.triple, self.layout
        return module

    def library(self, name: str, functions: Iterable[Any]) -> Any:
        """The optimised module of kernels; only their wrappers are seen outside."""
        module, reached, wrappers = llvm.parse_assembly(str(self._empty(name))), {}, []
        seen = {SYMBOL, *_SEEN}
        for function in functions:
            plain = function.py_func
            dispatcher = Inner(plain, targetoptions=function.targetoptions)
            dispatcher.compile(tuple(_numba_type(kind) for kind in signature(plain).arguments))
            found: Any = next(iter(dispatcher.overloads.values()))
            entry = found.library._get_module_for_linking().clone()
            entry.get_function(found.fndesc.llvm_func_name).linkage = "external"
            module.link_in(entry)
            reached.update(dict.fromkeys(called_libraries(found.library)))
            called, outside = plain.__name__, found.fndesc
            text = wrapper(self.context, self.target.triple, self.layout, called, outside)
            wrappers.append(str(text))
            seen |= {f"mbody_{called}{form}" for form in self.forms}
        link_into(module, list(reached))
        self._optimise(module)
        for text in wrappers:
            module.link_in(llvm.parse_assembly(text))
        _hide(module, seen)
        _drop_unreached(self.machine, module)
        _rename(module, name)
        return module

    def _optimise(self, module: Any) -> None:
        """The two passes that numba makes (`CPUCodeLibrary._optimize_final_module`)."""
        self._pass(module, opt=0, loop_vectorize=False, slp_vectorize=False, cost="cheap")
        self._pass(module)

    def _pass(self, module: Any, **options: Any) -> None:
        manager, passes = CPUCodegen._module_pass_manager(self.codegen, **options)
        manager.run(module, passes)
        module.verify()

    def whole(self, functions: Iterable[Any], sources: str, say: Callable[[str], None]) -> Any:
        """All libraries of kernels in one module."""
        functions = list(functions)
        whole = llvm.parse_assembly(str(self._empty("kernels")))
        for name, members in by_library(functions).items():
            say(name)
            whole.link_in(self.library(name, members))
        table = json.dumps({"kernels": entries(functions), "needs": needed(whole)})
        text = str(common(self.target.triple, self.layout, sources, table))
        whole.link_in(llvm.parse_assembly(text))
        names = [function.py_func.__name__ for function in functions]
        _hide(whole, {f"mbody_{name}{form}" for name in names for form in self.forms} | {*_SEEN})
        return whole


def needed(module: Any) -> list[str]:
    """Functions that a module takes from elsewhere, LLVM's own and Python's slots excepted."""
    declared = {one.name for one in module.functions if one.is_declaration} - {SYMBOL}
    return sorted(name for name in declared if not name.startswith("llvm."))


def emit(
    target: Target, module: Any, file: Path, portable: bool = False, parts: Sequence[Path] = ()
) -> None:
    """Machine code of a module: an object file by its ending, else linked into a library, with C
    sources where there are `parts`; half a file is never left.
    """
    module = llvm.parse_bitcode(module.as_bitcode())
    machine = machine_of(target)
    module.triple, module.data_layout = target.triple, str(machine.target_data)
    if parts or file.suffix == OBJECT:
        _seen_within(module)
    with tempfile.TemporaryDirectory(dir=file.parent) as folder:
        object_, made = Path(folder) / f"kernels{OBJECT}", Path(folder) / file.name
        object_.write_bytes(machine.emit_object(module))
        if file.suffix == OBJECT:
            made = object_
        else:
            link(target, [object_, *parts], made, _exported(module), portable)
        if target.opened and not (parts or file.suffix == OBJECT):
            seal(made)
        made.replace(file)


def _exported(module: Any) -> list[str]:
    """Functions that a program without NumPy takes of a library."""
    found = (thing for thing in (*module.functions, *module.global_variables))
    names = (thing.name for thing in found if not thing.is_declaration)
    return sorted(n for n in names if n.startswith("mbody_") and n.endswith(_FOR_IMAGES))


def _seen_within(module: Any) -> None:
    """Let only the program or library see the kernels that they are linked into."""
    for thing in [*module.functions, *module.global_variables]:
        if not thing.is_declaration and thing.linkage == llvm.Linkage.external:
            thing.visibility = "hidden"


def output_name(target: Target, object_: bool, parts: Sequence[Path]) -> str:
    """Name of what is made for a target: ``linux-x86-64-v3.so``, ``linux-x86-64-v3.o``, and with
    C sources ``linux-x86-64-v3.fmu.so``, by the last of them.
    """
    library = Path(target.file or "host.so")
    if parts:
        return f"{library.stem}.{parts[-1].stem}{library.suffix}"
    return library.stem + OBJECT if object_ else library.name


def _numba_type(kind: Any) -> Any:
    if isinstance(kind, Array):
        return number_type(kind.number, kind.axes)
    plain = _PLAIN.get(kind)
    return kind._numba_type_ if plain is None else plain


def entries(functions: Iterable[Any]) -> dict[str, Any]:
    """Of each kernel its arguments and results."""

    def word(kind: Any) -> str:
        """A kind in words."""
        return f"{kind.number}[{kind.axes}]" if isinstance(kind, Array) else kind.__name__

    found = {}
    for function in functions:
        interface = signature(function.py_func)
        arguments = zip(interface.names, map(word, interface.arguments), strict=True)
        found[function.py_func.__name__] = [
            [f"{name}: {kind}" for name, kind in arguments],
            [word(kind) for kind in interface.results],
        ]
    return found


def _drop_unreached(machine: Any, module: Any) -> None:
    """Drop what nobody calls: wrappers call the kernel, which is optimised already."""
    manager = llvm.ModulePassManager()
    manager.add_global_dead_code_eliminate_pass()
    manager.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options()))


def _hide(module: Any, seen: set[str]) -> None:
    """Internal linkage for all but some names: what is not reached falls out."""
    for thing in [*module.functions, *module.global_variables]:
        if thing.name in seen or thing.name.startswith("llvm."):
            continue
        if not thing.is_declaration:
            thing.linkage = "internal"


def _rename(module: Any, prefix: str) -> None:
    """Short names inside: numba's tell all types of their arguments, 2.5 kB each."""
    count = 0
    for thing in [*module.functions, *module.global_variables]:
        if not thing.is_declaration and len(thing.name) > 60:
            thing.name = f"{prefix}.{count}"
            count += 1


def _imported(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def main() -> None:
    """The program."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kernels", nargs="+", metavar="MODULE:KERNEL")
    parser.add_argument("--target", default="host", choices=list(TARGETS))
    parser.add_argument("--out", type=Path, default=Path("."))
    parser.add_argument("--sources", default="")
    parser.add_argument("--whole", action="store_true")
    parser.add_argument("--also", action="append", default=[], choices=list(TARGETS))
    parser.add_argument("--object", action="store_true")
    parser.add_argument("--with", dest="parts", action="append", default=[], type=Path)
    options = parser.parse_args()
    if options.sources and source_hash() != options.sources:
        parser.error("the sources were edited while their kernels were to be built: begin again")
    cache.without_cache()  # what a library is made of stands in this process; others know no target
    gc.disable()  # an eighth of the time; the process ends with its work
    functions = [_imported(place) for place in options.kernels]
    target = TARGETS[options.target]
    linked = options.object or options.parts
    build = Build(target, (WORDS,) if linked else FORMS)
    options.out.mkdir(parents=True, exist_ok=True)
    if options.whole:
        module = build.whole(functions, options.sources, _say)
        for one in (target, *(TARGETS[name] for name in options.also)):
            name = output_name(one, options.object, options.parts)
            _say(f"{name}{'' if one.tested else ', untested'}")
            emit(one, module, options.out / name, portable=True, parts=options.parts)
        return
    for name, members in by_library(functions).items():
        emit(target, build.whole(members, options.sources, _say), options.out / f"{name}.so")


def _say(text: str) -> None:
    print(text, flush=True)


if __name__ == "__main__":
    main()
    os._exit(0)  # numba's generator was changed; nothing of it need be taken down
