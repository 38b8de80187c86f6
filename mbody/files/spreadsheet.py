"""A result as a spreadsheet (XLSX): a sheet of instants, one of peaks, one of the model."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody._version import __version__
from mbody.errors import ModelError
from mbody.files.model.write import as_data
from mbody.files.tables import columns
from mbody.files.writing import writing
from mbody.model.study import mean_over
from mbody.solution.result_table import result_table

if TYPE_CHECKING:
    from mbody.quantities.output_units import OutputUnits
    from mbody.solution.solution import Solution

Row = Sequence[Any]
#: The rows that a sheet of this format may have, with its heading.
MOST_ROWS = 1_048_576
#: Letters of the widest cell that a column is made for.
WIDEST = 60
PEAKS = ("quantity", "unit", "least", "least at t", "greatest", "greatest at t", "mean", "rms")


def write_xlsx(solution: Solution, path: str | os.PathLike[str]) -> None:
    """Write a spreadsheet of three sheets: *instants*, a row an instant with the unit of each
    column in its heading; *peaks*, a row a quantity; *model*, what was analysed, and what is said
    of the result.

    Quantities are in the units that people read, `Mechanism.shown`; numbers have sixteen digits.

    Raises
    ------
    ModelError
        For a batch of designs, more instants than a sheet has rows, or without openpyxl.

    >>> import mbody, pathlib, tempfile
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_xlsx(run, pathlib.Path(folder, "run.xlsx"))
    """
    units = solution.mechanism.shown
    table = columns(solution, units=units)
    if len(solution) >= MOST_ROWS:
        raise ModelError(
            f"a sheet has {MOST_ROWS - 1} rows, and the result {len(solution)} instants: write it "
            "as CSV, or keep fewer instants"
        )
    try:
        import openpyxl
    except ImportError:
        raise ModelError(
            "a spreadsheet needs openpyxl, which is not installed: "
            "pip install 'mbody-planar[xlsx]'; CSV needs nothing"
        ) from None
    book = openpyxl.Workbook()
    book.remove(book.active)
    instants = np.column_stack(list(table.values())).tolist()
    _sheet(book, "instants", list(table), instants)
    _sheet(book, "peaks", PEAKS, _peaks(solution, units))
    _sheet(book, "model", ("of", "name", "what", "value"), _model(solution))
    whole = io.BytesIO()
    book.save(whole)
    with writing(path, binary=True) as file:
        file.write(whole.getvalue())


def _sheet(book: Any, title: str, head: Sequence[str], rows: Iterable[Row]) -> None:
    """A sheet with bold headings that stay in sight."""
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    sheet = book.create_sheet(title)
    sheet.append(list(head))
    widths = [len(text) for text in head]
    for row in rows:
        cells = [_cell(value) for value in row]
        sheet.append(cells)
        for n, value in enumerate(cells, start=1):
            if isinstance(value, str) and value[:1] == "=":
                sheet.cell(sheet.max_row, n).data_type = "s"  # text, and no formula
        sizes = (12 if isinstance(value, float) else len(str(value)) for value in cells)
        widths = [max(pair) for pair in zip(widths, sizes, strict=True)]
    for n, width in enumerate(widths, start=1):
        sheet.cell(1, n).font = Font(bold=True)
        sheet.column_dimensions[get_column_letter(n)].width = min(width, WIDEST) + 2
    sheet.freeze_panes = "B2"


def _cell(value: Any) -> Any:
    """A value of a cell; empty where there is no number."""
    if isinstance(value, float):
        return value + 0.0 if math.isfinite(value) else None
    return value


def _peaks(solution: Solution, units: OutputUnits) -> Iterator[Row]:
    """Of every quantity its extremes, where they are, and its mean and rms over time."""
    table = result_table(solution, units)
    t = table["t"].values
    for one in table:
        there = np.isfinite(one.values)
        if one.name == "t" or not there.any():
            continue
        values, at = one.values[there], t[there]
        low, high = int(values.argmin()), int(values.argmax())
        mean, square = (float(mean_over(part, at)) for part in (values, values**2))
        row = [values[low], at[low], values[high], at[high], mean, math.sqrt(max(square, 0.0))]
        yield (one.name, one.unit, *map(float, row))


def _model(solution: Solution) -> Iterator[Row]:
    """The head of the result, what is said of it, and every entry of the model's file."""
    machine = solution.mechanism
    yield "result", "", "mbody", __version__
    yield "result", "", "model", machine.name
    yield "result", "", "analysis", solution.analysis
    yield "result", "", "instants", len(solution)
    yield "result", "", "status", solution.status
    for key in ("constraint", "equilibrium", "virtual_work", "energy"):
        if (found := getattr(solution.checks, key)) is not None:
            yield "residual", "", key.replace("_", " "), float(found)
    for note in dict.fromkeys((*(one.message for one in solution.doubts), *solution.notes)):
        yield "note", "", "", note
    try:
        data = as_data(machine)
    except ModelError as error:
        yield "model", "", "is no file", str(error)
        return
    for section, entry in data.items():
        if not isinstance(entry, dict):
            yield "model", "", section, _text(entry)
            continue
        for name, fields in entry.items():
            if not isinstance(fields, dict):
                yield section, "", name, _text(fields)
                continue
            for key, value in fields.items():
                yield section, name, key, _text(value)


def _text(value: Any) -> Any:
    """An entry of a model: numbers and text as they are, others in one line."""
    if isinstance(value, (int, float, str)):
        return value
    if isinstance(value, dict):
        return ", ".join(f"{key} = {_text(part)}" for key, part in value.items())
    return ", ".join(str(_text(part)) for part in value)
