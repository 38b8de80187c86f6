"""How every result begins as data, whatever it is a result of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mbody._version import __version__
from mbody.solution.doubts import certificate

if TYPE_CHECKING:
    from mbody.quantities.units import UnitSystem

__all__ = ["heading", "unit_symbols"]

DIMENSIONS = ("length", "force", "time", "mass")


def unit_symbols(units: UnitSystem, angle: str = "rad") -> dict[str, str]:
    """The units of a result by dimension; angles are in `angle`, ``"deg"`` or ``"rad"``.

    >>> from mbody.quantities.units import unit_system
    >>> unit_symbols(unit_system("SI"), "deg")["torque"]
    'N·m'
    """
    symbols = {name: units.of(name) for name in DIMENSIONS}
    return symbols | {"angle": angle, "torque": units.of("torque")}


def heading(
    model: str | None, analysis: str, units: Mapping[str, str], result: Any = None
) -> dict[str, Any]:
    """The first keys of a result as data: ``{"mbody", "model", "analysis", "units", "status",
    "doubts", "notes"}``.

    Parameters
    ----------
    model : str or None
        Title of the mechanism; None where the result is of none.
    analysis : str
        What was done.
    units : mapping
        Of the numbers that follow, by dimension or by name.
    result : object, optional
        With `status`, `doubts` and `notes`; by default there is no doubt and no note. What has
        notes alone is completed.

    >>> from mbody.solution.doubts import Inherited
    >>> list(heading("a crank", "statics", {"length": "m"}, Inherited()))
    ['mbody', 'model', 'analysis', 'units', 'status', 'doubts', 'notes']
    """
    head = {"mbody": __version__, "model": model, "analysis": analysis, "units": dict(units)}
    if hasattr(result, "doubts"):
        return head | certificate(result)
    notes = list(getattr(result, "notes", ()))
    return head | {"status": "completed", "doubts": [], "notes": notes}
