"""Integration to one time after another: the steps of `simulate`, called from outside.

A call that one step covers is one call of the kernel, which leaves the state as it was where it
rejects the step; longer ones keep what they begin with, to go back to where they fail.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.contacts import OneSidedForce
from mbody.analysis.dynamics.branch_passage import KnownCrossings
from mbody.analysis.dynamics.initial_step import REFINEMENTS
from mbody.analysis.dynamics.integration import AT_ONCE, Integration
from mbody.analysis.dynamics.integrators import integrator, stepping
from mbody.analysis.dynamics.interruptions import (
    held_inputs,
    input_value,
    tables_of_time,
    without_held,
)
from mbody.analysis.position.assembly_analysis import raise_user_error
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
from mbody.solution.restart import Restart
from mbody.solution.solution import Solution
from mbody.stepping.carried_modes import CarriedModes

__all__ = ["Carried", "Stepwise"]

Array = np.ndarray

#: Instants within a call at which it is watched: of one step, and of many.
WITHIN, AMONG = 8, 200
#: Accelerations of a state that is set, and those that the mechanism has there, agree to this part
#: of the greatest, positions in model lengths and radians; those of another design do not.
AGREES = 1e-6


@dataclass(frozen=True, eq=False)
class Carried:
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
    reference, page : arrays (rows, 1)
        When the motion began, what is kept of that instant (see `mbody.kernels.output`), and of
        the present one.
    extremes : dict
        Of contacts and ropes the least force and the largest by size.
    modes : CarriedModes or None
        What is open, sticks and slides.
    """

    restart: Restart
    regularization: float
    near: Array
    passage: KnownCrossings
    first: float
    reference: Array
    page: Array
    extremes: dict[str, OneSidedForce]
    modes: CarriedModes | None = None


class Stepwise(Integration):
    """Integrates one system to one time after another."""

    outputs: Outputs
    reference: Array
    ends: tuple[Array, Array, Array]
    #: Whether the instants within calls of many steps are kept in `samples`, times and pages; and
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
        return bool(self.system.mechanism.controllers or tables_of_time(self.system))

    @functools.cached_property
    def _blank(self) -> tuple[Array, ...]:
        """What the method itself carries on, before its first step."""
        return tuple(part.copy() for part in self.steps.own)

    @functools.cached_property
    def _probe(self) -> tuple[Work, Stepping]:
        """Memory in which an instant is evaluated beside the motion."""
        memory = stepping(self.system.state_count, self.causes, self.regularization)
        return self.system.work(masses=True), memory

    @functools.cached_property
    def shown(self) -> Array:
        """What is kept of an instant (rows, 1): see `instant`."""
        return np.zeros((self.system.page_rows, 1))

    def regularize(self, regularization: float) -> None:
        """Another proximal term, of redundant rows: zero where there are none."""
        if regularization == self.regularization:
            return
        self.regularization = regularization
        self.stepping = self.stepping.replaced(regularization=regularization)
        self.motion = self._motion()
        self.steps = integrator(self.way.method, self.layout, self.work, self.way.step)
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
        self.layout = without_held(system.runtime(), {**held_inputs(system), **rows})
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
        self.reference = self.page.copy()
        self._show(None)

    def place_at(self, t: float, page: Array) -> None:
        """Show an instant (rows,) that no steps have led to."""
        self._clear()
        self.extremes = {}
        self.first, self.state[TIME] = t, t
        n, own = 2 * self.system.coordinates, self.system.own_rows.start
        self.y[:n], self.shown[:, 0] = page[:n], page
        self.y[n:] = page[own : own + self.system.layout.owns]

    def _clear(self) -> None:
        for own, blank in zip(self.steps.own, self._blank, strict=True):
            own[:] = blank
        self.state[:] = 0.0
        self.work.near[:] = 0.0
        self.outputs = self._no_outputs()

    # -- steps --------------------------------------------------------------------------------

    def reach(self, until: float) -> str:
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
        return self._far(until)

    def _far(self, until: float) -> str:
        """The same in any number of steps."""
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
        """The same, the instants within the call kept."""
        times, gained = self._instants(), self._gained.copy()
        pages = np.empty((len(times), self.rows, 1))
        work = np.zeros((len(times) + 1, self.causes))
        work[-1], self.state[DELIVERED] = gained, 0.0
        self.outputs = Outputs(times=times, pages=pages, work=work)
        try:
            status = self._all_steps()
            met = int(self.state[DELIVERED])
            self.samples = times[:met], pages[:met]
        finally:
            gained = self._gained.copy()
            self.outputs = self._no_outputs()
            self._gained[:] = gained
        return status

    def _no_outputs(self) -> Outputs:
        """None but the work since the reference."""
        pages, work = np.empty((0, len(self.shown), 1)), np.zeros((1, self.causes))
        return Outputs(times=np.empty(0), pages=pages, work=work)

    def _set_times(self) -> None:
        """What is due at the beginning, and the first set time after it."""
        t = float(self.state[TIME])
        self.target = self.until
        if not self.timed:
            return
        # as far ahead again, so that corners are seldom looked for
        self.interruptions.look_until(2.0 * self.until - self.first)
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

    # -- what is carried on -------------------------------------------------------------------

    def snapshot(self) -> Carried:
        """A copy of all that the next step depends on."""
        return Carried(
            restart=self._restart_state(self._gained),
            regularization=self.regularization,
            near=self.work.near.copy(),
            passage=self.passage.known,
            first=self.first,
            reference=self.reference,
            page=self.page.copy(),
            extremes=dict(self.extremes),
        )

    def go_on_from(self, given: Carried) -> None:
        """Go on from there."""
        self.regularize(given.regularization)
        self._take(given.restart)
        self.interruptions.go_on_from(given.restart.inputs, given.restart.sampled)
        self._gained[:] = given.restart.gained
        self.work.near[:] = given.near
        self.passage.known = given.passage
        self.first, self.reference, self.page = given.first, given.reference, given.page.copy()
        self.extremes = dict(given.extremes)

    def unfit(self, given: Carried, inputs: Array) -> str:
        """Why a motion of this system cannot go on from there, with these inputs; else nothing."""
        restart, n = given.restart, self.system.coordinates
        sampled = [one.controller.name for one in restart.sampled]
        if sampled != [one.name for one in self.system.mechanism.controllers]:
            return "is of another mechanism, with other controllers"
        parts = (restart.y, restart.gained, given.reference, given.near)
        mine = (self.y, self._gained, self.shown, self.work.near)
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
        swift = float((restart.scale[n : 2 * n] / restart.scale[:n]).max(initial=0.0))
        size = swift**2 + np.abs(a / self.system.coordinate_units).max(initial=0.0)
        moved = np.abs((self.shown[:n, 0] - restart.y[:n]) / self.system.coordinate_units)
        if off.max(initial=0.0) > AGREES * size or moved.max(initial=0.0) > AGREES:
            return (
                "has other accelerations than this mechanism: its numbers differ; reset(state) "
                "takes its positions and rates alone"
            )
        return ""

    @property
    def _gained(self) -> Array:
        """Work of every cause since the reference, in place."""
        return np.asarray(self.outputs.work[-1])

    # -- what is shown ------------------------------------------------------------------------

    def instant(
        self, inputs: Array | None = None, held: Mapping[str, float] | None = None
    ) -> Array:
        """What is kept of the present instant, (rows, 1), as results have it, with the present
        inputs or with others, set from outside or `held` between set times; the motion is left as
        it is.
        """
        (work, memory), page = self._probe, self.shown
        memory.y[:] = self.y
        memory.state[TIME] = self.state[TIME]
        work.signal[:] = self.work.signal
        if inputs is not None:
            work.signal[list(self.free_inputs.values()), 0] = inputs
        for name, value in (held or {}).items():
            work.signal[self.interruptions.held[name], 0] = value
        initial_derivative(self.layout, work, memory, REFINEMENTS, page)
        raise_user_error(self.system)
        return page

    def now(self, status: str) -> Solution:
        """The first and the present instant as a result."""
        self._show(self.instant())
        try:
            return self._solution(status)
        finally:
            self._show(None)

    def _show(self, page: Array | None) -> None:
        """Let the first instant be what results have, and the present one if its page is given."""
        t = float(self.state[TIME])
        if page is None or t == self.first:
            pages, times = self.reference[None], np.array([self.first])
        else:
            pages, times = np.array([self.reference, page]), np.array([self.first, t])
        self.ends = times, pages, self._works()[: len(times)]

    def _works(self) -> Array:
        return np.array([np.zeros(self.causes), self._gained])

    def _kept(self) -> tuple[Array, Array, Array]:
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
