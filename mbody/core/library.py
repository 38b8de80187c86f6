"""A library of machine code: finding the level of the processor, opening, checking its hash."""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import platform
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mbody.core.callbacks import DOOR
from mbody.errors import ModelError


class LibraryError(OSError):
    """Why a library cannot be used."""


@dataclass(frozen=True)
class Level:
    """Processors that one library is for."""

    name: str
    system: str
    machine: str
    file: str
    #: Features of the processor that it needs, by NumPy's names.
    needs: tuple[str, ...] = ()


#: Best first.
LEVELS = (
    Level("x86-64-v4", "linux", "x86_64", "linux-x86-64-v4.so", ("AVX512_SKX", "AVX2", "FMA3")),
    Level("x86-64-v3", "linux", "x86_64", "linux-x86-64-v3.so", ("AVX2", "FMA3")),
    Level("x86-64-v2", "linux", "x86_64", "linux-x86-64-v2.so", ("SSE42",)),
    Level("aarch64", "linux", "aarch64", "linux-aarch64.so"),
    Level("x86-64-v3", "win32", "x86_64", "windows-x86-64-v3.dll", ("AVX2", "FMA3")),
    Level("arm64", "darwin", "aarch64", "macos-arm64.dylib"),
)
_SEAL = hashlib.sha256().digest_size
_MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}


def processor_features() -> frozenset[str]:
    """Features of the processor, by NumPy's names."""
    # NumPy has no types of its private modules
    from numpy._core._multiarray_umath import __cpu_features__  # type: ignore[import-not-found]

    return frozenset(name for name, there in __cpu_features__.items() if there)


def best_levels() -> Iterator[Level]:
    """The levels that this processor has, best first; ``MBODY_CORE_LEVEL`` names the only one."""
    features = processor_features()
    wanted = os.environ.get("MBODY_CORE_LEVEL")
    machine = platform.machine().lower()
    machine = _MACHINES.get(machine, machine)
    if wanted and wanted != "host" and wanted not in {level.name for level in LEVELS}:
        names = ", ".join(dict.fromkeys(level.name for level in LEVELS))
        raise ModelError(f"MBODY_CORE_LEVEL={wanted} is none of the levels host, {names}")
    for level in LEVELS:
        if (level.system, level.machine) != (sys.platform, machine):
            continue
        lacking = [name for name in level.needs if name not in features]
        if wanted == level.name and lacking:
            raise ModelError(
                f"MBODY_CORE_LEVEL={wanted}, but this processor has no {', '.join(lacking)}: "
                "choose a lower level"
            )
        if not lacking and wanted in (None, "", level.name):
            yield level


class Library:
    """An opened library of kernels."""

    def __init__(self, opened: ctypes.CDLL, file: Path) -> None:
        self._opened, self.file = opened, file

    def entries(self) -> dict[str, Any]:
        """Its table: ``"kernels"``, the arguments and results of each, and ``"needs"``, the
        functions of the C library that it calls.
        """
        found: dict[str, Any] = json.loads(
            ctypes.string_at(_address(self._opened, "mbody_entries"))
        )
        return found

    def function(self, name: str, arguments: list[Any]) -> Any:
        """The entry of a kernel for calls from Python."""
        try:
            found = self._opened[f"mbody_{name}_np"]
        except AttributeError:
            raise LibraryError(f"{self.file} has no kernel {name!r}") from None
        found.argtypes, found.restype = arguments, ctypes.c_int32
        return found


def seal(file: Path) -> None:
    """Append the hash of a library to it, so that half a file is recognised before it is opened:
    the loader of the system would read beyond its end.
    """
    with file.open("r+b") as opened:
        digest = hashlib.sha256(opened.read()).digest()
        opened.write(digest)


def _check_whole(file: Path) -> None:
    content = file.read_bytes()
    whole, digest = content[:-_SEAL], content[-_SEAL:]
    if len(content) <= _SEAL or hashlib.sha256(whole).digest() != digest:
        raise ValueError("its content is not what was written")


def _address(opened: ctypes.CDLL, name: str) -> int:
    return ctypes.addressof(ctypes.c_char.in_dll(opened, name))


def open_library(file: Path, sources: str | None) -> Library:
    """Open a library that was made from these sources, and give it the door to users' Python."""
    try:
        _check_whole(file)
        opened = ctypes.CDLL(str(file))
        made_from = (ctypes.c_char * 64).in_dll(opened, "mbody_sources").value.decode()
        door = ctypes.c_void_p.in_dll(opened, "mbody_user_door")
        head = ctypes.c_int64.in_dll(opened, "mbody_object_head")
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise LibraryError(f"{file} is damaged ({error}): install mbody again") from None
    if made_from != sources:
        raise LibraryError(f"{file} was made from other sources ({made_from[:8]} …)")
    door.value = ctypes.cast(DOOR, ctypes.c_void_p).value
    # where NumPy's public structure of an array begins: behind the head of any Python object
    head.value = object.__basicsize__
    return Library(opened, file)
