"""Instants of a free motion in dual numbers: the motion once more, with derivatives by numbers.

Between two changes of modes the motion obeys the variational equations. A change comes where a
guard g(y, p, t) is zero, at a time that depends on the numbers: with the tangents S⁻ of the state
at a held time and the derivatives f⁻ before and f⁺ after it,

    ṫ* = −(g_y S⁻ + g_p) / ġ,    S⁺ = J_y (S⁻ + f⁻ ṫ*) + J_p + J_t ṫ* − f⁺ ṫ*,

where y⁺ = J(y, p, t) is the impact, or nothing changes but the derivative: the saltation matrix.

Leine, Nijmeijer: Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), 7.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mbody.analysis.initial.initial_state import event_measure
from mbody.core.dual_number import DualNumber
from mbody.derivatives.dual_impacts import ImpactDuals
from mbody.derivatives.dual_motion import DualInstant, DualMotion, Tangents
from mbody.derivatives.dual_solution import DualRecord, DualSolution, dual_solution
from mbody.derivatives.event_time import EventTime
from mbody.derivatives.first_states import FirstState
from mbody.derivatives.guard_duals import GuardDuals
from mbody.derivatives.mode_record import ModeStretch, stretches_of
from mbody.derivatives.named_numbers import number_sizes, unit_of
from mbody.derivatives.number_tangents import dual_values, number_tangents
from mbody.model.element import listed
from mbody.solution.measures import valued
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["FreeInstants"]

Array = np.ndarray

#: A change of the state, in its sizes, by a change of a number by its own size: what is less is
#: integrated with the errors of this one.
RESOLVED = 1e-3
#: Functions of formulas that jump.
JUMPING = re.compile(r"\b(?:sign|step)\s*\(")
#: A rate with which a guard becomes zero below this part of its usual one: it grazes zero.
GRAZING = 1e-6
#: By what part the tangents of a state may differ from what the modes that follow allow; by so many
#: tolerances besides.
APART, TOLERANCES = 1e-5, 1e3
#: A change nearer to the beginning than this part of the time is at it.
BEGINNING = 1e-9
#: Times nearer to each other than this part of the motion are one.
SAME = 1e-12


class FreeInstants:
    """Derivatives of the instants of one motion by some numbers.

    Parameters
    ----------
    run : Solution
        Of `simulate`, of one design.
    first : FirstState
        Where the motion begins, with derivatives.
    names : iterable of str
        Dotted names of numbers of the description; those of the first state are its own.
    """

    def __init__(self, run: Solution, first: FirstState, names: Iterable[str]) -> None:
        self.run, self.first, self.names = run, first, list(names)
        self.unclosed: set[str] = set()
        system = run.system
        own = [name for name in self.names if name in system.values]
        par, mass = number_tangents(system, own)
        places = [self.names.index(name) for name in own]
        self.par = np.zeros((len(par), len(self.names)))
        self.mass = np.zeros((len(mass), len(self.names)))
        self.par[:, places], self.mass[:, places] = par, mass
        self.values = _spread(dual_values(system, own), own, self.names)
        self.resolved = _resolved(system, self.names)
        self.stretches = stretches_of(run)
        #: Numbers by which there is no derivative from some time on, and why: {name: (t, why)}.
        self.lost: dict[str, tuple[float, str]] = {}
        self.events: list[EventTime] = []

    @property
    def notes(self) -> list[str]:
        """Where there are no derivatives."""
        unit, found = self.run.mechanism.units.time, []
        for t, why in dict.fromkeys(self.lost.values()):
            names = [name for name, one in self.lost.items() if one == (t, why)]
            by = "" if len(names) == len(self.names) else f" by {listed(names)}"
            found.append(f"from t = {t:.6g} {unit} on there is no derivative{by}: {why}")
        machine = self.run.mechanism
        parts = {one.name: one for one in (*machine.loads, *machine.states, *machine.drivers)}
        # as they are written: what a formula or a law is made of has no other list
        every = {**parts, **machine.curves}
        jumps = [name for name, one in every.items() if JUMPING.search(repr(one))]
        if jumps:
            found.append(
                f"{listed(jumps)} may jump (sign, step): what a jump on the way adds to the "
                "derivatives is not in them; compare with differences"
            )
        return found

    def at(self, instants: Array, with_loads: bool) -> DualSolution:
        """The result at some of its instants with derivatives.

        Raises
        ------
        SolveError
            Where a user's function failed, or the steps vanish.
        """
        first, system = self.first, self.run.system
        motion = DualMotion(
            self.run,
            first.way,
            first.y[system.coordinates : 2 * system.coordinates],
            first.accelerations,
            with_loads,
        )
        pages = _DualWalk(self, motion).pages(np.array(self.run.t[instants]))
        record = DualRecord(pages.value, pages.tangents, motion.first_load, system.coordinates)
        return dual_solution(self.run, self.values, record)

    def without_derivative(self, instants: Array, _: DualRecord) -> Array:
        """Which of some instants have no derivatives by any number, (instants,): none; what has
        none by some numbers has NaN.
        """
        return np.zeros(len(instants), dtype=bool)


class _DualWalk:
    """One way through all stretches."""

    def __init__(self, instants: FreeInstants, motion: DualMotion) -> None:
        self.all, self.motion = instants, motion
        run = instants.run
        self.system, self.names = run.system, instants.names
        uni = motion.uni
        mass = DualNumber(self.system.mass[:, 0], instants.mass)
        self.guards = GuardDuals(uni, instants.values)
        self.impacts = ImpactDuals(uni, instants.values, mass)
        count, width = len(uni.layout.switched), len(self.names)
        self.tangents = Tangents(
            instants.par,
            instants.mass,
            np.zeros((count, width)),
            instants.par[uni.phase_rows],
            instants.resolved,
        )
        begin = instants.first
        instants.lost = {name: (begin.t, why) for name, why in begin.lost.items()}
        instants.events = []
        self.slope_before = np.zeros(len(begin.y))
        self.short = SAME * float(run.t[-1] - instants.first.t)
        self.own = [event for event in run.events if not event.contact]
        self.measures = {
            event.name: event_measure(run.mechanism, event) for event in run.begun[0].request.events
        }

    def pages(self, t: Array) -> DualNumber:
        """Pages (instants, rows) at rising times."""
        motion, width = self.motion, len(self.names)
        values = np.full((len(t), motion.rows), np.nan)
        changes = np.zeros((len(t), motion.rows, width))
        y = DualNumber(self.all.first.y, self.all.first.tangents)
        begun = DualNumber(self.all.first.t, np.zeros(width))
        before: ModeStretch | None = None
        for stretch in self.all.stretches:
            y = self._entered(before, stretch, begun, y)
            after = stretch.t if before is not None else -np.inf
            own = [one for one in self.own if after < one.t <= stretch.end]
            inside = np.flatnonzero((t > after) & (t <= stretch.end))
            times = np.unique(np.concatenate([t[inside], [one.t for one in own], [stretch.end]]))
            found = motion.followed(stretch, stretch.t, y, self.tangents, times)
            places = np.searchsorted(times, t[inside])
            values[inside], changes[inside] = found.value[places], found.tangents[places]
            self._without_lost(changes, inside)
            for one in own:
                self._own_event(one, stretch, found[int(np.searchsorted(times, one.t))])
            last = found[len(times) - 1]
            y = self._state(last)
            begun, now = self._left(stretch, y)
            if stretch.guard is not None:
                near = inside[np.abs(t[inside] - stretch.end) <= self.short]
                changes[near] = np.nan
            elif self._ends(stretch):
                near = inside[t[inside] == stretch.end]
                changes[near] = now.page.tangents if now is not None else np.nan
                self._without_lost(changes, near)
            before = stretch
        return DualNumber(values, changes)

    # -- the beginning of a stretch -----------------------------------------------------------

    def _entered(
        self, before: ModeStretch | None, stretch: ModeStretch, begun: DualNumber, y: DualNumber
    ) -> DualNumber:
        """The state at the held time with which a stretch begins, from that at the end of the one
        before it, which moves with the time `begun`.
        """
        motion = self.motion
        if stretch.lost:
            self._lose(np.ones(len(self.names), dtype=bool), stretch.t, stretch.lost)
        old, moved = before or stretch, y
        if len(stretch.on):
            if stretch.strikes:
                y = self._struck(old, stretch, begun, y)
            now = motion.at(old.all_off(), begun, y, self.tangents)
            self._anchor(stretch, now)
        slope = stretch.slope
        if slope is None:
            slope = motion.at(stretch, begun, y, self.tangents).slope.value
        held = y.tangents - np.outer(slope, begun.tangents)
        first = y.value if stretch.y is None else stretch.y
        y = DualNumber(first, held)
        if not len(stretch.on):
            return y
        self._at_the_beginning(stretch, begun, moved, y)
        still = DualNumber(begun.value, 0.0 * begun.tangents)
        after = motion.at(stretch, still, y, self.tangents).y
        units = motion.scale[: len(first), None]
        most = np.abs(held / units).max(axis=0, initial=0.0)
        apart = np.abs((after.tangents - held) / units).max(axis=0, initial=0.0)
        limit = APART + TOLERANCES * motion.way.rtol
        wrong = apart > limit * np.maximum(most, self.all.resolved)
        why = "what touches or sticks from there on would not, with other numbers: another order"
        if before is None:
            why = "other numbers move apart what touches, or move what sticks, at the beginning"
        self._lose(wrong, stretch.t, why)
        return DualNumber(first, np.where(wrong, 0.0, after.tangents))

    def _at_the_beginning(
        self, stretch: ModeStretch, begun: DualNumber, before: DualNumber, after: DualNumber
    ) -> None:
        """Where a change at the very beginning jumps, other numbers have it or have it not."""
        motion, first = self.motion, self.all.first
        if not begun.tangents.any() or begun.value - first.t > BEGINNING * motion.run.t[-1]:
            return
        units = motion.scale[: len(after.value), None]
        jump = after.tangents - before.tangents
        jump += np.outer(self.slope_before, begun.tangents)
        most = np.abs(after.tangents / units).max(axis=0, initial=0.0)
        size = np.abs(jump / units).max(axis=0, initial=0.0)
        why = "the motion begins where its modes change, which it does or does not by other numbers"
        self._lose(size > APART * np.maximum(most, self.all.resolved), stretch.t, why)

    def _struck(
        self, old: ModeStretch, stretch: ModeStretch, begun: DualNumber, y: DualNumber
    ) -> DualNumber:
        """The state after the impacts with which a stretch begins."""
        n = self.system.coordinates
        for strike in stretch.strikes:
            if stretch.lost:
                break
            now = self.motion.at(old.all_off(), begun, y, self.tangents)
            v = self.impacts.velocities(now, strike.closed)
            if v is None:
                why = "whether contacts take part in the impact, or stick, is at its limit"
                self._lose(np.ones(len(self.names), dtype=bool), stretch.t, why)
                break
            state, changes = y.value.copy(), y.tangents.copy()
            state[n : 2 * n], changes[n : 2 * n] = v.value, v.tangents
            y = DualNumber(state, changes)
        return y

    def _anchor(self, stretch: ModeStretch, now: DualInstant) -> None:
        """Sticking begins where it does, which depends on the numbers."""
        uni, anchor = self.motion.uni, 0.0 * self.tangents.anchor
        phases = self.tangents.phases.copy()
        for n, touch in enumerate(uni.touches):
            if uni.one_way[n] and stretch.on[touch.normal]:
                unit = uni.unit_of(n)
                anchor[touch.normal] = now.value[touch.normal].tangents / unit
            if touch.tangent < 0 or not stretch.on[touch.tangent]:
                continue
            if touch.spot.solid == "circle":
                e = int(uni.layout.switched[touch.tangent])
                row = int(uni.layout.primitive_par[e])
                place = uni.phase_rows.index(row + 6)
                phases[place] = now.par[row + 6].tangents + self._turned(n, row, now)
            else:
                anchor[touch.tangent] = now.value[touch.tangent].tangents
        for pair in uni.rough:
            if stretch.on[pair.tangent]:
                anchor[pair.tangent] = now.value[pair.tangent].tangents
        self.tangents = Tangents(
            self.tangents.par, self.tangents.mass, anchor, phases, self.tangents.resolved
        )

    def _turned(self, n: int, row: int, now: DualInstant) -> Array:
        """Tangents of the angle by which the row along touch n, of two circles, is turned."""
        ends = []
        for b, k in zip(self.motion.uni.bodies[n], (0, 2), strict=True):
            x, y, angle = self._pose(b, now)
            c, s = np.cos(angle), np.sin(angle)
            ax, ay = now.par[row + k], now.par[row + k + 1]
            ends.append((x + c * ax - s * ay, y + s * ax + c * ay, angle))
        (ax, ay, i), (bx, by, j) = ends
        psi = now.par[row + 4] * i + now.par[row + 5] * j + now.par[row + 6]
        return np.asarray((np.arctan2(by - ay, bx - ax) - psi).tangents)

    def _pose(self, body: int, now: DualInstant) -> tuple[Any, Any, Any]:
        if 3 * body >= self.system.coordinates:
            zero = DualNumber(0.0, np.zeros(len(self.names)))
            return zero, zero, zero
        x, y, angle = (now.y[3 * body + k] for k in range(3))
        return x, y, angle

    # -- the end of a stretch -----------------------------------------------------------------

    def _left(self, stretch: ModeStretch, y: DualNumber) -> tuple[DualNumber, DualInstant | None]:
        """The time at which a stretch ends; the instant there that moves with it, where the motion
        ends by an event.
        """
        width, motion = len(self.names), self.motion
        t = DualNumber(stretch.end, np.zeros(width))
        if stretch.guard is None and not self._ends(stretch):
            return t, None
        now = motion.at(stretch, t, y, self.tangents)
        self.slope_before = now.slope.value
        if stretch.guard is None:
            row = self.all.events[-1].row
            moved = DualNumber(stretch.end, np.nan_to_num(row))
            state = self._moved(y, now, moved)
            return moved, motion.at(stretch, moved, state, self.tangents)
        t = self._when(stretch, now)
        y.tangents[:] = self._moved(y, now, t).tangents
        return t, None

    def _ends(self, stretch: ModeStretch) -> bool:
        """Whether the motion ends with it, by an event of the user."""
        run, events = self.all.run, self.all.events
        last = stretch is self.all.stretches[-1] and run.ending != "completed"
        return last and bool(events) and events[-1].t == stretch.end

    def _moved(self, y: DualNumber, now: DualInstant, t: DualNumber) -> DualNumber:
        """A state at a held time as one that moves with a time."""
        return DualNumber(y.value, y.tangents + np.outer(now.slope.value, t.tangents))

    def _when(self, stretch: ModeStretch, now: DualInstant) -> DualNumber:
        """The time at which the guard of a stretch is zero."""
        guard, width, end = stretch.guard, len(self.names), stretch.end
        assert guard is not None
        every = np.ones(width, dtype=bool)
        ahead = self._ahead(stretch, now)
        row = self._zero(stretch, guard, now, ahead)
        if row is None:
            why = "the derivative of when that changes is not there"
            if self.guards.value(guard, stretch, now) is not None:
                why = "what changes there only grazes its limit"
            self._lose(every, end, why)
            row = np.zeros(width)
        for other in stretch.also:
            if self.guards.kind_of(other) != self.guards.kind_of(guard):
                continue
            beside = self._zero(stretch, other, now, ahead)
            gone = every if beside is None else self._differ(row, beside)
            self._lose(gone, end, "two changes fall together there, in another order beside it")
        self._record(stretch, row)
        return DualNumber(end, np.where(self._gone, 0.0, row))

    def _differ(self, row: Array, other: Array) -> Array:
        size = np.maximum(np.abs(row), np.abs(other))
        return np.abs(row - other) > (APART + TOLERANCES * self.motion.way.rtol) * size

    def _zero(
        self, stretch: ModeStretch, guard: Any, now: DualInstant, ahead: DualInstant
    ) -> Array | None:
        """−(g_y S + g_p)/ġ of a guard; None where it has no derivative, or grazes zero."""
        g, rate = (self.guards.value(guard, stretch, one) for one in (now, ahead))
        if g is None or rate is None:
            return None
        return self._quotient(g.tangents, float(rate.tangents[0]), self._usual(guard))

    def _quotient(self, tangents: Array, rate: float, usual: float) -> Array | None:
        return None if not abs(rate) > GRAZING * usual else -tangents / rate

    def _usual(self, guard: Any) -> float:
        """With what rate a guard changes as a rule; of forces it is not known."""
        n = self.system.coordinates
        scale = self.motion.scale
        speed = float((scale[n : 2 * n] / scale[:n]).max()) * self.system.length
        if guard.kind == "close":
            return speed
        if guard.kind in ("stop", "lock"):
            return speed * speed / self.system.length
        return 0.0

    def _ahead(self, stretch: ModeStretch, now: DualInstant) -> DualInstant:
        """The instant with derivatives by time along the motion, its one direction."""
        y = DualNumber(now.y.value, now.slope.value[:, None])
        t = DualNumber(stretch.end, np.ones(1))
        return self.motion.at(stretch, t, y, self.tangents.none())

    # -- events -------------------------------------------------------------------------------

    def _record(self, stretch: ModeStretch, row: Array) -> None:
        """The events at the end of a stretch."""
        row = np.where(self._gone, np.nan, row)
        for one in self.all.run.events:
            if one.contact and abs(one.t - stretch.end) <= self.short:
                self.all.events.append(EventTime(one.name, one.contact, one.t, row))

    def _own_event(self, event: Any, stretch: ModeStretch, page: DualNumber) -> None:
        """A zero of a measured quantity."""
        motion, width = self.motion, len(self.names)
        y = self._state(page)
        t = DualNumber(event.t, np.zeros(width))
        now = motion.at(stretch, t, y, self.tangents)
        along = DualNumber(now.y.value, now.slope.value[:, None])
        ahead = motion.at(stretch, DualNumber(event.t, np.ones(1)), along, self.tangents.none())
        g, rate = (self._measured(event.name, one, part) for one, part in ((now, 0), (ahead, 1)))
        row = np.full(width, np.nan)
        if isinstance(rate, DualNumber) and rate.tangents[0] != 0.0:
            slopes = g.tangents if isinstance(g, DualNumber) else np.zeros(width)
            row = -slopes / rate.tangents[0]
        row = np.where(self._gone, np.nan, row)
        self.all.events.append(EventTime(event.name, "", event.t, row))

    def _measured(self, name: str, now: DualInstant, part: int) -> Any:
        """What an event is of, at an instant; of its part 1 numbers have no tangents."""
        page, n = now.page, self.system.coordinates
        width = page.tangents.shape[-1]
        record = DualRecord(page.value[None], page.tangents[None], self.motion.first_load, n)
        values = self.all.values
        if part:
            values = {
                one: DualNumber(x.value, np.zeros(width)) if isinstance(x, DualNumber) else x
                for one, x in values.items()
            }
        found = valued(dual_solution(self.all.run, values, record), self.measures[name])[0]
        return found[0] if isinstance(found, DualNumber) and found.ndim else found

    # -- what is shared -----------------------------------------------------------------------

    def _state(self, page: DualNumber) -> DualNumber:
        """The state of a page."""
        n, owns = self.system.coordinates, self.system.layout.owns
        rows = self.system.own_rows
        places = np.r_[0 : 2 * n, rows.start : rows.start + owns]
        return DualNumber(page.value[places], page.tangents[places].copy())

    @property
    def _gone(self) -> Array:
        return np.array([name in self.all.lost for name in self.names], dtype=bool)

    def _lose(self, which: Array, t: float, why: str) -> None:
        """There are no derivatives by some numbers any more."""
        for name, gone in zip(self.names, which, strict=True):
            if gone:
                self.all.lost.setdefault(name, (t, why))

    def _without_lost(self, changes: Array, instants: Array) -> None:
        """NaN by numbers that are lost."""
        gone = np.flatnonzero(self._gone)
        changes[np.ix_(instants, np.arange(changes.shape[1]), gone)] = np.nan


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
    return RESOLVED / sizes


def _spread(values: dict[str, Any], own: list[str], names: list[str]) -> dict[str, Any]:
    """Dual numbers by the numbers of the description, as such by all the names."""
    places = [names.index(name) for name in own]
    found = dict(values)
    for name, one in values.items():
        if isinstance(one, DualNumber):
            tangents = np.zeros(len(names))
            tangents[places] = one.tangents
            found[name] = DualNumber(one.value, tangents)
    return found
