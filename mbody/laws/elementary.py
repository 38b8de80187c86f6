"""Polynomial and harmonic laws."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mbody.errors import ModelError
from mbody.laws.base import FloatArray, Law, law_field, law_numbers, with_dimension
from mbody.quantities.types import Converted, NumberField, NumberRow, required
from mbody.quantities.units import Dimension

__all__ = ["Constant", "ConstantAcceleration", "ConstantSpeed", "Harmonic", "Polynomial"]


@dataclass(frozen=True)
class _Ascending(Law):
    """Laws whose kernel parameters are ascending coefficients."""

    kind: ClassVar[str] = "polynomial"

    def turns(self, x: float) -> FloatArray:
        """Places after x where f′ may change its sign, followed by inf."""
        slope = np.polynomial.Polynomial(self.parameters(self.numbers())).trim().deriv()
        # real parts of complex roots too: a superfluous place does no harm, a missing one would
        places = np.unique(np.real(slope.roots()))
        return np.append(places[places > x], math.inf)


@dataclass(frozen=True)
class Constant(_Ascending):
    """f = value.

    >>> Constant(3.0).derivatives(1.0)
    (3.0, 0.0, 0.0)
    """

    value: NumberField = law_field(1)


@dataclass(frozen=True)
class ConstantSpeed(_Ascending):
    """Uniform motion, ramp: f = value + speed x.

    >>> ConstantSpeed(1.0, 2.0).derivatives(3.0)
    (7.0, 2.0, 0.0)
    """

    value: NumberField = law_field(1)
    speed: NumberField = law_field(1, -1)


@dataclass(frozen=True)
class ConstantAcceleration(_Ascending):
    """Uniformly accelerated motion: f = value + speed x + acceleration x²/2.

    >>> ConstantAcceleration(0.0, 25.0, -40.0).derivatives(0.5)
    (7.5, 5.0, -40.0)
    """

    value: NumberField = law_field(1)
    speed: NumberField = law_field(1, -1)
    acceleration: NumberField = law_field(1, -2)

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """[value, speed, acceleration/2]."""
        return [numbers["value"], numbers["speed"], 0.5 * numbers["acceleration"]]


@dataclass(frozen=True)
class Polynomial(_Ascending):
    """f = c0 + c1 x + c2 x² + …, coefficients in ascending powers; its numbers are "c0", "c1", ….

    >>> Polynomial([1.0, 0.0, 3.0]).derivatives(2.0)
    (13.0, 12.0, 6.0)
    """

    coefficients: Converted[tuple[float, ...], NumberRow] = required()

    def _read_numbers(self) -> None:
        values = law_numbers(self.coefficients, "Polynomial", "coefficients")
        object.__setattr__(self, "coefficients", values)

    def _check(self) -> None:
        if not len(self.coefficients):
            raise ModelError("Polynomial: coefficients is empty; give at least the constant term")

    def dimensioned(self, value: Dimension, argument: Dimension) -> Law:
        """The same; every power of the argument has a dimension of its own."""
        if not self.pending:
            return self
        given = enumerate(self.coefficients)
        return Polynomial([with_dimension(c, value / argument**i, f"c{i}") for i, c in given])

    def numbers(self) -> dict[str, float]:
        """{"c0": …, "c1": …, …}."""
        return {f"c{i}": c for i, c in enumerate(self.coefficients)}

    def with_numbers(self, numbers: Mapping[str, Any]) -> Law:
        """The polynomial with these coefficients."""
        return Polynomial([numbers[f"c{i}"] for i in range(len(numbers))])

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """The coefficients in ascending powers."""
        return [numbers[f"c{i}"] for i in range(len(self.coefficients))]


@dataclass(frozen=True)
class Harmonic(Law):
    """Sinusoid, simple harmonic motion: f = mean + amplitude sin(frequency x + phase).

    Frequency in rad per unit of x, phase in rad.

    >>> Harmonic(1.0, 2.0, 10.0).derivatives(0.0)
    (1.0, 20.0, -0.0)
    """

    kind: ClassVar[str] = "harmonic"

    mean: NumberField = law_field(1)
    amplitude: NumberField = law_field(1)
    frequency: NumberField = law_field(0, -1, 1)
    phase: NumberField = law_field(angle=1, default=0.0)

    def turns(self, x: float) -> FloatArray:
        """The next two extremes."""
        if self.amplitude == 0.0 or self.frequency == 0.0:
            return np.array([math.inf])
        n = math.floor((self.frequency * x + self.phase) / math.pi - 0.5) + np.arange(-3, 5)
        places = np.sort(((n + 0.5) * math.pi - self.phase) / self.frequency)
        return np.asarray(places[places > x][:2])
