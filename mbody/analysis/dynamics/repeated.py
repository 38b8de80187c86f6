"""A motion at other instants than those that were kept: it is followed again from its beginning."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.dynamics.joining import sizes, stops_of
from mbody.analysis.dynamics.options import MotionRequest
from mbody.analysis.dynamics.release import integrate_phases
from mbody.analysis.initial.initial_state import state_of
from mbody.errors import ModelError, SolveError, brief
from mbody.solution.beginning import Beginning
from mbody.solution.certificate import as_reported, changed
from mbody.solution.checks import one_design
from mbody.solution.energy import account, causes
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["REPEATED", "beginning", "repeated_at"]

Array = np.ndarray

#: Part of a position's and a rate's size by which a motion that is repeated may differ from what
#: was kept: impacts are located to 1e-12 of a step, and differ by what follows from that.
REPEATED = 1e-6


def beginning(system: System, start: Solution, request: MotionRequest) -> Beginning:
    """What it takes to follow a motion again; of `start` its last instant alone is kept."""
    page = start.record.table(slice(None))[-1:, :, None]
    last = Solution(
        system=start.system,
        analysis=start.analysis,
        t=start.t[-1:],
        record=Record([page.copy()], 1, batch=False),
        given=None if start.given is None else start.given[-1:],
        regularization=start.regularization,
        dependencies=start.dependencies,
        notes=as_reported(start).notes if start.analysis == "close_loops" else (),
        restart=start.restart,
        released=start.released,
    )
    return Beginning(system, last, request, request.first)


def repeated_at(run: Solution, t: Any) -> Solution:
    """The motion at other instants; see `Solution.at`.

    Raises
    ------
    ModelError
        For what is no motion that can be followed again, and times that are not within it.
    SolveError
        Where it does not pass through what was kept.
    """
    one_design(run, "a motion is followed again for one design")
    if run.analysis != "simulate":
        raise ModelError(
            f"at follows a motion of simulate again, this is a result of {run.analysis}: give its "
            "instants to the analysis, as in t=[0.1, 0.2]"
        )
    if not run.begun:
        raise ModelError(
            "how this motion began is not known, as of one that was read from a file: simulate "
            "the mechanism again, with times= or every="
        )
    times = _times(run, t)
    firsts = np.array([one.first for one in run.begun])
    part = np.maximum(np.searchsorted(firsts, times, side="right") - 1, 0)
    pages = np.empty((len(times), run.system.page_rows, 1))
    stops = stops_of(run)
    names = causes(run.system, stops)
    work = np.zeros((len(times), len(names)))
    modes = {name: [""] * len(times) for name in run.modes}
    for n in np.unique(part):
        mine = np.flatnonzero(part == n)
        ends = float(firsts[n + 1]) if n + 1 < len(firsts) else np.inf
        found, before = _again(run, run.begun[n], times[mine], ends)
        at = np.searchsorted(found.t, times[mine])
        pages[mine] = found.record.table(slice(None))[at][:, :, None]
        for name, row in modes.items():
            for k, instant in zip(mine.tolist(), at.tolist(), strict=True):
                row[k] = found.modes[name][instant]
        for k, name in enumerate(names):
            if found.energy is not None and name in found.energy.by:
                work[mine, k] = found.energy.by[name][at] + before.get(name, 0.0)
    energy = account(run.system, pages[:, :, 0], work, stops)
    record = Record([pages], len(times), batch=False)
    whole = changed(run, t=times, record=record, energy=energy, restart=None, given=None)
    whole = changed(whole, modes=modes)
    return whole.take(np.arange(len(times)))


def _times(run: Solution, t: Any) -> Array:
    """The times, checked."""
    unit = run.mechanism.units.time
    try:
        times = np.asarray(t, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        raise ModelError(f"at takes times, in {unit}, not {brief(t)}") from None
    first = run.begun[0].first
    last = float(run.t[-1]) if len(run) else first
    wrong = times[~((times >= first) & (times <= last))]
    if not times.size or wrong.size:
        given = f"{wrong[0]:.6g} {unit} is not among them" if wrong.size else "none is given"
        raise ModelError(
            f"at takes times of the motion, from {first:.6g} to {last:.6g} {unit}: {given}"
        )
    return times


def _again(
    run: Solution, begun: Beginning, times: Array, ends: float
) -> tuple[Solution, dict[str, float]]:
    """The motion from a beginning, at these times, and the work that was done before it."""
    request = begun.request
    kept = np.flatnonzero((run.t >= begun.first) & (run.t < ends) & (run.t <= times.max()))
    known = run.t[kept[-1:]]
    wanted = np.unique(np.concatenate([times, known, request.times[-1:]]))
    enough = max(float(times.max()), float(known.max(initial=-np.inf)))

    def progress(reached: float) -> None:
        if reached > enough:
            raise KeyboardInterrupt  # by which a motion ends where it is

    state = state_of(begun.system, begun.start)
    request = replace(request, times=wanted)
    try:
        found = integrate_phases(begun.system, begun.start, state, request, progress)
    except SolveError as error:
        if not isinstance(error.solution, Solution):
            raise
        found = error.solution
    if not np.isin(times, found.t).all():
        raise SolveError(
            f"the motion from t = {begun.first:.6g}, followed again, ends before "
            f"{times.max():.6g} {run.mechanism.units.time}: controllers or loads in Python that "
            "are not functions of what they are given make another motion",
            solution=found,
        )
    before: dict[str, float] = {}
    if known.size:
        k, n = int(kept[-1]), int(np.searchsorted(found.t, known[0]))
        _check_same(run, k, found, n)
        if run.energy is not None and found.energy is not None and len(run.begun) > 1:
            before = {
                name: float(row[k] - found.energy.by[name][n])
                for name, row in run.energy.by.items()
                if name in found.energy.by
            }
    return found, before


def _check_same(run: Solution, k: int, found: Solution, n: int) -> None:
    """Refuse a motion that does not pass through an instant that was kept."""
    rows = slice(0, 2 * run.system.coordinates)
    ours, theirs = run.record.table(rows)[k], found.record.table(rows)[n]
    apart = float((np.abs(ours - theirs) / sizes(run, ours)).max(initial=0.0))
    if not apart <= REPEATED:
        raise SolveError(
            f"the motion, followed again, is at t = {run.t[k]:.6g} {run.mechanism.units.time} "
            f"apart from what was kept, by {apart:.2g} of its size: controllers or loads in Python "
            "that are not functions of what they are given make another motion",
            solution=found,
        )
