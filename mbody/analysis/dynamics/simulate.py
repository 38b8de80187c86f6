"""The verb `simulate`: free motion under loads, over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mbody.analysis.contact.unilateral import with_contacts_of_joints
from mbody.analysis.driven.table_extrapolation import extrapolated
from mbody.analysis.dynamics.energy_balance import energy_doubts
from mbody.analysis.dynamics.input_histories import with_inputs
from mbody.analysis.dynamics.options import last_time, motion_request, tolerances
from mbody.analysis.dynamics.release import integrate_phases
from mbody.analysis.dynamics.repeated import beginning
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import begins_so, initial_state_of, state_of
from mbody.analysis.position.assembly_analysis import as_system
from mbody.errors import ModelError, SolveError, brief
from mbody.model.body import Guesses
from mbody.model.event import Event
from mbody.model.mechanism import Mechanism
from mbody.model.remarks import remarks
from mbody.quantities.types import Number, PlainNumbers
from mbody.solution.certificate import as_reported, changed
from mbody.solution.doubts import Doubt, doubted
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

__all__ = ["first_instant", "first_instant_with_contacts", "judged", "simulate"]


def simulate(
    model: Mechanism | System,
    until: Number | None = None,
    *,
    start: Solution | None = None,
    guess: Guesses | None = None,
    rates: Mapping[str, Number] | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    step: Number | None = None,
    instants: int | None = None,
    every: Number | None = None,
    times: PlainNumbers | None = None,
    events: Sequence[Event] | None = None,
    release: Mapping[str, Number] | None = None,
    inputs: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] | bool | None = None,
) -> Solution:
    """Motion of what is free under all loads: forward dynamics.

    M a + Φ_qᵀ λ = f with Φ(q, t) = 0, by default by an explicit Runge–Kutta method of order 8 with
    control of the error; every step ends on Φ = 0 and Φ_q v = ν to rounding. Drivers, where there
    are any, follow their laws until they are released.

    Parameters
    ----------
    model : Mechanism or System
        With any number of free motions; massless bodies are ordinary where joints guide them.
    until : float or str, optional
        The last time, met exactly; by default that of the mechanism's own `simulation`, as all
        options below.
    start : Solution, optional
        Whose last instant is the first one here: of `close_loops`, of an analysis at an instant, or
        of another `simulate`; a motion of the same mechanism in the same way goes on bit for bit as
        if it had not ended, unless there are contacts. By default the `simulation` of the mechanism
        says it, else the loops are closed from the guesses, at rest, at t = 0.
    guess, rates : mapping, optional
        As of `close_loops`: first positions, and angular velocities, of bodies by name.
    method : str, optional
        ``"dop853"`` (the default) and ``"dopri5"``, explicit, of order 8 and 5; ``"radau5"``,
        implicit, of order 5, for stiff loads; of steps of one length ``"generalized-alpha"`` (order
        2, spectral radius 0.9), ``"rattle"`` and ``"rattle4"`` (order 2 and 4, symmetric and
        symplectic: energy stays bounded over any time), ``"moreau"`` for many contacts (order 1:
        impulses, no event is located).
    rtol, atol : float
        Error of a step, as a part of each coordinate and of the model's size; `atol` is `rtol` if
        it is not given. Of ``"moreau"`` the error of impulses, as a part of the greatest.
    step : float or str, optional
        Length of the steps of methods that have one.
    instants : int, optional
        How many instants are kept, both ends included, by default 201; or
    every : float, optional
        how far they are apart, or
    times : array, optional
        which ones they are.
    events : list of Event, optional
        Zero crossings that are recorded or end the motion; by default those of the mechanism's
        `simulation`.
    release : mapping, optional
        When drivers are released, by name: from then on they have no effort.
    inputs : mapping, optional
        Histories of inputs by name: a number or text such as ``"2 N*m"`` or ``"3 N*m*sin(2 rad/s
        *t)"``, a law of time (a `Table` with ``interpolation="hold"`` for a sampled signal), a
        function of time, a pair (t, u) of rows joined by straight lines, or one row spread evenly
        over the motion. Steps end at the corners of tables.
    progress : callable or bool, optional
        Called with the time reached, now and then; True shows on standard error how far it is.

    Returns
    -------
    Solution
        Motion, reactions, efforts at every instant; `energy`, the account of energy with its
        balance; `events`, an `EventRecord` each; `stats`, the counts of the steps; `status`.

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
    redundant joints are ordinary. Every step is checked for other branches of the constraints: a
    bend in which one passes near is resolved, a change point is passed by the smooth continuation
    with a note, and what cannot be made certain is a doubt, as are a balance of energy out of
    proportion to the tolerance and an inertia that vanishes for want of masses (`doubts`);
    `checks.branch` reports how near the motion came to a singular position, and when. Ctrl-C
    leaves what was done, with a status that says so.
    Events are looked for by values and rates at four samples a step and 400 of the motion, or more:
    two crossings between two of them are found by the extremum that lies between them.

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
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise ModelError(
            f"progress must be True or a function of the time reached, not {brief(progress)}"
        )
    system = _as_system(model, method)
    if system.batch is not None:
        raise ModelError("simulate takes one design: choose one of the batch with design(n)")
    last, errors = last_time(system, until), tolerances(system, rtol, atol)
    if inputs:
        # before the first instant is found: drivers may follow inputs
        first = 0.0 if start is None else float(start.t[-1])
        system = with_inputs(system, inputs, first, last)
    held, system = system, with_contacts_of_joints(system)
    start = first_instant_with_contacts(held, system, start, guess, rates)
    state = state_of(system, start)
    request = motion_request(
        system,
        state[0],
        last,
        errors,
        method=method,
        step=step,
        kept=(instants, every, times),
        events=events,
        release=release,
    )
    if progress is True:
        from mbody.analysis.dynamics.progress import shown

        progress = shown(last)
    try:
        run = integrate_phases(system, start, state, request, progress or None)
    except SolveError as error:
        if isinstance(error.solution, Solution):
            error.solution = judged(error.solution, request.way)
        raise
    return changed(judged(run, request.way), begun=(beginning(system, start, request),))


def _as_system(model: Mechanism | System, method: str | None) -> System:
    """The system of a model; its groups of contacts stay groups where the method takes them."""
    if isinstance(model, Mechanism):
        own = model.simulation
        chosen = own.method if method is None and own is not None else method
        return assemble(model, groups=chosen == "moreau")
    return as_system(model)


def first_instant_with_contacts(
    held: System,
    system: System,
    start: Solution | None,
    guess: Guesses | None,
    rates: Mapping[str, Number] | None,
) -> Solution:
    """The first instant with the joints that can separate closed, as in `held`; where what is given
    does not agree with that, with them as they are in `system`.
    """
    if not any(joint.can_separate for joint in held.mechanism.joints):
        return first_instant(system, start, guess, rates)
    try:
        found = first_instant(held, start, guess, rates)
    except (ModelError, SolveError):
        return first_instant(system, start, guess, rates)
    own = held.mechanism.simulation
    if start is None and own is not None and not begins_so(found, own):
        return first_instant(system, start, guess, rates)
    return found


def first_instant(
    system: System,
    start: Solution | None,
    guess: Guesses | None,
    rates: Mapping[str, Number] | None,
) -> Solution:
    """Whose last instant a motion begins with: `start`, else what the mechanism's own `simulation`
    says, else the loops closed from guesses.
    """
    own = system.mechanism.simulation
    if start is not None:
        if guess is not None or rates is not None:
            raise ModelError("start says positions and rates: leave out guess and rates")
        return start
    if own is not None and guess is None and rates is None:
        return initial_state_of(system, own)
    return close_loops(system, guess=guess, rates=rates)


def judged(run: Solution, way: Way, beyond: Sequence[Doubt] | None = None) -> Solution:
    """The motion with notes and doubts of its description, its laws and its energy; `beyond`: of
    tables that it left, where these are known already.
    """
    system = run.system
    notes = as_reported(run).notes
    own = system.once("remarks", lambda: remarks(system.mechanism))
    added = [note for note in own if note not in notes]
    found = changed(run, notes=(*notes, *added)) if added else run
    left = extrapolated(found) if beyond is None else beyond
    doubts = [*left, *energy_doubts(found, way.method, way.rtol)]
    return doubted(found, doubts)
