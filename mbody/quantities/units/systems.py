"""Consistent unit systems, chosen by name: the units of plain numbers in models and results.

The equations are homogeneous, so a mechanism works in one consistent system and no kernel uses
units: the unit of mass follows from force = mass · length / time². Currents are in amperes and
temperatures in kelvins in every system; the unit of voltage follows from voltage · current =
power, and is the volt where the unit of power is the watt.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from fractions import Fraction

from mbody.errors import ModelError
from mbody.quantities.units.dimensions import DIMENSIONS, Dimension, dimension_of, name_of
from mbody.quantities.units.symbols import SYMBOLS, Unit, known

__all__ = ["UNIT_SYSTEMS", "UnitSystem", "unit_system"]


#: Symbols of the electrical units that are derived, in the systems whose unit of power is the watt.
ELECTRICAL = {"voltage": "V", "resistance": "Ω", "inductance": "H", "capacitance": "F"}


#: Units that results are shown in beside those of a system.
EVERYDAY = {"mass": "kg", "power": "W", "inertia": "kg·m²"}


@dataclass(frozen=True)
class UnitSystem:
    """One consistent system of units: the unit symbols, and standard gravity.

    Attributes
    ----------
    name : str
        Of the system, for example ``"in-lbf-s"``.
    length, force, time, mass : str
        Unit symbols; angles are in radians inside and in degrees in printed results.
    g : float
        Standard gravity in length/time²: the default for converting a weight into a mass.
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

    def everyday(self, dimension: str) -> tuple[str, float] | None:
        """The kilogram, the watt or kg·m² and how many of it the unit of the system is, where it
        is another power of ten of it; None of other dimensions and units.

        >>> unit_system("mm-N-s").everyday("mass"), unit_system("mm-N-s").everyday("power")
        (('kg', 1000.0), ('W', 0.001))
        >>> unit_system("SI").everyday("mass"), unit_system("in-lbf-s").everyday("mass")
        (None, None)
        """
        if dimension not in EVERYDAY:
            return None
        ratio = self._ratio(dimension_of(dimension))
        digits = {str(ratio.numerator).rstrip("0"), str(ratio.denominator).rstrip("0")}
        return None if ratio == 1 or digits != {"1"} else (EVERYDAY[dimension], float(ratio))

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


def unit_system(name: str | UnitSystem) -> UnitSystem:
    """The unit system of that name: one of `UNIT_SYSTEMS`, or any length-force-time such as
    ``"cm-kN-s"``.

    Raises
    ------
    ModelError
        When there is none; the message lists the known ones.

    >>> unit_system("cm-kN-s").of("torque")
    'kN·cm'
    """
    if isinstance(name, UnitSystem):
        return name
    if isinstance(name, str):
        if name in UNIT_SYSTEMS:
            return UNIT_SYSTEMS[name]
        made = _made(name)
        if made is not None:
            return made
    names = ", ".join(repr(known) for known in UNIT_SYSTEMS)
    raise ModelError(
        f"there is no unit system {repr(name)[:60]}: choose one of {names}, or name a length, a "
        "force and a time, as in 'cm-kN-s'"
    )


def _made(name: str) -> UnitSystem | None:
    """A system of three units in `SYMBOLS`, None if they are not a length, a force and a time."""
    parts = [known(part) for part in name.split("-")] if len(name) <= 30 else []
    wanted = [DIMENSIONS[base] for base in ("length", "force", "time")]
    if len(parts) != 3 or [part and part.dimension for part in parts] != wanted:
        return None
    length, force, time = (part for part in parts if part is not None)
    mass = f"{force.symbol}·{time.symbol}²/{length.symbol}"
    g = Fraction("9.80665") * time.ratio**2 / length.ratio
    return UnitSystem(name, length.symbol, force.symbol, time.symbol, mass, float(g))
