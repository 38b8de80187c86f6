"""The stretches of a motion between changes of modes, as a run of `simulate` meets them."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np

from mbody.analysis.contact.systems_with_modes import has_modes
from mbody.analysis.dynamics.contact_motion import ContactIntegration
from mbody.analysis.dynamics.events import EventIntegration, Guard
from mbody.analysis.dynamics.interruptions import Interruptions
from mbody.analysis.initial.initial_state import state_of
from mbody.core.dual_number import DualNumber
from mbody.core.tolerances import GUARD_ZERO
from mbody.kernels.accelerations import free_motion
from mbody.kernels.contact_guards import guard_sizes
from mbody.kernels.layout import Layout, Work
from mbody.kernels.step_state import TIME
from mbody.laws import Expression, Law, MeasuredFormula, Table
from mbody.laws.kernels import MAX, OPERATIONS, SIGN, STEP, VARIABLE
from mbody.model.closed_mechanism import with_changed
from mbody.model.element import listed
from mbody.model.loads import Damper, Spring, TorsionDamper, TorsionSpring
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System, with_numbers_of

# -- Jumps of formulas along a motion: zeros of the arguments of `sign` and `step` -------------
# Between two jumps each such function is held at the side on which its argument is, so that the
# motion is smooth there; where an argument is zero the derivatives change as at every change of
# modes (`mbody.derivatives.dual_walk`). Corners, of `abs`, `min` and `max`, leave forces as they
# are: they change nothing there.

Array = np.ndarray


@dataclass(frozen=True)
class JumpGuard:
    """The argument of functions that jump where it is zero.

    `number`: Its place among the numbers of the formulas.
    `size`: Its greatest value along the motion.
    """

    number: int
    size: float = 0.0
    kind: ClassVar[str] = "jump"
    direction: ClassVar[int] = 0
    stop: ClassVar[bool] = False
    name: ClassVar[str] = "jump"


def arguments(layout: Layout) -> list[int]:
    """The places of all numbers of which there is a sign or a step."""
    steps = layout.formula_step
    jumping = np.isin(steps[:, 0], (SIGN, STEP)) if len(steps) else np.zeros(0, dtype=bool)
    return [int(place) for place in np.unique(steps[jumping, 1])] if jumping.any() else []


def without_functions(
    layout: Layout, sides: Mapping[int, float]
) -> tuple[Layout, dict[int, float]]:
    """The layout without the functions of these arguments, and what their values are on the sides,
    1 or −1, on which the arguments are, by place.
    """
    steps, values = layout.formula_step.copy(), dict[int, float]()
    for n, (code, a, _, place) in enumerate(layout.formula_step):
        if code in (SIGN, STEP) and int(a) in sides:
            side = sides[int(a)]
            values[int(place)] = side if code == SIGN else max(side, 0.0)
            # the greater one of a number and itself: a step that changes nothing
            steps[n] = MAX, a, a, a
    return layout.replaced(formula_step=steps), values


class JumpWatch(EventIntegration):
    """Integrates a motion once more, and locates where arguments of jumps are zero."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.jumps = [JumpGuard(place) for place in arguments(self.layout)]
        self.first_jump = len(self.events)
        every: list[Any] = self.events
        every += self.jumps
        self.carried = np.append(self.carried, np.zeros(len(self.jumps), dtype=bool))
        #: When which argument is zero.
        self.crossings: list[tuple[float, int]] = []
        self.greatest = dict.fromkeys((one.number for one in self.jumps), 0.0)
        self.aside: Work = self.work.copied()

    def _values(self, which: list[int], t: Array, records: Array) -> Array:
        last = self.first_jump + len(self.jumps)
        ours = [k for k, n in enumerate(which) if self.first_jump <= n < last]
        others = [k for k, n in enumerate(which) if not self.first_jump <= n < last]
        found = np.empty((len(which), len(t)))
        found[others] = super()._values([which[k] for k in others], t, records)
        if ours:
            places = [self.jumps[which[k] - self.first_jump].number for k in ours]
            found[ours] = self._arguments(places, t, records[:, :, 0])
            for place, row in zip(places, found[ours], strict=True):
                self.greatest[place] = max(self.greatest[place], float(np.abs(row).max()))
        return found

    def _arguments(self, places: list[int], t: Array, records: Array) -> Array:
        """Values (places, instants) of arguments."""
        system, work = self.system, self.aside
        n, owns = system.coordinates, system.layout.owns
        first = system.auxiliary_rows.start
        rows = system.layout.input_row
        found = np.empty((len(places), len(t)))
        for k, record in enumerate(records):
            work.q[:n, 0], work.v[:n, 0] = record[:n], record[n : 2 * n]
            work.own[:owns, 0] = record[first : first + owns]
            work.signal[rows, 0] = record[first + owns : first + owns + len(rows)]
            work.time[0, 0] = t[k]
            free_motion(self.layout, work, self.regularization, 0)
            found[:, k] = work.formula[places, 0]
        return found

    def _record(self, event: Any, t: float, record: Array) -> None:
        if isinstance(event, JumpGuard):
            self.crossings.append((t, event.number))
        else:
            super()._record(event, t, record)


# -- Laws and loads that may jump along a motion, followed as formulas or not ------------------

#: Functions of formulas that jump.
JUMPING = re.compile(r"\b(?:sign|step)\s*\(")
#: Functions of formulas with corners, at which accelerations of what is driven jump.
CORNERED = re.compile(r"\b(?:sign|step|abs|min|max|clamp|deadband)\s*\(")
#: Loads whose own law is of a stretch, an angle or a rate that formulas of the instant have.
OF_STRETCH = (Spring, Damper, TorsionSpring, TorsionDamper)


def with_formulas_of_the_instant(system: System) -> System:
    """The system in which laws of loads that jump are formulas of the instant, whose jumps are
    followed; the same where there are none.
    """
    replaced = []
    for load in system.mechanism.loads:
        made: dict[str, Any] = {}
        for name, law in _laws(load).items():
            of_time = load.__dataclass_fields__[name].metadata.get("of") == "time"
            known = of_time or isinstance(load, OF_STRETCH)
            if known and isinstance(law, Expression) and JUMPING.search(law.text):
                made[name] = _of_the_instant(law, "t" if of_time else "x")
        if made:
            replaced.append(replace(load, **made))
    if not replaced:
        return system
    return with_numbers_of(assemble(with_changed(system.mechanism, replaced, ())), system.values)


def _of_the_instant(law: Expression, variable: str) -> MeasuredFormula:
    names = tuple(OPERATIONS[code] for code in law.program)
    variables = (variable,) * sum(code == VARIABLE for code in law.program)
    return MeasuredFormula(law.text, names, variables, law.constants)


def _laws(element: Any) -> dict[str, Law]:
    """The laws of an element by field."""
    found = {part.name: getattr(element, part.name) for part in fields(element)}
    return {name: law for name, law in found.items() if isinstance(law, Law)}


def unfollowed_jumps(system: System, values: Mapping[str, Any]) -> dict[str, Array | bool]:
    """Why derivatives lack what a jump adds, and by which of the numbers: (numbers,), or all.
    `values`: of the description by dotted name, dual ones among them.

    A law of time jumps at a time of its own, which only its own numbers move.
    """
    machine, found = system.mechanism, dict[str, Array | bool]()
    for element in (*machine.inputs, *machine.drivers):
        for law in _laws(element).values():
            if not (isinstance(law, Expression) and CORNERED.search(law.text)):
                continue
            own = [x for name, x in values.items() if name.startswith(f"{element.name}.")]
            moving = [one.tangents != 0.0 for one in own if isinstance(one, DualNumber)]
            if moving:
                why = f"'{element.name}' jumps, or has a corner, at a time that they may move"
                found[why] = np.any(moving, axis=0)
    for load in machine.loads:
        for name, law in _laws(load).items():
            if load.__dataclass_fields__[name].metadata.get("of") == "time":
                continue
            jumps = isinstance(law, Expression) and JUMPING.search(law.text)
            if jumps or _holds(law):
                found[f"the law of '{load.name}' jumps, which is not followed"] = True
    # as they are written: what a formula calls has no other list
    written = repr((*machine.loads, *machine.states, *machine.drivers))
    for name, curve in machine.curves.items():
        if _holds(curve.law) and re.search(rf"\b{name}\s*\(", written):
            found[f"the curve '{name}' jumps, which is not followed"] = True
    return found


def _holds(law: Any) -> bool:
    return isinstance(law, Table) and law.interpolation == "hold"


class LostNumbers:
    """Numbers by which there is no derivative from some time on."""

    def __init__(self, names: Sequence[str], first: float, why: Mapping[str, str]) -> None:
        self.names = list(names)
        self.why = {name: (first, one) for name, one in why.items()}

    @property
    def gone(self) -> Array:
        """Which of them these are, (names,)."""
        return np.array([name in self.why for name in self.names], dtype=bool)

    def lose(self, which: Array | bool, t: float, why: str) -> None:
        """There are no derivatives by some numbers, or by any, any more."""
        some = np.broadcast_to(which, len(self.names))
        for name, gone in zip(self.names, some, strict=True):
            if gone:
                self.why.setdefault(name, (t, why))

    def without(self, changes: Array, instants: Array) -> None:
        """NaN by these numbers in changes (instants, rows, names), at some instants."""
        gone = np.flatnonzero(self.gone)
        changes[np.ix_(instants, np.arange(changes.shape[1]), gone)] = np.nan

    def notes(self, unit: str) -> list[str]:
        """Sentences; times have the unit."""
        found = []
        for t, why in dict.fromkeys(self.why.values()):
            names = [name for name, one in self.why.items() if one == (t, why)]
            by = "" if len(names) == len(self.names) else f" by {listed(names)}"
            found.append(f"from t = {t:.6g} {unit} on there is no derivative{by}: {why}")
        return found


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

    `t`: When it begins.
    `strikes`: Impacts with which it begins, in their order.
    `y`, `derivative`: Its first state, after these, and the derivative there; None where the state
      before goes on.
    `on`, `anchor`, `phases`, `slip_sign`: Rows that are on, where sticking began, phases of the
      rows along two circles, directions of sliding.
    `modes`, `pairs`: Of contact points and of frictional joints.
    `groups`: Contact points that stick by the row of one of them, by that one.
    `inputs`: Inputs that keep their values.
    `guard`: What is zero at the end; None of a set time and of the end of the motion.
    `also`: Others that are zero at the end.
    `lost`: Why there are no derivatives from here on; empty where there are.
    `sides`: On which side arguments of jumps are, 1 or −1, by place: set by what follows the
      motion.
    `crossed`: The argument that was zero where it begins.
    `sizes`: The greatest values of arguments of jumps along the motion, by place.
    `sampled`: Whether controllers may have to sample, or inputs to be set, where it begins.
    """

    t: float
    strikes: tuple[Strike, ...] = ()
    y: Array | None = None
    derivative: Array | None = None
    on: Array = field(default_factory=lambda: np.zeros(0))
    anchor: Array = field(default_factory=lambda: np.zeros(0))
    phases: Array = field(default_factory=lambda: np.zeros(0))
    slip_sign: Array = field(default_factory=lambda: np.zeros(0))
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
        """A stretch with no active constraint and no sliding, as rows are measured alone."""
        return ModeStretch(
            self.t,
            on=0.0 * self.on,
            anchor=0.0 * self.anchor,
            phases=self.phases,
            slip_sign=0.0 * self.slip_sign,
            modes=self.modes,
            pairs=self.pairs,
            inputs=self.inputs,
            sides=self.sides,
        )


def stretches_of(run: Solution) -> list[ModeStretch]:
    """The stretches of a motion of `simulate`."""
    (initial,) = run.initial_states
    system, settings, events = initial.system, initial.request.settings, initial.request.events
    t, q, v = state_of(system, initial.start)
    watch: JumpWatch | None = None
    times = initial.request.times
    going_on = initial.start.restart
    carried = None if going_on is None else (going_on.inputs, going_on.sampled)
    if has_modes(system):
        watch = recorder = ModeRecorder(system, initial.start, settings, events)
        recorder.run(t, q, v, times[times <= run.t[-1]], None, carried=carried)
        found = recorder.stretches
    else:
        found = _between_set_times(run, t, carried)
        if arguments(system.layout):
            watch = JumpWatch(system, initial.start, settings, events)
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
            derivative=None,
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
    times = Interruptions(run.system, run.system.work(), first, last, located=True)
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

    located = True

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.stretches: list[ModeStretch] = []
        self.strikes: list[Strike] = []
        self.why = ""
        #: Whether the next stretch begins at a set time.
        self.set_time = True

    def _begun(self) -> None:
        super()._begun()
        self._begin_stretch()

    def _interrupt(self, t: float) -> None:
        count, self.set_time = len(self.stretches), True
        super()._interrupt(t)
        if self.guards and len(self.stretches) == count:
            self._begin_stretch()

    def _begin_stretch(self) -> None:
        t, count = float(self.state[TIME]), len(self.uni)
        if self.stretches:
            self.stretches[-1].end = t
        self.stretches.append(
            ModeStretch(
                t,
                strikes=tuple(self.strikes),
                y=self.y.copy(),
                derivative=self.K[0].copy(),
                on=self.on,
                anchor=self.work.anchor[:count, 0].copy(),
                phases=self.work.par[self.uni.phase_rows, 0].copy(),
                slip_sign=self.work.slip_sign[: len(self.layout.friction_kind), 0].copy(),
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
        m, G = self.motion, self.guard_table
        found = self._guard_values(self.state[[TIME]], self.record[None])[:, 0]
        guard_sizes(m.layout, m.work, m.stepping, self.uni.table, G, self.record)
        sizes = zip(self.guards, found, G.size, strict=False)
        zero = [each for each, value, size in sizes if abs(value) <= GUARD_ZERO * size]
        one.also = tuple(each for each in zero if each != guard and each not in self.fresh)
        return super()._passed(guard)

    def _impact(self, record: Array) -> None:
        super()._impact(record)
        kind = self.occurred[-1].name if self.occurred else ""
        closed = np.flatnonzero(self.memory.modes.touches).tolist()
        self.strikes.append(Strike(tuple(closed), kind))
        if kind != REBOUND:
            self.why = "impacts come to rest there, of which there are infinitely many"

    def _collided(self, record: Array) -> None:
        super()._collided(record)
        self.why = "an impact without collision follows there (Painlevé's paradox)"

    def _note_several(self, record: Array) -> None:
        self.why = "several accelerations are consistent with the friction there"
        super()._note_several(record)
