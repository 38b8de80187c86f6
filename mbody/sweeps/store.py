"""Results of a sweep in a folder: a Parquet file for each piece, and the fingerprint of the sweep.

A file is written under a temporary name and renamed when it is complete. So a killed process leaves
no partial file, and several processes may write one piece. Every piece has the digest of its sweep
and of itself; one that does not match counts as missing and is computed again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from mbody._version import __version__
from mbody.errors import ModelError
from mbody.files.arrays import OPEN_SEAL, seal, sealed
from mbody.files.writing import ENDING, write_whole
from mbody.solution.doubts import Doubt, as_doubt
from mbody.sweeps.job import Job, PieceResult
from mbody.sweeps.samples import DesignNumbers

# -- Results of a sweep in memory --------------------------------------------------------------


class ResultsInMemory:
    """Columns of all designs."""

    def __init__(self, job: Job, designs: int) -> None:
        self.result = PieceResult(job.empty(designs))
        self.done = np.zeros(designs, dtype=bool)

    @property
    def failures(self) -> dict[int, str]:
        """Error message of each failed design."""
        return self.result.failures

    @property
    def doubts(self) -> dict[int, tuple[Doubt, ...]]:
        """Doubts of each design that has some."""
        return self.result.doubts

    def missing(self, pieces: list[int]) -> list[int]:
        """First designs of the pieces that are not done."""
        return pieces

    def keep(self, low: int, part: PieceResult) -> None:
        """Store the results of the designs from `low` on."""
        self.result.put(low, part)
        self.done[low : low + len(part.columns[0])] = True

    def column(self, index: int) -> np.ndarray:
        """One column."""
        return self.result.columns[index]


#: Age in seconds of a temporary file whose writer was killed.
LEFT = 86_400.0


def remove_abandoned(folder: Path) -> None:
    """Remove temporary files of killed writers that are older than a day."""
    for part in folder.glob(f"*{ENDING}"):
        with contextlib.suppress(OSError):
            if time.time() - part.stat().st_mtime > LEFT:
                part.unlink()


def fingerprint(job: Job, samples: DesignNumbers, size: int) -> dict[str, Any]:
    """Properties that must be equal for results to belong to one sweep."""
    system, machine = job.system, job.system.mechanism
    plan = [] if job.grid is None else [job.grid.s, job.grid.t, job.grid.given]
    how = sorted((k, getattr(v, "tolist", lambda v=v: v)()) for k, v in job.how.items())
    # formulas and guesses are not in the kernels' arrays, but they affect the other designs
    made = sorted((name, formula.text) for name, formula in system.formulas.items())
    guesses = [(body.name, repr(body.guess)) for body in machine.bodies]
    measures = sorted((name, repr(measure)) for name, measure in machine.measures.items())
    return {
        "model": _digest(
            *system.layout.as_dict().values(),
            system.par,
            system.mass,
            sorted(system.values.items()),
            made,
            guesses,
            measures,
            machine.units.name,
            [_code(function) for _, function in system.functions],
        ),
        "parameters": [*samples.given_names],
        "samples": _digest(samples.values),
        "designs": len(samples.values),
        "analysis": job.analysis,
        "instants": _digest(job.before, *plan, how, machine.simulation),
        "measures": [
            [c.name, c.measure.of, unit, c.by, c.instant]
            for c, unit in zip(job.columns, job.units, strict=True)
        ],
        "piece": size,
        "version": __version__,
    }


def digest_of(content: dict[str, Any]) -> str:
    """One digest of all of an fingerprint, which every piece carries.

    >>> len(digest_of({"analysis": "statics"}))
    64
    """
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _digest(*parts: Any) -> str:
    made = hashlib.sha256()
    for part in parts:
        array = np.ascontiguousarray(part) if isinstance(part, np.ndarray) else None
        made.update(repr(part).encode() if array is None else array.tobytes())
        made.update(b"|" if array is None else f"{array.shape}|".encode())
    return made.hexdigest()


def _code(function: Any) -> Any:
    """Name, instructions and plain constants of a user's function."""
    while hasattr(function, "function"):  # as the hook of the kernels wraps it
        function = function.function
    name = getattr(function, "__qualname__", str(type(function)))
    code = getattr(function, "__code__", None)
    return (name, None if code is None else _instructions(code))


def _instructions(code: Any) -> Any:
    plain = [part for part in code.co_consts if not hasattr(part, "co_code")]
    inner = [_instructions(part) for part in code.co_consts if hasattr(part, "co_code")]
    return (code.co_code, repr(plain), code.co_names, inner)


MANIFEST = "sweep.json"
#: Most bytes of a manifest, of an error message, and of a file apart from its numbers.
MAX_MANIFEST, MAX_MESSAGE, MAX_OVERHEAD = 50_000_000, 16_384, 10_000_000


class Store:
    """The folder of a sweep, new or to be continued."""

    def __init__(self, folder: Any, job: Job, samples: DesignNumbers, size: int) -> None:
        try:
            import pyarrow
            import pyarrow.parquet
        except ImportError:
            raise ModelError(
                "a sweep to a folder needs pyarrow, which is not installed: "
                'pip install "mbody-planar[data]"'
            ) from None
        self.arrow, self.parquet = pyarrow, pyarrow.parquet
        self.job, self.samples, self.size = job, samples, size
        content = fingerprint(job, samples, size)
        self.digest = digest_of(content)
        #: File status (size, time, inode) of every piece that was found valid.
        self.seen: dict[int, tuple[int, int, int]] = {}
        try:
            self.folder = Path(folder)
            self.folder.mkdir(parents=True, exist_ok=True)
            self._begin(content)
            remove_abandoned(self.folder)
        except (OSError, TypeError) as error:
            raise self._unwritten(folder, error) from None

    @staticmethod
    def _unwritten(folder: Any, error: Exception) -> ModelError:
        why = getattr(error, "strerror", None) or error
        return ModelError(f"cannot write a sweep to '{folder}' ({why}): choose a writable folder")

    def _begin(self, content: dict[str, Any]) -> None:
        """Write the fingerprint, or check that the folder contains the same sweep."""
        path = self.folder / MANIFEST
        if not path.exists():
            write_whole(path, json.dumps(content, indent=1, ensure_ascii=False).encode())
        try:
            with path.open(encoding="utf-8") as file:
                there = json.loads(file.read(MAX_MANIFEST))
            other = [key for key in content if there.get(key) != content[key]]
        except (ValueError, AttributeError, RecursionError):
            raise ModelError(
                f"'{path}' is damaged: delete it, and run the same sweep again; matching results "
                "are kept"
            ) from None
        if other:
            raise ModelError(
                f"'{self.folder}' contains another sweep, with other {', '.join(other)}: choose "
                "another folder, or delete this one"
            )

    def _file(self, low: int) -> Path:
        return self.folder / f"designs-{low:09d}.parquet"

    def _owner(self, low: int) -> str:
        """The text for the seal of a piece."""
        return f"{self.digest} {low}"

    def _largest(self) -> int:
        """Most bytes of the file of a piece."""
        numbers = sum(max(1, part[0].size) for part in self.job.empty(1))
        each = numbers + len(self.samples.given_names) + 1
        return self.size * (16 * each + MAX_MESSAGE) + MAX_OVERHEAD

    def _sound(self, low: int) -> bool:
        """Whether the file of a piece exists, is complete and belongs to this sweep.

        A file that has not changed is not read again.
        """
        try:
            with self._file(low).open("rb") as file:
                status = os.fstat(file.fileno())
                mark = (status.st_size, status.st_mtime_ns, status.st_ino)
                if self.seen.get(low) == mark:
                    return True
                self.seen.pop(low, None)
                if status.st_size > self._largest() or not sealed(file.read(), self._owner(low)):
                    return False
        except OSError:
            return False
        self.seen[low] = mark
        return True

    def missing(self, pieces: list[int]) -> list[int]:
        """First designs of the pieces to compute: missing ones, and those that do not match."""
        return [low for low in pieces if not self._sound(low)]

    def keep(self, low: int, part: PieceResult) -> None:
        """Write the results of the designs from `low` on."""
        content = seal(self._content(low, part), self._owner(low))
        try:
            write_whole(self._file(low), content)
        except OSError as error:
            if not self._sound(low):  # no other process has written the same piece
                raise self._unwritten(self.folder, error) from None
        self._sound(low)

    def _content(self, low: int, part: PieceResult) -> bytes:
        """A piece as a Parquet file, before its seal is set."""
        arrow, count = self.arrow, len(part.columns[0])
        table = {"design": arrow.array(np.arange(low, low + count))}
        rows = self.samples.values[low : low + count]
        for n, name in enumerate(self.samples.given_names):
            table[name] = arrow.array(np.ascontiguousarray(rows[:, n]))
        for column, values in zip(self.job.columns, part.columns, strict=True):
            flat = arrow.array(values.reshape(-1))
            if values.ndim == 2:
                flat = arrow.FixedSizeListArray.from_arrays(flat, values.shape[1])
            table[column.name] = flat
        sentences = [part.failures.get(n) for n in range(count)]
        table["error"] = arrow.array(sentences, type=arrow.string())
        doubts = [
            json.dumps([one.data() for one in part.doubts[n]], ensure_ascii=False)
            if n in part.doubts
            else None
            for n in range(count)
        ]
        table["doubt"] = arrow.array(doubts, type=arrow.string())
        made, sink = arrow.table(table), arrow.BufferOutputStream()
        with self.parquet.ParquetWriter(sink, made.schema) as writer:
            writer.write_table(made)
            writer.add_key_value_metadata(
                {"mbody.sweep": self.digest, "mbody.first": str(low), "mbody.seal": OPEN_SEAL}
            )
        content: bytes = sink.getvalue().to_pybytes()
        return content

    def _read(self, name: str) -> list[tuple[int, Any]]:
        """First design and one column of every existing piece."""
        found = []
        for low in range(0, len(self.samples.values), self.size):
            known = low in self.seen
            if self._sound(low):
                table = self.parquet.read_table(self._file(low), columns=[name])
                found.append((low, table[name].combine_chunks()))
            elif known:
                raise ModelError(
                    f"'{self._file(low)}' was changed or deleted since the sweep wrote it: run the "
                    "same sweep again to compute what is missing"
                )
        return found

    def column(self, index: int) -> np.ndarray:
        """One column, read from all files."""
        whole = self.job.empty(len(self.samples.values))[index]
        for low, read in self._read(self.job.columns[index].name):
            flat = read.flatten() if whole.ndim == 2 else read
            values = flat.to_numpy(zero_copy_only=False).reshape(-1, *whole.shape[1:])
            whole[low : low + len(values)] = values
        return whole

    @property
    def failures(self) -> dict[int, str]:
        """Error message of every failed design."""
        return self._sentences("error")

    @property
    def doubts(self) -> dict[int, tuple[Doubt, ...]]:
        """Doubts by design, for designs that have any."""
        texts = self._sentences("doubt")
        return {n: tuple(as_doubt(one) for one in json.loads(text)) for n, text in texts.items()}

    def _sentences(self, name: str) -> dict[int, str]:
        found: dict[int, str] = {}
        for low, column in self._read(name):
            if column.null_count < len(column):
                found |= {low + n: text for n, text in enumerate(column.to_pylist()) if text}
        return found

    @property
    def done(self) -> np.ndarray:
        """Which designs were analysed."""
        done = np.zeros(len(self.samples.values), dtype=bool)
        for low in range(0, len(done), self.size):
            done[low : low + self.size] = self._sound(low)
        return done
