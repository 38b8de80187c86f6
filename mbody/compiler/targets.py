"""Targets of machine code: triple, processor and features of each, and how objects are linked."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba.core import config

from mbody.core.selection import ZIG, linker


@dataclass(frozen=True)
class Target:
    """A kind of machine."""

    name: str
    triple: str
    cpu: str
    features: str = ""
    #: Arguments of the linker: of the C compiler of this machine, or of ``zig cc`` for others.
    link: tuple[str, ...] = ()
    #: Name of the library in the package.
    file: str = ""
    #: Whether its libraries were run, not only made.
    tested: bool = True
    #: Whether mbody itself opens its libraries; a browser takes nothing behind a module's end.
    opened: bool = True
    #: How machine code finds its data: at any address, or as it was linked.
    reloc: str = "pic"


def _host() -> Target:
    """The machine itself, or the processor that numba is set to."""
    settings: Any = config
    name = settings.CPU_NAME or llvm.get_host_cpu_name()
    own = "" if settings.CPU_NAME else llvm.get_host_cpu_features().flatten()
    return Target("host", llvm.get_process_triple(), name, settings.CPU_FEATURES or own)


_LINUX = "x86_64-unknown-linux-gnu"
_ZIG_LINUX = ("-target", "x86_64-linux-gnu.2.17", "-lm")

TARGETS = {
    target.name: target
    for target in (
        _host(),
        Target("x86-64-v2", _LINUX, "x86-64-v2", "", _ZIG_LINUX, "linux-x86-64-v2.so"),
        Target("x86-64-v3", _LINUX, "x86-64-v3", "", _ZIG_LINUX, "linux-x86-64-v3.so"),
        Target("x86-64-v4", _LINUX, "x86-64-v4", "", _ZIG_LINUX, "linux-x86-64-v4.so"),
        Target(
            "aarch64",
            "aarch64-unknown-linux-gnu",
            "generic",
            "+neon",
            ("-target", "aarch64-linux-gnu.2.17", "-lm"),
            "linux-aarch64.so",
            tested=False,
        ),
        Target(
            "windows",
            "x86_64-pc-windows-gnu",
            "x86-64-v3",
            "",
            ("-target", "x86_64-windows-gnu"),
            "windows-x86-64-v3.dll",
            tested=False,
        ),
        Target(
            "macos",
            "arm64-apple-macosx11.0.0",
            "apple-m1",
            "",
            ("-target", "aarch64-macos.11.0"),
            "macos-arm64.dylib",
            tested=False,
        ),
        # 128-bit vectors; no fused multiply-add, of which browsers have their own
        Target(
            "wasm32",
            "wasm32-unknown-wasi",
            "generic",
            "+simd128,+bulk-memory",
            ("-target", "wasm32-wasi", "-mexec-model=reactor"),
            "mbody.wasm",
            opened=False,
            reloc="static",
        ),
    )
}


def link(
    target: Target, objects: list[Path], library: Path, exports: list[str], portable: bool = False
) -> None:
    """Link objects into a shared library, a portable one against the oldest C library supported, or
    into a module of WebAssembly that has nothing but these exports, and needs nothing. C sources
    among them are compiled; of these only what says so is seen outside.
    """
    own = linker()
    if own and (target.name == "host" or (target.triple == _LINUX and not portable)):
        command = [*own, "-lm"]
    elif find_spec("ziglang"):
        command = [*ZIG, *target.link]
    else:
        raise RuntimeError(
            f"a library for {target.name} is linked by ziglang, which is not installed: "
            "pip install ziglang"
        )
    # libraries at the end: what an object needs is looked for behind it
    front = [part for part in command if part != "-lm"]
    back = [part for part in command if part == "-lm"]
    kind = ["-shared", "-s"]
    if "linux" in target.triple:
        # a library's own door to users' functions, whatever else the process has loaded for all
        kind.append("-Wl,-Bsymbolic")
    if not target.opened:
        kind = ["-Wl,--no-entry", "-Wl,--strip-all", "-Wl,--gc-sections"]
        kind += [f"-Wl,--export={name}" for name in (*exports, "__heap_base")]
    if any(one.suffix == ".c" for one in objects):
        kind += ["-std=c99", "-O2", "-fPIC", "-fvisibility=hidden"]
    whole = [*front, *kind, "-o", str(library), *map(str, objects), *back]
    done = subprocess.run(whole, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(whole)}: {done.stderr.strip()}")
