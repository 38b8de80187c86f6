"""Motions in dual numbers between changes of modes, and single instants with all rows."""

from __future__ import annotations

import functools
import math
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import Unilateral, arc_rows, edge_rows
from mbody.analysis.dynamics.contact_log import InstantModes, SharedForces
from mbody.analysis.dynamics.integrators import REFINEMENTS, auxiliary_sizes, coordinate_sizes
from mbody.analysis.dynamics.interruptions import hold_inputs, without_hold
from mbody.analysis.initial.initial_state import event_measure
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.core.bundle import Bundle
from mbody.core.lanes import LANES, TANGENTS, DualNumber, aligned, value
from mbody.derivatives.dual_solution import DualRecord, EventTime, dual_solution
from mbody.derivatives.mode_record import (
    Guarded,
    ImpactStage,
    JumpGuard,
    LostNumbers,
    ModeStretch,
    Strike,
    without_functions,
)
from mbody.errors import SolveError
from mbody.kernels.complementarity import find_arms
from mbody.kernels.contact_guards import (
    CLOSE,
    EDGE,
    ENTER,
    LOCK,
    PARADOX,
    STOP,
    look,
)
from mbody.kernels.contact_modes import MASSLESS, tangent_of
from mbody.kernels.contact_rows import fill_row, phase_offset, row_rate, written
from mbody.kernels.friction import ARMS, law_size
from mbody.kernels.layout import Layout, Work, artificial_masses
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.motion_duals import NEXT_LENGTH, T_NOW, FreeDuals, free_duals
from mbody.kernels.runge_kutta import order_8
from mbody.kernels.step_state import DONE
from mbody.model.element import Numbers
from mbody.solution.measures import evaluate_measure
from mbody.solution.shared_forces import pressing_rows
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.system.rank import independent_rows, joint_rows, rank_of
from mbody.system.system import System, polar_points

Array = np.ndarray

#: Steps from one instant to the next, at most.
STEPS = 20_000


@dataclass(frozen=True, eq=False)
class Tangents:
    """Derivatives of all that a motion is made of but its state, by some directions.

    `par`, `mass` (rows, directions): Of the numbers of the kernels.
    `anchor`, `phases` (rows of the active set, …) (phases, directions)
    `hold` (inputs that keep their values, directions)
    `resolved` (directions,): Below which tangents do not count.
    """

    par: Array
    mass: Array
    anchor: Array
    phases: Array
    hold: Array
    resolved: Array

    @property
    def count(self) -> int:
        """Directions."""
        return self.par.shape[1]

    def part(self, some: slice) -> Tangents:
        """Only some of the directions."""
        return Tangents(
            self.par[:, some],
            self.mass[:, some],
            self.anchor[:, some],
            self.phases[:, some],
            self.hold[:, some],
            self.resolved[some],
        )

    def none(self) -> Tangents:
        """One direction, by which nothing changes."""
        return Tangents(*(0.0 * part[..., :1] for part in vars(self).values()))


class DualRows:
    """Rows of workspaces of dual numbers, as if each had one lane: (row, 0) is a dual number. Of
    more directions than a workspace has lanes for, several have the tangents.
    """

    ndim = 2

    def __init__(self, parts: Sequence[tuple[Array, int]]) -> None:
        self.parts, self.shape = parts, (len(parts[0][0]), 1)

    def __getitem__(self, place: Any) -> DualNumber:
        row = place[0] if isinstance(place, tuple) else place
        tangents = [lanes[row, 1 : 1 + width] for lanes, width in self.parts]
        whole = tangents[0].copy() if len(tangents) == 1 else np.concatenate(tangents, axis=-1)
        return DualNumber(self.parts[0][0][row, 0], whole)

    def __setitem__(self, place: Any, number: Any) -> None:
        row, first = place[0] if isinstance(place, tuple) else place, 0
        for lanes, width in self.parts:
            lanes[row, 0] = value(number)
            own = number.tangents[first : first + width] if isinstance(number, DualNumber) else 0.0
            lanes[row, 1 : 1 + width], first = own, first + width


class DualWork:
    """A workspace at one instant, its rows `DualRows`."""

    def __init__(self, parts: Sequence[tuple[Work, int]]) -> None:
        self._parts = parts

    @property
    def values(self) -> DualWork:
        """Without tangents."""
        return DualWork([(self._parts[0][0], 0)])

    def __getattr__(self, name: str) -> DualRows:
        found = DualRows([(getattr(work, name), width) for work, width in self._parts])
        setattr(self, name, found)
        return found


@dataclass(frozen=True, eq=False)
class DualInstant:
    """One instant in dual numbers.

    `y`, `derivative`: The state, projected on the constraints, and its derivative.
    `record`: As of `mbody.kernels.motion_duals.keep_duals`.
    `work`: The workspace.
    """

    t: float
    y: DualNumber
    derivative: DualNumber
    record: DualNumber
    work: DualWork


class DualMotion:
    """Motions of one system in dual numbers. `rates`, `accelerations` (coordinates,)."""

    def __init__(
        self,
        run: Solution,
        settings: IntegrationSettings,
        rates: Array,
        accelerations: Array,
        with_loads: bool,
    ) -> None:
        self.run, self.system, self.settings = run, run.system, settings
        system = self.system
        self.hold = hold_inputs(system)
        self.layout = without_hold(system.runtime(), self.hold)
        self.sided: dict[tuple[tuple[int, float], ...], tuple[Layout, dict[int, float]]] = {}
        self.uni = Unilateral(system)
        #: Those of systems with other numbers, which are kept by who asks.
        self.beside: dict[int, SharedForces] = {}
        self.loads = len(system.mechanism.loads) if with_loads else 0
        self.first_load = system.record_rows + 1 + 3 * len(system.drivers)
        self.rows = self.first_load + self.loads * system.coordinates
        sizes = coordinate_sizes(system, rates, accelerations)
        self.scale = np.concatenate([sizes, auxiliary_sizes(system), [1.0]])
        light = artificial_masses(system.layout, system.mass, system.sizes).any()
        self.regularization = tol.REDUNDANT_ROW_SOFTNESS * bool(run.regularization)
        self.refinements = 1 + REFINEMENTS if light or self.regularization else 0

    def follow(
        self, stretch: ModeStretch, begin: float, y: DualNumber, tangents: Tangents, times: Array
    ) -> DualNumber:
        """Records (instants, rows) at rising times of a stretch, from a state `begin` on."""
        values = np.zeros((len(times), self.rows))
        changes = np.zeros((len(times), self.rows, tangents.count))
        for first in range(0, max(tangents.count, 1), TANGENTS):
            part = slice(first, min(first + TANGENTS, tangents.count))
            some = DualNumber(y.value, y.tangents[:, part])
            L, work = self._layout(stretch)[0], self._work(stretch, tangents.part(part))
            free = self._called(L, work, begin, some, tangents.resolved[part], times)
            output = np.asarray(free.output)
            values[:] = output[:, :, 0]
            changes[:, :, part] = output[:, :, 1 : 1 + part.stop - part.start]
        return DualNumber(values, changes)

    def at(
        self, stretch: ModeStretch, t: DualNumber, y: DualNumber, tangents: Tangents
    ) -> DualInstant:
        """One instant in the modes of a stretch; the time may have tangents, too."""
        works, found = list[tuple[Work, int]](), list[list[Array]]()
        for first in range(0, max(tangents.count, 1), TANGENTS):
            part = slice(first, min(first + TANGENTS, tangents.count))
            width = slice(1, 1 + part.stop - part.start)
            L, work = self._layout(stretch)[0], self._work(stretch, tangents.part(part))
            work.time[0, width] = t.tangents[part]
            some = DualNumber(y.value, y.tangents[:, part])
            now = np.array([t.value])
            free = self._called(L, work, float(t.value), some, tangents.resolved[part], now)
            works.append((work, width.stop - 1))
            found.append([free.y[:-1], free.K[0][:-1], free.output[0]])
        y, derivative, record = (
            DualRows([(lanes, width) for lanes, (_, width) in zip(one, works, strict=True)])[:]
            for one in zip(*found, strict=True)
        )
        return DualInstant(float(t.value), y, derivative, record, DualWork(works))

    def reported_row(
        self, stretch: ModeStretch, t: float, system: System, row: Array, phases: Array
    ) -> Array | None:
        """A row (rows,) of a system in the modes of a stretch with the forces that are reported;
        None where all are determined.
        """
        if id(system) not in self.beside:
            uni = self.uni if system is self.system else Unilateral(system)
            self.beside[id(system)] = SharedForces(uni)
        sharing, work = self.beside[id(system)], system.work()
        uni = sharing.uni
        n = system.coordinates
        work.q[:n, 0], work.v[:n, 0], work.time[0, 0] = row[:n], row[n : 2 * n], t
        for name, amount in stretch.inputs.items():
            work.signal[self.hold[name], 0] = amount
        uni.set_rows(work, stretch.on, stretch.slip_sign)
        work.par[uni.phase_rows, 0] = phases
        laws_of_time(without_hold(system.runtime(), self.hold), work)
        modes = InstantModes(list(stretch.modes), list(stretch.pairs), stretch.on)
        found = sharing.reported(work, row, modes)
        return None if found.forces is None else found.record

    def _layout(self, stretch: ModeStretch) -> tuple[Layout, dict[int, float]]:
        """The layout in which formulas are on the sides of a stretch, with what is held."""
        if not stretch.sides:
            return self.layout, {}
        key = tuple(sorted(stretch.sides.items()))
        if key not in self.sided:
            self.sided[key] = without_functions(self.layout, stretch.sides)
        return self.sided[key]

    def _called(
        self, L: Layout, work: Work, begin: float, first: DualNumber, resolved: Array, times: Array
    ) -> FreeDuals:
        """The kernel from a state on."""
        system, method = self.system, order_8()
        # one row more than the state has: a constant, below which tangents are not resolved
        size, stages = system.state_count + 1, len(method.B)
        y, width = aligned(size, LANES), first.tangents.shape[1]
        y[:-1, 0], y[:-1, 1 : 1 + width] = first.value, first.tangents
        y[-1, 1 : 1 + width] = resolved
        state = np.zeros(4)
        state[T_NOW] = begin
        state[NEXT_LENGTH] = 1e-4 * max(float(times[-1]) - begin, 1e-12)
        free = FreeDuals(
            t=times,
            relative=self.settings.rtol,
            absolute=self.settings.atol,
            regularization=self.regularization,
            refinements=self.refinements,
            rows=system.record_rows,
            loads=self.loads,
            scale=self.scale,
            state=state,
            y=y,
            K=np.zeros((stages + 1, size, LANES)),
            stage=aligned(size, LANES),
            end=aligned(size, LANES),
            error=np.zeros((2, size, LANES)),
            output=np.zeros((len(times), self.rows, LANES)),
        )
        code = free_duals(L, work, method, free, STEPS)
        raise_user_error(system)
        if code != DONE or not np.isfinite(free.output).all():
            unit = system.mechanism.units.time
            if float(times[-1]) - begin <= tol.TIMES_SAME_CHANGES * float(times[-1]):
                raise SolveError(
                    f"the motion of '{system.mechanism.name}' ends, but for rounding, where "
                    f"something changes, at t = {times[-1]:.6g} {unit}, as by an impact: it has no "
                    "derivatives there; move its end"
                )
            raise SolveError(
                f"the derivatives of the motion of '{system.mechanism.name}' cannot be followed "
                f"beyond t = {state[T_NOW]:.6g} {unit}, it is stiff there: keep more "
                "instants, or take differences by sweep"
            )
        return free

    def _work(self, stretch: ModeStretch, tangents: Tangents) -> Work:
        """A workspace of dual numbers, with weights of free motion, in the modes of a stretch."""
        work = self.system.work(LANES, masses=True)
        work.memory[:, 1:] = 0.0
        width, L = slice(1, 1 + tangents.count), self.system.layout
        work.par[: len(tangents.par), width] = tangents.par
        work.mass[: len(tangents.mass), width] = tangents.mass
        # weights are inverses, 1/m with the change −dm/m², of shares of the masses; what stands in
        # for a missing mass does not change
        share = 1.0 / np.bincount(L.slot_body, minlength=L.bodies)[L.slot_body]
        own = work.mass.reshape(-1, 3, LANES)[L.slot_body] * share[:, None, None]
        weights = work.weight[: 3 * L.slots].reshape(L.slots, 3, LANES)
        there = np.abs(own[:, :, 0] * weights[:, :, 0] - 1.0) < tol.TANGENT_WEIGHT_SAME
        derivatives = -own[:, :, width] * np.square(weights[:, :, :1])
        weights[:, :, width] = np.where(there[:, :, None], derivatives, 0.0)
        for place, amount in self._layout(stretch)[1].items():
            work.formula[place, 0] = amount
        for name, amount in stretch.inputs.items():
            work.signal[self.hold[name], 0] = amount
        work.signal[list(self.hold.values()), width] = tangents.hold
        if count := len(stretch.on):
            self.uni.set_rows(work, stretch.on, stretch.slip_sign)
            work.anchor[:count, 0], work.anchor[:count, width] = stretch.anchor, tangents.anchor
            work.par[self.uni.phase_rows, 0] = stretch.phases
            work.par[self.uni.phase_rows, width] = tangents.phases
        return work


# -- Kernels on dual numbers -------------------------------------------------------------------
# Gaps, rates and guards are what kernels say that they are. Of single instants these run as the
# plain Python that they were written in, on dual numbers in the place of floats.


class _Mathematics:
    """The functions of `math` that these kernels call, of dual numbers, too."""

    inf, nan, pi = math.inf, math.nan, math.pi
    atan2, sqrt, sin, cos = np.arctan2, np.sqrt, np.sin, np.cos

    @staticmethod
    def floor(x: Any) -> float:
        """The greatest whole number up to x, which has no derivative."""
        return math.floor(value(x))

    @staticmethod
    def ceil(x: Any) -> float:
        """The least whole number from x on, which has no derivative."""
        return math.ceil(value(x))


@functools.cache
def on_duals(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of a kernel, and all that it calls, in plain Python."""
    plain: Any = getattr(function, "py_func", function)
    names = dict(plain.__globals__)
    found = types.FunctionType(plain.__code__, names, plain.__name__)
    for name in plain.__code__.co_names:
        one: Any = names.get(name)
        own = getattr(one, "py_func", one)
        if one is math:
            names[name] = _Mathematics
        elif isinstance(own, types.FunctionType) and own.__module__.startswith("mbody.kernels."):
            names[name] = found if own is plain else on_duals(one)
    return found


def _of_any_number(bundle: Bundle | None) -> Any:
    """A copy of a bundle whose floats may be dual numbers."""
    every = {} if bundle is None else bundle.as_dict()
    return SimpleNamespace(
        **{name: one.astype(object if one.dtype == float else int) for name, one in every.items()}
    )


class DualUnilateral:
    """The contact points of one system by dual numbers, as kernels take them."""

    def __init__(self, uni: Unilateral, numbers: Mapping[str, Any]) -> None:
        self.uni, self.system, self.layout = uni, uni.system, uni.layout
        machine = self.system.mechanism
        at: Any = Numbers(dict(numbers), polar_points(machine), machine.bodies)
        contacts = {one.name: one for one in machine.contacts}
        candidates = [one for contact in machine.contacts for one in contact.candidates(at)]
        owners = [contacts[point.name] for point in uni.contact_points]
        self.friction = [one.coefficients(at)[0] for one in owners]
        self.restitution = [one.restitution_of(at) for one in owners]
        self.static = [
            one.coefficients(at)[1] if point.tangent >= 0 else 0.0
            for one, point in zip(owners, uni.contact_points, strict=True)
        ]
        self.edges, self.arcs = edge_rows(candidates, uni.bodies), arc_rows(candidates, uni.bodies)

    def of(self, owner: int) -> Any:
        """The table of the kernels, of edges and arcs those of one contact point alone."""
        table = self.uni.table
        edges = [n for n, point in enumerate(table.edge_point) if point == owner]
        arcs = [n for n, point in enumerate(table.arc_point) if point == owner]
        found = SimpleNamespace(**{name: getattr(table, name) for name in table.fields})
        found.friction, found.static = self.friction, self.static
        found.curve_point = np.zeros(0, dtype=int)
        found.edge_point, found.edge_bodies = table.edge_point[edges], table.edge_bodies[edges]
        found.arc_point, found.arc_bodies = table.arc_point[arcs], table.arc_bodies[arcs]
        found.edge, found.arc = [self.edges[n][3:] for n in edges], [self.arcs[n][4:] for n in arcs]
        return found

    def guard(
        self,
        guard: Guarded | JumpGuard,
        stretch: ModeStretch,
        now: DualInstant,
        work: DualWork | None = None,
    ) -> Any:
        """The value of a guard, by the workspace of the instant or another one; None of one that
        has no derivatives here: ends of curves, gaps that do not close.
        """
        if isinstance(guard, JumpGuard):
            return now.work.formula[guard.number, 0]
        table, owner = self.uni.table, guard.owner
        curved = owner in table.curve_point
        if guard.kind in (EDGE, ENTER) and curved:
            return None
        looks = {
            name: np.empty((1, 1), dtype=object)
            for name in ("value", "rate", "gap", "past", "past_rate")
        }
        ways = {
            name: np.empty((len(table.normal), 2), dtype=object) for name in ("ends", "end_rates")
        }
        G = SimpleNamespace(
            count=[1],
            kind=[guard.kind],
            owner=[owner],
            sense=[guard.sense],
            fresh=[0.0],
            slow=stretch.slow,
            leader=stretch.leader,
            arm=np.empty(7, dtype=object),
            **looks,
            **ways,
        )
        G.held, G.open, G.program = map(_of_any_number, stretch.shared or (None,) * 3)
        on_duals(look)(self.layout, work or now.work, self.of(owner), G, 0, False)
        # what is at an end of its edge and leaves that first closes nothing
        found, rate = G.value[0, 0], value(G.rate[0, 0])
        leaves = guard.kind == CLOSE and rate != rate
        # nor does what is behind a curve and passes its end
        behind = curved and value(found) < -tol.CONTACT_GAP_NONE * self.system.length
        return None if leaves or (behind and guard.kind == CLOSE) else found


# -- Times of mode changes and events, with derivatives ----------------------------------------


class ChangeTimes:
    """Times of changes and events of one motion, ṫ* = −(g_y S + g_p)/ġ."""

    def __init__(
        self, run: Solution, motion: DualMotion, values: dict[str, Any], lost: LostNumbers
    ) -> None:
        self.run, self.motion, self.values, self.lost = run, motion, values, lost
        self.rows = DualUnilateral(motion.uni, values)
        #: By time alone, along which no number changes.
        self.along = DualUnilateral(motion.uni, {name: value(one) for name, one in values.items()})
        self.width = len(lost.names)
        self.short = tol.TIMES_SAME_CHANGES * float(run.t[-1] - run.initial_states[0].start.t[0])
        self.events: list[EventTime] = []
        self.own = [event for event in run.events if not event.contact]
        self.measures = {
            event.name: event_measure(run.mechanism, event)
            for event in run.initial_states[0].request.events
        }
        #: The last change, and its derivatives.
        self.before: tuple[float, Array] = (-np.inf, np.zeros(self.width))

    def when(
        self, stretch: ModeStretch, now: DualInstant, tangents: Tangents, after: ModeStretch
    ) -> DualNumber:
        """The time at which the guard of a stretch is zero, before another one."""
        guard, end = stretch.guard, stretch.end
        assert guard is not None
        ahead = self.ahead(stretch, now, tangents)
        # what is thrown back comes more slowly each time
        again = isinstance(guard, Guarded) and any(
            guard.owner in one.owner for one in stretch.strikes
        )
        row = self._zero(stretch, guard, now, ahead, 0.0 if again else tol.GUARD_GRAZING)
        if row is None:
            why = "the derivative of when that changes is not there"
            if self.rows.guard(guard, stretch, now) is not None:
                why = "what changes there only grazes its limit"
            self.lost.lose(True, end, why)
            row = np.zeros(self.width)
        together = "two changes fall together there, in another order beside it"
        for other in self._others(stretch, now, after):
            zero = self._zero(stretch, other, now, ahead, tol.GUARD_GRAZING)
            gone = True if zero is None else self._differ(row, zero)
            self.lost.lose(gone, end, together)
        if end - self.before[0] <= self.short:
            self.lost.lose(self._differ(row, self.before[1]), end, together)
        self.before = end, row
        self._record(stretch, row)
        return DualNumber(end, np.where(self.lost.gone, 0.0, row))

    def _others(
        self, stretch: ModeStretch, now: DualInstant, after: ModeStretch
    ) -> Iterator[Guarded]:
        """Guards that are zero together with that of a stretch, and follow from the same."""
        guard = stretch.guard
        if not isinstance(guard, Guarded):
            return
        for other in stretch.guards:
            if other == guard or other.fresh or other.of_forces != guard.of_forces:
                continue
            found = self.along.guard(other, stretch, now, now.work.values)
            if found is not None and abs(found) <= tol.GUARD_ZERO * self._size(other, after):
                yield other

    def rooms(self, stretch: ModeStretch, now: DualInstant, tangents: Tangents) -> Iterator[Array]:
        """How the forces of a stretch change (1, directions), in their sizes and where numbers
        change by theirs, that are at their limits where it begins, and stay there.
        """
        for guard in stretch.guards:
            if not (guard.fresh and guard.of_forces) or guard.kind == PARADOX:
                continue
            none = tol.GUARD_ZERO * self._size(guard, stretch)
            rate = self.along.guard(guard, stretch, self.ahead(stretch, now, tangents))
            leaves = float(rate.tangents[0]) * (stretch.end - stretch.t)
            g = self.rows.guard(guard, stretch, now)
            if max(abs(leaves), abs(g.value)) <= none:
                room = tol.CHANGE_RESOLVED * tol.GUARD_ZERO / max(none, tol.TINY)
                yield g.tangents[None] * room / tangents.resolved

    def _size(self, guard: Guarded, stretch: ModeStretch) -> float:
        """With what a guard is compared, as of `mbody.kernels.contact_guards.find_sizes`."""
        if guard.of_forces:
            return 1.0 if guard.kind == PARADOX else float(stretch.force[guard.owner])
        if guard.kind not in (LOCK, STOP):
            return self.motion.system.length
        speed = float(stretch.slow[guard.owner]) / tol.RATE_NONE_FRICTION
        if guard.kind == LOCK:
            return speed
        table = self.motion.uni.table
        return speed / float(table.speed_unit[tangent_of(table, guard.owner)])

    def ahead(self, stretch: ModeStretch, now: DualInstant, tangents: Tangents) -> DualInstant:
        """An instant with derivatives by time along the motion, its one direction."""
        y = DualNumber(now.y.value, now.derivative.value[:, None])
        t = DualNumber(float(now.t), np.ones(1))
        return self.motion.at(stretch, t, y, tangents.none())

    def event(self, event: Any, stretch: ModeStretch, y: DualNumber, tangents: Tangents) -> None:
        """A zero of a measured quantity, with the state at its time."""
        motion, width = self.motion, self.width
        now = motion.at(stretch, DualNumber(event.t, np.zeros(width)), y, tangents)
        ahead = self.ahead(stretch, now, tangents)
        g, rate = (self._measured(event.name, one, part) for one, part in ((now, 0), (ahead, 1)))
        row = np.full(width, np.nan)
        if isinstance(rate, DualNumber) and rate.tangents[0] != 0.0:
            derivatives = g.tangents if isinstance(g, DualNumber) else np.zeros(width)
            row = -derivatives / rate.tangents[0]
        row = np.where(self.lost.gone, np.nan, row)
        self.events.append(EventTime(event.name, "", event.t, row))

    def _differ(self, row: Array, other: Array) -> Array:
        size = np.maximum(np.abs(row), np.abs(other))
        return (
            np.abs(row - other)
            > (tol.TANGENTS_DIFFER + tol.TANGENTS_DIFFER_TOLERANCES * self.motion.settings.rtol)
            * size
        )

    def _zero(
        self, stretch: ModeStretch, guard: Any, now: DualInstant, ahead: DualInstant, grazing: float
    ) -> Array | None:
        """−(g_y S + g_p)/ġ of a guard; None where it has no derivative, or grazes zero."""
        g = self.rows.guard(guard, stretch, now)
        rate = self.along.guard(guard, stretch, ahead)
        if g is None or rate is None:
            return None
        change = float(rate.tangents[0])
        if not abs(change) > grazing * self._usual(guard):
            return None
        return np.asarray(-g.tangents / change)

    def _usual(self, guard: Guarded | JumpGuard) -> float:
        """With what rate a guard changes as a rule; of forces it is not known."""
        n = self.motion.system.coordinates
        scale = self.motion.scale
        speed = float((scale[n : 2 * n] / scale[:n]).max()) * self.motion.system.length
        if isinstance(guard, JumpGuard):
            return guard.size / float(self.run.t[-1] - self.run.initial_states[0].start.t[0])
        if guard.kind == CLOSE:
            return speed
        if guard.kind in (STOP, LOCK):
            return speed * speed / self.motion.system.length
        return 0.0

    def _record(self, stretch: ModeStretch, row: Array) -> None:
        """The events at the end of a stretch."""
        row = np.where(self.lost.gone, np.nan, row)
        for one in self.run.events:
            # the time of what comes to rest is that at which its last flights end
            if one.contact and abs(float(one.state.t[0]) - stretch.end) <= self.short:
                self.events.append(EventTime(one.name, one.contact, one.t, row))

    def _measured(self, name: str, now: DualInstant, part: int) -> Any:
        """Value of an event's measure at an instant; for part 1, without tangents of parameters."""
        instant, n = now.record, self.motion.system.coordinates
        width = instant.tangents.shape[-1]
        record = DualRecord(instant.value[None], instant.tangents[None], self.motion.first_load, n)
        values = self.values
        if part:
            values = {
                one: DualNumber(x.value, np.zeros(width)) if isinstance(x, DualNumber) else x
                for one, x in values.items()
            }
        found = evaluate_measure(dual_solution(self.run, values, record), self.measures[name])[0]
        return found[0] if isinstance(found, DualNumber) and found.ndim else found


# -- Velocities after an impact with their derivatives -----------------------------------------
# An impact solves problems of complementarity; which of their unknowns are not zero the kernel has
# found, and with that it is a chain of linear systems A x = b, whose tangents are those of
# A ẋ = ḃ − Ȧ x. Of numbers that may have tangents the last axis is (value, tangents …).


class OpenImpulses(Exception):
    """No equation decides the impulses on which friction of joints depends."""


class ImpactDuals:
    """The impacts of one system."""

    def __init__(self, rows: DualUnilateral, mass: DualNumber) -> None:
        self.rows, self.mass = rows, mass

    def velocities(
        self, now: DualInstant, strike: Strike, resolved: Array
    ) -> tuple[DualNumber, Array]:
        """Velocities (coordinates,) after an impact at an instant; of what holds by neither an
        impulse nor a rate how room for it changes (limits, directions), beside impulses: it holds
        on where that grows. `resolved`: As of `Tangents`.
        """
        rows, system, width = self.rows, self.rows.system, now.y.tangents.shape[-1]
        n, m = system.coordinates, int((strike.normal == -1).sum())
        U, L, row = rows.uni.table, system.layout, np.empty(system.coordinates, dtype=object)

        def measured(s: int, sign: float) -> tuple[Array, Array]:
            """A row and its rate."""
            on_duals(fill_row)(L, now.work, U, s, sign, row)
            rate = sign * on_duals(row_rate)(L, now.work, U, s)
            return np.array([_lanes(one, width) for one in row]), _lanes(rate, width)

        signs = [(U.normal[k], U.gap_sign[k]) for k in strike.owner[:m]]
        signs += [
            (U.tangent[k] if f < 0 else L.friction_tangent[f], 1.0)
            for k, f in zip(strike.owner[m:], strike.pair[m:], strict=True)
        ]
        W, shifted = (np.array(one) for one in zip(*(measured(*one) for one in signs), strict=True))
        G = joint_rows(system, _lanes(now.work.block[:], width)) * system.row_units[:, None, None]
        held = [measured(s, 1.0)[0] for s in strike.held]
        G = np.concatenate([G, np.array(held).reshape(-1, n, 1 + width)])
        unit = system.coordinate_units[:, None]
        G = G * unit
        kept = np.array(independent_rows(G[:, :, 0]), dtype=int)
        open_ = rank_of(G[:, :, 0]).dependencies
        sizes = self._joint_sizes(now.work, strike, shifted, kept, open_)
        G = G[kept]
        mass, place = _lanes(self.mass[:n], width), np.arange(n)
        slot = L.body_slot[place // 3]
        weight = (now.work.share[slot] * now.work.weight[3 * slot + place % 3]).value
        light = mass[:, 0] * weight < 0.5
        mass[light, 0] = 1.0 / (MASSLESS * weight[light])
        W, mass = W * unit, mass * unit**2
        mass = mass / np.abs(mass[:, 0]).max()
        points = np.where(strike.pair < 0, strike.owner, 0)
        mu = np.array([_lanes(rows.friction[k], width) for k in points])
        e = np.array([_lanes(rows.restitution[k], width) for k in strike.owner[:m]])
        newton = np.array([rows.uni.contact_points[k].law == "newton" for k in strike.owner[:m]])
        bounce = _times(e, shifted[:m]) * strike.rebounds
        shifted[:m] += np.where((newton & (shifted[:m, 0] < 0.0))[:, None], bounce, 0.0)
        v, given = np.zeros((n, 1 + width)), np.zeros((m, 1 + width))
        room, most = list[Array](), np.zeros(1 + width)
        for stage, by_reaction in zip(strike.stages, sizes, strict=True):
            change, impulse, most_of = self._stage(
                stage, strike.normal, mass, G, W, shifted, mu, given, by_reaction
            )
            v, shifted = v + change, shifted + _applied(W, change)
            room += _rooms(stage.limit, impulse, most_of)
            most = np.maximum(most, np.abs(impulse).max(axis=0, initial=0.0))
            given = np.where(newton[:, None], 0.0, _times(e, impulse[:m]))
        y = _lanes(now.y[n : 2 * n], width) + unit * v
        least = most[1:] + most[0] * resolved
        changes = np.array(room).reshape(-1, 1 + width)[:, 1:]
        return DualNumber(y[:, 0], y[:, 1:]), changes / np.maximum(least, tol.TINY)

    def _stage(
        self,
        stage: ImpactStage,
        normal: Array,
        mass: Array,
        G: Array,
        W: Array,
        shifted: Array,
        mu: Array,
        given: Array,
        sizes: dict[int, Array],
    ) -> tuple[Array, Array, dict[int, Array]]:
        """By how much velocities change, impulses, and of tangents the most there may be, where
        rows W have the rates `shifted`: from M Δv = Gᵀ Λ_G + Wᵀ Λ, G Δv = 0 and W Δv = −shifted of
        what holds. `sizes`: Friction of joints by Λ_G.
        """
        n, g, hold = len(mass), len(G), np.flatnonzero(stage.hold)
        sliding = [r for r in np.flatnonzero(stage.slip).tolist() if not stage.hold[r]]
        size, lanes = n + g + len(hold), mass.shape[1:]
        pushed, carried = W.copy(), G.copy()
        for r in sliding:
            if r in sizes:
                carried -= stage.slip[r] * _times(sizes[r][:, None], W[r])
            else:
                pushed[normal[r]] -= stage.slip[r] * _times(mu[r], W[r])
        A, b = np.zeros((size, size, *lanes)), np.zeros((size, *lanes))
        A[range(n), range(n)] = mass
        whole = np.concatenate([carried, pushed[hold]])
        A[:n, n:] = -whole.transpose(1, 0, 2)
        A[n:, :n] = np.concatenate([G, W[hold]])
        for k, one in enumerate(given):
            b[:n] += _times(pushed[k], one)
        b[n + g :] = -shifted[hold]
        x = np.zeros_like(b)
        x[:, 0] = np.linalg.solve(A[..., 0], b[:, 0])
        moved = b[:, 1:] - np.einsum("ijk,j->ik", A[..., 1:], x[:, 0])
        x[:, 1:] = np.linalg.solve(A[..., 0], moved)
        impulse = np.zeros((len(W), *lanes))
        impulse[hold], most = x[n + g :], dict[int, Array]()
        for r in np.flatnonzero(normal != -1).tolist():
            if r in sizes:
                most[r] = _applied(sizes[r][None], x[n : n + g])[0]
            elif (k := normal[r]) >= 0:
                most[r] = _times(mu[r], impulse[k] + given[k])
        for r in sliding:
            impulse[r] = -stage.slip[r] * most[r]
        return x[:n], impulse, most

    def _joint_sizes(
        self, work: Any, strike: Strike, rates: Array, kept: Array, open_: Array
    ) -> Iterator[dict[int, Array]]:
        """Of every stage, by row that slides or is at its limit, by what the size of friction in a
        joint follows from impulses of the rows of joints that are kept: its derivatives, as it is
        homogeneous. Impulses may differ by `open_` (dependencies, rows): refuse a size that does.
        """
        system, width, arm = self.rows.system, rates.shape[-1] - 1, np.empty(7, dtype=object)
        L, place = system.layout, {int(row): n for n, row in enumerate(kept)}
        for stage in strike.stages:
            found = dict[int, Array]()
            counts = (strike.pair >= 0) & ((stage.slip != 0.0) | stage.limit)
            for r in np.flatnonzero(counts & stage.reaction.any(axis=1)).tolist():
                f = int(strike.pair[r])
                work.rate[f, 0] = DualNumber(rates[r, 0], rates[r, 1:])
                on_duals(find_arms)(L, work, f, False, arm)
                ahead = ARMS * int(stage.slip[r] < 0.0)
                law, force = (L.friction_kind[f], *arm[ahead : ahead + ARMS]), stage.reaction[r]
                by = [_lanes(one, width) for one in on_duals(law_size)(*law, *force)[1:]]
                found[r] = np.zeros((len(kept), 1 + width))
                if _open_size(system, f, law, force, open_):
                    raise OpenImpulses
                for row, part in zip(pressing_rows(system, L.friction_node[f]), by, strict=True):
                    if row in place:
                        found[r][place[row]] = -system.row_units[row] * part
            yield found


def slides_by_open_forces(system: System, work: Any, slip_signs: Array) -> bool:
    """Whether friction of joints that slide (pairs,) follows from forces of redundant rows, which
    no equation decides, at the position in a workspace of dual numbers.
    """
    L, arm = system.layout, np.empty(7, dtype=object)
    G = joint_rows(system, work.block[:].value) * system.jacobian_units
    open_ = rank_of(G).dependencies
    for f in np.flatnonzero(slip_signs).tolist():
        on_duals(find_arms)(L, work, f, False, arm)
        law = L.friction_kind[f], *arm[:ARMS]
        if _open_size(system, f, law, np.ones(2), open_):
            return True
    return False


def _open_size(system: System, f: int, law: Sequence[Any], force: Array, open_: Array) -> bool:
    """Whether friction pair f has another size where forces of rows that press differ from `force`
    (2,) by their parts in what is open (dependencies, rows).
    """
    rows = pressing_rows(system, system.layout.friction_node[f])
    units = np.array([system.row_units[row] if row >= 0 else 0.0 for row in rows])
    sizes, plain, parts = list[float](), [value(one) for one in law], open_[:, rows] * (units > 0.0)
    most = np.abs(force / np.where(units > 0.0, units, 1.0)).max()
    for part in parts[np.abs(parts).max(axis=1) > tol.PARTICIPATION_NONE]:
        other = most / np.abs(part).max() * part * units
        sizes += [on_duals(law_size)(*plain, *(force + s * other))[0] for s in (-1.0, 0.0, 1.0)]
    return bool(sizes) and bool(np.ptp(sizes) > tol.PARTICIPATION_NONE * max(sizes))


def _rooms(limit: Array, impulse: Array, most: dict[int, Array]) -> Iterator[Array]:
    """Of rows at a limit the impulse, of tangents what is left of that by friction."""
    for r in np.flatnonzero(limit).tolist():
        sign = 1.0 if impulse[r, 0] > 0.0 else -1.0
        yield most[r] - sign * impulse[r] if r in most else impulse[r]


def _lanes(one: Any, width: int) -> Array:
    """(value, tangents …) of a number, or an array of them."""
    if isinstance(one, DualNumber):
        return np.concatenate([np.asarray(one.value)[..., None], one.tangents], axis=-1)
    return np.append(float(one), np.zeros(width))


def _times(a: Array, b: Array) -> Array:
    """a b of each pair of numbers."""
    found = a[..., :1] * b + a * b[..., :1]
    found[..., 0] = a[..., 0] * b[..., 0]
    return np.asarray(found)


def _applied(A: Array, x: Array) -> Array:
    """A x of a matrix."""
    return np.asarray(_times(A, x).sum(axis=1))


# -- Anchors of sticking and closing, with derivatives -----------------------------------------


def anchored(
    uni: Unilateral, tangents: Tangents, stretch: ModeStretch, now: DualInstant
) -> Tangents:
    """Tangents with the anchors of contacts that begin to stick at an instant, which depend on the
    parameters.
    """
    anchor, phases, work = 0.0 * tangents.anchor, tangents.phases.copy(), now.work
    for k in range(len(uni.every_body)):
        s = tangent_of(uni.table, k)
        rows = [s] if s >= 0 else []
        if k < len(uni.contact_points) and uni.one_way[k]:
            rows.append(uni.contact_points[k].normal)
        for row in rows:
            if not stretch.on[row]:
                continue
            if row == s and k < len(uni.contact_points) and uni.table.circles[k]:
                place = int(uni.layout.primitive_par[uni.layout.active_set[s]]) + 6
                off = on_duals(phase_offset)(uni.layout, work, uni.table, k)
                phases[uni.phase_rows.index(place)] = (work.par[place, 0] + off).tangents
            else:
                anchor[row] = work.phi[2 * written(uni.layout, row), 0].tangents
    return replace(tangents, anchor=anchor, phases=phases)
