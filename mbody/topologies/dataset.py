"""A data set of random linkages in a folder: Parquet files of so many linkages each.

Each file follows from the seed and its number alone, so that threads and machines change nothing,
and a run that was stopped goes on with what is missing. Files are written under another name and
renamed when they are whole; each has a seal.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mbody.analysis.driven.time_grid import memory
from mbody.errors import ModelError
from mbody.files.arrays import OPEN_SEAL, seal, sealed
from mbody.sweeps.run import connected, results
from mbody.sweeps.store import remove_abandoned, write_whole
from mbody.topologies.arrays import canonical_order, linkage_arrays
from mbody.topologies.generator import ALIKE, GROUPS, check_groups, random_linkages, shape_of
from mbody.topologies.many_linkages import linkages

#: Readers of Parquet folders leave out what begins so.
MANIFEST = "_linkages.json"
#: Linkages of a file; topologies that are drawn at once, and how many more than would be enough.
PIECE, DRAWN, SPARE = 1024, 68, 4
#: Numbers that no instant repeats are stored byte by byte, which takes a third of the time of
#: the default and fewer bytes.
STORED: dict[str, Any] = {
    "compression": "zstd",
    "compression_level": -3,
    "use_dictionary": ["topology"],
    "write_statistics": False,
    "use_byte_stream_split": [f"{name}.list.element" for name in ("positions", "forces", "torque")],
}
#: Topologies without a linkage that moves after which there are said to be none.
FRUITLESS = 3200
#: Longest sentence of a manifest.
MOST = 100_000


@dataclass(frozen=True)
class LinkageSet:
    """What a data set is: all that its numbers follow from.

    Attributes
    ----------
    count, nodes, seed : int
        Linkages; joints of each; of the random numbers.
    groups : tuple of str
        Of "dyads", "sliders", "triads", "assur".
    instants : int
    turn : float
        Of the crank [rad].
    speed : float
        Of the crank [rad/s].
    gravity : pair of float
        (x, y) [m/s²].
    """

    count: int
    nodes: int = 8
    seed: int = 0
    groups: tuple[str, ...] = GROUPS
    instants: int = 200
    turn: float = 2.0 * np.pi
    speed: float = 1.0
    gravity: tuple[float, float] = (0.0, -9.81)

    def check(self) -> None:
        """Refuse what cannot be made.

        Raises
        ------
        ModelError
        """
        for name, least in (("count", 1), ("nodes", 4), ("seed", 0), ("instants", 2)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise ModelError(f"{name} must be a whole number from {least} on, not {value!r}")
        for name in ("turn", "speed"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) != 0.0):
                raise ModelError(
                    f"{name} must be a number that is not 0, not {getattr(self, name)}"
                )
        check_groups(self.groups, self.nodes)
        bars, places, _ = shape_of(self.nodes, self.groups)
        wanted = 8.0 * DRAWN * ALIKE * self.instants * 2 * (self.nodes + bars * places)
        if wanted > memory():
            raise ModelError(
                f"linkages of {self.nodes} joints at {self.instants} instants take "
                f"{wanted / 1e9:.3g} GB for {DRAWN * ALIKE} at a time, this machine has "
                f"{memory() / 1e9:.3g} GB of memory: ask for fewer joints or instants"
            )

    @property
    def digest(self) -> str:
        """Hash of all of it."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Written:
    """What `write_linkages` did.

    Attributes
    ----------
    folder : Path
    done, count : int
        Linkages of the part that are in the folder, and that are wanted.
    status : str
        "completed", or "stopped: …" after Ctrl-C.
    """

    folder: Path
    done: int
    count: int
    status: str


def write_linkages(
    folder: str | os.PathLike[str],
    what: LinkageSet,
    *,
    threads: int = 1,
    scheduler: str | None = None,
    part: tuple[int, int] = (1, 1),
    progress: Callable[[int, int], None] | None = None,
) -> Written:
    """Write a data set, or what is missing of it.

    Parameters
    ----------
    folder : path
    what : LinkageSet
    threads : int
    scheduler : str, optional
        Address of a Dask scheduler whose workers make the files' contents.
    part : pair of int
        Which of how many parts of the files to write, (3, 16): a process each, into one folder.
    progress : callable, optional
        Called with the number of linkages that are written, and of all.

    Raises
    ------
    ModelError
        Where pyarrow is missing, the folder cannot be written to or contains another data set.
    """
    what.check()
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ModelError(f"threads must be a whole number from 1 on, not {threads!r}")
    own, parts = part
    if not 1 <= own <= parts:
        raise ModelError(f"there is no part {own} of {parts}: give 1/{parts} to {parts}/{parts}")
    kept = _Folder(folder, what)
    pieces = range(own - 1, -(-what.count // PIECE), parts)
    missing = [n for n in pieces if not kept.sound(n)]
    count = sum(_size(what, n) for n in pieces)
    done = count - sum(_size(what, n) for n in missing)
    status = "completed"
    source = (
        _on_threads(what, missing, threads)
        if scheduler is None
        else _on_cluster(what, missing, scheduler)
    )
    try:
        if progress is not None:
            progress(done, count)
        for n, content in source:
            kept.keep(n, content)
            done += _size(what, n)
            if progress is not None:
                progress(done, count)
    except KeyboardInterrupt:
        status = f"stopped: {done} of {count} linkages are written"
    finally:
        source.close()
    return Written(kept.folder, done, count, status)


def _size(what: LinkageSet, piece: int) -> int:
    return min(PIECE, what.count - PIECE * piece)


def _on_threads(what: LinkageSet, pieces: list[int], threads: int) -> Any:
    """Contents of all files, as they are finished."""
    if threads == 1:
        for n in pieces:
            yield n, content_of(what, n)
        return
    pool = ThreadPoolExecutor(threads, thread_name_prefix="mbody")
    try:
        waiting: dict[Any, int] = {}
        left = list(reversed(pieces))
        while left or waiting:
            while left and len(waiting) < 2 * threads:
                n = left.pop()
                waiting[pool.submit(content_of, what, n)] = n
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                yield waiting.pop(future), future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(what: LinkageSet, pieces: list[int], scheduler: str) -> Any:
    """The same by the workers of a cluster."""
    with contextlib.closing(connected(scheduler)) as client:
        yield from results(client, pieces, lambda n: (content_of, what, n))


def content_of(what: LinkageSet, piece: int) -> bytes:
    """One file of a data set, with its seal: the first linkages of those drawn that move."""
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    wanted, tables, fruitless = _size(what, piece), list[Any](), 0
    first = PIECE * piece
    random = np.random.default_rng([what.seed, what.nodes, piece])
    while wanted:
        # a few topologies more, since some do not close sixteen times
        topologies = min(DRAWN, -(-wanted // ALIKE) + SPARE)
        arrays = random_linkages(topologies, what.nodes, random, what.groups, what.turn)
        table = _moving(what, arrays, first, wanted) if len(arrays["joints"]) else None
        if table is not None:
            tables.append(table)
            first, wanted, fruitless = first + len(table), wanted - len(table), 0
            continue
        fruitless += topologies
        if fruitless > FRUITLESS:
            raise ModelError(
                f"of {fruitless} random topologies of {what.nodes} joints none has a "
                "linkage that turns so far: ask for a smaller turn, or fewer joints"
            )
    made, sink = arrow.concat_tables(tables), arrow.BufferOutputStream()
    with parquet.ParquetWriter(sink, made.schema, **STORED) as writer:
        writer.write_table(made)
        writer.add_key_value_metadata({"mbody.linkages": what.digest, "mbody.seal": OPEN_SEAL})
    return seal(sink.getvalue().to_pybytes(), _owner(what, piece))


def _owner(what: LinkageSet, piece: int) -> str:
    return f"{what.digest} {piece}"


def _moving(what: LinkageSet, arrays: dict[str, np.ndarray], first: int, most: int) -> Any:
    """A table of those linkages that move, at most so many; None where there is none."""
    import pyarrow as arrow

    found = linkages(
        arrays, instants=what.instants, turn=what.turn, speed=what.speed, gravity=what.gravity
    )
    good = np.setdiff1d(np.arange(len(found)), np.fromiter(found.failures, int))[:most]
    if not good.size:
        return None
    named: dict[int, str] = {}
    order = canonical_order(linkage_arrays(arrays))
    names = [
        named.get(number) or named.setdefault(number, hashlib.sha256(row).hexdigest()[:16])
        for number, row in zip(found.topology[good].tolist(), order.table[good], strict=True)
    ]
    columns: dict[str, Any] = {
        "linkage": arrow.array(np.arange(first, first + len(good))),
        "topology": arrow.array(names),
        "margin": arrow.array(found.margin[good]),
    }
    for name in ("joints", "links", "ground", "driver", "slides", "directions"):
        part = arrays[name][good]
        kind = np.float64 if part.dtype.kind == "f" else np.int16
        columns |= _lists(arrow, name, part.astype(kind))
    for name, part in (
        ("positions", found.positions),
        ("forces", found.forces),
        ("torque", found.torque),
    ):
        columns |= _lists(arrow, name, part.astype(np.float32)[good])
    return arrow.table(columns)


def _lists(arrow: Any, name: str, rows: np.ndarray) -> dict[str, Any]:
    """A column of lists of one length, an array of each row; none of empty rows."""
    width = int(np.prod(rows.shape[1:]))
    if not width:
        return {}
    flat = arrow.array(np.ascontiguousarray(rows).reshape(-1))
    if rows.ndim == 1:
        return {name: flat}
    return {name: arrow.FixedSizeListArray.from_arrays(flat, width)}


class _Folder:
    """The folder of a data set, new or to be continued."""

    def __init__(self, folder: Any, what: LinkageSet) -> None:
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise ModelError(
                'a data set needs pyarrow, which is not installed: pip install "mbody[data]"'
            ) from None
        self.what = what
        try:
            self.folder = Path(folder)
            self.folder.mkdir(parents=True, exist_ok=True)
            remove_abandoned(self.folder)
            self._begin()
        except (OSError, TypeError) as error:
            raise self._unwritten(error, folder) from None

    @staticmethod
    def _unwritten(error: Exception, folder: Any) -> ModelError:
        why = getattr(error, "strerror", None) or error
        return ModelError(
            f"cannot write a data set to '{folder}' ({why}): choose a writable folder"
        )

    def _begin(self) -> None:
        """Write what the data set is, or check that it is the one that is there."""
        path, own = self.folder / MANIFEST, json.loads(json.dumps(asdict(self.what)))
        if not path.exists():
            write_whole(path, json.dumps(own, indent=1).encode())
        try:
            there = json.loads(path.read_text("utf-8")[:MOST])
            other = [name for name in own if there[name] != own[name]]
        except (ValueError, TypeError, KeyError):
            raise ModelError(
                f"'{path}' is damaged: delete it, and write the same data set again; files that "
                "belong to it are kept"
            ) from None
        if other:
            raise ModelError(
                f"'{self.folder}' contains another data set, with another {other[0]}: choose "
                "another folder, or delete this one"
            )

    def _file(self, piece: int) -> Path:
        return self.folder / f"linkages-{PIECE * piece:011d}.parquet"

    def sound(self, piece: int) -> bool:
        """Whether a file is there, whole, and of this data set."""
        try:
            return sealed(self._file(piece).read_bytes(), _owner(self.what, piece))
        except OSError:
            return False

    def keep(self, piece: int, content: bytes) -> None:
        """Write a file."""
        try:
            write_whole(self._file(piece), content)
        except OSError as error:
            raise self._unwritten(error, self.folder) from None
