"""Consistent unit systems, chosen by name: the units of plain numbers in models and results.

The equations are homogeneous, so a mechanism works in one consistent system and no kernel uses
units: the unit of mass follows from force = mass · length / time². Currents are in amperes and
temperatures in kelvins in every system; the unit of voltage follows from voltage · current =
power, and is the volt where the unit of power is the watt.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from mbody.errors import ModelError

# -- Dimensions as powers of length, mass, time, angle, electric current and temperature -------
# The angle counts as a dimension of its own, so that 5 Hz differs from 5 rad/s and N·m from
# N·m/rad; in products of quantities a radian is one, as usual, and in every electrical quantity, so
# that the constant of a motor may be written in N·m/A or in V·s/rad.


@dataclass(frozen=True)
class Dimension:
    """Powers of the six base dimensions.

    >>> DIMENSIONS["length"] / DIMENSIONS["time"] == DIMENSIONS["velocity"]
    True
    """

    length: Fraction = Fraction(0)
    mass: Fraction = Fraction(0)
    time: Fraction = Fraction(0)
    angle: Fraction = Fraction(0)
    current: Fraction = Fraction(0)
    temperature: Fraction = Fraction(0)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Dimension):
            return NotImplemented
        return self is other or (self._hash == other._hash and self._own == other._own)

    def __hash__(self) -> int:
        return self._hash

    @property
    def _own(self) -> tuple[Fraction, ...]:
        return self.length, self.mass, self.time, self.angle, self.current, self.temperature

    @functools.cached_property
    def _hash(self) -> int:
        """Once: results look units up by dimension, and fractions are slow to hash."""
        return hash(self._own)

    def _with(self, other: Dimension, sign: int) -> Dimension:
        return Dimension(
            self.length + sign * other.length,
            self.mass + sign * other.mass,
            self.time + sign * other.time,
            self.angle + sign * other.angle,
            self.current + sign * other.current,
            self.temperature + sign * other.temperature,
        )

    def __mul__(self, other: Dimension) -> Dimension:
        return self._with(other, 1)

    def __truediv__(self, other: Dimension) -> Dimension:
        return self._with(other, -1)

    def __pow__(self, power: Fraction | int) -> Dimension:
        return Dimension(
            self.length * power,
            self.mass * power,
            self.time * power,
            self.angle * power,
            self.current * power,
            self.temperature * power,
        )

    @property
    def mechanical(self) -> Dimension:
        """The dimension with the radian counted as one."""
        return replace(self, angle=Fraction(0))


def _make(*powers: int) -> Dimension:
    return Dimension(*map(Fraction, powers))


#: No dimension: a ratio, a count.
NUMBER = Dimension()

#: Dimensions by name; where several names have the same dimension, messages use the first.
DIMENSIONS = {
    "number": NUMBER,
    "length": _make(1, 0, 0),
    "mass": _make(0, 1, 0),
    "time": _make(0, 0, 1),
    "angle": _make(0, 0, 0, 1),
    "force": _make(1, 1, -2),
    "force rate": _make(1, 1, -3),
    "weight": _make(1, 1, -2),
    "torque": _make(2, 1, -2),
    "velocity": _make(1, 0, -1),
    "acceleration": _make(1, 0, -2),
    "angular velocity": _make(0, 0, -1, 1),
    "angular acceleration": _make(0, 0, -2, 1),
    "inertia": _make(2, 1, 0),
    "stiffness": _make(0, 1, -2),
    "damping": _make(0, 1, -1),
    "torsion stiffness": _make(2, 1, -2, -1),
    "torsion damping": _make(2, 1, -1, -1),
    "power": _make(2, 1, -3),
    "angular momentum": _make(2, 1, -1),
    "frequency": _make(0, 0, -1),
    "pressure": _make(-1, 1, -2),
    "area": _make(2, 0, 0),
    "density": _make(-3, 1, 0),
    "volume": _make(3, 0, 0),
    "volume flow": _make(3, 0, -1),
    "current": _make(0, 0, 0, 0, 1),
    "voltage": _make(2, 1, -3, 0, -1),
    "resistance": _make(2, 1, -3, 0, -2),
    "inductance": _make(2, 1, -2, 0, -2),
    "capacitance": _make(-2, -1, 4, 0, 2),
    "motor constant": _make(2, 1, -2, 0, -1),
    "temperature": _make(0, 0, 0, 0, 0, 1),
}

_NAMES: dict[Dimension, str] = {}
for _name, _dimension in DIMENSIONS.items():
    _NAMES.setdefault(_dimension, _name)


def dimension_of(name: str | Dimension) -> Dimension:
    """The dimension of that name.

    >>> dimension_of("torque") == dimension_of("force") * dimension_of("length")
    True
    """
    return name if isinstance(name, Dimension) else DIMENSIONS[name]


def name_of(dimension: Dimension) -> str:
    """Its name, empty where it has none.

    >>> name_of(DIMENSIONS["force"] * DIMENSIONS["length"])
    'torque'
    """
    return _NAMES.get(dimension, "")


# -- Units by symbol, each an exact ratio to SI; all other units are taken from pint -----------
# The usual units of mechanics and of its motors are defined here, so that a model file with
# ``lbf``, ``mm`` or ``rpm`` is read in microseconds. Pint, which takes 0.3 s to load, is used only
# for other symbols.


@dataclass(frozen=True)
class Unit:
    """A unit: its ratio to the SI unit, ``ratio · π^pi``, and its dimension.

    `symbol`: As it was written.
    `ratio`: Exact, so that a unit divided by itself is exactly one.
    `pi`: Power of π in the factor: 1 for a degree.
    `dimension`: Of the unit.
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
    ("dyn dyne", Fraction(1, 10**5), 0, _D["force"]),
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


#: Both letters that Unicode has for a millionth.
MICRO = ("µ", "μ")


@functools.lru_cache(maxsize=256)
def pint_unit(symbol: str) -> Unit | None:
    """A unit of pint, None where pint does not know it.

    >>> pint_unit("stone").factor
    6.35029318
    >>> pint_unit("nonsense") is None, pint_unit("µN").factor
    (True, 1e-06)
    """
    if symbol[:1] in MICRO and len(symbol) > 1:
        symbol = f"u{symbol[1:]}"
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
_OF_PINT = {"[length]": "m", "[mass]": "kg", "[time]": "s", "[current]": "A", "[temperature]": "K"}


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


#: Symbols of the electrical units that are derived, in the systems whose unit of power is the watt.
ELECTRICAL = {"voltage": "V", "resistance": "Ω", "inductance": "H", "capacitance": "F"}


@dataclass(frozen=True)
class UnitSystem:
    """One consistent system of units: the unit symbols, and standard gravity.

    `name`: Of the system, for example ``"in-lbf-s"``.
    `length`, `force`, `time`, `mass`: Unit symbols; angles are in radians inside and in degrees in
      printed results.
    `g`: Standard gravity in length/time²: the default for converting a weight into a mass.
    """

    name: str
    length: str
    force: str
    time: str
    mass: str
    g: float

    def of(self, dimension: str | Dimension) -> str:
        """Unit symbol of a dimension, for example ``of("torque")`` → ``"lbf·in"``.

        >>> unit_system("in-lbf-s").of("acceleration")
        'in/s²'
        >>> unit_system("SI").of(DIMENSIONS["force"] / DIMENSIONS["time"])
        'N/s'
        """
        return self._symbol(dimension_of(dimension))

    @functools.lru_cache(maxsize=1024)  # noqa: B019 (there are few unit systems)
    def _symbol(self, wanted: Dimension) -> str:
        name = name_of(wanted)
        if name == "mass":
            return self.mass
        if name in ELECTRICAL and self._ratio(wanted) == 1:
            return ELECTRICAL[name]
        powers = self.powers(wanted)
        above = "·".join(_powered(symbol, p) for symbol, p in powers if p > 0)
        below = [_powered(symbol, -p) for symbol, p in powers if p < 0]
        return "/".join([above or "1", *below]) if above or below else ""

    def powers(self, dimension: str | Dimension) -> tuple[tuple[str, Fraction], ...]:
        """The symbols of which a unit is composed, with powers: force, length, time, angle,
        current, temperature.

        >>> [(symbol, int(power)) for symbol, power in unit_system("SI").powers("torque") if power]
        [('N', 1), ('m', 1)]
        """
        wanted = dimension_of(dimension)
        return (
            (self.force, wanted.mass),
            (self.length, wanted.length - wanted.mass),
            (self.time, wanted.time + 2 * wanted.mass),
            ("rad", wanted.angle),
            ("A", wanted.current),
            ("K", wanted.temperature),
        )

    @functools.lru_cache(maxsize=1024)  # noqa: B019 (there are few unit systems)
    def unit(self, dimension: str | Dimension) -> Unit:
        """The unit of a dimension with its exact ratio to SI."""
        wanted = dimension_of(dimension)
        return Unit(self.of(wanted), self._ratio(wanted), 0, wanted)

    @functools.cached_property
    def second(self) -> float:
        """1 s in the unit of time.

        >>> unit_system("mm-N-ms").second
        1000.0
        """
        return float(1 / self._ratio(DIMENSIONS["time"]))

    def _ratio(self, wanted: Dimension) -> Fraction:
        length, force, time = (SYMBOLS[s] for s in (self.length, self.force, self.time))
        mass = force.ratio * time.ratio**2 / length.ratio
        ratio = Fraction(1)
        for base, power in (
            (length.ratio, wanted.length),
            (mass, wanted.mass),
            (time.ratio, wanted.time),
        ):
            if power.denominator != 1:
                ratio *= Fraction(float(base) ** float(power))
            else:
                ratio *= base**power.numerator
        return ratio


def _powered(symbol: str, power: Fraction) -> str:
    if power == 1:
        return symbol
    digits = "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(d)] for d in str(power)) if power.denominator == 1 else ""
    return symbol + (digits or f"^({power})")


UNIT_SYSTEMS = {
    system.name: system
    for system in (
        UnitSystem("SI", "m", "N", "s", "kg", 9.80665),
        UnitSystem("mm-N-s", "mm", "N", "s", "t", 9806.65),
        UnitSystem("in-lbf-s", "in", "lbf", "s", "blob", 9.80665 / 0.0254),
        UnitSystem("ft-lbf-s", "ft", "lbf", "s", "slug", 9.80665 / 0.3048),
    )
}


#: Names of systems by their units of length, mass and time.
BY_MASS = {"mks": "m-kg-s", "cgs": "cm-g-s"}


def unit_system(name: str | UnitSystem) -> UnitSystem:
    """The unit system of that name: one of `UNIT_SYSTEMS`, any length-force-time such as
    ``"cm-kN-s"``, or length-mass-time such as ``"mm-kg-s"``, where the unit of force has a name.

    Raises ModelError when there is none; the message lists the known ones.

    >>> unit_system("cm-kN-s").of("torque")
    'kN·cm'
    >>> unit_system("mm-kg-s").of("force"), unit_system("mks").name
    ('mN', 'SI')
    """
    if isinstance(name, UnitSystem):
        return name
    if isinstance(name, str):
        if name in UNIT_SYSTEMS:
            return UNIT_SYSTEMS[name]
        made = _coherent_system(BY_MASS.get(name.lower(), name))
        if made is not None:
            return made
    names = ", ".join(repr(known) for known in UNIT_SYSTEMS)
    raise ModelError(
        f"there is no unit system {repr(name)[:60]}: choose one of {names}, or name a length, a "
        "force and a time, as in 'cm-kN-s'"
    )


def _named(dimension: str, ratio: Fraction) -> Unit | None:
    """The first usual unit of that size."""
    wanted = DIMENSIONS[dimension]
    found = (unit for unit in SYMBOLS.values() if unit.dimension == wanted and unit.ratio == ratio)
    return next(found, None)


def _coherent_system(name: str) -> UnitSystem | None:
    """A system of three units in `SYMBOLS`, None if they are not a length, a force or a mass, and
    a time.
    """
    parts = [known(part) for part in name.split("-")] if len(name) <= 30 else []
    length, middle, time = parts if len(parts) == 3 else (None, None, None)
    if length is None or middle is None or time is None:
        return None
    found = [part.dimension for part in (length, middle, time)]
    by_mass = found[1] == DIMENSIONS["mass"]
    if found != [DIMENSIONS[k] for k in ("length", "mass" if by_mass else "force", "time")]:
        return None
    force, mass = middle, f"{middle.symbol}·{time.symbol}²/{length.symbol}"
    if by_mass:
        followed = _named("force", middle.ratio * length.ratio / time.ratio**2)
        if followed is None:
            raise ModelError(_no_force(name, length, middle, time))
        force, mass = followed, middle.symbol
        same = (length.symbol, force.symbol, time.symbol)
        for one in UNIT_SYSTEMS.values():
            if (one.length, one.force, one.time) == same:
                return one
    g = Fraction("9.80665") * time.ratio**2 / length.ratio
    return UnitSystem(name, length.symbol, force.symbol, time.symbol, mass, float(g))


def _no_force(name: str, length: Unit, mass: Unit, time: Unit) -> str:
    """Why no system has that unit of mass, and the ways out."""
    pound = length.symbol in ("in", "ft") or mass.symbol.startswith(("lb", "oz"))
    force = "lbf" if pound else "N"
    return (
        f"'{name}' names a mass, whose unit of force {mass.symbol}·{length.symbol}/{time.symbol}² "
        f"has no name: choose '{length.symbol}-{force}-{time.symbol}', write masses with their "
        f'unit, as "2 {mass.symbol}", and let results show them so by output_units, mass = '
        f'"{mass.symbol}"'
    )
