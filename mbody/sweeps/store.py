"""Answers of a sweep in a folder: a Parquet file for each piece, and what the sweep was.

A file is written under another name and renamed when it is whole, so that a process that is killed
leaves nothing half done; the next one takes up what is missing.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from mbody._version import __version__
from mbody.doubts import Doubt, as_doubt
from mbody.errors import ModelError
from mbody.sweeps.job import Job, Part
from mbody.sweeps.samples import Drawn

__all__ = ["Store"]

MANIFEST = "sweep.json"


class Store:
    """The folder of a sweep, new or to be gone on with.

    Raises
    ------
    ModelError
        Where pyarrow is not installed, the folder cannot be written to, or it holds another sweep.
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
        try:
            self.folder = Path(folder)
            self.folder.mkdir(parents=True, exist_ok=True)
            self._begin()
        except (OSError, TypeError) as error:
            raise ModelError(
                f"cannot keep a sweep in '{folder}' ({error}): choose a folder that may be written "
                "to"
            ) from None

    def _begin(self) -> None:
        """Write what the sweep is, or see that the folder holds the same one."""
        asked, path = _identity(self.job, self.samples, self.size), self.folder / MANIFEST
        if not path.exists():
            self._write(path, json.dumps(asked, indent=1, ensure_ascii=False).encode())
            return
        try:
            there = json.loads(path.read_text(encoding="utf-8"))
            other = [key for key in asked if there.get(key) != asked[key]]
        except (ValueError, AttributeError):
            other = [MANIFEST]
        if other:
            raise ModelError(
                f"'{self.folder}' holds another sweep, of other {', '.join(other)}: choose another "
                "folder, or delete this one"
            )

    def _write(self, path: Path, content: bytes) -> None:
        part = path.with_suffix(".part")
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)

    def _file(self, low: int) -> Path:
        return self.folder / f"designs-{low:09d}.parquet"

    def missing(self, pieces: list[int]) -> list[int]:
        """First designs of the pieces that are still to be done."""
        return [low for low in pieces if not self._file(low).exists()]

    def keep(self, low: int, part: Part) -> None:
        """Write the answers of the designs from `low` on."""
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
        sink = arrow.BufferOutputStream()
        self.parquet.write_table(arrow.table(table), sink)
        self._write(self._file(low), sink.getvalue().to_pybytes())

    def _pieces(self) -> list[int]:
        every = range(0, len(self.samples.values), self.size)
        return [low for low in every if self._file(low).exists()]

    def column(self, index: int) -> np.ndarray:
        """One column, read from all files."""
        name = self.job.columns[index].name
        whole = self.job.empty(len(self.samples.values))[index]
        for low in self._pieces():
            read = self.parquet.read_table(self._file(low), columns=[name])[name].combine_chunks()
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
        for low in self._pieces():
            told = self.parquet.read_table(self._file(low), columns=[name])[name]
            if told.null_count < len(told):
                found |= {low + n: text for n, text in enumerate(told.to_pylist()) if text}
        return found

    @property
    def done(self) -> np.ndarray:
        """Which designs were analysed."""
        done = np.zeros(len(self.samples.values), dtype=bool)
        for low in self._pieces():
            done[low : low + self.size] = True
        return done


def _identity(job: Job, samples: Drawn, size: int) -> dict[str, Any]:
    """What must be the same for answers to stand beside each other."""
    system = job.system
    functions = [getattr(f, "__qualname__", str(type(f))) for _, f in system.functions]
    plan = [] if job.plan is None else [job.plan.s, job.plan.t, job.plan.given]
    how = sorted((k, getattr(v, "tolist", lambda v=v: v)()) for k, v in job.how.items())
    return {
        "model": _digest(*system.layout.held().values(), system.par, system.mass, functions),
        "parameters": [*samples.told],
        "samples": _digest(samples.values),
        "designs": len(samples.values),
        "analysis": job.analysis,
        "instants": _digest(job.before, *plan, how, system.mechanism.simulation),
        "measures": [
            [c.name, c.measure.of, unit, c.by, c.instant]
            for c, unit in zip(job.columns, job.units, strict=True)
        ],
        "piece": size,
        "version": __version__,
    }


def _digest(*parts: Any) -> str:
    made = hashlib.sha256()
    for part in parts:
        array = np.ascontiguousarray(part) if isinstance(part, np.ndarray) else None
        made.update(repr(part).encode() if array is None else array.tobytes())
        made.update(b"|" if array is None else f"{array.shape}|".encode())
    return made.hexdigest()
