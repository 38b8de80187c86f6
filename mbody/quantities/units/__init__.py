"""Units: dimensions, symbols with exact ratios, and the consistent systems that they make."""

from mbody.quantities.units.dimensions import DIMENSIONS, NUMBER, Dimension, dimension_of, name_of
from mbody.quantities.units.symbols import SYMBOLS, Unit, foreign, known, of_quantity
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
    "foreign",
    "known",
    "name_of",
    "of_quantity",
    "unit_system",
]
