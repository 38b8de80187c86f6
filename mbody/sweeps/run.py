"""The function `sweep`: the same analysis of many designs."""

from __future__ import annotations

import contextlib
import os
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np

from mbody.analysis.dynamics.interruptions import counted
from mbody.analysis.position.assembly_analysis import as_system
from mbody.core.lanes import LANES
from mbody.errors import ModelError, SolveError
from mbody.model.element import whole_number
from mbody.model.mechanism import Mechanism
from mbody.sweeps.job import (
    BLOCK,
    Job,
    Measures,
    PieceResult,
    analyse_piece,
    columns_of,
    known_of_designs,
    prepared,
)
from mbody.sweeps.samples import Samples, Values, drawn
from mbody.sweeps.store import ResultsInMemory, Store
from mbody.sweeps.sweep_result import Sweep
from mbody.system.system import System

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
