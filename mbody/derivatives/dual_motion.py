"""Motions in dual numbers between changes of modes, and single instants with all rows."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.contact.friction_problem import ClosedContacts, StageImpulses
from mbody.analysis.contact.unilateral import SLIP_SIGNS, Unilateral
from mbody.analysis.dynamics.events import Guard
from mbody.analysis.dynamics.integrators import REFINEMENTS, auxiliary_sizes, coordinate_sizes
from mbody.analysis.dynamics.interruptions import hold_inputs, without_hold
from mbody.analysis.dynamics.shared_friction import InstantModes, reported_instant
from mbody.analysis.initial.initial_state import event_measure
from mbody.analysis.position.assembly_analysis import raise_user_error
from mbody.core import tolerances as tol
from mbody.core.dual_number import DualNumber, value
from mbody.core.duals import TANGENTS
from mbody.core.lanes import LANES, aligned
from mbody.derivatives.dual_solution import DualRecord, EventTime, dual_solution
from mbody.derivatives.mode_record import JumpGuard, LostNumbers, ModeStretch, without_functions
from mbody.errors import SolveError
from mbody.kernels.friction import FRICTION_KINDS
from mbody.kernels.layout import PER_PRIMITIVE, Layout, Work, artificial_masses
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.motion_duals import NEXT_LENGTH, T_NOW, FreeDuals, free_duals
from mbody.kernels.step_state import DONE
from mbody.kernels.tableaus import order_8
from mbody.model.contact import ContactCandidate
from mbody.model.element import Numbers
from mbody.solution.measures import evaluate_measure
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.system.rank import joint_rows
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


@dataclass(frozen=True, eq=False)
class DualInstant:
    """One instant in dual numbers.

    `y`, `derivative`: The state, projected on the constraints, and its derivative.
    `record`: As of `mbody.kernels.motion_duals.keep_duals`.
    `value`, `rate`: Of the rows of the active set: Φ and its rate.
    `block`: Φ_q of these.
    `joints`: Φ_q of all others.
    `par`, `signal`, `blocks`, `formula`: Of the workspace.
    """

    t: float
    y: DualNumber
    derivative: DualNumber
    record: DualNumber
    value: DualNumber
    rate: DualNumber
    block: DualNumber
    joints: DualNumber
    par: DualNumber
    signal: DualNumber
    blocks: DualNumber
    formula: DualNumber


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
        self.beside: dict[int, Unilateral] = {}
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
        parts = []
        for first in range(0, max(tangents.count, 1), TANGENTS):
            part = slice(first, min(first + TANGENTS, tangents.count))
            width = slice(1, 1 + part.stop - part.start)
            L, work = self._layout(stretch)[0], self._work(stretch, tangents.part(part))
            work.time[0, width] = t.tangents[part]
            some = DualNumber(y.value, y.tangents[:, part])
            now = np.array([t.value])
            free = self._called(L, work, float(t.value), some, tangents.resolved[part], now)
            parts.append(self._instant(work, free, width))
        if len(parts) == 1:
            return parts[0]
        names = [n for n in vars(parts[0]) if n != "t"]
        return DualInstant(
            parts[0].t, *(_concatenated([getattr(one, n) for one in parts]) for n in names)
        )

    def reported_row(
        self, stretch: ModeStretch, t: float, system: System, row: Array, phases: Array
    ) -> Array | None:
        """A row (rows,) of a system in the modes of a stretch with the forces that are reported;
        None where all are determined.
        """
        if system is not self.system and id(system) not in self.beside:
            self.beside[id(system)] = Unilateral(system)
        uni, work = self.beside.get(id(system), self.uni), system.work()
        n = system.coordinates
        work.q[:n, 0], work.v[:n, 0], work.time[0, 0] = row[:n], row[n : 2 * n], t
        for name, amount in stretch.inputs.items():
            work.signal[self.hold[name], 0] = amount
        uni.set_rows(work, stretch.on, stretch.slip_sign)
        work.par[uni.phase_rows, 0] = phases
        laws_of_time(without_hold(system.runtime(), self.hold), work)
        modes = InstantModes(list(stretch.modes), list(stretch.pairs), stretch.on)
        found = reported_instant(uni, work, uni.read(work), row, modes)
        return None if found.forces is None else found.record

    def _instant(self, work: Work, free: FreeDuals, width: slice) -> DualInstant:
        uni, L = self.uni, self.layout
        nodes, rows, places, columns = uni.places
        lanes = np.r_[0, width]
        v = work.v[:, lanes]
        blocks = work.block[:, lanes]
        count, n3 = len(nodes), self.system.coordinates
        parts = uni.units[rows, None] * blocks[places]
        block = np.zeros((count, n3 + 3, len(lanes)))
        block[rows, columns] = parts
        moving = _product(_dual(parts), _dual(v[columns]))
        rate = np.zeros((count, len(lanes)))
        np.add.at(rate, rows, np.column_stack([moving.value, moving.tangents]))
        rate -= uni.units[:, None] * work.nu[2 * nodes][:, lanes]
        return DualInstant(
            t=float(free.t[0]),
            y=_dual(free.y[:-1, lanes]),
            derivative=_dual(free.K[0][:-1, lanes]),
            record=_dual(free.output[0][:, lanes]),
            value=_dual(uni.units[:, None] * work.phi[2 * nodes][:, lanes]),
            rate=_dual(rate),
            block=_dual(block[:, :n3]),
            joints=_dual(joint_rows(self.system, blocks)),
            par=_dual(work.par[: len(self.system.par), lanes]),
            signal=_dual(work.signal[:, lanes]),
            blocks=_dual(blocks[: 12 * L.nodes]),
            formula=_dual(work.formula[:, lanes]),
        )

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


def _dual(lanes: Array) -> DualNumber:
    """Numbers (…, lanes) of a workspace."""
    return DualNumber(lanes[..., 0].copy(), lanes[..., 1:].copy())


def _product(a: DualNumber, b: DualNumber) -> DualNumber:
    """a b, of each pair; NumPy's chain rule costs more here."""
    tangents = a.tangents * b.value[..., None] + a.value[..., None] * b.tangents
    return DualNumber(a.value * b.value, tangents)


def _concatenated(parts: Sequence[DualNumber]) -> DualNumber:
    """The first number's value with the tangents of all parts side by side."""
    return DualNumber(parts[0].value, np.concatenate([one.tangents for one in parts], axis=-1))


# -- Guards of contact modes in dual numbers ---------------------------------------------------
# The same quantities as of `mbody.analysis.dynamics.contact_guards`, each of one instant.


class GuardDuals:
    """The guards of one system."""

    def __init__(self, uni: Unilateral, numbers: Mapping[str, Any]) -> None:
        self.uni, self.system = uni, uni.system
        contacts = {one.name: one for one in self.system.mechanism.contacts}
        self.numbers = numbers
        at: Any = numbers
        static = {name: one.coefficients(at)[1] for name, one in contacts.items()}
        #: Of every contact point its static friction.
        self.static = [static[point.name] for point in uni.contact_points]

    def value(self, guard: Guard | JumpGuard, stretch: ModeStretch, now: DualInstant) -> Any:
        """The value of a guard, a dual number; None of one that has no derivatives here."""
        if isinstance(guard, JumpGuard):
            return now.formula[guard.number]
        points = self.uni.contact_points
        if guard.kind == "close":
            found = points[guard.number].candidate.sign * now.value[points[guard.number].normal]
            return None if self.behind(guard, now) else found
        if guard.kind == "lock":
            return points[guard.number].candidate.sign * now.rate[points[guard.number].normal]
        if guard.kind == "open":
            return self._pressing(now.record, guard.number)
        if guard.kind in ("edge", "enter"):
            along = self._along(guard.number, now)
            return along if guard.kind == "edge" or along is None else -along
        if guard.kind == "stop":
            row, mode = self._sliding(stretch, guard.number)
            return SLIP_SIGNS[mode] * now.rate[row]
        if guard.kind == "slip" and guard.number < len(points):
            group = stretch.groups.get(guard.number, [guard.number])
            most = sum(self.static[k] * self._pressing(now.record, k) for k in group)
            return most - abs(self._multiplier(now.record, points[guard.number].tangent))
        if guard.kind == "slip":
            return self._reserve(guard.number - len(points), now)
        return None

    def behind(self, guard: Guard | JumpGuard, now: DualInstant) -> bool:
        """Whether what has no gap to close only passes an end of the edge that it is behind."""
        if guard.kind != "close":
            return False
        point = self.uni.contact_points[guard.number]
        gap = float(point.candidate.sign * value(now.value)[point.normal])
        return gap < -tol.CONTACT_GAP_NONE * self.system.length

    def kind_of(self, guard: Guard | JumpGuard) -> bool:
        """Whether a guard follows from forces, not from positions and rates alone."""
        return guard.kind in ("open", "slip", "share", "paradox")

    @functools.cached_property
    def _candidates(self) -> list[ContactCandidate]:
        """Of every contact point where it is, by the numbers."""
        machine = self.system.mechanism
        at = Numbers(dict(self.numbers), polar_points(machine), machine.bodies)
        return [candidate for contact in machine.contacts for candidate in contact.candidates(at)]

    def _along(self, number: int, now: DualInstant) -> Any:
        """Distance of a contact point from the nearer end of its edge, within it; None of arcs."""
        candidate = self._candidates[number]
        if candidate.edge is None or candidate.arcs:
            return None
        (ax, ay), (ux, uy), length = candidate.edge
        (xi, yi, ti), (xj, yj, tj) = (self._pose(body, now) for body in self.uni.bodies[number])
        jx, jy = candidate.position
        px = xj + np.cos(tj) * jx - np.sin(tj) * jy - xi
        py = yj + np.sin(tj) * jx + np.cos(tj) * jy - yi
        x, y = np.cos(ti) * px + np.sin(ti) * py - ax, np.cos(ti) * py - np.sin(ti) * px - ay
        along = ux * x + uy * y
        return along if value(along) <= value(length - along) else length - along

    def _pose(self, body: int, now: DualInstant) -> tuple[Any, Any, Any]:
        """x, y and angle of a body; the ground is the last one."""
        if 3 * body >= self.system.coordinates:
            return 0.0, 0.0, 0.0
        return now.y[3 * body], now.y[3 * body + 1], now.y[3 * body + 2]

    def _sliding(self, stretch: ModeStretch, number: int) -> tuple[int, str]:
        points = self.uni.contact_points
        if number < len(points):
            return points[number].tangent, stretch.modes[number]
        return self.uni.friction_joints[number - len(points)].tangent, stretch.pairs[
            number - len(points)
        ]

    def _multiplier(self, record: DualNumber, row: int) -> DualNumber:
        e = int(self.uni.layout.active_set[row])
        return record[3 * self.system.coordinates + PER_PRIMITIVE * e]

    def _pressing(self, record: DualNumber, number: int) -> Any:
        point = self.uni.contact_points[number]
        return -point.candidate.sign * self._multiplier(record, point.normal)

    def _reserve(self, m: int, now: DualInstant) -> Any:
        """How much more friction a frictional joint that sticks could have: of the nearer
        direction.
        """
        pair, L = self.uni.friction_joints[m], self.uni.layout
        force = self._multiplier(now.record, pair.tangent)
        node = int(L.friction_node[pair.pair])
        first = 3 * self.system.coordinates
        first += PER_PRIMITIVE * int(np.flatnonzero(L.primitive_node == node)[0])
        x, y = now.record[first], now.record[first + 1]
        ahead = self._limit(pair.pair, now, x, y, 1.0) - force
        back = self._limit(pair.pair, now, x, y, -1.0) + force
        return ahead if value(ahead) <= value(back) else back

    def _limit(self, f: int, now: DualInstant, x: Any, y: Any, sign: float) -> Any:
        """Static friction of pair f by the multipliers of what presses it, as of
        `mbody.analysis.contact.friction_problem`.
        """
        L = self.uni.layout
        kind, o = FRICTION_KINDS[int(L.friction_kind[f])], int(L.friction_par[f])
        mu, one, two = now.par[o + 1], now.par[o + 4], now.par[o + 5]
        if kind in ("torque", "force"):
            given = mu * now.signal[int(L.friction_signal[f])]
            size = given * (1.0 + two * sign)
            return size if value(given) > 0.0 and value(size) > 0.0 else 0.0 * size
        if kind == "pin":
            return mu * one / np.sqrt(1.0 + mu * mu) * np.hypot(x, y)
        if kind == "couple":
            return mu * abs(x) + two * sign * x
        if kind == "follower":
            at = 12 * int(L.friction_node[f]) + 6
            push = np.sqrt(now.blocks[at] ** 2 + now.blocks[at + 1] ** 2)
            if value(one) <= 0.0:
                return mu * push * abs(x)
            sine = one * mu / np.sqrt(1.0 + mu * mu)
            return push * sine / np.sqrt(1.0 - sine * sine) * abs(x)
        size = mu * abs(x)
        if kind == "guide" and value(one) > 0.0:
            moment = y + 0.5 * mu * sign * two * x
            ends = 2.0 * mu / one * abs(moment)
            return ends if value(ends) > value(size) else size
        return size


# -- Times of mode changes and events, with derivatives ----------------------------------------


class ChangeTimes:
    """Times of changes and events of one motion, ṫ* = −(g_y S + g_p)/ġ."""

    def __init__(
        self, run: Solution, motion: DualMotion, values: dict[str, Any], lost: LostNumbers
    ) -> None:
        self.run, self.motion, self.values, self.lost = run, motion, values, lost
        self.guards = GuardDuals(motion.uni, values)
        #: By time alone, along which no number changes.
        self.along = GuardDuals(motion.uni, {name: value(one) for name, one in values.items()})
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

    def when(self, stretch: ModeStretch, now: DualInstant, tangents: Tangents) -> DualNumber:
        """The time at which the guard of a stretch is zero."""
        guard, end = stretch.guard, stretch.end
        assert guard is not None
        ahead = self.ahead(stretch, now, tangents)
        row = self._zero(stretch, guard, now, ahead)
        if row is None:
            why = "the derivative of when that changes is not there"
            if self.guards.value(guard, stretch, now) is not None:
                why = "what changes there only grazes its limit"
            self.lost.lose(True, end, why)
            row = np.zeros(self.width)
        together = "two changes fall together there, in another order beside it"
        for other in stretch.also:
            if self.guards.kind_of(other) != self.guards.kind_of(guard):
                continue
            if self.guards.behind(other, now):
                continue
            zero = self._zero(stretch, other, now, ahead)
            if zero is None and other.kind == "close":
                # of edges on one line one comes upon the other where it passes its end
                zero = self._zero(stretch, Guard("enter", other.number), now, ahead)
            gone = True if zero is None else self._differ(row, zero)
            self.lost.lose(gone, end, together)
        if end - self.before[0] <= self.short:
            self.lost.lose(self._differ(row, self.before[1]), end, together)
        self.before = end, row
        self._record(stretch, row)
        return DualNumber(end, np.where(self.lost.gone, 0.0, row))

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
        self, stretch: ModeStretch, guard: Any, now: DualInstant, ahead: DualInstant
    ) -> Array | None:
        """−(g_y S + g_p)/ġ of a guard; None where it has no derivative, or grazes zero."""
        g = self.guards.value(guard, stretch, now)
        rate = self.along.value(guard, stretch, ahead)
        if g is None or rate is None:
            return None
        change = float(rate.tangents[0])
        return (
            None
            if not abs(change) > tol.GUARD_GRAZING * self._usual(guard)
            else -g.tangents / change
        )

    def _usual(self, guard: Guard | JumpGuard) -> float:
        """With what rate a guard changes as a rule; of forces it is not known."""
        n = self.motion.system.coordinates
        scale = self.motion.scale
        speed = float((scale[n : 2 * n] / scale[:n]).max()) * self.motion.system.length
        if isinstance(guard, JumpGuard):
            return guard.size / float(self.run.t[-1] - self.run.initial_states[0].start.t[0])
        if guard.kind == "close":
            return speed
        if guard.kind in ("stop", "lock"):
            return speed * speed / self.motion.system.length
        return 0.0

    def _record(self, stretch: ModeStretch, row: Array) -> None:
        """The events at the end of a stretch."""
        row = np.where(self.lost.gone, np.nan, row)
        for one in self.run.events:
            if one.contact and abs(one.t - stretch.end) <= self.short:
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
# An impact solves problems of complementarity; which of their unknowns are not zero is known from
# the motion, and with that it is a chain of linear systems. They are solved once more for every
# direction with its tangents as tiny imaginary parts (complex step), which loses no figure.
#
# Squire, Trapp: Using complex variables to estimate derivatives of real functions (1998).


class ImpactDuals:
    """The impacts of one system."""

    def __init__(self, uni: Unilateral, numbers: Mapping[str, Any], mass: DualNumber) -> None:
        self.uni, self.mass = uni, mass
        at: Any = numbers
        contacts = {one.name: one for one in uni.system.mechanism.contacts}
        self.friction = [contacts[one.name].coefficients(at)[0] for one in uni.contact_points]
        self.restitution = [contacts[one.name].restitution_of(at) for one in uni.contact_points]

    def velocities(self, now: DualInstant, closed: tuple[int, ...]) -> DualNumber | None:
        """Velocities (coordinates,) after an impact of closed contact points at an instant; None
        where which of them take part is at its limit.
        """
        n = self.uni.system.coordinates
        modes: list[tuple[Array, Array]] = []

        def first(contacts: ClosedContacts, before: Array, given: Array) -> Array | None:
            one = contacts.solution(before, given)
            if one is None or _undecided(contacts, one, before, given):
                return None
            hold, slip_signs = contacts.modes(one)
            scale = 1.0 / np.sqrt(np.maximum(np.diag(contacts.delassus), tol.TINY))
            rows = np.flatnonzero(hold)
            kept = _independent((scale[:, None] * contacts.delassus * scale)[np.ix_(rows, rows)])
            hold[:] = False
            hold[rows[kept]] = True
            modes.append((hold, slip_signs))
            return _impulses_of_modes(contacts, before, given, hold, slip_signs)

        plain = self._after(now, closed, -1, first)
        if plain is None:
            return None
        tangents = np.zeros((n, now.y.tangents.shape[1]))
        # what an impact stops is rounding of the velocities before it
        size = max(np.abs(plain).max(), np.abs(now.y.value[n : 2 * n]).max())
        for k in range(tangents.shape[1]):
            left = iter(modes)

            def again(
                contacts: ClosedContacts, before: Array, given: Array, left: Any = left
            ) -> Array | None:
                return _impulses_of_modes(contacts, before, given, *next(left))

            found = self._after(now, closed, k, again)
            assert found is not None
            if not np.allclose(
                found.real, plain.real, rtol=0.0, atol=tol.TANGENT_IMPACT_SAME * size
            ):
                return None
            tangents[:, k] = found.imag / tol.COMPLEX_STEP
        return DualNumber(plain.real, tangents)

    def _after(self, now: DualInstant, closed: tuple[int, ...], k: int, solve: Any) -> Array | None:
        """Velocities after the impact, with the tangents of direction k as imaginary parts."""
        uni, n, m = self.uni, self.uni.system.coordinates, len(closed)
        block, rate, joints, mass = (
            _with(one, k) for one in (now.block, now.rate, now.joints, self.mass)
        )
        W, rates = np.zeros((2 * m, n), dtype=block.dtype), np.zeros(2 * m, dtype=block.dtype)
        for place, number in enumerate(closed):
            point = uni.contact_points[number]
            W[place] = point.candidate.sign * block[point.normal]
            rates[place] = point.candidate.sign * rate[point.normal]
            if point.tangent >= 0:
                W[m + place], rates[m + place] = block[point.tangent], rate[point.tangent]
        Y = self._responses(joints, mass[:n], W)
        friction = _with_all([self.friction[one] for one in closed], k)
        restitution = _with_all([self.restitution[one] for one in closed], k)
        contacts = ClosedContacts(W @ Y, friction)
        newton = np.array([uni.contact_points[one].law == "newton" for one in closed])
        impulse = _impulses(contacts, rates, restitution, newton, solve)
        if impulse is None:
            return None
        v = _with(now.y, k)[n : 2 * n]
        return np.asarray(v + Y @ impulse)

    def _responses(self, joints: Array, mass: Array, W: Array) -> Array:
        """How velocities change by an impulse along each row, (coordinates, rows), as far as joints
        allow: from [M Gᵀ; G 0], G of rows that do not depend on each other.
        """
        system, n = self.uni.system, len(mass)
        unit = system.coordinate_units
        G = system.row_units[:, None] * joints * unit
        if len(G):
            # the others follow from these
            G = G[_independent(G.real.T)]
        size = float(np.abs(mass.real * unit**2).max())
        inertia = np.diag(mass * unit**2) / size
        count = len(G)
        whole = np.block([[inertia, G.T], [G, np.zeros((count, count))]])
        right = np.vstack([(W * unit).T / size, np.zeros((count, len(W)))])
        return np.asarray(unit[:, None] * np.linalg.solve(whole, right)[:n])


def _impulses(
    contacts: ClosedContacts, before: Array, restitution: Array, newton: Array, solve: Any
) -> Array | None:
    """Impulses (2 m,) of an impact, of any kind of number, stage by stage of `solve`; see
    `mbody.kernels.mode_problem.impact`.
    """
    m, D = len(contacts), contacts.delassus
    shifted = before.copy()
    approach = np.where(before[:m].real < 0.0, before[:m], 0.0)
    shifted[:m] += np.where(newton, restitution, 0.0) * approach
    impulse = solve(contacts, shifted, np.zeros(m))
    if impulse is None:
        return None
    given = np.where(newton, 0.0, restitution) * impulse[:m]
    if not given.any():
        return np.asarray(impulse)
    more = solve(contacts, shifted + D @ impulse + D[:, :m] @ given, given)
    if more is None:
        return None
    more[:m] += given
    return np.asarray(impulse + more)


def _impulses_of_modes(
    contacts: ClosedContacts, before: Array, given: Array, hold: Array, slip_signs: Array
) -> Array | None:
    """(Λ_N, Λ_T) (2 m,) by linear equations, of any kind of number: of rows that `hold` (2 m,), of
    tangents that slide (m,); other impulses are zero. None where rows depend on each other.
    """
    m, D, mu = len(contacts), contacts.delassus, contacts.friction
    size = np.diag(D).real
    # a power of two: unlike its root, dividing by it changes no digit
    unit = float(np.ldexp(1.0, np.frexp(size[size > 0.0][:1])[1]).sum()) or 1.0
    scale = 1.0 / np.sqrt(np.maximum(size / unit, tol.TINY))
    kind = np.result_type(D, before, given, mu)
    A, b = np.eye(2 * m, dtype=kind), np.zeros(2 * m, dtype=kind)
    A[hold] = (scale[:, None] * (D / unit) * scale)[hold]
    b[hold] = -(scale * before / unit)[hold]
    for k in np.flatnonzero(slip_signs):
        if not hold[m + k]:
            A[m + k, k] += slip_signs[k] * mu[k] * scale[k] / scale[m + k]
            b[m + k] = -slip_signs[k] * mu[k] * given[k] / scale[m + k]
    try:
        return np.asarray(scale * np.linalg.solve(A, b))
    except np.linalg.LinAlgError:
        return None


def _undecided(contacts: ClosedContacts, one: StageImpulses, before: Array, given: Array) -> bool:
    """Whether a row is at the limit of its mode: neither force nor velocity, or a full force that
    nothing opposes.
    """
    m, rows = len(contacts), contacts.rows
    scale = 1.0 / np.sqrt(np.maximum(np.diag(contacts.delassus)[rows], tol.TINY))
    forces, rates = one.forces / scale, one.rates * scale
    small = tol.CONTACT_IMPACT_UNKNOWN_NONE * np.abs(forces).max(initial=tol.TINY)
    slow = tol.CONTACT_IMPACT_UNKNOWN_NONE * np.abs(before[rows] * scale).max(initial=tol.TINY)
    if ((forces[:m] <= small) & (rates[:m] <= slow)).any():
        return True
    for r, k in enumerate(rows[m:] - m, start=m):
        limit = contacts.friction[k] * (one.forces[k] + given[k]) / scale[r]
        # friction of what does not press is none, whatever its rate
        if limit > small and limit - abs(forces[r]) <= small and abs(rates[r]) <= slow:
            return True
    return False


def _independent(A: Array) -> Array:
    """Columns of A that do not depend on each other, ascending."""
    from scipy.linalg import qr

    if not A.size:
        return np.zeros(0, dtype=int)
    _, R, order = qr(A, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    return np.sort(order[: len(sizes)][sizes > tol.ROWS_DEPENDENT * max(float(sizes[0]), tol.TINY)])


def _with(one: DualNumber, k: int) -> Array:
    """Values, with the tangents of direction k as imaginary parts; without any for k = −1."""
    if k < 0:
        return np.asarray(one.value)
    return np.asarray(one.value + 1j * tol.COMPLEX_STEP * one.tangents[..., k])


def _with_all(some: list[Any], k: int) -> Array:
    """Complex-step numbers x + i·TINY·tangent k of numbers of which some are dual; plain floats for
    k < 0.
    """
    plain = np.array([float(value(one)) for one in some])
    if k < 0:
        return plain
    parts = [one.tangents[k] if isinstance(one, DualNumber) else 0.0 for one in some]
    return np.asarray(plain + 1j * tol.COMPLEX_STEP * np.array(parts))


# -- Anchors of sticking and closing, with derivatives -----------------------------------------


def anchored(
    uni: Unilateral, tangents: Tangents, stretch: ModeStretch, now: DualInstant
) -> Tangents:
    """Tangents with the anchors of contacts that begin to stick at an instant, which depend on the
    parameters.
    """
    anchor, phases = 0.0 * tangents.anchor, tangents.phases.copy()
    for n, point in enumerate(uni.contact_points):
        if uni.one_way[n] and stretch.on[point.normal]:
            anchor[point.normal] = now.value[point.normal].tangents / uni.unit_of(n)
        if point.tangent < 0 or not stretch.on[point.tangent]:
            continue
        if point.candidate.solid == "circle":
            e = int(uni.layout.active_set[point.tangent])
            row = int(uni.layout.primitive_par[e])
            place = uni.phase_rows.index(row + 6)
            phases[place] = now.par[row + 6].tangents + _phase_tangents(uni, n, row, now)
        else:
            anchor[point.tangent] = now.value[point.tangent].tangents
    for pair in uni.friction_joints:
        if stretch.on[pair.tangent]:
            anchor[pair.tangent] = now.value[pair.tangent].tangents
    return replace(tangents, anchor=anchor, phases=phases)


def _phase_tangents(uni: Unilateral, n: int, row: int, now: DualInstant) -> Array:
    """Tangents of the angle by which the row along contact point n, of two circles, is rotated."""
    found = []
    for b, k in zip(uni.bodies[n], (0, 2), strict=True):
        x, y, angle = _pose(uni, b, now)
        c, s = np.cos(angle), np.sin(angle)
        ax, ay = now.par[row + k], now.par[row + k + 1]
        found.append((x + c * ax - s * ay, y + s * ax + c * ay, angle))
    (ax, ay, i), (bx, by, j) = found
    psi = now.par[row + 4] * i + now.par[row + 5] * j + now.par[row + 6]
    return np.asarray((np.arctan2(by - ay, bx - ax) - psi).tangents)


def _pose(uni: Unilateral, body: int, now: DualInstant) -> tuple[Any, Any, Any]:
    if 3 * body >= uni.system.coordinates:
        zero = DualNumber(0.0, np.zeros(now.y.tangents.shape[1]))
        return zero, zero, zero
    x, y, angle = (now.y[3 * body + k] for k in range(3))
    return x, y, angle
