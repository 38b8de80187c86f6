"""One instant whose numbers are traced: what results have of it becomes a list of operations.

Drivers' motions are those of the bodies, and loads those of their formulas: neither is among what
the kernels keep.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from mbody.core.recorded_numbers import Untraceable
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.kernels.number_program import NumberProgram
from mbody.laws import Expression, MeasuredFormula, Table
from mbody.laws.kernels import CONSTANT, LOG, OPERATIONS, POWER_CONSTANT
from mbody.model.study import Measure, measure_named
from mbody.quantities.evaluate import ONE, TWO
from mbody.solution.histories import LoadHistory, Reaction, auxiliary_history
from mbody.solution.measures import check_measure, evaluate_measure, relative_angle, stretched
from mbody.solution.solution import Solution
from mbody.solution.tracing import Recording, Rule, driven_motion
from mbody.system.formula_steps import record_formula
from mbody.system.system import System

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


#: Steps of formulas that read the instant, and what those of positions and velocities read.
READ = ("position", "velocity", "turn", "time", "signal", "own")
MOTIONS = {"position": ORDER[:3], "velocity": ORDER[3:6]}


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
        values: list[Any] = []
        for kind, *arguments in found.steps:
            if kind == "parameter":
                values.append(found.numbers[arguments[0]])
            elif kind in READ:
                values.append(self._read(kind, *arguments))
            elif kind == "law":
                if len(arguments) > 2:
                    raise Untraceable("the value of a table of two variables")
                values.append(_law(found.laws[arguments[0]], values[arguments[1]]))
            else:
                values.append(FUNCTIONS[kind](*(values[place] for place in arguments)))
        return values[found.value]

    def _read(self, kind: str, owner: str = "", axis: int = 0) -> Any:
        """A number of the instant, as `mbody.system.formula_steps.StepList` names it."""
        if kind == "time":
            return self.t
        if kind in ("signal", "own"):
            return auxiliary_history(self, owner)
        if owner == "ground":
            return 1.0 if (kind, axis) == ("turn", 0) else 0.0
        if kind == "turn":
            return (np.cos, np.sin)[axis](self[owner].angle)
        return getattr(self[owner], MOTIONS[kind][axis])


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
        return _expression(law, list(numbers), x)
    if isinstance(law, Table) and (law.interpolation, law.outside) == ("linear", "hold"):
        # each straight part adds what it rises between its ends
        value = law.y[0]
        for (a, b), (c, d) in zip(pairwise(law.x), pairwise(law.y), strict=True):
            value = value + (d - c) / (b - a) * np.maximum(np.minimum(x - a, b - a), 0.0)
        return value
    raise Untraceable(f"the value of a {type(law).__name__} law")


def _expression(law: Expression, constants: list[Any], x: Any) -> Any:
    """The value of a formula at x: see `mbody.laws.kernels`."""
    stack: list[Any] = []
    for code in law.program:
        name = OPERATIONS[code]
        if code < CONSTANT:
            stack.append(x)
        elif code == CONSTANT:
            stack.append(constants.pop(0))
        elif code <= POWER_CONSTANT:
            stack.append(FUNCTIONS[name.partition(" ")[0]](stack.pop(), constants.pop(0)))
        elif code <= LOG:
            stack.append(FUNCTIONS[name](stack.pop()))
        else:
            b, a = stack.pop(), stack.pop()
            stack.append(FUNCTIONS[name](a, b))
    return stack[0]


# -- Measured quantities of the present instant as Python functions, made once for each --------
# A quantity is computed once by mbody's own functions from an instant whose numbers are recorded
# (`mbody.solution.tracing`); the operations that this takes become the text of a function. It reads
# positions and rates where the integrator has them; accelerations and forces make it evaluate the
# instant.

#: What reads one number of the present instant.
Read = Callable[[], float]

#: Operations as Python writes them; all else is a function of its arguments.
WRITTEN = {"negative": "-{0}", "+": "{0} + {1}", "-": "{0} - {1}", "*": "{0} * {1}"}
WRITTEN |= {"/": "{0} / {1}", "^": "pow({0}, {1})"}
#: The functions, as they stop where a number is none, and as they go on with what is no number.
NAMES = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "atan2", "hypot", "pow")
STRICT: dict[str, Any] = {name: getattr(math, name) for name in NAMES}
STRICT |= {"abs": abs, "min": min, "max": max, "number": float}
NUMPY = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "pow": "power"}
LENIENT = {name: getattr(np, NUMPY.get(name, name)) for name in NAMES}
LENIENT |= {"abs": np.abs, "min": np.minimum, "max": np.maximum, "number": np.float64}


class Present:
    """The present instant of a motion, for functions that read it."""

    def __init__(
        self, system: System, y: memoryview, slots: memoryview, instant: Callable[[], memoryview]
    ) -> None:
        self.system, self.record = system, instant
        self.y, self.slots = y, slots
        self.rows = system.record_rows
        self.recording = Recording(
            {f"row {n}": Rule(0.0) for n in range(self.rows)} | {"time": Rule(0.0)}
        )
        traced: list[Any] = list(self.recording.inputs.values())
        record: Any = TracedRecord(traced[:-1])
        self.instant = TracedInstant(system, "simulate", traced[-1], record, None)

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
        if isinstance(value, np.ndarray):
            value = value[()]
        text, needs_record = self._text(self.recording.program([value]))
        strict, lenient = (_function(text, scope) for scope in (STRICT, LENIENT))
        y, slots, record = self.y, self.slots, self.record

        def evaluated() -> float:
            kept = record() if needs_record else None
            try:
                found: float = strict(y, slots, kept)
            except (ValueError, ArithmeticError):
                with np.errstate(all="ignore"):
                    found = float(lenient(y, slots, kept))
            return found

        return evaluated

    def _text(self, program: NumberProgram) -> tuple[str, bool]:
        """The function as text, and whether it reads the record."""
        inputs, few = self.rows + 1, 2 * self.system.coordinates
        constants = len(program.slots) - len(program.operations)
        used = {int(n) for n in program.operations[:, 1:3].ravel()} | {int(program.targets[0])}
        lines = ["def read(y, slots, record):"]
        needs_record = False
        for n in sorted(used):
            if n < inputs:
                source = f"y[{n}]" if n < few else f"record[{n}]"
                needs_record |= few <= n < self.rows
                source = "slots[0]" if n == self.rows else source
                lines.append(f"    s{n} = number({source})")
            elif n < constants:
                lines.append(f"    s{n} = number({float(program.slots[n])!r})")
        for code, a, b, place in program.operations.tolist():
            name = OPERATIONS[code]
            binary = code > OPERATIONS.index("log")
            form = WRITTEN.get(name, f"{name}({{0}}, {{1}})" if binary else f"{name}({{0}})")
            lines.append(f"    s{place} = {form.format(f's{a}', f's{b}')}")
        lines.append(f"    return s{int(program.targets[0])}")
        return "\n".join(lines), needs_record


def _function(text: str, scope: dict[str, Any]) -> Callable[..., Any]:
    own = dict(scope, inf=math.inf, nan=math.nan)
    exec(text, own)
    found: Callable[..., Any] = own["read"]
    return found
