"""The function `sweep`: the same analysis of many designs."""

from __future__ import annotations

import contextlib
import functools
import os
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from mbody.analysis.dynamics.interruptions import counted
from mbody.analysis.position.assembly_analysis import as_system
from mbody.analysis.position.design_results import partial_ending
from mbody.core.lanes import LANES
from mbody.core.presentation import present
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed, whole_number
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import dimension_named
from mbody.quantities.evaluate import degrees_of
from mbody.quantities.units import DIMENSIONS
from mbody.solution.doubts import Doubt
from mbody.summaries.text_table import Column, number, numbers, paragraph, table
from mbody.sweeps.job import (
    BLOCK,
    Job,
    Measures,
    PieceResult,
    ResultsInMemory,
    Store,
    analyse_piece,
    columns_of,
    known_of_designs,
    prepared,
)
from mbody.sweeps.samples import DesignNumbers, Samples, Values, drawn
from mbody.system.system import System, locked

# -- The result of a sweep: columns by name, with named axes -----------------------------------

#: Failed designs that a summary names.
NAMED = 3
#: Designs up to which each has a row, and how many numbers a row has.
LISTED, ROW_NUMBERS = 30, 8


class ColumnStore(Protocol):
    """The columns, in memory or in a folder."""

    def column(self, index: int) -> np.ndarray:
        """One column: (designs,) or (designs, instants)."""

    @property
    def failures(self) -> dict[int, str]:
        """Error message of every failed design."""

    @property
    def doubts(self) -> dict[int, tuple[Doubt, ...]]:
        """Doubts by design, for designs that have any."""

    @property
    def done(self) -> np.ndarray:
        """Which designs were analysed: (designs,)."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """Measured quantities of many designs, in the units of the mechanism or of the measure.

    Attributes
    ----------
    system : System
        The description with its own numbers.
    samples : DesignNumbers
        The numbers of the designs.
    names : tuple of str
        The measured quantities.
    units : dict
        Unit of each.
    t : array (instants,)
        Times of the instants; empty for free motions.
    ending : str
        "completed", or "stopped: …" with the number of finished designs.
    known : tuple of str
        What is known of the forces that the quantities are made of, by the first and last design.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> found = mbody.sweep(
    ...     machine,
    ...     {"crank.A.x": [0.9, 1.0], "coupler.mass": [2.0, 3.0, 4.0]},
    ...     measure="peak(motor.effort)",
    ...     turn=True,
    ... )
    >>> found["peak(motor.effort)"].shape, list(found.axes)
    ((2, 3), ['crank.A.x', 'coupler.mass'])
    """

    system: System
    samples: DesignNumbers
    names: tuple[str, ...]
    units: dict[str, str]
    t: np.ndarray
    ending: str
    kept: ColumnStore
    known: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.samples.values)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    @property
    def axes(self) -> dict[str, np.ndarray]:
        """Name and values of every axis: the parameters of a grid, else the number of the
        design.
        """
        axes: dict[str, np.ndarray] = locked(self.samples.axes or {"design": np.arange(len(self))})
        return axes

    def axes_of(self, name: str) -> tuple[str, ...]:
        """Names of the axes of ``sweep[name]``; of a history the last one is ``"instant"``."""
        history = self._column(name).ndim == 2
        return (*self.axes, "instant") if history else tuple(self.axes)

    def __getitem__(self, name: str) -> np.ndarray:
        """A quantity along the axes that `axes_of` names; NaN where a design failed or was not
        analysed.
        """
        column = self._column(name)
        shape = tuple(len(values) for values in self.axes.values())
        return column.reshape(*shape, *column.shape[1:])

    def _column(self, name: str) -> np.ndarray:
        if name not in self.names:
            raise ModelError(
                f"the sweep has no {name!r} (there are: {listed(self.names)})", str(name)
            )
        return np.asarray(locked(self.kept.column(self.names.index(name))))

    def parameter(self, name: str) -> np.ndarray:
        """Values of a parameter: (designs,)."""
        for names in (self.samples.given_names, self.samples.names):
            if name in names:
                return np.asarray(locked(self.samples.values[:, names.index(name)]))
        raise ModelError(
            f"{name!r} is not a parameter of the sweep (there are: "
            f"{listed(self.samples.given_names)})",
            str(name),
        )

    @property
    def failures(self) -> dict[int, str]:
        """Error messages of failed designs, by number."""
        return self.kept.failures

    @functools.cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts of the designs; each message has the number of the design."""
        return tuple(
            replace(one, message=f"design {n}: {one.message}")
            for n, found in sorted(self.kept.doubts.items())
            for one in found
        )

    @property
    def status(self) -> str:
        """`ending`, or "doubtful: …" where a design is in doubt."""
        if not self.doubts:
            return self.ending
        count = len(self.kept.doubts)
        return f"doubtful: {count} of {len(self)} designs, as {self.doubts[0].message}"

    @property
    def notes(self) -> tuple[str, ...]:
        """Those on the description, how many designs failed, what is known of forces, and the
        messages of the doubts.
        """
        own = [partial_ending("failed", self.failures, len(self))] if self.failures else []
        return (*self.system.notes, *own, *self.known, *(one.message for one in self.doubts))

    @property
    def done(self) -> np.ndarray:
        """Which designs were analysed, well or not: (designs,)."""
        return self.kept.done

    def design(self, number: int) -> System:
        """One design as a system, to be analysed by itself."""
        count = len(self)
        if not hasattr(number, "__index__") or not -count <= number < count:
            raise ModelError(f"there is no design {number!r}: give 0 to {count - 1}")
        values = self.samples.values[number].tolist()
        return self.system.with_values(dict(zip(self.samples.names, values, strict=True)))

    def unit_of(self, parameter: str, angle: str = "rad") -> str:
        """Unit of values of a parameter, of an angle "deg" or "rad"; empty for a plain number."""
        names = dict(zip(self.samples.given_names, self.samples.names, strict=True))
        units = self.system.mechanism.units
        kind = dimension_named(self.system.mechanism, names.get(parameter, parameter))
        unit = "" if kind is None else units.of(kind)
        return angle if unit == units.of(DIMENSIONS["angle"]) else unit

    def _parameter_values(self, name: str, angle: str) -> tuple[np.ndarray, str]:
        """Values of a parameter and their unit, angles in "deg" or "rad"."""
        values, unit = self.parameter(name), self.unit_of(name, angle)
        return (degrees_of(values) if unit == "deg" else values), unit

    def columns(self, angle: str = "rad") -> dict[str, Any]:
        """Parameters, quantities of one number, ``"error"`` and ``"doubt"``, by name: each
        (designs,). Parameters that are angles are in "deg" or "rad"; quantities have the units of
        `units`.
        """
        given = self.samples.given_names
        table: dict[str, Any] = {name: self._parameter_values(name, angle)[0] for name in given}
        for name in self.names:
            column = self._column(name)
            table[name] = column if column.ndim == 1 else list(column)
        sentences, doubts = self.failures, self.kept.doubts
        table["error"] = [sentences.get(n, "") for n in range(len(self))]
        table["doubt"] = ["; ".join(d.message for d in doubts.get(n, ())) for n in range(len(self))]
        return table

    def to_dataframe(self) -> Any:
        """A row for each design as a pandas DataFrame; needs pandas."""
        try:
            import pandas  # type: ignore[import-untyped, unused-ignore]
        except ImportError:
            raise ModelError(
                "a table of a sweep needs pandas, which is not installed: pip install pandas"
            ) from None
        frame = pandas.DataFrame(self.columns())
        frame.attrs |= {"status": self.status, "notes": self.notes}
        return frame

    def _statistics(self, name: str) -> list[float]:
        """Least, mean, greatest value and standard deviation; NaN where there is none."""
        column = self._column(name)
        column = column[np.isfinite(column)]
        if not column.size:
            return [np.nan] * 4
        return [column.min(), column.mean(), column.max(), column.std()]

    def __repr__(self) -> str:
        return (
            f"Sweep({self.system.mechanism.name!r}: {', '.join(self.names)} of {len(self)} "
            f"designs, {self.status})"
        )

    def _repr_html_(self) -> str:
        # what a notebook shows
        return str(present("notebook", self))

    def _designs(self) -> list[str]:
        """A row for each design where they are few: its numbers, and its measures of one value."""
        if not 1 < len(self) <= LISTED:
            return []
        columns = [Column("DESIGN", [str(n) for n in range(len(self))])]
        for name in self.samples.given_names:
            values, unit = self._parameter_values(name, "deg")  # as all summaries have angles
            columns.append(Column(name, numbers(values), unit))
        measures = [name for name in self.names if self._column(name).ndim == 1]
        if not measures:
            return []  # histories
        for name in measures:
            columns.append(Column(name, numbers(self._column(name)), self.units[name]))
        return ["", *table(columns[: 1 + ROW_NUMBERS])]

    def __str__(self) -> str:
        machine, failed = self.system.mechanism, self.failures
        lines = paragraph(
            f"{machine.name}: sweep of {len(self)} designs over "
            f"{', '.join(self.samples.given_names)}"
        )
        rows = [self._statistics(name) for name in self.names]
        columns = [Column("MEASURES", list(self.names), text=True)]
        for n, title in enumerate(("least", "mean", "greatest", "deviation")):
            columns.append(Column(title, [number(row[n]) for row in rows]))
        columns.append(Column("unit", [self.units[name] for name in self.names], text=True))
        lines += ["", *table(columns)]
        lines += self._designs()
        if failed:
            lines += ["", f"{len(failed)} of {len(self)} designs failed:"]
            some = sorted(failed.items())[:NAMED]
            lines += [f"  design {design}: {sentence}" for design, sentence in some]
        doubts = self.kept.doubts
        if doubts:
            lines += ["", f"{len(doubts)} of {len(self)} designs are in doubt:"]
            lines += [f"  {one.message}" for one in self.doubts[:NAMED]]
        if self.status != "completed":
            lines += ["", self.status]
        if self.known:
            lines += ["", *(line for note in self.known for line in paragraph(f"note: {note}"))]
        return "\n".join(lines)


# -- Pieces of a sweep on the threads of this machine ------------------------------------------

#: Pieces in the queue of each thread.
AHEAD = 2


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def on_threads(
    job: Job, values: np.ndarray, pieces: list[int], size: int, threads: int
) -> Generator[tuple[int, PieceResult], None, None]:
    """First design and result of every piece, in order."""
    if threads == 1:
        for low in pieces:
            yield low, analyse_piece(job, values[low : low + size])
        return
    pool = ThreadPoolExecutor(threads, thread_name_prefix="mbody")
    queue: deque[tuple[int, Future[PieceResult]]] = deque()
    try:
        for low in pieces:
            queue.append((low, pool.submit(analyse_piece, job, values[low : low + size])))
            if len(queue) > AHEAD * threads:
                first, future = queue.popleft()
                yield first, future.result()
        while queue:
            first, future = queue.popleft()
            yield first, future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


# -- Pieces of work on an existing Dask cluster: of sweeps, and of data sets of linkages -------

#: Pieces in the queue of each thread of the workers.
QUEUED_PIECES = 3


def connected(scheduler: str) -> Any:
    """A client of that scheduler."""
    client: Any
    try:
        from distributed import Client as client
    except ImportError:
        raise ModelError(
            "work on a cluster needs Dask's distributed, which is not installed: "
            'pip install "mbody-planar[cluster]"'
        ) from None
    try:
        return client(scheduler, timeout=10, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise SolveError(
            f"no scheduler can be reached at {scheduler!r} ({type(error).__name__}): start one "
            "with 'dask scheduler', and workers that have mbody"
        ) from None


def on_cluster(
    job: Job, values: np.ndarray, pieces: list[int], size: int, client: Any
) -> Generator[tuple[int, PieceResult], None, None]:
    """First design and result of every piece, in the order of completion."""
    with contextlib.closing(client):
        task = client.scatter(job, broadcast=True, hash=False)
        yield from results(
            client, pieces, lambda low: (analyse_piece, task, values[low : low + size])
        )


def results(
    client: Any, pieces: Sequence[int], call: Callable[[int], tuple[Any, ...]]
) -> Generator[tuple[int, Any], None, None]:
    """Every piece with its result, in the order of completion.

    `call` gives the function of a piece and its arguments. A few calls for each thread of the
    workers are in the queue, so that no worker waits and the memory does not grow.
    """
    import distributed

    ahead = QUEUED_PIECES * max(1, sum(client.nthreads().values()))
    waiting = iter(pieces)
    begun: dict[Any, int] = {}
    arriving: Any = distributed.as_completed(loop=client.loop)

    def send() -> None:
        piece = next(waiting, None)
        if piece is not None:
            future = client.submit(*call(piece), pure=False)
            begun[future] = piece
            arriving.add(future)

    for _ in range(min(ahead, len(pieces))):
        send()
    while begun:
        future = next(arriving)
        piece = begun.pop(future)
        result = future.result()
        send()
        yield piece, result


#: Designs of a piece that are analysed one by one, and of a file or a message to a cluster.
SINGLE, LARGE = 16, 4 * BLOCK


def sweep(
    model: Mechanism | System,
    parameters: Samples | Values,
    analysis: str = "kinetostatics",
    measure: Measures | None = None,
    *,
    threads: int | None = None,
    to: str | os.PathLike[str] | None = None,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | bool | None = None,
    **options: Any,
) -> Sweep:
    """Measured quantities of many designs: parameter study, tolerance study, Monte Carlo.

    Parameters
    ----------
    model : Mechanism or System
        With its own numbers; the designs differ from it in some of them.
    parameters : mapping or Samples
        Values by name, in all combinations (a grid); or the samples of `mbody.sweeps.together`,
        `latin_hypercube`, `sobol` or `monte_carlo`. Names are those
        of `System.with_values`: dotted names (``"crank.A.x"``), parameters of the description, a
        load of one number by its own name. Values are floats or text with units.
    analysis : str
        "kinetostatics", "kinematics", "statics", or "simulate".
    measure : str, Measure, list or dict of them
        Formulas of histories as of `Solution.measure`, or measures of the mechanism by name; in
        ``max(…)``, ``min(…)``, ``peak(…)`` (of the absolute value), ``rms(…)``, ``mean(…)``,
        ``integral(…)`` over time, ``first(…)``, ``last(…)`` or ``at(…, instant)`` the instants of a
        design become one number; ``(Measure("A.force", "kN"), "peak")`` has a unit of its own.
        By default the measures of the mechanism.
    threads : int, optional
        By default as many as this process has cores.
    to : path, optional
        A folder for the results, as Parquet files, instead of memory. A sweep that was stopped or
        killed continues when it is called again.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``"tcp://10.0.0.5:8786"``, whose workers are used.
    progress : callable or bool, optional
        Called from time to time with the number of finished designs and of all; True shows on
        standard error how far it is.
    **options
        The instants: ``t``, ``drive``, ``turn``, ``instants``, ``guess`` as of the analysis, or
        ``at``, ``over`` as of `Instants`, by default those of the mechanism itself; of simulate its
        own arguments.

    Returns
    -------
    Sweep
        Columns by name with named axes, a message for each failed design, doubts, a status.

    Raises
    ------
    ModelError
        For names, values, measures or instants that do not fit the mechanism; for a folder that
        contains another sweep.
    SolveError
        Where drivers are missing, or the scheduler cannot be reached.

    Notes
    -----
    Designs of driven mechanisms are computed in parallel on the compiled lanes, on the branch of
    the description. Free motions are too, by the methods dop853 and dopri5, each with its own start
    and its own steps, as by `simulate`. Other designs are analysed one by one: all with redundant
    joints, user code, several driven values, events or releases, and those with a singular
    position, stiffness or an undefined value on the way. The numbers do not depend on threads,
    folder or scheduler, bit for bit on machines of one kind. After Ctrl-C the finished designs are
    returned, with a status "stopped: …".

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.slider_crank(1.0, 3.0, masses=(1, 2, 3), speed=10.0)
    >>> from mbody.sweeps import Normal, monte_carlo
    >>> found = mbody.sweep(
    ...     machine,
    ...     monte_carlo({"crank.A.x": Normal(tolerance=0.02)}, 1000, seed=1),
    ...     measure={"pin": "peak(A.force)"},
    ...     turn="motor",
    ... )
    >>> found["pin"].shape, found.failures, found.status
    ((1000,), {}, 'completed')
    """
    system = as_system(model)
    samples = drawn(system, parameters)
    columns = columns_of(system.mechanism, measure)
    job = prepared(system, samples.names, columns, analysis, options)
    count, remote = len(samples.values), to is not None or scheduler is not None
    job = job.of_many(count)
    size = _piece(job, remote)
    if not remote and job.grid is not None:  # each thread has two pieces at least
        size = min(size, -(-count // (2 * _threads(system, threads) * LANES)) * LANES)
    kept = ResultsInMemory(job, count) if to is None else Store(to, job, samples, size)
    pieces = kept.missing(list(range(0, count, size)))
    if scheduler is None:
        source = on_threads(job, samples.values, pieces, size, _threads(system, threads))
    else:
        source = on_cluster(job, samples.values, pieces, size, connected(scheduler))
    seen = counted("designs") if progress is True else progress or None
    done, status = count - sum(min(size, count - low) for low in pieces), "completed"
    try:
        for low, part in source:
            kept.keep(low, part)
            done += len(part.columns[0])
            if seen is not None:
                seen(done, count)
    except KeyboardInterrupt:
        status = f"stopped: after {done} of {count} designs"
    finally:
        source.close()
    units = {column.name: unit for column, unit in zip(columns, job.units, strict=True)}

    def ends() -> list[np.ndarray]:
        failed = kept.failures
        good = [n for n in np.flatnonzero(kept.done).tolist() if n not in failed]
        return [samples.values[n] for n in {*good[:1], *good[-1:]}]

    known = known_of_designs(job, ends)
    return Sweep(system, samples, tuple(units), units, job.instants, status, kept, known)


def _threads(system: System, threads: int | None) -> int:
    """Number of threads; user code needs one."""
    if threads is None:
        return 1 if system.has_user_code else cores()
    threads = whole_number("threads", threads)
    return 1 if system.has_user_code else threads


def _piece(job: Job, remote: bool) -> int:
    """Designs of a piece at most, a multiple of the lanes."""
    if job.course is None:
        return 4 * SINGLE if remote else SINGLE
    return max(job.block, min(LARGE, 16 * job.block)) if remote else job.block
