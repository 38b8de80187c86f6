"""Time integration of one motion: memory and calls of the kernel that leads it, and its result.

One class leads every motion: to its end, as `simulate` asks, or to one time after another. Its
steps are those of `mbody.kernels.advance`, which watches the guards of contacts, ropes and
frictional joints and zeros of users' measures (`mbody.analysis.dynamics.active_modes`), or nothing.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import has_modes, unilateral_of
from mbody.analysis.driven.contact_report import (
    OneSidedForce,
    extremes,
    one_sided,
    one_sided_force,
    pulled,
)
from mbody.analysis.driven.diagnosis import (
    adjusted,
    branching,
    open_along,
    open_note,
    undetermined,
    valueless,
    weightless,
)
from mbody.analysis.dynamics.branch_passage import BranchPassage
from mbody.analysis.dynamics.integrators import (
    PATIENT,
    REFINEMENTS,
    Motion,
    auxiliary_sizes,
    coordinate_sizes,
    find_steady,
    first_auxiliary_states,
    first_step,
    integrator,
    limited_instants,
    refined_where_uneven,
    refuse_auxiliary_states,
    step_counts,
    stepping,
    unresolved_states,
)
from mbody.analysis.dynamics.interruptions import (
    ControllerReadings,
    Interruptions,
    SampledState,
    has_corners,
    hold_inputs,
    input_value,
    jump_doubt,
    solution_of_records,
    without_hold,
    works_of_drivers,
)
from mbody.analysis.dynamics.restart import (
    Checkpoint,
    no_progress,
    stopped,
    unfit_checkpoint,
)
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.closed_position import vanishing
from mbody.analysis.singular.nearby_singularity import packed_positions, unpacked_positions
from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.layout import Work, artificial_masses
from mbody.kernels.loop_closure import laws_of_time, violation
from mbody.kernels.methods import unwatched_motion
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    BRANCH_UNCERTAIN,
    CROSSED,
    DELIVERED,
    DONE,
    JACOBIAN_VALID,
    LAST_STEP,
    LAST_STEP_ALLOWED,
    LIMITED_INSTANTS,
    MORE,
    NEXT,
    NOT_QUIET,
    STEPS,
    THROUGHPUT,
    TIME,
    ZERO,
    Outputs,
    Stepping,
    Tolerances,
)
from mbody.laws import Constant
from mbody.model.model_notes import may_be_one_sided
from mbody.model.simulation import Event
from mbody.model.states import Controller
from mbody.solution.doubts import doubted
from mbody.solution.energy import account, causes, gain_of_jump
from mbody.solution.histories import EventRecord, Record, reported_certificate, with_fields
from mbody.solution.shared_forces import ForceSet, SharedResult, inadmissible
from mbody.solution.solution import IntegrationSettings, ModalState, Restart, Solution
from mbody.system.rank import dense_rates
from mbody.system.system import System

Array = np.ndarray

#: Steps of one call of the kernel; between calls progress is shown and Ctrl-C takes effect.
AT_ONCE = 500
#: Of so many steps the mean is compared with the greatest; where `PATIENT` steps are still to go,
#: the step size may collapse.
JUDGED = 10_000


#: Instants within a call at which it is monitored: of one step, and of many.
WITHIN, AMONG = 8, 200
#: Looks at a step at which forces are met, at least; looks at events in the whole motion, at least.
OF_A_STEP, OF_ALL = 4, 400


@dataclass(frozen=True, eq=False)
class KeptInstants:
    """Instants of a motion that are kept.

    `t`, `records`, `works`: Times (instants,), records (instants, rows, 1), and the work of every
      cause since the beginning (instants, causes).
    `modes`, `forces`: What is open, sticks and slides, and admissible forces where they are not
      determined; empty where nothing has modes.
    """

    t: Array
    records: Array
    works: Array
    modes: Sequence[dict[str, str]] = ()
    forces: Sequence[ForceSet | None] = ()

    @property
    def but_last(self) -> KeptInstants:
        """These without the last one."""
        return KeptInstants(*(part[:-1] for part in vars(self).values()))


def joined_instants(blocks: Sequence[KeptInstants], rows: int, causes: int) -> KeptInstants:
    """Blocks of instants, of records of so many rows and works of so many causes, as one."""
    none = np.empty(0), np.empty((0, rows, 1)), np.empty((0, causes))
    every = [(one.t, one.records, one.works) for one in blocks]
    t, records, works = (np.concatenate(part) for part in zip(none, *every, strict=True))
    modes = tuple(mode for one in blocks for mode in one.modes)
    return KeptInstants(t, records, works, modes, tuple(f for one in blocks for f in one.forces))


class Integration:
    """The motion of one system from a first state on: to the end, as `simulate` asks, or to one
    time after another.

    A call of `advance_to` that one step covers is one call of the kernel, which leaves the state as
    it was where it rejects the step; longer ones go back to where they began where they fail.
    """

    #: Whether the instants within calls of many steps are kept in `samples`, times and records; and
    #: those within each call.
    watched = closely = False
    samples: tuple[Array, Array] | None = None
    #: Whether explicit steps vanished, for a reason that is not known.
    vanished = False
    #: Whether it locates jumps in formulas itself.
    located = False
    integrator = staticmethod(integrator)

    def __init__(
        self,
        system: System,
        start: Solution,
        settings: IntegrationSettings,
        events: Sequence[Event] = (),
        jumps: Sequence[int] = (),
        *,
        meets_forces: bool = False,
    ) -> None:
        self.system, self.start, self.settings = system, start, settings
        refuse_auxiliary_states(system, settings.method)
        self.layout = without_hold(system.runtime(), hold_inputs(system))
        self.work = system.work(masses=True)
        self.regularization = (
            start.regularization
            if start.system is system
            else tol.REDUNDANT_ROW_SOFTNESS * bool(start.regularization)
        )
        self.causes = len(causes(system))
        self.steps = self.integrator(settings.method, self.layout, self.work, settings.step)
        self.stepping = stepping(
            system.state_count, self.causes, self.regularization, self.steps.rows, self.steps.terms
        )
        self.y, self.state = self.stepping.y, self.stepping.state
        self.K, self.P, self.scale = self.stepping.K, self.stepping.P, self.stepping.scale
        #: What is asked of the steps where nothing is watched; whether inputs are others than those
        #: of the present derivative.
        self.asked, self.inputs_changed = np.zeros(3), False
        #: Whether something may open, stick or slide; what is decided of that, and events.
        self.has_modes, self.active = has_modes(system), None
        self.motion = self._motion()
        #: Whether loads follow laws of time, of which the length of steps says nothing.
        self.swings = self.layout.varying > 0 or system.has_user_code
        #: What holds in one direction only, whose forces are met within steps.
        self.sided: Sequence[Any] = ()
        if self.has_modes or events or jumps:
            from mbody.analysis.dynamics.active_modes import ActiveModes

            self.active = ActiveModes(self, events, jumps)
        if (self.active or meets_forces) and may_be_one_sided(system.mechanism):
            self.sided = one_sided(system)
        #: How far apart events are looked at, at most: of a call of one step at its ends.
        self.apart = math.inf
        self.initial_work = np.zeros(self.causes)
        self.restart_point: Restart | None = None
        self.occurred: list[EventRecord] = []
        self.stops = [one.name for one in system.mechanism.contacts]
        #: Of contacts and ropes the least force, the largest by size, and the first of wrong sign.
        self.extremes: dict[str, OneSidedForce] = {}
        #: The first instant as it is shown.
        self.reference = np.empty((0, 1))
        #: No instants to be kept; the work of every cause since the beginning.
        records, work = np.empty((0, system.record_rows, 1)), np.zeros((1, self.causes))
        self.nothing = Outputs(times=np.empty(0), pages=records, work=work)
        self.total = self.nothing.work[0]
        #: Instants that are wanted, and those that are kept.
        self.wanted, self.kept = np.empty(0), list[KeptInstants]()
        #: The status of a motion that ended where forces jumped.
        self.ending = ""
        #: The state before the step that ends in time, and that which it went on from.
        self.before_end: Restart | None = None
        self.resumed: ModalState | None = None
        #: Whether `record` is of an earlier instant.
        self.late = False

    def _motion(self) -> Motion:
        """All that the kernel works on."""
        if self.active is not None:
            self.active.forget_motions()
        # a small mass replaces a missing one: refinement takes its effect back
        light = artificial_masses(self.layout, self.system.mass, self.system.sizes).any()
        tolerances = Tolerances(
            relative=self.settings.rtol,
            absolute=self.settings.atol,
            refinements=REFINEMENTS if light or self.regularization else 0,
            full_refinements=REFINEMENTS,
            patience=PATIENT,
        )
        motion = Motion(self.layout, self.work, self.stepping, tolerances)
        uni = unilateral_of(self.system) if self.has_modes else None
        return motion if uni is None else refined_where_uneven(motion, uni)

    # -- a whole motion ------------------------------------------------------------------------

    def run(
        self,
        first: float,
        q: Array,
        v: Array,
        times: Array,
        progress: Callable[[float], None] | None,
        restart: Restart | None = None,
        carried: tuple[dict[str, float], Sequence[SampledState]] | None = None,
    ) -> Solution:
        """The motion at the times; from `restart` on as if it had not been interrupted. `carried`:
        held inputs and controllers as the motion before left them.
        """
        self.begin(first, q, v, float(times[-1]))
        self.wanted, self.kept = times, []
        code, status = MORE, "completed"
        if carried is not None:
            self.interruptions.restore(*carried)
        if restart is not None:
            self._resume(restart)
        try:
            if restart is None and self.interruptions.any:
                self._interrupt(first)
            self.target = min(self.until, self.interruptions.next(float(self.state[TIME])))
            code, status = self._integrate(progress)
        except KeyboardInterrupt:
            unit = self.system.mechanism.units.time
            status = f"stopped: at t = {self.state[TIME]:.6g} {unit} by the user"
            self._keep_now()
        found = self.solution(status)
        lost = np.flatnonzero(~np.isfinite(found.record.blocks[0][:, :, 0]).all(axis=1))
        if lost.size:  # an instant at which a load has no value, though the steps passed it
            self.state[TIME] = found.t[lost[0]]
            found = found.take(np.arange(lost[0]))
        if lost.size or code not in (DONE, MORE):
            raise stopped(self, found, code)
        return found

    def begin(
        self, first: float, q: Array, v: Array, until: float, own: Array | None = None
    ) -> None:
        """First state with its derivative, and the length of the first step; `own`: auxiliary
        states, by default those that the start has.
        """
        n3 = self.system.coordinates
        self.first, self.until = first, until
        for _, one in self.system.law_calls:
            one.begin()
        self.rows = self.system.record_rows
        self.y[:n3], self.y[n3 : 2 * n3] = q, v
        self.y[2 * n3 :] = first_auxiliary_states(self.system, self.start) if own is None else own
        self.record = np.empty((self.rows, 1))
        self.state[TIME] = first
        self.interruptions = Interruptions(self.system, self.work, first, until, self.located)
        self.target = until
        self.passage = BranchPassage(
            self.system, bool(self.regularization), self.state, until - first
        )
        closes = self.evaluate()
        if closes and own is None and find_steady(self):
            self.evaluate()
        if not closes:
            raise SolveError(
                f"the start does not fit '{self.system.mechanism.name}': its loops do not close "
                "near it; give a motion of this mechanism, or its own guesses"
            )
        problem = undetermined(self.system, first, self.y[:n3], self.y[n3 : 2 * n3])
        problem = problem or weightless(self.system)
        if problem is not None:
            raise problem
        whole = np.concatenate([q, v])
        self.notes = adjusted(self.system, whole, self.y[: 2 * n3], until - first)
        if self.regularization:
            self.notes += branching(self.system, first, self.y[:n3], self.y[n3 : 2 * n3])
        self.check_finite(first)
        self.passage.first_position = self.y[:n3].copy()
        own = auxiliary_sizes(self.system)
        sizes = coordinate_sizes(self.system, v, self.K[0, n3 : 2 * n3])
        self.scale[:] = np.concatenate([sizes, own])
        # powers are rounded, also where no work is done: to a part of the energy at these rates
        energy = float(self.work.mass[:n3, 0] @ sizes[n3:] ** 2)
        self.state[THROUGHPUT] = tol.ENERGY_ROUNDING_STEP * energy / self.settings.rtol
        self._begin_steps()
        self.step_reference, self.longest = (0.0, first), 0.0

    def _begin_steps(self) -> None:
        """The length of the first step of a motion that goes on to `until`."""
        whole = self.until - self.first
        self.state[NEXT] = self.settings.step or first_step(
            self.settings, self.y, self.K[0], self.scale, whole
        )
        if self.has_modes and self.swings and not self.steps.fixed:
            # what swings while nothing moves says nothing of how long steps are
            self.state[NEXT] = min(self.state[NEXT], whole / OF_ALL)

    def evaluate(self) -> bool:
        """Project the state, evaluate its derivative and its record; whether the loops close."""
        m = self.motion
        closes = initial_derivative(
            m.layout, m.work, m.stepping, m.tolerances.full_refinements, self.record
        )
        raise_user_error(self.system)
        if self.active is not None:
            self.active.look()
        return bool(closes)

    def _evaluate_anew(self) -> None:
        """`evaluate` of a motion that goes on: the best conditioning is that of all its steps."""
        best = self.state.item(BEST_CONDITIONING)
        self.evaluate()
        self.state[BEST_CONDITIONING] = max(best, self.state.item(BEST_CONDITIONING))

    # -- steps ---------------------------------------------------------------------------------

    def _take_steps(self, until: float, count: int, outputs: Outputs, locates: bool = True) -> int:
        """At most so many steps towards a time; a code of `mbody.kernels.step_state`. `locates`:
        whether zeros of what is watched are located, and the record kept of where steps end.
        """
        changed, self.inputs_changed = self.inputs_changed, False
        if (active := self.active) is not None:
            code = active.steps(until, count, outputs, locates, changed)
            self.inputs_changed = active.beyond
            return code
        m, asked, methods = self.motion, self.asked, self.steps.methods
        asked[0], asked[1], asked[2] = until, count, changed
        return int(
            unwatched_motion(
                m.layout, m.work, methods, m.stepping, m.tolerances, outputs, asked, self.record
            )
        )

    def _advance(self, until: float, steps: int, outputs: Outputs, locates: bool = True) -> int:
        """At most so many steps, and what lies between them; a code as of `_take_steps`."""
        code, left = MORE, steps
        while code == MORE and left > 0:
            done = self.state[STEPS]
            count = 1 if self.passage.open else left
            if until != self.until:  # nothing is kept of what leads to a set time
                self.state[LAST_STEP_ALLOWED] = 1.0
            code = self._take_steps(until, count, outputs, locates)
            left -= max(1, int(self.state[STEPS] - done))
            self.passage.record_crossings(self.y)
            self.passage.check_inertia(self.y)
            if code == BRANCH_UNCERTAIN:
                self.passage.decide(self.y, self.K[0])
                code = MORE
            elif code == LAST_STEP:
                if until == self.until:
                    self.restart_point = self._restart_state(outputs.work[-1])
                self.state[LAST_STEP_ALLOWED] = 1.0
                code, left = MORE, left + 1
        raise_user_error(self.system)
        return code

    def _integrate(self, progress: Callable[[float], None] | None) -> tuple[int, str]:
        """The whole motion, its instants kept: the last code of the kernel, and the status."""
        self.apart = (self.until - self.first) / OF_ALL
        if self.resumed is None and self.active is not None and (status := self.active.begin()):
            return MORE, status
        if self.resumed is None:
            self._keep_first()
        self.total += self.initial_work
        if self.resumed is not None and self.active is not None:
            self.active.log.lost[:] = self.resumed.lost
            self.record = np.array(self.resumed.page)[:, None]
        code, status = self._all_steps(progress)
        return code, status or "completed"

    def _keep_first(self) -> None:
        """Keep the first instant, where it is wanted."""
        if self.wanted[0] <= self.first:
            self.keep(self.first, self.record, self.total)

    def _all_steps(self, progress: Callable[[float], None] | None = None) -> tuple[int, str]:
        """Steps to the last time: the last code of the kernel, and the status of a motion that ends
        before, else nothing.
        """
        code, status = MORE, ""
        while code == MORE and not status:
            code, status = self._step()
            self._check_progress()
            if progress is not None:
                progress(float(self.state[TIME]))
        return (MORE if status else code), status

    def _step(self) -> tuple[int, str]:
        """Steps up to what they meet."""
        t = float(self.state[TIME])
        if self.target <= t < self.until and not self.ending:
            t = self._pass_set_time(t)
        if self.ending or t >= self.until:
            return (MORE, self.ending) if self.ending else (DONE, "")
        code = self._quiet_steps()
        if self.active is not None:
            if code == CROSSED:
                return MORE, self.active.meet()
            if code == ZERO:
                return MORE, self.active.go_on()
            if code == NOT_QUIET:
                return MORE, self.ended(self.active.log.lost_zero)
        return MORE if code == DONE and self.target < self.until else code, ""

    def _quiet_steps(self) -> int:
        """Steps towards the next set time as long as they are quiet, keeping the instants that they
        meet: a code of the kernel. Of what holds in one direction only the forces are met within
        each step.
        """
        t, h, count = float(self.state[TIME]), float(self.state[NEXT]), AT_ONCE
        # a motion that goes on begins before its first instant
        since = max(t, float(self.kept[-1].t[-1])) if self.kept else t
        first, last = np.searchsorted(self.wanted, [since, self.target], side="right")
        marks = wanted = self.wanted[first:last]
        if self.sided:
            count, parts = 1, OF_A_STEP
            if not self.has_modes or (self.active is not None and self.active.events):
                parts = max(parts, math.ceil(h / self.apart))
            within = t + np.arange(1, parts + 1) / parts * h
            marks = np.union1d(wanted, within[within < self.target])
        records, work = self.nothing.pages, np.zeros((len(marks) + 1, self.causes))
        if len(marks):
            records = np.empty((len(marks), self.rows, 1))
        work[-1], self.state[DELIVERED] = self.total, 0.0
        try:
            code = self._advance(self.target, count, Outputs(times=marks, pages=records, work=work))
        finally:
            self.total[:] = work[-1]  # also of steps before Python fails
        met = int(self.state[DELIVERED])
        self.meet_forces(marks[:met], records[:met])
        asked = np.flatnonzero(np.isin(marks[:met], wanted)) if self.sided else np.arange(met)
        if not self.has_modes and len(asked):
            self.kept.append(KeptInstants(marks[asked], records[asked], work[asked]))
            return code
        for n in asked.tolist():
            self.keep(float(marks[n]), records[n], work[n])
        return code

    def ended(self, why: str) -> str:
        """Keep the last instant; the status of a motion that ends there."""
        t, self.restart_point = float(self.state[TIME]), None
        self.keep(t, self.record, self.total)
        return f"ended: at t = {t:.6g} {self.system.mechanism.units.time}, {why}"

    # -- one time after another ----------------------------------------------------------------

    @functools.cached_property
    def guarded(self) -> bool:
        """Whether a step may fail after it was accepted, so that the state must be kept before."""
        return self.has_distances or self.system.has_user_code or self.timed

    @functools.cached_property
    def has_distances(self) -> bool:
        """Whether joints, drivers or couplings are along distances, which may vanish."""
        machine = self.system.mechanism
        elements = (*machine.joints, *machine.drivers, *machine.couplings)
        return any(list(one.distances()) for one in elements)

    @functools.cached_property
    def timed(self) -> bool:
        """Whether there are set times: samples of controllers, corners of laws of time."""
        return bool(self.system.mechanism.controllers or has_corners(self.system))

    @functools.cached_property
    def _blank(self) -> tuple[Array, ...]:
        """Initial memory of the method itself, before its first step."""
        return tuple(part.copy() for part in self.steps.own)

    def regularize(self, regularization: float) -> None:
        """Another proximal term, of redundant rows: zero where there are none."""
        if regularization == self.regularization:
            return
        self.regularization = regularization
        self.stepping = self.stepping.replaced(regularization=regularization)
        self.steps = integrator(self.settings.method, self.layout, self.work, self.settings.step)
        self.motion = self._motion()
        self.__dict__.pop("_probe_memory", None)

    @functools.cached_property
    def free_inputs(self) -> dict[str, int]:
        """Inputs that are set from outside, with the signal row of each: those whose value is a
        number that no controller sets.
        """
        machine, rows = self.system.mechanism, self.system.input_rows
        by_controllers = {name for one in machine.controllers for name in one.sets}
        return {
            one.name: int(row)
            for one, row in zip(machine.inputs, rows, strict=True)
            if one.name not in by_controllers and isinstance(one.value, Constant)
        }

    def free_the_inputs(self) -> np.ndarray:
        """Let the kernels leave the inputs that are set from outside as they are; their values."""
        system, rows = self.system, self.free_inputs
        self.layout = without_hold(system.runtime(), {**hold_inputs(system), **rows})
        self.motion = self._motion()
        laws = {one.name: one.value for one in system.mechanism.inputs}
        values = [input_value(laws[name], name, system, 0.0) for name in rows]
        self.work.signal[list(rows.values()), 0] = values
        return np.array(values, dtype=float)

    def start_at(self, t: float, q: Array, v: Array, own: Array | None = None) -> None:
        """Begin anew, as a motion of `simulate` does; modes are decided anew."""
        self._clear()
        # how long it goes on is not known yet
        self.begin(t, q, v, math.inf, own)
        self.reference = self.record.copy()
        if (active := self.active) is not None:
            self.ending = active.begin()
            active.first_modes = active.log.named_modes()
            first = active.log.shown(t, self.record)
            self.reference, active.first_forces = first.record[:, None].copy(), first.forces

    def place_at(self, t: float, record: Array) -> None:
        """Show an instant (rows,) that no steps have led to, with all contacts open."""
        self._clear()
        if self.active is not None:
            self.active.first_modes = self.active.log.named_modes()
        self.first, self.state[TIME] = t, t
        n, own = 2 * self.system.coordinates, self.system.auxiliary_rows.start
        self.y[:n], self.present_record[:, 0] = record[:n], record
        self.y[n:] = record[own : own + self.system.layout.owns]

    def _clear(self) -> None:
        """Nothing is left of a motion before."""
        for own, blank in zip(self.steps.own, self._blank, strict=True):
            own[:] = blank
        self.state[:] = 0.0
        self.work.near[:] = 0.0
        self.extremes, self.ending, self.inputs_changed = {}, "", False
        self.total[:], self.occurred, self.kept, self.late = 0.0, [], [], False
        if self.active is not None:
            self.active.forget()

    def advance_to(self, until: float, inputs_changed: bool = False) -> str:
        """Go on to exactly this time; the status of a motion that ends before, else nothing.
        `inputs_changed`: since the present derivative was evaluated.

        Raises SolveError as `simulate` does; the state is then the one before the call.
        """
        begins = not self.state.item(STEPS)
        if inputs_changed and begins:
            self.refresh()
        elif inputs_changed:
            self.inputs_changed = True
        if self.ending:
            return self.ending
        if begins:
            self.until = until
            self._begin_steps()
        self.passage.whole, self.apart = until - self.first, math.inf
        if self._one_step(until):
            return ""
        # forces have jumped beyond the modes, or no step was tried
        if self.inputs_changed:
            self.refresh()
        return self.ending or self._advance_in_steps(until)

    def _one_step(self, until: float) -> bool:
        """Go on by one step, if it reaches the end and is quiet."""
        state = self.state
        watched = self.closely or self.sided or (self.watched and self.active is not None)
        if watched or self.guarded or state.item(TIME) + state.item(NEXT) < until:
            return False
        state[LAST_STEP_ALLOWED] = 1.0
        code = self._advance(until, 1, self.nothing, locates=False)
        self.late = self.active is not None
        return code in (MORE, DONE) and state.item(TIME) == until

    def _renew(self) -> None:
        """The record of the present instant."""
        if self.late:
            self.record, self.late = self.instant().copy(), False

    def _advance_in_steps(self, until: float) -> str:
        """Advances to `until` in any number of steps; the state is restored after an error."""
        self._renew()
        saved, self.until = self.snapshot(), until
        self.state[LAST_STEP_ALLOWED] = 1.0
        try:
            return self._steps_to_end()
        except BaseException as error:
            self.go_on_from(saved)
            if isinstance(error, SolveError):
                error.solution = self.now("completed")
            raise

    def _steps_to_end(self) -> str:
        """Steps to `until`, keeping the records of the instants within the call that are monitored;
        the status of a motion that ends before, else nothing.
        """
        t, self.kept = float(self.state[TIME]), []
        one = t + self.state[NEXT] >= self.until
        if not one:
            self.apart = (self.until - t) / OF_ALL
        self.wanted = np.array([self.until]) if self.active is not None else np.empty(0)
        if self.closely or (self.watched and self.active is None):
            self.wanted = np.linspace(t, self.until, (WITHIN if one else AMONG) + 1)[1:]
        self._set_times()
        code, status = self._all_steps()
        if code not in (DONE, MORE):
            raise stopped(self, self.solution(""), code)
        if self.kept and (self.watched or self.closely):
            kept = self._kept_instants()
            self.samples = kept.t, kept.records
        return status

    def _set_times(self) -> None:
        """Interrupts due at the beginning, and the first set time after it."""
        t = float(self.state[TIME])
        self.target = self.until
        if not self.timed:
            return
        self.interruptions.look_until(self.until)
        if not self.state[STEPS] or self.interruptions.due(t):
            self._interrupt(t)
        self.target = min(self.until, self.interruptions.next(t))

    def refresh(self) -> None:
        """The derivative anew, of inputs that have changed; changed forces may end sticking."""
        self.inputs_changed = False
        self._evaluate_anew()
        self.state[JACOBIAN_VALID] = 0.0
        self.steps.jumped()
        self.late = False
        self.ending = "" if self.active is None else self.active.settle_jump()

    # -- set times -----------------------------------------------------------------------------

    def _interrupt(self, t: float) -> None:
        """Do what is due at a set time, and find the next one."""
        if (corner := self.interruptions.jump_after(t)) is not None:
            self._pass_jump(corner)
            t = corner
        if self.interruptions.sampled or self.interruptions.tables:
            self._evaluate_anew()
            if self.interruptions.at(t, self._read):
                self._evaluate_anew()
                self.check_finite(t)
                self.steps.jumped()
        self.target = min(self.until, self.interruptions.next(t))
        active = self.active
        if active is not None and active.guard_table.count[0] and not self.ending:
            self.ending = active.settle_jump()  # the first modes follow later

    def _pass_set_time(self, t: float) -> float:
        """Do what is due at a set time, or just after it where rates of drivers jump; the time from
        which it goes on.
        """
        self._interrupt(t)
        now = float(self.state[TIME])
        if now > t and now in self.wanted:
            record = self.instant().copy() if self.active is None else self.record
            self.keep(now, record, self.total)
        if now >= self.until:
            self.restart_point = self._restart_state(self.total)
        return now

    def _read(self, controller: Controller, inputs_differ: bool) -> list[float]:
        """Measured values that a controller reads at the present instant, evaluated anew where
        inputs changed.
        """
        if inputs_differ:
            self.evaluate()
        return self._readings.of(controller)

    @functools.cached_property
    def _readings(self) -> ControllerReadings:
        return ControllerReadings(
            self.system, self.y, self.state, self._present_record, self.regularization
        )

    def _present_record(self) -> Array:
        """The record (rows, 1) of the present instant, as it is read."""
        if self.active is None:
            return self.record
        shown = self.active.log.shown(float(self.state[TIME]), self.record)
        return shown.record[:, None]

    def _pass_jump(self, corner: float) -> None:
        """Go from just before a time to it: velocities jump with the rates of the drivers."""
        work, n = self.work, self.system.coordinates
        work.q[:n, 0], v = self.y[:n], self.y[n : 2 * n].copy()
        before, after = (self._prescribed(t) for t in (float(self.state[TIME]), corner))
        self.state[TIME] = corner
        size = max(np.abs(before).max(initial=0.0), np.abs(after).max(initial=0.0))
        if not np.abs(after - before).max(initial=0.0) > tol.RATE_JUMP_SAME * size:
            return
        if self.active is not None and self.has_modes:
            # what jerks moves what touches by impacts, not by rows that hold
            self.active.switch_off()
        self.evaluate()
        self.check_finite(corner)
        work.q[:n, 0] = self.y[:n]
        mass, jump = self.system.mass[:n, 0], self.y[n : 2 * n] - v
        works = works_of_drivers(self.system, work, mass * jump, 0.5 * (before + after))
        for name, part in works.items():
            self.total[causes(self.system).index(name)] += part
        doubt = jump_doubt(self.system, corner, gain_of_jump(mass, v, jump), works)
        self.passage.doubts += (doubt,) if doubt else ()
        self.state[JACOBIAN_VALID] = 0.0
        self.steps.jumped()
        if self.active is not None and self.has_modes:
            # impacts of what the driver moves towards each other; what it moves apart opens
            self.active.close_what_drivers_press()
            self.ending = self.active.settle()

    def _prescribed(self, t: float) -> Array:
        """ν of every row at a time, the position being in the workspace; lengths by the model
        length.
        """
        self.work.time[0, 0] = t
        laws_of_time(self.layout, self.work)
        violation(self.layout, self.work)
        return dense_rates(self.system, self.work)

    def _check_progress(self) -> None:
        """Refuse to go on where loads that jump to and fro keep steps short for ever, or where a
        distance has become zero.
        """
        n, unit = self.system.coordinates, self.system.mechanism.units.time
        if self.has_distances:
            when = f"t = {self.state[TIME]:.6g} {unit}"
            gone = vanishing(self.system, self.y[:n], when, tol.DISTANCE_LOST)
            if gone is not None:
                gone.solution = self.solution("")
                raise gone
        (count, since), (done, t) = self.step_reference, (self.state[STEPS], self.state[TIME])
        if done - count < JUDGED:
            return
        mean = float(t - since) / float(done - count)
        self.step_reference, self.longest = (float(done), float(t)), max(self.longest, mean)
        left = (self.until - t) / max(mean, tol.TINY)
        rate = float(np.abs(self.y[n : 2 * n] / self.scale[:n]).max())
        rate = max(rate, float(np.sqrt(np.abs(self.K[0, n : 2 * n] / self.scale[:n]).max())))
        if (
            mean < tol.STEP_COLLAPSE_SHRUNK * self.longest
            and mean * rate < tol.STEP_COLLAPSE_SLOW
            and left > PATIENT
        ):
            raise no_progress(self, mean, left, JUDGED)

    # -- restarts -----------------------------------------------------------------------------

    def _restart_state(self, work_done: Array) -> Restart:
        """All that the next step depends on; `work_done` since the beginning. With modes the first
        one before the end counts: what happens in a step that ends there happens again, in the
        whole of it.
        """
        if self.has_modes and self.before_end is not None:
            return self.before_end
        found = Restart(
            settings=self.settings,
            scale=self.scale.copy(),
            y=self.y.copy(),
            slope=self.K[0].copy(),
            powers=self.P[0].copy(),
            gained=work_done.copy(),
            state=self.state.copy(),
            own=tuple(part.copy() for part in self.steps.own),
            inputs=self.interruptions.inputs(),
            sampled=tuple(one.copied() for one in self.interruptions.sampled),
            met=packed_positions(self.passage.met),
        )
        if self.active is not None and self.has_modes:
            found = replace(found, modal=self.active.modal_state())
            self.before_end = found
        return found

    def _resume(self, restart: Restart) -> None:
        """Continue from a restart state."""
        modal, active = restart.modal, self.active
        if modal is not None and active is not None:
            # the first instant is the last one before; steps go on from before that
            active.set_modes(modal.end)
            self.evaluate()
            self._keep_first()
            active.resume(modal)
        self.y[:], self.state[TIME] = restart.y, restart.state[TIME]
        self.interruptions.restore(restart.inputs, restart.sampled)
        record = self.record.copy()
        # for the distances from singular positions with which the next step begins
        self.evaluate()
        self.record = record
        self._take(restart)
        if self.state[NEXT] <= tol.TIME_STEP_SHORTEST_REJECTED * abs(self.until):
            self._begin_steps()  # that of a motion that was hardly any
        self.initial_work[:] = restart.gained
        if active is not None:
            active.resume_guards(modal)
            self.resumed = modal

    def _take(self, restart: Restart) -> None:
        """Set all that the next step depends on, the work but."""
        self.passage.met = unpacked_positions(self.system, restart.met)
        self.scale[:] = restart.scale
        self.y[:], self.K[0], self.P[0] = restart.y, restart.slope, restart.powers
        self.state[:] = restart.state
        self.state[DELIVERED] = 0.0
        self.step_reference = float(self.state[STEPS]), float(self.state[TIME])
        for own, part in zip(self.steps.own, restart.own, strict=True):
            own[:] = part

    def _restart(self, work_done: Array) -> Restart | None:
        """Where to continue, with the work, and what contacts took, since the last instant that was
        kept.
        """
        found = self.restart_point
        if found is None or not len(work_done):
            return None
        found = replace(found, gained=found.gained - work_done[-1, : self.causes])
        if not self.has_modes:
            return found
        if found.modal is None:
            return None
        lost = tuple((np.array(found.modal.lost) - work_done[-1, self.causes :]).tolist())
        assert self.active is not None
        modal = replace(found.modal, lost=lost, end=self.active.active_set())
        return replace(found, modal=modal)

    def snapshot(self) -> Checkpoint:
        """A copy of all that the next step depends on."""
        self._renew()
        self.before_end = None  # that of the present state
        return Checkpoint(
            restart=self._restart_state(self.total),
            regularization=self.regularization,
            near=self.work.near.copy(),
            passage=self.passage.known,
            first=self.first,
            reference=self.reference,
            record=self.record.copy(),
            extremes=dict(self.extremes),
            modes=None if self.active is None else self.active.contact_modes(),
        )

    def go_on_from(self, given: Checkpoint) -> None:
        """Go on from there; later events are dropped."""
        self.regularize(given.regularization)
        self._take(given.restart)
        self.interruptions.go_on_from(given.restart.inputs, given.restart.sampled)
        self.total[:] = given.restart.gained
        self.work.near[:] = given.near
        self.passage.known = given.passage
        self.first, self.reference, self.record = given.first, given.reference, given.record.copy()
        self.extremes, self.late, self.kept = dict(given.extremes), False, []
        self.ending, self.inputs_changed = "", False
        if self.active is not None:
            assert given.modes is not None
            self._forget_later_events(float(self.state[TIME]))
            self.active.take_modes(given.modes)

    def unfit(self, given: Checkpoint, inputs: Array) -> str:
        """Why a motion of this system cannot go on from there, with these inputs; else nothing."""
        active, modes = self.active, given.modes
        if active is not None:
            if modes is None or not active.fits(modes):
                return "is of another mechanism, with other contacts"
            before = active.contact_modes(), self.ending
            active.take_modes(modes)
        try:
            return unfit_checkpoint(self, given, inputs)
        finally:
            if active is not None:
                active.take_modes(before[0])
                self.ending = before[1]

    # -- records -------------------------------------------------------------------------------

    @functools.cached_property
    def _probe_memory(self) -> tuple[Work, Stepping]:
        """Memory in which an instant is evaluated beside the motion."""
        memory = stepping(self.system.state_count, self.causes, self.regularization)
        return self.system.work(masses=True), memory

    @functools.cached_property
    def present_record(self) -> Array:
        """Record of an instant, (rows, 1): see `instant`."""
        return np.zeros((self.system.record_rows, 1))

    def instant(
        self, inputs: Array | None = None, input_values: Mapping[str, float] | None = None
    ) -> Array:
        """Record of the present instant, (rows, 1), with the present inputs or with others, set
        from outside or `input_values` between set times, in the present modes, its forces
        admissible; the motion is left unchanged.
        """
        (work, memory), record, active = self._probe_memory, self.present_record, self.active
        if active is not None:
            for part, own in zip(active.rows_of(work), active.rows_of(self.work), strict=True):
                part[:] = own
        memory.y[:] = self.y
        memory.state[TIME] = self.state[TIME]
        work.signal[:] = self.work.signal
        if inputs is not None:
            work.signal[list(self.free_inputs.values()), 0] = inputs
        for name, value in (input_values or {}).items():
            work.signal[self.interruptions.hold[name], 0] = value
        initial_derivative(self.layout, work, memory, REFINEMENTS, record)
        raise_user_error(self.system)
        if active is not None:
            shown = active.log.shown(float(self.state[TIME]), record)
            record[:, 0], active.present_forces = shown.record, shown.forces
        return record

    def now(self, status: str) -> Solution:
        """The first and the present instant as a result."""
        return self.solution(status, self._ends(self.instant()))

    def _ends(self, record: Array) -> KeptInstants:
        """The first instant, and the present one of this record, if it is another one."""
        t, active = float(self.state[TIME]), self.active
        count = 1 if t == self.first else 2
        times, records = np.array([self.first, t]), np.array([self.reference, record])
        works = np.zeros((2, self.causes + len(self.stops)))
        works[1, : self.causes] = self.total
        found = KeptInstants(times[:count], records[:count], works[:count])
        if active is None:
            return found
        works[1, self.causes :] = active.log.lost
        modes = active.first_modes, active.log.named_modes()
        forces = active.first_forces, active.present_forces
        return replace(found, modes=modes[:count], forces=forces[:count])

    @property
    def named_modes(self) -> dict[str, str]:
        """Present modes of contacts and frictional joints, by name."""
        return {} if self.active is None else self.active.log.named_modes()

    @property
    def open_forces(self) -> SharedResult | None:
        """Admissible forces of the present instant, which was evaluated; None where they are
        determined.
        """
        active = self.active
        return None if active is None else active.log.shared_result(active.present_forces)

    def meet(self, name: str, forces: OneSidedForce) -> None:
        """Take forces of a contact or a rope into its extremes, and the first of wrong sign."""
        self.extremes[name] = extremes(forces, self.extremes.get(name))

    def meet_forces(self, marks: Array, records: Array) -> None:
        """Take forces of contacts and ropes over a step into their extremes, within the output
        instants.
        """
        if not self.sided or not len(self.wanted):
            return
        inside = (marks >= self.wanted[0]) & (marks <= self.wanted[-1])
        if not inside.any():
            return
        run = solution_of_records(self.system, marks[inside], records[inside])
        for one in self.sided:
            self.meet(one.name, one_sided_force(run, one))

    def keep(self, t: float, record: Array, work: Array) -> None:
        """Keep an instant; once, the last state of it."""
        if self.kept and self.kept[-1].t[-1] == t:
            last = self.kept.pop().but_last
            self.kept += [last] if len(last.t) else []
        found = KeptInstants(np.array([t]), record[None].copy(), work[None].copy())
        if self.active is not None and self.has_modes:
            shown, lost = self.active.log.shown(t, record), self.active.log.lost
            found = KeptInstants(
                found.t,
                shown.record[None, :, None].copy(),
                np.concatenate([work, lost])[None],
                (self.active.log.present_names,),
                (shown.forces,),
            )
        self.kept.append(found)

    def _kept_instants(self) -> KeptInstants:
        """The instants that are kept."""
        return joined_instants(self.kept, self.rows, self.causes + len(self.stops))

    def _keep_now(self) -> None:
        """Keep the instant that a motion has reached, to continue from there."""
        if not self.state[STEPS]:
            return
        t = float(self.state[TIME])
        self.restart_point = None if self.stops else self._restart_state(self.total)
        self.evaluate()
        self.keep(t, self.record, self.total)
        self._forget_later_events(t)

    def _forget_later_events(self, t: float) -> None:
        """What lies in a step that is not made yet is met again."""
        self.occurred = [one for one in self.occurred if one.t <= t]
        if self.active is not None:
            self.active.guard_table.seen[:] = -1.0

    def check_finite(self, t: float) -> None:
        """Refuse to go on where the derivative has no values."""
        if np.isfinite(self.K[0]).all():
            return
        n = self.system.coordinates
        raise valueless(self.system, self.work, t, self.y[:n], self.y[n : 2 * n])

    def solution(self, status: str, kept: KeptInstants | None = None) -> Solution:
        """The motion as a result, by default with the instants that are kept: with modes, shared
        forces, and notes on contacts and events.
        """
        n, state = self.system.coordinates, self.state
        kept = kept or self._kept_instants()
        times, output, work_done = kept.t, kept.records, kept.works
        found = Solution(
            system=self.system,
            analysis="simulate",
            t=times,
            record=Record([output], len(times), batch=False),
            given=None,
            regularization=self.regularization,
            dependencies=open_along(self.system, output[:, :n, 0]) if self.regularization else None,
            notes=reported_certificate(self.start).notes
            if self.start.analysis == "close_loops"
            else (),
            status=status,
            stats=step_counts(state),
            energy=account(self.system, output[:, :, 0], work_done, self.stops),
            events=tuple(self.occurred),
            restart=self._restart(work_done),
        )
        last = float(times[-1]) if len(times) else self.first
        notes = (*reported_certificate(found).notes, *self.notes, *self.passage.notes(last))
        if may_be_one_sided(self.system.mechanism):
            notes += tuple(pulled(found, self.extremes))
        notes += limited_instants(int(state[LIMITED_INSTANTS]))
        notes += unresolved_states(found)
        if self.regularization:
            notes += open_note(found.dependencies)
        found = with_fields(found, notes=notes, branch=self.passage.least(last))
        found = doubted(found, self.passage.doubts)
        if (active := self.active) is None:
            return found
        notes = reported_certificate(found).notes
        notes = (*notes, *active.fast_events(), *active.log.notes_of())
        names = {name: [each[name] for each in kept.modes] for name in active.log.named_modes()}
        shared = active.log.shared_result(*kept.forces)
        found = with_fields(found, notes=notes, modes=names, shared=shared)
        return doubted(found, inadmissible(found))
