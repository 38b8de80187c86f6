"""Bytes of an image: arrays, tables of bundles, names of entries."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from mbody.core.bundle import Bundle, array_words
from mbody.core.interface import KERNELS, Array, signature
from mbody.core.libraries import by_library
from mbody.core.native_builder import builder_command, builder_fails, place, progress
from mbody.core.selection import PACKAGE, STAMP_DIGITS, cache_folder, source_hash
from mbody.errors import ModelError
from mbody.kernels.advance import advance_motion
from mbody.kernels.continuation import follow
from mbody.kernels.image_calls import begin_motion, close_at
from mbody.kernels.number_program import measures, set_numbers
from mbody.kernels.runge_kutta import runge_kutta

# -- The compiled core for browsers: WebAssembly of the package, or built once on this machine -

# -- The kernels that images call: a fourth of all ---------------------------------------------

IMAGE_KERNELS = (
    set_numbers,
    measures,
    close_at,
    follow,
    begin_motion,
    runge_kutta,
    advance_motion,
)


#: Name of the target of the compiler.
TARGET = "wasm32"
#: Name of the core for browsers, in the package and beside it.
FILE = "mbody.wasm"
#: The ES module that loads it.
MODULE = Path(__file__).parent / "browser" / "mbody.mjs"


def browser_core() -> Path:
    """The file of the core for browsers, built where neither the package nor the cache has it."""
    ready = ready_core()
    if ready is not None:
        return ready
    folder = _core_folder()
    if folder is None:
        raise ModelError(
            "the core for browsers has to be built, and no folder to keep it can be written: set "
            "MBODY_CACHE_DIR"
        )
    steps = len(by_library(IMAGE_KERNELS)) + 1  # the last one is the file itself
    build_browser_core(folder, progress("the core for browsers", steps))
    return folder / FILE


def ready_core() -> Path | None:
    """The file of the core for browsers where the package or the cache has it."""
    sources, folder = source_hash() or "", _core_folder()
    places = [PACKAGE / "core_libraries" / FILE, *([] if folder is None else [folder / FILE])]
    return next((one for one in places if one.exists() and made_from(one, sources)), None)


def _core_folder() -> Path | None:
    """The folder of the cache for this core."""
    stamp = hashlib.sha256(f"{TARGET} {source_hash() or ''}".encode()).hexdigest()[:STAMP_DIGITS]
    return cache_folder(stamp)


def build_browser_core(folder: Path, say: Callable[[str], None] | None = None) -> None:
    """Build the core for browsers into a folder; `say` gets the name of each step."""
    missing = [name for name in ("numba", "ziglang") if find_spec(name) is None]
    if missing:
        raise ModelError(
            "the core for browsers is built by numba and ziglang, not all of which are installed: "
            f"pip install {' '.join(missing)}"
        )
    names = [place(kernel) for kernel in IMAGE_KERNELS]
    command, settings = builder_command(names, TARGET, folder, "--whole")
    last = builder_fails(command, settings, say)
    if last is not None:
        raise ModelError(f"the core for browsers could not be built; the builder said:\n{last}")


def made_from(file: Path, sources: str) -> bool:
    """Whether a core was made from these sources; their hash is among its data."""
    return bool(sources) and sources.encode() in file.read_bytes()


#: The first word of an image, and the number of its format.
MAGIC, FORMAT = b"mbodyimg", 1
#: Word of the checksum.
CHECKSUM = 13
#: Words before the data; bytes on which every array begins.
HEAD, LINE = 16, 64
#: Kinds of entries: a changeable number, an input (such a number that may change while a motion
#: goes on), a measure, the arguments of a kernel, an array, where a state of a user's own begins.
NUMBER, INPUT, MEASURE, CALL, ARRAY, STATE = range(1, 7)


@dataclass(frozen=True)
class ImageEntry:
    """A named entry of an image: its kind, the byte at which it begins, how many numbers or words
    it has, and its unit.
    """

    kind: int
    offset: int
    count: int
    name: str
    unit: str = ""


@dataclass
class Arena:
    """Memory that is laid out piece by piece; an array that is put twice lies there once."""

    end: int = 8 * HEAD
    entries: list[ImageEntry] = field(default_factory=list)
    #: Bytes from the start of the image at which words lie that hold places.
    pointers: list[int] = field(default_factory=list)
    parts: list[tuple[int, np.ndarray]] = field(default_factory=list)
    known: dict[tuple[int, int], int] = field(default_factory=dict)
    tables: dict[int, int] = field(default_factory=dict)
    #: What has been put, kept alive: an address must not be used again.
    kept: list[Any] = field(default_factory=list)

    def put(self, array: np.ndarray) -> int:
        """The place of an array."""
        key = array.__array_interface__["data"][0], array.nbytes
        if key not in self.known:
            self.end += -self.end % LINE
            self.known[key] = self.end
            self.parts.append((self.end, array))
            self.kept.append(array)
            self.end += array.nbytes
        return self.known[key]

    def bundle(self, bundle: Any) -> int:
        """The place of the table of a bundle; its arrays are put too."""
        if id(bundle) in self.tables:
            return self.tables[id(bundle)]
        self.kept.append(bundle)
        words: list[int] = []
        pointers: list[int] = []
        numbers: dict[str, int] = {}
        memory = vars(bundle).get("memory")
        for name in bundle.fields:
            value = getattr(bundle, name)
            if isinstance(value, np.ndarray):
                place = self._within(memory, value)
                # the pointer is the fifth word of numba's record of an array
                pointers.append(len(words) + 4)
                words += array_words(place, value.shape, value.itemsize)
            elif isinstance(value, Bundle):
                pointers.append(len(words))
                words.append(self.bundle(value))
            else:
                numbers[name] = len(words)
                words.append(self._word(value))
        place = self.table(words, pointers)
        self.tables[id(bundle)] = place
        return place

    def _within(self, memory: np.ndarray | None, array: np.ndarray) -> int:
        """The place of an array, which may lie in the memory of a workspace."""
        if memory is None:
            return self.put(array)
        begin, here = (one.__array_interface__["data"][0] for one in (memory, array))
        return self.put(memory) + int(here) - int(begin)

    def place(self, bundle: Any, name: str) -> int:
        """The place of an array of a bundle that was put."""
        self.bundle(bundle)
        return self._within(getattr(bundle, "memory", None), getattr(bundle, name))

    @staticmethod
    def _word(value: float) -> int:
        if isinstance(value, float):
            return int(np.float64(value).view(np.int64))
        return int(value)

    def field_place(self, bundle: Bundle, name: str) -> int:
        """The place of a number in the table of a bundle."""
        at = 0
        for one in bundle.fields:
            value = getattr(bundle, one)
            if one == name:
                break
            at += len(array_words(0, value.shape)) if isinstance(value, np.ndarray) else 1
        return self.bundle(bundle) + 8 * at

    def table(self, words: list[int], pointers: list[int]) -> int:
        """The place of words, of which some hold places."""
        place = self.put(np.array(words, dtype=np.int64))
        self.pointers += [place + 8 * n for n in pointers]
        return place

    def call(self, name: str, kernel: str, *values: Any) -> dict[str, int]:
        """Enter the arguments of a kernel under a name: the place of each word by the name of the
        argument.
        """
        interface = signature(KERNELS[kernel])
        words: list[int] = []
        pointers: list[int] = []
        at: dict[str, int] = {}
        for argument, kind, value in zip(interface.names, interface.arguments, values, strict=True):
            at[argument] = len(words)
            if isinstance(kind, Array):
                pointers.append(len(words))
                words += [self.put(value), *value.shape]
            elif isinstance(kind, type) and issubclass(kind, Bundle):
                pointers.append(len(words))
                words.append(self.bundle(value))
            else:
                words.append(self._word(kind(value)))
        place = self.table(words, pointers)
        self.entries.append(ImageEntry(CALL, place, len(words), name))
        return {argument: place + 8 * n for argument, n in at.items()}

    def array(self, name: str, array: np.ndarray, unit: str = "") -> None:
        """Enter an array that was put, or is put now, under a name."""
        self.entries.append(ImageEntry(ARRAY, self.put(array), array.size, name, unit))

    def word(self, name: str, place: int, count: int = 1) -> None:
        """Enter numbers at a known place under a name."""
        self.entries.append(ImageEntry(ARRAY, place, count, name))

    def image(self, manifest: bytes, sources: str) -> bytes:
        """All of it: head, data, names, entries, words that hold places, manifest."""
        texts = bytearray()
        places: dict[str, int] = {}
        first = self.end + -self.end % 8
        for entry in self.entries:
            for text in (entry.name, entry.unit):
                if text not in places:
                    places[text] = first + len(texts)
                    texts += text.encode() + b"\0"
        texts += bytes(-len(texts) % 8)
        entries = [
            (entry.kind, entry.offset, entry.count, places[entry.name], places[entry.unit])
            for entry in self.entries
        ]
        table = first + len(texts)
        moved = table + 40 * len(entries)
        about = moved + 8 * len(self.pointers)
        total = about + len(manifest) + -len(manifest) % 8
        memory = np.zeros(total, dtype=np.uint8)
        for one_place, array in self.parts:
            flat = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
            memory[one_place : one_place + array.nbytes] = flat
        words = memory.view(np.int64)
        memory[:8] = np.frombuffer(MAGIC, dtype=np.uint8)
        words[1:5] = FORMAT, total, moved // 8, len(self.pointers)
        words[5:9] = table // 8, len(entries), about, len(manifest)
        memory[72:104] = np.frombuffer(bytes.fromhex(sources), dtype=np.uint8)
        memory[first:table] = np.frombuffer(bytes(texts), dtype=np.uint8)
        words[table // 8 : moved // 8] = np.ravel(entries) if entries else []
        words[moved // 8 : about // 8] = [place // 8 for place in self.pointers]
        memory[about : about + len(manifest)] = np.frombuffer(manifest, dtype=np.uint8)
        words[CHECKSUM] = checksum(memory.view(np.uint64)).view(np.int64)
        return memory.tobytes()


def checksum(words: np.ndarray) -> np.uint64:
    """Σ (2n + 1) word n, modulo 2⁶⁴, without the word of the checksum itself; never 0. No change of
    one word leaves it.
    """
    weights = 2 * np.arange(words.size, dtype=np.uint64) + np.uint64(1)
    weights[CHECKSUM] = 0
    return max(np.sum(weights * words, dtype=np.uint64), np.uint64(1))
