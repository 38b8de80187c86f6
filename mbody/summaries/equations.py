"""The system of force equations of one instant with its numbers, as textbooks print it."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbody.analysis.position.closed_position import direction, place
from mbody.core.tolerances import PRINTED_NONE, PRINTED_NONE_FINE, PRINTED_NONE_REDUNDANT, TINY
from mbody.errors import ModelError
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.solution.checks import Equations, loaded
from mbody.solution.histories import check_forces, whole_instant
from mbody.summaries.text_table import (
    ABOUT,
    WIDTH,
    Column,
    angles,
    cut,
    even,
    force_names,
    heading,
    link_names,
    number,
    numbers,
    paragraph,
    table,
)
from mbody.system.rank import dense, jacobian, rank_of
from mbody.system.system import DENSE

if TYPE_CHECKING:
    from mbody.model.contact import OneSided
    from mbody.model.coupling import Coupling
    from mbody.model.driver import Driver
    from mbody.model.joints import Joint
    from mbody.solution.solution import Solution


# -- The lines of a system of equations: a matrix where it fits, else an equation a line -------

Array = np.ndarray

#: Most unknowns that make a matrix.
MATRIX = 12
#: Significant digits of the greatest coefficient, the most first: as many as fit.
DIGITS = (6, 5, 4)
#: Most characters of the name of a row beside a matrix.
LABEL = 18
#: A space at which no line is broken.
GLUE = "\N{NO-BREAK SPACE}"


def summary(system: Equations) -> str:
    """The summary of the equations of one instant, at most 100 characters wide.

    >>> import mbody
    >>> run = mbody.statics(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> summary(run.equations()).splitlines()[3].split()[:4]
    ['EQUATIONS', 'F12x', 'F12y', 'F32x']
    """
    rhs = numbers(_rounded(system, system.rhs, system.row_units))
    found = _matrix(system, rhs) or _sentences(system, rhs)
    about = "moments about the mass centres; m a means I α in their rows"
    lines = even(
        [*system.heading, "", *found, about, "", *_unknowns(system), "", *_closing(system)]
    )
    return "\n".join(lines)


def _rounded(system: Equations, values: Array, units: tuple[str, ...]) -> Array:
    """Values with 0 in place of rounding: relative to the greatest force, or torque by the greatest
    moment arm.
    """
    part = PRINTED_NONE if system.rank == len(system.unknowns) else PRINTED_NONE_REDUNDANT
    force = np.array(units) == system.row_units[0]
    moment_arm = max(TINY, float(np.abs(system.matrix[2::3]).max(initial=0.0)))
    forces = np.where(force, np.abs(values), np.abs(values) / moment_arm)
    return np.where(forces <= part * forces.max(initial=0.0), 0.0, values)


def _matrix(system: Equations, rhs: list[str]) -> list[str]:
    """The matrix as a table; nothing where it is too wide."""
    if len(system.unknowns) > MATRIX:
        return []
    labels = [cut(label, LABEL) for label in system.rows]
    for digits in DIGITS:
        cells = [_coefficients(system, column, digits) for column in system.matrix.T]
        columns = [Column("EQUATIONS", labels, text=True, whole=True)]
        columns += [Column(name, cell) for name, cell in zip(system.unknowns, cells, strict=True)]
        columns += [Column("", ["="] * len(labels)), Column("m a - loads", rhs)]
        found = table(columns)
        if max(map(len, found)) <= WIDTH:
            return found
    return []


def _coefficients(system: Equations, column: Array, digits: int) -> list[str]:
    """Cells of one column: 0 and ±1 bare, moment arms with as many decimals as in all columns."""
    moment_arms = np.abs(system.matrix[~_bare(system.matrix)])
    top = math.floor(math.log10(moment_arms.max())) if moment_arms.size else 0
    decimals = max(0, digits - 1 - top)
    # bare numbers are above the units of the moment arms
    tail = " " * (decimals + 1) if decimals and not _bare(column).all() else ""
    return [
        ("·" if x == 0.0 else f"{x:.0f}") + tail if bare else f"{x:.{decimals}f}"
        for x, bare in zip((column + 0.0).tolist(), _bare(column), strict=True)
    ]


def _bare(values: Array) -> Array:
    return (values == 0.0) | (np.abs(values) == 1.0)


def _sentences(system: Equations, rhs: list[str]) -> list[str]:
    """Every equation as a line, or some."""
    wide = max(map(len, system.rows))
    found = ["EQUATIONS", "─"]
    for label, row, right in zip(system.rows, system.matrix, rhs, strict=True):
        terms = [_term(x, name) for x, name in zip(row, system.unknowns, strict=True) if x]
        first = terms[0].removeprefix(f"+{GLUE}").replace(f"-{GLUE}", "-") if terms else "0"
        words = " ".join([first, *terms[1:], f"={GLUE}{right.strip()}"])
        found += [
            line.replace(GLUE, " ")
            for line in textwrap.wrap(
                f"{label:<{wide}}  ".replace(" ", GLUE) + words,
                WIDTH,
                subsequent_indent=" " * (wide + 2),
                break_on_hyphens=False,
                break_long_words=False,
            )
        ]
    found[1] = "─" * max(map(len, found))
    return found


def _term(coefficient: float, name: str) -> str:
    """One term with its sign, such as "- 2.487 F43y"."""
    sign, size = "-" if coefficient < 0.0 else "+", number(abs(coefficient))
    return GLUE.join([sign, name] if size == "1" else [sign, size, name])


def _unknowns(system: Equations) -> list[str]:
    found = table(
        [
            Column("UNKNOWNS", system.unknowns, text=True, whole=True),
            Column("value", numbers(_rounded(system, system.values, system.units))),
            Column("", system.units, text=True, whole=True),
            Column("", system.meanings, text=True),
        ]
    )
    return [*found, ABOUT] if any(name.endswith(", torque") for name in system.meanings) else found


def _closing(system: Equations) -> list[str]:
    """How well the values solve the equations, and whether nothing else does."""
    residual, units = np.abs(system.residual), np.array(system.row_units)
    parts = [
        f"{residual[units == unit].max():.1e} {unit}" for unit in dict.fromkeys(system.row_units)
    ]
    found = [f"RESIDUAL   {', '.join(parts)} at most (matrix · unknowns - right-hand side)"]
    rows, columns = system.matrix.shape
    if system.rank == columns:
        return found
    left = columns - system.rank
    note = f"{rows} equations for {columns} unknowns, of rank {system.rank}: {left} "
    note += "combination of unknowns is" if left == 1 else "combinations of unknowns are"
    if columns > rows:
        note += " left open by redundant constraints; the values are those of least norm"
    else:
        note += " left open at this singular position; the values are limits"
    return [*found, "", *paragraph(note, "NOTE   ")]


def equations(solution: Solution, instant: int = 0) -> str:
    """The force equations of one instant as text, at most 100 characters wide.

    The matrix where it fits, else every equation as a line, and the solved unknowns.

    >>> import mbody
    >>> run = mbody.statics(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> equations(run).splitlines()[1]
    'statics equations at t = 0 s; units SI: m, N, s, kg'
    """
    return str(system_of_equations(solution, instant))


def system_of_equations(solution: Solution, instant: int = 0) -> Equations:
    """The force equations of one instant as arrays: matrix · unknowns = m a − loads.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.slider_crank(1, 3, masses=(1, 3, 2), speed=10.0))
    >>> system_of_equations(run).unknowns[6:]
    ('N14', 'T14', 'T12')
    """
    k = _checked(solution, instant)
    return _UnknownColumns(solution, k).equations()


def _checked(solution: Solution, instant: Any) -> int:
    """The instant's place in the solution; refuses what has no such equations."""
    check_forces(solution, "equations")
    k, rows = whole_instant(solution, instant), solution.system.rows
    if rows > DENSE:
        raise ModelError(
            f"'{solution.mechanism.name}' has {rows} unknowns, equations are written out for up to "
            f"{DENSE}: read reactions and efforts by name"
        )
    return k


class _Unknown(NamedTuple):
    """One unknown: its name, unit and meaning; its column (coordinates,) and its value."""

    name: str
    unit: str
    meaning: str
    column: Array
    value: float


class _UnknownColumns:
    """The unknowns of one instant: of the joints, the couplings, the drivers.

    Multipliers λ of an element exert −Φ_qᵀ λ. What they are to be called by are combinations
    u = C λ of them, such as the components of the force on one body: then columns are −Φ_qᵀ C⁻¹.
    """

    def __init__(self, solution: Solution, instant: int) -> None:
        self.solution, self.instant = solution, instant
        self.system, self.mechanism = solution.system, solution.mechanism
        self.unit = self.mechanism.units.of
        self.names = force_names(self.mechanism)
        self.work = loaded(solution, instant)
        self.phi_q = jacobian(self.system, self.work)[1]
        self.q = self.work.q[:, 0]
        self.numbers = solution.record.table(slice(None))[instant]

    def equations(self) -> Equations:
        """All columns beside m a − loads."""
        found = [unknown for joint in self.mechanism.joints for unknown in self._joint(joint)]
        for contact in self.mechanism.contacts:
            found += self._contact(contact) if contact.closed else []
        found += [self._coupling(coupling) for coupling in self.mechanism.couplings]
        found += [self._driver(driver) for driver in self.mechanism.drivers]
        links, n3 = link_names(self.mechanism)[1:], self.system.coordinates
        matrix = np.array([unknown.column for unknown in found]).reshape(-1, n3).T
        size = np.tile([1.0, 1.0, self.system.length], len(links))
        matrix[np.abs(matrix) <= PRINTED_NONE_FINE * size[:, None]] = 0.0
        inertia = self.system.mass[:n3, 0] * self.numbers[2 * n3 : 3 * n3]
        units = (self.unit("force"), self.unit("force"), self.unit("torque"))
        return Equations(
            rows=tuple(f"Σ{what} {link}" for link in links for what in ("Fx", "Fy", "M")),
            row_units=units * len(links),
            unknowns=tuple(unknown.name for unknown in found),
            units=tuple(unknown.unit for unknown in found),
            meanings=tuple(unknown.meaning for unknown in found),
            matrix=matrix,
            rhs=inertia - self.work.force[:n3, 0] - self._friction_forces()[:n3],
            values=np.array([unknown.value for unknown in found]),
            rank=rank_of(dense(self.system, self.work)[1]).rank,
            heading=tuple([*heading(self.solution, self._when()), *self._friction()]),
        )

    def _friction_forces(self) -> Array:
        """Friction forces on the coordinates, those of the ground last."""
        L, n3 = self.system.layout, 3 * self.system.coordinates
        block = self.work.block[:, 0].reshape(-1, 3)
        force = np.zeros(self.system.coordinates + 3)
        for e in L.active_set:
            own = self.numbers[n3 + PER_PRIMITIVE * e]
            for side, body in ((0, L.primitive_i[e]), (2, L.primitive_j[e])):
                force[3 * body : 3 * body + 3] -= own * block[4 * L.written_node[e] + side]
        return force

    def _friction(self) -> list[str]:
        return ["friction of joints is among the loads"] if self.solution.losses else []

    def _when(self) -> str:
        time = f"t = {number(self.solution.t[self.instant])} {self.unit('time')}"
        count = len(self.solution)
        if count == 1:
            return f"equations at {time}"
        return f"equations at {time} (instant {self.instant} of 0 … {count - 1})"

    def _multipliers(self, name: str) -> tuple[Array, Array]:
        """Forces of unit multipliers of an element, (coordinates, rows), and its λ (rows,)."""
        primitive, row, _ = self.system.row_table
        own = np.isin(primitive, self.system.primitives_of[name])
        places = 3 * self.system.coordinates + PER_PRIMITIVE * primitive[own] + row[own]
        return -self.phi_q[own].T, self.numbers[places]

    def _joint(self, joint: Joint) -> list[_Unknown]:
        exerted, lam = self._multipliers(joint.name)
        parts, whole = self._components(joint)
        _, on = self.names[joint.name]
        by = joint.i.body if joint.j.body == on else joint.j.body
        # force and torque on that body, the torque about the joint's place on j
        wrench = exerted[3 * self.system.bodies[on] :][:3].copy()
        relative = place(self.system, self.q, joint, "j") - self.q[3 * self.system.bodies[on] :][:2]
        wrench[2] -= relative[0] * wrench[1] - relative[1] * wrench[0]
        C = np.eye(len(lam)) if whole is None else whole @ wrench
        columns, values = exerted @ np.linalg.inv(C), C @ lam
        found = []
        for n, (kind, unit, detail) in enumerate(parts):
            name = self._named(joint.name, kind)
            meaning = f"on {on} by {by} at {joint.name}, {detail}"
            if whole is None and kind != "F":
                meaning = f"{detail} of {joint.name}, between {joint.i.body} and {joint.j.body}"
            unit = self.unit(unit)
            found.append(_Unknown(name, unit, meaning, columns[:, n], float(values[n])))
        return found

    def _components(self, joint: Joint) -> tuple[list[tuple[str, str, str]], Array | None]:
        """Kind, dimension and direction of a joint's unknowns, and the parts of its force (x, y)
        and torque that they are (unknowns, 3); None where they are its multipliers.
        """
        x, y = ("x", "force", "along x"), ("y", "force", "along y")
        torque = ("T", "torque", "torque")
        if joint.unknowns == ("F",):
            exerted = self._multipliers(joint.name)[0][:, 0]
            return [("F", "force", f"tension, {self._along(exerted, joint.name)}")], None
        if joint.unknowns:
            normal = direction(self.system, self.q, joint, "i") + 0.5 * np.pi
            across = ("N", "force", f"normal to the guide, along {angles(normal)[0]}°")
            known = {
                "x": (x, [1.0, 0.0, 0.0]),
                "y": (y, [0.0, 1.0, 0.0]),
                "N": (across, [np.cos(normal), np.sin(normal), 0.0]),
                "T": (torque, [0.0, 0.0, 1.0]),
            }
            parts = [known[letter] for letter in joint.unknowns]
            return [part for part, _ in parts], np.array([row for _, row in parts])
        kinds = "".join(self.system.row_kinds[e] for e in self.system.primitives_of[joint.name])
        return [
            (f"λ{n}", "force" if kind == "l" else "torque", f"multiplier of row {n}")
            for n, kind in enumerate(kinds, 1)
        ], None

    def _contact(self, contact: OneSided) -> list[_Unknown]:
        """The forces of a contact that is closed for good: across it at each place, and along it
        where it rolls.
        """
        exerted, lam = self._multipliers(contact.name)
        candidates = contact.candidates(self.system.numbers)
        unit, found = self.unit(contact.quantities()["contact"]), list[_Unknown]()
        for n, (column, force) in enumerate(zip(exerted.T, lam, strict=True)):
            across, place = n < len(candidates), n % len(candidates)
            sign = -candidates[place].sign if across else 1.0
            number = str(place + 1) if len(candidates) > 1 else ""
            name = f"{'N' if across else 'T'}{number},{contact.name}"
            where = f" at its place {number}" if number else ""
            what = "pressing force" if across else "force along"
            meaning = f"{what} of {contact.name}{where}"
            found.append(_Unknown(name, unit, meaning, sign * column, sign * float(force)))
        return found

    def _coupling(self, coupling: Coupling) -> _Unknown:
        exerted, lam = self._multipliers(coupling.name)
        letter, dimension = ("T", "torque") if coupling.angular else ("F", "force")
        meaning = f"{dimension} of {coupling.name}, on a coordinate of the factor 1"
        name = f"{letter},{coupling.name}"
        return _Unknown(name, self.unit(dimension), meaning, -exerted[:, 0], -float(lam[0]))

    def _driver(self, driver: Driver) -> _Unknown:
        exerted, lam = self._multipliers(driver.name)
        by, on = driver.bodies
        name = self._named(driver.name, "F")
        meaning, unit = f"on {on} by {by}, torque of {driver.name}", self.unit("torque")
        if not driver.angular:
            along = self._along(-exerted[:, 0], driver.name)
            meaning, unit = f"on {on} by {by}, force of {driver.name}, {along}", self.unit("force")
        # an effort is −λ: its product with the driven rate is the power that it gives
        return _Unknown(name, unit, meaning, -exerted[:, 0], -float(lam[0]))

    def _along(self, exerted: Array, name: str) -> str:
        """Direction of a force on the body of its name, of what it exerts (coordinates,)."""
        n = 3 * self.system.bodies[self.names[name][1]]
        if n < len(exerted):
            fx, fy = exerted[n : n + 2]
        else:  # on the ground, which has no column: the reaction to all other bodies' forces
            fx, fy = -exerted[0::3].sum(), -exerted[1::3].sum()
        return f"along {angles(np.arctan2(fy, fx))[0]}°"

    def _named(self, element: str, kind: str) -> str:
        """Name of an unknown, after that of its force: F14x, N14, T14; multipliers are λ1,slot."""
        whole = self.names[element][0]
        stem = whole.removesuffix(f",{element}")
        if kind.startswith("λ"):
            return f"{kind},{element}"
        name = {"x": f"{stem}x", "y": f"{stem}y", "F": stem}.get(kind, kind + stem[1:])
        return name if whole == stem else f"{name},{element}"
