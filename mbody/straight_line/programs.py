"""Straight-line code of a topology: found where it is kept, made where it is not, and run."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import io
import os
import subprocess
import sys
import tempfile
import threading
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mbody.core import selection
from mbody.core.selection import PACKAGE, LibraryError, open_library, source_hash
from mbody.errors import ModelWarning
from mbody.kernels.continuation import BY_DRIVER
from mbody.kernels.continuation_lanes import FOUND, Designs, LanePath, smallest
from mbody.kernels.layout import PER_PRIMITIVE, Layout, Work
from mbody.kernels.square_lu import Square
from mbody.straight_line import pieces as code_interface

#: Fields of which the code needs to know only how many rows they have.
OWN = ("par", "mass", "q", "past", "time")
#: Bodies up to which code is made: its length, and the time to make it, grow with their square.
MOST = 24
OUTPUT = code_interface.WORDS_OF_MOTION.index("output")
_lock = threading.Lock()
_codes: dict[str, StraightLineCode | None] = {}


@dataclass(frozen=True, eq=False)
class StraightLineCode:
    """The code of one topology.

    `function`: The machine code.
    `initial`: Rows of the workspace whose first numbers it is given.
    """

    function: Any
    initial: tuple[tuple[str, int], ...]

    def first_numbers(self, work: Work) -> np.ndarray:
        """The first numbers that it is given, of a workspace of the system."""
        return np.array([getattr(work, name)[n, 0] for name, n in self.initial])

    def follow_designs(
        self, L: Layout, work: Work, path: LanePath, designs: Designs, output: np.ndarray
    ) -> None:
        """Follow all designs, as the kernel of that name does, by the code of designs: output
        (kept, designs, instants).
        """
        steps = step_table(path)
        initial = self.first_numbers(work)
        groups = np.zeros(2 + len(L.primitive_node), dtype=np.int64)
        reaction = (designs.wanted - 9 * L.bodies) // PER_PRIMITIVE + 1
        groups[np.clip(reaction, 0, len(groups) - 1)] = 1
        arrays = designs.par, designs.mass, designs.q, steps, initial, designs.wanted
        words = [designs.par.shape[1], len(steps), *map(_address, arrays), len(designs.wanted)]
        words += map(_address, (groups, output, designs.failed))
        self.run((ctypes.c_int64 * len(words))(*words))

    def run(self, words: Any) -> None:
        """Run the code with its words, an array of ctypes."""
        if self.function(words):
            raise RuntimeError("straight-line code ended with an error")


class MotionCall:
    """A call of the code of one motion, cut into pieces: its arrays are kept, and may take other
    numbers, for all calls of as many instants.

    `q` (rows, lanes): First positions.
    `ends` (rows, lanes): The last instant of every lane.
    `found` (FOUND, lanes): As `LanesOutput` has it.
    """

    def __init__(
        self,
        code: StraightLineCode,
        work: Work,
        instants: code_interface.LaneInstants,
        rows: int,
        initial: np.ndarray,
        *,
        joined: bool,
    ) -> None:
        self.code, self.work, self.instants, self.initial = code, work, instants, initial
        steps, lanes = instants.s.shape
        self.joined = joined
        self.shape = rows, lanes, steps - 1 if joined else steps
        self.q, self.ends, self.found = work.q, np.empty((rows, lanes)), np.empty((FOUND, lanes))
        self.small = np.array([smallest(instants.position_norm)])
        s, t, given = instants.s, instants.t, instants.given
        before = work.par, work.mass, work.q, s, t, given, self.small, initial
        words = [lanes, steps, *map(_address, before), self.shape[2], 0]
        words += map(_address, (self.ends, self.found))
        self.words = (ctypes.c_int64 * len(words))(*words)

    def __call__(self) -> np.ndarray:
        """Follow all lanes, as `follow_lanes` does: (steps, rows, lanes), read along the steps;
        where pieces are joined without the last step, which is the next lane's first.
        """
        output = np.empty(self.shape)
        self.words[OUTPUT] = _address(output)
        self.code.run(self.words)
        if not self.joined:
            output[:, :, -1] = self.ends
        return output.transpose(2, 0, 1)


def _address(array: np.ndarray) -> int:
    """Address of the numbers of an array; `ctypes.data` takes four times as long."""
    found: int = array.__array_interface__["data"][0]
    return found


def step_table(path: LanePath) -> np.ndarray:
    """Numbers of all steps, which all lanes share: (instants, columns)."""
    s, t = path.s[:, 0], path.t[:, 0]
    count = len(s)
    found = {name: np.zeros(count) for name in code_interface.COLUMNS}
    lengths = np.diff(s)
    found["here"], found["time"] = s, t
    found["h"][1:], found["back"][2:], found["longer"][3:] = lengths, lengths[:-1], s[2:-1] - s[:-3]
    found["seen"][1:], found["seen_twice"][2:] = 1.0, 1.0
    back = found["back"]
    found["quintic"][:] = back != 0.0
    found["back_safe"] = np.where(back != 0.0, back, 1.0)
    found["three"][3:] = ((back != 0.0) & (found["longer"] != back))[3:]
    if path.mode == BY_DRIVER:
        found["rate"], found["acceleration"] = path.given[::2, 0], path.given[1::2, 0]
    found["small"][:] = smallest(path.position_norm)
    return np.ascontiguousarray(np.stack([found[name] for name in code_interface.COLUMNS], axis=1))


def straight_line_code(
    L: Layout, pivots: tuple[Square, Square], path: LanePath, work: Work, *, pieces: bool = False
) -> StraightLineCode | None:
    """The code of a topology, of many designs or, with `pieces`, of one motion whose pieces go side
    by side; made where it is not kept. None where there is none: machine code is not the core,
    nothing can build or keep it, or what a kernel does depends on numbers.
    """
    if selection.chosen().name != "native" or not 0 < L.bodies <= MOST:
        return None
    arrays = _description(L, pivots, path, work) | {"path.pieces": np.array(int(pieces))}
    digest = hashlib.sha256((_own_sources() + (source_hash() or "")).encode())
    for name, array in arrays.items():
        digest.update(f"{name}{array.shape}".encode())
        digest.update(array.tobytes())
    key = digest.hexdigest()[:32]
    with _lock:
        if key not in _codes:
            _codes[key] = _built_code(key, arrays)
        return _codes[key]


def _description(
    L: Layout, pivots: tuple[Square, Square], path: LanePath, work: Work
) -> dict[str, np.ndarray]:
    """Inputs on which the code depends, as arrays by name; of numbers only whether they are
    structural.
    """
    found: dict[str, Any] = {}
    for name in L.fields:
        value = getattr(L, name)
        # addresses of users' functions, of which there are none
        found[f"layout.{name}"] = np.zeros_like(value) if name.endswith("_handle") else value
    one, other = pivots
    for n, square in enumerate((one,) if one is other else (one, other)):
        found |= {f"pivots{n}.{name}": getattr(square, name) for name in square.fields}
    found |= {f"path.{name}": getattr(path, name) for name in ("mode", "with_forces", "at_rest")}
    for name, count in work.frame.count.items():
        first = np.zeros(count)
        if name not in OWN:
            rows = getattr(work, name)
            first = np.where(np.isin(rows[:, 0], code_interface.STRUCTURAL), rows[:, 0], 2.0)
        found[f"initial.{name}"] = first
    for name, square in zip(code_interface.FACTORS, pivots, strict=True):
        numbers = len(square.target) + len(square.fill) + 2 * len(square.pivot)
        found[f"initial.{name}"] = np.zeros(numbers)
    return {name: np.array(value, order="C") for name, value in found.items()}


# ---------------------------------------------------------------------------------------------
# Where the machine code is


@functools.cache
def _own_sources() -> str:
    digest = hashlib.sha256()
    for file in (*sorted(Path(__file__).parent.glob("*.py")), PACKAGE / "core/recorded_numbers.py"):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _built_code(key: str, arrays: dict[str, np.ndarray]) -> StraightLineCode | None:
    kept = selection.machine_code_folder()
    if kept is None:
        return None
    folder, level = kept
    file, none = folder / f"straight-line-{key}.so", folder / f"straight-line-{key}.none"
    if none.exists():
        return None
    if file.exists():
        try:
            return _opened(file)
        except LibraryError:  # a damaged file is made again
            file.unlink(missing_ok=True)
    return _opened(file) if build(file, none, level, arrays) else None


def _opened(file: Path) -> StraightLineCode:
    library = open_library(file, source_hash())
    initial = tuple((name, n) for name, n in library.entries()["initial"])
    return StraightLineCode(library.function("straight_line", [ctypes.c_void_p]), initial)


def build(
    file: Path, none: Path, level: str, arrays: dict[str, np.ndarray], lanes: int | None = None
) -> bool:
    """Build the code by a process of its own; returns whether there is some.

    file, none: where the code is put, or an empty file if there is none; level: the processor's;
    arrays: the description; lanes: how many, if not as many as suit the processor. A compiler that
    fails is a `ModelWarning`.
    """
    packed = io.BytesIO()
    np.savez(packed, **arrays)  # type: ignore[arg-type]
    path = os.pathsep.join(filter(None, [str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")]))
    settings = os.environ | {"MBODY_CORE": "plain", "MBODY_QUIET": "1", "PYTHONPATH": path}
    with tempfile.TemporaryDirectory() as folder:
        described = Path(folder) / "description.npz"
        described.write_bytes(packed.getvalue())
        command = [sys.executable, "-m", "mbody.straight_line.code_builder", str(described)]
        command += ["--target", level, "--to", str(file), "--sources", source_hash() or ""]
        command += ["--lanes", str(lanes)] if lanes else []
        done = subprocess.run(
            command, env=settings, capture_output=True, text=True, stdin=subprocess.DEVNULL
        )
    if done.returncode == code_interface.NONE:
        none.touch()
        return False
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"it ended with {done.returncode}"])[-1]
        warnings.warn(
            f"straight-line code could not be built ({last}): analyses of this mechanism take "
            "about three times as long",
            ModelWarning,
            stacklevel=2,
        )
        return False
    return True
