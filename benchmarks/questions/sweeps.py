"""Sweeps: many designs of one mechanism, and the memory that they take.

Times are of the wall, since some engines have two threads. Peers that are looped in Python do a few
of the designs, which their name tells; their times are scaled to all of them.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import mbody
from benchmarks.frame import OURS, Engine, Row, Scope, available, in_turn, sufficient_trial, trials
from benchmarks.peers import closed_form, kinetostatic, ours, pinocchio
from benchmarks.peers.closed_form import Crank
from benchmarks.peers.stepping import TOLERANCES, dop853
from benchmarks.planar import planar
from benchmarks.questions.cold_start import ROOT
from benchmarks.questions.memory import at_rest, greatest
from benchmarks.studies import (
    EIGHT_BAR,
    FOUR_BAR,
    FREE,
    POSITIONS,
    SIX_BARS,
    SLIDER_CRANK,
    Study,
    norton_numbers,
)
from mbody.sweeps import Sweep, together
from mbody.sweeps.samples import drawn

__all__ = ["TITLE", "measure"]

TITLE = (
    "Sweeps: mbody on two threads, the others on one, unless said; peers in a Python loop do a few "
    "designs and are scaled; error of the greatest pin force as a part, of free motions at the end"
)
#: Designs of the full form and of the short one, by the number that the full form has.
DESIGNS = {"driven": (10_000, 2000), "tolerances": (100_000, 10_000), "free": (1000, 64)}
#: Designs of those that go through them in Python: by batches of LAPACK, by loops, free.
BATCHED, FEW, FREE_FEW = 500, 10, 4
THREADS, UNTIL, LEVEL = 2, 10.0, 1e-6
ALONE = f"{OURS}, one thread"


def measure(scope: Scope) -> list[Row]:
    """Four-bars, six-bars, eight-bars; tolerances of a slider-crank, their memory; free motions."""
    rows = four_bars(scope)
    for study in (*SIX_BARS, EIGHT_BAR):
        rows += several_loops(study, scope)
    return rows + tolerances(scope) + memory(scope) + free(scope)


def counted(kind: str, scope: Scope) -> int:
    """How many designs."""
    return DESIGNS[kind][scope.short]


def workload_name(count: int, study: Study) -> str:
    """The workload of a turn."""
    return f"{count} {study.name} × {POSITIONS} positions"


def turned(study: Study, count: int) -> tuple[Sweep, mbody.Solution, dict[str, Callable[[], Any]]]:
    """The sweep made once, a turn of the description's own numbers, and our tasks."""
    system = mbody.assemble(study.build())
    found = study.sweep(system, count, THREADS)
    if found.failures:
        raise ArithmeticError(f"{study.name}: {len(found.failures)} designs failed")
    run = mbody.kinetostatics(system, turn="motor", instants=POSITIONS)
    tasks = {
        OURS: lambda: study.sweep(system, count, THREADS)[study.measure],
        ALONE: lambda: study.sweep(system, count, 1)[study.measure],
    }
    return found, run, tasks


def compared(
    workload: str,
    tasks: dict[str, Callable[[], Any]],
    reference: np.ndarray,
    scope: Scope,
    parts: dict[str, float] | None = None,
) -> list[Row]:
    """Rows in turn; errors of the designs that both an engine and the reference did."""
    scope.progress(f"  {workload}")
    errors = {}
    for name, task in tasks.items():
        found = task()
        both = min(len(found), len(reference))
        errors[name] = float(np.abs(found[:both] / reference[:both] - 1.0).max())
    return in_turn(
        "sweeps", workload, tasks, errors, scope, parts=parts or {}, clock=time.perf_counter
    )


def four_bars(scope: Scope) -> list[Row]:
    """Closed forms by hand, batches of nine equations, loops of Pinocchio and MuJoCo.

    The reference are the nine equations.
    """
    count = counted("driven", scope)
    found, run, tasks = turned(FOUR_BAR, count)
    crank = Crank(*(getattr(run["crank"], name) for name in ("angle", "omega", "alpha")))
    numbers = norton_numbers(found)
    batched = min(BATCHED, count)
    some = {name: values[:batched] for name, values in numbers.items()}
    nine = f"NumPy, batched 9×9 by hand, of {batched} designs"
    for name, force in (
        ("all pins and the torque", closed_form.all_of_four_bars),
        ("this pin alone", closed_form.four_bars),
        ("the book's formulas, all pins", closed_form.book_four_bars),
    ):
        tasks |= by_hand(f"NumPy by hand, {name}", force, numbers, crank)
    tasks[nine] = lambda: closed_form.peaks(closed_form.nine_equations, some, crank)
    parts, few = {nine: batched / count}, min(FEW, count)
    for name, module, maker in (
        ("Pinocchio rnea, cut at B", "pinocchio", kinetostatic.pinocchio_loop),
        ("MuJoCo mj_inverse, cut at B", "mujoco", kinetostatic.mujoco_loop),
    ):
        if available(module):
            name += f", of {few} designs"
            tasks[name], parts[name] = each(maker, found, few), few / count
    return compared(workload_name(count, FOUR_BAR), tasks, tasks[nine](), scope, parts)


def by_hand(
    name: str, force: closed_form.Force, numbers: closed_form.Numbers, crank: Crank
) -> dict[str, Callable[[], np.ndarray]]:
    """A closed form on one thread, and on as many as mbody has."""
    return {
        name: lambda: closed_form.peaks(force, numbers, crank),
        f"{name}, two threads": lambda: closed_form.on_threads(THREADS, force, numbers, crank),
    }


def each(
    maker: Callable[..., Callable[[], Any]], found: Sweep, few: int
) -> Callable[[], np.ndarray]:
    """A peer's loop over the first designs; models are made, and the kinematics given, before."""
    loops = []
    for design in range(few):
        one = {name: float(found.parameter(name)[design]) for name in FOUR_BAR.letters}
        machine = kinetostatic.links(**one)
        run = mbody.kinetostatics(found.design(design), found.t)
        lengths = tuple(one[name] for name in ("crank.A.x", "coupler.B.x", "rocker.B.x"))
        loops.append(maker(machine, kinetostatic.given(run, machine.tree()), lengths))
    return lambda: np.array([np.hypot(*loop()[0][:, 1].T).max() for loop in loops])


def several_loops(study: Study, scope: Scope) -> list[Row]:
    """mbody one by one, which is the reference, and Pinocchio with all cuts at once."""
    count = counted("driven", scope)
    found, _, tasks = turned(study, count)
    few = min(FEW, count)
    name = f"{OURS}, kinetostatics one by one, of {few} designs"
    designs = [found.design(design) for design in range(few)]

    def singly() -> np.ndarray:
        runs = [mbody.kinetostatics(d, turn="motor", instants=POSITIONS) for d in designs]
        return np.array([run.reaction("B").magnitude.max() for run in runs])

    tasks[name], parts = singly, {name: few / count}
    if available("pinocchio"):
        name = f"Pinocchio rnea, all loops cut, of {few} designs"
        tasks[name], parts[name] = cuts(designs, "B"), few / count
    return compared(workload_name(count, study), tasks, singly(), scope, parts)


def cuts(designs: Sequence[mbody.System], joint: str) -> Callable[[], np.ndarray]:
    """The greatest force at a joint where a loop is cut, of every design."""
    loops = []
    for design in designs:
        machine = planar(design)
        tree = machine.tree()
        run = mbody.kinetostatics(design, turn="motor", instants=POSITIONS)
        names = [one.name for one in design.mechanism.joints]
        at = [names[machine.pins.index(pin)] for pin in tree.loops].index(joint)
        loops.append((kinetostatic.cuts(machine, kinetostatic.given(run, tree)), at))
    return lambda: np.array([np.hypot(*loop()[:, at].T).max() for loop, at in loops])


def tolerances(scope: Scope) -> list[Row]:
    """The closed form by hand is the reference."""
    count = counted("tolerances", scope)
    found, run, tasks = turned(SLIDER_CRANK, count)
    numbers, h = SLIDER_CRANK.numbers(found), run["crank"]
    crank, force = Crank(h.angle, h.omega, h.alpha), closed_form.slider_cranks
    tasks |= by_hand("NumPy by hand, this pin alone", force, numbers, crank)
    reference = closed_form.peaks(force, numbers, crank)
    return compared(f"{workload_name(count, SLIDER_CRANK)}, 9 tolerances", tasks, reference, scope)


# -- memory -----------------------------------------------------------------------------------


def memory(scope: Scope) -> list[Row]:
    """Of the same study, and of one of a tenth of its designs: it is bounded."""
    most = counted("tolerances", scope)
    rows = []
    for count in (most, most // 10):
        beyond, seconds = fresh(count)
        workload = f"{count} {SLIDER_CRANK.name}, memory beyond the import"
        scope.progress(f"  {workload}: {beyond / 2**20:.0f} MiB")
        rows.append(Row("sweeps", workload, OURS, None, seconds, 1, 1.0, bytes=beyond))
    return rows


def fresh(count: int) -> tuple[float, float]:
    """Bytes and seconds of the study in a process of its own."""
    code = "import sys; from benchmarks.questions.sweeps import alone; alone(sys.argv[1])"
    run = subprocess.run(
        [sys.executable, "-c", code, str(count)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    beyond, seconds = json.loads(run.stdout)
    return beyond, seconds


def alone(count: str) -> None:
    """What the fresh process does; it prints both numbers."""
    before = at_rest()
    system = mbody.assemble(SLIDER_CRANK.build())
    begin = time.perf_counter()
    SLIDER_CRANK.sweep(system, int(count), THREADS)
    print(json.dumps([greatest() - before, time.perf_counter() - begin]))


# -- free motions -----------------------------------------------------------------------------


def free(scope: Scope) -> list[Row]:
    """Each at its loosest tolerance that keeps the first few designs within the error.

    The reference is Pinocchio at 1e-13; without it there is none, and no row.
    """
    if not available("scipy", "pinocchio"):
        return []
    count = counted("free", scope)
    workload = f"{count} {FREE.name} to {UNTIL:g} s within {LEVEL:.0e}"
    scope.progress(f"  {workload}")
    system = mbody.assemble(FREE.build())
    samples = drawn(system, FREE.samples(system, count))
    few = min(FREE_FEW, count)
    made = []
    for row in samples.values[:few].tolist():
        design = system.with_values(dict(zip(samples.names, row)))
        made.append(pinocchio.Pinocchio(planar(design)))

    def ours_of(rtol: float, some: int, threads: int) -> Sweep:
        values = together(dict(zip(samples.names, samples.values[:some].T)))
        how = {"until": UNTIL, "rtol": rtol, "threads": threads}
        return mbody.sweep(system, values, "simulate", FREE.measure, **how)

    def theirs(rtol: float) -> list[np.ndarray]:
        return [dop853(one.slope, one.start, UNTIL, rtol) for one in made]

    def crank(ends: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        states = [one.state(y) for one, y in zip(made, ends)]
        return np.array([q[0] for q, _ in states]), np.array([v[0] for _, v in states])

    angle, omega = crank(theirs(1e-13))

    def error(angles: np.ndarray, rates: np.ndarray) -> float:
        off = np.abs(angles - angle), np.abs(rates - omega) / np.abs(omega).max()
        return float(np.max(off))

    name = f"Pinocchio + DOP853, of {few} designs"
    engines = [
        Engine(
            OURS,
            ours.SETTINGS,
            lambda rtol: lambda: ours_of(rtol, few, THREADS),
            lambda found: (found["angle"], found["omega"]),
        ),
        Engine(name, TOLERANCES, lambda rtol: lambda: theirs(rtol), crank),
    ]
    chosen = {
        one.name: sufficient_trial(trials(one, error, LEVEL, scope), LEVEL) for one in engines
    }
    if None in chosen.values():
        missed = [one for one, trial in chosen.items() if trial is None]
        raise ArithmeticError(f"{workload}: {', '.join(missed)} did not get there")
    rtol, other = chosen[OURS].setting, chosen[name].setting
    tasks: dict[str, Callable[[], Any]] = {
        OURS: lambda: ours_of(rtol, count, THREADS),
        ALONE: lambda: ours_of(rtol, count, 1),
        name: lambda: theirs(other),
    }
    errors = {one: trial.error for one, trial in chosen.items()} | {ALONE: chosen[OURS].error}
    clock = time.perf_counter
    return in_turn("sweeps", workload, tasks, errors, scope, parts={name: few / count}, clock=clock)
