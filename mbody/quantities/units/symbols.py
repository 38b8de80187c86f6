"""Units by symbol, each an exact ratio to SI; all other units are taken from pint.

The usual units of mechanics and of its motors are defined here, so that a model file with
``lbf``, ``mm`` or ``rpm`` is read in microseconds. Pint, which takes 0.3 s to load, is used only
for other symbols.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from mbody.quantities.units.dimensions import DIMENSIONS, NUMBER, Dimension

__all__ = ["SYMBOLS", "Unit", "pint_unit", "known", "of_quantity"]


@dataclass(frozen=True)
class Unit:
    """A unit: its ratio to the SI unit, ``ratio · π^pi``, and its dimension.

    Attributes
    ----------
    symbol : str
        As it was written.
    ratio : Fraction
        Exact, so that a unit divided by itself is exactly one.
    pi : int
        Power of π in the factor: 1 for a degree.
    dimension : Dimension
        Of the unit.
    """

    symbol: str
    ratio: Fraction
    pi: int
    dimension: Dimension

    def __mul__(self, other: Unit) -> Unit:
        return Unit(
            f"{self.symbol}·{other.symbol}",
            self.ratio * other.ratio,
            self.pi + other.pi,
            self.dimension * other.dimension,
        )

    def __truediv__(self, other: Unit) -> Unit:
        return replace(self * other**-1, symbol=f"{self.symbol}/{other.symbol}")

    def __pow__(self, power: int) -> Unit:
        return Unit(
            f"{self.symbol}^{power}", self.ratio**power, self.pi * power, self.dimension**power
        )

    @property
    def factor(self) -> float:
        """The factor as one float, rounded once if it is rational; inf where it is too large.

        >>> known("deg").factor == math.pi / 180.0
        True
        """
        ratio = self.ratio
        try:
            if not self.pi:
                return float(ratio)
            return math.pi**self.pi * ratio.numerator / ratio.denominator
        except OverflowError:
            return math.inf


_IN, _FT = Fraction("0.0254"), Fraction("0.3048")
_LB, _G = Fraction("0.45359237"), Fraction("9.80665")
_LBF = _LB * _G
_D = DIMENSIONS
_ENERGY = _D["torque"]

# symbols: ratio to SI, power of π, dimension
_TABLE: tuple[tuple[str, Fraction | int, int, Dimension], ...] = (
    ("m", 1, 0, _D["length"]),
    ("km", 1000, 0, _D["length"]),
    ("dm", Fraction(1, 10), 0, _D["length"]),
    ("cm", Fraction(1, 100), 0, _D["length"]),
    ("mm", Fraction(1, 1000), 0, _D["length"]),
    ("um µm μm", Fraction(1, 10**6), 0, _D["length"]),
    ('in inch inches "', _IN, 0, _D["length"]),
    ("ft foot feet '", _FT, 0, _D["length"]),
    ("yd yard", 3 * _FT, 0, _D["length"]),
    ("mile miles mi", 5280 * _FT, 0, _D["length"]),
    ("kg", 1, 0, _D["mass"]),
    ("g gram", Fraction(1, 1000), 0, _D["mass"]),
    ("t tonne", 1000, 0, _D["mass"]),
    ("lb lbm lbs", _LB, 0, _D["mass"]),
    ("oz", _LB / 16, 0, _D["mass"]),
    ("slug slugs", _LBF / _FT, 0, _D["mass"]),
    ("blob blobs slinch", _LBF / _IN, 0, _D["mass"]),
    ("s sec", 1, 0, _D["time"]),
    ("ms", Fraction(1, 1000), 0, _D["time"]),
    ("min", 60, 0, _D["time"]),
    ("h hr", 3600, 0, _D["time"]),
    ("rad", 1, 0, _D["angle"]),
    ("mrad", Fraction(1, 1000), 0, _D["angle"]),
    ("deg degree degrees °", Fraction(1, 180), 1, _D["angle"]),
    ("rev turn", 2, 1, _D["angle"]),
    ("rpm", Fraction(1, 30), 1, _D["angular velocity"]),
    ("Hz", 1, 0, _D["frequency"]),
    ("N", 1, 0, _D["force"]),
    ("mN", Fraction(1, 1000), 0, _D["force"]),
    ("kN", 1000, 0, _D["force"]),
    ("MN", 10**6, 0, _D["force"]),
    ("lbf", _LBF, 0, _D["force"]),
    ("ozf", _LBF / 16, 0, _D["force"]),
    ("kip", 1000 * _LBF, 0, _D["force"]),
    ("kgf kp", _G, 0, _D["force"]),
    ("Nm", 1, 0, _D["torque"]),
    ("Nmm", Fraction(1, 1000), 0, _D["torque"]),
    ("kNm", 1000, 0, _D["torque"]),
    ("J", 1, 0, _ENERGY),
    ("kJ", 1000, 0, _ENERGY),
    ("W", 1, 0, _D["power"]),
    ("kW", 1000, 0, _D["power"]),
    ("MW", 10**6, 0, _D["power"]),
    ("hp", 550 * _LBF * _FT, 0, _D["power"]),
    ("mph", 5280 * _FT / 3600, 0, _D["velocity"]),
    ("Pa", 1, 0, _D["pressure"]),
    ("kPa", 1000, 0, _D["pressure"]),
    ("MPa", 10**6, 0, _D["pressure"]),
    ("GPa", 10**9, 0, _D["pressure"]),
    ("bar", 10**5, 0, _D["pressure"]),
    ("psi", _LBF / _IN**2, 0, _D["pressure"]),
    ("A", 1, 0, _D["current"]),
    ("mA", Fraction(1, 1000), 0, _D["current"]),
    ("kA", 1000, 0, _D["current"]),
    ("V", 1, 0, _D["voltage"]),
    ("mV", Fraction(1, 1000), 0, _D["voltage"]),
    ("kV", 1000, 0, _D["voltage"]),
    # both letters that Unicode has for it
    ("ohm Ω Ω", 1, 0, _D["resistance"]),
    ("mohm mΩ mΩ", Fraction(1, 1000), 0, _D["resistance"]),
    ("kohm kΩ kΩ", 1000, 0, _D["resistance"]),
    ("H", 1, 0, _D["inductance"]),
    ("mH", Fraction(1, 1000), 0, _D["inductance"]),
    ("uH µH μH", Fraction(1, 10**6), 0, _D["inductance"]),
    ("F", 1, 0, _D["capacitance"]),
    ("mF", Fraction(1, 1000), 0, _D["capacitance"]),
    ("uF µF μF", Fraction(1, 10**6), 0, _D["capacitance"]),
    ("nF", Fraction(1, 10**9), 0, _D["capacitance"]),
    ("K", 1, 0, _D["temperature"]),
)

#: The usual units by symbol.
SYMBOLS = {
    symbol: Unit(symbol, Fraction(ratio), pi, dimension)
    for symbols, ratio, pi, dimension in _TABLE
    for symbol in symbols.split()
}


def known(symbol: str) -> Unit | None:
    """The unit in `SYMBOLS` with that symbol, None if there is none.

    >>> known("kN").factor
    1000.0
    """
    return SYMBOLS.get(symbol)


#: Units of pint that need not load it. They are not among the symbols, since those are no names of
#: parameters, and L is the name of many.
LITRES = ("L", "l", "litre", "liter")


@functools.lru_cache(maxsize=1)
def _registry() -> Any:
    """Pint's registry, with exact ratios; loaded when it is first needed."""
    import pint

    return pint.UnitRegistry(non_int_type=Fraction, cache_folder=None)


@functools.lru_cache(maxsize=256)
def pint_unit(symbol: str) -> Unit | None:
    """A unit of pint, None where pint does not know it.

    >>> pint_unit("stone").factor
    6.35029318
    >>> pint_unit("nonsense") is None
    True
    """
    if not symbol.isidentifier() or not symbol.isascii() or len(symbol) > 40:
        return None
    if symbol in LITRES:
        return Unit(symbol, Fraction(1, 1000), 0, _D["length"] ** 3)
    import pint

    registry = _registry()
    try:
        unit = registry.parse_units(symbol)
        return _measured(symbol, registry.Quantity(Fraction(1), unit))
    except (pint.PintError, ArithmeticError, ValueError, TypeError, KeyError, AttributeError):
        return None


def of_quantity(quantity: Any) -> Unit | None:
    """A quantity of pint as a unit of that size; None for anything else, and for arrays.

    >>> import pint
    >>> of_quantity(pint.UnitRegistry().Quantity(2.0, "kN")).factor
    2000.0
    >>> of_quantity(2.0) is None
    True
    """
    if not (hasattr(quantity, "dimensionality") and hasattr(quantity, "to")):
        return None
    return _measured(f"{quantity}", quantity)


#: Pint's names of our base dimensions, and their SI units.
_OF_PINT = {
    "[length]": "m",
    "[mass]": "kg",
    "[time]": "s",
    "[current]": "A",
    "[temperature]": "K",
}


def _measured(symbol: str, quantity: Any) -> Unit | None:
    """A quantity of pint as a unit; None for dimensions other than those of `Dimension`, and for
    the scales of temperature that do not begin at absolute zero.
    """
    powers = dict(quantity.dimensionality)
    if not set(powers) <= set(_OF_PINT):
        return None
    if "[temperature]" in powers and type(quantity)(0, quantity.units).to_root_units().magnitude:
        return None
    size = quantity.to({_OF_PINT[name]: power for name, power in powers.items()} or "radian")
    # for pint a radian is dimensionless, but it remains among the root units
    powers["[angle]"] = dict(quantity.to_root_units().unit_items()).get("radian", 0)
    exact = {
        name.strip("[]"): Fraction(power).limit_denominator(12) for name, power in powers.items()
    }
    dimension = Dimension(**exact)
    try:
        return Unit(symbol, Fraction(size.magnitude), 0, dimension)
    except (TypeError, ValueError, OverflowError):  # an array, nan or inf
        return None


#: The unit of plain numbers.
ONE = Unit("1", Fraction(1), 0, NUMBER)
