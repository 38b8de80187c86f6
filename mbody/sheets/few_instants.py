"""The table of a few instants: a row a quantity, a column an instant."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.model.one_sided_constraint import joined
from mbody.quantities.units import DIMENSIONS
from mbody.sheets.names import ROUNDING, force_floor, force_names, swiftness
from mbody.sheets.text_table import WIDTH, Column, angles, numbers, table
from mbody.solution.measures import found_by, measured

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["few_instants"]

#: As many instants have a column each.
MOST = 6
#: Mechanisms of more links have rows of drivers and measures alone.
LINKS = 12

Array = np.ndarray


def few_instants(solution: Solution) -> list[str]:
    """Lines of a table of two to `MOST` instants of one design; of others none.

    >>> import mbody, numpy as np
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> run = mbody.statics(machine, drive={"motor": np.radians([30.0, 60.0])})
    >>> [line.split()[:4] for line in few_instants(run)[:4:3]]
    [['INSTANTS', '1', '2'], ['crank', 'angle', 'deg', '30.000']]
    """
    if solution.record.batch or not 2 <= len(solution) <= MOST:
        return []
    rows = _Rows(solution)
    if np.ptp(solution.t) > 0.0:
        rows.add("t", rows.unit("time"), solution.t)
    rows.drivers()
    if len(solution.mechanism.bodies) <= LINKS:
        rows.links()
        rows.joints()
    rows.measures()
    return rows.lines()


class _Rows:
    """Names, units and cells, row by row."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        self.mechanism = solution.mechanism
        self.unit = self.mechanism.units.of
        self.names: list[str] = []
        self.units: list[str] = []
        self.cells: list[list[str]] = []
        self.swift = swiftness(solution)
        self.floor = force_floor(solution) if solution.has_forces else 0.0

    def lines(self) -> list[str]:
        """One table, or two below each other where the instants are wider than a sheet."""
        if not self.names:
            return []
        columns = [
            Column(str(n), list(cells))
            for n, cells in enumerate(zip(*self.cells, strict=True), start=1)
        ]
        head = [
            Column("INSTANTS", self.names, text=True, whole=True),
            Column("", self.units, text=True, whole=True),
        ]
        whole = table([*head, *columns])
        if max(map(len, whole)) <= WIDTH:
            return whole
        half = (len(columns) + 1) // 2
        return [*table([*head, *columns[:half]]), "", *table([*head, *columns[half:]])]

    def add(self, name: str, unit: str, values: Array, floor: float = 0.0) -> None:
        cells = numbers(values, floor)
        there = np.isfinite(values)
        self._row(name, unit, [c if seen else "–" for c, seen in zip(cells, there, strict=True)])

    def _row(self, name: str, unit: str, cells: list[str]) -> None:
        self.names.append(name)
        self.units.append(unit)
        self.cells.append(cells)

    def drivers(self) -> None:
        """The efforts of drivers, and their power."""
        states = self.solution.drive_states
        for n, driver in enumerate(self.mechanism.drivers):
            if states is not None and not driver.angular:
                self.add(driver.name, self.unit("length"), states[:, n, 0])
            if not self.solution.has_forces:
                continue
            effort = self.solution.effort(driver.name)
            kind = "torque" if driver.angular else "force"
            floor = self.floor * (self.solution.system.length if driver.angular else 1.0)
            self.add(f"{driver.name} {kind}", self.unit(kind), effort, floor)
            if states is None or self.solution.analysis == "statics":
                continue
            rate = states[:, n, 1]
            power, least = effort * rate, floor * float(np.abs(rate).max())
            self.add(f"{driver.name} power", self.unit("power"), power, least)
            other = self.mechanism.units.everyday("power")
            if other is not None:
                self.add("", other[0], power * other[1], least * other[1])

    def links(self) -> None:
        """Angles of the links, and their rates."""
        for body in self.mechanism.bodies:
            history = self.solution[body.name]
            self._row(f"{body.name} angle", "deg", angles(history.angle))
            if self.solution.analysis == "statics":
                continue
            floor = ROUNDING * float(np.sqrt(self.swift))
            self.add(f"{body.name} ω", self.unit("angular velocity"), history.omega, floor)
            if self.solution.analysis != "close_loops":
                kind = "angular acceleration"
                self.add(f"{body.name} α", self.unit(kind), history.alpha, ROUNDING * self.swift)

    def joints(self) -> None:
        """Forces at the joints: magnitude and direction."""
        if not self.solution.has_forces:
            return
        names = force_names(self.mechanism)
        for joint in joined(self.mechanism):
            name, on = names[joint.name]
            reaction = self.solution.reaction(joint.name, on)
            shown = name if name.endswith(joint.name) else f"{name}, {joint.name}"
            self.add(shown, self.unit("force"), reaction.magnitude, self.floor)
            there = reaction.magnitude > self.floor
            x, y = (np.where(np.abs(c) > self.floor, c, 0.0) for c in (reaction.fx, reaction.fy))
            turned = angles(np.arctan2(y, x))
            cells = [cell if seen else "" for cell, seen in zip(turned, there, strict=True)]
            self._row("", "deg", cells)

    def measures(self) -> None:
        """The measures of the model that change from instant to instant."""
        for name, measure in self.mechanism.measures.items():
            if measure.by or not found_by(self.solution, measure):
                continue
            values, dimension, unit = measured(self.solution, measure)
            if dimension == DIMENSIONS["angle"] and not measure.unit:
                values, unit = np.degrees(values), "deg"
            finite = np.abs(values[np.isfinite(values)])
            self.add(name, unit, values, ROUNDING * float(finite.max(initial=0.0)))
