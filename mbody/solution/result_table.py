"""The table of a result: every history that it has by name, with its unit, as one column.

What an element has is what its `quantities` declare; the values are those of measures. All that
prints, writes or draws histories reads these columns.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from mbody.model.body import MOTION, ROTATION
from mbody.model.model_notes import moving_points
from mbody.quantities.output_units import OutputUnits
from mbody.quantities.units import NUMBER, Dimension, dimension_of
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.declared_result import ResultColumn, ResultTable
from mbody.solution.histories import auxiliary_history, one_design, reported_states
from mbody.solution.measures import (
    found_by,
    histories_of,
    measured,
    quantity_history,
    unit_measured,
)
from mbody.solution.solution import SHOWN_TABLE, Solution

#: Of a body, in the order of tables; of a point its place and the rates of it.
BODY = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
OF_BODIES = MOTION | ROTATION
ACCELERATIONS = ("ax", "ay", "alpha")
#: What columns are of.
ROLES = (
    "time", "body", "point", "joint", "contact", "coupling", "driver", "load", "input", "state",
    "quantity", "measure",
)  # fmt: skip
#: What needs no forces, of joints, loads and drivers.
FORCES = ("fx", "fy", "force", "torque", "loss", "contact", "effort", "power")


def result_table(
    solution: Solution,
    units: Mapping[str, str] | OutputUnits | None = None,
    points: Iterable[str] | None = None,
    roles: Container[str] = ROLES,
) -> ResultTable:
    """All histories of one motion, or those of some roles.

    Time first, then nine columns a body (mass centre and angle) and six a point that moves (of a
    pin that on the first of its links), or of the `points`; of joints, contacts, couplings, drivers
    and loads what they declare; then inputs, auxiliary states, quantities and measures.
    Kinematics has no forces, statics no rates of drivers.
    """
    one_design(solution, "a table is of one design")
    if not isinstance(units, OutputUnits):
        units = solution.mechanism.data_units.having(units or {})
    return ResultTable(_TableReader(solution, units).columns(points, roles))


def shown_table(solution: Solution) -> ResultTable:
    """The table in the units that people read, also of a batch; made once of a result as long as
    these are the same.
    """
    units, fields = solution.mechanism.shown, vars(solution)
    chosen, found = fields.get(SHOWN_TABLE, (None, ResultTable()))
    if chosen != units.chosen:
        found = ResultTable(_TableReader(solution, units).columns(None))
        fields[SHOWN_TABLE] = units.chosen, found
    return found


class _TableReader:
    """Columns of one result, in units."""

    def __init__(self, solution: Solution, units: OutputUnits) -> None:
        self.run, self.machine = solution, solution.mechanism
        self.units, self.doubts = units, solution.doubts
        #: Dimensions and units by what elements declare.
        self.kinds: dict[str | Dimension, tuple[Dimension, str]] = {}

    def columns(
        self, points: Iterable[str] | None, roles: Container[str] = ROLES
    ) -> Iterator[ResultColumn]:
        run, machine = self.run, self.machine
        if "time" in roles:
            yield self._column("t", "", "time", "time", lambda: run.t)
        for body in machine.bodies if "body" in roles else ():
            yield from self._motion(body.name, "body", {key: OF_BODIES[key] for key in BODY})
        for point in moving_points(machine) if points is None else points:
            yield from self._motion(point, "point", MOTION)
        acting = {one.name for one in acting_contacts(run)}
        contacts = [one for one in machine.contacts if run.modes or one.name in acting]
        for role, elements in (
            ("joint", machine.joints),
            ("contact", contacts if run.has_forces else []),
            ("coupling", machine.couplings),
            ("driver", machine.drivers),
            ("load", machine.loads),
        ):
            for element in elements if role in roles else ():
                yield from self._element(element, role)
        for role, signals in (("input", machine.inputs), ("state", reported_states(machine))):
            for one in signals if role in roles else ():
                read = functools.partial(auxiliary_history, run, one.name)
                yield self._column(one.name, "", role, one.dimension or NUMBER, read)
        for one in machine.quantities if "quantity" in roles else ():
            read = functools.partial(quantity_history, run, one.name)
            yield self._column(one.name, "", "quantity", one.dimension or NUMBER, read)
        for name, measure in machine.measures.items() if "measure" in roles else ():
            if found_by(run, measure):
                yield self._measure(name, measure)

    def _column(
        self,
        owner: str,
        key: str,
        role: str,
        dimension: str | Dimension,
        read: Callable[[], Any],
        unique: Callable[[], bool | None] = lambda: True,
    ) -> ResultColumn:
        """A column of values that are read in units of the model."""
        units, doubts = self.units, self.doubts
        if dimension not in self.kinds:  # dimensions take long to compare
            found = dimension_of(dimension)
            self.kinds[dimension] = found, "" if found == NUMBER else units.of(found)
        wanted, unit = self.kinds[dimension]
        if doubts:
            element = owner.partition(".")[0]
            doubts = tuple(one for one in doubts if element in (one.elements or (element,)))

        def converted() -> Any:
            return units.converted(read(), wanted)

        return ResultColumn(owner, key, role, wanted, unit, converted, unique, doubts)

    def _histories(
        self,
        owner: str,
        role: str,
        keys: Mapping[str, str],
        unique: Callable[[str], bool | None] | None = None,
    ) -> Iterator[ResultColumn]:
        """Of one owner, what they share read once."""
        shared: list[Callable[[str], Any]] = []

        def history(key: str) -> Any:
            if not shared:
                shared.append(histories_of(self.run, owner))
            return shared[0](key)

        for key, dimension in keys.items():
            read = functools.partial(history, key)
            known = functools.partial(unique, key) if unique else lambda: True
            yield self._column(owner, key, role, dimension, read, known)

    def _motion(self, owner: str, role: str, keys: Mapping[str, str]) -> Iterator[ResultColumn]:
        """Of a body or a point; closing the loops finds no accelerations."""
        if self.run.analysis == "close_loops":
            keys = {key: keys[key] for key in keys if key not in ACCELERATIONS}
        return self._histories(owner, role, keys)

    def _element(self, element: Any, role: str) -> Iterator[ResultColumn]:
        """What an element declares, as far as the analysis finds it."""
        run, name, keys = self.run, element.name, element.quantities()
        if role != "load" and not run.has_forces:
            keys = {key: keys[key] for key in keys if key not in FORCES}
        if role == "driver" and run.analysis == "statics":
            keys = {key: keys[key] for key in ("effort", "value") if key in keys}
        if "loss" in keys and name not in run.losses:
            del keys["loss"]
        yield from self._histories(name, role, keys, functools.partial(self._unique, element))
        if role in ("coupling", "driver") and run.has_forces and run.resting:
            limits = run.range(name)
            if not np.array_equal(limits.low, limits.high, equal_nan=True):
                for end in ("low", "high"):
                    read = functools.partial(getattr, limits, end)
                    dimension = element.effort_dimension
                    yield self._column(name, f"effort_{end}", role, dimension, read, lambda: None)

    def _unique(self, element: Any, key: str) -> bool | None:
        """Whether a force of an element is determined; None where it was not examined."""
        if key in ("effort", "power"):
            found: bool | None = self.run.unique_effort(element.name)
            return found
        if key not in ("fx", "fy", "torque", "force", "contact") or element.role == "load":
            return True
        parts = self.run.reaction(element.name).unique if element.bodies else None
        if parts is None:
            return None
        known = dict(zip(("fx", "fy", "torque"), parts, strict=True))
        if key in known:
            return known[key]
        both = known["fx"], known["fy"]
        return False if False in both else None if None in both else True

    def _measure(self, name: str, measure: Any) -> ResultColumn:
        """A measured quantity, in its own unit where it has one."""
        dimension, unit = unit_measured(self.run.mechanism, measure.history)

        def read() -> Any:
            return measured(self.run, measure)[0]

        if measure.unit:
            return ResultColumn(name, "", "measure", dimension, unit, read, doubts=self.run.doubts)
        return self._column(name, "", "measure", dimension, read)
