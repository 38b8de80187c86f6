"""The readable summary of a solution: what ``print(run)`` shows, in the names of textbooks."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import member_forces
from mbody.core.tolerances import PRINTED_NONE, PRINTED_NONE_FINE
from mbody.laws import MeasuredFormula
from mbody.model.closed_mechanism import moving_points
from mbody.model.contact import joined
from mbody.model.element import AuxiliaryState
from mbody.model.study import Measure, in_time, mean_weights, outermost
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.solution.histories import auxiliary_history, reported_states
from mbody.solution.measures import found_by, measured
from mbody.summaries.text_table import (
    ABOUT,
    WIDTH,
    Column,
    acceleration_scale,
    angles,
    closing,
    cut,
    even,
    everyday,
    force_floor,
    force_names,
    heading,
    joint_torque,
    link_names,
    number,
    numbers,
    paragraph,
    polars,
    table,
    there,
    torque_cells,
    uniqueness_text,
)

if TYPE_CHECKING:
    from mbody.model.element import Element
    from mbody.solution.friction_results import Efficiency
    from mbody.solution.solution import Solution


# -- The table of contacts, ropes and frictional joints in summaries -------------------------------


def contacts(solution: Solution) -> list[str]:
    """Lines on every contact: number of impacts, mode at the end, greatest force, energy lost; of a
    driven motion its modes and the greatest force alone, of kinematics the modes.
    """
    modes = solution.modes
    if not modes or not len(solution):
        return []
    machine = solution.mechanism
    pressing = {one.name: one.quantities()["contact"] for one in machine.contacts}
    names, unit = list(modes), machine.units.of
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
        ("greatest press", "force", numbers(np.array(most), floor)),
        ("torque", "torque", numbers(np.array(most), floor * solution.system.length)),
    ]
    if "torque" not in pressing.values():
        kinds.pop()
    columns = [Column("CONTACTS", names, text=True)]
    if not driven:
        columns.append(Column("impacts", [str(n) if n else "" for n in strikes]))
    columns += [
        Column(title, _of_kind(cells, names, pressing, kind), unit(kind))
        for title, kind, cells in kinds
    ]
    if driven:
        return table([*columns, Column("", texts, text=True, whole=True)])
    columns += [
        Column("took", numbers(np.array([lost[n] for n in names])), unit("torque")),
        Column("at the end", [str(modes[n][-1]) for n in names], text=True),
        Column("between", [_between(solution, n) for n in names], text=True, whole=True),
    ]
    return table(columns)


def _of_kind(cells: list[str], names: list[str], pressing: dict[str, str], kind: str) -> list[str]:
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
    unit, floor = solution.mechanism.units.of, force_floor(solution)
    for kind in ("torque", "force"):
        chosen = [c for c in solution.mechanism.couplings if c.effort_dimension == kind]
        if not chosen:
            continue
        efforts = [solution.effort(coupling.name).ravel() for coupling in chosen]
        least = floor * (solution.system.length if kind == "torque" else 1.0)
        columns = [Column("COUPLINGS", [coupling.name for coupling in chosen], text=True)]
        if efforts[0].size == 1:
            columns.append(Column(kind, numbers(np.concatenate(efforts), least), unit(kind)))
        else:
            ends = np.array([(there(effort).min(), there(effort).max()) for effort in efforts]).T
            columns.append(Column(f"least {kind}", numbers(ends[0], least), unit(kind)))
            columns.append(Column("greatest", numbers(ends[1], least), unit(kind)))
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
    unit = solution.mechanism.units.of("torque")
    given, useful, lost = (number(x) for x in (found.given, found.useful, found.lost))
    return (
        f"EFFICIENCY   {found.value:.6g} of '{output}': given {given}, useful {useful}, lost in "
        f"joints {lost} {unit}"
    )


def _losses(solution: Solution) -> list[str]:
    units = solution.mechanism.units
    unit = units.of("power")
    names = list(solution.losses)
    losses = np.array([solution.losses[name] for name in names]).reshape(len(names), -1)
    if losses.shape[1] == 1:
        power = losses[:, 0]
        modes = [np.ravel(solution.mode(name))[0] for name in names]
        least = PRINTED_NONE_FINE * float(np.abs(power).max(initial=0.0))
        return table(
            [
                Column("FRICTION", names, text=True),
                Column("loss", numbers(power, least), unit),
                *everyday(units, "power", power, least),
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
            Column("peak loss", numbers(peak, floor), unit),
            *everyday(units, "power", peak, floor),
            Column("mean of the instants", numbers(mean, floor), unit),
            *everyday(units, "power", mean, floor),
        ]
    )


def _bands(solution: Solution) -> list[str]:
    """Drivers whose effort friction leaves open."""
    found = []
    for driver in solution.mechanism.drivers:
        limits = solution.range(driver.name)
        open_at = (limits.low != limits.high) & ~np.isnan(limits.low)
        if open_at.any():
            unit = solution.mechanism.units.of(driver.effort_dimension)
            ends = limits.low[open_at].min(), limits.high[open_at].max()
            found.append((driver.name, *ends, unit))
    if not found:
        return []
    names, low, high, units = zip(*found, strict=True)
    return table(
        [
            Column("AT REST", list(names), text=True),
            Column("from", _ends(low)),
            Column("to", _ends(high)),
            Column("unit", list(units), text=True),
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


def _floor(solution: Solution, dimension: Dimension) -> float:
    """Rounding level of a quantity beside the greatest of its kind in the mechanism; 0 where there
    is nothing to compare with.
    """
    length, acceleration = solution.system.length, acceleration_scale(solution)
    force = force_floor(solution) if solution.has_forces else 0.0
    floors = {
        "length": PRINTED_NONE * length,
        "angle": PRINTED_NONE,
        "velocity": PRINTED_NONE * length * np.sqrt(acceleration),
        "angular velocity": PRINTED_NONE * np.sqrt(acceleration),
        "acceleration": PRINTED_NONE * length * acceleration,
        "angular acceleration": PRINTED_NONE * acceleration,
        "force": force,
        "torque": force * length,
        "power": force * length * np.sqrt(acceleration),
    }
    return next((floor for name, floor in floors.items() if DIMENSIONS[name] == dimension), 0.0)


def _cleared(solution: Solution, measure: Measure, values: np.ndarray) -> np.ndarray:
    """Values with 0 for what is rounding, beside the mechanism or beside the greatest of them.

    What is one number of all instants is compared itself, with the rounding of its history: of an
    integral with that over the whole time.
    """
    history, dimension, _ = measured(solution, Measure(outermost(measure.of).of))
    floor = max(_floor(solution, dimension), PRINTED_NONE * float(np.abs(history).max()))
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
        if dimension == DIMENSIONS["angle"] and not measure.unit:
            values, unit = np.degrees(values), "deg"
        values = _cleared(solution, measure, values)
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
    found = [solution.point(name) for name in names[:LISTED_POINTS]]
    x, y, vx, vy, ax, ay = (
        np.array([getattr(one, key)[0] for one in found])
        for key in ("x", "y", "vx", "vy", "ax", "ay")
    )
    unit, length = solution.mechanism.units.of, solution.system.length
    acceleration = acceleration_scale(solution)
    lines = table(
        [
            Column("POINTS", names[:LISTED_POINTS], text=True),
            Column("x", numbers(x, PRINTED_NONE * length), unit("length")),
            Column("y", numbers(y, PRINTED_NONE * length), unit("length")),
            Column(
                "v", polars(vx, vy, PRINTED_NONE * np.sqrt(acceleration) * length), unit("velocity")
            ),
            Column("a", polars(ax, ay, PRINTED_NONE * acceleration * length), unit("acceleration")),
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
    least, greatest, units = [], [], []
    for one in own:
        values, unit = auxiliary_history(solution, one.name), ""
        if one.dimension == DIMENSIONS["angle"]:
            values, unit = np.degrees(values), "deg"
        elif one.dimension is not None:
            unit = solution.mechanism.units.of(one.dimension)
        least.append(number(np.fmin.reduce(values)))
        greatest.append(number(np.fmax.reduce(values)))
        units.append(unit)
    columns = [
        Column(title, [one.name for one in own], text=True),
        Column("least", least),
        Column("greatest", greatest),
        Column("unit", units, text=True),
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
        self.acceleration = acceleration_scale(solution)
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
            floor = PRINTED_NONE * float(np.sqrt(self.acceleration))
            self.add(f"{body.name} ω", self.unit("angular velocity"), history.omega, floor)
            if self.solution.analysis != "close_loops":
                kind = "angular acceleration"
                self.add(
                    f"{body.name} α",
                    self.unit(kind),
                    history.alpha,
                    PRINTED_NONE * self.acceleration,
                )

    def joints(self) -> None:
        """Forces at the joints: magnitude and direction."""
        if not self.solution.has_forces:
            return
        names = force_names(self.mechanism)
        for joint in joined(self.mechanism):
            name, on = names[joint.name]
            reaction = self.solution.reaction(joint.name, on)
            label = name if name.endswith(joint.name) else f"{name}, {joint.name}"
            self.add(label, self.unit("force"), reaction.magnitude, self.floor)
            there = reaction.magnitude > self.floor
            x, y = (np.where(np.abs(c) > self.floor, c, 0.0) for c in (reaction.fx, reaction.fy))
            directions = angles(np.arctan2(y, x))
            cells = [cell if seen else "" for cell, seen in zip(directions, there, strict=True)]
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
            self.add(name, unit, values, PRINTED_NONE * float(finite.max(initial=0.0)))


# -- The summary of many instants or designs: ranges and peaks, and where they occur -------------


class _Summary:
    """Arrays are (instants,), of a batch (designs, instants)."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        self.mechanism = solution.mechanism
        self.unit = self.mechanism.units.of
        self.batch = solution.record.batch
        self.names = force_names(self.mechanism)
        self.states = solution.drive_states
        self.forces = solution.has_forces
        self.moves = solution.analysis != "statics"
        self.spans = len(solution) > 1 and np.ptp(solution.t) > 0.0

    def lines(self) -> list[str]:
        parts = [few_instants(self.solution), self._links()]
        if self.forces:
            parts.append(self._joints())
        parts += [couplings(self.solution), contacts(self.solution)]
        parts += [self._drivers(angular) for angular in (True, False)]
        parts += friction(self.solution)
        parts += signals(self.solution)
        parts.append(measures(self.solution))
        lines = heading(self.solution, self._when())
        if self.batch:
            lines += paragraph("peaks and ranges over all designs; system.design(n) is one of them")
        for part in parts:
            lines += ["", *part] if part else []
        return lines + closing(self.solution, residuals=not self.batch)

    def _when(self) -> str:
        t, unit = self.solution.t, self.unit("time")
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
            columns.append(Column("at t", numbers(self.solution.t[instant]), self.unit("time")))
        if self.states is not None and self.states.shape[1]:
            driver = self.mechanism.drivers[0]
            value, title = self.states[instant, 0, 0], f"at {cut(driver.name, 12)}"
            if driver.angular:
                columns.append(Column(title, angles(value), "deg"))
            else:
                columns.append(Column(title, numbers(value), self.unit("length")))
        elif len(self.solution) > 1 and not self.spans:
            columns.append(Column("at instant", [str(k) for k in instant]))
        return columns

    # -- the tables ---------------------------------------------------------------------------

    def _links(self) -> list[str]:
        bodies = [self.solution[body.name] for body in self.mechanism.bodies]
        unit = self.unit
        columns = [Column("LINKS", link_names(self.mechanism)[1:], text=True)]
        ends = [(np.degrees(body.angle.min()), np.degrees(body.angle.max())) for body in bodies]
        low, high = ([f"{round(end[k], 3) + 0.0:.3f}" for end in ends] for k in (0, 1))
        columns.append(Column("angle from", low, "deg"))
        columns.append(Column("to", high, "deg"))
        if self.moves:
            omega, alpha = (
                np.array([np.abs(getattr(body, key)).max() for body in bodies])
                for key in ("omega", "alpha")
            )
            speed = np.array([np.hypot(body.vx, body.vy).max() for body in bodies])
            rate = np.array([np.hypot(body.ax, body.ay).max() for body in bodies])
            acceleration, length = acceleration_scale(self.solution), self.solution.system.length
            columns += [
                Column(
                    "peak ω",
                    numbers(omega, PRINTED_NONE * np.sqrt(acceleration)),
                    unit("angular velocity"),
                ),
                Column(
                    "peak α",
                    numbers(alpha, PRINTED_NONE * acceleration),
                    unit("angular acceleration"),
                ),
                Column("peak v_G", numbers(speed, PRINTED_NONE * speed.max()), unit("velocity")),
                Column(
                    "peak a_G",
                    numbers(rate, PRINTED_NONE * acceleration * length),
                    unit("acceleration"),
                ),
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
                Column("magnitude @ dir.", polars(x, y, floor), self.unit("force")),
                *self._places(at),
                Column("peak torque", torques, self.unit("torque")),
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
        weight = self._weights()
        mean = np.nansum((efforts * weight).reshape(len(chosen), -1), axis=1)
        square = np.nansum((efforts**2 * weight).reshape(len(chosen), -1), axis=1)
        kind = self.unit("torque" if angular else "force")
        floor = force_floor(self.solution) * (self.solution.system.length if angular else 1.0)
        columns = [
            Column(
                "TORQUES" if angular else "DRIVERS",
                [self.names[d.name][0] for d in chosen],
                text=True,
            ),
            Column("driver", [d.name for d in chosen], text=True),
            Column("least", numbers(np.fmin.reduce(flat, axis=1), floor), kind),
            Column("greatest", numbers(np.fmax.reduce(flat, axis=1), floor), kind),
            Column("mean", numbers(mean, floor), kind),
            Column("rms", numbers(np.sqrt(square), floor), kind),
        ]
        if self.moves and self.states is not None:
            number_of = {driver.name: n for n, driver in enumerate(self.mechanism.drivers)}
            rates = np.array([self.states[:, number_of[d.name], 1] for d in chosen])
            rates = rates[:, None, :] if self.batch else rates
            power = np.fmax.reduce(np.abs(efforts * rates).reshape(len(chosen), -1), axis=1)
            least = floor * np.abs(rates).max()
            columns.append(Column("peak power", numbers(power, least), self.unit("power")))
            columns += everyday(self.mechanism.units, "power", power, least)
        over = "time" if in_time(self.solution.t) else "the instants"
        return [*table(columns), f"mean and rms over {over}"]

    def _weights(self) -> Array:
        """Of the instants in a mean over the motion and over the designs: their sum is 1."""
        designs = self.solution.record.count if self.batch else 1
        return mean_weights(self.solution.t) / designs


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
        self.unit = self.mechanism.units.of
        self.forces = solution.has_forces
        self.moves = solution.analysis != "statics"
        self.accelerates = self.moves and solution.analysis != "close_loops"
        self.names = force_names(self.mechanism)
        self.t = float(solution.t[0])

    def lines(self) -> list[str]:
        when = f"at t = {number(self.t)} {self.unit('time')}"
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

    def _histories(self, *keys: str) -> list[Array]:
        """One array over the moving links for each key."""
        bodies = [self.solution[body.name] for body in self.mechanism.bodies]
        return [np.array([getattr(body, key)[0] for body in bodies]) for key in keys]

    def _links(self) -> list[str]:
        unit, acceleration = self.unit, acceleration_scale(self.solution)
        mass = self.solution.system.mass[:-3, 0].reshape(-1, 3)
        x, y, angle, omega, alpha, ax, ay = self._histories(
            "x", "y", "angle", "omega", "alpha", "ax", "ay"
        )
        length = self.solution.system.length
        columns = [
            Column("LINKS", link_names(self.mechanism), text=True),
            Column("mass", ["", *numbers(mass[:, 0])], unit("mass")),
            *self._kilograms(mass[:, 0]),
            Column("I_G", ["", *numbers(mass[:, 2])], unit("inertia")),
        ]
        if not self.moves:
            rounding = PRINTED_NONE * length
            columns.append(Column("x_G", ["", *numbers(x, rounding)], unit("length")))
            columns.append(Column("y_G", ["", *numbers(y, rounding)], unit("length")))
        columns.append(Column("angle", ["", *angles(angle)], "deg"))
        if self.moves:
            floor = PRINTED_NONE * np.sqrt(acceleration)
            columns.append(Column("ω", ["", *numbers(omega, floor)], unit("angular velocity")))
        if self.accelerates:
            alphas = numbers(alpha, PRINTED_NONE * acceleration)
            columns.append(Column("α", ["", *alphas], unit("angular acceleration")))
            vector = polars(ax, ay, PRINTED_NONE * acceleration * length)
            columns.append(Column("a_G", ["", *vector], unit("acceleration")))
        return table(columns)

    def _kilograms(self, mass: Array) -> list[Column]:
        """The masses again where the unit of the system is not in everyday use."""
        found = everyday(self.mechanism.units, "mass", mass)
        return [Column(one.title, ["", *one.cells], one.unit) for one in found]

    def _joints(self) -> list[str]:
        found = []
        for joint in joined(self.mechanism):
            name, on = self.names[joint.name]
            found.append((name, joint.name, self.solution.reaction(joint.name, on)))
        if not found:
            return []
        x, y = (np.array([getattr(r, k)[0] for *_, r in found]) for k in ("fx", "fy"))
        torque = np.array([joint_torque(self.mechanism, r)[0] for *_, r in found])
        floor, unit = force_floor(self.solution), self.unit("force")
        torques = torque_cells(self.solution, torque, floor)
        lines = table(
            [
                Column("FORCES", [name for name, *_ in found], text=True),
                Column("x", numbers(x, floor), unit),
                Column("y", numbers(y, floor), unit),
                Column("magnitude @ dir.", polars(x, y, floor), unit),
                Column("torque", torques, self.unit("torque")),
                Column("joint", [joint for _, joint, _ in found], text=True),
                Column("i on j", [f"{r.by} on {r.on}" for *_, r in found], text=True),
                Column("", [uniqueness_text(r) for *_, r in found], text=True, whole=True),
            ]
        )
        return [*lines, ABOUT] if any(torques) else lines

    def _drivers(self, angular: bool) -> list[str]:
        drivers = self.mechanism.drivers
        chosen = [n for n, driver in enumerate(drivers) if driver.angular == angular]
        if not chosen:
            return []
        states = self.solution.drive_states
        assert states is not None  # one motion has them
        value, rate, change = states[0, chosen].T
        names = [drivers[n].name for n in chosen]
        unit, per = self.unit, "angular " if angular else ""
        columns = [Column("driver" if self.forces else "DRIVERS", names, text=True)]
        if self.forces:
            titles = [self.names[name][0] for name in names]
            columns.insert(0, Column("DRIVERS", titles, text=True))
            effort = np.array([self.solution.effort(name)[0] for name in names])
            kind = "torque" if angular else "force"
            floor = force_floor(self.solution) * (self.solution.system.length if angular else 1.0)
            effort = np.where(np.abs(effort) > floor, effort, 0.0)
            columns.append(Column(kind, numbers(effort), unit(kind)))
            if self.moves:
                columns.append(Column("power", numbers(effort * rate), unit("power")))
                columns += everyday(self.mechanism.units, "power", effort * rate)
        if angular:
            columns.append(
                Column("angle", [f"{v + 0.0:.3f}" for v in np.degrees(value).round(3)], "deg")
            )
        else:
            columns.append(Column("length", numbers(value), unit("length")))
        if self.moves:
            columns.append(Column("rate", numbers(rate), unit(f"{per}velocity")))
        if self.accelerates:
            columns.append(Column("acceleration", numbers(change), unit(f"{per}acceleration")))
        return table(columns)

    def _inertia(self) -> list[str]:
        parts = [self.solution.inertia(body.name) for body in self.mechanism.bodies]
        x, y, torque = (np.array([part[k][0] for part in parts]) for k in range(3))
        mass = self.solution.system.mass[:-3, 0].reshape(-1, 3)
        if not mass.any():
            return []
        unit, acceleration = self.unit, acceleration_scale(self.solution)
        floor = PRINTED_NONE * mass[:, 0].max() * acceleration * self.solution.system.length
        torques = numbers(torque, PRINTED_NONE * mass[:, 2].max() * acceleration)
        return table(
            [
                Column("INERTIA", link_names(self.mechanism)[1:], text=True),
                Column("-m a_Gx", numbers(x, floor), unit("force")),
                Column("-m a_Gy", numbers(y, floor), unit("force")),
                Column("magnitude @ dir.", polars(x, y, floor), unit("force")),
                Column("-I_G α", torques, unit("torque")),
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
        return number(self._law(load, field))

    def degrees(self, load: Element, field: str) -> str:
        """An angle in degrees, as text."""
        return angles(self.solution.system.values[f"{load.name}.{field}"])[0]

    def _load(self, load: Any) -> str:
        """Line on a load at this instant, with its two bodies."""
        values, unit = self.solution.system.values, self.unit
        line: str = load.line(self)
        if line:
            return line
        words = []
        for field in dataclasses.fields(load):
            name = f"{load.name}.{field.name}"
            if "dimension" in field.metadata and values.get(name):
                dimension, label = field.metadata["dimension"], field.name.replace("_", " ")
                words.append(f"{label} {number(values[name])} {unit(dimension)}")
            elif field.name == "value":
                words.append(f"{self.value(load, 'value')} {unit(field.metadata['law'])}")
            elif isinstance(measured := getattr(load, field.name), MeasuredFormula):
                words.append(f"{field.name} {measured.text}")
            elif field.name == "law" and load.law is not None:
                words.append("by a law")
            elif "law" in field.metadata and field.metadata["of"] != "time" and field.name != "law":
                constant = values.get(name)
                label = f"{field.name} by a law"
                if constant is not None:
                    label = f"{field.name} {number(constant)} {unit(field.metadata['law'])}"
                if constant != 0.0:
                    words.append(label)
        by, on = load.bodies[0], load.bodies[-1]
        words.append(f"on {on}" if by in ("ground", on) else f"of {by} on {on}")
        return ", ".join(words[:-1]) + (" " if words[:-1] else "") + words[-1]
