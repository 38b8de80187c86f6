"""Instants of a free motion in dual numbers: the motion once more, with derivatives by numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

from mbody.analysis.driven.driven import kinematics
from mbody.analysis.dynamics.integrators import first_auxiliary_states
from mbody.analysis.dynamics.simulate import integrate_phases, motion_start, phase_rows
from mbody.analysis.freedom.mobility import released
from mbody.analysis.initial.initial_state import StartDriver, start_drivers, state_of
from mbody.analysis.singular.singular_positions import Prescribed
from mbody.core import tolerances as tol
from mbody.core.lanes import DualNumber
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.dual_motion import (
    ChangeTimes,
    DualInstant,
    DualMotion,
    ImpactDuals,
    OpenImpulses,
    Tangents,
    anchored,
    slides_by_open_forces,
)
from mbody.derivatives.dual_solution import (
    DualRecord,
    DualSolution,
    EventTime,
    ReportedForces,
    dual_solution,
    dual_values,
    number_sizes,
    number_tangents,
    unit_of,
)
from mbody.derivatives.mode_record import (
    OPEN_FORCES,
    OPEN_IMPULSES,
    LostNumbers,
    ModeStretch,
    stretches_of,
    unfollowed_jumps,
)
from mbody.derivatives.sampled_inputs import SampledInputs, reads_loads
from mbody.errors import ModelError
from mbody.kernels.layout import PER_PRIMITIVE, Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.laws import ConstantSpeed
from mbody.model.driver import AngleDriver, CoordinateDriver
from mbody.model.element import Marker, listed
from mbody.model.joint_limits import JointLimit
from mbody.model.model_notes import with_others
from mbody.model.simulation import STATE
from mbody.quantities import Formula
from mbody.quantities.units import DIMENSIONS
from mbody.solution.histories import link_poses, with_fields
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.solution.traced_instant import driven_motion
from mbody.system.assembler import assemble
from mbody.system.rank import dense, independent_rows, jacobian
from mbody.system.system import System, with_numbers_of

# -- First states of free motions, with derivatives by numbers and by what is prescribed of them

#: Rates of what is prescribed, by place.
RATES = {"angle": "omega", "x": "vx", "y": "vy"}
#: Why there is no derivative by a number.
TIED = "what is prescribed of the beginning does not agree with the joints any more"
#: Places of a body, in the order of a pose, and the directions in which they are measured.
PLACES = (("x", 0.0), ("y", 0.5 * math.pi), ("angle", 0.0))


@dataclass(frozen=True, eq=False)
class FirstState:
    """The start of a motion.

    `y` (numbers,): Coordinates, rates, auxiliary states.
    `tangents` (numbers, names)
    `accelerations` (coordinates,): For sizes alone.
    """

    t: float
    y: np.ndarray
    tangents: np.ndarray
    accelerations: np.ndarray
    settings: IntegrationSettings
    lost: dict[str, str] = field(default_factory=dict)


def first_state(run: Solution, names: Sequence[str], given: bool) -> FirstState:
    """The first state of a motion of `simulate`; `given`: that of another result, which is held."""
    _refuse_motion(run)
    begun = run.initial_states[0]
    system, start = run.system, begun.start
    t, q, v = state_of(system, start)
    n = system.coordinates
    y = np.concatenate([q, v, first_auxiliary_states(system, start)])
    tangents = np.zeros((len(y), len(names)))
    for k, state in enumerate(system.mechanism.states):
        if state.start_number in names:
            tangents[2 * n + k, names.index(state.start_number)] = 1.0
    lost: dict[str, str] = {}
    if not given:
        tangents[: 2 * n], lost = _prescribed(system, start, names)
    return FirstState(t, y, tangents, _accelerations(run), begun.request.settings, lost)


def _accelerations(run: Solution) -> np.ndarray:
    """The accelerations of the first instant, for sizes alone; of what rests with forces those that
    these would give to all mass.
    """
    system, n = run.system, run.system.coordinates
    a = np.abs(run.record.table(slice(2 * n, 3 * n))[0])
    mass = float(system.mass[:n:3, 0].sum())
    if not len(system.layout.active_set) or mass <= 0.0:
        return np.asarray(a)
    primitives = run.record.table(slice(3 * n, 3 * n + PER_PRIMITIVE * len(system.owners)))[0]
    force = float(np.abs(primitives.reshape(-1, PER_PRIMITIVE)[:, 2:4]).max(initial=0.0))
    return np.maximum(a, np.tile([force / mass, force / mass, 0.0], n // 3))


def _refuse_motion(run: Solution) -> None:
    """Refuse motions that nothing here follows in dual numbers."""
    what = _without_derivatives(run)
    if what:
        raise ModelError(
            f"gradient: a motion with {what}, as that of '{run.mechanism.name}', is not "
            "differentiated: compare designs by sweep"
        )


def _without_derivatives(run: Solution) -> str:
    """Feature of a motion through which no derivatives are followed; "" where it has none."""
    machine = run.mechanism
    if machine.groups or run.initial_states[0].request.settings.method == "moreau":
        return "impulses in place of located impacts"
    if len(run.initial_states) > 1:
        return "several parts"
    own = [event for event in run.events if not event.contact]
    if run.ending != "completed" and not (own and own[-1].t == run.t[-1]):
        return "an end before its time"
    return ""


def _prescribed(
    system: System, start: Solution, names: Sequence[str]
) -> tuple[np.ndarray, dict[str, str]]:
    """Derivatives of position and velocity, where the description prescribes all of both; names by
    which there are none, and why.
    """
    settings = system.mechanism.simulation
    n = system.coordinates
    imposed = [] if settings is None else start_drivers(system, settings, rates=False, poses={})
    poses = link_poses(start)
    alone = [
        (f"{body} {place} held", (body, place, direction), poses[body][part], 0.0)
        for body in _alone(system, start)
        for part, (place, direction) in enumerate(PLACES)
        if (body, place) not in {(where[0], where[1]) for _, where, *_ in imposed}
    ]
    fast = [] if settings is None else start_drivers(system, settings, rates=True, poses={})
    rates = {name: speed for name, *_, speed in fast}
    every = [*imposed, *alone]
    free = _free(system, start, every, poses)
    if system.rows + len(free) != n or start.regularization:
        missing = n - system.rows - len(free)
        raise ModelError(
            f"gradient: how the motion of '{system.mechanism.name}' begins is not determined: "
            f"{max(missing, 0)} of its coordinates follow from guesses, which are no numbers: "
            "prescribe as many as are free in the start of its simulation, or give start, a result"
        )
    _refuse_left_out(system, start, [where for name, where, *_ in free if name not in rates])
    driven = _driven(system, [(one, rates.get(one[0], 0.0)) for one in free])
    places: dict[str, str] = {}
    for name, (body, place, _), *_ in free:
        places[f"start.{body}.{place}"] = f"{name}.law.value"
        places[f"start.{body}.{RATES[place]}"] = f"{name}.law.speed"
    made = _start_tangents(system, names)
    own = [name for name in names if name in system.values or name in places]
    every_name = [*own, *(name for name in made if name not in own and name in places)]
    found, lost = np.zeros((2 * n, len(names))), dict[str, str]()
    if not every_name:
        return found, lost
    by = [places.get(name, name) for name in every_name]
    chain = np.zeros((len(by), len(names)))
    for k, name in enumerate(every_name):
        if name in own:
            chain[k, names.index(name)] += 1.0
        if name in made and name not in names:
            chain[k] += made[name]
    run = kinematics(driven, guess=poses)
    whole = DrivenInstants(run, by).at(np.zeros(1, dtype=int), with_loads=False)
    found = whole.record.tangents[0, : 2 * n] @ chain
    for one in every:
        if one not in free:
            _, (body, place, _), *_ = one
            asked = made.get(f"start.{body}.{place}", np.zeros(len(names)))
            if f"start.{body}.{place}" in names:
                asked = np.eye(len(names))[names.index(f"start.{body}.{place}")]
            moved = _tangents_of(whole, body, place, len(by)) @ chain - asked
            most = max(1.0, float(np.abs(moved).max(initial=0.0)))
            lost |= {
                names[int(k)]: TIED
                for k in np.flatnonzero(np.abs(moved) > tol.ROWS_DEPENDENT * most)
            }
    return found, lost


def _refuse_left_out(
    system: System, start: Solution, places: Sequence[tuple[str, str, float]]
) -> None:
    """Refuse rates that the start leaves out and that least kinetic energy decides."""
    _, q, v = state_of(system, start)
    v = v / system.coordinate_units
    rates = [Prescribed(body, RATES[place], 0.0) for body, place, _ in places]
    for one in rates:
        rate = float(one.row(system, q) @ v)
        if abs(rate) > tol.RATE_NONE_MOTION * float(np.abs(v).max()):
            value = one.with_value(system, rate * one.unit(system))
            raise ModelError(
                f"gradient: the start of '{system.mechanism.name}' leaves out {value}, which "
                f"masses decide: give {one.key} in the start of '{one.body}'",
                one.body,
            )


def _driven(system: System, free: list[tuple[StartDriver, float]]) -> System:
    """The system with a driver for each of the prescribed coordinates, its joints without the
    contacts of their limits, which would be made once more.
    """
    whole = system.mechanism
    limits = {one.name for one in whole.contacts if isinstance(one, JointLimit)}
    machine = (with_others(whole, limits, []) if limits else whole).copied()
    for (name, (body, place, direction), value, _), speed in free:
        law = ConstantSpeed(float(value), float(speed))
        if place == "angle":
            machine.add(AngleDriver(name, body, law))
        else:
            machine.add(CoordinateDriver(name, Marker("ground", (0.0, 0.0), direction), body, law))
    return with_numbers_of(assemble(machine), system.values)


def _free(
    system: System, start: Solution, every: list[StartDriver], poses: Mapping[str, Any]
) -> list[StartDriver]:
    """Those of the prescribed coordinates that joints leave free, first ones first."""
    if system.rows + len(every) <= system.coordinates:
        return every
    driven = _driven(system, [(one, 0.0) for one in every])
    G = dense(driven, _workspace(driven, start))[1]
    owners = [driven.owners[int(e)][0].name for e in driven.row_table[0]]
    named = {one[0]: one for one in every}
    order = [row for row, name in enumerate(owners) if name not in named]
    order += map(owners.index, named)
    kept = (owners[order[n]] for n in independent_rows(G[order]))
    return [named[name] for name in kept if name in named]


def _tangents_of(whole: DualSolution, body: str, place: str, count: int) -> np.ndarray:
    """Tangents of a coordinate of a body at the only instant: (numbers,)."""
    if place == "angle":
        found: Any = whole[body].angle
    else:
        point = whole.point(Marker(body, (0.0, 0.0)))
        found = point.x if place == "x" else point.y
    return found.tangents[0] if isinstance(found, DualNumber) else np.zeros(count)


def _alone(system: System, start: Solution) -> list[str]:
    """Bodies that no joint and no driver holds: they begin where their guesses say."""
    _, G = jacobian(system, _workspace(system, start))
    moved = np.abs(G).max(axis=0, initial=0.0).reshape(-1, 3).any(axis=1)
    return [body.name for body in system.mechanism.bodies if not moved[system.bodies[body.name]]]


def _workspace(system: System, start: Solution) -> Work:
    """A workspace at the first position."""
    t, q, _ = state_of(system, start)
    work = system.work()
    work.q[: len(q), 0], work.time[0, 0] = q, t
    laws_of_time(system.runtime(), work)
    return work


def _start_tangents(system: System, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Derivatives of the numbers of the start that formulas make of some parameters."""
    mechanism, settings = system.mechanism, system.mechanism.simulation
    values = dual_values(system, [name for name in names if name in system.values])
    own = {name: values[name] for name in mechanism.parameters}
    places = [n for n, name in enumerate(names) if name in system.values]
    scope, found = mechanism.parameters.scope(own), {}
    for body, state in () if settings is None else settings.start.items():
        for key, given in state.items():
            if not isinstance(given, Formula):
                continue
            made = given.of(DIMENSIONS[STATE[key]]).value(scope)
            if isinstance(made, DualNumber):
                row = np.zeros(len(names))
                row[places] = made.tangents
                found[f"start.{body}.{key}"] = row
    return found


# -- Derivatives along a motion: variational equations, and saltation matrices at changes ------
# A change comes where a guard g(y, p, t) is zero, at a time that depends on the numbers: with the
# tangents S⁻ of the state at a held time and the derivatives f⁻ before and f⁺ after it,
#
#     ṫ* = −(g_y S⁻ + g_p) / ġ,    S⁺ = J_y (S⁻ + f⁻ ṫ*) + J_p + J_t ṫ* − f⁺ ṫ*,
#
# where y⁺ = J(y, p, t) is the impact, or nothing changes but the derivative.
#
# Leine, Nijmeijer: Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), 7.

Array = np.ndarray


class DualWalk:
    """One way through all stretches of a motion."""

    def __init__(
        self,
        motion: DualMotion,
        first: FirstState,
        stretches: Sequence[ModeStretch],
        tangents: Tangents,
        times: ChangeTimes,
        impacts: ImpactDuals,
        inputs: SampledInputs,
    ) -> None:
        self.motion, self.first, self.stretches = motion, first, stretches
        self.run, self.system = motion.run, motion.system
        self.tangents, self.times, self.impacts = tangents, times, impacts
        self.inputs = inputs
        self.lost: LostNumbers = times.lost
        self.derivative_before = np.zeros(len(first.y))
        self.reported = ReportedForces(self.run, times.lost.names)
        #: Where the motion has come to.
        self.y = DualNumber(first.y, first.tangents)

    def records(self, t: Array) -> DualNumber:
        """Records (instants, rows) at rising times."""
        motion, width = self.motion, len(self.lost.names)
        values = np.full((len(t), motion.rows), np.nan)
        changes = np.zeros((len(t), motion.rows, width))
        y = DualNumber(self.first.y, self.first.tangents)
        begun = DualNumber(self.first.t, np.zeros(width))
        before: ModeStretch | None = None
        last: DualNumber | None = None
        for stretch, after_it in zip(self.stretches, [*self.stretches[1:], None], strict=True):
            if stretch.sampled:
                known = last if not begun.tangents.any() else None
                begun, y = self._sampled(before or stretch, begun, y, known)
            self.tangents = self.inputs.enter(stretch, self.tangents)
            self._set_sides(before, stretch, begun, y)
            y = self._entered(before, stretch, begun, y)
            after = before.end if before is not None else -np.inf
            own = [one for one in self.times.own if after < one.t <= stretch.end]
            inside = np.flatnonzero((t > after) & (t <= stretch.end))
            wanted = _within(stretch, np.concatenate([t[inside], [one.t for one in own]]))
            times = np.unique(np.append(wanted, stretch.end))
            found = motion.follow(stretch, stretch.t, y, self.tangents, times)
            places = np.searchsorted(times, wanted)
            events, places = places[len(inside) :], places[: len(inside)]
            values[inside], changes[inside] = found.value[places], found.tangents[places]
            self._report(stretch, inside, t, values, changes)
            self.lost.without(changes, inside)
            for one, place in zip(own, events, strict=True):
                self.times.event(one, stretch, self._state(found[place]), self.tangents)
            last = found[len(times) - 1]
            y = self._state(last)
            self._check_sides(stretch, y)
            begun, now = self._end_time(stretch, y, after_it)
            if stretch.guard is not None:
                at_end = inside[np.abs(t[inside] - stretch.end) <= self.times.short]
                changes[at_end] = np.nan
            elif self._ends(stretch):
                at_end = inside[t[inside] == stretch.end]
                changes[at_end] = now.record.tangents if now is not None else np.nan
                self.lost.without(changes, at_end)
            elif (moving := begun.tangents != 0.0).any():
                at_end = inside[np.abs(t[inside] - stretch.end) <= self.times.short]
                self._meet(changes, at_end, stretch.end, moving)
            before = stretch
        self.y = y
        return DualNumber(values, changes)

    # -- forces that no equation decides ------------------------------------------------------

    def _report(
        self, stretch: ModeStretch, inside: Array, t: Array, values: Array, changes: Array
    ) -> None:
        """Sets the forces of instants of a stretch that are not unique to those reported."""
        instants, own = np.searchsorted(self.run.t, t[inside]), slice(0, self.system.record_rows)
        phases = self.tangents.phases
        for n in self.reported.open_at(instants):
            k, place = int(instants[n]), inside[n]

            def shown(
                system: System, row: Array, number: int, step: float, k: int = k
            ) -> Array | None:
                moved = stretch.phases + step * phases[:, number]
                return self.motion.reported_row(stretch, float(self.run.t[k]), system, row, moved)

            self.reported.derive(k, values[place, own], changes[place, own], shown)

    # -- samples of controllers ---------------------------------------------------------------

    def _sampled(
        self, old: ModeStretch, begun: DualNumber, y: DualNumber, record: DualNumber | None
    ) -> tuple[DualNumber, DualNumber]:
        """Let controllers sample: the time at which inputs change, and the state there. `record`:
        of this state, where it is known.
        """
        tangents = self.inputs.enter(old, self.tangents)
        later = self.inputs.sample(old, begun, y, self.tangents, record)
        if not later.any():
            return begun, y
        now = self.motion.at(old, begun, y, tangents)
        y = self._moved(y, now, DualNumber(begun.value, later))
        return DualNumber(begun.value, begun.tangents + later), y

    def _meet(self, changes: Array, instants: Array, t: float, moving: Array) -> None:
        """Leaves derivatives to positions alone where a time that the parameters move falls on an
        instant.
        """
        n = self.system.coordinates
        if instants.size:
            rows = np.arange(n, self.motion.rows)
            changes[np.ix_(instants, rows, np.flatnonzero(moving))] = np.nan
            self.inputs.meet(t, moving)

    # -- the beginning of a stretch -----------------------------------------------------------

    def _entered(
        self, before: ModeStretch | None, stretch: ModeStretch, begun: DualNumber, y: DualNumber
    ) -> DualNumber:
        """The state at the held time with which a stretch begins, from that at the end of the one
        before it, which moves with the time `begun`.
        """
        motion = self.motion
        if stretch.lost:
            self.lost.lose(True, stretch.t, stretch.lost)
        old, moved = before or stretch, y
        if len(stretch.on):
            if stretch.jerked:
                begun = DualNumber(stretch.t, begun.tangents)
                y = motion.at(old.all_off(), begun, y, self.tangents).y
            if stretch.strikes and not stretch.lost:
                y = self._struck(old, stretch, begun, y)
            now = motion.at(old.all_off(), begun, y, self.tangents)
            self.tangents = anchored(motion.uni, self.tangents, stretch, now)
        derivative = stretch.derivative
        if not begun.tangents.any():
            derivative = np.zeros(len(y.value))
        elif derivative is None:
            derivative = motion.at(stretch, begun, y, self.tangents).derivative.value
        tangents = y.tangents - np.outer(derivative, begun.tangents)
        first = y.value if stretch.y is None else stretch.y
        y = DualNumber(first, tangents)
        if not len(stretch.on):
            return y
        self._at_the_beginning(stretch, begun, moved, y)
        still = DualNumber(begun.value, 0.0 * begun.tangents)
        entered = motion.at(stretch, still, y, self.tangents)
        for room in self.times.rooms(stretch, entered, self.tangents):
            why = "whether what touches presses, or sticks, is at its limit"
            self._one_sided(room, stretch.t, why)
        if motion.regularization and not stretch.lost:
            open_ = slides_by_open_forces(self.system, entered.work, stretch.slip_sign)
            self.lost.lose(open_, stretch.t, OPEN_FORCES)
        after = entered.y
        why = "what touches or sticks from there on would not, with other numbers: another order"
        if before is None:
            why = "other numbers move apart what touches, or move what sticks, at the beginning"
        wrong = self._differ(after.tangents, tangents)
        if stretch.rests:
            self.lost.remark(
                stretch.t,
                "impacts come to rest there, of which there are infinitely many: derivatives from "
                "there on are those of the last that is located, and have some 4 figures",
            )
            wrong &= self._differ(after.tangents, tangents, tol.TANGENTS_DIFFER_AT_REST)
        self.lost.lose(wrong, stretch.t, why)
        return DualNumber(first, np.where(wrong, 0.0, after.tangents))

    def _differ(self, some: Array, others: Array, part: float = tol.TANGENTS_DIFFER) -> Array:
        """By which numbers tangents of a state differ by more than this part, and errors."""
        units = self.motion.scale[: len(some), None]
        most = np.abs(others / units).max(axis=0, initial=0.0)
        difference = np.abs((some - others) / units).max(axis=0, initial=0.0)
        limit = part + tol.TANGENTS_DIFFER_TOLERANCES * self.motion.settings.rtol
        return np.asarray(difference > limit * np.maximum(most, self.tangents.resolved))

    def _at_the_beginning(
        self, stretch: ModeStretch, begun: DualNumber, before: DualNumber, after: DualNumber
    ) -> None:
        """Where a change at the very beginning jumps, other numbers have it or have it not."""
        later = begun.value - self.first.t
        if not begun.tangents.any() or later > tol.TIMES_SAME_BEGINNING * self.motion.run.t[-1]:
            return
        kept = before.tangents - np.outer(self.derivative_before, begun.tangents)
        why = "the motion begins where its modes change, which it does or does not by other numbers"
        self.lost.lose(self._differ(kept, after.tangents), stretch.t, why)

    def _struck(
        self, old: ModeStretch, stretch: ModeStretch, begun: DualNumber, y: DualNumber
    ) -> DualNumber:
        """The state after the impacts with which a stretch begins."""
        n, motion = self.system.coordinates, self.motion
        own = slice(n, 2 * n)
        units = motion.scale[own]
        for strike in stretch.strikes:
            now = motion.at(old.all_off(), begun, y, self.tangents)
            jump = np.abs((strike.after - now.y.value[own]) / units).max()
            size = np.abs(now.y.value[own] / units).max()
            rounding = tol.TANGENTS_DIFFER_TOLERANCES * motion.settings.rtol
            off, room = np.inf, np.zeros((0, 1))
            why = "which contacts take part in the impact is not known"
            try:
                v, room = self.impacts.velocities(now, strike, self.tangents.resolved)
                off = float(np.abs((strike.after - v.value) / units).max())
            except OpenImpulses:
                why = OPEN_IMPULSES
            except np.linalg.LinAlgError:
                pass
            if not off <= tol.TANGENTS_DIFFER * jump + rounding * size:
                self.lost.lose(True, stretch.t, why)
                break
            why = "whether contacts take part in the impact, or stick, is at its limit"
            self._one_sided(room, stretch.t, why)
            state, changes = now.y.value.copy(), now.y.tangents.copy()
            state[own], changes[own] = strike.after, v.tangents
            y = DualNumber(state, changes)
        return y

    def _one_sided(self, room: Array, t: float, why: str) -> None:
        """Of what is at its limit: by numbers for which the room for it (limits, directions) grows
        it goes on as it does, and not where it shrinks.
        """
        if not len(room):
            return
        least = tol.TANGENTS_DIFFER + tol.TANGENTS_DIFFER_TOLERANCES * self.motion.settings.rtol
        grows = np.asarray((room > least).any(axis=0))
        shrinks = np.asarray((room < -least).any(axis=0))
        self.lost.lose(grows & shrinks, t, why)
        for which, side in ((grows & ~shrinks, "greater"), (shrinks & ~grows, "smaller")):
            self.lost.halve(which, t, side, why)

    # -- the end of a stretch -----------------------------------------------------------------

    def _end_time(
        self, stretch: ModeStretch, y: DualNumber, after: ModeStretch | None
    ) -> tuple[DualNumber, DualInstant | None]:
        """The time at which a stretch ends, before another; the instant there that moves with it,
        where the motion ends by an event.
        """
        motion = self.motion
        t = DualNumber(stretch.end, np.zeros(len(self.lost.names)))
        if stretch.guard is None and not self._ends(stretch):
            t = self.inputs.when(stretch.end)
            if t.tangents.any():
                now = motion.at(stretch, DualNumber(t.value, 0.0 * t.tangents), y, self.tangents)
                self.derivative_before = now.derivative.value
                y.tangents[:] = self._moved(y, now, t).tangents
            return t, None
        now = motion.at(stretch, t, y, self.tangents)
        self.derivative_before = now.derivative.value
        if stretch.guard is None:
            row = self.times.events[-1].row
            moved = DualNumber(stretch.end, np.nan_to_num(row))
            state = self._moved(y, now, moved)
            return moved, motion.at(stretch, moved, state, self.tangents)
        t = self.times.when(stretch, now, self.tangents, after or stretch)
        y.tangents[:] = self._moved(y, now, t).tangents
        return t, None

    def _ends(self, stretch: ModeStretch) -> bool:
        """Whether the motion ends with it, by an event of the user."""
        run, events = self.run, self.times.events
        last = stretch is self.stretches[-1] and run.ending != "completed"
        return last and bool(events) and events[-1].t == stretch.end

    def _moved(self, y: DualNumber, now: DualInstant, t: DualNumber) -> DualNumber:
        """A state at a held time as one that moves with a time."""
        return DualNumber(y.value, y.tangents + np.outer(now.derivative.value, t.tangents))

    # -- jumps of formulas --------------------------------------------------------------------

    def _set_sides(
        self, before: ModeStretch | None, stretch: ModeStretch, begun: DualNumber, y: DualNumber
    ) -> None:
        """On which sides the arguments of jumps are in a stretch."""
        if not stretch.sizes:
            return
        place = stretch.crossed
        if before is not None and place is not None:
            stretch.sides = dict(before.sides)
            if place in stretch.sides:
                stretch.sides[place] *= -1.0
                self._check_that_it_crosses(place, stretch, begun, y)
            else:
                self.lost.lose(True, stretch.t, "what jumps there was at its jump before")
            return
        still = DualNumber(begun.value, 0.0 * begun.tangents)
        if stretch.y is not None:
            y = DualNumber(stretch.y, y.tangents)
        stretch.sides = {}
        now = self.motion.at(stretch, still, y, self.tangents)
        ahead = self.times.ahead(stretch, now, self.tangents)
        for place, size in stretch.sizes.items():
            g = now.work.formula[place, 0]
            rate = float(ahead.work.formula[place, 0].tangents[0])
            side = float(np.sign(g.value))
            if abs(g.value) <= tol.GUARD_ZERO * size:
                side = float(np.sign(rate))
                moved = np.abs(g.tangents) > tol.GUARD_ZERO * size * self.tangents.resolved
                why = "the motion begins there where a formula jumps, other numbers beside it"
                self.lost.lose(moved, stretch.t, why)
            if side:
                stretch.sides[place] = side

    def _check_that_it_crosses(
        self, place: int, stretch: ModeStretch, begun: DualNumber, y: DualNumber
    ) -> None:
        """Loses the derivatives where a jump of a formula holds its own argument at zero."""
        still = DualNumber(begun.value, 0.0 * begun.tangents)
        now = self.motion.at(stretch, still, y, self.tangents)
        ahead = self.times.ahead(stretch, now, self.tangents)
        rate = float(ahead.work.formula[place, 0].tangents[0])
        if not rate * stretch.sides[place] > 0.0:
            why = "the jump of a formula (sign, step) holds its own argument at zero"
            self.lost.lose(True, stretch.t, why)

    def _check_sides(self, stretch: ModeStretch, y: DualNumber) -> None:
        """No argument of a jump must have left its side."""
        if not stretch.sizes:
            return
        t = DualNumber(stretch.end, np.zeros(y.tangents.shape[1]))
        g = self.motion.at(stretch, t, y, self.tangents).work.formula[:].value
        for place, size in stretch.sizes.items():
            side = stretch.sides.get(place, 0.0)
            if side * g[place] < -tol.GUARD_BEYOND_ZERO * size or (
                not side and abs(g[place]) > tol.GUARD_BEYOND_ZERO * size
            ):
                why = "a formula (sign, step) has jumped unseen"
                self.lost.lose(True, stretch.t, why)

    # -- shared computations -------------------------------------------------------------------

    def _state(self, record: DualNumber) -> DualNumber:
        """The state of a record."""
        n, owns = self.system.coordinates, self.system.layout.owns
        rows = self.system.auxiliary_rows
        places = np.r_[0 : 2 * n, rows.start : rows.start + owns]
        return DualNumber(record.value[places], record.tangents[places].copy())


def _within(stretch: ModeStretch, t: Array) -> Array:
    """Times of a stretch; those that differ from its ends by rounding are its ends."""
    tolerance = tol.TIMES_SAME * np.abs(t)
    found = np.where(t - stretch.t <= tolerance, stretch.t, t)
    return np.where(stretch.end - t <= tolerance, stretch.end, found)


class FreeInstants:
    """Derivatives of the instants of one motion by some numbers."""

    def __init__(
        self, run: Solution, first: FirstState, names: Iterable[str], whole: System | None = None
    ) -> None:
        self.run, self.first, self.names = run, first, list(names)
        self.unclosed: set[str] = set()
        system = run.system
        own = [name for name in self.names if name in system.values]
        par, mass = number_tangents(system, own)
        places = [self.names.index(name) for name in own]
        self.par = np.zeros((len(par), len(self.names)))
        self.mass = np.zeros((len(mass), len(self.names)))
        self.par[:, places], self.mass[:, places] = par, mass
        self.values = spread(dual_values(system, own), own, self.names)
        self.resolved = _resolved(whole or system, self.names)
        self.sizes = number_sizes(whole or system, self.names)
        self.stretches = stretches_of(run)
        self.lost = self._nothing_lost()
        self.events: list[EventTime] = []
        self.walk: DualWalk | None = None

    @property
    def notes(self) -> list[str]:
        """Notes of places without derivatives."""
        walk = self.walk
        more = [] if walk is None else [*walk.inputs.notes, *walk.reported.notes]
        return [*self.lost.notes(self.run.mechanism.units.time), *more]

    def at(self, instants: Array, with_loads: bool) -> DualSolution:
        """The result at some of its instants with derivatives."""
        return dual_solution(self.run, self.values, self.rows(instants, with_loads))

    def rows(
        self, instants: Array, with_loads: bool, before: FreeInstants | None = None
    ) -> DualRecord:
        """The rows of these instants; `before`: the part of the motion before this one."""
        first, system = self.first, self.run.system
        motion = DualMotion(
            self.run,
            first.settings,
            first.y[system.coordinates : 2 * system.coordinates],
            first.accelerations,
            with_loads or reads_loads(self.run),
        )
        self.lost = self._nothing_lost()
        if before is not None:
            self.lost.go_on_from(before.lost)
        times = ChangeTimes(self.run, motion, self.values, self.lost)
        uni = motion.uni
        tangents = Tangents(
            self.par,
            self.mass,
            np.zeros((len(uni.layout.active_set), len(self.names))),
            self.par[uni.phase_rows],
            np.zeros((len(motion.hold), len(self.names))),
            self.resolved,
        )
        impacts = ImpactDuals(times.rows, DualNumber(system.mass[:, 0], self.mass))
        inputs = SampledInputs(self.run, motion, self.values, self.sizes, self.lost)
        if before is not None and before.walk is not None:
            inputs.go_on_from(before.walk.inputs)
        self.walk = DualWalk(motion, first, self.stretches, tangents, times, impacts, inputs)
        records = self.walk.records(np.array(self.run.t[instants]))
        self._compare(motion, records, instants)
        self.events = times.events
        return DualRecord(records.value, records.tangents, motion.first_load, system.coordinates)

    def _compare(self, motion: DualMotion, records: DualNumber, instants: Array) -> None:
        """Controllers that are no functions of what they read make another motion each time."""
        machine, n = self.run.mechanism, 2 * self.run.system.coordinates
        if not machine.controllers:
            return
        kept = self.run.record.table(slice(0, n))[instants]
        difference = np.abs(records.value[:, :n] - kept) / (motion.scale[:n] + np.abs(kept))
        if float(difference.max(initial=0.0)) <= max(
            tol.STATE_REPEATED, tol.TANGENTS_DIFFER_TOLERANCES * motion.settings.rtol
        ):
            return
        names = listed([one.name for one in machine.controllers])
        why = f"followed again the motion is another: {names} must be functions of what they read"
        self.lost.lose(True, self.first.t, f"{why}, or objects, which are copied with their memory")
        records.tangents[:] = np.nan

    def without_derivative(self, instants: Array, _: DualRecord) -> Array:
        """Which of some instants have no derivatives by any number, (instants,): none; what has
        none by some numbers has NaN.
        """
        return np.zeros(len(instants), dtype=bool)

    def _nothing_lost(self) -> LostNumbers:
        """The numbers that have no derivatives from the beginning on."""
        found = LostNumbers(self.names, self.first.t, self.first.lost)
        for why, which in unfollowed_jumps(self.run.system, self.values).items():
            found.lose(which, self.first.t, why)
        return found


def _resolved(system: System, names: Sequence[str]) -> Array:
    """Of each number the tangents, in sizes of the state, below which errors do not count.

    A mass by which a pendulum does not swing otherwise has tangents of rounding alone, which no
    step is short enough for. A number that is zero has the greatest size of its unit.
    """
    sizes = number_sizes(system, names)
    units = [unit_of(system.mechanism, name) for name in names]
    for k in np.flatnonzero(sizes == 0.0):
        alike = [one for one in system.values if unit_of(system.mechanism, one) == units[k]]
        sizes[k] = number_sizes(system, alike).max(initial=0.0)
    sizes[sizes == 0.0] = np.inf
    return tol.CHANGE_RESOLVED / sizes


def spread(values: dict[str, Any], own: list[str], names: list[str]) -> dict[str, Any]:
    """Dual numbers by the numbers of the description, as such by all the names."""
    places = [names.index(name) for name in own]
    found = dict(values)
    for name, one in values.items():
        if isinstance(one, DualNumber):
            tangents = np.zeros(len(names))
            tangents[places] = one.tangents
            found[name] = DualNumber(one.value, tangents)
    return found


# -- Motions in which drivers are released, in dual numbers: one part after the other ----------
# A driver is released at a set time. Position and rates go on, with their derivatives; from then on
# the system has a freedom more, and the state that the driver has led to is the first one of a free
# motion. Instants at that time belong to the part after it.


class ReleasedInstants:
    """Derivatives of the instants of a motion in which drivers are released."""

    def __init__(self, run: Solution, first: FirstState, names: Sequence[str]) -> None:
        self.run, self.first, self.names = run, first, list(names)
        self.unclosed: set[str] = set()
        system = run.system
        own = [name for name in self.names if name in system.values]
        self.values = spread(dual_values(system, own), own, self.names)
        self.parts = _parts(run)
        self.solved_parts: list[FreeInstants] = []
        self.lost = LostNumbers(self.names, first.t, first.lost)

    @property
    def notes(self) -> list[str]:
        """Notes of places without derivatives."""
        return self.solved_parts[-1].notes if self.solved_parts else []

    @property
    def events(self) -> list[EventTime]:
        """Those of all parts."""
        return [one for part in self.solved_parts for one in part.events]

    def at(self, instants: Array, with_loads: bool) -> DualSolution:
        """The result at some of its instants with derivatives."""
        t, first = np.asarray(self.run.t[instants]), self.first
        loads = len(self.run.mechanism.loads) if with_loads else 0
        system = self.run.system
        first_load = system.record_rows + 1 + 3 * len(system.drivers)
        rows = first_load + loads * system.coordinates
        values, changes = np.zeros((len(t), rows)), np.zeros((len(t), rows, len(self.names)))
        self.solved_parts = []
        for k, run in enumerate(self.parts):
            part = FreeInstants(run, first, self.names, system)
            inside = t >= run.initial_states[0].first if k else np.ones(len(t), dtype=bool)
            if k < len(self.parts) - 1:
                inside &= t < run.t[-1]
            places = np.searchsorted(run.t, t[inside])
            before = self.solved_parts[-1] if k else None
            found = part.rows(places, with_loads, before)
            self._widen(run, found, np.flatnonzero(inside), values, changes)
            self.solved_parts.append(part)
            if k < len(self.parts) - 1:
                first = self._going_on(part, self.parts[k + 1])
        self.lost = self.solved_parts[-1].lost
        record = DualRecord(values, changes, first_load, system.coordinates)
        return self._since_release(t, dual_solution(self.run, self.values, record), record)

    def without_derivative(self, instants: Array, _: DualRecord) -> Array:
        """Instants without derivatives (instants,): none."""
        return np.zeros(len(instants), dtype=bool)

    def _going_on(self, part: FreeInstants, after: Solution) -> FirstState:
        """The state at the end of a part as the first one of the next."""
        begun, walk = after.initial_states[0], part.walk
        assert walk is not None
        t, q, v = state_of(after.system, begun.start)
        n = after.system.coordinates
        accelerations = np.abs(after.record.table(slice(2 * n, 3 * n))[0])
        y = np.concatenate([q, v, first_auxiliary_states(after.system, begun.start)])
        return FirstState(t, y, walk.y.tangents, accelerations, begun.request.settings)

    def _widen(
        self, run: Solution, found: DualRecord, places: Array, values: Array, changes: Array
    ) -> None:
        """Put the rows of a part where those of the whole system are."""
        whole, part = self.run.system, run.system
        to, origin = phase_rows(whole, part)
        to, origin = np.append(to, whole.record_rows), np.append(origin, part.record_rows)
        names = [one.name for one in whole.drivers]
        signals = np.arange(3)
        for k, one in enumerate(part.drivers):
            to = np.append(to, whole.record_rows + 1 + 3 * names.index(one.name) + signals)
            origin = np.append(origin, part.record_rows + 1 + 3 * k + signals)
        first = whole.record_rows + 1 + 3 * len(names)
        loads = np.arange(values.shape[1] - first)
        to, origin = np.append(to, first + loads), np.append(origin, found.loads + loads)
        values[np.ix_(places, to)] = found.values[:, origin]
        changes[np.ix_(places, to)] = found.tangents[:, origin]

    def _since_release(self, t: Array, found: DualSolution, record: DualRecord) -> DualSolution:
        """Of what released drivers drove, the motion from then on."""
        system = self.run.system
        for n, driver in enumerate(system.drivers):
            free = t >= self.run.released.get(driver.name, np.inf)
            if free.any():
                row = system.record_rows + 1 + 3 * n
                for k, one in enumerate(driven_motion(found, driver)):
                    record.values[free, row + k] = one.value[free]
                    record.tangents[free, row + k] = one.tangents[free]
        return found


#: The instants of a motion over time, with derivatives.
MotionInstants: TypeAlias = FreeInstants | ReleasedInstants


def motion_instants(run: Solution, names: Sequence[str], given: bool) -> MotionInstants:
    """The instants of a motion of `simulate`; `given`: whether it begins as another result ends."""
    first = first_state(run, names, given)
    kind = ReleasedInstants if run.released else FreeInstants
    return kind(run, first, list(names))


def _parts(run: Solution) -> list[Solution]:
    """The motion between releases, followed again, each part with its beginning."""
    (begun,) = run.initial_states
    request, system, start = begun.request, begun.system, begun.start
    gone = {name for name, t in run.released.items() if t <= request.first}
    later = {name: t for name, t in run.released.items() if name not in gone}
    last, first, found = float(run.t[-1]), request.first, list[Solution]()
    for until in [*sorted(set(later.values())), np.inf]:
        free = released(system, sorted(gone)) if gone else system
        ends = min(until, float(request.times[-1]))
        times = request.times[(request.times >= first) & (request.times <= ends)]
        times = np.union1d(times, [ends])
        part = replace(request, first=first, times=times, release={})
        one = integrate_phases(free, start, None, part, None)
        found.append(with_fields(one, initial_states=(motion_start(free, start, part),)))
        if one.t[-1] >= last:
            break
        start, first = found[-1], until
        gone |= {name for name, t in later.items() if t == until}
    return found
