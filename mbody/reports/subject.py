"""Subject of a report: a result over the cycle, its names and peaks, and further analyses."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.driven import analyse_at
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.freedom.mobility import Mobility, mobility
from mbody.engines.crosscheck import Crosscheck, crosscheck
from mbody.errors import ModelError, SolveError
from mbody.model.mechanism import Mechanism
from mbody.model.study import Instants
from mbody.quantities.evaluate import place_in_turn
from mbody.quantities.output_units import OutputUnits
from mbody.solution.columns import ResultTable
from mbody.solution.result_table import shown_table
from mbody.solution.solution import Solution
from mbody.summaries.text_table import Column, force_floor, force_names, number, quantities
from mbody.system.formula_rows import driver_states
from mbody.views.free_bodies import force_peak
from mbody.views.motions import cycle
from mbody.views.page import digest_of

Array = np.ndarray

#: So few instants of a model are marked, each with its free-body diagrams.
FEW = 6
#: Instants of a cycle at which other engines are asked.
COMPARED = 100


@dataclass(eq=False)
class Subject:
    """A result with what chapters of a report need of it more than once.

    `run`: Over the cycle, over time, or at one instant.
    `described`: The description, as it was given.
    `marked`: Instants of its own at which free-body diagrams are drawn.
    `plots`, `polar`: What is plotted; by default all measures, and the joints of the greatest
      forces.
    `against`: Engines of the cross-check.
    `command`: That repeats the report.
    `other`: Another design that it is compared with.
    `label`: Name of the design in a comparison.
    """

    run: Solution
    marked: list[int]
    described: Mechanism
    plots: Sequence[str] = ()
    polar: Sequence[str] = ()
    against: Any = None
    command: str = ""
    other: Subject | None = None
    label: str = ""
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def mechanism(self) -> Mechanism:
        """The description."""
        return self.run.mechanism

    @property
    def many(self) -> bool:
        """Whether there are several instants."""
        return len(self.run) > 1

    @property
    def course(self) -> str:
        """Word for the range of the instants: motion or cycle."""
        return "motion" if self.run.analysis == "simulate" else "cycle"

    @functools.cached_property
    def units(self) -> OutputUnits:
        """The units that are shown."""
        return self.mechanism.shown

    def unit(self, dimension: str) -> str:
        """The unit of a dimension."""
        return self.units.of(dimension)

    def shown(self, value: Any, dimension: str) -> float:
        """One value of the model in the unit that is shown."""
        return float(self.units.converted(value, dimension))

    def column(self, title: str, values: Any, dimension: str, floor: float = 0.0) -> Column:
        """A column of values of the model."""
        return quantities(title, values, dimension, self.units, floor)

    @functools.cached_property
    def mobility(self) -> Mobility:
        """Degrees of freedom."""
        return mobility(self.mechanism)

    @functools.cached_property
    def crosscheck(self) -> Crosscheck:
        """The cross-checks by other engines."""
        return crosscheck(self.run.system, self.against, ours=self.compared)

    @functools.cached_property
    def compared(self) -> Solution:
        """The result at as many instants as other engines are asked for: of a cycle enough."""
        step = -(-len(self.run) // COMPARED)
        if step < 2 or self.run.analysis == "simulate":
            return self.run
        return self.run.take(range(0, len(self.run), step))

    @functools.cached_property
    def names(self) -> dict[str, tuple[str, str]]:
        """Textbook names of joint forces and efforts, with the body on which they act."""
        return force_names(self.mechanism)

    @functools.cached_property
    def floor(self) -> float:
        """Rounding level of forces."""
        return force_floor(self.run)

    @property
    def table(self) -> ResultTable:
        """All histories, in the units that are shown."""
        return shown_table(self.run)

    @property
    def loaded(self) -> bool:
        """Whether any force is more than rounding; without masses and loads there is none."""
        return self.run.has_forces and self.floor > 0.0

    @functools.cached_property
    def _file(self) -> tuple[str, str]:
        text, digest, why = digest_of(self.described)
        if why:
            self.failed["text"] = why
        return text, digest

    @property
    def text(self) -> str:
        """The model as a file; empty where it has Python code."""
        return self._file[0]

    @property
    def digest(self) -> str:
        """SHA-256 of the model's text; empty where it has none."""
        return self._file[1]

    def where(self, instants: Sequence[int]) -> list[tuple[str, list[str], str]]:
        """Columns that say where instants are: title, cells, unit."""
        if not self.many:
            return []
        columns = []
        for driver in self.mechanism.drivers[:1]:
            value = self.run.driven(driver.name)[0]
            if np.ptp(value) > 0.0:
                name = getattr(driver, "body", driver.name)
                kind, own = "length", value[list(instants)]
                if driver.angular:
                    kind, own = "angle", np.radians([place_in_turn(float(one)) for one in own])
                shown = self.units.converted(own, kind)
                unit = self.unit(kind)
                cells = [f"{round(v, 2) + 0.0:g}" if unit == "deg" else number(v) for v in shown]
                columns.append((f"at {name}", cells, unit))
        if np.ptp(self.run.t) > 0.0:
            cells = [number(self.shown(self.run.t[k], "time")) for k in instants]
            columns.append(("at t", cells, self.unit("time")))
        return columns

    def place(self, instant: int) -> str:
        """Drivers or time of one instant, in words."""
        return ", ".join(
            f"{title} = {cells[0]}{'°' if unit == 'deg' else f' {unit}'}"
            for title, cells, unit in self.where([instant])
        )


def book(name: str) -> str:
    """A name of `force_names` with its index.

    >>> book("F32"), book("F(12,3)"), book("T12,motor"), book("F_P")
    ('F_{32}', 'F_{12,3}', 'T_{12,motor}', 'F_P')
    """
    parts = re.fullmatch(r"([A-Z])(\d\d|\(\d+,\d+\))(?:,(.*))?", name)
    if parts is None:
        return name
    suffix = f",{parts[3]}" if parts[3] else ""
    return f"{parts[1]}_{{{parts[2].strip('()')}{suffix}}}"


def run_of(
    mechanism: Mechanism, wanted: Instants | None, to: Any, assembly: str | int | None = None
) -> tuple[Solution, list[int]]:
    """The result that a report shows, and the instants that were asked for in it.

    A mechanism that asks for single instants is analysed over its whole revolution as well where it
    can turn, so that peaks are those of the cycle; the instants are then marked in it. With an
    assembly mode, which is one of the first instant, they stay alone.
    """
    if to is not None or (mechanism.simulation is not None and wanted is None):
        if assembly is not None:
            raise ModelError(
                "an assembly mode is of driven analyses, and this is a free motion: leave it out, "
                "or choose instants"
            )
        run = simulate(mechanism, to)
        return run, [force_peak(run)] if len(run) else []
    if not mechanism.drivers:
        raise ModelError(
            f"'{mechanism.name}' has no driver, and no table [simulate]: there is nothing to "
            "report: drive a body, or say until when it moves (--to TIME)",
            mechanism.name,
        )
    ask = wanted or mechanism.ask
    single = ask is not None and not ask.over
    alone = ask is not None and single and all(len(row) == 1 for row in ask.at.values())
    if alone and assembly is None and _revolves(mechanism):
        try:
            whole = analyse_at(mechanism, "kinetostatics", cycle(mechanism, ask))
            asked = analyse_at(mechanism, "kinetostatics", ask)
            return whole, [_nearest(whole, asked)]
        except SolveError:
            pass  # it cannot turn round: its own instants are reported
    run = analyse_at(mechanism, "kinetostatics", ask or cycle(mechanism, None), assembly)
    if single and len(run) <= FEW:
        return _between(mechanism, run, ask, wanted, assembly)
    return run, [force_peak(run)]


def _between(
    mechanism: Mechanism,
    run: Solution,
    ask: Instants | None,
    wanted: Instants | None,
    assembly: str | int | None,
) -> tuple[Solution, list[int]]:
    """The few instants of a model with as many between as make smooth curves, and where they are;
    instants that the user chose stay alone.
    """
    count = len(run)
    smooth = cycle(mechanism, ask)
    if wanted is not None or smooth is ask or count < 2 or smooth.over:
        return run, list(range(count))
    try:
        whole = analyse_at(mechanism, "kinetostatics", smooth, assembly)
    except SolveError:
        return run, list(range(count))
    # of equal steps from one to the next
    return whole, [round(n * (len(whole) - 1) / (count - 1)) for n in range(count)]


def _revolves(mechanism: Mechanism) -> bool:
    """Whether one driver of an angle moves by its law."""
    from mbody.system.assembler import assemble

    system, moving = assemble(mechanism), []
    for driver in system.independent_drivers:
        if driver_states(driver, mechanism, system.numbers):
            return False
        _, rate, change = system.law_of(driver).derivatives(0.0)
        if rate or change:
            moving.append(driver.angular)
    return moving == [True]


def _nearest(whole: Solution, asked: Solution) -> int:
    """The instant of the whole revolution at which the driver is as nearly as it can be."""
    for driver in whole.mechanism.drivers:
        value = whole.driven(driver.name)[0]
        if np.ptp(value) > 0.0:
            away = value - float(asked.driven(driver.name)[0][0])
            away = np.abs(np.remainder(away + math.pi, math.tau) - math.pi)
            return int(np.argmin(away))
    return 0
