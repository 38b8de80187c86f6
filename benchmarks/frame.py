"""The frame of every question: engines in turn, equal accuracy, medians and ratios as rows.

An `Engine` is tried at each of its settings, from loose to tight; for each required error the
fastest setting counts that reaches it, and whose next tighter setting reaches it too (one lucky
zero crossing is no accuracy). The settings chosen are then run in turn, round by round, so that
what else the machine does falls on all alike; a short call is repeated within its round.
"""

from __future__ import annotations

import functools
import gc
import importlib
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

__all__ = ["LEVELS", "OURS", "Scope", "Engine", "Row", "in_turn", "race", "sufficient_trial"]

OURS = "mbody"
#: Errors that a work–precision question asks for.
LEVELS = (1e-3, 1e-6, 1e-9)
#: Seconds of the processor that this process had, where that is label finely. Engines run on one
#: thread; by the wall, short calls would seem faster than long ones wherever others run as well.
#: Questions whose engines take several threads give `in_turn` the clock on the wall.
FINE = time.get_clock_info("process_time").resolution < 1e-6
CLOCK = time.process_time if FINE else time.perf_counter
Clock = Callable[[], float]
#: Seconds that an engine has a round, if a call takes less.
BLOCK = 0.05


@dataclass(frozen=True)
class Row:
    """One engine at one workload: an answer in the form of ``--json``.

    Attributes
    ----------
    question, workload, engine : str
        Question, workload and engine.
    error : float or None
        Against the reference of the workload; of an engine that did not reach the required error,
        its least error.
    median_s : float or None
        Median seconds; None where the engine did not reach the required error.
    runs : int
        How many were measured.
    ratio_to_mbody : float or None
        Median over the rounds of this engine's time by that of mbody in the same round.
    bytes : float or None
        Of questions about memory.
    setting : str
        Step or tolerance that was chosen.
    """

    question: str
    workload: str
    engine: str
    error: float | None
    median_s: float | None
    runs: int
    ratio_to_mbody: float | None
    bytes: float | None = None
    setting: str = ""

    def short(self) -> dict[str, Any]:
        """The seven keys of ``--json``, and the bytes of a question about memory."""
        found = asdict(self)
        del found["setting"]
        if self.bytes is None:
            del found["bytes"]
        return found


@dataclass(frozen=True)
class Scope:
    """Scope of the measurements: a short form in seconds, or all."""

    short: bool = False
    runs: int = 7
    #: Longest single run [s] of an engine; slower settings are left out.
    longest: float = 20.0
    progress: Callable[[str], None] = field(default=lambda line: None, repr=False)


@dataclass(frozen=True)
class Engine:
    """An engine, its settings from loose to tight, and how it runs.

    `prepare(setting)` builds what its user would build once and returns the call that is timed;
    `state` turns what that returns into (angles, rates) of all bodies at the end.
    """

    name: str
    settings: Sequence[Any]
    prepare: Callable[[Any], Callable[[], Any]]
    state: Callable[[Any], tuple[np.ndarray, np.ndarray]]


@dataclass
class Trial:
    """One setting of an engine: what it costs and how far off it is."""

    setting: Any
    seconds: float
    error: float
    times: list[float] = field(default_factory=list)


def timed(call: Callable[[], Any], clock: Clock = CLOCK, *, times: int = 1) -> tuple[float, Any]:
    """Least seconds of so many calls, and what one gives; rubbish is collected before."""
    spent = math.inf
    gc.collect()
    gc.disable()
    try:
        for _ in range(times):
            begin = clock()
            found = call()
            spent = min(spent, clock() - begin)
        return spent, found
    finally:
        gc.enable()


def warm(prepare: Callable[[], Callable[[], Any]], about: float, clock: Clock = CLOCK) -> float:
    """Median seconds of as many calls in a row as last `BLOCK` seconds, 15 at most.

    What ran before has left the caches to itself; a call of a millisecond would be timed with
    that, and not with what a user's loop of such calls takes.
    """
    count = max(1, min(15, int(BLOCK / max(about, 1e-9))))
    gc.collect()
    gc.disable()
    try:
        found = []
        for _ in range(count):
            call = prepare()
            begin = clock()
            call()
            found.append(clock() - begin)
    finally:
        gc.enable()
    return statistics.median(found)


def trials(
    engine: Engine,
    error: Callable[[np.ndarray, np.ndarray], float],
    tightest: float,
    scope: Scope,
) -> list[Trial]:
    """Every setting once, until two in a row reach the tightest error, or are a hundred times
    worse than the least so far, or a run lasts too long.
    """
    found: list[Trial] = []
    for n, setting in enumerate(engine.settings):
        try:
            if not n:
                engine.prepare(setting)()  # the first call compiles and loads
            seconds, result = timed(engine.prepare(setting))
            off = float(error(*engine.state(result)))
        except Exception as failure:
            scope.progress(f"    {engine.name} at {setting}: {str(failure)[:80]}")
            if isinstance(failure, TimeoutError):
                break
            continue
        off = off if math.isfinite(off) else math.inf
        scope.progress(f"    {engine.name} at {setting}: {1e3 * seconds:.2f} ms, error {off:.1e}")
        found.append(Trial(setting, seconds, off))
        last, least = found[-2:], min(t.error for t in found)
        good = all(t.error <= tightest for t in last)
        worse = all(t.error > 100.0 * least for t in last)
        if seconds > scope.longest or (len(last) > 1 and (good or worse)):
            break
    return found


def sufficient_trial(tried: Sequence[Trial], level: float) -> Trial | None:
    """The fastest setting within the error, whose next tighter one is within it too."""
    good = [
        trial
        for n, trial in enumerate(tried)
        if trial.error <= level and all(t.error <= level for t in tried[n + 1 : n + 2])
    ]
    return min(good, key=lambda trial: trial.seconds) if good else None


def race(
    question: str,
    workload: str,
    engines: Iterable[Engine],
    error: Callable[[np.ndarray, np.ndarray], float],
    scope: Scope,
    levels: Sequence[float] = LEVELS,
) -> list[Row]:
    """Rows of all engines at each error, and at the least error of those that miss the last one."""
    scope.progress(f"  {workload}")
    engines = list(engines)
    tried = {e.name: trials(e, error, min(levels), scope) for e in engines}
    wanted: list[tuple[str, dict[str, Trial | None]]] = []
    for level in levels:
        chosen = {name: sufficient_trial(found, level) for name, found in tried.items()}
        wanted.append((f"{workload}, error {level:.0e}", chosen))
    for name, found in tried.items():
        good = [t for t in found if math.isfinite(t.error)]
        if name.startswith(OURS) or min((t.error for t in good), default=1.0) > 10.0 * max(levels):
            continue
        if good and sufficient_trial(found, min(levels)) is None:
            best = min(good, key=lambda t: t.error)
            pair = {OURS: sufficient_trial(tried[OURS], best.error), name: best}
            wanted.append((f"{workload}, as exact as {name} gets", pair))
    by_name = {engine.name: engine for engine in engines}
    entrants = {
        (name, id(trial)): (by_name[name], trial)
        for _, chosen in wanted
        for name, trial in chosen.items()
        if trial is not None
    }
    rounds(list(entrants.values()), scope)
    rows = []
    for label, chosen in wanted:
        ours = chosen.get(OURS)
        for name, trial in chosen.items():
            if trial is None:
                least = min((t.error for t in tried[name]), default=math.inf)
                off = least if math.isfinite(least) else None
                rows.append(Row(question, label, name, off, None, 0, None))
            else:
                rows.append(row_of(question, label, name, trial, ours))
    return rows


def rounds(entrants: list[tuple[Engine, Trial]], scope: Scope) -> None:
    """Time all in turn; what lasts longer than a second takes part in the first three rounds."""
    for n in range(scope.runs):
        for engine, trial in entrants:
            if n < 3 or trial.seconds < 1.0:
                made = functools.partial(engine.prepare, trial.setting)
                trial.times.append(warm(made, trial.seconds))


def row_of(question: str, workload: str, name: str, trial: Trial, ours: Trial | None) -> Row:
    """Median, and the median of the ratios round by round."""
    ratio = None
    if ours is not None:
        ratio = statistics.median(a / b for a, b in zip(trial.times, ours.times))
    median = statistics.median(trial.times)
    count = len(trial.times)
    return Row(
        question, workload, name, trial.error, median, count, ratio, setting=f"{trial.setting}"
    )


def in_turn(
    question: str,
    workload: str,
    tasks: dict[str, Callable[[], Any]],
    errors: dict[str, float],
    scope: Scope,
    *,
    parts: float | Mapping[str, float] = 1.0,
    clock: Clock = CLOCK,
) -> list[Row]:
    """Rows of calls that have nothing to choose; times are by `parts`, of all alike or by name;
    the first is mbody's.
    """
    by = parts if isinstance(parts, Mapping) else dict.fromkeys(tasks, parts)
    times: dict[str, list[float]] = {name: [] for name in tasks}
    about = {name: timed(task, clock)[0] for name, task in tasks.items()}
    for _ in range(scope.runs):
        for name, task in tasks.items():
            spent = warm(functools.partial(_same, task), about[name], clock)
            times[name].append(spent / by.get(name, 1.0))
    for name, values in times.items():
        scope.progress(f"    {name}: {statistics.median(values):.3g} s")
    ours = times[next(iter(tasks))]
    return [
        Row(
            question,
            workload,
            name,
            errors.get(name),
            statistics.median(values),
            len(values),
            statistics.median(a / b for a, b in zip(values, ours)),
        )
        for name, values in times.items()
    ]


def _same(task: Callable[[], Any]) -> Callable[[], Any]:
    return task


@functools.cache
def available(*modules: str) -> bool:
    """Whether the modules of a peer are installed; says which one is not."""
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError as error:
            print(f"left out: {module} ({error})", file=sys.stderr)
            return False
    return True
