"""The verb `simulate`: free motion under loads, over time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mbody.analysis.close_loops import close_loops
from mbody.analysis.closure import as_system
from mbody.analysis.course import Course
from mbody.analysis.eventful import Eventful
from mbody.analysis.start import checked_events, started
from mbody.elements import listed
from mbody.errors import ModelError
from mbody.events import Event, Stop, as_events
from mbody.mechanism import Mechanism
from mbody.solution import Solution
from mbody.system import System

__all__ = ["simulate"]


def simulate(
    model: Mechanism | System,
    until: float | str | None = None,
    *,
    start: Solution | None = None,
    guess: Mapping[str, Any] | None = None,
    rates: Mapping[str, float] | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    instants: int | None = None,
    every: float | None = None,
    times: Any = None,
    events: Sequence[Event | Stop] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """Motion of what is free under all loads: forward dynamics.

    M a + Φ_qᵀ λ = f with Φ(q, t) = 0, by an explicit Runge–Kutta method of order 8 with control of
    the error; every step ends on Φ = 0 and Φ_q v = ν to rounding. Drivers, where there are any,
    follow their laws.

    Parameters
    ----------
    model : Mechanism or System
        With any number of free motions; massless bodies are ordinary where joints guide them.
    until : float or str, optional
        The last time, met exactly; by default what the mechanism itself asks, as all that follows.
    start : Solution, optional
        Whose last instant is the first one here: of `close_loops`, of an analysis at an instant, or
        of another `simulate`. By default the `simulation` of the mechanism says it, else the loops
        are closed from the guesses, at rest, at t = 0.
    guess, rates : mapping, optional
        As of `close_loops`: first positions, and angular velocities, of bodies by name.
    rtol, atol : float
        Error of a step, as a part of each coordinate and of the model's size; `atol` is `rtol` if
        it is not given.
    instants : int, optional
        How many instants are kept, both ends included, by default 201; or
    every : float, optional
        how far they are apart, or
    times : array, optional
        which ones they are.
    events : list of Event and Stop, optional
        Zero crossings that are recorded or end the motion, and stops that are struck; by default
        those of the mechanism's `simulation`.
    progress : callable, optional
        Called with the time reached, now and then.

    Returns
    -------
    Solution
        Motion, reactions, efforts at every instant; `energy`, the account of energy with its
        balance; `events`, an `Occurrence` each; `stats`, the counts of the steps; `status`.

    Raises
    ------
    ModelError
        For times or a start that do not fit the mechanism.
    SolveError
        Where loops do not close, the motion is not determined, a user's function fails, or the
        steps vanish; it carries what was computed before.

    Notes
    -----
    Singular positions (change points, dead centres under inertia) are passed at any tolerance;
    redundant joints are ordinary. Ctrl-C leaves what was done, with a status that says so.
    Crossings of one event that are closer together than a quarter of a step, and than a part in 400
    of the motion, may pass unseen.

    Examples
    --------
    >>> import mbody
    >>> swing = mbody.Mechanism("pendulum")
    >>> swing.add(
    ...     mbody.Body("bob", mass=1.0, cg=(1.0, 0.0), guess=0.0),
    ...     mbody.Revolute("O", "ground", "bob"),
    ...     mbody.Gravity("gravity", y=-9.81),
    ... )
    >>> run = mbody.simulate(swing, 2.0)
    >>> float(abs(run.energy.balance).max()) < 1e-6
    True
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("simulate takes one design: choose one of the batch with design(n)")
    own = system.mechanism.simulation
    if until is None and own is None:
        raise ModelError("simulate needs the last time: give until")
    last = system.mechanism.number(
        until if own is None or until is not None else own.until, "time", "simulate", "until"
    )
    if rtol is None:
        rtol = 1e-8 if own is None else own.rtol
    for name, value in (("rtol", rtol), ("atol", rtol if atol is None else atol)):
        if not isinstance(value, int | float) or not 1e-14 <= value <= 0.1:
            raise ModelError(f"{name} is {value!r}: give a number from 1e-14 to 0.1")
    if start is None and own is not None and guess is None and rates is None:
        start = started(system.mechanism, own)
    elif start is None:
        start = close_loops(system, guess=guess, rates=rates)
    elif guess is not None or rates is not None:
        raise ModelError("start says positions and rates: leave out guess and rates")
    first, q, v = _state(system, start)
    unit = system.mechanism.units.time
    if not last > first:
        raise ModelError(
            f"until is {last:g} {unit}, the motion begins at {first:g} {unit}: give a later time"
        )
    if instants is every is times is None and own is not None:
        instants = own.instants
    kept = _times(first, last, instants, every, times)
    absolute = rtol if atol is None else float(atol)
    if events is None:
        events = () if own is None else own.events
    parameters = {name: float(system.values[name]) for name in system.mechanism.parameters}
    watched = checked_events(system.mechanism, as_events(events), parameters)
    if watched:
        course: Course = Eventful(system, start, rtol, absolute, watched)
    else:
        course = Course(system, start, rtol, absolute)
    return course.run(first, q, v, kept, progress)


def _state(system: System, start: Any) -> tuple[float, np.ndarray, np.ndarray]:
    """Time, positions and rates of the last instant of a solution."""
    if not isinstance(start, Solution):
        raise ModelError(f"start must be a Solution, not {start!r}")
    if start.record.batch:
        raise ModelError("start is a batch of designs: give one, of system.design(n)")
    names = [body.name for body in system.mechanism.bodies]
    missing = [name for name in names if name not in start.system.bodies]
    if missing:
        raise ModelError(f"start has no body {listed(missing)}: give a motion of the same bodies")
    q, v = np.empty(3 * len(names)), np.empty(3 * len(names))
    for n, name in enumerate(names):
        body = start[name]
        q[3 * n : 3 * n + 3] = body.x[-1], body.y[-1], body.angle[-1]
        v[3 * n : 3 * n + 3] = body.vx[-1], body.vy[-1], body.omega[-1]
    return float(start.t[-1]), q, v


def _finite(value: Any, name: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ModelError(f"{name} must be a number, not {value!r}") from None
    if not math.isfinite(number):
        raise ModelError(f"{name} is {number}, it must be finite")
    return number


def _times(first: float, last: float, instants: Any, every: Any, times: Any) -> np.ndarray:
    """The instants that are kept, ascending, from the first to the last."""
    if sum(given is not None for given in (instants, every, times)) > 1:
        raise ModelError("give one of instants, every and times")
    if times is not None:
        kept = np.unique(np.asarray(times, dtype=float).reshape(-1))
        if not kept.size or not np.isfinite(kept).all() or kept[0] < first or kept[-1] > last:
            raise ModelError(f"times must lie between {first:g} and {last:g}")
        return kept
    if every is not None:
        step = _finite(every, "every")
        if not step > 0.0 or (last - first) / step > 1e7:
            raise ModelError(f"every is {step:g}: give a positive time, for at most 1e7 instants")
        count = math.floor((last - first) / step * (1.0 + 1e-12))
        kept = first + step * np.arange(count + 1)
        if last - kept[-1] > 1e-9 * step:
            kept = np.append(kept, last)
        kept[-1] = min(kept[-1], last)
        return kept
    count = 201 if instants is None else instants
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= 10_000_000:
        raise ModelError(f"instants must be a whole number from 2 to 1e7, not {instants!r}")
    return np.linspace(first, last, count)
