"""Inputs: named numbers that formulas use and that may change during a motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar

from mbody.errors import ModelError
from mbody.laws import Cam, Law, Polynomial, as_law
from mbody.model.element import Element, LawLike, law_field
from mbody.quantities import Formula, FormulaError, Scope, Valued, evaluate
from mbody.quantities.formula import read
from mbody.quantities.number import number
from mbody.quantities.types import default
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension

__all__ = ["Input", "dimension_given"]


@dataclass(frozen=True)
class Input(Element):
    """A named number that formulas use, and that may change while the mechanism moves.

    It is what a motor controller, a driver at the pedal or a file of measurements gives: a formula
    names it as it names a parameter, and `simulate`, a `Simulator` or a `Controller` change it.

    Parameters
    ----------
    name : str
        Unique in the mechanism; formulas name it.
    value : float, str, Law
        Its value where nobody gives another: a number with its unit, such as ``"0 N*m"``, by which
        its dimension is known, or a law of time.

    Examples
    --------
    >>> from mbody import Body, Mechanism, Revolute, Torque
    >>> machine = Mechanism("crank")
    >>> machine.add(Body("crank", mass=1.0, inertia=0.1), Revolute("O", "ground", "crank"))
    >>> machine.add(Input("u", "2 N*m"), Torque("motor", "crank", value="u - 0.1*crank.omega"))
    >>> machine.inputs[0].value
    Constant(value=2.0)
    """

    main: ClassVar[tuple[str, ...]] = ("value",)
    role: ClassVar[str] = "input"

    value: LawLike = law_field("number", 0.0)
    #: What it measures; None of a plain number. The mechanism that takes it finds it.
    dimension: Dimension | None = default(None)

    def _enter(self) -> None:
        if not self.name.isidentifier():
            raise ModelError(
                f"'{self.name}' cannot name an input: formulas name it, so it has letters, digits "
                "and _ only, and begins with a letter",
                self.name,
            )
        super()._enter()

    def _law(self, field: dataclasses.Field[Any], value: Any) -> Law | Formula:
        if isinstance(value, Real) and not isinstance(value, bool):
            value = number(value, "number", self.name, field.name)
        try:
            return as_law(value)
        except ModelError as error:
            raise ModelError(f"'{self.name}': {field.name}: {error}", self.name) from None

    def measured(self, scope: Scope) -> Input:
        """The input with the dimension of its value."""
        try:
            found = dimension_given(self.value, scope)
            law: Any = self.value
            if isinstance(law, Law):
                law = law.dimensioned(found or NUMBER, DIMENSIONS["time"])
        except FormulaError as error:
            raise ModelError(f"'{self.name}': value: {error}", self.name) from None
        return dataclasses.replace(self, value=law, dimension=found)


def dimension_given(value: Any, scope: Scope) -> Dimension | None:
    """The dimension of a number or a law of time that was given as text; None where it has none.

    >>> from mbody.quantities import Scope
    >>> dimension_given(as_law("2 N*m"), Scope()) == DIMENSIONS["torque"]
    True
    """
    if isinstance(value, str):
        value = read(value, None)
    time = DIMENSIONS["time"]
    whole = dataclasses.replace(scope, names={**scope.names, "t": Valued(1.0, time)})
    for formula, power in _formulas(value):
        found = evaluate(formula.tree, whole).dimension
        if found is not None:
            return found / time**power
    return None


def _formulas(value: Any) -> Iterator[tuple[Formula, int]]:
    """Formulas among the numbers of a law that have its dimension times a power of time, with that
    power.
    """
    if isinstance(value, Formula):
        yield value, 0
    elif isinstance(value, Polynomial):
        yield from ((c, -n) for n, c in enumerate(value.coefficients) if isinstance(c, Formula))
    elif isinstance(value, Cam):
        for segment in value.segments:
            yield from _formulas(segment)
    elif isinstance(value, Law):
        for field in dataclasses.fields(value):
            own, powers = getattr(value, field.name), field.metadata.get("powers", (0, 0, 0))
            if powers[0] == 1 and not powers[2]:
                parts = own if isinstance(own, tuple) else (own,)
                yield from ((part, powers[1]) for part in parts if isinstance(part, Formula))
