"""One instant whose numbers are traced: what results have of it becomes a list of operations.

Drivers' motions are those of the bodies, and loads those of their formulas: neither is among what
the kernels keep.
"""

from __future__ import annotations

import math
import operator
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise, repeat
from typing import Any

import numpy as np

from mbody.core import recorded_numbers
from mbody.core.recorded_numbers import FUNCTIONS as RECORDED_NUMBERS_FUNCTIONS
from mbody.core.recorded_numbers import Untraceable
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.kernels.number_program import NumberProgram
from mbody.laws import Expression, MeasuredFormula, Table
from mbody.laws.kernels import OPERATIONS
from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.model.simulation import Measure, measure_named
from mbody.quantities.evaluate import BY_FUNCTION, ONE, TWO, by_numpy, postfix_value
from mbody.solution.histories import LoadHistory, Reaction, auxiliary_history, place
from mbody.solution.measures import (
    check_measure,
    evaluate_measure,
    reaction_part,
    relative_angle,
    stretched,
)
from mbody.solution.solution import Solution
from mbody.system.formula_steps import record_formula, recorded_values
from mbody.system.system import System

# -- Recorded numbers (`mbody.core.recorded_numbers`) as programs for the compiled core --------

CODES = {name: OPERATIONS.index(BY_FUNCTION[name]) for name in RECORDED_NUMBERS_FUNCTIONS}
#: What a rule requires of a number, as `mbody.model.element.number_field` names it: the lowest
#: value, and whether it is excluded.
LOWEST = {"positive": (0.0, 1), "not negative": (0.0, 0), "": (-1e300, 1)}


@dataclass(frozen=True)
class Rule:
    """The value that an input has at first, and what is required of it: "positive",
    "not negative" or nothing.
    """

    value: float
    sign: str = ""


class Recording(recorded_numbers.NumberRecording):
    """Operations on named inputs.

    >>> recording = Recording({"a": Rule(3.0), "b": Rule(4.0)})
    >>> a, b = recording.inputs["a"], recording.inputs["b"]
    >>> program = recording.program([np.sqrt(a * a + b * b)])
    >>> len(program.operations)
    4
    """

    def __init__(self, inputs: dict[str, Rule]) -> None:
        super().__init__(inputs)
        self.rules = list(inputs.values())

    def program(self, targets: Sequence[Any]) -> NumberProgram:
        """The program from the inputs to these numbers, traced ones or constants, with all that
        they need.
        """
        wanted = [self.place_of(target) for target in targets]
        count = len(self.rules)
        kept = [place for place in self.needed(targets) if place >= count]
        constants = [place for place in kept if self.made[place][0] == "constant"]
        steps = [place for place in kept if self.made[place][0] in CODES]
        order = [*range(count), *constants, *steps]
        slot = {place: n for n, place in enumerate(order)}
        slots = np.zeros(len(order))
        slots[:count] = [rule.value for rule in self.rules]
        slots[count : count + len(constants)] = [self.made[place][1] for place in constants]
        operations = np.zeros((len(steps), 4), dtype=np.int64)
        for row, step in zip(operations, steps, strict=True):
            name, first, *second = self.made[step]
            row[:] = CODES[name], slot[first], slot[(second or [first])[0]], slot[step]
        bounds = [LOWEST[rule.sign] for rule in self.rules]
        return NumberProgram(
            slots=slots,
            lowest=np.array([low for low, _ in bounds]),
            strict=np.array([strict for _, strict in bounds], dtype=np.int64),
            operations=operations,
            targets=np.array([slot[place] for place in wanted], dtype=np.int64),
        )


def of_what_is_read(program: NumberProgram) -> tuple[NumberProgram, np.ndarray]:
    """The program without the inputs that no operation reads; the numbers of those that are."""
    inputs, slots = len(program.lowest), len(program.slots)
    read = np.unique(np.concatenate([program.operations[:, 1:3].ravel(), program.targets]))
    read = read[read < inputs]
    kept = np.concatenate([read, np.arange(inputs, slots)])
    place = np.zeros(slots, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    operations = program.operations.copy()
    operations[:, 1:] = place[operations[:, 1:]]
    short = NumberProgram(
        slots=program.slots[kept],
        lowest=program.lowest[read],
        strict=program.strict[read],
        operations=operations,
        targets=place[program.targets],
    )
    return short, read


# -- Driven coordinates from the motion of the bodies, in any kind of numbers ------------------


def driven_motion(result: Any, driver: Any) -> tuple[Any, Any, Any]:
    """Value, rate and acceleration of the coordinate of a driver: an angle, a distance, or a
    displacement along an axis of body i.
    """
    if isinstance(driver, AngleDriver):
        i, j = result[driver.relative_to], result[driver.body]
        return j.angle - i.angle, j.omega - i.omega, j.alpha - i.alpha
    if not isinstance(driver, DistanceDriver | CoordinateDriver):
        raise Untraceable(f"the motion of a {type(driver).__name__}")
    (x, y), (vx, vy), (ax, ay) = _separation(result, driver)
    if isinstance(driver, DistanceDriver):
        length = np.hypot(x, y)
        rate = (x * vx + y * vy) / length
        return length, rate, (vx * vx + vy * vy + x * ax + y * ay - rate * rate) / length
    body = result[driver.i.body]
    angle = body.angle + result.system.numbers.angle(driver, "i")
    c, s, w = np.cos(angle), np.sin(angle), body.omega
    along, across = c * x + s * y, c * y - s * x
    rate = c * vx + s * vy + w * across
    rotation = body.alpha * across - w * w * along + 2.0 * w * (c * vy - s * vx)
    return along, rate, c * ax + s * ay + rotation


def _separation(result: Any, element: Any) -> list[tuple[Any, Any]]:
    """The vector from the place on i to that on j, with both derivatives, world axes."""
    (ix, iy), (jx, jy) = (_motion(result, element, side) for side in "ij")
    return [(b - a, d - c) for a, b, c, d in zip(ix, jx, iy, jy, strict=True)]


def _motion(result: Any, element: Any, side: str) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """x and y of a place, each with both derivatives."""
    body = result[getattr(element, side).body]
    x, y = place(result, element, side)
    px, py, w, alpha = x - body.x, y - body.y, body.omega, body.alpha
    return (
        (x, body.vx - w * py, body.ax - alpha * py - w * w * px),
        (y, body.vy + w * px, body.ay + alpha * px - w * w * py),
    )


#: What a body has, in the order in which the kernels keep it.
ORDER = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
#: Operations of formulas.
FUNCTIONS: dict[str, Any] = ONE | TWO


class TracedRecord:
    """The record of one instant (see `mbody.solution.histories.Record`), its rows traced."""

    batch, count = False, 1

    def __init__(self, rows: list[Any]) -> None:
        self.rows = rows

    def take(self, row: int) -> Any:
        """One number."""
        return self.rows[row]

    def some(self, first: int, count: int) -> list[Any]:
        """Numbers that follow each other."""
        return self.rows[first : first + count]

    def table(self, rows: slice) -> Any:
        """Raises Untraceable: compiled code computes tables."""
        raise Untraceable("compiled code computes it")

    def at(self, rows: slice, instants: Any, design: int = 0) -> Any:
        """Raises Untraceable: compiled code computes instants."""
        raise Untraceable("compiled code computes it")


#: What steps of formulas read as positions and velocities.
MOTIONS = {"position": ORDER[:3], "velocity": ORDER[3:6], "acceleration": ORDER[6:]}


class _Absent:
    """A number that cannot be recorded, of a history whose other numbers can."""

    def __init__(self, error: Untraceable) -> None:
        self.error = error

    def __float__(self) -> float:
        raise self.error


class TracedInstant(Solution):
    """One instant with traced numbers."""

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force of a joint, and its torque where that can be recorded."""
        try:
            return super().reaction(joint, on)
        except Untraceable as error:
            torque: Any = _Absent(error)
        first, fx, fy = 3 * self.system.coordinates + 2, None, None
        for e in self.system.primitives_of[joint]:
            x, y = self.record.some(first + PER_PRIMITIVE * e, 2)
            fx, fy = (x, y) if fx is None or fy is None else (fx + x, fy + y)
        own: Any = self.mechanism[joint]
        assert fx is not None and fy is not None
        return Reaction(joint, own.j.body, own.i.body, fx, fy, torque)

    def driven(self, driver: str) -> tuple[Any, Any, Any]:
        """Value, rate and acceleration of what a driver drives, by the motion of the bodies."""
        return driven_motion(self, self.mechanism[driver])

    def load(self, name: str, on: str | None = None) -> LoadHistory:
        """Force and torque of a load on body j, by its law."""
        own: Any = self.mechanism[name]
        actions = own.actions(self.system.numbers)
        if len(actions) != 1 or actions[0].kind not in ("stretch", "twist", "force", "torque"):
            raise Untraceable("compiled code computes it")
        action = actions[0]
        p = action.parameters
        zero: Any = 0.0
        if action.kind == "stretch":
            length, rate, (ux, uy) = stretched(self, own)
            f = self._value(own, action.law, (1.0 - p[5]) * (length - p[4]) + p[5] * rate)
            on_j = -f * ux, -f * uy
            return LoadHistory(name, action.j, action.i, *on_j, zero, f, length, None, rate)
        if action.kind == "twist":
            angle, rate = relative_angle(self, own)
            f = self._value(own, action.law, (1.0 - p[1]) * (angle - p[0]) + p[1] * rate)
            parts: tuple[Any, ...] = (zero, zero, -f, zero, None, angle, rate)
            return LoadHistory(name, action.j, action.i, *parts)
        f = self._value(own, action.signals[0], self.t)
        if action.kind == "torque":
            rotation: tuple[Any, Any] = relative_angle(self, own) if own.by_angle else (None, None)
            return LoadHistory(name, action.j, action.i, zero, zero, f, zero, None, *rotation)
        body = self[action.j]
        angle = body.angle * p[4]
        c, s = np.cos(angle), np.sin(angle)
        fx, fy = f * (c * p[2] - s * p[3]), f * (s * p[2] + c * p[3])
        size: Any = np.hypot(fx, fy)
        return LoadHistory(name, action.j, action.i, fx, fy, zero, size)

    def _value(self, load: Any, signal: Any, x: Any) -> Any:
        """The value of a load's law at x, or of its formula of measured quantities."""
        if isinstance(signal.law, MeasuredFormula):
            return self._formula(signal.law, signal.parameters, load)
        return _law(signal, x)

    def _formula(self, law: MeasuredFormula, constants: list[Any], load: Any) -> Any:
        """The value of a formula of measured quantities, step by step as the kernels take them."""
        system = self.system
        found = record_formula(law, list(constants), system.mechanism, system.numbers, load)
        return recorded_values(found, [found.value], self._read, _curve)[0]

    def _read(self, kind: str, owner: str = "", axis: int = 0) -> Any:
        """A number of the instant, as `mbody.system.formula_steps.StepList` names it."""
        if kind == "time":
            return self.t
        if kind in ("signal", "own"):
            return auxiliary_history(self, owner)
        if kind == "reaction":
            return reaction_part(self, owner, axis)
        if owner == "ground":
            return 1.0 if (kind, axis) == ("turn", 0) else 0.0
        if kind == "turn":
            return (np.cos, np.sin)[axis](self[owner].angle)
        return getattr(self[owner], MOTIONS[kind][axis])


def _curve(signal: Any, _order: int, arguments: list[Any]) -> Any:
    if len(arguments) > 1:
        raise Untraceable("the value of a table of two variables")
    return _law(signal, *arguments)


def _law(signal: Any, x: Any) -> Any:
    """The value of a law at x, from its numbers."""
    law, numbers = signal.law, signal.parameters
    if law.kind == "polynomial":
        value = 0.0
        for number in reversed(numbers):
            value = value * x + number
        return value
    if law.kind == "harmonic":
        mean, amplitude, frequency, phase = numbers
        return mean + amplitude * np.sin(frequency * x + phase)
    if isinstance(law, Expression):
        return postfix_value(law.postfix().operations, numbers, repeat(x), by_numpy)
    if isinstance(law, Table) and (law.interpolation, law.outside) == ("linear", "hold"):
        # each straight part adds what it rises between its ends
        value = law.y[0]
        for (a, b), (c, d) in zip(pairwise(law.x), pairwise(law.y), strict=True):
            value = value + (d - c) / (b - a) * np.maximum(np.minimum(x - a, b - a), 0.0)
        return value
    raise Untraceable(f"the value of a {type(law).__name__} law")


# -- Measured quantities of the present instant as operations, recorded once for each -----------
# A quantity is computed once by mbody's own functions from an instant whose numbers are recorded.
# What that leaves is evaluated in numbers or in arrays: positions and rates are read where the
# integrator has them; accelerations and forces make it evaluate the instant.

#: What reads one number of the present instant.
Read = Callable[[], float]

#: Operations on numbers of Python, which stop where NumPy goes on with what is no number.
STRICT: dict[str, Any] = {name: getattr(math, name, None) for name in FUNCTIONS}
STRICT |= {"negative": operator.neg, "+": operator.add, "-": operator.sub, "*": operator.mul}
STRICT |= {"/": operator.truediv, "^": math.pow, "abs": abs}
# a NaN is selected, so that it is not hidden, and remains one
STRICT["min"] = lambda a, b: a if a < b or a != a else b
STRICT["max"] = lambda a, b: a if a > b or a != a else b
STRICT["sign"] = lambda a: float(np.sign(a))


#: Operations within each other in one function, beyond which results are kept.
DEEPEST = 100


class RowProgram:
    """A number as operations on rows of an instant; the time is the row after the last.

    `rows`: Those that it reads.
    """

    def __init__(self, program: NumberProgram) -> None:
        program, read = of_what_is_read(program)
        self.rows: list[int] = read.tolist()
        self.slots: list[float] = program.slots.tolist()
        self.operations: list[list[int]] = program.operations.tolist()
        self.target = int(program.targets[0])

    def function(
        self, sources: list[Callable[[], Any]], functions: dict[str, Any]
    ) -> Callable[[], Any]:
        """What evaluates it, by what reads each of its rows and what does each operation."""
        binary, count = OPERATIONS.index("log") + 1, len(self.slots) - len(self.operations)
        uses = Counter(place for _, a, b, _ in self.operations for place in {a, b})
        found = [*sources, *(_same(value) for value in self.slots[len(sources) : count])]
        kept, shared, depths = list[Any](), list[Callable[[], Any]](), [0] * count
        for code, a, b, one_place in self.operations:
            made = _applied(
                functions[OPERATIONS[code]], found[a], found[b] if code >= binary else None
            )
            depths.append(1 + max(depths[a], depths[b]))
            if uses[one_place] > 1 or depths[-1] > DEEPEST:
                depths[-1] = 0
                shared.append(made)
                kept.append(None)
                made = partial(kept.__getitem__, len(kept) - 1)
            found.append(made)
        whole = found[self.target]

        def evaluated() -> Any:
            for n, one in enumerate(shared):
                kept[n] = one()
            return whole()

        return evaluated if shared else whole


def _same(value: float) -> Callable[[], Any]:
    return lambda: value


def _applied(function: Any, a: Callable[[], Any], b: Callable[[], Any] | None) -> Callable[[], Any]:
    return (lambda: function(a())) if b is None else lambda: function(a(), b())


def _numpy(source: Callable[[], float]) -> Callable[[], Any]:
    return lambda: np.float64(source())


def recorded_instant(system: System) -> tuple[Recording, TracedInstant]:
    """An instant whose rows and time are inputs of a recording."""
    names = [*(f"row {n}" for n in range(system.record_rows)), "time"]
    recording = Recording(dict.fromkeys(names, Rule(0.0)))
    *rows, time = recording.inputs.values()
    record: Any = TracedRecord(rows)
    return recording, TracedInstant(system, "simulate", time, record, None)  # type: ignore[arg-type]


class Present:
    """The present instant of a motion, for functions that read it."""

    def __init__(
        self, system: System, y: memoryview, slots: memoryview, instant: Callable[[], memoryview]
    ) -> None:
        self.system, self.record = system, instant
        self.y, self.slots = y, slots
        self.recording, self.instant = recorded_instant(system)

    def measure(self, of: str | Measure, solution: Callable[[], Solution]) -> Read:
        """A measured quantity; one that no list of operations gives is read from `solution`, the
        present instant as a result.
        """
        measure = measure_named(self.system.mechanism.measures, of)
        check_measure(self.system.mechanism, measure)
        try:
            return self.read(evaluate_measure(self.instant, measure)[0])
        except Exception:  # whatever Python does with a number that is none
            return lambda: float(solution().measure(measure)[-1])

    def read(self, value: Any) -> Read:
        """Function that evaluates a traced number at the present instant."""
        program = RowProgram(self.recording.program([value]))
        few, last = 2 * self.system.coordinates, self.system.record_rows
        needs_record = any(few <= n < last for n in program.rows)
        y, slots, instant, record = self.y, self.slots, self.record, self.y

        def source(n: int) -> Callable[[], float]:
            if few <= n < last:
                return lambda: record[n]
            return partial(y.__getitem__, n) if n < few else partial(slots.__getitem__, 0)

        sources = [source(n) for n in program.rows]
        strict = program.function(sources, STRICT)
        lenient = program.function([_numpy(one) for one in sources], FUNCTIONS)

        def evaluated() -> float:
            nonlocal record
            if needs_record:
                record = instant()
            try:
                return strict()
            except (ValueError, ArithmeticError):
                with np.errstate(all="ignore"):
                    return float(lenient())

        return evaluated
