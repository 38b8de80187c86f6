"""The stretches of a motion between changes of modes, as a run of `simulate` meets them."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.contact.unilateral import has_modes
from mbody.analysis.dynamics.contact_motion import ContactIntegration
from mbody.analysis.dynamics.interruptions import Interruptions
from mbody.analysis.dynamics.jumping_forces import AT_ZERO
from mbody.analysis.dynamics.located import Guard
from mbody.analysis.initial.initial_state import state_of
from mbody.derivatives.formula_jumps import JumpGuard, JumpWatch, arguments
from mbody.kernels.step_state import TIME
from mbody.solution.solution import Solution

__all__ = ["ModeStretch", "Strike", "stretches_of"]

Array = np.ndarray

#: What an impact is that has derivatives; another comes to rest, or is one without collision.
REBOUND = "impact"


@dataclass(frozen=True)
class Strike:
    """An impact: what was closed, and what it is called."""

    closed: tuple[int, ...]
    kind: str


@dataclass(eq=False)
class ModeStretch:
    """A motion between two changes of modes, or set times.

    Attributes
    ----------
    t : float
        When it begins.
    strikes : tuple of Strike
        Impacts with which it begins, in their order.
    y, slope : array or None
        Its first state, after these, and the derivative there; None where the state before goes on.
    on, anchor, phases, sense : arrays
        Rows that are on, where sticking began, phases of the rows along two circles, senses of
        sliding.
    modes, pairs : tuples of str
        Of touches and of rough joints.
    groups : dict
        Touches that stick by the row of one of them, by that one.
    inputs : dict
        Inputs that keep their values.
    end : float
    guard : Guard, JumpGuard or None
        What is zero at the end; None of a set time and of the end of the motion.
    also : tuple of Guard
        Others that are zero at the end.
    lost : str
        Why there are no derivatives from here on; empty where there are.
    sides : dict
        On which side arguments of jumps are, 1 or −1, by place: set by what follows the motion.
    crossed : int or None
        The argument that was zero where it begins.
    sizes : dict
        The greatest values of arguments of jumps along the motion, by place.
    sampled : bool
        Whether controllers may have to sample, or inputs to be set, where it begins.
    """

    t: float
    strikes: tuple[Strike, ...] = ()
    y: Array | None = None
    slope: Array | None = None
    on: Array = field(default_factory=lambda: np.zeros(0))
    anchor: Array = field(default_factory=lambda: np.zeros(0))
    phases: Array = field(default_factory=lambda: np.zeros(0))
    sense: Array = field(default_factory=lambda: np.zeros(0))
    modes: tuple[str, ...] = ()
    pairs: tuple[str, ...] = ()
    groups: dict[int, list[int]] = field(default_factory=dict)
    inputs: dict[str, float] = field(default_factory=dict)
    end: float = np.inf
    guard: Guard | JumpGuard | None = None
    also: tuple[Guard, ...] = ()
    lost: str = ""
    sides: dict[int, float] = field(default_factory=dict)
    crossed: int | None = None
    sizes: dict[int, float] = field(default_factory=dict)
    sampled: bool = False

    def all_off(self) -> ModeStretch:
        """The same with no row on and nothing that slides: what rows measure alone."""
        return ModeStretch(
            self.t,
            on=0.0 * self.on,
            anchor=0.0 * self.anchor,
            phases=self.phases,
            sense=0.0 * self.sense,
            modes=self.modes,
            pairs=self.pairs,
            inputs=self.inputs,
            sides=self.sides,
        )


def stretches_of(run: Solution) -> list[ModeStretch]:
    """The stretches of a motion of `simulate`."""
    (begun,) = run.begun
    system, way, events = begun.system, begun.request.way, begun.request.events
    t, q, v = state_of(system, begun.start)
    watch: JumpWatch | None = None
    times = begun.request.times
    going_on = begun.start.restart
    carried = None if going_on is None else (going_on.inputs, going_on.sampled)
    if has_modes(system):
        watch = recorder = ModeRecorder(system, begun.start, way, events)
        recorder.run(t, q, v, times[times <= run.t[-1]], None, carried=carried)
        found = recorder.stretches
    else:
        found = _between_set_times(run, t, carried)
        if arguments(system.layout):
            watch = JumpWatch(system, begun.start, way, events)
            watch.run(t, q, v, times[times <= run.t[-1]], None, carried=carried)
    found[-1].end = float(run.t[-1])
    return found if watch is None else _at_jumps(found, watch)


def _at_jumps(stretches: list[ModeStretch], watch: JumpWatch) -> list[ModeStretch]:
    """The stretches, parted where arguments of jumps are zero."""
    found = list(stretches)
    for t, place in sorted(watch.crossings):
        k = next((k for k, one in enumerate(found) if one.t < t <= one.end), None)
        if k is None:
            continue
        after = replace(
            found[k],
            t=t,
            strikes=(),
            y=None,
            slope=None,
            inputs=dict(found[k].inputs),
            lost="",
            crossed=place,
            sizes={},
            sampled=False,
        )
        found[k].end, found[k].also = t, ()
        found[k].guard = JumpGuard(place, watch.greatest[place])
        found.insert(k + 1, after)
    for one in found:
        one.sizes = dict(watch.greatest)
    return found


def _between_set_times(run: Solution, first: float, carried: Any) -> list[ModeStretch]:
    """The stretches of a motion whose modes do not change; what controllers set is left open."""
    last = float(run.t[-1])
    times = Interruptions(run.system, run.system.work(), first, last)
    if carried is not None:
        times.restore(*carried)
    for one in times.sampled:
        one.function = functools.partial(_nothing, len(one.controller.sets))
    times.at(first, lambda *_: [])
    found = [ModeStretch(first, inputs=times.inputs(), sampled=True)]
    while (due := times.next(found[-1].t)) < last:
        jump = times.jump_after(due)
        t = due if jump is None else jump
        times.at(t, lambda *_: [])
        found[-1].end = t
        found.append(ModeStretch(t, inputs=times.inputs(), sampled=True))
    return found


def _nothing(count: int, *_: float) -> list[float]:
    """In the place of a controller."""
    return [0.0] * count


class ModeRecorder(JumpWatch, ContactIntegration):
    """Integrates a motion once more, and notes where its modes change."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.stretches: list[ModeStretch] = []
        self.strikes: list[Strike] = []
        self.why = ""
        #: Whether the next stretch begins at a set time.
        self.set_time = True

    def _begin_anew(self) -> None:
        super()._begin_anew()
        self._begin_stretch()

    def _interrupt(self, t: float) -> None:
        count, self.set_time = len(self.stretches), True
        super()._interrupt(t)
        if self.guards and len(self.stretches) == count:
            self._begin_stretch()

    def _begin_stretch(self) -> None:
        t, count = float(self.state[TIME]), len(self.on)
        if self.stretches:
            self.stretches[-1].end = t
        self.stretches.append(
            ModeStretch(
                t,
                strikes=tuple(self.strikes),
                y=self.y.copy(),
                slope=self.K[0].copy(),
                on=self.on.copy(),
                anchor=self.work.anchor[:count, 0].copy(),
                phases=self.work.par[self.uni.phase_rows, 0].copy(),
                sense=self.work.sense[: len(self.layout.friction_kind), 0].copy(),
                modes=tuple(self.modes),
                pairs=tuple(self.pairs),
                groups={k: list(group) for k, group in self.groups.items()},
                inputs=self.interruptions.inputs(),
                lost=self.why,
                sampled=self.set_time,
            )
        )
        self.strikes, self.why, self.set_time = [], "", False

    def _settle_jump(self) -> None:
        self.why = "the rate of a driver jumps there, where bodies touch or rub"
        super()._settle_jump()

    def _passed(self, guard: Guard) -> str:
        one = self.stretches[-1]
        one.guard = guard
        found = zip(self.guards, *self._guarded(), strict=True)
        zero = [each for each, value, size in found if abs(value) <= AT_ZERO * size]
        one.also = tuple(each for each in zero if each != guard and each not in self.fresh)
        return super()._passed(guard)

    def _impact(self, closed: list[int], hit: list[int]) -> str | None:
        status = super()._impact(closed, hit)
        kind = self.occurred[-1].name if self.occurred else ""
        self.strikes.append(Strike(tuple(closed), kind))
        if kind != REBOUND:
            self.why = "impacts come to rest there, of which there are infinitely many"
        return status

    def _without_collision(self, before: tuple[list[str], list[str]]) -> str:
        self.why = "an impact without collision follows there (Painlevé's paradox)"
        return super()._without_collision(before)

    def _note_several(self, page: Array) -> None:
        self.why = "several accelerations are consistent with the friction there"
        super()._note_several(page)
