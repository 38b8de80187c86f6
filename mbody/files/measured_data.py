"""Measured histories from a file of comma-separated values with headings."""

from __future__ import annotations

import csv
import math
import os
from pathlib import Path

import numpy as np

from mbody.errors import ModelError, brief

MOST = 1_000_000  # rows


def measured_data(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Columns by heading, (rows,) each; NaN where a cell is empty."""
    what = f"the data file {brief(str(path))}"
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream) if any(map(str.strip, row))]
    except OSError as error:
        raise ModelError(f"{what} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise ModelError(f"{what} is no text of comma-separated values") from None
    if len(rows) < 2 or len(rows) > MOST:
        raise ModelError(f"{what} has {len(rows)} rows: give headings and 1 to {MOST} rows of data")
    names = [cell.strip() for cell in rows[0]]
    if any(not name or _number(name) is not None for name in names):
        raise ModelError(
            f'{what} has no headings: its first row names what the columns are, such as "t" and '
            '"slider.x [mm]"'
        )
    twice = next((name for name in names if names.count(name) > 1), "")
    if twice:
        raise ModelError(f"{what} has two columns '{twice}': give each once")
    table = np.full((len(rows) - 1, len(names)), math.nan)
    for n, row in enumerate(rows[1:]):
        if len(row) > len(names):
            raise ModelError(f"{what}: row {n + 2} has {len(row)} cells, headings are {len(names)}")
        for k, cell in enumerate(row):
            value = _number(cell) if cell.strip() else math.nan
            if value is None:
                raise ModelError(
                    f"{what}: row {n + 2}, column '{names[k]}' is no number: {brief(cell)}"
                )
            table[n, k] = value
    return {name: table[:, k] for k, name in enumerate(names)}


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
