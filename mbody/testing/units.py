"""The bench in other units: what an element gives must go along with its numbers."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mbody.laws import Cam, Function, Law, Table
from mbody.model.element import Element
from mbody.model.numbers import dimension_named
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.testing.bench import Bench, BenchState
from mbody.testing.report import Array, Ledger

__all__ = ["OtherUnits"]

#: Units of length, mass and time, as parts of the old ones, that no product of small powers undoes.
UNITS = (7.3, 0.31, 1.9)


class OtherUnits:
    """The same bench with every number in other units of length, mass and time.

    Attributes
    ----------
    missing : str
        Why it cannot be made: numbers that have no dimension. Empty where it can.
    """

    def __init__(self, bench: Bench) -> None:
        self.missing = _missing(bench.element)
        self.own = any(f.metadata.keys() & {"dimension", "law"} for f in _fields(bench.element))
        if self.missing:
            return
        machine = bench.system.mechanism
        dimensions = {name: dimension_named(machine, name) for name in bench.system.values}
        if None in dimensions.values():
            self.missing = "a law of it has numbers without a dimension"
            return
        values = {
            name: value / _size(dimensions[name] or Dimension())
            for name, value in bench.system.values.items()
        }
        self.bench = dataclasses.replace(bench)
        self.bench.__dict__["system"] = bench.system.with_values(values)

    def require(self, ledger: Ledger, name: str, error: float, what: str) -> None:
        """Require it of an element that declares what its numbers measure, note it of others."""
        text = f"in other units of length, mass and time {what}: what do its numbers measure?"
        if self.own:
            ledger.require(name, error, text)
        else:
            ledger.record(name, error, "it is right in any units", "it is right in one unit system")

    def state(self, state: BenchState) -> BenchState:
        """The same state in the other units."""
        length, time = _size(DIMENSIONS["length"]), _size(DIMENSIONS["time"])
        unit = np.tile([length, length, 1.0], len(state.q) // 3)
        return BenchState(state.t / time, state.q / unit, state.v / unit * time)

    def forces(self, forces: Array) -> Array:
        """Forces (bodies, 3) in the other units."""
        force, torque = _size(DIMENSIONS["force"]), _size(DIMENSIONS["torque"])
        found: Array = forces / np.array([force, force, torque])
        return found

    def rows(self, phi: Array, kinds: str) -> Array:
        """Φ (rows,) in the other units."""
        sizes = [_size(DIMENSIONS["length"]) if kind == "l" else 1.0 for kind in kinds]
        found: Array = phi / np.array(sizes)
        return found


def _fields(element: Element) -> list[Any]:
    return list(dataclasses.fields(element))


def _size(dimension: Dimension) -> float:
    """The new unit of a dimension as a part of the old one."""
    powers = dimension.length, dimension.mass, dimension.time
    return float(np.prod([unit ** float(p) for unit, p in zip(UNITS, powers, strict=True)]))


def _missing(element: Element) -> str:
    for field in _fields(element):
        law = getattr(element, field.name)
        if isinstance(law, (Function, Table, Cam)):
            return f"a {type(law).__name__} cannot be taken to other units here"
        if "law" in field.metadata and isinstance(law, Law) and not law.numbers():
            return f"a {type(law).__name__} has no numbers"
    return ""
