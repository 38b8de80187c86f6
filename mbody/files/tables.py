"""Tables of a solution: columns by name, a pandas DataFrame, a file of comma-separated values."""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
import json
import math
import os
import uuid
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from mbody._version import __version__
from mbody.errors import ModelError, brief
from mbody.files.model.write import as_data
from mbody.model.contact import joined
from mbody.model.simulation import mean_over
from mbody.solution.contact_forces import acting_contacts
from mbody.solution.declared_result import ResultTable
from mbody.solution.doubts import certificate
from mbody.solution.result_table import result_table

if TYPE_CHECKING:
    from mbody.quantities.output_units import OutputUnits
    from mbody.solution.solution import Solution


# -- Files that results are written to ---------------------------------------------------------

#: End of a file that is not yet whole.
ENDING = ".part"
#: Ends of files that are no text.
SPREADSHEETS = (".xlsx", ".xls", ".xlsm", ".ods")


@contextlib.contextmanager
def writing(
    path: str | os.PathLike[str], *, binary: bool = False, mark: bool = False
) -> Iterator[IO[Any]]:
    """A file open for writing; one that exists is replaced. `mark`: Whether text begins with the
    mark of UTF-8, by which spreadsheets know it.
    """
    try:
        mode: dict[str, Any] = {"encoding": "utf-8-sig" if mark else "utf-8", "newline": ""}
        with Path(path).open("wb" if binary else "w", **({} if binary else mode)) as file:
            yield file
    except TypeError:
        raise ModelError(f"a path must be text or path-like, not {path!r}") from None
    except BrokenPipeError:
        raise  # who read it has gone, as of `--csv /dev/stdout | head`: there is nothing to mend
    except OSError as error:
        raise ModelError(
            f"cannot write '{path}' ({error.strerror}): choose a folder that exists and may be "
            "written to"
        ) from None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a unique temporary name, and rename it when it is complete."""
    part = path.with_name(f"{path.stem}-{uuid.uuid4().hex}{ENDING}")
    try:
        with part.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


# -- A result as a spreadsheet (XLSX): a sheet of instants, one of peaks, one of the model -----

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


# -- Measured histories from a file of comma-separated values with headings --------------------

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


# -- Friction results as plain lists: losses, modes, ranges, uniqueness, jams ------------------


def friction_data(solution: Solution, table: ResultTable, units: OutputUnits) -> dict[str, Any]:
    """``{"losses", "modes", "ranges", "friction"}`` of mechanisms with frictional joints, else
    empty; losses are columns of the table.

    A range of a reaction has (fx, fy, torque) of each instant; None stands for what is infinite.
    """
    report = solution.friction
    if report is None:
        return {} if solution.shared is None else {"ranges": _ranges(solution, units)}
    certified = report.certified
    same = bool((certified == certified.flat[0]).all()) if certified.size else True
    losses = table.by_owner("joint", "loss") | table.by_owner("contact", "loss")
    found: dict[str, Any] = {
        "losses": {name: as_list(one["loss"].values) for name, one in losses.items()},
        "modes": {name: solution.mode(name) for name in solution.modes or solution.losses},
        "friction": {
            "certified": bool(certified.all()) if same else certified.tolist(),
            "jams": [
                jam._asdict() | {"t": float(units.converted(jam.t, "time"))} for jam in report.jams
            ],
        },
    }
    if solution.analysis != "simulate" or solution.shared is not None:
        found["ranges"] = _ranges(solution, units)
    return found


def _ranges(solution: Solution, units: OutputUnits) -> dict[str, Any]:
    """Of the efforts and reactions that joints at rest, or contacts, leave open."""
    efforts, reactions = {}, {}
    if solution.shared is None and not solution.resting:
        return {"efforts": {}, "reactions": {}}
    machine = solution.mechanism
    for one in (*machine.couplings, *machine.drivers):
        limits = solution.range(one.name)
        if not np.array_equal(limits.low, limits.high, equal_nan=True):
            efforts[one.name] = {
                end: as_list(units.converted(getattr(limits, end), one.effort_dimension))
                for end in ("low", "high")
            }
    shared = solution.shared is not None
    for joint in (*machine.joints, *acting_contacts(solution)) if shared else joined(machine):
        limits = solution.range(joint.name)
        low, high = (
            np.stack([units.converted(getattr(one, k), d) for k, d in PARTS.items()], axis=-1)
            for one in (limits.low, limits.high)
        )
        if not np.array_equal(low, high, equal_nan=True):
            reactions[joint.name] = {"low": as_list(low), "high": as_list(high)}
    return {"efforts": efforts, "reactions": reactions}


#: Components of a reaction.
PARTS = {"fx": "force", "fy": "force", "torque": "torque"}


def as_list(values: Any) -> list[Any]:
    """Numbers of a history; None where there is none, as of forces that have no limit."""
    array = np.asarray(values, dtype=float) + 0.0
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return list(plain.tolist())


# -- The columns of a result by heading ----------------------------------------------------------


def columns(
    solution: Solution, angle: str | None = None, units: OutputUnits | None = None
) -> dict[str, np.ndarray]:
    """The columns of `mbody.Solution.table` by heading, each with its unit; where forces are not
    determined, each joint, contact, coupling and driver has a column ``"A.unique"``, 1 or 0, NaN
    where it was not examined.

    >>> import mbody
    >>> table = columns(mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)))
    >>> list(table)[:4]
    ['t [s]', 'crank.x [m]', 'crank.y [m]', 'crank.angle [rad]']
    """
    units = units or solution.mechanism.data_units.with_angle(angle, "rad")
    table, flags = result_table(solution, units), dict[str, set[bool | None]]()
    for one in table:
        if one.key in UNIQUE and one.role != "load" and solution.has_forces:
            flags.setdefault(one.owner, set()).add(one.unique)
    shown = flags if any(one != {True} for one in flags.values()) else {}
    found = dict[str, np.ndarray]()
    for owner, group in itertools.groupby(table, lambda one: one.owner):
        found |= {one.heading: one.values for one in group}
        if said := shown.get(owner):
            worth = 0.0 if False in said else math.nan if None in said else 1.0
            found[f"{owner}.unique"] = np.full(len(solution), worth)
    return found


#: What is determined or not.
UNIQUE = ("fx", "fy", "torque", "effort")


def dataframe(solution: Solution) -> Any:
    """The columns as a pandas DataFrame, a row an instant.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> dataframe(run).shape
    (361, 51)
    """
    table = columns(solution)
    try:
        import pandas  # type: ignore[import-untyped, unused-ignore]
    except ImportError:
        raise ModelError(
            "a DataFrame needs pandas, which is not installed: pip install pandas; "
            "columns() and to_csv() need nothing"
        ) from None
    frame = pandas.DataFrame(table)
    frame.attrs |= certificate(solution)
    return frame


def write_parquet(solution: Solution, path: str | os.PathLike[str]) -> None:
    """Write the columns as a table of Parquet, a row an instant; status and notes are in its
    metadata, as JSON under ``mbody``.

    >>> import mbody, pathlib, tempfile
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_parquet(run, pathlib.Path(folder, "run.parquet"))
    """
    table = columns(solution)
    try:
        import pyarrow.parquet
    except ImportError:
        raise ModelError(
            "a table of Parquet needs pyarrow, which is not installed: "
            'pip install "mbody-planar[data]"; CSV needs nothing'
        ) from None
    made = pyarrow.table(table)
    said = {"mbody": json.dumps(certificate(solution), ensure_ascii=False)}
    whole = io.BytesIO()
    pyarrow.parquet.write_table(made.replace_schema_metadata(said), whole)
    with writing(path, binary=True) as file:
        file.write(whole.getvalue())


def dataset(solution: Solution) -> Any:
    """The columns as a Dataset of xarray over the coordinate ``t``."""
    table = columns(solution)
    try:
        import xarray  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        raise ModelError(
            "a Dataset needs xarray, which is not installed: pip install xarray; "
            "columns() and to_npz() need nothing"
        ) from None
    parts = {}
    for column, values in table.items():
        name, _, unit = column.partition(" [")
        parts[name] = ("t", np.array(values), {"units": unit.removesuffix("]")} if unit else {})
    said = certificate(solution)
    attributes = {
        "model": solution.mechanism.name,
        "analysis": solution.analysis,
        "status": said["status"],
        "doubts": json.dumps(said["doubts"], ensure_ascii=False),
        "notes": list(said["notes"]),
    }
    return xarray.Dataset(parts, coords={"t": parts.pop("t")}, attrs=attributes)


def write_csv(
    solution: Solution, path: str | os.PathLike[str], angle: str | None = None, excel: bool = False
) -> None:
    """Write the columns as comma-separated values, UTF-8, one header line, a line an instant; for
    spreadsheets with the mark of UTF-8.

    Every number is written with as many digits as bring back the same number.

    >>> import mbody, pathlib, tempfile
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "run.csv")
    ...     write_csv(run, path)
    ...     path.read_text("utf-8")[:24]
    't [s],crank.x [m],crank.'
    """
    if str(path).lower().endswith(SPREADSHEETS):
        raise ModelError(
            f"'{path}' is a file of a spreadsheet, and CSV is text: to_xlsx (--xlsx) writes that"
        )
    columns(solution)  # refuses what has no columns before a file is touched
    with writing(path, mark=excel) as file:
        print_csv(solution, file, angle)


def print_csv(solution: Solution, stream: Any, angle: str | None = None) -> None:
    """Writes a result as CSV to a stream of text."""
    table = columns(solution, angle)
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(table)
    # floats as repr gives them: the shortest exact text
    writer.writerows(np.column_stack(list(table.values())).tolist())
