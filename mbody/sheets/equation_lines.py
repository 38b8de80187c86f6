"""The lines of a system of equations: a matrix where it fits, else an equation a line."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np

from mbody.sheets.names import ABOUT, REDUNDANT, ROUNDING
from mbody.sheets.text_table import WIDTH, Column, cut, even, number, numbers, paragraph, table

if TYPE_CHECKING:
    from mbody.solution.force_equations import Equations

__all__ = ["sheet"]

Array = np.ndarray

#: Most unknowns that make a matrix.
MATRIX = 12
#: Significant digits of the greatest coefficient, the most first: as many as fit.
DIGITS = (6, 5, 4)
#: Most characters of the name of a row beside a matrix.
LABEL = 18
#: A space at which no line is broken.
GLUE = "\N{NO-BREAK SPACE}"


def sheet(system: Equations) -> str:
    """The sheet of the equations of one instant, at most 100 characters wide.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.statics(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> sheet(run.equations()).splitlines()[3].split()[:4]
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
    """The same, 0 for what is rounding beside the greatest force, or torque by the greatest arm."""
    part = ROUNDING if system.rank == len(system.unknowns) else REDUNDANT
    force = np.array(units) == system.row_units[0]
    arm = max(1e-300, float(np.abs(system.matrix[2::3]).max(initial=0.0)))
    forces = np.where(force, np.abs(values), np.abs(values) / arm)
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
    """Cells of one column: 0 and ±1 bare, arms with as many decimals as in all columns."""
    arms = np.abs(system.matrix[~_bare(system.matrix)])
    top = math.floor(math.log10(arms.max())) if arms.size else 0
    decimals = max(0, digits - 1 - top)
    # bare numbers are above the units of the arms
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
