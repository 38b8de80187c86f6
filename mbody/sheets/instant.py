"""The readable sheet of a solution: what ``print(run)`` shows, in the names of textbooks."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.free_body import member_forces
from mbody.laws import MeasuredFormula
from mbody.model.one_sided_constraint import joined
from mbody.sheets.contacts import contacts
from mbody.sheets.couplings import couplings
from mbody.sheets.friction import friction
from mbody.sheets.measured import measures
from mbody.sheets.names import (
    ABOUT,
    ROUNDING,
    closing,
    everyday,
    force_floor,
    force_names,
    heading,
    joint_torque,
    link_names,
    remark,
    swiftness,
    torque_cells,
)
from mbody.sheets.points import points
from mbody.sheets.signals import signals
from mbody.sheets.summary import summary
from mbody.sheets.text_table import Column, angles, even, number, numbers, paragraph, polars, table

if TYPE_CHECKING:
    from mbody.model.element import Element
    from mbody.solution.solution import Solution

__all__ = ["sheet"]

Array = np.ndarray


#: Members that a sheet shows.
MEMBERS = 12


def sheet(solution: Solution) -> str:
    """A solution as text, at most 100 characters wide.

    One instant: links, forces at the joints as F_ij (of link i on link j), drivers, inertia forces,
    loads, residuals. Many instants or designs: the ranges and peaks, and where they occur.

    Parameters
    ----------
    solution : Solution
        Of any analysis.

    Returns
    -------
    str
        Lines without a line break at the end.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> sheet(run).splitlines()[0]
    'four-bar'
    """
    many = solution.record.batch or len(solution) > 1
    return "\n".join(even(summary(solution) if many else _Instant(solution).lines()))


class _Instant:
    """The sheet of one instant, table by table."""

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
        parts += [self._drivers(turns) for turns in (True, False)]
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
        unit, swift = self.unit, swiftness(self.solution)
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
            reach = ROUNDING * length
            columns.append(Column("x_G", ["", *numbers(x, reach)], unit("length")))
            columns.append(Column("y_G", ["", *numbers(y, reach)], unit("length")))
        columns.append(Column("angle", ["", *angles(angle)], "deg"))
        if self.moves:
            floor = ROUNDING * np.sqrt(swift)
            columns.append(Column("ω", ["", *numbers(omega, floor)], unit("angular velocity")))
        if self.accelerates:
            turn = numbers(alpha, ROUNDING * swift)
            columns.append(Column("α", ["", *turn], unit("angular acceleration")))
            vector = polars(ax, ay, ROUNDING * swift * length)
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
        turning = torque_cells(self.solution, torque, floor)
        lines = table(
            [
                Column("FORCES", [name for name, *_ in found], text=True),
                Column("x", numbers(x, floor), unit),
                Column("y", numbers(y, floor), unit),
                Column("magnitude @ dir.", polars(x, y, floor), unit),
                Column("torque", turning, self.unit("torque")),
                Column("joint", [joint for _, joint, _ in found], text=True),
                Column("i on j", [f"{r.by} on {r.on}" for *_, r in found], text=True),
                Column("", [remark(r) for *_, r in found], text=True, whole=True),
            ]
        )
        return [*lines, ABOUT] if any(turning) else lines

    def _drivers(self, turns: bool) -> list[str]:
        drivers = self.mechanism.drivers
        chosen = [n for n, driver in enumerate(drivers) if driver.angular == turns]
        if not chosen:
            return []
        states = self.solution.drive_states
        assert states is not None  # one motion has them
        value, rate, change = states[0, chosen].T
        names = [drivers[n].name for n in chosen]
        unit, per = self.unit, "angular " if turns else ""
        columns = [Column("driver" if self.forces else "DRIVERS", names, text=True)]
        if self.forces:
            titles = [self.names[name][0] for name in names]
            columns.insert(0, Column("DRIVERS", titles, text=True))
            effort = np.array([self.solution.effort(name)[0] for name in names])
            kind = "torque" if turns else "force"
            floor = force_floor(self.solution) * (self.solution.system.length if turns else 1.0)
            effort = np.where(np.abs(effort) > floor, effort, 0.0)
            columns.append(Column(kind, numbers(effort), unit(kind)))
            if self.moves:
                columns.append(Column("power", numbers(effort * rate), unit("power")))
                columns += everyday(self.mechanism.units, "power", effort * rate)
        if turns:
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
        unit, swift = self.unit, swiftness(self.solution)
        floor = ROUNDING * mass[:, 0].max() * swift * self.solution.system.length
        torques = numbers(torque, ROUNDING * mass[:, 2].max() * swift)
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
        """What a load is at this instant, and between which bodies."""
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
