"""The way through a motion with derivatives: between changes of modes the variational equations,
at changes the saltation matrix.

A change comes where a guard g(y, p, t) is zero, at a time that depends on the numbers: with the
tangents S⁻ of the state at a held time and the derivatives f⁻ before and f⁺ after it,

    ṫ* = −(g_y S⁻ + g_p) / ġ,    S⁺ = J_y (S⁻ + f⁻ ṫ*) + J_p + J_t ṫ* − f⁺ ṫ*,

where y⁺ = J(y, p, t) is the impact, or nothing changes but the derivative.

Leine, Nijmeijer: Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), 7.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.core.dual_number import DualNumber
from mbody.derivatives.change_times import APART, TOLERANCES, ChangeTimes
from mbody.derivatives.dual_impacts import ImpactDuals
from mbody.derivatives.dual_motion import DualInstant, DualMotion, Tangents
from mbody.derivatives.first_states import FirstState
from mbody.derivatives.lost_numbers import LostNumbers
from mbody.derivatives.mode_record import ModeStretch
from mbody.derivatives.sampled_inputs import SampledInputs
from mbody.derivatives.sticking_anchors import anchored

__all__ = ["DualWalk"]

Array = np.ndarray

#: A change nearer to the beginning than this part of the time is at it.
BEGINNING = 1e-9
#: An argument of a jump is zero below this part of its greatest value.
AT_ZERO = 1e-9
#: Times nearer to each other than this part of them are one: no step is as short.
ROUNDING = 1e-13
#: How far beyond zero it may be where another motion has found it to be zero.
BEYOND = 1e-5


class DualWalk:
    """One way through all stretches of a motion.

    Parameters
    ----------
    motion : DualMotion
    first : FirstState
    stretches : sequence of ModeStretch
    tangents : Tangents
        Of the numbers; what sticks is added on the way.
    times : ChangeTimes
    impacts : ImpactDuals
    inputs : SampledInputs
    """

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
        self.slope_before = np.zeros(len(first.y))
        #: Where the motion has come to.
        self.y = DualNumber(first.y, first.tangents)

    def pages(self, t: Array) -> DualNumber:
        """Pages (instants, rows) at rising times."""
        motion, width = self.motion, len(self.lost.names)
        values = np.full((len(t), motion.rows), np.nan)
        changes = np.zeros((len(t), motion.rows, width))
        y = DualNumber(self.first.y, self.first.tangents)
        begun = DualNumber(self.first.t, np.zeros(width))
        before: ModeStretch | None = None
        last: DualNumber | None = None
        for stretch in self.stretches:
            if stretch.sampled:
                known = last if not begun.tangents.any() else None
                begun, y = self._sampled(before or stretch, begun, y, known)
            self.tangents = self.inputs.enter(stretch, self.tangents)
            self._set_sides(before, stretch, begun, y)
            y = self._entered(before, stretch, begun, y)
            after = stretch.t if before is not None else -np.inf
            own = [one for one in self.times.own if after < one.t <= stretch.end]
            inside = np.flatnonzero((t > after) & (t <= stretch.end))
            wanted = _within(stretch, np.concatenate([t[inside], [one.t for one in own]]))
            times = np.unique(np.append(wanted, stretch.end))
            found = motion.followed(stretch, stretch.t, y, self.tangents, times)
            places = np.searchsorted(times, wanted)
            events, places = places[len(inside) :], places[: len(inside)]
            values[inside], changes[inside] = found.value[places], found.tangents[places]
            self.lost.without(changes, inside)
            for one, place in zip(own, events, strict=True):
                self.times.event(one, stretch, self._state(found[place]), self.tangents)
            last = found[len(times) - 1]
            y = self._state(last)
            self._check_sides(stretch, y)
            begun, now = self._left(stretch, y)
            if stretch.guard is not None:
                near = inside[np.abs(t[inside] - stretch.end) <= self.times.short]
                changes[near] = np.nan
            elif self._ends(stretch):
                near = inside[t[inside] == stretch.end]
                changes[near] = now.page.tangents if now is not None else np.nan
                self.lost.without(changes, near)
            elif (moving := begun.tangents != 0.0).any():
                near = inside[np.abs(t[inside] - stretch.end) <= self.times.short]
                self._meet(changes, near, stretch.end, moving)
            before = stretch
        self.y = y
        return DualNumber(values, changes)

    # -- samples of controllers ---------------------------------------------------------------

    def _sampled(
        self, old: ModeStretch, begun: DualNumber, y: DualNumber, page: DualNumber | None
    ) -> tuple[DualNumber, DualNumber]:
        """Let controllers sample: the time at which inputs change, and the state there. `page`: of
        this state, where it is known.
        """
        tangents = self.inputs.enter(old, self.tangents)
        later = self.inputs.sample(old, begun, y, self.tangents, page)
        if not later.any():
            return begun, y
        now = self.motion.at(old, begun, y, tangents)
        y = self._moved(y, now, DualNumber(begun.value, later))
        return DualNumber(begun.value, begun.tangents + later), y

    def _meet(self, changes: Array, near: Array, t: float, moving: Array) -> None:
        """What numbers move falls on an instant: its positions alone have derivatives by them."""
        n = self.system.coordinates
        if near.size:
            rows = np.arange(n, self.motion.rows)
            changes[np.ix_(near, rows, np.flatnonzero(moving))] = np.nan
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
            if stretch.strikes:
                y = self._struck(old, stretch, begun, y)
            now = motion.at(old.all_off(), begun, y, self.tangents)
            self.tangents = anchored(motion.uni, self.tangents, stretch, now)
        slope = stretch.slope
        if not begun.tangents.any():
            slope = np.zeros(len(y.value))
        elif slope is None:
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
        wrong = apart > limit * np.maximum(most, self.tangents.resolved)
        why = "what touches or sticks from there on would not, with other numbers: another order"
        if before is None:
            why = "other numbers move apart what touches, or move what sticks, at the beginning"
        self.lost.lose(wrong, stretch.t, why)
        return DualNumber(first, np.where(wrong, 0.0, after.tangents))

    def _at_the_beginning(
        self, stretch: ModeStretch, begun: DualNumber, before: DualNumber, after: DualNumber
    ) -> None:
        """Where a change at the very beginning jumps, other numbers have it or have it not."""
        motion, first = self.motion, self.first
        if not begun.tangents.any() or begun.value - first.t > BEGINNING * motion.run.t[-1]:
            return
        units = motion.scale[: len(after.value), None]
        jump = after.tangents - before.tangents
        jump += np.outer(self.slope_before, begun.tangents)
        most = np.abs(after.tangents / units).max(axis=0, initial=0.0)
        size = np.abs(jump / units).max(axis=0, initial=0.0)
        why = "the motion begins where its modes change, which it does or does not by other numbers"
        self.lost.lose(size > APART * np.maximum(most, self.tangents.resolved), stretch.t, why)

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
                self.lost.lose(True, stretch.t, why)
                break
            state, changes = y.value.copy(), y.tangents.copy()
            state[n : 2 * n], changes[n : 2 * n] = v.value, v.tangents
            y = DualNumber(state, changes)
        return y

    # -- the end of a stretch -----------------------------------------------------------------

    def _left(self, stretch: ModeStretch, y: DualNumber) -> tuple[DualNumber, DualInstant | None]:
        """The time at which a stretch ends; the instant there that moves with it, where the motion
        ends by an event.
        """
        motion = self.motion
        t = DualNumber(stretch.end, np.zeros(len(self.lost.names)))
        if stretch.guard is None and not self._ends(stretch):
            t = self.inputs.when(stretch.end)
            if t.tangents.any():
                now = motion.at(stretch, DualNumber(t.value, 0.0 * t.tangents), y, self.tangents)
                self.slope_before = now.slope.value
                y.tangents[:] = self._moved(y, now, t).tangents
            return t, None
        now = motion.at(stretch, t, y, self.tangents)
        self.slope_before = now.slope.value
        if stretch.guard is None:
            row = self.times.events[-1].row
            moved = DualNumber(stretch.end, np.nan_to_num(row))
            state = self._moved(y, now, moved)
            return moved, motion.at(stretch, moved, state, self.tangents)
        t = self.times.when(stretch, now, self.tangents)
        y.tangents[:] = self._moved(y, now, t).tangents
        return t, None

    def _ends(self, stretch: ModeStretch) -> bool:
        """Whether the motion ends with it, by an event of the user."""
        run, events = self.run, self.times.events
        last = stretch is self.stretches[-1] and run.ending != "completed"
        return last and bool(events) and events[-1].t == stretch.end

    def _moved(self, y: DualNumber, now: DualInstant, t: DualNumber) -> DualNumber:
        """A state at a held time as one that moves with a time."""
        return DualNumber(y.value, y.tangents + np.outer(now.slope.value, t.tangents))

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
            g, rate = now.formula[place], float(ahead.formula.tangents[place, 0])
            side = float(np.sign(g.value))
            if abs(g.value) <= AT_ZERO * size:
                side = float(np.sign(rate))
                moved = np.abs(g.tangents) > AT_ZERO * size * self.tangents.resolved
                why = "the motion begins there where a formula jumps, other numbers beside it"
                self.lost.lose(moved, stretch.t, why)
            if side:
                stretch.sides[place] = side

    def _check_that_it_crosses(
        self, place: int, stretch: ModeStretch, begun: DualNumber, y: DualNumber
    ) -> None:
        """What jumps must not be driven back to its jump."""
        still = DualNumber(begun.value, 0.0 * begun.tangents)
        now = self.motion.at(stretch, still, y, self.tangents)
        rate = float(self.times.ahead(stretch, now, self.tangents).formula.tangents[place, 0])
        if not rate * stretch.sides[place] > 0.0:
            why = "the jump of a formula (sign, step) holds its own argument at zero"
            self.lost.lose(True, stretch.t, why)

    def _check_sides(self, stretch: ModeStretch, y: DualNumber) -> None:
        """No argument of a jump must have left its side."""
        if not stretch.sizes:
            return
        t = DualNumber(stretch.end, np.zeros(y.tangents.shape[1]))
        g = self.motion.at(stretch, t, y, self.tangents).formula.value
        for place, size in stretch.sizes.items():
            side = stretch.sides.get(place, 0.0)
            if side * g[place] < -BEYOND * size or (not side and abs(g[place]) > BEYOND * size):
                why = "a formula (sign, step) has jumped unseen"
                self.lost.lose(True, stretch.t, why)

    # -- what is shared -----------------------------------------------------------------------

    def _state(self, page: DualNumber) -> DualNumber:
        """The state of a page."""
        n, owns = self.system.coordinates, self.system.layout.owns
        rows = self.system.own_rows
        places = np.r_[0 : 2 * n, rows.start : rows.start + owns]
        return DualNumber(page.value[places], page.tangents[places].copy())


def _within(stretch: ModeStretch, t: Array) -> Array:
    """Times of a stretch; those that differ from its ends by rounding are its ends."""
    near = ROUNDING * np.abs(t)
    found = np.where(t - stretch.t <= near, stretch.t, t)
    return np.where(stretch.end - t <= near, stretch.end, found)
