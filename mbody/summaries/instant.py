"""The readable summary of a solution: what ``print(run)`` shows, in the names of textbooks."""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import member_forces
from mbody.core.tolerances import PRINTED_NONE, PRINTED_NONE_FINE
from mbody.laws import MeasuredFormula
from mbody.model.body import MOTION
from mbody.model.contact import joined
from mbody.model.element import AuxiliaryState
from mbody.model.model_notes import moving_points
from mbody.model.simulation import Measure, in_time, mean_weights, outermost
from mbody.quantities.output_units import OutputUnits
from mbody.solution.histories import failed_designs, reported_states
from mbody.solution.measures import as_shown, found_by, measured, shown_measure
from mbody.solution.result_table import shown_table
from mbody.summaries.text_table import (
    ABOUT,
    WIDTH,
    Column,
    acceleration_scale,
    angles,
    beside,
    closing,
    cut,
    directions,
    even,
    first_values,
    first_vectors,
    floor_of,
    force_floor,
    force_names,
    heading,
    joint_torque,
    link_names,
    number,
    numbers,
    paragraph,
    quantities,
    rounding,
    table,
    there,
    torque_cells,
    turned,
    turns,
    uniqueness_text,
    vectors,
    with_unit,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mbody.model.element import Element
    from mbody.solution.declared_result import ResultColumn
    from mbody.solution.friction_results import Efficiency
    from mbody.solution.histories import BodyHistory
    from mbody.solution.solution import Solution


# -- The table of contacts, ropes and frictional joints in summaries -------------------------------


def contacts(solution: Solution) -> list[str]:
    """Lines on every contact: number of impacts, mode at the end, greatest force, energy lost; of a
    driven motion its modes and the greatest force alone, of kinematics the modes.
    """
    modes = solution.modes
    if not modes or not len(solution) or solution.record.batch:
        return []
    machine = solution.mechanism
    pressing = {one.name: one.quantities()["contact"] for one in machine.contacts}
    names, units = list(modes), machine.shown
    driven = solution.analysis != "simulate"
    if driven:  # its frictional joints are in a table of their own
        names = [name for name in names if name in pressing]
    texts = [", ".join(dict.fromkeys(map(str, modes[n]))) for n in names]
    if not solution.has_forces:
        columns = [Column("CONTACTS", names, text=True)]
        return table([*columns, Column("", texts, text=True, whole=True)])
    floor = force_floor(solution)
    most = [float(np.abs(solution.contact(n)).max()) if n in pressing else 0.0 for n in names]
    strikes = [
        sum(one.contact == n and one.name in ("impact", "rest") for one in solution.events)
        for n in names
    ]
    lost = dict.fromkeys(names, 0.0)
    if solution.energy is not None:
        lost |= {n: float(part[-1]) for n, part in solution.energy.lost.items() if n in lost}
    kinds = [
        quantities("greatest press", most, "force", units, floor),
        quantities("torque", most, "torque", units, floor * solution.system.length),
    ]
    if "torque" not in pressing.values():
        kinds.pop()
    columns = [Column("CONTACTS", names, text=True)]
    if not driven:
        columns.append(Column("impacts", [str(n) if n else "" for n in strikes]))
    for column, kind in zip(kinds, ("force", "torque"), strict=False):
        column.cells = _of_kind(column.cells, names, pressing, kind)
    columns += kinds
    if driven:
        return table([*columns, Column("", texts, text=True, whole=True)])
    columns += [
        quantities("took", [lost[n] for n in names], "torque", units),
        Column("at the end", [str(modes[n][-1]) for n in names], text=True),
        Column("between", [_between(solution, n) for n in names], text=True, whole=True),
    ]
    return table(columns)


def _of_kind(
    cells: Sequence[str], names: list[str], pressing: dict[str, str], kind: str
) -> list[str]:
    """The cells of what presses with that, a force or a torque."""
    return [
        cell if pressing.get(name, "force") == kind else ""
        for name, cell in zip(names, cells, strict=True)
    ]


def _between(solution: Solution, name: str) -> str:
    bodies = getattr(solution.mechanism[name], "bodies", ())
    return " and ".join(bodies)


# -- The table of couplings in the summaries of one instant and of many ---------------------------


def couplings(solution: Solution) -> list[str]:
    """Efforts of the couplings, of those of angles and of those of lengths; of many instants or
    designs the least and the greatest.
    """
    lines: list[str] = []
    if not solution.has_forces:
        return lines
    units, floor = solution.mechanism.shown, force_floor(solution)
    for kind in ("torque", "force"):
        chosen = [c for c in solution.mechanism.couplings if c.effort_dimension == kind]
        if not chosen:
            continue
        efforts = [solution.effort(coupling.name).ravel() for coupling in chosen]
        least = floor * (solution.system.length if kind == "torque" else 1.0)
        columns = [Column("COUPLINGS", [coupling.name for coupling in chosen], text=True)]
        if efforts[0].size == 1:
            columns.append(quantities(kind, np.concatenate(efforts), kind, units, least))
        else:
            ends = np.array([(there(effort).min(), there(effort).max()) for effort in efforts]).T
            columns.append(quantities(f"least {kind}", ends[0], kind, units, least))
            columns.append(quantities("greatest", ends[1], kind, units, least))
        bodies = [", ".join(coupling.bodies) for coupling in chosen]
        columns.append(Column("between", bodies, text=True, whole=True))
        lines += [*([""] if lines else []), *table(columns)]
    return lines


# -- The tables of friction on a summary: what joints lose, and between what efforts lie at rest -


def friction(solution: Solution) -> list[list[str]]:
    """Tables of the losses of frictional joints, and of the bands of efforts where joints rest;
    none of mechanisms without friction.

    >>> import mbody
    >>> friction(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    []
    """
    if not solution.has_forces or not solution.losses:
        return []
    parts = [_losses(solution)] if solution.analysis != "statics" else []
    if solution.analysis != "simulate":
        parts.append(_bands(solution))
    return [part for part in parts if part]


def efficiency_line(solution: Solution, output: str, found: Efficiency) -> str:
    """The account of work of a motion."""
    units = solution.mechanism.shown
    given, useful = (number(units.converted(x, "torque")) for x in (found.given, found.useful))
    return (
        f"EFFICIENCY   {found.value:.6g} of '{output}': given {given}, useful {useful}, lost in "
        f"joints {with_unit(found.lost, 'torque', units)}"
    )


def _losses(solution: Solution) -> list[str]:
    units = solution.mechanism.shown
    names = list(solution.losses)
    losses = np.array([solution.losses[name] for name in names]).reshape(len(names), -1)
    if losses.shape[1] == 1:
        power = losses[:, 0]
        modes = [np.ravel(solution.mode(name))[0] for name in names]
        least = PRINTED_NONE_FINE * float(np.abs(power).max(initial=0.0))
        return table(
            [
                Column("FRICTION", names, text=True),
                quantities("loss", power, "power", units, least),
                Column("", modes, text=True),
            ]
        )
    peak = np.fmax.reduce(losses, axis=1)
    floor = PRINTED_NONE_FINE * float(np.nanmax(peak, initial=0.0))
    known = np.isfinite(losses)
    mean = np.where(known, losses, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    return table(
        [
            Column("FRICTION", names, text=True),
            quantities("peak loss", peak, "power", units, floor),
            quantities("mean of the instants", mean, "power", units, floor),
        ]
    )


def _bands(solution: Solution) -> list[str]:
    """Drivers whose effort friction leaves open."""
    found = []
    for driver in solution.mechanism.drivers:
        limits = solution.range(driver.name)
        open_at = (limits.low != limits.high) & ~np.isnan(limits.low)
        if open_at.any():
            units, kind = solution.mechanism.shown, driver.effort_dimension
            ends = [limits.low[open_at].min(), limits.high[open_at].max()]
            found.append((driver.name, *units.converted(np.array(ends), kind), units.of(kind)))
    if not found:
        return []
    names, low, high, symbols = zip(*found, strict=True)
    return table(
        [
            Column("AT REST", list(names), text=True),
            Column("from", _ends(low)),
            Column("to", _ends(high)),
            Column("unit", list(symbols), text=True),
        ]
    )


def _ends(values: tuple[float, ...]) -> list[str]:
    """Numbers, of which infinite ones are said."""
    found = numbers(np.nan_to_num(np.array(values), posinf=0.0, neginf=0.0))
    return [
        cell if np.isfinite(value) else ("−∞" if value < 0.0 else "∞")
        for cell, value in zip(found, values, strict=True)
    ]


# -- The table of measured quantities on a summary -----------------------------------------------


def _cleared(solution: Solution, measure: Measure, values: np.ndarray) -> np.ndarray:
    """Values with 0 for what is rounding, beside the mechanism or beside the greatest of them.

    What is one number of all instants is compared itself, with the rounding of its history: of an
    integral with that over the whole time.
    """
    history, dimension, _ = measured(solution, Measure(outermost(measure.of).of))
    floor = max(floor_of(solution, dimension), PRINTED_NONE * float(np.abs(history).max()))
    plain = history
    if measure.by:
        plain = measured(solution, Measure(measure.of))[0]
        floor *= float(np.ptp(solution.t)) if measure.by == "integral" else 1.0
    return np.where(np.abs(plain) <= floor, 0.0, values)


def measures(solution: Solution) -> list[str]:
    """Lines of a table: the value of every measure, of many instants the least and the greatest.

    What needs forces is left open where the analysis finds none.
    """
    if not solution.mechanism.measures or solution.record.batch:
        return []
    cells: dict[str, list[str]] = {
        key: [] for key in ("name", "least", "greatest", "value", "unit", "of")
    }
    for name, measure in solution.mechanism.measures.items():
        cells["name"].append(name)
        cells["of"].append(measure.of)
        alone = bool(measure.by) or len(solution) == 1
        if not found_by(solution, measure):
            for key in ("value", "unit") if alone else ("least", "greatest", "unit"):
                cells[key].append("–")
            for key in ("least", "greatest") if alone else ("value",):
                cells[key].append("")
            continue
        values, dimension, unit = measured(solution, measure)
        values = _cleared(solution, measure, values)
        values, unit = as_shown(solution.mechanism, measure, values, dimension, unit)
        extremes = (
            number(np.fmin.reduce(values, axis=None)),
            number(np.fmax.reduce(values, axis=None)),
        )
        cells["unit"].append(unit)
        texts = ("", "", extremes[0]) if alone else (*extremes, "")
        for key, cell in zip(("least", "greatest", "value"), texts, strict=True):
            cells[key].append(cell)
    columns = [
        Column("MEASURES", cells["name"], text=True),
        Column("least", cells["least"]),
        Column("greatest", cells["greatest"]),
        Column("value", cells["value"]),
        Column("unit", cells["unit"], text=True),
        Column("of", cells["of"], text=True),
    ]
    return table(columns)


# -- The table of points on a summary of one instant: places, velocities, accelerations ----------

#: Points that a summary shows.
LISTED_POINTS = 24


def points(solution: Solution) -> list[str]:
    """Lines of a table of the first instant; none for a mechanism without such points."""
    names = moving_points(solution.mechanism)
    if not names:
        return []
    found = shown_table(solution)
    x, y, vx, vy, ax, ay = (found.of(names[:LISTED_POINTS], key) for key in MOTION)
    lines = table(
        [
            Column("POINTS", names[:LISTED_POINTS], text=True),
            first_values("x", x, solution),
            first_values("y", y, solution),
            first_vectors("v", vx, vy, solution),
            first_vectors("a", ax, ay, solution),
        ]
    )
    more = len(names) - LISTED_POINTS
    return [*lines, f"{more} points more are among the data and in tables"] if more > 0 else lines


# -- The tables of inputs and of auxiliary states on a summary
# -----------------------------------------


def signals(solution: Solution) -> list[list[str]]:
    """Two tables: inputs, and auxiliary states with the formulas of their rates; of many instants
    the least and the greatest, empty where there are none.
    """
    machine = solution.mechanism
    states = reported_states(machine)
    rates = [_rate(one) for one in states]
    return [
        _table(solution, "INPUTS", machine.inputs, []),
        _table(solution, "STATES", states, [Column("rate", rates, text=True)]),
    ]


def _rate(state: Any) -> str:
    """The formula of a rate, as it was written; none of a state that an element brings."""
    if isinstance(state, AuxiliaryState):
        return ""
    return str(getattr(state.rate, "text", state.rate))


def _table(solution: Solution, title: str, own: Any, more: list[Column]) -> list[str]:
    """The table of some elements."""
    if not own or solution.record.batch:
        return []
    found = [shown_table(solution)[one.name] for one in own]
    least = [number(np.fmin.reduce(one.values)) for one in found]
    columns = [
        Column(title, [one.name for one in own], text=True),
        Column("least", least),
        Column("greatest", [number(np.fmax.reduce(one.values)) for one in found]),
        Column("unit", [one.unit for one in found], text=True),
        *more,
    ]
    if len(solution) == 1:
        columns[1:3] = [Column("value", least)]
    return table(columns)


# -- The table of a few instants: a row a quantity, a column an instant ------------------------

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
        rows.history("t", "t")
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
        self.shown = self.mechanism.shown
        self.names: list[str] = []
        self.units: list[str] = []
        self.cells: list[list[str]] = []
        self.table = shown_table(solution)
        self.floor = force_floor(solution) if solution.has_forces else 0.0

    def lines(self) -> list[str]:
        """One table, or two below each other where the instants are wider than a summary."""
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

    def quantity(self, name: str, values: Array, dimension: str, floor: float = 0.0) -> None:
        """A row of values and a floor in units of the model."""
        units = self.shown
        floor /= units.size(dimension)
        self.add(name, units.of(dimension), units.converted(values, dimension), floor)

    def add(self, name: str, unit: str, values: Array, floor: float = 0.0) -> None:
        cells = numbers(values, floor)
        there = np.isfinite(values)
        self._row(name, unit, [c if seen else "–" for c, seen in zip(cells, there, strict=True)])

    def _row(self, name: str, unit: str, cells: list[str]) -> None:
        self.names.append(name)
        self.units.append(unit)
        self.cells.append(cells)

    def history(self, name: str, column: str) -> None:
        """A row of a column of the table, where there is such a one."""
        if (own := self.table.get(column)) is not None:
            self.add(name, own.unit, own.values, rounding(self.solution, own))

    def drivers(self) -> None:
        """The efforts of drivers, and their power."""
        for driver in self.mechanism.drivers:
            if not driver.angular:
                self.history(driver.name, f"{driver.name}.value")
            self.history(f"{driver.name} {driver.effort_dimension}", f"{driver.name}.effort")
            self.history(f"{driver.name} power", f"{driver.name}.power")

    def links(self) -> None:
        """Angles of the links, and their rates."""
        for body in (one.name for one in self.mechanism.bodies):
            self._turned(f"{body} angle", self.solution[body].angle)
            if self.solution.analysis != "statics":
                self.history(f"{body} ω", f"{body}.omega")
                self.history(f"{body} α", f"{body}.alpha")

    def _turned(self, name: str, angle: Array, there: Array | bool = True) -> None:
        """A row of angles, where there are some."""
        seen = np.broadcast_to(there, angle.shape)
        cells = zip(angles(angle, self.shown), seen, strict=True)
        self._row(name, self.shown.of("angle"), [cell if one else "" for cell, one in cells])

    def joints(self) -> None:
        """Forces at the joints: magnitude and direction."""
        if not self.solution.has_forces:
            return
        names = force_names(self.mechanism)
        for joint in joined(self.mechanism):
            name, on = names[joint.name]
            reaction = self.solution.reaction(joint.name, on)
            label = name if name.endswith(joint.name) else f"{name}, {joint.name}"
            self.quantity(label, reaction.magnitude, "force", self.floor)
            there = reaction.magnitude > self.floor
            x, y = (np.where(np.abs(c) > self.floor, c, 0.0) for c in (reaction.fx, reaction.fy))
            self._turned("", np.arctan2(y, x), there)

    def measures(self) -> None:
        """The measures of the model that change from instant to instant."""
        for name, measure in self.mechanism.measures.items():
            if measure.by or not found_by(self.solution, measure):
                continue
            values, _, unit = shown_measure(self.solution, measure)
            finite = np.abs(values[np.isfinite(values)])
            self.add(name, unit, values, PRINTED_NONE * float(finite.max(initial=0.0)))


# -- The tables of a few dozen positions: a row a position --------------------------------------

#: As many positions of a driven motion have a row each.
ROWS = 40
#: Tables beside which no others follow: of larger mechanisms efforts and measures alone.
BLOCKS = 3


def positions(solution: Solution) -> list[str]:
    """Lines of tables with a row for each of `MOST` to `ROWS` positions of a driven motion: joint
    forces and efforts, of kinematics the motion of the links; of others none.

    >>> import mbody, numpy as np
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> run = mbody.statics(machine, drive={"motor": np.radians(np.arange(0.0, 360.0, 30.0))})
    >>> [line.split() for line in positions(run)[:4:3]]
    [['at', 'motor', 'T12', 'F12', 'F32', 'F43', 'F14'], ['0.000', '0', '0', '0', '0', '0']]
    """
    if solution.record.batch or solution.analysis == "simulate":
        return []
    if not MOST < len(solution) <= ROWS:
        return []
    columns, forces = solution.table({"angle": "rad"}), solution.has_forces
    drivers = columns.by_owner("driver", "value", "effort")
    names = force_names(solution.mechanism)
    head = [_history(solution, one["value"], f"at {name}") for name, one in drivers.items()]
    if not head:
        head = [_history(solution, columns["t"], "t")]
    own = [
        _history(solution, one["effort"], names[name][0]) for name, one in drivers.items() if forces
    ]
    if forces:
        found = columns.by_owner("joint", "force")
        more = [_history(solution, one["force"], names[name][0]) for name, one in found.items()]
    else:
        found = columns.by_owner("body", "angle", "omega")
        more = [
            _history(solution, column, f"{name} ω" if key == "omega" else name)
            for name, one in found.items()
            for key, column in one.items()
        ]
    known = {f"{owner}.{key}" for key in ("force", "effort") for owner in (*found, *drivers)}
    for name, measure in solution.mechanism.measures.items():
        if not measure.by and measure.of not in known and found_by(solution, measure):
            values, _, unit = shown_measure(solution, measure)
            floor = PRINTED_NONE * float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
            own.append(Column(name, numbers(values, floor), unit))
    blocks = _blocks(head, [*own, *more])
    if len(blocks) > BLOCKS:
        blocks = _blocks(head, own)
    return [line for n, block in enumerate(blocks) for line in ([""] if n else []) + table(block)]


def _history(solution: Solution, column: ResultColumn, title: str) -> Column:
    """A column of a history that is in the units that are shown, but for angles in rad."""
    units = solution.mechanism.shown
    if column.quantity == "angle":
        values, turn = column.values, 2.0 * np.pi
        if values.min() >= 0.0 and np.ptp(values) < turn <= values.max():
            values = values % turn  # positions that the law meets in its next revolution
        return turned(title, values, units)
    return Column(title, numbers(column.values, rounding(solution, column)), column.unit)


def _blocks(head: list[Column], columns: list[Column]) -> list[list[Column]]:
    """The columns in tables that are not wider than a summary, each behind the same head."""
    for count in range(1, len(columns)):
        size = -(-len(columns) // count)
        parts = [columns[n : n + size] for n in range(0, len(columns), size)]
        if all(len(one) <= WIDTH for part in parts for one in table([*head, *part])):
            return [[*head, *part] for part in parts]
    return [[*head, column] for column in columns]


# -- The summary of many instants or designs: ranges and peaks, and where they occur -------------


class _Summary:
    """Arrays are (instants,), of a batch (designs, instants)."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        self.mechanism = solution.mechanism
        self.units = self.mechanism.shown
        self.batch = solution.record.batch
        self.names = force_names(self.mechanism)
        self.states = solution.drive_states
        self.forces = solution.has_forces
        self.moves = solution.analysis != "statics"
        self.spans = len(solution) > 1 and np.ptp(solution.t) > 0.0

    def lines(self) -> list[str]:
        parts = [few_instants(self.solution), positions(self.solution), self._links()]
        if self.forces:
            parts.append(self._joints())
        parts += [couplings(self.solution), contacts(self.solution)]
        parts += [self._drivers(angular) for angular in (True, False)]
        parts += friction(self.solution)
        parts += signals(self.solution)
        parts.append(measures(self.solution))
        lines = heading(self.solution, self._when())
        if self.batch:
            which = (
                "the designs that did not fail"
                if failed_designs(self.solution.reports)
                else "all designs"
            )
            lines += paragraph(f"peaks and ranges over {which}; run.design(n) is one of them")
        for part in parts:
            lines += ["", *part] if part else []
        return lines + closing(self.solution, residuals=not self.batch)

    def _when(self) -> str:
        t, unit = self.units.converted(self.solution.t, "time"), self.units.of("time")
        count = len(t)
        when = f"at {count} instants" if count > 1 else "at one instant"
        if self.batch:
            when = f"of {self.solution.record.count} designs {when}"
        first, last = number(t.min()), number(t.max())
        return (
            f"{when}, t = {first} … {last} {unit}" if self.spans else f"{when}, t = {first} {unit}"
        )

    # -- places of extremes --------------------------------------------------------------------

    def _places(self, at: list[int]) -> list[Column]:
        """Columns that show at which design, time and driver position the flat indices lie."""
        instant = [k % len(self.solution) for k in at]
        columns = []
        if self.batch:
            design = [str(k // len(self.solution)) for k in at]
            columns.append(Column("design", design))
        if self.spans:
            columns.append(quantities("at t", self.solution.t[instant], "time", self.units))
        if self.states is not None and self.states.shape[1]:
            driver = self.mechanism.drivers[0]
            value, title = self.states[instant, 0, 0], f"at {cut(driver.name, 12)}"
            if driver.angular:
                columns.append(directions(title, value, self.units))
            else:
                columns.append(quantities(title, value, "length", self.units))
        elif len(self.solution) > 1 and not self.spans:
            columns.append(Column("at instant", [str(k) for k in instant]))
        return columns

    # -- the tables ---------------------------------------------------------------------------

    def _links(self) -> list[str]:
        bodies = [self.solution[body.name] for body in self.mechanism.bodies]
        units = self.units
        columns = [Column("LINKS", link_names(self.mechanism)[1:], text=True)]
        columns.append(
            turned("angle from", [np.fmin.reduce(one.angle, axis=None) for one in bodies], units)
        )
        columns.append(
            turned("to", [np.fmax.reduce(one.angle, axis=None) for one in bodies], units)
        )
        if self.moves:

            def peaks(size: Callable[[BodyHistory], Array]) -> Array:
                return np.array([np.fmax.reduce(size(one), axis=None) for one in bodies])

            omega, alpha = (
                peaks(lambda one: np.abs(one.omega)),
                peaks(lambda one: np.abs(one.alpha)),
            )
            speed = peaks(lambda one: np.hypot(one.vx, one.vy))
            rate = peaks(lambda one: np.hypot(one.ax, one.ay))
            acceleration, length = acceleration_scale(self.solution), self.solution.system.length
            columns += [
                quantities(title, values, dimension, units, PRINTED_NONE * least)
                for title, values, dimension, least in (
                    ("peak ω", omega, "angular velocity", np.sqrt(acceleration)),
                    ("peak α", alpha, "angular acceleration", acceleration),
                    ("peak v_G", speed, "velocity", speed.max()),
                    ("peak a_G", rate, "acceleration", acceleration * length),
                )
            ]
        return table(columns)

    def _joints(self) -> list[str]:
        found = []
        for joint in joined(self.mechanism):
            name, on = self.names[joint.name]
            found.append((name, joint.name, self.solution.reaction(joint.name, on)))
        if not found:
            return []
        at = [int(np.argmax(np.nan_to_num(r.magnitude, nan=-1.0))) for *_, r in found]
        x, y = (
            np.array([getattr(r, key).flat[k] for k, (*_, r) in zip(at, found, strict=True)])
            for key in ("fx", "fy")
        )
        floor = force_floor(self.solution)
        torques = [np.abs(joint_torque(self.mechanism, r)) for *_, r in found]
        torque = np.array([np.fmax.reduce(one, axis=None) for one in torques])
        torques = torque_cells(self.solution, torque, floor)
        lines = table(
            [
                Column("PEAK FORCES", [name for name, *_ in found], text=True),
                vectors("magnitude @ dir.", x, y, "force", self.units, floor),
                *self._places(at),
                Column("peak torque", torques, self.units.of("torque")),
                Column("joint", [joint for _, joint, _ in found], text=True),
                Column("i on j", [f"{r.by} on {r.on}" for *_, r in found], text=True),
                Column("", [uniqueness_text(r) for *_, r in found], text=True, whole=True),
            ]
        )
        return [*lines, ABOUT] if any(torques) else lines

    def _drivers(self, angular: bool) -> list[str]:
        chosen = [d for d in self.mechanism.drivers if d.angular == angular]
        if not chosen or not self.forces:
            return []
        efforts = np.array([self.solution.effort(driver.name) for driver in chosen])
        flat = efforts.reshape(len(chosen), -1)
        # over the motions of all designs, without instants that have none
        weight = np.resize(mean_weights(self.solution.t), flat.shape) * np.isfinite(flat)
        with np.errstate(invalid="ignore"):
            mean, square = (
                np.nansum(one * weight, axis=1) / weight.sum(axis=1) for one in (flat, flat**2)
            )
        units, kind = self.units, "torque" if angular else "force"
        floor = force_floor(self.solution) * (self.solution.system.length if angular else 1.0)
        columns = [
            Column(
                "TORQUES" if angular else "DRIVERS",
                [self.names[d.name][0] for d in chosen],
                text=True,
            ),
            Column("driver", [d.name for d in chosen], text=True),
            quantities("least", np.fmin.reduce(flat, axis=1), kind, units, floor),
            quantities("greatest", np.fmax.reduce(flat, axis=1), kind, units, floor),
            quantities("mean", mean, kind, units, floor),
            quantities("rms", np.sqrt(square), kind, units, floor),
        ]
        if self.moves and self.states is not None:
            number_of = {driver.name: n for n, driver in enumerate(self.mechanism.drivers)}
            rates = np.array([self.states[:, number_of[d.name], 1] for d in chosen])
            rates = rates[:, None, :] if self.batch else rates
            power = np.fmax.reduce(np.abs(efforts * rates).reshape(len(chosen), -1), axis=1)
            least = floor * np.abs(rates).max()
            columns.append(quantities("peak power", power, "power", units, least))
        over = "time" if in_time(self.solution.t) else "the instants"
        return [*table(columns), f"mean and rms over {over}"]


#: Members that a summary shows.
MEMBERS = 12


def summary(solution: Solution) -> str:
    """A solution as text, at most 100 characters wide.

    One instant: links, forces at the joints as F_ij (of link i on link j), drivers, inertia forces,
    loads, residuals. Many instants or designs: the ranges and peaks, and where they occur.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> summary(run).splitlines()[0]
    'four-bar'
    """
    many = solution.record.batch or len(solution) > 1
    return "\n".join(even(_Summary(solution).lines() if many else _Instant(solution).lines()))


class _Instant:
    """The summary of one instant, table by table."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        self.mechanism = solution.mechanism
        self.units = self.mechanism.shown
        self.forces = solution.has_forces
        self.moves = solution.analysis != "statics"
        self.accelerates = self.moves and solution.analysis != "close_loops"
        self.names = force_names(self.mechanism)
        self.table = shown_table(solution)
        self.t = float(solution.t[0])

    def lines(self) -> list[str]:
        when = f"at t = {with_unit(self.t, 'time', self.units)}"
        parts = [self._links(), points(self.solution) if self.accelerates else []]
        if self.forces:
            parts.append(self._joints())
        parts += [couplings(self.solution), contacts(self.solution)]
        parts += [self._drivers(angular) for angular in (True, False)]
        if self.forces and self.moves:
            parts.append(self._inertia())
        if self.forces:
            parts.append(self._loads())
        if not self.moves:
            parts.append(self._members())
        parts += friction(self.solution)
        parts += signals(self.solution)
        parts.append(measures(self.solution))
        lines = heading(self.solution, when)
        for part in parts:
            lines += ["", *part] if part else []
        return lines + closing(self.solution)

    def _links(self) -> list[str]:
        units, run, names = self.units, self.solution, [one.name for one in self.mechanism.bodies]
        mass = run.system.mass[:-3, 0].reshape(-1, 3)
        own = functools.partial(self.table.of, names)

        def column(title: str, key: str) -> Column:
            return first_values(title, own(key), run, [""])

        columns = [
            Column("LINKS", link_names(self.mechanism), text=True),
            quantities("mass", mass[:, 0], "mass", units, before=[""]),
            quantities("I_G", mass[:, 2], "inertia", units, before=[""]),
        ]
        if not self.moves:
            columns += [column("x_G", "x"), column("y_G", "y")]
        columns.append(directions("angle", [run[one].angle[0] for one in names], units, [""]))
        if self.moves:
            columns.append(column("ω", "omega"))
        if self.accelerates:
            columns.append(column("α", "alpha"))
            columns.append(first_vectors("a_G", own("ax"), own("ay"), run, [""]))
        return table(columns)

    def _joints(self) -> list[str]:
        found = []
        for joint in joined(self.mechanism):
            name, on = self.names[joint.name]
            found.append((name, joint.name, self.solution.reaction(joint.name, on)))
        if not found:
            return []
        x, y = (np.array([getattr(r, k)[0] for *_, r in found]) for k in ("fx", "fy"))
        torque = np.array([joint_torque(self.mechanism, r)[0] for *_, r in found])
        floor, units = force_floor(self.solution), self.units
        torques = torque_cells(self.solution, torque, floor)
        lines = table(
            [
                Column("FORCES", [name for name, *_ in found], text=True),
                quantities("x", x, "force", units, floor),
                quantities("y", y, "force", units, floor),
                vectors("magnitude @ dir.", x, y, "force", units, floor),
                Column("torque", torques, units.of("torque")),
                Column("joint", [joint for _, joint, _ in found], text=True),
                Column("i on j", [f"{r.by} on {r.on}" for *_, r in found], text=True),
                Column("", [uniqueness_text(r) for *_, r in found], text=True, whole=True),
            ]
        )
        return [*lines, ABOUT] if any(torques) else lines

    def _drivers(self, angular: bool) -> list[str]:
        names = [one.name for one in self.mechanism.drivers if one.angular == angular]
        if not names:
            return []
        own = functools.partial(self.table.of, names)

        def column(title: str, key: str) -> Column:
            return first_values(title, own(key), self.solution)

        columns = [Column("driver" if self.forces else "DRIVERS", names, text=True)]
        if self.forces:
            titles = [self.names[name][0] for name in names]
            columns.insert(0, Column("DRIVERS", titles, text=True))
            columns.append(column("torque" if angular else "force", "effort"))
            if self.moves:
                columns.append(column("power", "power"))
        if angular:
            value = own("value")
            columns.append(turns("angle", [one.values[0] for one in value], value[0].unit))
        else:
            columns.append(column("length", "value"))
        if self.moves:
            columns.append(column("rate", "rate"))
            rates = np.array([self.solution.driven(name)[1][0] for name in names])
            columns += beside(rates, "angular velocity" if angular else "velocity", self.units)
        if self.accelerates:
            columns.append(column("acceleration", "acceleration"))
        return table(columns)

    def _inertia(self) -> list[str]:
        parts = [self.solution.inertia(body.name) for body in self.mechanism.bodies]
        x, y, torque = (np.array([part[k][0] for part in parts]) for k in range(3))
        mass = self.solution.system.mass[:-3, 0].reshape(-1, 3)
        if not mass.any():
            return []
        units, acceleration = self.units, acceleration_scale(self.solution)
        floor = PRINTED_NONE * mass[:, 0].max() * acceleration * self.solution.system.length
        least = PRINTED_NONE * mass[:, 2].max() * acceleration
        return table(
            [
                Column("INERTIA", link_names(self.mechanism)[1:], text=True),
                quantities("-m a_Gx", x, "force", units, floor),
                quantities("-m a_Gy", y, "force", units, floor),
                vectors("magnitude @ dir.", x, y, "force", units, floor),
                quantities("-I_G α", torque, "torque", units, least),
            ]
        )

    def _members(self) -> list[str]:
        """Links on which two or three forces act, as sentences."""
        sentences = [
            m.words for m in member_forces(self.solution) if m.kind in ("two-force", "three-force")
        ]
        return [line for words in sentences[:MEMBERS] for line in paragraph(words, "MEMBER   ")]

    def _loads(self) -> list[str]:
        loads = self.mechanism.loads
        if not loads:
            return []
        columns = [
            Column("LOADS", [load.name for load in loads], text=True),
            Column("", [type(load).__name__ for load in loads], text=True),
            Column("", [self._load(load) for load in loads], text=True),
        ]
        return table(columns)

    def _law(self, element: Element, field: str) -> float:
        """Value of one of an element's laws of time."""
        law: Any = getattr(element, field)
        own, name = law.numbers(), f"{element.name}.{field}"
        plain = set(own) == {"value"}
        values = self.solution.system.values
        law = law.with_numbers({k: values[name if plain else f"{name}.{k}"] for k in own})
        return float(law.derivatives(self.t)[0])

    def value(self, load: Element, field: str) -> str:
        """Value of a law, as text; of a formula of measured quantities the formula."""
        law = getattr(load, field)
        if isinstance(law, MeasuredFormula):
            return f"({law.text})"
        dimension = type(load).__dataclass_fields__[field].metadata["law"]
        return number(self._units_of(load).converted(self._law(load, field), dimension))

    def unit(self, dimension: str) -> str:
        """The unit of what `value` gives of the load whose line is written."""
        return self.of_load.of(dimension)

    def _units_of(self, load: Element) -> OutputUnits:
        """Units of the numbers of a load: of one with formulas those of the model, in which they
        are written.
        """
        given = (getattr(load, one.name) for one in dataclasses.fields(load))
        written = any(isinstance(one, MeasuredFormula) for one in given)
        return OutputUnits(self.mechanism.units) if written else self.units

    def degrees(self, load: Element, field: str) -> str:
        """An angle in degrees, as text."""
        return angles(self.solution.system.values[f"{load.name}.{field}"])[0]

    def _load(self, load: Any) -> str:
        """Line on a load at this instant, with its two bodies."""
        values = self.solution.system.values
        self.of_load = units = self._units_of(load)
        line: str = load.line(self)
        if line:
            return line
        words = []
        for field in dataclasses.fields(load):
            name = f"{load.name}.{field.name}"
            if "dimension" in field.metadata and values.get(name):
                dimension, label = field.metadata["dimension"], field.name.replace("_", " ")
                words.append(f"{label} {with_unit(values[name], dimension, units)}")
            elif field.name == "value":
                words.append(f"{self.value(load, 'value')} {units.of(field.metadata['law'])}")
            elif isinstance(measured := getattr(load, field.name), MeasuredFormula):
                words.append(f"{field.name} {measured.text}")
            elif field.name == "law" and load.law is not None:
                words.append("by a law")
            elif "law" in field.metadata and field.metadata["of"] != "time" and field.name != "law":
                constant = values.get(name)
                label = f"{field.name} by a law"
                if constant is not None:
                    label = f"{field.name} {with_unit(constant, field.metadata['law'], units)}"
                if constant != 0.0:
                    words.append(label)
        by, on = load.bodies[0], load.bodies[-1]
        words.append(f"on {on}" if by in ("ground", on) else f"of {by} on {on}")
        return ", ".join(words[:-1]) + (" " if words[:-1] else "") + words[-1]
