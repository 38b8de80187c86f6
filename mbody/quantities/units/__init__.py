"""Units: dimensions, symbols with exact ratios, consistent unit systems."""

from mbody.quantities.units.systems import (
    DIMENSIONS,
    NUMBER,
    SYMBOLS,
    UNIT_SYSTEMS,
    Dimension,
    Unit,
    UnitSystem,
    dimension_of,
    known,
    name_of,
    of_quantity,
    pint_unit,
    unit_system,
)

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
