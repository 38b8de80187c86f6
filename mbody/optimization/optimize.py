"""The verb `optimize`: the numbers of a mechanism at which a quantity is least or greatest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mbody.analysis.driven.requested_instants import turned_driver
from mbody.analysis.driven.requests import ANALYSES
from mbody.analysis.dynamics.progress import counted
from mbody.analysis.position.assembly_analysis import as_system
from mbody.errors import ModelError, brief
from mbody.files.model.optimize_table import optimization_tasks
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.optimization_task import OptimizationTask
from mbody.optimization.aims_and_limits import aim_of, limit_of
from mbody.optimization.design_evaluation import Evaluator
from mbody.optimization.motion_evaluation import MotionEvaluator
from mbody.optimization.multi_start import MultiStart
from mbody.optimization.optimum import Optimum
from mbody.optimization.pareto_front import pareto_front
from mbody.optimization.ranges import Ranges, ranges_of
from mbody.optimization.results import optimum_of
from mbody.optimization.start_designs import Screen
from mbody.quantities.types import Number
from mbody.sweeps.columns import MeasuredColumn
from mbody.sweeps.job import prepared
from mbody.system.system import System

__all__ = ["optimize"]

#: Options for the instants, and those of a motion over time.
INSTANTS = ("t", "drive", "turn", "instants", "turns", "guess", "at", "over")
MOTION = "simulate"
OF_MOTION = ("until", "method", "rtol", "atol", "step", "instants", "every", "times", "events")
#: Two aims as one, for the signature.
Wanted = str | Sequence[str] | None


def optimize(
    model: Mechanism | System,
    task: str | OptimizationTask | None = None,
    /,
    *,
    minimize: Wanted = None,
    maximize: Wanted = None,
    by: Mapping[str, tuple[Number, Number]] | None = None,
    subject_to: str | Sequence[str] = (),
    analysis: str = "kinetostatics",
    start: Mapping[str, Number] | None = None,
    starts: int = 8,
    seed: int = 0,
    loss: float = 0.01,
    points: int = 9,
    progress: Callable[[int, int], None] | bool | None = None,
    **options: Any,
) -> Optimum:
    """The numbers of a mechanism at which a quantity is least, or greatest, within limits.

    Parameters
    ----------
    model : Mechanism or System
        Driven so that no freedom is left, with its own numbers.
    task : str or OptimizationTask, optional
        A task of the mechanism by name, as [optimize.NAME] of its file; other arguments then have
        no meaning, except `progress`.
    minimize, maximize : str, or a list of two
        As of `sweep`: ``"peak(B.force)"``, ``"rms(motor.effort)"``. Of two aims the Pareto front is
        found: designs of which none is better in both.
    by : mapping
        Lowest and greatest value by number: floats in the units of the mechanism, angles in rad, or
        text with units.
    subject_to : str or list
        Limits on the whole cycle: ``"min(abs(sin(coupler.angle - rocker.angle))) >= 0.64"``,
        ``"peak(motor.effort) <= 20 N*m"``, ``"coupler.P.y >= 2 mm"`` (at all instants).
    analysis : str
        "kinetostatics", "kinematics", "statics", or "simulate" for a motion over time.
    start : mapping, optional
        By number where the first search begins, instead of the description.
    starts : int
        Searches; all but the first begin at the best of a Latin hypercube.
    seed : int
        Of the hypercube.
    loss : float
        The part of the objective that its tolerance band may cost.
    points : int
        Designs of a Pareto front.
    progress : callable or bool, optional
        Called with the number of finished searches and of all; True shows it on standard error.
    **options
        The instants: ``over="turn"``, ``at``, ``t``, ``drive``, ``turn``, ``turns``,
        ``instants``, ``guess``, as of `sweep`; by default those of the mechanism itself. Of a
        motion: ``until``, ``times``, ``instants``, ``every``, ``events``, ``method``, ``rtol``,
        ``atol``, ``step``, as of `simulate`.

    Returns
    -------
    Optimum
        Values, what binds with its multiplier, tolerance band, how many searches agree.

    Raises
    ------
    ModelError
        For names, bounds, limits or options that do not fit the mechanism; for a quantity that none
        of the numbers changes.
    SolveError
        Where no design within the bounds can be analysed; where none meets the limits, with the
        least that is missing.

    Notes
    -----
    Every search is sequential quadratic programming with exact derivatives; a greatest value over
    the cycle is minimised as a bound of all instants. Designs stay on the branch of the description
    and away from singular positions: nothing may move more than 50 times as fast, by the rate of
    the drivers, as in the design that a search is measured by. That the optimum is the best of all
    is not proved; `agreeing` says how many searches ended at it. After Ctrl-C the best design so
    far is returned, with a status "stopped: …".

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> found = mbody.optimize(
    ...     machine,
    ...     minimize="peak(motor.effort)",
    ...     by={"coupler.cg.x": (0.0, 3.0), "rocker.cg.x": (-1.0, 1.0)},
    ...     over="turn",
    ...     starts=2,
    ... )
    >>> found.objective < found.start_objective and found.agreeing == found.starts
    True
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("optimize takes one design: choose one of the batch with design(n)")
    if task is not None:
        own = _task(system.mechanism, task)
        return optimize(system, progress=progress, **own.arguments())
    aims = _aims_given(minimize, maximize)
    _check_counts(starts=starts, points=points)
    _check_options(analysis, options)
    ranges = ranges_of(system, by, start)
    machine, names = system.mechanism, list(ranges.names)
    motion = MotionEvaluator(system, names, options) if analysis == MOTION else None
    if motion is not None:
        count = motion.instants
    else:
        count = len(_job(system, ranges, (), analysis, options).instants)
    goals = [aim_of(machine, text, greatest, count) for text, greatest in aims]
    texts = [subject_to] if isinstance(subject_to, str) else list(subject_to)
    limits = [limit_of(machine, text, count) for text in texts]
    if motion is not None:
        screen = Screen(None, motion, goals, limits)
    else:
        job = _job(system, ranges, Screen.columns(goals, limits), analysis, options)
        turned = turned_driver(system, job.how.get("turn"))
        screen = Screen(job, Evaluator(job, names, turned), goals, limits)
    seen = counted("searches") if progress is True else progress or None
    search = MultiStart(screen.evaluator, screen, ranges, starts, seed, seen)
    if len(goals) == 2:
        return pareto_front(search, goals, limits, points, loss)
    ended = search.ended(goals[0], limits)
    return optimum_of(search, ended, goals[0], limits, loss)


def _task(machine: Mechanism, task: str | OptimizationTask) -> OptimizationTask:
    if isinstance(task, OptimizationTask):
        return task
    tasks = optimization_tasks(machine)
    own = tasks.get(task) if isinstance(task, str) else None
    if own is None:
        known = listed(tasks) or "none"
        raise ModelError(
            f"'{machine.name}' has no optimization {brief(task)} (it has: {known})", str(task)
        )
    return own


def _aims_given(minimize: Wanted, maximize: Wanted) -> list[tuple[Any, bool]]:
    """What is to be least, and what is to be greatest: one aim, or two."""
    found: list[tuple[Any, bool]] = []
    for given, greatest in ((minimize, False), (maximize, True)):
        several = list(given) if isinstance(given, list | tuple) else [given]
        found += [(one, greatest) for one in several if one is not None]
    if not found:
        raise ModelError(
            'optimize: say what is to be least or greatest, such as minimize="peak(motor.effort)"'
        )
    if len(found) > 2:
        raise ModelError(
            f"optimize: there are {len(found)} aims: give one, or two for their Pareto front, and "
            "make limits of the others by subject_to"
        )
    return found


def _check_counts(**counts: Any) -> None:
    for name, value in counts.items():
        least = 1 if name == "starts" else 3
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= 10_000:
            raise ModelError(
                f"optimize: {name} must be a whole number from {least} to 10000, not {brief(value)}"
            )


def _check_options(analysis: str, options: Mapping[str, Any]) -> None:
    known = [*ANALYSES, MOTION]
    if analysis not in known:
        raise ModelError(
            f"optimize: there is no analysis {brief(analysis)} with derivatives (there are: "
            f"{listed(known)})"
        )
    own = OF_MOTION if analysis == MOTION else INSTANTS
    for name in options:
        if name not in own:
            raise ModelError(
                f"optimize: {analysis} has no option {name!r} (there are: {', '.join(own)})"
            )


def _job(
    system: System,
    ranges: Ranges,
    columns: tuple[MeasuredColumn, ...],
    analysis: str,
    options: Mapping[str, Any],
) -> Any:
    return prepared(system, tuple(ranges.names), columns, analysis, options)
