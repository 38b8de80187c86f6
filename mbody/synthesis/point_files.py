"""Tables of what a synthesis is to meet: paths, poses and functions as files."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path
from typing import Any

from mbody.errors import ModelError, brief
from mbody.quantities import Formula, FormulaError, read

#: Columns of a table, what it is then, and which of them are angles.
KINDS = {
    ("x", "y"): "path",
    ("x", "y", "timing"): "path",
    ("x", "y", "angle"): "poses",
    ("input", "output"): "function",
}
ANGLES = ("timing", "angle", "input", "output")
#: A heading with its unit, and a number without one.
HEADING = re.compile(r"\s*(.*?)\s*(?:\[([^\]]*)\])?\s*")
PLAIN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def read_demand(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The arguments of `synthesize` from a table: ``path`` and maybe ``timing``, ``poses``, or
    ``function``.

    The first row names the columns: x and y, maybe timing; x, y and angle; or input and output. A
    table of two columns of numbers is a path. A heading may have the unit of its column, as
    ``x [mm]``, and a cell its own; plain angles are in degrees.
    """
    try:
        text = Path(path).read_text("utf-8-sig")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise ModelError(f"cannot read '{path}' ({reason})") from None
    rows = [[cell.strip() for cell in row] for row in csv.reader(text.splitlines())]
    rows = [row for row in rows if any(row) and not row[0].startswith("#")]
    if not rows:
        raise ModelError(f"'{path}' is empty: give a row for each point")
    heads = [HEADING.fullmatch(cell) for cell in rows[0]]
    names = tuple(head[1].lower() if head else "" for head in heads)
    units = [head[2] or "" if head else "" for head in heads]
    first = 1
    if names in KINDS:
        rows, first = rows[1:], 2
    elif len(names) == 2 and _is_number(rows[0][0]):
        names, units = ("x", "y"), ["", ""]
    else:
        raise ModelError(
            f"'{path}': the first row is {brief(', '.join(rows[0]))}: it must name the columns: "
            "x, y; x, y, timing; x, y, angle; or input, output, each maybe with a unit, as x [mm]"
        )
    table = []
    for n, row in enumerate(rows, first):
        if len(row) != len(names):
            raise ModelError(
                f"'{path}': row {n} has {len(row)} cells, the columns are {', '.join(names)}"
            )
        cells = zip(row, names, units, strict=True)
        table.append([_cell(cell, name, unit, n, path) for cell, name, unit in cells])
    what = KINDS[names]
    if "timing" in names:
        return {what: [row[:2] for row in table], "timing": [row[2] for row in table]}
    return {what: table}


def _is_number(text: str) -> bool:
    try:
        read(text, None)
    except FormulaError:
        return False
    return any(letter.isdigit() for letter in text)


def _cell(text: str, name: str, unit: str, n: int, path: Any) -> Formula | float:
    if unit and PLAIN.fullmatch(text):
        text = f"{text} {unit}"
    try:
        cell = read(text, None, "deg" if name in ANGLES else "rad")
    except FormulaError as error:
        raise ModelError(f"'{path}': row {n}, {name}: {error}") from None
    if isinstance(cell, Formula) and cell.names:
        raise ModelError(f"'{path}': row {n}, {name}: {brief(text)} is no number")
    return cell
