"""Units in which results come out, by quantity: those of the model, or others."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.quantities.evaluate import Scope, degrees_of, dimension_text, evaluate
from mbody.quantities.parse import FormulaError, parse_unit
from mbody.quantities.units import (
    DIMENSIONS,
    NUMBER,
    SYMBOLS,
    Dimension,
    UnitSystem,
    dimension_of,
    name_of,
)

#: Quantities of a name that is not that of their dimension, and what they may be.
ALSO = {
    "speed": ("angular velocity", "velocity"),
    "work": ("torque",),
    "energy": ("torque",),
}
QUANTITIES = {name: (name,) for name in DIMENSIONS if name not in ("number", "weight")} | ALSO


class OutputUnits:
    """The unit of every quantity of a result, and how many of the model's one of it is.

    `system`: Units of the model.
    `chosen`: Others: by dimension the symbol and its size in units of the model.
    `beside`: Of the same form: what sheets show beside a quantity, in a column of its own.

    >>> from mbody.quantities.units import unit_system
    >>> units = OutputUnits(unit_system("mm-N-s")).having({"mass": "kg", "speed": "rpm"})
    >>> units.of("mass"), units.of("angular velocity"), units.of("length")
    ('kg', 'rpm', 'mm')
    >>> float(units.converted(0.002, "mass"))
    2.0
    """

    def __init__(
        self,
        system: UnitSystem,
        chosen: Mapping[Dimension, tuple[str, float]] | None = None,
        beside: Mapping[Dimension, tuple[str, float]] | None = None,
    ) -> None:
        self.system, self.name = system, system.name
        self.chosen, self.beside = dict(chosen or {}), dict(beside or {})

    def having(self, given: Mapping[str, str]) -> OutputUnits:
        """Other units of some quantities by name, such as ``{"mass": "kg", "speed": "rpm"}``.

        Raises
        ------
        ModelError
            For a quantity that there is not, and for a unit of another quantity.
        """
        named: dict[Dimension, tuple[str, float]] = {}
        for name, unit in given.items():
            dimension, size = _sized(name, unit, self.system)
            if named.setdefault(dimension, (unit_text(unit), size))[1] != size:
                raise ModelError(
                    f"output units: {name} has the same dimension as another quantity that is in "
                    f"{named[dimension][0]}: give both one unit"
                )
        beside = {one: unit for one, unit in self.beside.items() if one not in named}
        return OutputUnits(self.system, self.chosen | named, beside)

    def with_angle(self, given: str | None, otherwise: str) -> OutputUnits:
        """With angles in `given`; by default in the chosen unit, or `otherwise` where none is."""
        if given is None and DIMENSIONS["angle"] in self.chosen:
            return self
        return self.having({"angle": given or otherwise})

    def of(self, dimension: str | Dimension) -> str:
        """The symbol of the unit of a quantity."""
        found = self.chosen.get(dimension_of(dimension))
        return self.system.of(dimension) if found is None else found[0]

    def given(self, dimension: Dimension) -> str:
        """The unit that was chosen for a quantity, as it is printed; empty where none was."""
        return self.chosen[dimension][0] if dimension in self.chosen else ""

    def size(self, dimension: str | Dimension) -> float:
        """How many units of the model the unit of a quantity is."""
        return self.chosen.get(dimension_of(dimension), ("", 1.0))[1]

    def converted(self, values: Any, dimension: str | Dimension) -> Any:
        """Values in the model's unit, in that of the output."""
        found = self.chosen.get(dimension_of(dimension))
        if found is None:
            return values
        if found[0] == "deg":
            return degrees_of(values)
        return np.asarray(values, dtype=float) / found[1]

    def names(self) -> dict[str, str]:
        """What was chosen, by name of the quantity, as a mechanism takes it.

        >>> from mbody.quantities.units import unit_system
        >>> OutputUnits(unit_system("SI")).having({"speed": "rpm"}).names()
        {'angular velocity': 'rpm'}
        """
        return {name_of(dimension): unit for dimension, (unit, _) in self.chosen.items()}

    def symbols(self) -> dict[str, str]:
        """The unit of every quantity by name, for the head of a result.

        >>> from mbody.quantities.units import unit_system
        >>> OutputUnits(unit_system("SI")).symbols()["torque"]
        'N·m'
        """
        return {name: self.of(name) for name in DIMENSIONS if name not in ("number", "weight")}


def unit_text(unit: str) -> str:
    """A unit as it is printed: products with a dot, whether it was given with a star or a space.

    >>> unit_text("lbf*in"), unit_text("kg mm^2"), unit_text("rad/s")
    ('lbf·in', 'kg·mm²', 'rad/s')
    """
    return re.sub(r"\s*\*\s*|\s+", "·", unit.strip()).replace("^2", "²").replace("^3", "³")


@functools.lru_cache(maxsize=64)
def read_by_people(system: UnitSystem) -> OutputUnits:
    """The units of sheets, reports and pictures where a model does not choose: angles in degrees,
    powers in watts, metric masses in kilograms and inertias in kg times the square of the unit of
    length; angular velocities have revolutions a minute beside them.

    >>> from mbody.quantities.units import unit_system
    >>> units = read_by_people(unit_system("mm-N-s"))
    >>> [units.of(one) for one in ("mass", "power", "inertia", "angle", "torque")]
    ['kg', 'W', 'kg·mm²', 'deg', 'N·mm']
    >>> read_by_people(unit_system("in-lbf-s")).of("mass")
    'blob'
    """
    found = {DIMENSIONS["angle"]: ("deg", SYMBOLS["deg"].factor)}
    metric = {"mass": ("kg", Fraction(1)), "power": ("W", Fraction(1))}
    metric["inertia"] = f"kg·{system.length}²", SYMBOLS[system.length].ratio ** 2
    for name, (symbol, ratio) in metric.items():
        ratio /= system.unit(name).ratio
        if {str(part).rstrip("0") for part in ratio.as_integer_ratio()} == {"1"}:
            found[DIMENSIONS[name]] = symbol, float(ratio)
    rpm = SYMBOLS["rpm"]
    size = rpm.factor / system.unit(rpm.dimension).factor
    return OutputUnits(system, found, {rpm.dimension: ("rpm", size)})


def _sized(name: Any, unit: Any, system: UnitSystem) -> tuple[Dimension, float]:
    """What a unit measures, and how many units of a system it is; for the quantity `name`."""
    if name not in QUANTITIES:
        import difflib

        near = difflib.get_close_matches(str(name), QUANTITIES, 1)
        hint = f"did you mean '{near[0]}'?" if near else "name one as mass, torque, speed"
        raise ModelError(f"output units: there is no quantity {brief(str(name))}, {hint}")
    wanted = [DIMENSIONS[one] for one in QUANTITIES[name]]
    if not isinstance(unit, str):
        raise ModelError(f"output units: the unit of {name} must be text, such as 'kg': {unit!r}")
    try:
        one = evaluate(parse_unit(unit), Scope(system), with_units=True)
    except FormulaError as error:
        raise ModelError(f"output units: {name}: {error}") from None
    if not 0.0 < one.value < math.inf:
        raise ModelError(f"output units: {name}: '{unit}' is no unit")
    measures = one.dimension or NUMBER
    for dimension in wanted:
        if measures.mechanical == dimension.mechanical:
            return dimension, float(one.value)
    raise ModelError(
        f"output units: '{unit}' measures {dimension_text(measures)}, not {name}: take one "
        f"such as {system.of(wanted[0])}"
    )
