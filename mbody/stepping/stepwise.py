"""Integration to one time after another: the steps of `simulate`, called from outside.

A call that one step covers is one call of the kernel, which leaves the state as it was where it
rejects the step; longer ones keep what they begin with, to go back to where they fail.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.contact.systems_with_modes import has_modes, refuse_modes
from mbody.analysis.driven.contact_report import OneSidedForce, one_sided, one_sided_force
from mbody.analysis.driven.law_doubts import (
    derivative_doubts,
    law_doubts,
    open_curves,
    open_tables,
)
from mbody.analysis.dynamics.branch_passage import KnownCrossings
from mbody.analysis.dynamics.contact_motion import ContactIntegration
from mbody.analysis.dynamics.events import EventIntegration
from mbody.analysis.dynamics.integration import AT_ONCE, Integration
from mbody.analysis.dynamics.integrators import REFINEMENTS, integrator, stepping
from mbody.analysis.dynamics.interruptions import (
    has_corners,
    hold_inputs,
    input_value,
    without_hold,
)
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.errors import SolveError
from mbody.kernels.layout import Work
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    DELIVERED,
    DONE,
    JACOBIAN_VALID,
    LAST_STEP_ALLOWED,
    MORE,
    NEXT,
    STEPS,
    TIME,
    Outputs,
    Stepping,
)
from mbody.laws import Constant
from mbody.model.simulation import WITH_MODES, Event
from mbody.solution.doubts import Doubt
from mbody.solution.histories import Record
from mbody.solution.measures import evaluate_measure
from mbody.solution.shared_forces import ForceSet, SharedResult
from mbody.solution.solution import IntegrationSettings, Restart, Solution
from mbody.solution.traced_instant import Present, Read
from mbody.system.system import System

# -- Contact modes of a checkpoint -------------------------------------------------------------

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class ContactModes:
    """Contact modes of a checkpoint: what a motion with contacts needs besides its state.

    Attributes
    ----------
    first : dict
        Mode of every contact and frictional joint when the motion began, by name.
    rows : tuple of arrays
        Which rows are on, with what depends on it, their anchors, slip signs of sliding, and the
        numbers of the rows, among which are the phases of circles that stick.
    tables : tuple of arrays
        Modes, who leads what sticks, what is closed and what has left its edge, when contact points
        were struck last, what is rounding of guards, whose forces no equation decides, when modes
        changed last and how often then.
    notes : tuple of str
    lost : array (contacts,)
        Energy that impacts of each took.
    """

    first: dict[str, str]
    rows: tuple[Array, ...]
    tables: tuple[Array, ...]
    notes: tuple[str, ...]
    lost: Array
    #: Admissible forces of the first instant.
    forces: ForceSet | None = None


#: Instants within a call at which it is watched: of one step, and of many.
WITHIN, AMONG = 8, 200


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """All that the next step depends on.

    Attributes
    ----------
    restart : Restart
        The state of the integrator, and the work since the reference.
    regularization : float
        Of redundant rows.
    near : array
        Distances from singular positions at the beginning of the step.
    passage : tuple
        Singular positions ahead, those behind, doubts, and positions that were met.
    first : float
    reference, record : arrays (rows, 1)
        When the motion began, what is kept of that instant (see `mbody.kernels.layout`), and of
        the present one.
    extremes : dict
        Of contacts and ropes the least force and the largest by size.
    modes : ContactModes or None
        What is open, sticks and slides.
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


class Stepwise(Integration):
    """Integrates one system to one time after another."""

    outputs: Outputs
    reference: Array
    ends: tuple[Array, Array, Array]
    #: Whether the instants within calls of many steps are kept in `samples`, times and records; and
    #: those within each call.
    watched = closely = False
    samples: tuple[Array, Array] | None = None
    #: Of contacts and ropes the least force and the largest by size, since the beginning.
    extremes: dict[str, OneSidedForce]

    @functools.cached_property
    def guarded(self) -> bool:
        """Whether a step may fail after it was accepted, so that the state must be kept before."""
        machine = self.system.mechanism
        elements = (*machine.joints, *machine.drivers, *machine.couplings)
        distances = any(list(one.distances()) for one in elements)
        return distances or self.system.has_user_code or self.timed

    @functools.cached_property
    def timed(self) -> bool:
        """Whether there are set times: samples of controllers, corners of laws of time."""
        return bool(self.system.mechanism.controllers or has_corners(self.system))

    @functools.cached_property
    def _blank(self) -> tuple[Array, ...]:
        """Initial memory of the method itself, before its first step."""
        return tuple(part.copy() for part in self.steps.own)

    @functools.cached_property
    def _probe(self) -> tuple[Work, Stepping]:
        """Memory in which an instant is evaluated beside the motion."""
        memory = stepping(self.system.state_count, self.causes, self.regularization)
        return self.system.work(masses=True), memory

    @functools.cached_property
    def present_record(self) -> Array:
        """Record of an instant, (rows, 1): see `instant`."""
        return np.zeros((self.system.record_rows, 1))

    def regularize(self, regularization: float) -> None:
        """Another proximal term, of redundant rows: zero where there are none."""
        if regularization == self.regularization:
            return
        self.regularization = regularization
        self.stepping = self.stepping.replaced(regularization=regularization)
        self.motion = self._motion()
        self.steps = integrator(self.settings.method, self.layout, self.work, self.settings.step)
        self.__dict__.pop("_probe", None)

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
        self.extremes = {}
        # how long it goes on is not known yet
        self.begin(t, q, v, math.inf, own)
        self.reference = self.record.copy()
        self._show(None)

    def place_at(self, t: float, record: Array) -> None:
        """Show an instant (rows,) that no steps have led to."""
        self._clear()
        self.extremes = {}
        self.first, self.state[TIME] = t, t
        n, own = 2 * self.system.coordinates, self.system.auxiliary_rows.start
        self.y[:n], self.present_record[:, 0] = record[:n], record
        self.y[n:] = record[own : own + self.system.layout.owns]

    def _clear(self) -> None:
        for own, blank in zip(self.steps.own, self._blank, strict=True):
            own[:] = blank
        self.state[:] = 0.0
        self.work.near[:] = 0.0
        self.outputs = self._no_outputs()

    # -- steps --------------------------------------------------------------------------------

    def advance_to(self, until: float) -> str:
        """Go on to exactly this time; the status of a motion that ends before, else nothing.

        Raises
        ------
        SolveError
            As `simulate` does; the state is then the one before the call.
        """
        state = self.state
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
            return self._watched_steps() if watched else self._all_steps()
        except BaseException as error:
            self.go_on_from(saved)
            if isinstance(error, SolveError):
                error.solution = self.now("completed")
            raise

    def _instants(self) -> Array:
        """Times within a call, its end included, at which it is watched."""
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
            status = self._all_steps()
            met = int(self.state[DELIVERED])
            self.samples = times[:met], records[:met]
        finally:
            gained = self._gained.copy()
            self.outputs = self._no_outputs()
            self._gained[:] = gained
        return status

    def _no_outputs(self) -> Outputs:
        """None but the work since the reference."""
        records, work = np.empty((0, len(self.present_record), 1)), np.zeros((1, self.causes))
        return Outputs(times=np.empty(0), pages=records, work=work)

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

    def _all_steps(self) -> str:
        self._set_times()
        code = MORE
        while code == MORE:
            code = self._advance(self.target, AT_ONCE, self.outputs)
            if code == DONE and self.target < self.until:
                self._interrupt(self.target)
                code = MORE
            self._check_progress()
        if code != DONE:
            raise self._stopped(self._solution(""), code)
        return ""

    def refresh(self) -> None:
        """The derivative anew, of inputs that have changed."""
        state = self.state
        best = state.item(BEST_CONDITIONING)
        self.evaluate()
        state[BEST_CONDITIONING] = max(best, state.item(BEST_CONDITIONING))
        state[JACOBIAN_VALID] = 0.0
        self.steps.jumped(self.motion)

    # -- checkpoints ---------------------------------------------------------------------------

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

    @property
    def _gained(self) -> Array:
        """Work of every cause since the reference, in place."""
        return np.asarray(self.outputs.work[-1])

    # -- records -------------------------------------------------------------------------------

    def instant(
        self, inputs: Array | None = None, input_values: Mapping[str, float] | None = None
    ) -> Array:
        """Record of the present instant, (rows, 1), with the present inputs or with others, set
        from outside or `input_values` between set times; the motion is left unchanged.
        """
        (work, memory), record = self._probe, self.present_record
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
        self._show(self.instant())
        try:
            return self._solution(status)
        finally:
            self._show(None)

    def _show(self, record: Array | None) -> None:
        """Let results have the first instant, and the present one if its record is given."""
        t = float(self.state[TIME])
        if record is None or t == self.first:
            records, times = self.reference[None], np.array([self.first])
        else:
            records, times = np.array([self.reference, record]), np.array([self.first, t])
        self.ends = times, records, self._works()[: len(times)]

    def _works(self) -> Array:
        return np.array([np.zeros(self.causes), self._gained])

    @property
    def open_forces(self) -> SharedResult | None:
        """None: no contact or friction shares its forces."""
        return None

    def _kept_instants(self) -> tuple[Array, Array, Array]:
        return self.ends

    def meet(self, name: str, forces: OneSidedForce) -> None:
        """Take forces of a contact or a rope into its extremes."""
        if name in self.extremes:
            known = self.extremes[name]
            parts = ((known.t, forces.t), (known.force, forces.force), (known.size, forces.size))
            forces = OneSidedForce(*(np.concatenate(part) for part in parts))
        kept = np.unique([np.argmin(forces.force), np.argmax(forces.size)])
        self.extremes[name] = OneSidedForce(forces.t[kept], forces.force[kept], forces.size[kept])

    def _between(self) -> dict[str, OneSidedForce]:
        return self.extremes


#: What reads one number.
Reading = Callable[[], float]


class StepwiseEvents(Stepwise, EventIntegration):
    """Motion by steps with events, which every step looks for."""

    #: Of each event the value at the state in `at`; none where one needs more than that.
    values: Sequence[Reading] = ()
    at: tuple[Array, Array]
    #: Whether `record` is of an earlier instant.
    late = False

    def start_at(self, t: float, q: Array, v: Array, own: Array | None = None) -> None:
        """Begin anew, without the events before."""
        self.total, self.late = np.zeros(self.causes), False
        self.occurred = []
        self.forces = {one.name: [] for one in self.sided}
        self._forget()
        super().start_at(t, q, v, own)

    def _forget(self) -> None:
        """Nothing of former calls is kept."""
        self.instants, self.records, self.works = list[float](), list[Array](), list[Array]()

    def advance_to(self, until: float) -> str:
        """Advances to a time, event by event; returns how it ended, "" for completed."""
        if not self.state[STEPS]:
            self.until = until
            self._begin_steps()
        self.passage.whole = until - self.first
        return "" if self._quiet(until) else self._advance_in_steps(until)

    def _quiet(self, until: float) -> bool:
        """Go on by one short step that nothing crosses; False, where that is not certain.

        The cubic through values and rates at both ends of a step a quarter as long as the tolerance
        allows, as far apart as samples of longer steps are: where its four control points have one
        sign, so has the cubic.
        """
        state = self.state
        t = state.item(TIME)
        short = state.item(STEPS) > 0.0 and until - t <= tol.STEP_SHORT * state.item(NEXT)
        busy = self.guarded or self.closely or self.sided
        if not short or busy or not self.values:
            return False
        saved, first = self._save(), self._sampled_ends(until - t)
        self.outputs.work[-1] = self.total
        state[LAST_STEP_ALLOWED] = 1.0
        code = self._advance(until, 1, self.outputs)
        if code in (MORE, DONE) and state.item(TIME) == until:
            last, third = self._sampled_ends(until - t), (until - t) / 3.0
            for (v0, r0), (v1, r1) in zip(first, last, strict=True):
                hull = v0, v0 + third * r0, v1 - third * r1, v1
                low, high = min(hull), max(hull)
                if (
                    not min(abs(low), abs(high)) > tol.CONTROL_POINTS_CLEAR * (high - low)
                    or low < 0.0 < high
                ):
                    break
            else:
                self.total, self.late = self.outputs.work[-1].copy(), True
                return True
        self._restore(saved)
        return False

    def _sampled_ends(self, h: float) -> list[tuple[float, float]]:
        """Value and rate of every event at the present state."""
        y, slots = self.at
        t, little, found = self.state.item(TIME), tol.DIFFERENCE_STEP_RATES * h, []
        for sign in (0.0, 1.0, -1.0):
            y[:] = self.y + sign * little * self.K[0]
            slots[TIME] = t + sign * little
            found.append([value() for value in self.values])
        here, after, before = found
        return [(v, (a - b) / (2.0 * little)) for v, a, b in zip(here, after, before, strict=True)]

    def _renew(self) -> None:
        """The record of the present instant."""
        if self.late:
            self.record, self.late = self.instant().copy(), False

    def refresh(self) -> None:
        """Evaluates the present state after changed inputs; events are looked for anew."""
        super().refresh()
        self.late = False

    def _advance_in_steps(self, until: float) -> str:
        self._renew()
        return super()._advance_in_steps(until)

    def _all_steps(self) -> str:
        self._forget()
        self._set_times()
        self.wanted = self._instants() if self.closely else np.array([self.until])
        code, status = MORE, ""
        while code == MORE and not status:
            code, status = self._step()
            self._check_progress()
        if code not in (DONE, MORE):
            raise self._stopped(self._solution(""), code)
        for name, parts in self.forces.items():
            for part in parts:
                self.meet(name, part)
            self.forces[name] = []
        return status

    def _watched_steps(self) -> str:
        status = self._all_steps()
        if self.instants:
            self.samples = np.array(self.instants), np.array(self.records)
        return status

    def snapshot(self) -> Checkpoint:
        """Checkpoint of the motion with its event values."""
        self._renew()
        return super().snapshot()

    def go_on_from(self, given: Checkpoint) -> None:
        """Continues from a checkpoint; later events are dropped."""
        super().go_on_from(given)
        self.late = False
        t = float(self.state[TIME])
        self.occurred = [one for one in self.occurred if one.t <= t]
        self._forget()

    @property
    def _gained(self) -> Array:
        return self.total


# -- Integration to one time after another with contacts, ropes and frictional joints --------------


class StepwiseContacts(StepwiseEvents, ContactIntegration):
    """Motion by steps with contacts, ropes and frictional joints: modes as of `simulate`, decided
    again where inputs change.
    """

    first_modes: dict[str, str]
    #: Admissible forces of the first and of the present instant, where they are not determined.
    first_forces: ForceSet | None = None
    present_forces: ForceSet | None = None

    def start_at(self, t: float, q: Array, v: Array, own: Array | None = None) -> None:
        """Starts at positions q and velocities v; contact modes are decided anew."""
        self._open_all()
        self.lost[:] = 0.0
        super().start_at(t, q, v, own)
        self.ending = self.begin_modes()
        self.first_modes = self.named_modes()
        first = self.shown(t, self.record)
        self.reference, self.first_forces = first.record[:, None].copy(), first.forces
        self._show(None)

    def place_at(self, t: float, record: Array) -> None:
        """Places the motion at a record of an instant, with all contacts open."""
        self._open_all()
        super().place_at(t, record)
        self.first_modes = self.named_modes()

    def _open_all(self) -> None:
        """Nothing touches, and no joint sticks."""
        G = self.guard_table
        self.memory.forget()
        G.open_normal[:] = G.open_tangent[:] = G.count[0] = 0
        self.contact_notes, self.ending = [], ""
        self.changed[0], self.counts[:] = -np.inf, 0
        self.work.anchor[:] = 0.0
        self.work.par[:] = self.probe.par
        none = np.zeros(len(self.uni)), np.zeros(len(self.layout.friction_kind))
        self.uni.set_rows(self.work, *none)
        self.eliminate_rows_that_are_on()

    def _forget(self) -> None:
        super()._forget()
        self.kept_modes, self.kept_forces = [], []

    def advance_to(self, until: float) -> str:
        """Advances to a time; returns how it ended, "" for completed."""
        return self.ending or super().advance_to(until)

    def _quiet(self, until: float) -> bool:
        """Go on by one step, if it reaches the end and is quiet."""
        state = self.state
        busy = self.guarded or self.closely or self.watched or not self.watches
        if busy or state.item(TIME) + state.item(NEXT) < until:
            return False
        done, state[LAST_STEP_ALLOWED] = self.outputs.work[-1], 1.0
        done[:] = self.total
        code = self._quietly(until, 1, self.outputs, False)
        self.passage.record_crossings(self.y)
        self.passage.check_inertia(self.y)
        self.total[:], self.late = done, True
        return code in (MORE, DONE) and state.item(TIME) == until

    def refresh(self) -> None:
        """Evaluates the present state after changed inputs; changed forces may end sticking."""
        super().refresh()
        self.ending = self.settle_jump()

    # -- checkpoints of contacts ---------------------------------------------------------------

    def _rows_of(self, work: Work) -> tuple[Array, ...]:
        return work.on, work.pad, work.regularization_weight, work.anchor, work.slip_sign, work.par

    def snapshot(self) -> Checkpoint:
        """Checkpoint of the motion with its contact modes."""
        self.before_end = None  # that of the present state
        return replace(super().snapshot(), modes=self._contact_modes())

    def _contact_modes(self) -> ContactModes:
        return ContactModes(
            first=dict(self.first_modes),
            rows=tuple(part.copy() for part in self._rows_of(self.work)),
            tables=tuple(part.copy() for part in self._tables),
            notes=tuple(self.contact_notes),
            lost=self.lost.copy(),
            forces=self.first_forces,
        )

    @property
    def _tables(self) -> tuple[Array, ...]:
        M, G, struck = self.memory.modes, self.guard_table, self.memory.impact.struck
        own = M.mode, M.leader, M.closed, M.beyond, struck, G.fresh, G.open_normal, G.open_tangent
        return *own, self.changed, self.counts

    def go_on_from(self, given: Checkpoint) -> None:
        """Continues from a checkpoint with its contact modes."""
        super().go_on_from(given)
        assert given.modes is not None
        self._take_modes(given.modes)

    def _take_modes(self, given: ContactModes) -> None:
        self.first_modes, self.first_forces = dict(given.first), given.forces
        for part, was in zip(self._rows_of(self.work), given.rows, strict=True):
            part[:] = was
        for part, was in zip(self._tables, given.tables, strict=True):
            part[:] = was
        self.eliminate_rows_that_are_on()
        self.guards_again(self.guard_table.fresh)
        self.lost[:] = given.lost
        self.contact_notes, self.ending = list(given.notes), ""

    def unfit(self, given: Checkpoint, inputs: Array) -> str:
        """Reason why a checkpoint does not fit this motion; "" where it fits."""
        modes = given.modes
        mine = (*self._rows_of(self.work), *self._tables)
        if modes is None or [part.shape for part in (*modes.rows, *modes.tables)] != [
            part.shape for part in mine
        ]:
            return "is of another mechanism, with other contacts"
        before = self._contact_modes(), self.ending
        self._take_modes(modes)
        try:
            return super().unfit(given, inputs)
        finally:
            self._take_modes(before[0])
            self.ending = before[1]

    def _works(self) -> Array:
        works = np.zeros((2, self.causes + len(self.stops)))
        works[1] = np.concatenate([self.total, self.lost])
        return works

    # -- records of contacts -------------------------------------------------------------------

    def instant(
        self, inputs: Array | None = None, input_values: Mapping[str, float] | None = None
    ) -> Array:
        """Record of the present instant, (rows, 1), in the present modes, its forces admissible."""
        probe = self._probe[0]
        for part, own in zip(self._rows_of(probe), self._rows_of(self.work), strict=True):
            part[:] = own
        record = super().instant(inputs, input_values)
        shown = self.shown(float(self.state[TIME]), record)
        record[:, 0], self.present_forces = shown.record, shown.forces
        return record

    @property
    def open_forces(self) -> SharedResult | None:
        """Admissible forces of the present instant, which was evaluated; None where they are
        determined.
        """
        return self.shared_result(self.present_forces)

    def _solution(self, status: str) -> Solution:
        kept, count = (self.kept_modes, self.kept_forces), len(self.ends[0])
        self.kept_modes = [self.first_modes, self.named_modes()][:count]
        self.kept_forces = [self.first_forces, self.present_forces][:count]
        try:
            return super()._solution(status)
        finally:
            self.kept_modes, self.kept_forces = kept


def stepwise(
    system: System, start: Solution, settings: IntegrationSettings, events: tuple[Event, ...]
) -> Stepwise:
    """The integration of a system."""
    if has_modes(system):
        if settings.method not in WITH_MODES:
            refuse_modes(system, f"the method '{settings.method}'")
        return StepwiseContacts(system, start, settings, events)
    if events:
        return StepwiseEvents(system, start, settings, events)
    return Stepwise(system, start, settings)


# -- Monitors between the ends of calls: tables left, contacts lifted off, events --------------


class Monitor:
    """Tables, contacts and ropes of one motion; events look for themselves."""

    def __init__(self, integration: Stepwise, present: Present, events: bool) -> None:
        self.integration, self.present = integration, present
        self.system = system = integration.system
        described = system.mechanism
        left = (*open_tables(described), *open_curves(described))
        integration.closely = bool(left)
        self.contacts: list[tuple[str, Any, Read | None, Read | None]] = []
        if isinstance(integration, StepwiseEvents):
            _find_values(integration)
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
        regular = self.integration.regularization
        record = Record([records], len(times), batch=False)
        return Solution(self.system, "simulate", times, record, None, regularization=regular)


def _find_values(integration: StepwiseEvents) -> None:
    """Values of events at other states than the present one, where no forces are in them."""
    integration.at = np.zeros_like(integration.y), np.zeros_like(integration.state)
    y, slots = (memoryview(part.data) for part in integration.at)
    present = Present(integration.system, y, slots, _no_record)
    with contextlib.suppress(Exception):  # what no list of operations gives, or forces
        found = [
            present.read(evaluate_measure(present.instant, one)[0]) for one in integration.measures
        ]
        for value in found:
            value()
        integration.values = found


def _no_record() -> memoryview:
    raise LookupError("there are no forces beside the present instant")
