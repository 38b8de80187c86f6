"""Inputs that controllers set along a motion, with derivatives.

Between two samples an input keeps its value u, whose derivatives are numbers of the variational
equations like any other; at a sample they become those of what the controller computes from what it
reads, u̇ = c_r (r_y S + r_p) with all that it remembers. Samples are at set times, unless the sample
time or the delay is one of the numbers: sample k of a sample time T then moves by k Ṫ, and the
derivatives of the state jump by (f⁻ − f⁺) ṫ, as at every change.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbody.analysis.dynamics.interruptions import Interruptions, SampledState
from mbody.analysis.initial.initial_state import state_of
from mbody.core.lanes import DualNumber, value
from mbody.core.tolerances import DIFFERENCE_STEP_INPUTS, TIMES_MOVE_ALIKE, TIMES_SAME_SAMPLE
from mbody.derivatives.dual_motion import DualMotion, Tangents
from mbody.derivatives.dual_solution import DualRecord, dual_solution
from mbody.derivatives.mode_record import LostNumbers, ModeStretch
from mbody.derivatives.reduced_measures import MeasureProgram, recorded_measure
from mbody.model.element import listed
from mbody.model.simulation import Measure, measure_named
from mbody.model.states import Controller
from mbody.quantities import parse
from mbody.solution.measures import evaluate_measure
from mbody.solution.solution import Solution

# -- Functions of controllers with derivatives, by the samples of one motion -------------------
# A function of the user's is called with dual numbers, so that what it computes, and what it
# remembers, has exact derivatives. Where it takes plain numbers only, as `math.sin` and NumPy's
# arrays of floats do, copies of it follow the same samples for numbers a little greater and
# smaller, each with a memory of its own: differences of what these return.

Array = np.ndarray


class ControllerDuals:
    """One controller along a motion. `sizes` (numbers,)."""

    def __init__(self, controller: Controller, function: Callable[..., Any], sizes: Array) -> None:
        self.controller, self.function = controller, function
        self.steps = DIFFERENCE_STEP_INPUTS * np.where(
            (sizes > 0.0) & np.isfinite(sizes), sizes, 1.0
        )
        self.exact: Any = copy.deepcopy(function)
        #: Of the differences: the function itself, then for each number one above and one below.
        self.copies: list[Callable[..., Any]] = []
        self.samples: list[tuple[DualNumber, list[DualNumber]]] = []

    @property
    def differenced(self) -> bool:
        """Whether differences are taken."""
        return bool(self.copies)

    def __call__(self, t: DualNumber, reads: Sequence[DualNumber]) -> dict[str, DualNumber]:
        """Dual values of the inputs that the controller sets at the next sample."""
        self.samples.append((t, list(reads)))
        if self.exact is not None:
            time = t if t.tangents.any() else float(t.value)
            try:
                # where it asks for a value that is dual it may fail in any way
                return self._dual(_named(self.controller, self.exact(time, *reads)))
            except Exception:
                self.exact = None
        if not self.copies:
            count = 1 + 2 * len(self.steps)
            self.copies = [copy.deepcopy(self.function) for _ in range(count)]
            for sample in self.samples[:-1]:
                self._differenced(*sample)
        return self._differenced(t, reads)

    def _dual(self, found: Mapping[str, Any]) -> dict[str, DualNumber]:
        none = np.zeros(len(self.steps))
        return {
            name: DualNumber(float(value(one)), getattr(one, "tangents", none))
            for name, one in found.items()
        }

    def _differenced(self, t: DualNumber, reads: Sequence[DualNumber]) -> dict[str, DualNumber]:
        """Central differences of the copies, which go on with this sample."""
        every = [t, *reads]
        values = np.array([float(one.value) for one in every])
        rows = np.array([one.tangents for one in every])
        plain, *others = self.copies
        found = self._plain(plain, values)
        tangents = {name: np.zeros(len(self.steps)) for name in found}
        for k, step in enumerate(self.steps):
            above = self._plain(others[2 * k], values + step * rows[:, k])
            below = self._plain(others[2 * k + 1], values - step * rows[:, k])
            for name, row in tangents.items():
                row[k] = (above.get(name, np.nan) - below.get(name, np.nan)) / (2.0 * step)
        return {name: DualNumber(one, tangents[name]) for name, one in found.items()}

    def _plain(self, function: Callable[..., Any], given: Array) -> dict[str, float]:
        found = _named(self.controller, function(*given.tolist()))
        return {name: float(one) for name, one in found.items()}


def _named(controller: Controller, found: Any) -> dict[str, Any]:
    """Values that a controller's function returned, by the names of the inputs; a motion has
    checked them before.
    """
    if isinstance(found, Mapping):
        return dict(found)
    row = np.asarray(found, dtype=object).reshape(-1)
    return dict(zip(controller.sets, row, strict=True))


#: Why there is no derivative by a sample time at an instant.
ON_IT = "a sample falls on it, which another value moves away from it; take other instants"


def reads_loads(run: Solution) -> bool:
    """Whether controllers read what loads do."""
    machine = run.mechanism
    loads = {load.name for load in machine.loads}
    measures = [_measure(run, text) for one in machine.controllers for text in one.reads]
    names = {name for one in measures for name in parse(one.of, curves=True).names}
    return any(name.partition(".")[0] in loads for name in names)


def _measure(run: Solution, text: str) -> Measure:
    return measure_named(run.mechanism.measures, text)


@dataclass
class _Sampled:
    """A controller at work, in dual numbers."""

    state: SampledState
    duals: ControllerDuals
    reads: list[Measure]
    every: Array
    delay: Array
    #: When inputs are to be set, and to what.
    pending: list[tuple[DualNumber, dict[str, DualNumber]]] = field(default_factory=list)

    def due(self, t: float) -> bool:
        """Whether there is a sample at a time."""
        return self.sample_time <= t + self.close

    @property
    def close(self) -> float:
        """Times nearer to each other are one."""
        return TIMES_SAME_SAMPLE * self.state.controller.every

    @property
    def sample_time(self) -> float:
        """That of the next sample."""
        return self.state.anchor + self.state.count * self.state.controller.every


class SampledInputs:
    """The held inputs of one motion. `sizes` (numbers,)."""

    def __init__(
        self,
        run: Solution,
        motion: DualMotion,
        values: Mapping[str, Any],
        sizes: Array,
        lost: LostNumbers,
    ) -> None:
        self.run, self.motion, self.values, self.lost = run, motion, values, lost
        self.width = len(lost.names)
        initial = run.initial_states[0]
        first, last = state_of(initial.system, initial.start)[0], float(run.t[-1])
        times = Interruptions(run.system, run.system.work(), first, last, located=True)
        self.corners = times.corners
        none = np.zeros(self.width)
        self.now = {name: DualNumber(x, none) for name, x in times.inputs().items()}
        going_on = initial.start.restart
        fresh = list(times.sampled)
        if going_on is not None:
            times.restore(going_on.inputs, going_on.sampled)
        if going_on is None or times.sampled == fresh:
            self._described(first)
        else:
            self.now = {name: DualNumber(x, none) for name, x in times.inputs().items()}
        self.sampled = [
            _Sampled(
                one,
                ControllerDuals(one.controller, one.function, sizes),
                [_measure(run, text) for text in one.controller.reads],
                self._tangents(f"{one.controller.name}.every"),
                self._tangents(f"{one.controller.name}.delay"),
                [
                    (DualNumber(t, none), {name: DualNumber(x, none) for name, x in given.items()})
                    for t, given in one.pending
                ],
            )
            for one in times.sampled
        ]
        self.programs: dict[str, MeasureProgram | None] = {}
        #: Instants on which samples fall that move, and the numbers that move them.
        self.met: dict[float, Array] = {}

    def go_on_from(self, before: SampledInputs) -> None:
        """Go on with what a part of the motion before has left, with its derivatives."""
        self.now, self.sampled = before.now, before.sampled
        self.met = dict(before.met)

    @property
    def notes(self) -> list[str]:
        """Notes on differenced controllers, and on instants without derivatives."""
        own = [one.state.controller.name for one in self.sampled if one.duals.differenced]
        found = []
        if own:
            found.append(
                f"controllers of your own, of {listed(own)}, take plain numbers only, and are "
                "differenced: derivatives through them have some 9 figures"
            )
        unit = self.run.mechanism.units.time
        for t, which in self.met.items():
            names = listed([self.lost.names[k] for k in np.flatnonzero(which)])
            found.append(
                f"at t = {t:.6g} {unit} rates and forces have no derivative by {names}: {ON_IT}"
            )
        return found

    def enter(self, stretch: ModeStretch, tangents: Tangents) -> Tangents:
        """Set the inputs of a stretch; tangents with theirs."""
        for name in (name for one in self.sampled for name in one.state.controller.sets):
            stretch.inputs[name] = float(self.now[name].value)
        inputs = self.now | {
            name: DualNumber(x, np.zeros(self.width))
            for name, x in stretch.inputs.items()
            if name not in self.now
        }
        rows = [inputs[name].tangents for name in self.motion.hold]
        return replace(tangents, hold=np.array(rows).reshape(-1, self.width))

    def sample(
        self,
        before: ModeStretch,
        t: DualNumber,
        y: DualNumber,
        tangents: Tangents,
        record: DualNumber | None,
    ) -> Array:
        """Do what is due at a time, which may move; by how much numbers move the change of the
        inputs away from there: delays that are zero may be more.

        y, record: the state there, which moves with it, and its record where that is known, in the
        modes before.
        """
        later = []
        for one in self.sampled:
            if one.due(float(t.value)):
                if record is None:
                    seen = replace(before, inputs=dict(before.inputs))
                    record = self.motion.at(seen, t, y, self.enter(seen, tangents)).record
                one.state.count += 1
                found = one.duals(t, self._reads(one, record))
                self._check(one, float(t.value), found)
                delay = one.state.controller.delay
                when = DualNumber(t.value + delay, t.tangents + one.delay)
                one.pending.append((when, found))
                later.append(one.delay * (delay == 0.0))
            while one.pending and one.pending[0][0].value <= t.value + one.close:
                # what is sampled after it reads the new inputs
                self.now |= one.pending.pop(0)[1]
                record = None
        return self._alike(later, float(t.value))

    def when(self, t: float) -> DualNumber:
        """A set time, as the samples or changes that are due there move it."""
        rows = []
        for one in self.sampled:
            if one.due(t):
                rows.append(one.state.count * one.every)
            rows += [row.tangents for row, _ in one.pending if row.value <= t + one.close]
        if self.corners.size and np.abs(self.corners - t).min() <= 0.0:
            rows.append(np.zeros(self.width))
        return DualNumber(t, self._alike(rows, t))

    def _alike(self, rows: Sequence[Array], t: float) -> Array:
        """How all of these move; numbers that move them apart are lost."""
        if not rows:
            return np.zeros(self.width)
        unlike = np.ptp(rows, axis=0) > TIMES_MOVE_ALIKE * np.abs(rows).max(axis=0)
        self.lost.lose(unlike, t, "samples fall together there that move apart")
        return np.where(unlike, 0.0, rows[0])

    def meet(self, t: float, moving: Array) -> None:
        """Note an instant on which a sample falls that numbers move."""
        if moving.any():
            self.met[t] = moving

    def _described(self, first: float) -> None:
        """Inputs that controllers set, before they do, by the numbers of their laws."""
        machine = self.run.mechanism
        names = {name for one in machine.controllers for name in one.sets}
        for one in machine.inputs:
            if one.name not in names:
                continue
            law: Any = one.value
            own, found = law.numbers(), np.zeros(self.width)
            plain = set(own) == {"value"}
            for key in own:
                number = self.values[f"{one.name}.value" if plain else f"{one.name}.value.{key}"]
                if isinstance(number, DualNumber) and plain:
                    found = number.tangents
                elif isinstance(number, DualNumber):
                    which = number.tangents != 0.0
                    why = f"the law of '{one.name}', before it is set, is not differentiated"
                    self.lost.lose(which, first, why)
            self.now[one.name] = DualNumber(self.now[one.name].value, found)

    def _tangents(self, name: str) -> Array:
        found = self.values[name]
        return found.tangents if isinstance(found, DualNumber) else np.zeros(self.width)

    def _reads(self, one: _Sampled, instant: DualNumber) -> list[DualNumber]:
        n = self.motion.system.coordinates
        record = DualRecord(instant.value[None], instant.tangents[None], self.motion.first_load, n)
        found, whole, names = [], None, self.lost.names
        for measure in one.reads:
            if measure.of not in self.programs:
                self.programs[measure.of] = recorded_measure(self.run, record, measure, names)
            program = self.programs[measure.of]
            if program is not None:
                value, row = program.evaluated(record, 0, self.run.system.values, names)
                found.append(DualNumber(value, row))
                continue
            whole = whole or dual_solution(self.run, dict(self.values), record)
            read = evaluate_measure(whole, measure)[0]
            read = read[0] if getattr(read, "ndim", 0) else read
            if not isinstance(read, DualNumber):
                read = DualNumber(float(read), np.zeros(self.width))
            found.append(read)
        return found

    def _check(self, one: _Sampled, t: float, found: Mapping[str, DualNumber]) -> None:
        """Lose the numbers by which what a controller sets has no derivative."""
        for each in found.values():
            wrong = ~np.isfinite(each.tangents)
            why = f"what controller '{one.state.controller.name}' sets has none"
            self.lost.lose(wrong, t, why)
            each.tangents = np.where(wrong, 0.0, each.tangents)
