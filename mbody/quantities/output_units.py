"""Units in which results come out, by quantity: those of the model, or others."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.quantities.evaluate import Scope, degrees_of, dimension_text, evaluate
from mbody.quantities.parse import FormulaError, parse_unit
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, UnitSystem, dimension_of

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

    >>> from mbody.quantities.units import unit_system
    >>> units = OutputUnits(unit_system("mm-N-s")).having({"mass": "kg", "speed": "rpm"})
    >>> units.of("mass"), units.of("angular velocity"), units.of("length")
    ('kg', 'rpm', 'mm')
    >>> float(units.converted(0.002, "mass"))
    2.0
    """

    def __init__(
        self, system: UnitSystem, chosen: Mapping[Dimension, tuple[str, float]] | None = None
    ) -> None:
        self.system, self.chosen = system, dict(chosen or {})

    def having(self, given: Mapping[str, str]) -> OutputUnits:
        """Other units of some quantities by name, such as ``{"mass": "kg", "speed": "rpm"}``.

        Raises
        ------
        ModelError
            For a quantity that there is not, and for a unit of another quantity.
        """
        found = dict(self.chosen)
        for name, unit in given.items():
            dimension, size = _sized(name, unit, self.system)
            found[dimension] = (unit.replace("*", "·"), size)
        return OutputUnits(self.system, found)

    def of(self, dimension: str | Dimension) -> str:
        """The symbol of the unit of a quantity."""
        found = self.chosen.get(dimension_of(dimension))
        return self.system.of(dimension) if found is None else found[0]

    def converted(self, values: Any, dimension: str | Dimension) -> Any:
        """Values in the model's unit, in that of the output."""
        found = self.chosen.get(dimension_of(dimension))
        if found is None:
            return values
        if found[0] == "deg":
            return degrees_of(values)
        return np.asarray(values, dtype=float) / found[1]


def _sized(name: Any, unit: Any, system: UnitSystem) -> tuple[Dimension, float]:
    """What a unit measures, and how many units of a system it is; for the quantity `name`."""
    if name not in QUANTITIES:
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
