"""Time integration of one motion: memory and calls of the integrator, and its result."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mbody.analysis.contact.systems_with_modes import refuse_modes
from mbody.analysis.driven.contact_report import OneSidedForce
from mbody.analysis.driven.diagnosis import (
    adjusted,
    branching,
    open_along,
    open_note,
    stuck,
    undetermined,
    valueless,
    weightless,
)
from mbody.analysis.driven.time_grid import check_law_ranges
from mbody.analysis.dynamics.branch_passage import BranchPassage, KnownCrossings
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
    refuse_auxiliary_states,
    stepping,
    unresolved_states,
)
from mbody.analysis.dynamics.interruptions import (
    Interruptions,
    SampledState,
    has_corners,
    hold_inputs,
    input_value,
    without_hold,
    works_of_drivers,
)
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.closed_position import vanishing
from mbody.analysis.singular.nearby_singularity import packed_positions, unpacked_positions
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import Work, artificial_masses
from mbody.kernels.loop_closure import laws_of_time, violation
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    BRANCH_UNCERTAIN,
    DELIVERED,
    DONE,
    EVALUATIONS,
    JACOBIAN_VALID,
    JACOBIANS,
    LAST_STEP,
    LAST_STEP_ALLOWED,
    LIMITED_INSTANTS,
    MORE,
    NEAR_SINGULAR_STEPS,
    NEXT,
    REJECTED,
    STEPS,
    STIFF,
    THROUGHPUT,
    TIME,
    Outputs,
    Stepping,
    Tolerances,
)
from mbody.laws import Constant
from mbody.model.closed_mechanism import may_be_one_sided
from mbody.model.element import listed
from mbody.model.inputs import Controller
from mbody.model.simulation import EVEN
from mbody.solution.doubts import Doubt, doubted
from mbody.solution.energy import account, causes, gain_of_jump
from mbody.solution.histories import EventRecord, Record, reported_certificate, with_fields
from mbody.solution.solution import IntegrationSettings, Restart, Solution
from mbody.solution.traced_instant import Present, Read
from mbody.system.rank import dense_rates
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.solution.shared_forces import ForceSet, SharedResult

# -- Readings of controllers: measures compiled when they are first read -----------------------

Array = np.ndarray


def solution_of_records(
    system: System, t: Array, records: Array, regularization: float = 0.0
) -> Solution:
    """Records (instants, rows, 1) of a motion at times (instants,) as a result, without what the
    motion says beside them.
    """
    kept = Record([records], len(t), batch=False)
    return Solution(system, "simulate", t, kept, None, regularization=regularization)


class ControllerReadings:
    """Readings of the present instant of a motion."""

    def __init__(
        self,
        system: System,
        y: Array,
        state: Array,
        record: Callable[[], Array],
        regularization: float,
    ) -> None:
        self.system, self.state, self.record = system, state, record
        self.regularization = regularization
        slots = memoryview(state.data)
        self.present = Present(
            system, memoryview(y.data), slots, lambda: memoryview(record().reshape(-1).data)
        )
        self._readers: dict[str, list[Read]] = {}

    def of(self, controller: Controller) -> list[float]:
        """Measured values that a controller reads at the present instant."""
        found = self._readers.get(controller.name)
        if found is None:
            measure = self.present.measure
            found = [measure(text, self._instant) for text in controller.reads]
            self._readers[controller.name] = found
        return [read() for read in found]

    def _instant(self) -> Solution:
        """The present instant as a result."""
        t, records = np.array([self.state[TIME]]), self.record()[None].copy()
        return solution_of_records(self.system, t, records, self.regularization)


#: Steps of one call of the kernel; between calls progress is shown and Ctrl-C takes effect.
AT_ONCE = 500
#: Of so many steps the mean is compared with the greatest; where `PATIENT` steps are still to go,
#: the step size may collapse.
JUDGED = 10_000


@dataclass(frozen=True, eq=False)
class ContactModes:
    """Contact modes of a checkpoint: what a motion with contacts needs besides its state.

    `first`: Mode of every contact and frictional joint when the motion began, by name.
    `rows`: Which rows are on, with what depends on it, their anchors, slip signs of sliding, and
      the numbers of the rows, among which are the phases of circles that stick.
    `tables`: Modes, who leads what sticks, what is closed and what has left its edge, when contact
      points were struck last, what is rounding of guards, whose forces no equation decides, when
      modes changed last and how often then.
    `lost` (contacts,): Energy that impacts of each took.
    """

    first: dict[str, str]
    rows: tuple[Array, ...]
    tables: tuple[Array, ...]
    notes: tuple[str, ...]
    lost: Array
    #: Admissible forces of the first instant.
    forces: ForceSet | None = None


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """All that the next step depends on.

    `restart`: The state of the integrator, and the work since the reference.
    `regularization`: Of redundant rows.
    `near`: Distances from singular positions at the beginning of the step.
    `passage`: Singular positions ahead, those behind, doubts, and positions that were met.
    `reference`, `record` (rows, 1): When the motion began, what is kept of that instant (see
      `mbody.kernels.layout`), and of the present one.
    `extremes`: Of contacts and ropes the least force and the largest by size.
    `modes`: What is open, sticks and slides.
    """

    restart: Restart
    regularization: float
    near: Array
    passage: KnownCrossings
    first: float
    reference: Array
    record: Array
    extremes: dict[str, OneSidedForce]
    modes: ContactModes | None = None


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


#: Instants within a call at which it is monitored: of one step, and of many.
WITHIN, AMONG = 8, 200


class Integration:
    """The motion of one system from a first state on: to the end, as `simulate` asks, or to one
    time after another.

    A call of `advance_to` that one step covers is one call of the kernel, which leaves the state as
    it was where it rejects the step; longer ones go back to where they began where they fail.
    """

    #: Whether it decides what is open, sticks and slides.
    decides_modes = False
    #: Whether the instants within calls of many steps are kept in `samples`, times and records; and
    #: those within each call.
    watched = closely = False
    samples: tuple[Array, Array] | None = None
    #: Whether explicit steps vanished, for a reason that is not known.
    vanished = False
    #: Whether it locates jumps in formulas itself.
    located = False
    integrator = staticmethod(integrator)

    def __init__(self, system: System, start: Solution, settings: IntegrationSettings) -> None:
        self.system, self.start, self.settings = system, start, settings
        refuse_auxiliary_states(system, settings.method)
        if not self.decides_modes:
            refuse_modes(system, "stepping without events of contacts")
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
        self.motion = self._motion()
        self.initial_work = np.zeros(self.causes)
        self.restart_point: Restart | None = None
        self.step_reference, self.longest = (0.0, 0.0), 0.0
        self.occurred: list[EventRecord] = []
        self.stops: list[str] = []
        #: Of contacts and ropes the least force, the largest by size, and the first of wrong sign.
        self.extremes: dict[str, OneSidedForce] = {}
        #: The first instant as it is shown, and what is kept of the motion.
        self.reference, self.outputs = np.empty((0, 1)), self._no_outputs()

    def _motion(self) -> Motion:
        """All that the kernel works on."""
        # a small mass replaces a missing one: refinement takes its effect back
        light = artificial_masses(self.layout, self.system.mass, self.system.sizes).any()
        tolerances = Tolerances(
            relative=self.settings.rtol,
            absolute=self.settings.atol,
            refinements=REFINEMENTS if light or self.regularization else 0,
            full_refinements=REFINEMENTS,
            patience=PATIENT,
        )
        return Motion(self.layout, self.work, self.stepping, tolerances)

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
        code, status = MORE, "completed"
        if carried is not None:
            self.interruptions.restore(*carried)
        if restart is not None:
            self._resume(restart)
        try:
            if restart is None and self.interruptions.any:
                self._interrupt(first)
            self.target = min(self.until, self.interruptions.next(float(self.state[TIME])))
            code, status = self._integrate(times, progress)
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
            raise self.stopped(found, code)
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
        self._check_finite(self.K, first)
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

    def evaluate(self) -> bool:
        """Project the state, evaluate its derivative and its record; whether the loops close."""
        m = self.motion
        closes = initial_derivative(
            m.layout, m.work, m.stepping, m.tolerances.full_refinements, self.record
        )
        raise_user_error(self.system)
        return bool(closes)

    def _take_steps(self, until: float, count: int, outputs: Outputs) -> int:
        """At most so many steps towards a time; a code of `mbody.kernels.step_state`."""
        return self.steps.steps(self.motion, until, count, outputs)

    def _advance(self, until: float, steps: int, outputs: Outputs) -> int:
        """At most so many steps, and what lies between them; a code as of `_take_steps`."""
        code, left = MORE, steps
        while code == MORE and left > 0:
            done = self.state[STEPS]
            count = 1 if self.passage.open else left
            if until != self.until:  # nothing is kept of what leads to a set time
                self.state[LAST_STEP_ALLOWED] = 1.0
            code = self._take_steps(until, count, outputs)
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

    def _integrate(self, times: Array, progress: Callable[[float], None] | None) -> tuple[int, str]:
        """The whole motion, its instants kept: the last code of the kernel, and the status."""
        records = np.empty((len(times), self.rows, 1))
        work = np.zeros((len(times) + 1, self.causes))
        work[-1] = self.initial_work
        if times[0] <= self.first:
            records[0], self.state[DELIVERED] = self.record, 1.0
        self.outputs = Outputs(times=times, pages=records, work=work)
        code, status = self._all_steps(progress)
        return code, status or "completed"

    def _all_steps(self, progress: Callable[[float], None] | None = None) -> tuple[int, str]:
        """Steps to the last time: the last code of the kernel, and the status of a motion that ends
        before, else nothing.
        """
        code = MORE
        while code == MORE:
            code = self._advance(self.target, AT_ONCE, self.outputs)
            if code == DONE and self.target < self.until:
                self._interrupt(self.target)
                code = MORE
                if len(self.outputs.times) and self.state[TIME] >= self.until:
                    self._keep_now()  # rates of drivers jumped at the very end
            self._check_progress()
            if progress is not None:
                progress(float(self.state[TIME]))
        return code, ""

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
        self.motion = self._motion()
        self.steps = integrator(self.settings.method, self.layout, self.work, self.settings.step)
        self.__dict__.pop("_probe_memory", None)

    @functools.cached_property
    def free_inputs(self) -> dict[str, int]:
        """Inputs that are set from outside, with the signal row of each: those whose value is a
        number that no controller sets.
        """
        machine, rows = self.system.mechanism, self.system.layout.input_row
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
        """Begin anew, as a motion of `simulate` does."""
        self._clear()
        # how long it goes on is not known yet
        self.begin(t, q, v, math.inf, own)
        self.reference = self.record.copy()

    def place_at(self, t: float, record: Array) -> None:
        """Show an instant (rows,) that no steps have led to."""
        self._clear()
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
        self.extremes, self.outputs = {}, self._no_outputs()

    def _no_outputs(self) -> Outputs:
        """None but the work since the beginning."""
        records, work = np.empty((0, self.system.record_rows, 1)), np.zeros((1, self.causes))
        return Outputs(times=np.empty(0), pages=records, work=work)

    def advance_to(self, until: float, inputs_changed: bool = False) -> str:
        """Go on to exactly this time; the status of a motion that ends before, else nothing.
        `inputs_changed`: since the present derivative was evaluated.

        Raises SolveError as `simulate` does; the state is then the one before the call.
        """
        state = self.state
        if inputs_changed:
            self.refresh()
        if not state.item(STEPS):
            self.until = until
            self._begin_steps()
        self.passage.whole = until - self.first
        if not (self.guarded or self.closely) and state.item(TIME) + state.item(NEXT) >= until:
            state[LAST_STEP_ALLOWED] = 1.0
            code = self._advance(until, 1, self.outputs)
            if code in (MORE, DONE) and state.item(TIME) == until:
                return ""
        return self._advance_in_steps(until)

    def _advance_in_steps(self, until: float) -> str:
        """Advances to `until` in any number of steps; the state is restored after an error."""
        saved, self.until = self.snapshot(), until
        self.state[LAST_STEP_ALLOWED] = 1.0
        try:
            watched = self.watched or self.closely
            return self._watched_steps() if watched else self._steps_to_end()
        except BaseException as error:
            self.go_on_from(saved)
            if isinstance(error, SolveError):
                error.solution = self.now("completed")
            raise

    def _instants(self) -> Array:
        """Times within a call, its end included, at which it is monitored."""
        t = float(self.state[TIME])
        count = WITHIN if t + self.state[NEXT] >= self.until else AMONG
        return np.linspace(t, self.until, count + 1)[1:]

    def _watched_steps(self) -> str:
        """Advances to `until` and keeps the records of the instants within the call."""
        times, gained = self._instants(), self._gained.copy()
        records = np.empty((len(times), self.rows, 1))
        work = np.zeros((len(times) + 1, self.causes))
        work[-1], self.state[DELIVERED] = gained, 0.0
        self.outputs = Outputs(times=times, pages=records, work=work)
        try:
            status = self._steps_to_end()
            kept = self._kept_instants()
            self.samples = kept.t, kept.records
        finally:
            gained = self._gained.copy()
            self.outputs = self._no_outputs()
            self._gained[:] = gained
        return status

    def _steps_to_end(self) -> str:
        """Steps to `until`; the status of a motion that ends before, else nothing."""
        self._set_times()
        code, status = self._all_steps()
        if code not in (DONE, MORE):
            raise self.stopped(self.solution(""), code)
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
        """The derivative anew, of inputs that have changed."""
        state = self.state
        best = state.item(BEST_CONDITIONING)
        self.evaluate()
        state[BEST_CONDITIONING] = max(best, state.item(BEST_CONDITIONING))
        state[JACOBIAN_VALID] = 0.0
        self.steps.jumped(self.motion)

    # -- set times -----------------------------------------------------------------------------

    def _interrupt(self, t: float) -> None:
        """Do what is due at a set time, and find the next one."""
        best = float(self.state[BEST_CONDITIONING])
        if (corner := self.interruptions.jump_after(t)) is not None:
            self._pass_jump(corner)
            t = corner
        if self.interruptions.sampled or self.interruptions.tables:
            self.evaluate()
            if self.interruptions.at(t, self._read):
                self.evaluate()
                self._check_finite(self.K, t)
                self.steps.jumped(self.motion)
            self.state[BEST_CONDITIONING] = max(self.state[BEST_CONDITIONING], best)
        self.target = min(self.until, self.interruptions.next(t))

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
        return self.record

    def _pass_jump(self, corner: float) -> None:
        """Go from just before a time to it: velocities jump with the rates of the drivers."""
        work, n = self.work, self.system.coordinates
        work.q[:n, 0], v = self.y[:n], self.y[n : 2 * n].copy()
        before, after = (self._prescribed(t) for t in (float(self.state[TIME]), corner))
        self.state[TIME] = corner
        size = max(np.abs(before).max(initial=0.0), np.abs(after).max(initial=0.0))
        if not np.abs(after - before).max(initial=0.0) > tol.RATE_JUMP_SAME * size:
            return
        self._loosen()
        self.evaluate()
        self._check_finite(self.K, corner)
        work.q[:n, 0] = self.y[:n]
        mass, jump = self.system.mass[:n, 0], self.y[n : 2 * n] - v
        works = works_of_drivers(self.system, work, mass * jump, 0.5 * (before + after))
        self._give(works)
        self._check_jump(corner, *gain_of_jump(mass, v, jump), works)
        self.state[JACOBIAN_VALID] = 0.0
        self.steps.jumped(self.motion)
        self._settle_jump()

    def _check_jump(
        self, t: float, gained: float, rounding: float, works: Mapping[str, float]
    ) -> None:
        """A doubt where a jump of velocities changes the energy by more or less than drivers do."""
        given = sum(works.values())
        allowed = rounding + tol.ENERGY_IMPACT * sum(map(abs, works.values()))
        if abs(gained - given) <= allowed:
            return
        units = self.system.mechanism.units
        energy = units.of("torque")
        message = (
            f"at t = {t:.6g} {units.time} rates of drivers jump, which changes the energy by "
            f"{gained:.3g} {energy}, their impulses by {given:.3g} {energy}: do not rely on the "
            "motion from there on, and look at bodies without mass or inertia"
        )
        self.passage.doubts += (Doubt("energy", message, t, tuple(works)),)

    def _prescribed(self, t: float) -> Array:
        """ν of every row at a time, the position being in the workspace; lengths by the model
        length.
        """
        self.work.time[0, 0] = t
        laws_of_time(self.layout, self.work)
        violation(self.layout, self.work)
        return dense_rates(self.system, self.work)

    def _loosen(self) -> None:
        """Releases contact constraints before a jump of driver rates; nothing without contacts."""

    def _settle_jump(self) -> None:
        """Impacts and openings that follow from a jump of driver rates; none without contacts."""

    def _give(self, works: Mapping[str, float]) -> None:
        """Add what drivers gave at one instant to the work since the beginning."""
        names, gained = causes(self.system), self._gained
        for name, part in works.items():
            gained[names.index(name)] += part

    @property
    def _gained(self) -> Array:
        """Work of every cause since the beginning, in place."""
        return np.asarray(self.outputs.work[-1])

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
            raise SolveError(
                f"the loads jump to and fro at t = {t:.6g} {unit}: the last {JUDGED} steps were "
                f"{mean:.1g} {unit} each, the end would take {left:.1g} more; smooth what jumps, "
                "as dry friction and valves do where rates change their sign",
                solution=self.solution(""),
            )

    # -- restarts -----------------------------------------------------------------------------

    def _restart_state(self, work_done: Array) -> Restart:
        """All that the next step depends on; `work_done` since the beginning."""
        return Restart(
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

    def _resume(self, restart: Restart) -> None:
        """Continue from a restart state."""
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
        """Where to continue, with the work since the last instant that was kept."""
        if self.restart_point is None or not len(work_done):
            return None
        return replace(
            self.restart_point, gained=self.restart_point.gained - work_done[-1, : self.causes]
        )

    def snapshot(self) -> Checkpoint:
        """A copy of all that the next step depends on."""
        return Checkpoint(
            restart=self._restart_state(self._gained),
            regularization=self.regularization,
            near=self.work.near.copy(),
            passage=self.passage.known,
            first=self.first,
            reference=self.reference,
            record=self.record.copy(),
            extremes=dict(self.extremes),
        )

    def go_on_from(self, given: Checkpoint) -> None:
        """Go on from there."""
        self.regularize(given.regularization)
        self._take(given.restart)
        self.interruptions.go_on_from(given.restart.inputs, given.restart.sampled)
        self._gained[:] = given.restart.gained
        self.work.near[:] = given.near
        self.passage.known = given.passage
        self.first, self.reference, self.record = given.first, given.reference, given.record.copy()
        self.extremes = dict(given.extremes)

    def unfit(self, given: Checkpoint, inputs: Array) -> str:
        """Why a motion of this system cannot go on from there, with these inputs; else nothing."""
        restart, n = given.restart, self.system.coordinates
        sampled = [one.controller.name for one in restart.sampled]
        if sampled != [one.name for one in self.system.mechanism.controllers]:
            return "is of another mechanism, with other controllers"
        parts = (restart.y, restart.gained, given.reference, given.near)
        mine = (self.y, self._gained, self.present_record, self.work.near)
        if [part.shape for part in parts] != [part.shape for part in mine]:
            return "is of another mechanism, with other elements"
        before, t = self.y.copy(), float(self.state[TIME])
        self.y[:], self.state[TIME] = restart.y, restart.state[TIME]
        try:
            a = self.instant(inputs, restart.inputs)[2 * n : 3 * n, 0]
        finally:
            self.y[:], self.state[TIME] = before, t
        off = np.abs((a - restart.slope[n : 2 * n]) / self.system.coordinate_units)
        # at rest what accelerations there are is rounding
        velocity_scale = float((restart.scale[n : 2 * n] / restart.scale[:n]).max(initial=0.0))
        size = velocity_scale**2 + np.abs(a / self.system.coordinate_units).max(initial=0.0)
        moved = np.abs((self.present_record[:n, 0] - restart.y[:n]) / self.system.coordinate_units)
        if (
            off.max(initial=0.0) > tol.ACCELERATIONS_AGREE * size
            or moved.max(initial=0.0) > tol.ACCELERATIONS_AGREE
        ):
            return (
                "has other accelerations than this mechanism: its numbers differ; reset(state) "
                "takes its positions and rates alone"
            )
        return ""

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
        from outside or `input_values` between set times; the motion is left unchanged.
        """
        (work, memory), record = self._probe_memory, self.present_record
        memory.y[:] = self.y
        memory.state[TIME] = self.state[TIME]
        work.signal[:] = self.work.signal
        if inputs is not None:
            work.signal[list(self.free_inputs.values()), 0] = inputs
        for name, value in (input_values or {}).items():
            work.signal[self.interruptions.hold[name], 0] = value
        initial_derivative(self.layout, work, memory, REFINEMENTS, record)
        raise_user_error(self.system)
        return record

    def now(self, status: str) -> Solution:
        """The first and the present instant as a result."""
        return self.solution(status, self._ends(self.instant()))

    def _ends(self, record: Array) -> KeptInstants:
        """The first instant, and the present one of this record, if it is another one."""
        t = float(self.state[TIME])
        count = 1 if t == self.first else 2
        times, records = np.array([self.first, t]), np.array([self.reference, record])
        return KeptInstants(times[:count], records[:count], self._works()[:count])

    def _works(self) -> Array:
        """The work of every cause up to the first and the present instant."""
        return np.array([np.zeros(self.causes), self._gained])

    @property
    def named_modes(self) -> dict[str, str]:
        """Present modes of contacts and frictional joints, by name: there are none."""
        return {}

    @property
    def open_forces(self) -> SharedResult | None:
        """None: no contact or friction shares its forces."""
        return None

    def meet(self, name: str, forces: OneSidedForce) -> None:
        """Take forces of a contact or a rope into its extremes, and the first of wrong sign."""
        if name in self.extremes:
            known = self.extremes[name]
            parts = ((known.t, forces.t), (known.force, forces.force), (known.size, forces.size))
            forces = OneSidedForce(*(np.concatenate(part) for part in parts))
        pulls = forces.force < -tol.FORCE_NONE * forces.size.max()
        kept = np.unique([pulls.argmax(), forces.force.argmin(), forces.size.argmax()])
        self.extremes[name] = OneSidedForce(forces.t[kept], forces.force[kept], forces.size[kept])

    def _keep_now(self) -> None:
        """Keep the instant that a motion has reached, to continue from there."""
        if not self.state[STEPS]:
            return
        kept, done = self._kept_instants(), self._gained.copy()
        self.restart_point = self._restart_state(done)
        met = len(kept.t)
        self.evaluate()
        if met and kept.t[-1] == self.state[TIME]:
            met -= 1
        self.outputs = Outputs(
            times=np.append(kept.t[:met], self.state[TIME]),
            pages=np.concatenate([kept.records[:met], self.record[None]]),
            work=np.concatenate([kept.works[:met], [done, done]]),
        )
        self.state[DELIVERED] = met + 1

    def _kept_instants(self) -> KeptInstants:
        """The instants that are met."""
        met = int(self.state[DELIVERED])
        O = self.outputs
        return KeptInstants(O.times[:met], O.pages[:met], O.work[:met])

    def _check_finite(self, K: Array, t: float) -> None:
        if np.isfinite(K[0]).all():
            return
        n = self.system.coordinates
        raise valueless(self.system, self.work, t, self.y[:n], self.y[n : 2 * n])

    def stopped(self, found: Solution, code: int) -> SolveError:
        """The sentence of a motion that cannot be integrated."""
        state = self.state
        unit = self.system.mechanism.units.time
        t = float(state[TIME])
        when = f"t = {t:.6g} {unit}"
        if code == STIFF:
            left = (self.until - t) / state[NEXT]
            return SolveError(
                f"the loads are too stiff for explicit steps: at {when} the step has shrunk to "
                f"{state[NEXT]:.2g} {unit}, the end would take {left:.1g} more; ask for the "
                "method 'radau5'",
                solution=found,
            )
        beyond = np.array([t + part * max(t, 1e-6) for part in (0.0, 1e-9, 1e-6, 1e-3)])
        try:
            check_law_ranges(self.system, beyond, {})
        except ModelError as error:
            why = f"the motion ends at {when}: {error}"
            return SolveError(why, error.element, found)
        q = self.y[: self.system.coordinates]
        reason = vanishing(self.system, q, when) or stuck(self.system, t, q)
        if reason is not None:
            reason.solution = found
            return reason
        if self.settings.method in EVEN:
            return SolveError(
                f"the equations of a step of '{self.settings.method}' have no solution at {when}: "
                f"{self.settings.step:g} {unit} is too long there, or the loads jump or grow "
                "without bound; take shorter steps, or the method 'dop853'",
                solution=found,
            )
        curves = [
            name
            for name, curve in self.system.mechanism.curves.items()
            if getattr(curve.law, "outside", "") == "error"
        ]
        self.vanished = self.settings.method != "radau5"
        ended = f", or are beyond the points of the curves {listed(curves)}" if curves else ""
        return SolveError(
            f"the steps vanish at {when}: the loads jump there, grow without bound, or are too "
            f"stiff{ended}; smooth them, or ask for less accuracy",
            solution=found,
        )

    def solution(self, status: str, kept: KeptInstants | None = None) -> Solution:
        """The motion as a result, by default with the instants that are kept."""
        n, state = self.system.coordinates, self.state
        kept = kept or self._kept_instants()
        times, output, work_done = kept.t, kept.records, kept.works
        stats = {
            "steps": int(state[STEPS]),
            "rejected": int(state[REJECTED]),
            "careful": int(state[NEAR_SINGULAR_STEPS]),
            "evaluations": int(state[EVALUATIONS]),
        }
        if state[JACOBIANS]:
            stats["tangents"] = int(state[JACOBIANS])
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
            stats=stats,
            energy=account(self.system, output[:, :, 0], work_done, self.stops),
            events=tuple(self.occurred),
            restart=self._restart(work_done),
        )
        last = float(times[-1]) if len(times) else self.first
        notes = (*reported_certificate(found).notes, *self.notes, *self.passage.notes(last))
        if may_be_one_sided(self.system.mechanism):
            from mbody.analysis.driven.contact_report import pulled

            notes += tuple(pulled(found, self.extremes))
        notes += _limited(int(state[LIMITED_INSTANTS]))
        notes += unresolved_states(found)
        if self.regularization:
            notes += open_note(found.dependencies)
        found = with_fields(found, notes=notes, branch=self.passage.least(last))
        return doubted(found, self.passage.doubts)


def _limited(count: int) -> tuple[str, ...]:
    """The note of steps that stability limits, where it shows between their ends."""
    if not count:
        return ()
    when = "an instant" if count == 1 else f"{count} instants"
    return (
        f"stability, not the tolerance, limits the explicit steps: what they interpolate was in "
        f"error by more than ten tolerances at {when}, which got steps of their own; some hundred "
        "tolerances may be left of it, with the method 'radau5' none",
    )
