"""Between which values the numbers of an optimization may go, and where it begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.derivatives.named_numbers import checked_names, unit_of
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.numbers import dimension_named
from mbody.quantities import Formula, FormulaError
from mbody.quantities.number import NotFinite, float_or_formula
from mbody.system.system import System

__all__ = ["Ranges", "ranges_of"]


@dataclass(frozen=True, eq=False)
class Ranges:
    """The numbers that are varied.

    Attributes
    ----------
    names : tuple of str
        Dotted names.
    given : tuple of str
        The names as given.
    low, high, start : array (numbers,)
    units : tuple of str
    notes : tuple of str
        Numbers of the description that lie beyond their bounds, where the search does not begin.
    """

    names: tuple[str, ...]
    given: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    units: tuple[str, ...]
    notes: tuple[str, ...] = ()


def ranges_of(
    system: System, by: Mapping[str, Any] | None, start: Mapping[str, Any] | None
) -> Ranges:
    """What `by` and `start` say.

    Raises
    ------
    ModelError
        For numbers that there are not or that formulas make, and bounds that are none.
    """
    if not isinstance(by, Mapping) or not by:
        raise ModelError(
            'optimize: by must be a dict of bounds such as {"crank.A.x": (0.1, 0.3)}, not '
            f"{brief(by)}"
        )
    names = checked_names(system, list(by), "optimize")
    low, high = (
        np.array([_bounds(system, g, n, by[g])[k] for g, n in names.items()]) for k in (0, 1)
    )
    if start is not None and not isinstance(start, Mapping):
        raise ModelError(f"optimize: start must be a dict of numbers, not {brief(start)}")
    strange = [name for name in start or {} if name not in by]
    if strange:
        raise ModelError(
            f"optimize: start has {brief(strange[0])}, which by does not vary (it varies: "
            f"{listed(by)})",
            str(strange[0]),
        )
    first, notes = [], []
    for n, (given, name) in enumerate(names.items()):
        own = float(system.values[name])
        if start is not None and given in start:
            own = _number(system, name, start[given], given)
            if not low[n] <= own <= high[n]:
                raise ModelError(
                    f"optimize: start of '{given}' is {own:g}, beyond its bounds {low[n]:g} to "
                    f"{high[n]:g}",
                    given,
                )
        elif not low[n] <= own <= high[n]:
            notes.append(_beyond(system, given, name, own, (low[n], high[n])))
        first.append(own)
    return Ranges(
        names=tuple(names.values()),
        given=tuple(names),
        low=low,
        high=high,
        start=np.clip(np.array(first), low, high),
        units=tuple(unit_of(system.mechanism, name) for name in names.values()),
        notes=tuple(notes),
    )


def _beyond(system: System, given: str, name: str, own: float, bounds: tuple[float, float]) -> str:
    """The note of a number whose bounds leave the description out."""
    unit = unit_of(system.mechanism, name)
    near = float(np.clip(own, *bounds))
    return (
        f"'{given}' is {own:.6g} {unit}".rstrip()
        + f" in the description, beyond its bounds: the first search begins at {near:.6g} {unit}"
    ).rstrip()


def _bounds(system: System, given: str, name: str, pair: Any) -> tuple[float, float]:
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        raise ModelError(
            f"optimize: '{given}' needs its lowest and greatest value (low, high), not "
            f"{brief(pair)}",
            given,
        )
    low, high = (_number(system, name, one, given) for one in pair)
    unit = unit_of(system.mechanism, name)
    if not low < high:
        raise ModelError(
            f"optimize: '{given}' goes from {low:g} to {high:g} {unit}".rstrip()
            + ": give its lowest value, then its greatest",
            given,
        )
    sign, _ = system.rule(name)
    if sign and (low < 0.0 or (sign == "positive" and low == 0.0)):
        raise ModelError(
            f"optimize: '{given}' goes from {low:g} {unit}".rstrip()
            + f", it must {'be positive' if sign == 'positive' else 'not be negative'}: give a "
            "greater lowest value",
            given,
        )
    return low, high


def _number(system: System, name: str, value: Any, given: str) -> float:
    """One number in the units of the mechanism."""
    machine = system.mechanism
    try:
        made = value if isinstance(value, Formula) else float_or_formula(value, None)
        if isinstance(made, Formula):
            dimension, scope = dimension_named(machine, name), machine.parameters.scope()
            made = (made if dimension is None else made.of(dimension)).value(scope)
        number = float(made)
    except NotFinite as error:
        raise ModelError(f"optimize: '{given}' is {error}, it must be finite", given) from None
    except FormulaError as error:
        raise ModelError(f"optimize: '{given}': {error}", given) from None
    return number
