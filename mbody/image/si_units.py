"""SI units of numbers and measures: what units of co-simulation have."""

from __future__ import annotations

import functools
from dataclasses import dataclass

from mbody.quantities import Scope, evaluate, parse_unit
from mbody.quantities.units import NUMBER, Dimension, name_of, unit_system

__all__ = ["SiUnit", "si_unit"]

#: Names by which SI has what is composed otherwise in mbody's systems.
USUAL = {
    "inertia": "kg.m2",
    "pressure": "Pa",
    "power": "W",
    "density": "kg/m3",
    "angular momentum": "kg.m2/s",
    "resistance": "Ohm",
}
SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹·", "0123456789.")


@dataclass(frozen=True)
class SiUnit:
    """The SI unit of what another unit measures.

    Attributes
    ----------
    name : str
        Such as "N.m"; empty of a plain number.
    factor : float
        The other unit in this one.
    dimension : Dimension
    """

    name: str
    factor: float
    dimension: Dimension


@functools.cache
def si_unit(text: str) -> SiUnit:
    """The SI unit of what a unit measures, with "." for products and plain exponents.

    >>> si_unit("lbf·in").name, round(si_unit("lbf·in").factor, 6)
    ('N.m', 0.112985)
    >>> si_unit("deg").name, si_unit("").factor
    ('rad', 1.0)
    """
    if not text:
        return SiUnit("", 1.0, NUMBER)
    system = unit_system("SI")
    found = evaluate(parse_unit(text), Scope(system))
    dimension = found.dimension or NUMBER
    name = USUAL.get(name_of(dimension)) or system.of(dimension).translate(SUPERSCRIPTS)
    return SiUnit(name, float(found.value), dimension)
