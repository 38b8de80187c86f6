"""Answers of a sweep in a folder: a Parquet file for each piece, and what the sweep was.

A file is written under a name of its own and renamed when it is whole, so that a process that is
killed leaves nothing half done, and several may write one piece. Every piece carries the digest of
its sweep and of itself; one that does not fit is missing, and is done again.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.files.seal import OPEN_SEAL, seal, sealed
from mbody.solution.doubts import Doubt, as_doubt
from mbody.sweeps.identity import digest_of, identity
from mbody.sweeps.job import Job, Part
from mbody.sweeps.pieces import clear, write_whole
from mbody.sweeps.samples import Drawn

__all__ = ["Store"]

MANIFEST = "sweep.json"
#: Bytes of a manifest, of a sentence of a failed design, and of a file beside its numbers, at most.
LARGEST, SENTENCE, ROOM = 50_000_000, 16_384, 10_000_000


class Store:
    """The folder of a sweep, new or to be gone on with.

    Raises
    ------
    ModelError
        Where pyarrow is not installed, the folder cannot be written to, its manifest is damaged, or
        it holds another sweep.
    """

    def __init__(self, folder: Any, job: Job, samples: Drawn, size: int) -> None:
        try:
            import pyarrow
            import pyarrow.parquet
        except ImportError:
            raise ModelError(
                "a sweep to a folder needs pyarrow, which is not installed: "
                'pip install "mbody[data]"'
            ) from None
        self.arrow, self.parquet = pyarrow, pyarrow.parquet
        self.job, self.samples, self.size = job, samples, size
        asked = identity(job, samples, size)
        self.digest = digest_of(asked)
        #: Of every piece that was found in order, what the system tells of its file.
        self.seen: dict[int, tuple[int, int, int]] = {}
        try:
            self.folder = Path(folder)
            self.folder.mkdir(parents=True, exist_ok=True)
            self._begin(asked)
            clear(self.folder)
        except (OSError, TypeError) as error:
            raise self._unwritten(folder, error) from None

    @staticmethod
    def _unwritten(folder: Any, error: Exception) -> ModelError:
        why = getattr(error, "strerror", None) or error
        return ModelError(
            f"cannot keep a sweep in '{folder}' ({why}): choose a folder that may be written to"
        )

    def _begin(self, asked: dict[str, Any]) -> None:
        """Write what the sweep is, or see that the folder holds the same one."""
        path = self.folder / MANIFEST
        if not path.exists():
            write_whole(path, json.dumps(asked, indent=1, ensure_ascii=False).encode())
        try:
            with path.open(encoding="utf-8") as file:
                there = json.loads(file.read(LARGEST))
            other = [key for key in asked if there.get(key) != asked[key]]
        except (ValueError, AttributeError, RecursionError):
            raise ModelError(
                f"'{path}' is damaged: delete it, and run the same sweep again; what fits is kept"
            ) from None
        if other:
            raise ModelError(
                f"'{self.folder}' holds another sweep, of other {', '.join(other)}: choose another "
                "folder, or delete this one"
            )

    def _file(self, low: int) -> Path:
        return self.folder / f"designs-{low:09d}.parquet"

    def _owner(self, low: int) -> str:
        """What the seal of a piece is made with."""
        return f"{self.digest} {low}"

    def _largest(self) -> int:
        """Bytes that the file of a piece may have."""
        numbers = sum(max(1, part[0].size) for part in self.job.empty(1))
        each = numbers + len(self.samples.told) + 1
        return self.size * (16 * each + SENTENCE) + ROOM

    def _sound(self, low: int) -> bool:
        """Whether the file of a piece is there, whole and of this sweep; one that has not changed
        since is not read again.
        """
        try:
            with self._file(low).open("rb") as file:
                told = os.fstat(file.fileno())
                mark = (told.st_size, told.st_mtime_ns, told.st_ino)
                if self.seen.get(low) == mark:
                    return True
                self.seen.pop(low, None)
                if told.st_size > self._largest() or not sealed(file.read(), self._owner(low)):
                    return False
        except OSError:
            return False
        self.seen[low] = mark
        return True

    def missing(self, pieces: list[int]) -> list[int]:
        """First designs of the pieces to be done: missing ones, and those that do not fit."""
        return [low for low in pieces if not self._sound(low)]

    def keep(self, low: int, part: Part) -> None:
        """Write the answers of the designs from `low` on.

        Raises
        ------
        ModelError
            Where they cannot be written, as on a full disk.
        """
        content = seal(self._content(low, part), self._owner(low))
        try:
            write_whole(self._file(low), content)
        except OSError as error:
            if not self._sound(low):  # nobody else has written the same piece
                raise self._unwritten(self.folder, error) from None
        self._sound(low)

    def _content(self, low: int, part: Part) -> bytes:
        """A piece as a Parquet file whose seal is open."""
        arrow, count = self.arrow, len(part.columns[0])
        table = {"design": arrow.array(np.arange(low, low + count))}
        rows = self.samples.values[low : low + count]
        for n, name in enumerate(self.samples.told):
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
        """First design and one column of every piece that is there."""
        found = []
        for low in range(0, len(self.samples.values), self.size):
            known = low in self.seen
            if self._sound(low):
                table = self.parquet.read_table(self._file(low), columns=[name])
                found.append((low, table[name].combine_chunks()))
            elif known:
                raise ModelError(
                    f"'{self._file(low)}' was changed or deleted since the sweep wrote it: run the "
                    "same sweep again, it does what is missing"
                )
        return found

    def column(self, index: int) -> np.ndarray:
        """One column, read from all files.

        Raises
        ------
        ModelError
            Where a file was changed after it was written.
        """
        whole = self.job.empty(len(self.samples.values))[index]
        for low, read in self._read(self.job.columns[index].name):
            flat = read.flatten() if whole.ndim == 2 else read
            values = flat.to_numpy(zero_copy_only=False).reshape(-1, *whole.shape[1:])
            whole[low : low + len(values)] = values
        return whole

    @property
    def failures(self) -> dict[int, str]:
        """Sentence of every design that failed."""
        return self._sentences("error")

    @property
    def doubts(self) -> dict[int, tuple[Doubt, ...]]:
        """What is in doubt of every design of which something is."""
        told = self._sentences("doubt")
        return {n: tuple(as_doubt(one) for one in json.loads(text)) for n, text in told.items()}

    def _sentences(self, name: str) -> dict[int, str]:
        found: dict[int, str] = {}
        for low, told in self._read(name):
            if told.null_count < len(told):
                found |= {low + n: text for n, text in enumerate(told.to_pylist()) if text}
        return found

    @property
    def done(self) -> np.ndarray:
        """Which designs were analysed."""
        done = np.zeros(len(self.samples.values), dtype=bool)
        for low in range(0, len(done), self.size):
            done[low : low + self.size] = self._sound(low)
        return done
