"""The numbers of a description with a complex step in one of them: places, masses, laws, by the
formulas of this file.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.engines.independent_reading import evaluated
from mbody.laws import Constant, ConstantAcceleration, ConstantSpeed, Harmonic, Polynomial, Rise
from mbody.model.element import Polar, place_name
from tests.support.taylor import Taylor, cos, sin

#: The complex step: derivatives are imaginary parts by it.
STEP = 1e-30
POLYNOMIALS = {
    Constant: ("value",),
    ConstantSpeed: ("value", "speed"),
    ConstantAcceleration: ("value", "speed", "acceleration"),
}
#: Places and weights of the derivative of a law's second derivative by differences.
PLACES = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


class ComplexReading:
    """Numbers by dotted name, one of them (and what formulas make of it) with a complex step."""

    def __init__(self, system: Any, by: str) -> None:
        self.system, self.mechanism = system, system.mechanism
        self.values: dict[str, Any] = dict(system.values)
        if by in self.values:  # else a number of the first state alone
            self.values[by] = complex(self.values[by], STEP)
        self.polar = {name.removesuffix(".r") for name in self.values if name.endswith(".r")}
        self.arms: dict[tuple[str, str], tuple[Any, Any]] = {}
        if by in self.mechanism.parameters:
            self._follow()

    def _follow(self) -> None:
        """What formulas make of parameters, again and again until all that follow have."""
        parameters = self.mechanism.parameters
        for _ in range(len(self.system.formulas) + 1):
            own = {name: self.values[name] for name in parameters}
            before = dict(self.values)
            for name, formula in self.system.formulas.items():
                found = evaluated(formula.text, own, self.mechanism)
                assert found is not None, formula.text
                # a plain number of an angle may be in degrees: the scale is that of the value
                here = float(self.system.values[name])
                real = complex(found[0]).real
                scale = here / real if real else 1.0
                self.values[name] = complex(here, complex(found[0]).imag * scale)
            if all(self.values[name] == before[name] for name in self.values):
                return
        raise AssertionError("formulas in a circle")

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def get(self, element: Any, field: str) -> Any:
        """A number of an element, None where it is not given."""
        if getattr(element, field, None) is None:
            return None
        return self.values[f"{element.name}.{field}"]

    def point(self, name: str) -> tuple[Any, Any]:
        if name in self.polar:
            r, angle = self[f"{name}.r"], self[f"{name}.angle"]
            return r * cos(angle), r * sin(angle)
        return self[f"{name}.x"], self[f"{name}.y"]

    def arm(self, element: Any, field: str) -> tuple[Any, Any]:
        """From the mass centre to a marker, link axes."""
        key = element.name, field
        if key not in self.arms:
            self.arms[key] = self._arm(element, field)
        return self.arms[key]

    def _arm(self, element: Any, field: str) -> tuple[Any, Any]:
        marker = element.places()[field]
        name = f"{marker.body}.{marker.point}"
        if not isinstance(marker.point, str):
            name = place_name(f"{element.name}.{field}", marker.point)
            if isinstance(marker.point, Polar):
                assert name in self.polar
        x, y = (0.0, 0.0) if name.endswith(".origin") else self.point(name)
        cx, cy = self.point(f"{marker.body}.cg")
        return x - cx, y - cy

    def angle(self, element: Any, field: str) -> Any:
        return self[f"{element.name}.{field}.angle"]

    def mass(self, body: Any) -> tuple[Any, Any]:
        weight = self.values.get(f"{body.name}.weight")
        mass = self[f"{body.name}.mass"] if weight is None else weight / self.mechanism.g
        return mass, self[f"{body.name}.inertia"]

    def law(self, element: Any, field: str, x: Any) -> Any:
        """A law of an element at a number with a complex step, or along lines."""
        law = getattr(element, field)
        own = law.numbers()
        name = f"{element.name}.{field}"
        plain = set(own) == {"value"}
        numbers = {k: self[name if plain else f"{name}.{k}"] for k in own}
        if not isinstance(x, Taylor):
            return _derivatives(law, numbers, complex(x))[0]
        f, f1, f2 = _derivatives(law, numbers, x.f)
        return x.through(f, f1, f2)


def _derivatives(law: Any, numbers: dict[str, Any], x: complex) -> tuple[Any, Any, Any]:
    """(f, f′, f″) at a complex step, of numbers with one."""
    kinds = POLYNOMIALS.get(type(law))
    if kinds is not None or isinstance(law, Polynomial):
        names = kinds or [f"c{k}" for k in range(len(numbers))]
        c = [numbers[name] for name in names]
        if kinds is not None and len(c) == 3:
            c[2] = 0.5 * c[2]
        f = sum(a * x**k for k, a in enumerate(c))
        f1 = sum(k * a * x ** (k - 1) for k, a in enumerate(c) if k)
        f2 = sum(k * (k - 1) * a * x ** (k - 2) for k, a in enumerate(c) if k > 1)
        return f, f1, f2
    if isinstance(law, Harmonic):
        a, w = numbers["amplitude"], numbers["frequency"]
        phase = w * x + numbers["phase"]
        s, c = sin(phase), cos(phase)
        return numbers["mean"] + a * s, a * w * c, -a * w * w * s
    if isinstance(law, Rise):
        return _rise(law, numbers, x)
    assert all(complex(one).imag == 0.0 for one in numbers.values()), type(law).__name__
    return _around(law, x)


def _around(law: Any, x: complex, h: float = 4e-3) -> tuple[Any, Any, Any]:
    """Any law at a complex step of its argument alone."""
    f, f1, f2 = (float(one) for one in law.derivatives(x.real))
    third = 0.0
    if x.imag:
        ends = [float(law.derivatives(x.real + k * h)[2]) for k in PLACES]
        third = float(WEIGHTS @ np.array(ends)) / h
    return (complex(f, f1 * x.imag), complex(f1, f2 * x.imag), complex(f2, third * x.imag))


def _rise(law: Any, n: dict[str, Any], x: complex) -> tuple[Any, Any, Any]:
    """base + height S(u), u = (x − start)/duration, S being the shape over the unit interval."""
    shape = type(law)(law.shape, 1.0, 0.0, 1.0)
    u = (x - n["start"]) / n["duration"]
    s, s1, s2 = _around(shape, complex(u)) if 0.0 < complex(u).real < 1.0 else (0.0, 0.0, 0.0)
    if complex(u).real >= 1.0:
        s = 1.0
    h, d = n["height"], n["duration"]
    return n["base"] + h * s, h * s1 / d, h * s2 / (d * d)


def remainder(x: Any, turn: float = 2.0 * math.pi) -> Any:
    """x within one turn, 0 ≤ x < turn; the step as it is."""
    if isinstance(x, Taylor):
        return x - turn * math.floor(x.f.real / turn)
    return x - turn * math.floor(complex(x).real / turn)
