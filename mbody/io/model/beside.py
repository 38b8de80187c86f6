"""Tables in files of their own, which a model names: only below its own folder."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

from mbody.errors import ModelError

__all__ = ["beside", "columns"]

LARGEST = 10_000_000  # bytes


def columns(name: str, folder: Path | None) -> tuple[list[float], list[float]]:
    """The first two columns of a CSV file beside the model file, (rows,) each.

    Raises
    ------
    ModelError
        For a path that leads elsewhere, a file that is too large or has no two columns of numbers.
    """
    path = beside(name, folder)
    try:
        with path.open("rb") as stream:
            text = stream.read(LARGEST + 1)
    except OSError as error:
        raise ModelError(f"the table '{name}' cannot be read: {error.strerror}") from None
    if len(text) > LARGEST:
        raise ModelError(f"the table '{name}' is larger than {LARGEST // 1_000_000} MB")
    try:
        rows = list(csv.reader(text.decode("utf-8-sig").splitlines()))
    except (UnicodeDecodeError, csv.Error):
        raise ModelError(f"the table '{name}' is no text of comma-separated values") from None
    rows = [row for row in rows if any(cell.strip() for cell in row)]
    if rows and not any(map(_is_number, rows[0][:2])):
        rows = rows[1:]
    for n, row in enumerate(rows, 1):
        if not _numbers(row):
            raise ModelError(f"the table '{name}': row {n} has no two numbers: {_cut(row[:3])}")
    return [float(row[0]) for row in rows], [float(row[1]) for row in rows]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(row: list[str]) -> bool:
    first = row[:2]
    return len(first) == 2 and all(_is_number(c) and math.isfinite(float(c)) for c in first)


def beside(name: str, folder: Path | None) -> Path:
    """The path of a file that a model names, which must lie in or below the model's folder."""
    if folder is None:
        raise ModelError(f"'{name}' cannot be read: a model from text has no folder beside it")
    try:
        whole = (folder / name).resolve()
        inside = whole.is_relative_to(folder.resolve()) and not Path(name).is_absolute()
        ordinary = whole.is_file()
    except (OSError, ValueError, RuntimeError):
        inside, ordinary = True, False
    if not inside:
        raise ModelError(f"{_cut(name)} lies outside the folder of the model: name a file below it")
    if not ordinary:
        raise ModelError(f"there is no file {_cut(name)} beside the model")
    return whole


def _cut(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
