"""Units: dimensions, symbols with exact ratios, consistent unit systems."""

from mbody.quantities.units.dimensions import DIMENSIONS, NUMBER, Dimension, dimension_of, name_of
from mbody.quantities.units.symbols import SYMBOLS, Unit, known, of_quantity, pint_unit
from mbody.quantities.units.systems import UNIT_SYSTEMS, UnitSystem, unit_system

__all__ = [
    "DIMENSIONS",
    "NUMBER",
    "SYMBOLS",
    "UNIT_SYSTEMS",
    "Dimension",
    "Unit",
    "UnitSystem",
    "dimension_of",
    "pint_unit",
    "known",
    "name_of",
    "of_quantity",
    "unit_system",
]
