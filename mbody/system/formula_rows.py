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
from mbody.system.formula_steps import StepList, record_formula

__all__ = ["FormulaRows", "RecordedLaw", "recorded"]

CODES = {name: n for n, name in enumerate(OPERATIONS)}


@dataclass(frozen=True)
class RecordedLaw:
    """A law with its parameters, and the steps of one that is a formula of measured quantities."""

    signal: Signal
    steps: StepList | None = None
    #: Whether its rate and its second derivative count: of rows, not of forces.
    derivatives: bool = False

    @property
    def law(self) -> Law:
        """The law."""
        return self.signal.law

    @property
    def laws(self) -> list[Signal]:
        """The laws that its steps evaluate."""
        return [] if self.steps is None else self.steps.laws

    @property
    def parameters(self) -> list[Any]:
        """Its parameters, each a float or an array over a batch."""
        return self.signal.parameters if self.steps is None else self.steps.numbers


def recorded(
    signal: Signal, machine: Mechanism, at: Numbers, argument: Element | None = None
) -> RecordedLaw:
    """A law of a load or a state; `argument`: the load whose own law it is."""
    if not isinstance(signal.law, MeasuredFormula):
        return RecordedLaw(signal)
    return RecordedLaw(signal, record_formula(signal.law, signal.parameters, machine, at, argument))


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
        places: list[int] = []
        for what in steps.steps:
            if what[0] == "law":
                code, a, b = self._law(what, laws, places)
            else:
                code, a, b = self._read(what, int(first)) or self._operation(what, places)
            places.append(self._place(code, a, b))
        value = places[steps.value]
        if signal is not None:
            self.rows.append((TO_SIGNAL, value, 0, signal))
        if rate is not None:
            self.rows.append((TO_RATE, value, 0, rate))

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
        if kind == "signal":
            return SIGNAL, self.inputs[rest[0]], 0
        if kind == "own":
            return OWN, self.states.index(rest[0]), 0
        return None

    def _law(self, what: tuple[Any, ...], laws: int, places: list[int]) -> tuple[int, int, int]:
        """A law at a number, or a table of two variables at two."""
        _, n, *operands = what
        taken = [places[one] for one in operands]
        if len(taken) == 1:
            return LAW, taken[0], laws + n
        return SURFACE + laws + n, taken[0], taken[1]

    def _operation(self, what: tuple[Any, ...], places: list[int]) -> tuple[int, int, int]:
        """An operation on numbers whose places are known; one of one number takes it twice."""
        name, *operands = what
        taken = [places[one] for one in operands]
        return CODES[name], taken[0], taken[-1]
