"""`Simulator`: a motion that another program leads on, step by step."""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

import numpy as np

from mbody.analysis.contact.unilateral import has_modes, with_contacts_of_joints
from mbody.analysis.driven.contact_report import OneSidedForce, one_sided, one_sided_force
from mbody.analysis.driven.law_doubts import (
    derivative_doubts,
    law_doubts,
    open_curves,
    open_tables,
)
from mbody.analysis.dynamics.branch_passage import choose_branch, singular_start
from mbody.analysis.dynamics.integration import Integration
from mbody.analysis.dynamics.integrators import first_auxiliary_states
from mbody.analysis.dynamics.interruptions import solution_of_records
from mbody.analysis.dynamics.options import motion_request, tolerances, with_inputs
from mbody.analysis.dynamics.restart import Checkpoint
from mbody.analysis.dynamics.simulate import (
    first_instant_with_contacts,
    motion_of,
    refuse_readings_of_released,
)
from mbody.analysis.freedom.mobility import free_motions, released
from mbody.analysis.initial.close_loops import branch_rates, first_rates, moved_note
from mbody.analysis.initial.initial_state import fitted_places, state_of
from mbody.analysis.position.assembly_analysis import as_system, closed, raise_user_error
from mbody.analysis.singular.singular_positions import Prescribed, singular
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError, brief
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.step_state import TIME
from mbody.model.body import Guesses
from mbody.model.element import listed, takes_one_design
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.model.simulation import STATE
from mbody.quantities.formula import Number
from mbody.quantities.units import DIMENSIONS
from mbody.solution.doubts import Doubt
from mbody.solution.histories import with_fields
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import Present, Read
from mbody.stepping.readings import Inputs, MechanicsNow
from mbody.system.formula_steps import driver_inputs
from mbody.system.rank import dense, rank_of
from mbody.system.system import Locked, System, too_large

# -- States that a user sets: the nearest one that joints and drivers allow, and how far it is -

Array = np.ndarray

#: Places and angles, all others being rates.
PLACES = ("x", "y", "angle")
#: Values that a sentence names.
NAMED = 3


@dataclass(frozen=True, eq=False)
class Nearest:
    """A state that joints and drivers allow.

    `q`, `v` (coordinates,)
    `distance`: The greatest difference of a place from what it was to be, in model lengths and
        radians.
    `notes`: What is not as it was to be.
    `regularization`: Of redundant rows; zero where there are none.
    """

    q: Array
    v: Array
    distance: float
    notes: tuple[str, ...]
    regularization: float


def prescribed_values(system: System, given: Any) -> list[Prescribed]:
    """Values by name, ``{"crank": {"angle": 0.5}}`` or ``{"crank.angle": 0.5}``, as numbers."""
    example = '{"crank": {"angle": 0.5, "omega": 2.0}}'
    if not isinstance(given, Mapping):
        raise ModelError(
            f"reset takes a state, or positions and rates by name such as {example}, not "
            f"{brief(given)}"
        )
    found = []
    for name, value in given.items():
        body, parts = name, value
        if isinstance(name, str) and not isinstance(value, Mapping):
            body, _, key = name.rpartition(".")
            parts = {key: value}
        if not isinstance(parts, Mapping) or body not in system.bodies or body == "ground":
            known = listed(one.name for one in system.mechanism.bodies)
            raise ModelError(
                f"reset: there is no body {brief(body or name)} (there are: {known}); give "
                f"positions and rates by name, such as {example}",
                str(body or name),
            )
        for key, one in parts.items():
            if key not in STATE:
                raise ModelError(
                    f"reset: '{body}' has no {key!r} to set (it has: {', '.join(STATE)})", body
                )
            number = number_in(system.mechanism, one, STATE[key], "reset", f"{body}.{key}")
            found.append(Prescribed(body, key, number))
    return found


def nearest_state(system: System, t: float, base: Array, given: Sequence[Prescribed]) -> Nearest:
    """The state nearest to prescribed values. Leaders of free motions that these leave free stay
    where they are in the position `base` (coordinates,); rates are those of `first_rates`.
    """
    if too_large(system):
        raise ModelError(
            f"reset: '{system.mechanism.name}' has {system.rows} rows, too many for positions by "
            "name: set a state that a simulator had"
        )
    places = [one for one in given if one.key in PLACES]
    rates = [one for one in given if one.key not in PLACES]
    work = system.work()
    work.time[:] = t
    laws_of_time(system.runtime(), work)
    raise_user_error(system)
    work.q[: system.coordinates, 0] = base
    kept = _stationary_motions(system, work, base, places)
    q, off = _continued_position(system, work, t, base, (*places, *kept))
    off = off[: len(places)]
    start = closed(system, t, {}, pose=np.append(q, np.zeros(3)))
    q = start.work.q[: system.coordinates, 0].copy()
    here = None
    if start.regularization or start.ratio < tol.PIVOT_SUSPECT:
        own = system.work()
        own.q[:], own.signal[:], own.time[:] = start.work.q, start.work.signal, start.work.time
        here = singular(system, own, t, tol.SINGULAR_DISTANCE_PRECISE)
    notes: tuple[str, ...] = ()
    if here is None:
        found = first_rates(system, start.work, rates)
        v, notes = system.coordinate_units * found.v, moved_note(system, found.moved)
        lacking, fast = found.met - found.given.p, found.fast
    else:
        v, notes = branch_rates(system, here, t, q, rates)
        lacking = fast = np.zeros(len(rates))
    wrong = [
        (one, -part)
        for one, part in zip(places, off, strict=True)
        if abs(part) > tol.SIMULATOR_STATE_MET
    ]
    wrong += [
        (one, part)
        for one, part, size in zip(rates, lacking, fast, strict=True)
        if abs(part) > tol.SIMULATOR_STATE_MET * size
    ]
    if wrong:
        notes = (*notes, _sentence(system, wrong))
    return Nearest(
        q, v, float(np.abs(off).max(initial=0.0)), (*start.notes, *notes), start.regularization
    )


def _stationary_motions(
    system: System, work: Work, q: Array, given: Sequence[Prescribed]
) -> list[Prescribed]:
    """Positions of the leading bodies' free motions, as far as `given` leaves them free."""
    own = rank_of(dense(system, work)[1], parts=system.coordinate_part).motions
    found: list[Prescribed] = []
    rows = np.array([one.row(system, q) for one in given]).reshape(-1, system.coordinates) @ own.T
    free = free_motions(system, np.append(q, np.zeros(3)), own) if len(own) else ()
    for motion in free:
        vx, vy, _ = motion.rates[motion.leader]
        place = "angle" if motion.turns else "x" if abs(vx) >= abs(vy) else "y"
        one = Prescribed(motion.leader, place, 0.0)
        one = replace(one, value=one.at(system, q) * one.unit(system))
        row = one.row(system, q) @ own.T
        left = (
            row
            if not len(rows)
            else row - np.linalg.lstsq(rows.T, row, rcond=tol.SINGULAR_VALUE_ZERO)[0] @ rows
        )
        if np.abs(left).max() > tol.SIMULATOR_ROW_FREE * np.abs(row).max():
            found.append(one)
            rows = np.vstack([rows, row])
    return found


def _continued_position(
    system: System, work: Work, t: float, base: Array, places: Sequence[Prescribed]
) -> tuple[Array, Array]:
    """The position, and how far places are from what they were to be: it is led there from `base`
    so that it stays on its branch.
    """
    q, ground = base, np.zeros(3)
    starts = [one.at(system, q) * one.unit(system) for one in places]
    changes = [one.value - start for one, start in zip(places, starts, strict=True)]
    sizes = (abs(change) / one.unit(system) for one, change in zip(places, changes, strict=True))
    count, off = (
        max(1, math.ceil(max(sizes, default=0.0) / tol.POSITION_PRESCRIBED_STEP)),
        np.zeros(len(places)),
    )
    for n in range(1, count + 1):
        candidates = [
            Prescribed(one.body, one.key, one.value if n == count else start + n / count * change)
            for one, start, change in zip(places, starts, changes, strict=True)
        ]
        found = fitted_places(system, work, candidates, np.append(q, ground))
        if found is None:
            texts = ", ".join(one.with_value(system, one.value) for one in places[:NAMED])
            unit = system.mechanism.units.time
            raise SolveError(
                f"reset: the loops of '{system.mechanism.name}' do not close near {texts or 'it'} "
                f"at t = {t:.6g} {unit}: give values that its joints allow",
                places[0].body if places else None,
            )
        q, off = found.q[: system.coordinates], found.off
    return q, off


def _sentence(system: System, wrong: Sequence[tuple[Prescribed, float]]) -> str:
    """Sentence on prescribed values that were not met, in the user's units."""
    texts = [
        f"{one.with_value(system, one.value + part * one.unit(system))}, not "
        f"{one.with_value(system, one.value).partition(' = ')[2]}"
        for one, part in wrong[:NAMED]
    ]
    more = f", and {len(wrong) - NAMED} more" if len(wrong) > NAMED else ""
    return (
        f"the reset does not fit joints and drivers: the nearest state that fits was taken, with "
        f"{'; '.join(texts)}{more}"
    )


# -- The state of a simulator: immutable, to be kept, copied, pickled and set back -------------


@dataclass(frozen=True, eq=False)
class SimulatorState(Locked):
    """The state of a motion at one instant.

    Set back in a `Simulator` of the same mechanism and method, the same steps give the same bits.

    `t`: Time.
    `q`, `v` (coordinates,): Mass centre (x, y) and angle of every body, in the order of the
      description, and their rates [length, length, rad; a unit of time].
    `own` (states,): The mechanism's auxiliary states.
    `inputs` (inputs,): Values of the inputs.
    `bodies`: The bodies of q and v.
    `status`: As of `Simulator.status`, doubts aside.
    `beyond`: Tables that the motion left.
    """

    t: float
    q: Array
    v: Array
    own: Array
    inputs: Array
    bodies: tuple[str, ...]
    status: str = "completed"
    beyond: tuple[Doubt, ...] = field(default=(), repr=False)
    #: What the integrator carries on, and where a motion that leaves a singular position began.
    checkpoint: Checkpoint | None = field(default=None, repr=False)
    origin: tuple[float, Array, Array] | None = field(default=None, repr=False)


# -- What is looked at between the ends of calls: tables that are left, contacts that lift off -


class Monitor:
    """Tables, contacts and ropes of one motion; events look for themselves."""

    def __init__(self, integration: Integration, present: Present, events: bool) -> None:
        self.integration, self.present = integration, present
        self.system = system = integration.system
        described = system.mechanism
        left = (*open_tables(described), *open_curves(described))
        integration.closely = bool(left)
        self.contacts: list[tuple[str, Any, Read | None, Read | None]] = []
        for one in [] if events else one_sided(system):
            force: Read | None = None
            size: Read | None = None
            with contextlib.suppress(Exception):  # what no list of operations gives
                forces = one_sided_force(present.instant, one)
                force, size = present.read(forces.force), present.read(forces.size)
            self.contacts.append((one.name, one, force, size))
        integration.watched = bool(self.contacts)
        self.any = bool(self.contacts) or integration.closely or system.has_user_code

    def after_call(self, known: tuple[Doubt, ...]) -> tuple[Doubt, ...]:
        """Look at what the last call went through; the doubts of tables that were left."""
        engine = self.integration
        if engine.samples is None:
            self._at_the_end()
            if not self.system.has_user_code:
                return known
            new = derivative_doubts(self.system)
            return (*known, *(one for one in new if one not in known))
        (times, records), engine.samples = engine.samples, None
        run = self._result(times, records)
        names = {one.elements for one in known}
        for name, one, _, _ in self.contacts:
            engine.meet(name, one_sided_force(run, one))
        return (*known, *(one for one in law_doubts(run) if one.elements not in names))

    def _at_the_end(self) -> None:
        """Forces of contacts and ropes at the end of a call that was one step."""
        engine, t = self.integration, np.array([self.integration.state[TIME]])
        for name, one, force, size in self.contacts:
            if force is None or size is None:
                run = self._result(t, np.array(self.present.record())[None, :, None])
                engine.meet(name, one_sided_force(run, one))
                continue
            known, now, large = engine.extremes.get(name), force(), size()
            if known is None or now < known.force.min() or large > known.size.max():
                engine.meet(name, OneSidedForce(t, np.array([now]), np.array([large])))

    def _result(self, times: Array, records: Array) -> Solution:
        """Instants as a result."""
        return solution_of_records(self.system, times, records, self.integration.regularization)


class Simulator(MechanicsNow):
    """A motion that your program leads on: step, read, set, and step again.

    The motion is that of `mbody.simulate`, by the same steps: each call ends exactly where it is to
    end, and every step within it keeps the tolerance.

    Parameters
    ----------
    model : Mechanism or System
        One design; a mechanism's own `simulation` gives what is not given here: the start, the
        method, the tolerance, and the events that every step looks for.
    method, rtol, atol, step, start, guess, rates
        As of `mbody.simulate`.

    Attributes
    ----------
    inputs : mapping
        The inputs of the mechanism by name; what is set acts from now on.

    Raises
    ------
    ModelError, SolveError
        As `simulate` does; and for drivers that are to be released later on.

    Examples
    --------
    >>> import mbody
    >>> sim = mbody.Simulator(mbody.gallery.load("double_pendulum"), rtol=1e-9)
    >>> before = sim.state
    >>> for _ in range(100):
    ...     sim.step(1e-3)
    >>> first = sim["upper"].angle
    >>> sim.state = before
    >>> for _ in range(100):
    ...     sim.step(1e-3)
    >>> sim["upper"].angle == first
    True
    """

    def __init__(
        self,
        model: Mechanism | System,
        *,
        method: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        step: Number | None = None,
        start: Solution | None = None,
        guess: Guesses | None = None,
        rates: Mapping[str, Number] | None = None,
    ) -> None:
        whole = as_system(model)
        takes_one_design("a Simulator", whole.batch)
        errors = tolerances(whole, rtol, atol)
        closed_system, whole = whole, with_contacts_of_joints(whole)
        self._start = first_instant_with_contacts(closed_system, whole, start, guess, rates)
        t, q, v = state_of(whole, self._start)
        self._request = motion_request(
            whole,
            t,
            t + max(whole.mechanism.units.second, abs(t)),
            errors,
            method=method,
            step=step,
            kept=(2, None, None),
            events=None,
            release=None,
        )
        gone = self._released(whole, t)
        self.system = whole
        if gone:
            refuse_readings_of_released(whole.mechanism, gone, self._request.events)
            self.system = released(whole, gone)
            t, q, v = state_of(self.system, self._start)
        settings, events = self._request.settings, self._request.events
        self._show(motion_of(self.system, self._start, settings, events), settings)
        self._monitor = Monitor(self._integration, self._present, bool(self._request.events))
        self.inputs = self._find_inputs()
        self._begin(t, q, v)
        self._first = self.state

    def _released(self, system: System, t: float) -> list[str]:
        """Drivers that are released from the first instant on."""
        own = {driver.name for driver in system.drivers}
        gone = [name for name in self._start.released if name in own]
        for name, when in self._request.release.items():
            if when > t:
                raise ModelError(
                    f"'{name}' is to be released at {when:g} {system.mechanism.units.time}: a "
                    "Simulator releases nothing later on; simulate until then, and give the result "
                    "as start",
                    name,
                )
            if name not in gone:
                gone.append(name)
        return gone

    def _find_inputs(self) -> Inputs:
        """The inputs, and what sets those that cannot be set."""
        system, engine = self.system, self._integration
        values = dict(zip(engine.free_inputs, engine.free_the_inputs().tolist(), strict=True))
        self._rows = list(engine.free_inputs.values())
        self._signals: Any = memoryview(engine.work.signal.reshape(-1).data)
        others = {}
        first = system.auxiliary_rows.start + system.layout.owns
        for n, one in enumerate(system.mechanism.inputs):
            if one.name not in values:
                setters = [c.name for c in system.mechanism.controllers if one.name in c.sets]
                why = "follows its law of time: declare it with a number to set it here"
                if setters:
                    why = f"is set by the controller '{setters[0]}': take that off to set it here"
                others[one.name] = why, functools.partial(self._kept_number, first + n)

        def number(name: str, value: Any) -> float:
            own = next(one for one in system.mechanism.inputs if one.name == name)
            own_dimension = own.dimension or DIMENSIONS["number"]
            return number_in(system.mechanism, value, own_dimension, "inputs", name)

        drivers = driver_inputs(system.mechanism, system.numbers)
        return Inputs(values, self._set_input, others, number, drivers)

    def _kept_number(self, row: int) -> float:
        return self._instant_record()[row]

    def _begin(
        self, t: float, q: Array, v: Array, notes: tuple[str, ...] = (), own: Array | None = None
    ) -> None:
        """Begin at a state, as a motion of `simulate` does."""
        engine = self._integration
        self._origin, self._before = None, None
        self._ended, self._notes, self._beyond, self._stale = "", notes, (), False
        if has_modes(self.system) or choose_branch(self.system, self._start, (t, q, v)) is None:
            engine.start_at(t, q, v, own)
            self._invalidate()
            return
        # the motion begins at a singular position: its first part is found as a whole
        self._origin = t, q.copy(), v.copy()
        self._lead_out(t)

    # -- steps --------------------------------------------------------------------------------

    def step(self, dt: Number) -> None:
        """Go on by `dt`, to exactly ``t + dt``.

        Parameters
        ----------
        dt : float or str
            Positive [time].

        Raises
        ------
        ModelError
            For a time that is not positive.
        SolveError
            As `simulate`, with its sentences; the state is then the one before the step. Also where
            the motion has ended.
        """
        t = self._slots[TIME]
        length = dt if type(dt) is float else self._time(dt, "dt")
        until = t + length
        if not t < until < math.inf:
            unit = self.system.mechanism.units.time
            raise ModelError(
                f"step: dt is {length:g} {unit} at t = {t:g} {unit}: give a positive time; to go "
                "back, keep sim.state and set it again"
            )
        self._advance_to(until)

    def until(self, t: Number) -> None:
        """Go on to exactly the time `t`, which may be the present one.

        Parameters
        ----------
        t : float or str
            Not before the present time.

        Raises
        ------
        ModelError
            For an earlier time.
        SolveError
            As `step`.
        """
        now, until = self._slots[TIME], self._time(t, "t")
        if not now <= until < math.inf:
            unit = self.system.mechanism.units.time
            raise ModelError(
                f"until: t is {until:g} {unit}, the motion is at {now:g} {unit} already: give a "
                "later time; to go back, keep sim.state and set it again"
            )
        if until > now:
            self._advance_to(until)

    def _time(self, value: Any, name: str) -> float:
        return number_in(self.system.mechanism, value, "time", "simulator", name)

    def _advance_to(self, until: float) -> None:
        if self._ended or self._origin is not None:
            until = self._prepared(until)
        self._record_valid, self._certified = False, None
        if until > self._slots[TIME]:
            self._ended = self._integration.advance_to(until, self._stale)
            self._stale = False
            if self._monitor.any:
                self._beyond = self._monitor.after_call(self._beyond)

    def _prepared(self, until: float) -> float:
        """Leads the motion out of its start; returns the time to step to."""
        if self._ended:
            raise SolveError(
                f"the motion of '{self.system.mechanism.name}' has ended: "
                f"{self._ended.removeprefix('ended: ')}; set an earlier state, or reset it"
            )
        if self._origin is not None and not self._lead_out(until):
            return self._slots[TIME]
        return until

    def _refresh(self) -> None:
        """The derivative with which the next step begins, by the present inputs."""
        if self._stale:
            self._integration.refresh()
            self._stale = False

    def _lead_out(self, until: float) -> bool:
        """Out of the singular position at which it began; whether steps go on from there."""
        assert self._origin is not None
        t = self._origin[0]
        # a little longer, so that the time itself is kept
        last = until + (1e-9 * (until - t) or 1.0)
        request = replace(self._request, first=t, times=np.array([until]))
        start = with_fields(self._start.take([-1]), t=np.array([t]))
        present = {name: self.inputs[name] for name in self.inputs.names}
        system = with_inputs(self.system, present, t, last) if present else self.system
        part = singular_start(system, start, self._origin, request, last)
        assert part is not None
        self._before = part
        if until > t and part.t[-1] < until:
            self._origin = None
            self._integration.regularize(part.regularization)
            self._integration.start_at(
                *state_of(self.system, part), own=first_auxiliary_states(system, part)
            )
            return True
        rows = part.record.table(slice(None))
        self._integration.place_at(until, rows[int(np.searchsorted(part.t, until))])
        self._record_valid, self._certified = True, None
        return False

    # -- the state ----------------------------------------------------------------------------

    @property
    def own(self) -> Array:
        """A copy of the mechanism's auxiliary states (states,), in the order of the description."""
        return self._integration.y[2 * self.system.coordinates :].copy()

    @property
    def reached(self) -> tuple[float, Array, str, tuple[Doubt, ...]]:
        """The time, positions, rates and auxiliary states (rows,), the status of a motion that has
        ended, else nothing, and doubts about the branch.
        """
        engine = self._integration
        return engine.state.item(TIME), engine.y, self._ended, engine.passage.doubts

    @property
    def state(self) -> SimulatorState:
        """The state, to be kept, copied, pickled, and set back: the same steps then give the same
        bits.
        """
        self._refresh()
        return SimulatorState(
            t=self.t,
            q=self.q,
            v=self.v,
            own=self.own,
            inputs=self.inputs.array(),
            bodies=tuple(body.name for body in self.system.mechanism.bodies),
            status=self._ended or "completed",
            beyond=self._beyond,
            checkpoint=None if self._origin is not None else self._integration.snapshot(),
            origin=self._origin,
        )

    @state.setter
    def state(self, given: SimulatorState) -> None:
        why = self._unfit(given)
        if why:
            raise ModelError(f"the state that is set {why}")
        self._set(given)

    def _set(self, given: SimulatorState) -> None:
        self.inputs.set_all(given.inputs)
        self._ended = "" if given.status == "completed" else given.status
        self._stale, self._notes, self._before = False, (), None
        self._beyond = given.beyond
        self._origin = given.origin
        if given.checkpoint is None:
            self._lead_out(given.t)
            return
        self._integration.go_on_from(given.checkpoint)
        self._invalidate()

    def _unfit(self, given: Any) -> str:
        """Why a state cannot be gone on from exactly; else nothing."""
        if not isinstance(given, SimulatorState):
            return f"must be one that sim.state gave, not {brief(given)}"
        names = tuple(body.name for body in self.system.mechanism.bodies)
        if given.bodies != names or len(given.inputs) != len(self.inputs.names):
            return f"is of another mechanism, of the bodies {listed(given.bodies)}"
        checkpoint = given.checkpoint
        if checkpoint is None:
            return "" if given.origin is not None else "is not whole: take one of sim.state"
        settings, own = checkpoint.restart.settings, self._request.settings
        if settings != own:
            return (
                f"goes by {settings.method} at rtol {settings.rtol:g}, this simulator by "
                f"{own.method} at rtol {own.rtol:g}: reset(state) takes its positions and rates "
                "alone"
            )
        self._record_valid = False
        return self._integration.unfit(checkpoint, given.inputs)

    def _set_input(self, place: int, value: float) -> None:
        self._signals[self._rows[place]] = value
        self._stale, self._record_valid, self._certified = True, False, None

    def reset(
        self, to: SimulatorState | Mapping[str, Any] | None = None, *, t: Number | None = None
    ) -> float:
        """Begin anew: at the first state, at another one, or at positions and rates by name.

        Parameters
        ----------
        to : SimulatorState or mapping, optional
            A state of this mechanism, or values by name, ``{"crank": {"angle": 0.5, "omega": 2}}``
            or ``{"crank.angle": "30 deg"}``: of x, y (the origin of the link's axes), angle, vx, vy
            and omega, as in ``[simulate] start``; and of auxiliary states. What these leave free
            stays as in the first position of this simulator, and rests: the leaders of the free
            motions (`minimal`). Inputs have their first values again, or those of the state.
        t : float or str, optional
            Time, by default that of the state, or the first one.

        Returns
        -------
        float
            How far the state is from the one that was given, where joints and drivers do not allow
            that: the greatest difference of a place or an angle, in model lengths and radians. The
            nearest one is taken then, and `notes` say what differs. 0 where it fits.

        Raises
        ------
        ModelError
            For names that there are not, and what is no number.
        SolveError
            Where the loops do not close near there; the state is then as it was.
        """
        when = None if t is None else self._time(t, "t")
        if to is None and when is None:
            self._set(self._first)
            return 0.0
        if isinstance(to, SimulatorState) and when is None and not self._unfit(to):
            self._set(to)
            return 0.0
        before = self.state
        try:
            return self._reset(to, when)
        except Exception:
            self._set(before)
            raise

    def _reset(self, to: Any, when: float | None) -> float:
        system = self.system
        if isinstance(to, SimulatorState):
            names = tuple(body.name for body in system.mechanism.bodies)
            if to.bodies != names:
                raise ModelError(
                    f"the state to reset to is of another mechanism, of the bodies "
                    f"{listed(to.bodies)}"
                )
            if to.checkpoint is not None:
                self._integration.regularize(to.checkpoint.regularization)
            self._first_inputs(to if len(to.inputs) == len(self.inputs.names) else self._first)
            own = to.own.copy() if len(to.own) == len(self.own) else None
            self._begin(to.t if when is None else when, to.q.copy(), to.v.copy(), (), own)
            return float(system.extent(self.q - to.q))
        first = self._first
        states = [state.name for state in system.mechanism.states]
        given_states = {k: to[k] for k in to if k in states} if isinstance(to, Mapping) else {}
        left = {k: to[k] for k in to if k not in states} if isinstance(to, Mapping) else to
        given = prescribed_values(system, {} if to is None else left)
        own = self._auxiliary_states(given_states) if given_states else None
        when = first.t if when is None else when
        nearest = nearest_state(system, when, first.q, given)
        self._integration.regularize(nearest.regularization)
        self._first_inputs(first)
        self._begin(when, nearest.q, nearest.v, nearest.notes, own)
        return nearest.distance

    def _first_inputs(self, state: SimulatorState) -> None:
        self.inputs.set_all(state.inputs)

    def _auxiliary_states(self, given: Mapping[str, Any]) -> Array:
        """Auxiliary states at a beginning, some of them given."""
        found, machine = self._first.own.copy(), self.system.mechanism
        for n, state in enumerate(machine.states):
            if state.name in given:
                of = state.dimension or DIMENSIONS["number"]
                found[n] = number_in(machine, given[state.name], of, "reset", state.name)
        return found

    def __reduce__(self) -> NoReturn:
        raise ModelError(
            "a Simulator cannot be copied: make another one of the same system, and set its state "
            "to sim.state, which can be copied and pickled"
        )

    def __repr__(self) -> str:
        unit = self.system.mechanism.units.time
        return f"Simulator({self.system.mechanism.name!r}, t = {self.t:.6g} {unit})"
