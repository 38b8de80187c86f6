"""Time integration of one motion: memory and calls of the integrator, and its result."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mbody.analysis.contact.systems_with_modes import refuse_modes
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
    refuse_auxiliary_states,
    stepping,
    unresolved_states,
)
from mbody.analysis.dynamics.interruptions import (
    Interruptions,
    RateJumps,
    SampledState,
    hold_inputs,
    without_hold,
)
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.analysis.position.closed_position import vanishing
from mbody.analysis.singular.nearby_singularity import packed_positions, unpacked_positions
from mbody.core import tolerances as tol
from mbody.errors import ModelError, SolveError
from mbody.kernels.layout import artificial_masses
from mbody.kernels.state_derivative import initial_derivative
from mbody.kernels.step_state import (
    BEST_CONDITIONING,
    BRANCH_UNCERTAIN,
    DELIVERED,
    DONE,
    EVALUATIONS,
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
    Tolerances,
)
from mbody.model.closed_mechanism import may_be_one_sided
from mbody.model.element import listed
from mbody.model.inputs import Controller
from mbody.model.simulation import EVEN
from mbody.solution.doubts import doubted
from mbody.solution.energy import account, causes
from mbody.solution.histories import EventRecord, Record, reported_certificate, with_fields
from mbody.solution.solution import IntegrationSettings, Restart, Solution
from mbody.solution.traced_instant import Present, Read
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.analysis.driven.contact_report import OneSidedForce

# -- Readings of controllers: measures compiled when they are first read -----------------------

Array = np.ndarray


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
        record = Record([self.record()[None].copy()], 1, batch=False)
        t, regular = np.array([self.state[TIME]]), self.regularization
        return Solution(self.system, "simulate", t, record, None, regularization=regular)


#: What takes at most so many steps towards a time, with what is kept on the way; a code.
StepTaker = Callable[[float, int, Outputs], int]
#: Steps of one call of the kernel; between calls progress is shown and Ctrl-C takes effect.
AT_ONCE = 500
#: Of so many steps the mean is compared with the greatest; where `PATIENT` steps are still to go,
#: the step size may collapse.
JUDGED = 10_000


class Integration(RateJumps):
    """Integrates one system from a first state."""

    #: Whether it decides what is open, sticks and slides.
    decides_modes = False
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
        found = self._solution(status)
        lost = np.flatnonzero(~np.isfinite(found.record.blocks[0][:, :, 0]).all(axis=1))
        if lost.size:  # an instant at which a load has no value, though the steps passed it
            self.state[TIME] = found.t[lost[0]]
            found = found.take(np.arange(lost[0]))
        if lost.size or code not in (DONE, MORE):
            raise self._stopped(found, code)
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

    def _advance(
        self, until: float, steps: int, outputs: Outputs, take: StepTaker | None = None
    ) -> int:
        """At most so many steps; a code of `mbody.kernels.step_state`. `take`: what takes them, by
        default the method.
        """
        code, left = MORE, steps
        while code == MORE and left > 0:
            done = self.state[STEPS]
            count = 1 if self.passage.open else left
            if until != self.until:  # nothing is kept of what leads to a set time
                self.state[LAST_STEP_ALLOWED] = 1.0
            if take is None:
                code = self.steps.steps(self.motion, until, count, outputs)
            else:
                code = take(until, count, outputs)
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
        self.times, self.output = times, np.empty((len(times), self.rows, 1))
        self.work_done = np.zeros((len(times) + 1, self.causes))
        self.work_done[-1] = self.initial_work
        if times[0] <= self.first:
            self.output[0], self.state[DELIVERED] = self.record, 1.0
        outputs = Outputs(times=times, pages=self.output, work=self.work_done)
        code = MORE
        while code == MORE:
            code = self._advance(self.target, AT_ONCE, outputs)
            if code == DONE and self.target < self.until:
                self._interrupt(self.target)
                code = MORE
                if self.state[TIME] >= self.until:  # rates of drivers jumped at the very end
                    self._keep_now()
            self._check_progress()
            if progress is not None:
                progress(float(self.state[TIME]))
        return code, "completed"

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

    def _check_progress(self) -> None:
        """Refuse to go on where loads that jump to and fro keep steps short for ever, or where a
        distance has become zero.
        """
        n, unit = self.system.coordinates, self.system.mechanism.units.time
        gone = vanishing(
            self.system, self.y[:n], f"t = {self.state[TIME]:.6g} {unit}", tol.DISTANCE_LOST
        )
        if gone is not None:
            gone.solution = self._solution("")
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
                solution=self._solution(""),
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

    def _keep_now(self) -> None:
        """Keep the instant that a motion has reached, to continue from there."""
        if not self.state[STEPS]:
            return
        self.restart_point = self._restart_state(self.work_done[-1])
        met, done = int(self.state[DELIVERED]), self.work_done[-1].copy()
        self.evaluate()
        if met and self.times[met - 1] == self.state[TIME]:
            met -= 1
        self.times = np.append(self.times[:met], self.state[TIME])
        self.output = np.concatenate([self.output[:met], self.record[None]])
        self.work_done = np.concatenate([self.work_done[:met], done[None]])
        self.state[DELIVERED] = met + 1

    def _kept_instants(self) -> tuple[Array, Array, Array]:
        """Times, records and work of the instants that are met."""
        met = int(self.state[DELIVERED])
        return self.times[:met], self.output[:met], self.work_done[:met]

    def _check_finite(self, K: Array, t: float) -> None:
        if np.isfinite(K[0]).all():
            return
        n = self.system.coordinates
        raise valueless(self.system, self.work, t, self.y[:n], self.y[n : 2 * n])

    def _stopped(self, found: Solution, code: int) -> SolveError:
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

    def _solution(self, status: str) -> Solution:
        n, state = self.system.coordinates, self.state
        times, output, work_done = self._kept_instants()
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

            notes += tuple(pulled(found, self._between()))
        notes += _limited(int(state[LIMITED_INSTANTS]))
        notes += unresolved_states(found)
        if self.regularization:
            notes += open_note(found.dependencies)
        found = with_fields(found, notes=notes, branch=self.passage.least(last))
        return doubted(found, self.passage.doubts)

    def _between(self) -> Mapping[str, OneSidedForce] | None:
        """Forces of contacts and ropes between the instants that are kept."""
        return None


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
