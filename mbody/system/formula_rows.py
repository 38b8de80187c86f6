"""Steps of all formulas of measured quantities as one table for the kernels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.kernels import constraints
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.laws import Law, MeasuredFormula
from mbody.laws.kernels import OPERATIONS, FloatArray
from mbody.model.element import Element, Numbers
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import Signal

if TYPE_CHECKING:
    from mbody.system.formula_steps import DriverFormula, StepList


def driver_states(driver: Element, machine: Mechanism, at: Numbers) -> tuple[str, ...]:
    """Auxiliary states that a driver follows."""
    own: Any = driver
    if not isinstance(own.law, MeasuredFormula):
        return ()
    from mbody.system.formula_steps import recorded_driver

    signal = at.law(driver, "law")
    return tuple(sorted(recorded_driver(driver, signal, machine, at).states))


# -- Formula of a driver as a law of time, by NumPy --------------------------------------------


@dataclass(frozen=True, eq=False, repr=False)
class ComposedLaw(Law):
    """The formula of a driver with the laws of its inputs: a function of time."""

    kind: ClassVar[str] = "measured"

    text: str
    formula: DriverFormula
    inputs: Mapping[str, Law]

    def __repr__(self) -> str:
        return repr(self.text)

    def numbers(self) -> dict[str, float]:
        """None: they belong to the formula."""
        return {}

    def raw(self, xs: FloatArray) -> FloatArray:
        """f, f′, f″, (N, 3), at times (N,)."""
        from mbody.system.formula_steps import SIGNALS, step_values

        formula = self.formula
        signals = {name: law.raw(xs) for name, law in self.inputs.items()}

        def read(kind: str, *arguments: str) -> FloatArray:
            if kind == "time":
                return xs
            column: FloatArray = signals[arguments[0]][:, SIGNALS.index(kind)]
            return column

        goals = (formula.value, formula.rate, formula.acceleration)
        return np.stack(step_values(formula.steps, goals, read, xs.shape), axis=1)


def driven_law(driver: Element, mechanism: Mechanism, at: Numbers) -> Law:
    """The law of a driver that follows a formula of time and inputs."""
    signal = at.law(driver, "law")
    from mbody.system.formula_steps import recorded_driver

    formula = recorded_driver(driver, signal, mechanism, at)
    text = getattr(signal.law, "text", "")
    if formula.measured_bodies or formula.states:
        what = "positions" if formula.measured_bodies else "auxiliary states"
        raise ModelError(
            f"'{driver.name}' follows {what}, '{text}', which time alone does not give: give "
            "times, or values of the drivers that follow time",
            driver.name,
        )
    inputs = {}
    for one in mechanism.inputs:
        if one.name in formula.signals:
            own = one.value.numbers()
            name = f"{one.name}.value"
            plain = set(own) == {"value"}
            inputs[one.name] = one.value.with_numbers(
                {key: at[name if plain else f"{name}.{key}"] for key in own}
            )
    return ComposedLaw(text, formula, inputs)


CODES = {name: n for n, name in enumerate(OPERATIONS)}
#: Curves and their derivatives, in the order of the codes.
LAWS = ("law", "law rate", "law acceleration")


@dataclass(frozen=True)
class RecordedLaw:
    """A law with its parameters, and the steps of one that is a formula of measured quantities."""

    signal: Signal
    steps: StepList | None = None
    #: Whether its rate and its second derivative count: of rows, not of forces.
    derivatives: bool = False
    #: What a driver follows, if that is a formula of measured quantities.
    driven: DriverFormula | None = None

    @property
    def law(self) -> Law:
        """The law."""
        return self.signal.law

    @property
    def laws(self) -> list[Signal]:
        """The laws that its steps evaluate."""
        steps = self.steps if self.driven is None else self.driven.steps
        return [] if steps is None else steps.laws

    @property
    def parameters(self) -> list[Any]:
        """Its parameters, each a float or an array over a batch."""
        steps = self.steps if self.driven is None else self.driven.steps
        return self.signal.parameters if steps is None else steps.numbers

    @property
    def of_solution(self) -> bool:
        """Whether it measures accelerations or reactions."""
        if self.steps is None:
            return False
        from mbody.system.formula_steps import measures_solution

        return measures_solution(self.steps, self.steps.value)

    @property
    def timed(self) -> bool:
        """Whether it is a law of time, which the kernels evaluate as a function of one number."""
        return self.steps is None and self.driven is None


def recorded(
    signal: Signal, machine: Mechanism, at: Numbers, argument: Element | None = None
) -> RecordedLaw:
    """A law of a load or a state; `argument`: the load whose own law it is."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal)
    from mbody.system.formula_steps import record_formula

    return RecordedLaw(signal, record_formula(signal.law, signal.parameters, machine, at, argument))


def driver_law(signal: Signal, driver: Element, machine: Mechanism, at: Numbers) -> RecordedLaw:
    """Law that a driver follows, or the coordinate of a stop."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal, derivatives=True)
    from mbody.model.stop import Stop
    from mbody.system.formula_steps import recorded_driver, recorded_stop

    if isinstance(driver, Stop):
        return RecordedLaw(signal, driven=recorded_stop(driver, machine, at))
    return RecordedLaw(signal, driven=recorded_driver(driver, signal, machine, at))


def following(mechanism: Mechanism, at: Numbers) -> dict[str, tuple[str, ...]]:
    """Stops, and drivers that follow positions, with the moving bodies of their rows."""
    found: dict[str, tuple[str, ...]] = {}
    if mechanism.stops:
        from mbody.system.formula_steps import recorded_stop

        stops = {one.name: recorded_stop(one, mechanism, at) for one in mechanism.stops}
        found = {name: one.measured_bodies for name, one in stops.items()}
    for driver in mechanism.drivers:
        driven = driver_law(at.law(driver, "law"), driver, mechanism, at).driven
        if driven is not None and driven.measured_bodies:
            found[driver.name] = driven.measured_bodies
    return found


class FormulaRows:
    """The table of `mbody.kernels.constraints`, filled formula by formula; what two of them
    read or compute alike is there once.
    """

    def __init__(
        self,
        bodies: Mapping[str, int],
        inputs: Mapping[str, int],
        states: Sequence[str],
        primitives: Mapping[str, Sequence[int]],
    ) -> None:
        self.bodies, self.inputs, self.states = bodies, inputs, list(states)
        self.primitives = primitives
        self.rows: list[tuple[int, int, int, int]] = []
        self.count = 0
        self._known: dict[tuple[int, int, int], int] = {}

    def add(
        self,
        law: RecordedLaw,
        first: int,
        *,
        laws: int = 0,
        signal: int | None = None,
        rate: int | None = None,
    ) -> None:
        """Append a formula whose parameters begin at row `first`, and where its value goes; of any
        other law nothing. laws: number of the first of the laws that it evaluates.
        """
        steps = law.steps
        if steps is None:
            return
        if signal is not None:
            self._recorded(steps, first, laws, [(constraints.TO_SIGNAL, steps.value, signal)])
        if rate is not None:
            self._recorded(steps, first, laws, [(constraints.TO_RATE, steps.value, rate)])

    def add_signal(self, law: RecordedLaw, first: int, laws: int, signal: int) -> None:
        """Append what a driver follows of time, inputs and auxiliary states: its value, rate and
        acceleration.
        """
        if law.driven is None or law.driven.measured_bodies:
            return
        driven = law.driven
        numbers = (driven.value, driven.rate, driven.acceleration)
        goals = [(constraints.TO_SIGNAL, number, signal + n) for n, number in enumerate(numbers)]
        self._recorded(driven.steps, first, laws, goals)
        self._known.clear()  # inputs may be set before the loads are evaluated

    def add_rows(
        self,
        driven: DriverFormula,
        first: int,
        laws: int,
        signal: int,
        row: int,
        blocks: Mapping[str, int],
    ) -> tuple[int, int, int]:
        """Append the row of a driver that follows positions; where its steps begin, where those of
        γ do, and where they end. row: that of Φ; blocks: where those of its bodies begin.
        """
        begin = len(self.rows)
        goals = [
            (constraints.TO_SIGNAL, driven.value, signal),
            (constraints.TO_SIGNAL, driven.rate, signal + 1),
        ]
        goals += [(constraints.TO_PHI, driven.phi, row), (constraints.TO_NU, driven.rate, row)]
        goals += [
            (constraints.TO_BLOCK, number, blocks[body] + axis)
            for (body, axis), number in driven.gradient.items()
        ]
        self._recorded(driven.steps, first, laws, goals)
        self._known.clear()
        middle = len(self.rows)
        self._recorded(
            driven.steps, first, laws, [(constraints.TO_GAMMA, driven.acceleration, row)]
        )
        self._known.clear()
        return begin, middle, len(self.rows)

    def _recorded(
        self, steps: StepList, first: int, laws: int, goals: Sequence[tuple[int, int, int]]
    ) -> None:
        """Append the steps that some numbers need, then where these go: (code, place, row)."""
        needed = steps.needed([number for _, number, _ in goals])
        places: dict[int, int] = {}
        for place in needed:
            what = steps.steps[place]
            if what[0] == "reaction":
                places[place] = self._reaction(what[1], what[2])
                continue
            if what[0].startswith("law"):
                code, a, b = self._law(what, laws, places)
            else:
                code, a, b = self._read(what, int(first)) or self._operation(what, places)
            places[place] = self._row_of(code, a, b)
        for code, number, row in goals:
            self.rows.append((code, places[number], 0, row))

    def _reaction(self, name: str, part: int) -> int:
        """Place of a part of the reaction of a joint, the sum of those of its primitives; of a
        driver of the multiplier of its own.
        """
        first, *more = [PER_PRIMITIVE * e + part for e in self.primitives[name]]
        found = self._row_of(constraints.REACTION, first, 0)
        for row in more if part > 1 else ():
            other = self._row_of(constraints.REACTION, row, 0)
            found = self._row_of(CODES["+"], found, other)
        return found

    def table(self) -> np.ndarray:
        """(steps, 4)."""
        return np.array(self.rows, dtype=np.int64).reshape(-1, 4)

    def _row_of(self, code: int, a: int, b: int) -> int:
        """Place of a number, recorded if it was not yet."""
        if (code, a, b) not in self._known:
            self._known[code, a, b] = self.count
            self.rows.append((code, a, b, self.count))
            self.count += 1
        return self._known[code, a, b]

    def _read(self, what: tuple[Any, ...], first: int) -> tuple[int, int, int] | None:
        """Code and row of a number of the instant; None of an operation."""
        from mbody.system.formula_steps import SIGNALS

        kind, *arguments = what
        if kind == "position":
            return constraints.POSITION, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "velocity":
            return constraints.VELOCITY, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "acceleration":
            return constraints.ACCELERATION, 3 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "turn":
            return constraints.TURN, 2 * self.bodies[arguments[0]] + arguments[1], 0
        if kind == "time":
            return constraints.TIME, 0, 0
        if kind == "parameter":
            return constraints.PARAMETER, first + arguments[0], 0
        if kind in SIGNALS:
            return constraints.SIGNAL, self.inputs[arguments[0]] + SIGNALS.index(kind), 0
        if kind == "own":
            return constraints.OWN, self.states.index(arguments[0]), 0
        return None

    def _law(
        self, what: tuple[Any, ...], laws: int, places: Mapping[int, int]
    ) -> tuple[int, int, int]:
        """A law at a number, or a derivative of it, or a table of two variables at two."""
        kind, n, *operands = what
        inputs = [places[one] for one in operands]
        if len(inputs) == 1:
            return constraints.LAW + LAWS.index(kind), inputs[0], laws + n
        return constraints.SURFACE + laws + n, inputs[0], inputs[1]

    def _operation(self, what: tuple[Any, ...], places: Mapping[int, int]) -> tuple[int, int, int]:
        """An operation on numbers whose places are known; one of one number takes it twice."""
        name, *operands = what
        inputs = [places[one] for one in operands]
        return CODES[name], inputs[0], inputs[-1]
