"""Steps of all formulas of measured quantities as one table for the kernels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.kernels.measured_formulas import (
    LAW,
    OWN,
    PARAMETER,
    POSITION,
    SIGNAL,
    SURFACE,
    TIME,
    TO_BLOCK,
    TO_GAMMA,
    TO_NU,
    TO_PHI,
    TO_RATE,
    TO_SIGNAL,
    TURN,
    VELOCITY,
)
from mbody.laws import Law, MeasuredFormula
from mbody.laws.postfix import OPERATIONS
from mbody.model.element import Element, Numbers
from mbody.model.mechanism import Mechanism
from mbody.model.primitives import Signal
from mbody.model.stop import Stop
from mbody.system.driver_formulas import DriverFormula, recorded_driver
from mbody.system.formula_derivatives import SIGNALS
from mbody.system.formula_steps import StepList, record_formula
from mbody.system.stop_formulas import recorded_stop

__all__ = ["FormulaRows", "RecordedLaw", "followed", "following", "recorded"]

CODES = {name: n for n, name in enumerate(OPERATIONS)}
#: Curves and their derivatives, in the order of the codes.
LAWS = ("law", "law rate", "law bend")


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
    def timed(self) -> bool:
        """Whether it is a law of time, which the kernels evaluate as a function of one number."""
        return self.steps is None and self.driven is None


def recorded(
    signal: Signal, machine: Mechanism, at: Numbers, argument: Element | None = None
) -> RecordedLaw:
    """A law of a load or a state; `argument`: the load whose own law it is."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal)
    return RecordedLaw(signal, record_formula(signal.law, signal.parameters, machine, at, argument))


def followed(signal: Signal, driver: Element, machine: Mechanism, at: Numbers) -> RecordedLaw:
    """What a driver follows, or the coordinate of a stop."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal, derivatives=True)
    if isinstance(driver, Stop):
        return RecordedLaw(signal, driven=recorded_stop(driver, machine, at))
    return RecordedLaw(signal, driven=recorded_driver(driver, signal, machine, at))


def following(mechanism: Mechanism, at: Numbers) -> dict[str, tuple[str, ...]]:
    """Stops, and drivers that follow positions, with the moving bodies of their rows."""
    stops = (one for one in mechanism.contacts if isinstance(one, Stop))
    found = {one.name: recorded_stop(one, mechanism, at).follows for one in stops}
    for driver in mechanism.drivers:
        driven = followed(at.law(driver, "law"), driver, mechanism, at).driven
        if driven is not None and driven.follows:
            found[driver.name] = driven.follows
    return found


class FormulaRows:
    """The table of `mbody.kernels.measured_formulas`, filled formula by formula; what two of them
    read or compute alike is there once.

    Parameters
    ----------
    bodies : mapping
        Number of every body.
    inputs : mapping
        Signal row of every input.
    states : sequence of str
        The own states.
    """

    def __init__(
        self, bodies: Mapping[str, int], inputs: Mapping[str, int], states: Sequence[str]
    ) -> None:
        self.bodies, self.inputs, self.states = bodies, inputs, list(states)
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
            self._recorded(steps, first, laws, [(TO_SIGNAL, steps.value, signal)])
        if rate is not None:
            self._recorded(steps, first, laws, [(TO_RATE, steps.value, rate)])

    def add_signal(self, law: RecordedLaw, first: int, laws: int, signal: int) -> None:
        """Append what a driver follows of time, inputs and own states: its value, rate and
        acceleration.
        """
        if law.driven is None or law.driven.follows:
            return
        driven = law.driven
        numbers = (driven.value, driven.rate, driven.acceleration)
        goals = [(TO_SIGNAL, number, signal + n) for n, number in enumerate(numbers)]
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
        goals = [(TO_SIGNAL, driven.value, signal), (TO_SIGNAL, driven.rate, signal + 1)]
        goals += [(TO_PHI, driven.phi, row), (TO_NU, driven.rate, row)]
        goals += [
            (TO_BLOCK, number, blocks[body] + axis)
            for (body, axis), number in driven.gradient.items()
        ]
        self._recorded(driven.steps, first, laws, goals)
        self._known.clear()
        middle = len(self.rows)
        self._recorded(driven.steps, first, laws, [(TO_GAMMA, driven.acceleration, row)])
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
            if what[0].startswith("law"):
                code, a, b = self._law(what, laws, places)
            else:
                code, a, b = self._read(what, int(first)) or self._operation(what, places)
            places[place] = self._place(code, a, b)
        for code, number, row in goals:
            self.rows.append((code, places[number], 0, row))

    def table(self) -> np.ndarray:
        """(steps, 4)."""
        return np.array(self.rows, dtype=np.int64).reshape(-1, 4)

    def _place(self, code: int, a: int, b: int) -> int:
        """Where a number is, recorded if it was not yet."""
        if (code, a, b) not in self._known:
            self._known[code, a, b] = self.count
            self.rows.append((code, a, b, self.count))
            self.count += 1
        return self._known[code, a, b]

    def _read(self, what: tuple[Any, ...], first: int) -> tuple[int, int, int] | None:
        """Code and row of a number of the instant; None of an operation."""
        kind, *rest = what
        if kind == "position":
            return POSITION, 3 * self.bodies[rest[0]] + rest[1], 0
        if kind == "velocity":
            return VELOCITY, 3 * self.bodies[rest[0]] + rest[1], 0
        if kind == "turn":
            return TURN, 2 * self.bodies[rest[0]] + rest[1], 0
        if kind == "time":
            return TIME, 0, 0
        if kind == "parameter":
            return PARAMETER, first + rest[0], 0
        if kind in SIGNALS:
            return SIGNAL, self.inputs[rest[0]] + SIGNALS.index(kind), 0
        if kind == "own":
            return OWN, self.states.index(rest[0]), 0
        return None

    def _law(
        self, what: tuple[Any, ...], laws: int, places: Mapping[int, int]
    ) -> tuple[int, int, int]:
        """A law at a number, or a derivative of it, or a table of two variables at two."""
        kind, n, *operands = what
        taken = [places[one] for one in operands]
        if len(taken) == 1:
            return LAW + LAWS.index(kind), taken[0], laws + n
        return SURFACE + laws + n, taken[0], taken[1]

    def _operation(self, what: tuple[Any, ...], places: Mapping[int, int]) -> tuple[int, int, int]:
        """An operation on numbers whose places are known; one of one number takes it twice."""
        name, *operands = what
        taken = [places[one] for one in operands]
        return CODES[name], taken[0], taken[-1]
