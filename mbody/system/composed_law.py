"""What a driver follows of time and inputs, as a law of time: by NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.laws import Law
from mbody.laws.base import FloatArray
from mbody.model.element import Element, Numbers
from mbody.model.mechanism import Mechanism
from mbody.system.driver_formulas import DriverFormula, recorded_driver
from mbody.system.formula_derivatives import SIGNALS
from mbody.system.step_values import step_values

__all__ = ["ComposedLaw", "driven_law"]


@dataclass(frozen=True, eq=False, repr=False)
class ComposedLaw(Law):
    """The formula of a driver with the laws of its inputs: a function of time.

    Parameters
    ----------
    text : str
        The formula.
    formula : DriverFormula
        Of time and inputs alone.
    inputs : mapping
        The laws of the inputs.
    """

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
        formula = self.formula
        signals = {name: law.raw(xs) for name, law in self.inputs.items()}

        def read(kind: str, *rest: str) -> FloatArray:
            if kind == "time":
                return xs
            column: FloatArray = signals[rest[0]][:, SIGNALS.index(kind)]
            return column

        goals = (formula.value, formula.rate, formula.acceleration)
        return np.stack(step_values(formula.steps, goals, read, xs.shape), axis=1)


def driven_law(driver: Element, mechanism: Mechanism, at: Numbers) -> Law:
    """The law of a driver that follows a formula of time and inputs.

    Raises
    ------
    ModelError
        Where it follows positions or own states, which are no functions of time.
    """
    signal = at.law(driver, "law")
    formula = recorded_driver(driver, signal, mechanism, at)
    text = getattr(signal.law, "text", "")
    if formula.follows or formula.states:
        what = "positions" if formula.follows else "own states"
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
