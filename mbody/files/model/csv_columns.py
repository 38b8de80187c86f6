"""Tables in files of their own, which a model names: only below its own folder."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from array import array
from pathlib import Path

from mbody.errors import ModelError, brief
from mbody.quantities import FormulaError, parse_unit

LARGEST = 10_000_000  # bytes
MOST = 100_000  # rows
LONGEST = 10_000  # characters of a line, more than a row of numbers takes


def columns(name: str, folder: Path | None) -> tuple[list[float | str], list[float | str]]:
    """The first two columns of a CSV file beside the model file, (rows,) each: numbers, as text
    with the unit where the heading of a column has one, as "angle [deg]".
    """
    path, what = path_in_folder(name, folder), f"the table {brief(name)}"
    x, y = array("d"), array("d")
    try:
        with path.open("rb") as stream:
            if os.fstat(stream.fileno()).st_size > LARGEST:
                raise ModelError(f"{what} is larger than {LARGEST // 1_000_000} MB")
            text = io.TextIOWrapper(stream, "utf-8-sig", newline="")
            lines = iter(lambda: text.readline(LONGEST), "")
            headed = False
            units = ["", ""]
            for n, row in enumerate(csv.reader(lines), 1):
                if n > MOST:
                    raise ModelError(f"{what} has more than {MOST} rows: leave some of them out")
                if _numbers(row):
                    x.append(float(row[0]))
                    y.append(float(row[1]))
                elif any(map(str.strip, row)):
                    if headed or x or any(map(_is_number, row[:2])):  # it is no row of headings
                        raise ModelError(f"{what}: row {n} has no two numbers: {brief(row[:3])}")
                    headed = True
                    units = [unit_of(cell) for cell in (*row, "", "")[:2]]
    except OSError as error:
        raise ModelError(f"{what} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise ModelError(f"{what} is no text of comma-separated values") from None
    return _with_unit(x.tolist(), units[0], what), _with_unit(y.tolist(), units[1], what)


def unit_of(heading: str) -> str:
    """The unit in a heading, in brackets at its end; empty where it has none.

    >>> unit_of("angle [deg]"), unit_of("force"), unit_of("part [-]")
    ('deg', '', '')
    """
    found = re.search(r"\[([^\[\]]*)\]\s*$", heading)
    unit = found[1].strip() if found else ""
    return "" if unit in ("-", "–", "1") else unit


def _with_unit(values: list[float], unit: str, what: str) -> list[float | str]:
    """Numbers as they are, or as text with their unit."""
    if not unit:
        return [*values]
    try:
        parse_unit(unit)
    except FormulaError as error:
        why = str(error).rpartition(" is not a formula: ")[2]
        raise ModelError(
            f"{what}: its heading has [{unit[:40]}]: {why.rstrip('?')}: write a unit as in "
            "'angle [deg]', or leave it out"
        ) from None
    return [f"{value!r} {unit}" for value in values]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(row: list[str]) -> bool:
    first = row[:2]
    return len(first) == 2 and all(_is_number(c) and math.isfinite(float(c)) for c in first)


def path_in_folder(name: str, folder: Path | None) -> Path:
    """The path of a file that a model names, which must lie in or below the model's folder."""
    if folder is None:
        raise ModelError(f"{brief(name)} cannot be read: a model from text has no folder beside it")
    try:
        whole = (folder / name).resolve()
        inside = whole.is_relative_to(folder.resolve()) and not Path(name).is_absolute()
        ordinary = whole.is_file()
    except (OSError, ValueError, RuntimeError):
        inside, ordinary = True, False
    if not inside:
        raise ModelError(
            f"{brief(name)} lies outside the folder of the model: name a file below it"
        )
    if not ordinary:
        raise ModelError(f"there is no file {brief(name)} beside the model")
    return whole
