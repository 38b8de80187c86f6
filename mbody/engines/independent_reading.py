"""The numbers of a system, read again independently for the engines that check it, with pint.

Text with units is evaluated by Python's own parser with the units of pint. Masses, places and laws
follow from the numbers by the formulas of this file. So an error in mbody's units, formulas,
positions, masses or law kernels does not enter the engines that should find it. Tables and cams are
those of `textbook_laws`; Python functions, and formulas that Python reads differently, are taken
from the system.
"""

from __future__ import annotations

import ast
import functools
import math
import re
import weakref
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from mbody.core.tolerances import COMPARISON_READING, TABLE_RANGE_MARGIN
from mbody.laws import (
    Cam,
    Constant,
    ConstantAcceleration,
    ConstantSpeed,
    Dwell,
    Expression,
    Harmonic,
    Law,
    MeasuredFormula,
    Polynomial,
    Rise,
    Table,
)
from mbody.model.driver import AngleDriver
from mbody.model.element import Element, Marker, Polar
from mbody.model.loads import Torque, TorsionDamper, TorsionSpring
from mbody.model.mechanism import Mechanism
from mbody.quantities import Formula
from mbody.quantities.units import DIMENSIONS, SYMBOLS, UnitSystem
from mbody.system.assembler import assemble
from mbody.system.system import System

# -- Tables by SciPy's interpolators and cam programs by Norton's formulas, for engines that
#    check -------------------------------------------------------------------------------------

Array = np.ndarray
#: f, f′, f″.
Three = tuple[Any, Any, Any]


class Tabulated:
    """A `Table`: called it gives values, and `derivatives` (f, f′, f″), at places or arrays."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self.x, self.y = np.array(table.x, dtype=float), np.array(table.y, dtype=float)
        self.curve = self._curve(table.interpolation or "spline")

    def _curve(self, kind: str) -> Callable[[Array, int], Array]:
        """Function of places within the table and the order of the derivative."""
        from scipy.interpolate import CubicSpline, PchipInterpolator

        x, y = self.x, self.y
        if kind == "spline":
            end = "periodic" if self.table.periodic else self.table.end or "not-a-knot"
            return CubicSpline(x, y, bc_type=end)
        if kind == "pchip":
            if self.table.periodic:  # three periods: the ends of the middle one are inner points
                period = x[-1] - x[0]
                x = np.concatenate([x[:-1] - period, x, x[1:] + period])
                y = np.concatenate([y[:-1], y, y[1:]])
            return PchipInterpolator(x, y)
        slopes = np.diff(y) / np.diff(x) * (kind == "linear")

        def pieces(at: Array, order: int) -> Array:
            n = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
            if kind == "hold" and order == 0:
                return y[np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 1)]
            return (y[n] + slopes[n] * (at - x[n]), slopes[n], 0.0 * at)[order]

        return pieces

    def __call__(self, x: Any) -> Any:
        """Values."""
        return self.derivatives(x)[0]

    def derivatives(self, x: Any) -> Three:
        """(f, f′, f″); NaN outside of a table that has no values there."""
        first, last = self.x[0], self.x[-1]
        span = last - first
        at = np.asarray(x, dtype=float)
        if self.table.periodic:
            at = first + np.mod(at - first, span)
        within = np.clip(at, first, last)
        f, f1, f2 = (np.array(self.curve(within, n), dtype=float) for n in range(3))
        beyond = at - within
        if self.table.interpolation == "hold":
            held = last + (self.x[-1] - self.x[-2])  # the last value lasts as the one before it
            outside = (at > held) | (beyond < -TABLE_RANGE_MARGIN * span)
            f1, f2 = 0.0 * f1, 0.0 * f2
        else:
            outside = np.abs(beyond) > TABLE_RANGE_MARGIN * span
            if self.table.outside == "hold":
                f1, f2 = np.where(outside, 0.0, f1), np.where(outside, 0.0, f2)
            else:
                f, f2 = f + f1 * beyond, np.where(outside, 0.0, f2)
        if self.table.outside == "error":
            f, f1, f2 = (np.where(outside, np.nan, one) for one in (f, f1, f2))
        return (f, f1, f2) if at.ndim else (float(f), float(f1), float(f2))


class FormulaProgram:
    """A `Rise`, or a `Cam` program: called it gives values, and `derivatives` (f, f′, f″)."""

    def __init__(self, law: Rise | Cam) -> None:
        self.period = law.period if isinstance(law, Cam) else math.inf
        segments = law.segments if isinstance(law, Cam) else (law,)
        self.rises: list[tuple[Rise, float, float]] = []
        end, level = 0.0, None
        for one in segments:
            if isinstance(one, Dwell):
                end += one.duration
                continue
            level = one.base if level is None else level
            self.rises.append((one, end + one.start, level))
            end, level = end + one.start + one.duration, level + one.height
        self.base = self.rises[0][2]

    def __call__(self, x: Any) -> Any:
        """Values."""
        return self.derivatives(x)[0]

    def derivatives(self, x: Any) -> Three:
        """(f, f′, f″) at a place, or at an array of them."""
        if np.ndim(x):
            table = np.array([self.derivatives(one) for one in np.ravel(x).tolist()])
            f, f1, f2 = table.reshape(*np.shape(x), 3).transpose(-1, *range(np.ndim(x)))
            return f, f1, f2
        x = float(x) % self.period if math.isfinite(self.period) else float(x)
        found: Three = (self.base, 0.0, 0.0)
        for rise, start, level in self.rises:
            u = (x - start) / rise.duration
            if u >= 1.0:
                found = (level + rise.height, 0.0, 0.0)
            elif u >= 0.0:
                s, v, a = shape(rise.shape, u)
                h, b = rise.height, rise.duration
                found = (level + h * s, h * v / b, h * a / b**2)
        return found


#: Coefficients of the polynomials of standard cams, from u³ on.
POLYNOMIALS = {"3-4-5": (10.0, -15.0, 6.0), "4-5-6-7": (0.0, 35.0, -84.0, 70.0, -20.0)}
#: Parts of a rise in which the acceleration grows and in which it falls, of the modified curves.
GROWS_FALLS = {
    "parabolic": (0.0, 0.0),
    "modified-trapezoidal": (0.25, 0.25),
    "modified-sine": (0.25, 0.75),
}


def shape(name: str, u: float) -> tuple[float, float, float]:
    """s, s′, s″ of a rise of height 1 and duration 1, at 0 ≤ u ≤ 1."""
    if name == "cycloidal":
        w = 2.0 * math.pi
        return u - math.sin(w * u) / w, 1.0 - math.cos(w * u), w * math.sin(w * u)
    if name == "harmonic":
        w = math.pi
        return (
            0.5 * (1.0 - math.cos(w * u)),
            0.5 * w * math.sin(w * u),
            0.5 * w * w * math.cos(w * u),
        )
    if name in POLYNOMIALS:
        curve = np.polynomial.Polynomial([0.0, 0.0, 0.0, *POLYNOMIALS[name]])
        return float(curve(u)), float(curve.deriv()(u)), float(curve.deriv(2)(u))
    if u >= 0.5:  # symmetric about the middle; where f″ jumps there, it is that to the right
        s, v, a = _half(*GROWS_FALLS[name], 1.0 - u)
        return 1.0 - s, v, -a
    return _half(*GROWS_FALLS[name], u)


def _half(b: float, d: float, u: float) -> tuple[float, float, float]:
    """s, s′, s″ up to the middle: the acceleration grows as a sine over b/2, stays, and falls as a
    cosine over d/2 (Norton's family).
    """
    top = 0.5 / _grown(b, d, 0.5)[0]
    s, v, a = _grown(b, d, u)
    return top * s, top * v, top * a


def _grown(b: float, d: float, u: float) -> tuple[float, float, float]:
    """s, s′, s″ whose greatest acceleration is 1, not brought to the height 1."""
    p, q, stays = b / math.pi, d / math.pi, 0.5 * (1.0 - d)
    if u < 0.5 * b:
        return p * (u - p * math.sin(u / p)), p * (1.0 - math.cos(u / p)), math.sin(u / p)
    first = p * (0.5 * b - p)
    if u <= stays:
        w = u - 0.5 * b
        return first + p * w + 0.5 * w * w, p + w, 1.0
    whole = stays - 0.5 * b
    w, speed = u - stays, p + whole
    place = first + p * whole + 0.5 * whole**2
    return (
        place + speed * w + q * q * (1.0 - math.cos(w / q)),
        speed + q * math.sin(w / q),
        math.cos(w / q),
    )


# -- Second-order Taylor arithmetic: derivatives along a line, exact to rounding ---------------


class Jet:
    """f, f′, f″ along one line: arithmetic of second-order Taylor series, exact to rounding."""

    __slots__ = ("f", "f1", "f2")

    def __init__(self, f: float, f1: float = 0.0, f2: float = 0.0) -> None:
        self.f, self.f1, self.f2 = f, f1, f2

    def through(self, f: float, g: float, h: float) -> Jet:
        """A function of self with value f, derivative g, second derivative h."""
        return Jet(f, g * self.f1, g * self.f2 + h * self.f1**2)

    def __add__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.f + other, self.f1, self.f2)
        return Jet(self.f + other.f, self.f1 + other.f1, self.f2 + other.f2)

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.f * other, self.f1 * other, self.f2 * other)
        a, b = self, other
        return Jet(a.f * b.f, a.f1 * b.f + a.f * b.f1, a.f2 * b.f + 2.0 * a.f1 * b.f1 + a.f * b.f2)

    def __pow__(self, p: float) -> Jet:
        if p == 0:
            return Jet(1.0)
        if p == 1:
            return self
        return self.through(
            self.f**p, p * self.f ** (p - 1), p * (p - 1) * self.f ** (p - 2) if p != 2 else 2.0
        )

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Any) -> Jet:
        return self + other * -1.0

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __truediv__(self, other: Any) -> Jet:
        return self * (other**-1 if isinstance(other, Jet) else 1.0 / other)

    def __rtruediv__(self, other: Any) -> Jet:
        return self**-1 * other

    __radd__, __rmul__ = __add__, __mul__

    # NumPy's functions call these methods on objects
    def sqrt(self) -> Jet:
        """√f."""
        return self**0.5

    def cos(self) -> Jet:
        """cos f."""
        c, s = math.cos(self.f), math.sin(self.f)
        return self.through(c, -s, -c)

    def sin(self) -> Jet:
        """sin f."""
        c, s = math.cos(self.f), math.sin(self.f)
        return self.through(s, c, -s)

    def arctan(self) -> Jet:
        """arctan f."""
        derivative = 1.0 / (1.0 + self.f**2)
        return self.through(math.atan(self.f), derivative, -2.0 * self.f * derivative**2)

    def exp(self) -> Jet:
        """e to the f."""
        return self.through(*[math.exp(self.f)] * 3)

    def log(self) -> Jet:
        """The natural logarithm."""
        return self.through(math.log(self.f), 1.0 / self.f, -1.0 / self.f**2)


_readings: weakref.WeakKeyDictionary[System, Reading] = weakref.WeakKeyDictionary()


def reading(system: System) -> Reading:
    """The reading of a system of one design, made once.

    >>> import mbody
    >>> system = mbody.assemble(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 2, 3)))
    >>> reading(system).mass("coupler")
    (2.0, 1.5)
    """
    if system not in _readings:
        _readings[system] = Reading(system)
    return _readings[system]


class Reading:
    """Numbers, places, masses and laws of a system of one design.

    `values`: Numbers by dotted name, in the units of the mechanism.
    """

    def __init__(self, system: System) -> None:
        self.system, self.mechanism = system, system.mechanism
        self.values: dict[str, Any] = dict(system.values)
        self._laws: dict[tuple[str, str], Any] = {}
        self._formulas = dict(self._texts())
        self._parameters = {name: self.values.get(name) for name in self.mechanism.parameters}
        for name in self.mechanism.parameters:
            self._parameters[name] = self._parameter(name, frozenset())
        for name, formula in self._formulas.items():
            anew = self._number(formula)
            ours = self.values.get(name)
            if anew is None or ours is None or np.ndim(ours):
                continue
            if abs(anew - ours) > COMPARISON_READING * abs(anew):
                self.values[name] = anew

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def _texts(self) -> Iterator[tuple[str, Formula]]:
        """Numbers that the user wrote as text and that were not changed since."""
        own = assemble(self.mechanism).values
        given = {**self.mechanism.parameters, **self.mechanism.formulas}
        for name, formula in given.items():
            if not isinstance(formula, Formula) or np.ndim(self.values.get(name, 0.0)):
                continue
            dependent = name in self.system.formulas
            if dependent or own.get(name) == self.values.get(name):
                yield name, formula

    def _parameter(self, name: str, visited: frozenset[str]) -> float:
        """The value of a parameter in the units of the mechanism."""
        own = float(self.values.get(name, 0.0))
        formula = self._formulas.get(name)
        if formula is None or name in visited:
            return own
        for other in formula.names & self._parameters.keys():
            self._parameters[other] = self._parameter(other, visited | {name})
        anew = self._number(formula)
        return own if anew is None else anew

    def _number(self, formula: Any) -> float | None:
        """The value of a formula; None where it cannot be read here."""
        found = evaluated(formula.text, self._parameters, self.mechanism)
        if found is None:
            return None
        value, measured = found
        if not measured and not formula.names and formula.dimension == DIMENSIONS["angle"]:
            return None  # a plain number may be in degrees, depending on the field
        return float(value)

    # -- places -------------------------------------------------------------------------------

    def point(self, name: str) -> tuple[float, float]:
        """(x, y) of a point by its dotted name, in link axes."""
        if f"{name}.r" in self.values:
            r, angle = float(self.values[f"{name}.r"]), float(self.values[f"{name}.angle"])
            return r * math.cos(angle), r * math.sin(angle)
        return float(self.values[f"{name}.x"]), float(self.values[f"{name}.y"])

    def place(self, element: Element, field: str) -> tuple[float, float]:
        """(x, y) of a marker in link axes."""
        marker: Marker = element.places()[field]
        if isinstance(marker.point, str):
            return self.point(f"{marker.body}.{marker.point}")
        if f"{element.name}.{field}.x" in self.values or f"{element.name}.{field}.r" in self.values:
            return self.point(f"{element.name}.{field}")
        if isinstance(marker.point, Polar):
            r, angle = marker.point.r, marker.point.angle
            return r * math.cos(angle), r * math.sin(angle)
        return float(marker.point[0]), float(marker.point[1])

    def arm(self, element: Element, field: str) -> tuple[float, float]:
        """(x, y) from the mass centre of the marker's body to the marker, in link axes."""
        x, y = self.place(element, field)
        body = element.places()[field].body
        cx, cy = (0.0, 0.0) if body == "ground" else self.point(f"{body}.cg")
        return x - cx, y - cy

    def angle(self, element: Element, field: str) -> float:
        """Direction of a marker in link axes [rad]."""
        return float(self.values[f"{element.name}.{field}.angle"])

    # -- masses -------------------------------------------------------------------------------

    def mass(self, body: str) -> tuple[float, float]:
        """Mass and moment of inertia of a body."""
        if body == "ground":
            return 0.0, 0.0
        mass = float(self.values.get(f"{body}.mass") or 0.0)
        weight = self.values.get(f"{body}.weight")
        if not mass and weight:
            mass = float(weight) / self.mechanism.g
        return mass, float(self.values.get(f"{body}.inertia") or 0.0)

    @functools.cached_property
    def masses(self) -> np.ndarray:
        """(bodies, 3): m, m, I of the moving bodies."""
        rows = [self.mass(body.name) for body in self.mechanism.bodies]
        return np.array([(m, m, inertia) for m, inertia in rows]).reshape(-1, 3)

    # -- laws ---------------------------------------------------------------------------------

    def law(self, element: Element, field: str = "law") -> Any:
        """A law of a driver or a load, by its formula."""
        key = element.name, field
        if key not in self._laws:
            self._laws[key] = self._law(element, field)
        return self._laws[key]

    def _law(self, element: Element, field: str) -> Any:
        law: Law = getattr(element, field)
        own = law.numbers()
        name = f"{element.name}.{field}"
        plain = set(own) == {"value"}
        numbers = {k: float(self.values[name if plain else f"{name}.{k}"]) for k in own}
        if isinstance(law, Expression) and numbers == own:
            angular = isinstance(element, AngleDriver | Torque | TorsionSpring | TorsionDamper)
            written = _written(law, self._parameters, self.mechanism, angular)
            if written is not None:
                return written
        return law_by_formula(law.with_numbers(numbers))


def laws_of(
    system: System, run: Any, driver: Any, instants: Any = slice(None)
) -> np.ndarray | None:
    """(3, instants): value, rate and acceleration by the law of a driver at instants of a run.

    None where the run used other values than the law, or what it follows is no function of time.
    """
    if run.given is not None or isinstance(driver.law, MeasuredFormula):
        return None
    law = reading(system).law(driver)
    table = [law.derivatives(float(t)) for t in np.asarray(run.t)[instants]]
    return np.array(table).reshape(-1, 3).T


class PlainLaw:
    """A law as plain formulas: called it gives values, and `derivatives` (f, f′, f″) at a place."""

    def __init__(self, function: Any) -> None:
        self._function = function

    def __call__(self, x: Any) -> Any:
        """Values at a place, or at an array of them."""
        return self.derivatives(x)[0]

    def derivatives(self, x: Any) -> tuple[Any, Any, Any]:
        """(f, f′, f″) at a place, or at an array of them."""
        if np.ndim(x):
            places = np.asarray(x, dtype=float)
            table = np.array([self.derivatives(one) for one in places.ravel().tolist()])
            f, f1, f2 = table.reshape(*places.shape, 3).transpose(-1, *range(places.ndim))
            return f, f1, f2
        found = self._function(Jet(float(x), 1.0))
        if not isinstance(found, Jet):
            found = Jet(float(found))
        return float(found.f), float(found.f1), float(found.f2)


def law_by_formula(law: Law) -> Any:
    """A law by a formula of this file; the law itself where there is none.

    >>> law_by_formula(Harmonic(1.0, 2.0, 10.0)).derivatives(0.0)[:2]
    (1.0, 20.0)
    """
    n: Any = law.numbers()
    match law:
        case Constant():
            return PlainLaw(lambda x: n["value"] + 0.0 * x)
        case ConstantSpeed():
            return PlainLaw(lambda x: n["value"] + n["speed"] * x)
        case ConstantAcceleration():
            half = 0.5 * n["acceleration"]
            return PlainLaw(lambda x: n["value"] + n["speed"] * x + half * (x * x))
        case Harmonic():
            wave, phase = n["frequency"], n["phase"]
            return PlainLaw(lambda x: n["mean"] + n["amplitude"] * (wave * x + phase).sin())
        case Polynomial():
            coefficients = [n[f"c{k}"] for k in range(len(n))]

            def horner(x: Any) -> Any:
                found: Any = Jet(0.0)
                for c in reversed(coefficients):
                    found = found * x + c
                return found

            return PlainLaw(horner)
        case Table():
            return Tabulated(law)
        case Rise() | Cam():
            return FormulaProgram(law)
    return law


def _written(
    law: Expression, parameters: dict[str, Any], mechanism: Mechanism, angular: bool
) -> PlainLaw | None:
    """The law of a formula from its text; None where it cannot be read here."""
    found = parsed(law.text, mechanism.units)
    if found is None or (angular and not found[1]):
        return None
    tree, names = found[0], _names(parameters)

    def at(x: Any) -> Any:
        return _value(tree, {**names, "t": x, "x": x})

    try:
        at(Jet(0.37, 1.0))
    except Exception:  # a function that jets do not have
        return None
    return PlainLaw(at)


# -- formulas ---------------------------------------------------------------------------------

_NUMBER = r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_NAME = r"[^\W\d]\w*"
_POWER = r"(?:\^-?\d+)?"
#: A number and its unit, which binds more tightly than any operation.
_MEASURED = re.compile(rf"({_NUMBER})\s*({_NAME}{_POWER}(?:\s*[*/]\s*{_NAME}{_POWER})*)")
_PRETTY = str.maketrans({"·": "*", "²": "^2", "³": "^3", "⁴": "^4", "−": "-", "°": "deg"})
_FUNCTIONS: dict[str, Any] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "abs": np.abs,
    "hypot": np.hypot,
    "min": min,
    "max": max,
    "sign": lambda x: (x > 0.0) - (x < 0.0) + 0.0,
    "step": lambda x: 1.0 if x >= 0.0 else 0.0,
    "clamp": lambda x, low, high: low if x < low else high if x > high else x,
    "deadband": lambda x, width: x - width if x > width else x + width if x < -width else 0.0 * x,
}


@functools.cache
def _pint() -> Any:
    import pint

    return pint.UnitRegistry()


def scale(unit: str, system_units: UnitSystem) -> float:
    """The size of a unit in those of a system, by pint."""
    registry = _pint()
    one = (1.0 * registry.parse_units(unit)).to_base_units()
    length, force, time = (
        (1.0 * registry.parse_units(name)).to_base_units().magnitude
        for name in (system_units.length, system_units.force, system_units.time)
    )
    mass = force * time**2 / length
    powers = dict(one.dimensionality)
    size = (
        length ** powers.pop("[length]", 0)
        * mass ** powers.pop("[mass]", 0)
        * time ** powers.pop("[time]", 0)
    )
    if powers:
        raise ValueError(unit)
    return float(one.magnitude / size)


def evaluated(
    text: str, parameters: dict[str, Any], mechanism: Mechanism
) -> tuple[Any, bool] | None:
    """A formula's value in the units of the mechanism, and whether it has units; None where Python
    and pint cannot read it.

    >>> import mbody
    >>> machine = mbody.Mechanism("in inches", units="in-lbf-s")
    >>> round(evaluated("2*a + 25.4 mm", {"a": 3.0}, machine)[0], 12)
    7.0
    """
    found = parsed(text, mechanism.units)
    try:
        return None if found is None else (_value(found[0], _names(parameters)), found[1])
    except Exception:  # any error of an unknown name or an invalid number
        return None


@functools.lru_cache(maxsize=1024)
def parsed(text: str, units: UnitSystem) -> tuple[ast.expr, bool] | None:
    """A formula as Python's syntax tree, with units as numbers, and whether it had units; None
    where Python and pint cannot read it.
    """
    measured = False

    def bracketed(found: re.Match[str]) -> str:
        nonlocal measured
        number, unit = found.groups()
        parts = re.split(r"(\s*[*/]\s*)", unit)
        # directly after a number there is a unit; further on what is a symbol of one, written
        # without spaces, belongs to it, and all else are names of parameters
        kept, parts = parts[:1], parts[1:]
        while parts and len(parts[0]) == 1 and _is_symbol(parts[1].partition("^")[0]):
            kept += parts[:2]
            parts = parts[2:]
        measured = True
        size = scale("".join(kept).replace("^", "**"), units)
        return f"({number}*{size!r}){''.join(parts)}"

    try:
        plain = _MEASURED.sub(bracketed, text.translate(_PRETTY)).replace("^", "**")
        return ast.parse(plain.strip(), mode="eval").body, measured
    except Exception:  # any error of Python's parser or of pint
        return None


def _is_symbol(name: str) -> bool:
    """Whether a name may go on a unit, by the grammar of formulas; what it measures says pint."""
    return name in SYMBOLS and name not in ("t", "x")


def _names(parameters: dict[str, Any]) -> dict[str, Any]:
    """The values of the names in a formula."""
    return {**parameters, **_FUNCTIONS, "pi": math.pi}


def _value(node: ast.AST, names: dict[str, Any]) -> Any:
    """The value of a node of Python's tree: numbers, names, the four operations, powers, calls."""
    match node:
        case ast.Constant(value=int() | float() as value):
            return float(value)
        case ast.Name(id=name):
            return names[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, names)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand, names)
        case ast.BinOp(left=left, op=operation, right=right):
            a, b = _value(left, names), _value(right, names)
            match operation:
                case ast.Add():
                    return a + b
                case ast.Sub():
                    return a - b
                case ast.Mult():
                    return a * b
                case ast.Div():
                    return a / b
                case ast.Pow():
                    return a**b
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            return names[name](*[_value(argument, names) for argument in arguments])
    raise ValueError(ast.dump(node))
