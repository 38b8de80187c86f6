"""The analysis of a sweep, prepared once, and the results of a piece of its designs."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from mbody._version import __version__
from mbody.analysis.contact.closed_contacts import with_closed_contacts
from mbody.analysis.driven.batch import BatchSetup, batch_setup, closed_poses, on_lanes
from mbody.analysis.driven.contact_report import unfit
from mbody.analysis.driven.driven import ANALYSES, analyse_system_at, arguments_at
from mbody.analysis.driven.path_following import Runner
from mbody.analysis.driven.time_grid import TimeGrid, check_law_ranges, time_grid
from mbody.analysis.dynamics.batch_integration import LaneMotions, integrate_lanes, lane_motions
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.position.assembly_analysis import check_determined, closed, closed_near
from mbody.analysis.position.design_results import DesignFailures
from mbody.core.lanes import LANES
from mbody.errors import ModelError, SolveError, brief
from mbody.files.saved import OPEN_SEAL, seal, sealed
from mbody.files.tables import ENDING, write_whole
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import varied
from mbody.model.simulation import (
    REDUCTIONS,
    Instants,
    Measure,
    Reduced,
    check_times,
    integrand,
    outermost,
    reduce_history,
)
from mbody.solution.doubts import Doubt, as_doubt
from mbody.solution.histories import Record
from mbody.solution.measures import check_measure, in_output_unit, measured
from mbody.solution.solution import Solution
from mbody.sweeps.samples import DesignNumbers
from mbody.system.system import System

# -- Results of a sweep in a folder: a Parquet file for each piece, and the fingerprint of the
#    sweep -------------------------------------------------------------------------------------
#
# A file is written under a temporary name and renamed when it is complete. So a killed process
# leaves no partial file, and several processes may write one piece. Every piece has the digest of
# its sweep and of itself; one that does not match counts as missing and is computed again.

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


# -- Measured quantities of every design, and the reductions from instants to one number -------

#: Columns that the table of a sweep always has.
TAKEN = ("design", "error")


@dataclass(frozen=True)
class MeasuredColumn:
    """One quantity of every design.

    `measure`: Of the history.
    `by`: Reduction to one number, of `REDUCTIONS` or "at"; empty where all instants are kept.
    `instant`: Of "at".
    """

    name: str
    measure: Measure
    by: str = ""
    instant: int = 0

    def __call__(self, run: Solution) -> np.ndarray:
        """What it is of a result."""
        t = run.t / run.mechanism.units.second
        return reduced(self, measured(run, self.measure)[0], t)


def reduced(column: MeasuredColumn, history: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The column of a history (…, instants) at the times t, in s."""
    return reduce_history(column.by, column.instant, history, t)


#: A measured quantity, with its reduction to one number or without.
MeasureLike: TypeAlias = "str | Measure | tuple[str | Measure, str]"
#: One of them, or several, in a mapping by name.
Measures: TypeAlias = "MeasureLike | Iterable[MeasureLike] | Mapping[str, MeasureLike]"


def columns_of(
    mechanism: Mechanism, given: Measures | None, verb: str = "sweep"
) -> tuple[MeasuredColumn, ...]:
    """The requested quantities; by default the measures of the mechanism. Sentences begin with the
    verb.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> [(c.name, c.by) for c in columns_of(machine, ["peak(A.force)", "rms(motor.effort)"])]
    [('peak(A.force)', 'peak'), ('rms(motor.effort)', 'rms')]
    """
    if given is None:
        given = list(mechanism.measures)
        if not given:
            raise ModelError(
                f'{verb}: name a measure, such as measure="peak(A.force)": '
                f"'{mechanism.name}' has no measures of its own"
            )
    if isinstance(given, str | Measure):
        given = [given]
    if isinstance(given, Mapping):
        found = [_column(mechanism, measured, str(name), verb) for name, measured in given.items()]
    elif isinstance(given, Iterable):
        found = [_column(mechanism, measured, "", verb) for measured in given]
    else:
        raise ModelError(f"{verb}: measure must be text, a list or a dict, not {brief(given)}")
    names = [column.name for column in found]
    if not names or len(set(names)) < len(names):
        raise ModelError(f"{verb}: measures [{', '.join(names)}]: give each once, at least one")
    if reserved := next((name for name in names if name in TAKEN), ""):
        raise ModelError(
            f"{verb}: a measure cannot have the name '{reserved}', which is a column of every "
            "table: choose another"
        )
    return tuple(found)


def _column(mechanism: Mechanism, measured: Any, name: str, verb: str) -> MeasuredColumn:
    reduction, unit = "", ""
    if isinstance(measured, tuple) and len(measured) == 2 and measured[1] in REDUCTIONS:
        measured, reduction = measured
    if isinstance(measured, Measure):
        measured, unit = measured.of, measured.unit
    if not isinstance(measured, str):
        raise ModelError(
            f"{verb}: a measure is text, a Measure, or a pair of one and of "
            f"{', '.join(REDUCTIONS)}, not {brief(measured)}"
        )
    by, inner, instant = (
        (reduction, measured.strip(), 0) if reduction else _outermost(measured, verb)
    )
    measure = mechanism.measures.get(inner) or Measure(inner, unit)
    if measure.by and by:
        raise ModelError(
            f"{verb}: '{inner}' is one number of all instants already, {measure.of}: leave "
            f"'{by}' out"
        )
    if measure.by:
        by, instant, measure = measure.by, measure.instant, measure.history
    elif by == "integral":
        check_measure(mechanism, Measure(measure.of))
        measure = Measure(integrand(measure.of), unit)
    check_measure(mechanism, measure)
    measure = in_output_unit(mechanism, measure)
    return MeasuredColumn(
        name or (f"{reduction}({inner})" if reduction else measured.strip()), measure, by, instant
    )


def _outermost(text: str, verb: str) -> Reduced:
    """The reduction of a formula; errors begin with the verb."""
    try:
        return outermost(text)
    except ModelError as error:
        raise ModelError(f"{verb}: {error}") from None


#: Most designs that are computed in parallel, most numbers stored for them at once, and most
#: designs in parallel for free motions. What Python does once for a block takes as long as some 50
#: four-bars of 360 positions: 84 ns a position with 256 designs, 70 with 1024, 67 with 4096.
BLOCK, NUMBERS, FREE = 64 * LANES, 4_000_000, 4 * LANES
#: Positions from which on straight-line code is used: it saves half to two thirds of the time. To
#: make it takes about a second, once for a topology and a machine: some ten such sweeps save it.
STRAIGHT = 500_000
#: Designs of a block whose smallest gap is looked for where they do not close.
EXPLAINED = 8
#: Options for the instants of a driven analysis, and for a motion.
INSTANTS = ("t", "drive", "turn", "instants", "turns", "guess", "at", "over")
MOTION = (
    "until", "guess", "rates", "method", "rtol", "atol", "step", "instants", "every", "times",
    "events", "release",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Job:
    """The analysis of every design; it can be sent to another machine.

    `system`: The description with its own numbers.
    `names`: The numbers that differ between designs.
    `columns`: The measured quantities.
    `units`: Of each column.
    `how`: Arguments of the analysis.
    `ask`: The instants in the words of a description; else `how` says them.
    `grid`: The instants; None of a free motion.
    `before`: Instants before the requested ones.
    `course`: What the designs share, of a free motion a `LaneMotions`; None where they go one by
      one.
    `wanted`: Output rows of the kernels that the columns need.
    """

    system: System
    names: tuple[str, ...]
    columns: tuple[MeasuredColumn, ...]
    units: tuple[str, ...]
    analysis: str
    how: dict[str, Any]
    ask: Instants | None
    grid: TimeGrid | None
    before: int
    course: BatchSetup | LaneMotions | None
    wanted: np.ndarray

    @property
    def instants(self) -> np.ndarray:
        """Times of the requested instants."""
        return np.zeros(0) if self.grid is None else self.grid.t[self.before :]

    @property
    def block(self) -> int:
        """Number of designs that are computed in parallel."""
        if isinstance(self.course, LaneMotions):
            most, instants = FREE, len(self.course.request.times)
        elif self.grid is not None:
            most, instants = BLOCK, len(self.grid.t)
        else:
            return LANES
        each = max(1, instants * len(self.wanted))
        return max(LANES, min(most, NUMBERS // each // LANES * LANES))

    def of_many(self, designs: int) -> Job:
        """A copy for so many designs in all: where they are many, by straight-line code."""
        if not isinstance(self.course, BatchSetup) or self.grid is None:
            return self
        straight = self.system.machine_code or designs * len(self.grid.t) >= STRAIGHT
        return replace(self, course=replace(self.course, straight=straight))

    def empty(self, designs: int) -> list[np.ndarray]:
        """Columns of NaN."""
        count = len(self.instants)
        shapes = [(designs,) if c.by or count == 1 else (designs, count) for c in self.columns]
        return [np.full(shape, np.nan) for shape in shapes]


@dataclass(frozen=True, eq=False)
class PieceResult:
    """Results of a piece of the designs.

    `columns` (designs,) (designs, instants)
    `failures`: Error message of each failed design, by its number in the piece.
    `doubts`: Doubts by the design's number in the piece. Designs on lanes have none: their
      residuals are checked on the way.
    """

    columns: list[np.ndarray]
    failures: dict[int, str] = field(default_factory=dict)
    doubts: dict[int, tuple[Doubt, ...]] = field(default_factory=dict)

    def put(self, low: int, part: PieceResult) -> None:
        """Take the results of a part, whose first design is the design `low` here."""
        for whole, piece in zip(self.columns, part.columns, strict=True):
            whole[low : low + len(piece)] = piece
        self.failures.update((low + design, why) for design, why in part.failures.items())
        self.doubts.update((low + design, found) for design, found in part.doubts.items())


class _RowRecorder(Record):
    """A record of one design that stores which rows are read."""

    def __init__(self, rows: set[int]) -> None:
        super().__init__([], 1, batch=True)
        self.rows = rows

    def take(self, row: int) -> np.ndarray:
        self.rows.add(row)
        return np.zeros((1, 1))

    def table(self, rows: slice) -> np.ndarray:
        self.rows |= set(range(*rows.indices(rows.stop)))
        return np.zeros((1, 1, rows.stop - (rows.start or 0)))


class _SelectedRows(Record):
    """A record of only some rows: (rows, designs, instants)."""

    def __init__(self, wanted: np.ndarray, rows: np.ndarray) -> None:
        super().__init__([], rows.shape[1], batch=True)
        self.index, self.rows = {int(row): n for n, row in enumerate(wanted)}, rows

    def take(self, row: int) -> np.ndarray:
        return np.asarray(self.rows[self.index[row]])

    def table(self, rows: slice) -> np.ndarray:
        wanted = [self.index[row] for row in range(*rows.indices(rows.stop))]
        return np.ascontiguousarray(np.moveaxis(self.rows[wanted], 0, 2))


def prepared(
    system: System,
    names: tuple[str, ...],
    columns: tuple[MeasuredColumn, ...],
    analysis: str,
    options: Mapping[str, Any],
) -> Job:
    """The job of a sweep."""
    if analysis not in (*ANALYSES, "simulate"):
        known = listed([*ANALYSES, "simulate"])
        raise ModelError(f"sweep: there is no analysis {analysis!r} (there are: {known})")
    known_options = MOTION if analysis == "simulate" else INSTANTS
    for name in options:
        if name not in known_options:
            raise ModelError(
                f"sweep: {analysis} takes no {name!r} (it takes: {', '.join(known_options)})"
            )
    if system.batch is not None:
        raise ModelError("sweep takes one design: its parameters make the others")
    how = {name: value for name, value in options.items() if value is not None}
    if analysis == "simulate":
        units, wanted = _noted(system, names[0], columns, analysis)
        for column in columns:
            if not column.by:
                raise ModelError(
                    f"sweep: '{column.name}' of a free motion is a history: say how it becomes one "
                    f"number, such as last({column.measure.of})"
                )
        drift = _drift(system, names, columns, how)
        return Job(system, names, columns, units, analysis, how, None, None, 0, drift, wanted)
    ask, guess = _ask(system, how), how.pop("guess", None)
    before = 0
    if ask is not None:
        how, before = arguments_at(system, ask)
    keys = "t", "drive", "turn", "instants", "turns"
    grid = time_grid(system, *(how.get(key) for key in keys))
    _check_instants(columns, grid.t[before:])
    chosen = with_closed_contacts(system, float(grid.t[0]), grid.first(system), guess)
    system, guess = chosen.system, chosen.guess
    units, wanted = _noted(system, names[0], columns, analysis)
    course = _course(system, names, analysis, grid, guess, "t" in how and "drive" not in how)
    if guess is not None:
        how["guess"], ask = guess, None
    return Job(system, names, columns, units, analysis, how, ask, grid, before, course, wanted)


def _check_instants(columns: tuple[MeasuredColumn, ...], t: np.ndarray) -> None:
    """Refuse an instant that there is not, and integrals where no time passes."""
    count = len(t)
    for column in columns:
        check_times(column.by, t)
        if column.by == "at" and not -count <= column.instant < count:
            raise ModelError(
                f"sweep: '{column.name}': there is no such instant, they are 0 to {count - 1}"
            )


def _drift(
    system: System,
    names: tuple[str, ...],
    columns: tuple[MeasuredColumn, ...],
    how: Mapping[str, Any],
) -> LaneMotions | None:
    """Start and settings shared by free motions; None where they must go one by one, and each says
    for itself why.
    """
    try:
        drift = lane_motions(system, names, how)
    except (ModelError, SolveError):
        return None
    if drift is not None:
        _check_instants(columns, np.asarray(drift.request.times))
    return drift


def _ask(system: System, how: dict[str, Any]) -> Instants | None:
    """The instants as `Instants`, unless other options define them."""
    if any(name in how for name in ("t", "drive", "turn")):
        return None
    if "at" in how or "over" in how:
        message = {
            name: how.pop(name) for name in ("at", "over", "instants", "turns") if name in how
        }
        return Instants(**message)
    return system.mechanism.ask or Instants()


def _course(
    system: System,
    names: tuple[str, ...],
    analysis: str,
    grid: TimeGrid,
    guess: Any,
    at_times: bool,
) -> BatchSetup | None:
    """Settings shared by the designs of a driven motion; None where they must go one by one."""
    two = system.with_values({name: [system.values[name]] * 2 for name in names})
    if not at_times and any(varied(two.values, driver) for driver in system.drivers):
        return None  # each has its own times
    runner = Runner(system, analysis)
    try:
        start = closed(system, float(grid.t[0]), grid.first(system), guess)
        check_determined(system, start, analysis)
    except SolveError:
        if system.rows < system.coordinates:
            raise
        return None
    return batch_setup(runner, start, grid)


def _noted(
    system: System, name: str, columns: tuple[MeasuredColumn, ...], analysis: str
) -> tuple[tuple[str, ...], np.ndarray]:
    """Unit of every column, and the rows that they need."""
    rows: set[int] = set()
    one = system.with_values({name: [system.values[name]]})
    count = len(system.drivers)
    run = Solution(one, analysis, np.zeros(1), _RowRecorder(rows), np.zeros((1, count, 3)))
    vars(run)["open_forces"] = None  # for which other rows would be needed
    with np.errstate(all="ignore"):
        units = tuple(measured(run, column.measure)[2] for column in columns)
        unfit(run)
    return units, np.array(sorted(rows), dtype=np.int64)


def analyse_piece(job: Job, values: np.ndarray) -> PieceResult:
    """The results of a piece of the designs, values (designs, names)."""
    piece = PieceResult(job.empty(len(values)))
    for low in range(0, len(values), job.block):
        piece.put(low, _block(job, values[low : low + job.block]))
    return piece


def _block(job: Job, values: np.ndarray) -> PieceResult:
    """The results of designs that are computed in parallel."""
    result, alone = PieceResult(job.empty(len(values))), np.ones(len(values), dtype=bool)
    progress, open_loops = np.ones(len(values)), 0
    if job.course is not None:
        try:
            found, alone, progress = _together(job, job.course, values)
        except ModelError:  # one of them has an invalid number: those beside it go together
            if len(values) > LANES:
                half = -(-len(values) // (2 * LANES)) * LANES
                result.put(0, _block(job, values[:half]))
                result.put(half, _block(job, values[half:]))
                return result
        else:
            for column, history in zip(result.columns, found, strict=True):
                column[~alone] = history.reshape(column.shape)[~alone]
    failures = DesignFailures()
    for design in np.flatnonzero(alone).tolist():
        with failures.of(design):
            if progress[design] < 1.0 and not _closes(job, values[design]):
                open_loops += 1
                raise _open(job, values[design], float(progress[design]), open_loops <= EXPLAINED)
            run, found = _alone(job, values[design])
            for column, value in zip(result.columns, found, strict=True):
                column[design] = value
            if run.doubts:
                result.doubts[design] = run.doubts
    result.failures.update(failures.sentences)
    for column, wanted in zip(result.columns, job.columns, strict=True):
        finite = np.isfinite(column).reshape(len(values), -1).all(axis=1)
        for design in np.flatnonzero(~finite).tolist():
            result.failures.setdefault(design, f"'{wanted.name}' has no finite value")
    return result


def side_by_side(job: Job, values: np.ndarray) -> tuple[list[np.ndarray], np.ndarray] | None:
    """Columns of designs, values (designs, names), and which of them can be trusted, without a look
    at why others fail; None where designs must go one by one.
    """
    if job.course is None:
        return None
    parts = [
        _together(job, job.course, values[low : low + job.block])
        for low in range(0, len(values), job.block)
    ]
    columns = [np.concatenate(pieces) for pieces in zip(*(part[0] for part in parts), strict=True)]
    return columns, ~np.concatenate([part[1] for part in parts])


def _together(
    job: Job, course: BatchSetup | LaneMotions, values: np.ndarray
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Columns of the designs on lanes, which designs must be analysed one by one, and how much of
    the path from the description's numbers closes, 1 of all.
    """
    own = dict(zip(job.names, np.ascontiguousarray(values.T), strict=True))
    system, given = job.system.with_values(own), None
    progress = np.ones(len(values))
    if isinstance(course, LaneMotions):
        times = course.request.times
        rows, sound = integrate_lanes(system, course, own, job.wanted)
    else:
        times = course.grid.t
        failures = DesignFailures()
        check_law_ranges(system, times, job.how.get("drive") or {}, failures)
        closed_at = closed_poses(system, course.grid, course.pose, course.origin, course.small)
        rows, sound = on_lanes(system, course, closed_at.poses, job.wanted)
        sound &= closed_at.good
        sound[list(failures)] = False
        progress = closed_at.progress
        if len(course.grid.given) == len(times):
            given = course.grid.take(np.arange(job.before, len(times))).given
    kept = _SelectedRows(job.wanted, rows[:, :, job.before :])
    run = Solution(system, job.analysis, times[job.before :], kept, given)
    vars(run)["open_forces"] = None
    with np.errstate(all="ignore"):
        found = _columns(job, run)
        return found, ~sound | unfit(run), progress


def _columns(job: Job, run: Solution) -> list[np.ndarray]:
    """The columns of a result."""
    return [column(run) for column in job.columns]


def known_of_designs(job: Job, designs: Callable[[], Sequence[np.ndarray]]) -> tuple[str, ...]:
    """What is known of the forces of which the columns of some designs are made; these are asked
    for where forces may be open.
    """
    if not any(row >= 3 * job.system.coordinates for row in job.wanted):
        return ()
    if job.course is not None and not len(job.system.layout.friction_kind):
        return ()  # on lanes no rows are redundant
    found = list[str]()
    for values in designs():
        run, _ = _alone(job, values)
        found += [one for column in job.columns for one in run.known_of(column)]
    return tuple(dict.fromkeys(found))


def _design(job: Job, values: np.ndarray) -> System:
    """One design as a system."""
    return job.system.with_values(dict(zip(job.names, values.tolist(), strict=True)))


def _closes(job: Job, values: np.ndarray) -> bool:
    """Whether a design closes from the guesses of the description."""
    assert job.grid is not None
    system, t = _design(job, values), float(job.grid.t[0])
    return closed_near(system, t, job.how.get("guess"), job.grid.first(system)) is not None


def _open(job: Job, values: np.ndarray, progress: float, explained: bool) -> SolveError:
    """The error of a design that does not close, with the smallest gap where it is `explained`,
    which takes some hundred times as long.
    """
    assert job.grid is not None
    units, t = job.system.mechanism.units, float(job.grid.t[0])
    if explained:
        try:
            system = _design(job, values)
            closed(system, t, job.grid.first(system), job.how.get("guess"))
        except SolveError as error:
            return error
    return SolveError(
        f"loops do not close at t = {t:g} {units.time}: from the numbers of the description to "
        f"those of this design they do for {progress:.1%} of the way; analyse it alone to see the "
        "gap"
    )


def _alone(job: Job, values: np.ndarray) -> tuple[Solution, list[Any]]:
    """One design, and its columns."""
    system = _design(job, values)
    if job.analysis == "simulate":
        run = simulate(system, **job.how)
    elif job.ask is not None:
        run = analyse_system_at(system, job.analysis, job.ask)
    else:
        run = ANALYSES[job.analysis](system, **job.how)
        run = run.take(np.arange(job.before, len(run))) if job.before else run
    _check_instants(job.columns, run.t)
    with np.errstate(all="ignore"):
        found = _columns(job, run)
    return run, [part if part.size > 1 else part.reshape(-1)[0] for part in found]
