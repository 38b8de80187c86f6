"""The text of a result that declares what it is made of: rows, tables, sentences, notes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mbody.quantities.output_units import OutputUnits
from mbody.quantities.units import DIMENSIONS
from mbody.solution.declared_result import (
    ColumnTable,
    DeclaredEntry,
    Heading,
    IncludedResult,
    ItemTable,
    Sentence,
    Value,
    called,
    entries,
    in_units,
    model_of,
    of_name,
)
from mbody.summaries.text_table import Column, certified, even, number, numbers, paragraph, table

#: Rows of a table of histories that are shown.
SHOWN = 13


def summary(result: Any) -> str:
    """A result as text, at most 100 characters wide; its `repr` where it has no words.

    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> found = mbody.engineering.fluctuation(mbody.kinetostatics(engine, turn=True))
    >>> summary(found).splitlines()[2].split()
    ['FLUCTUATION', 'unit']
    """
    model, heading = model_of(result), Heading("")
    units = UnitsOfText(None if model is None else model.shown)
    blocks: list[tuple[bool, list[str]]] = []  # the first, whether they are sentences
    group: list[tuple[Value, Any]] = []
    for one, owner in [*expanded(result), (heading, result)]:
        if isinstance(one, str):
            continue
        if isinstance(one, Value):
            group += [(one, owner)] if one.words else []
            continue
        blocks.append((False, labelled(heading, group, units)))
        group = []
        if isinstance(one, Heading):
            heading = one
        elif isinstance(one, Sentence):
            said = one.read(owner)
            texts = [said] if isinstance(said, str) else said
            blocks.append((True, [line for text in texts if text for line in paragraph(text)]))
        elif isinstance(one, ItemTable | ColumnTable):
            blocks.append((False, table_of(one, owner, units)))
    blocks = [block for block in blocks if block[1]]
    if not blocks:
        return repr(result)
    lines, above = first_line(result), False
    for sentences, block in blocks:
        # sentences follow each other without a gap
        lines += ([""] if lines and not (sentences and above) else []) + block
        above = sentences
    return "\n".join(even([*lines, *(certified(result) if hasattr(result, "doubts") else [])]))


def expanded(result: Any) -> Iterator[tuple[DeclaredEntry | str, Any]]:
    """All that is declared, with what it is read of."""
    for one in entries(result):
        if isinstance(one, IncludedResult):
            # its headings would begin tables of their own
            other = one.read(result)
            parts = () if other is None else expanded(other)
            yield from (part for part in parts if not isinstance(part[0], Heading))
        else:
            yield one, result


def first_line(result: Any) -> list[str]:
    """The name of the model, and what the result is about."""
    model, about = model_of(result), getattr(result, "about_text", "").format(result)
    name = getattr(result, "model", "") if model is None else model.name
    text = ": ".join(part for part in (str(name), about) if part)
    return paragraph(text) if text else []


class UnitsOfText:
    """Numbers in the units that people read, and the symbols of these.

    `output`: None of a result that knows no mechanism: angles alone are in degrees.
    """

    def __init__(self, output: OutputUnits | None) -> None:
        self.output = output

    def of(self, dimension: str, values: Any) -> tuple[Any, str]:
        """Values of a quantity in their unit, and its symbol."""
        if dimension == "share":
            return np.multiply(values, 100.0), "%"
        if self.output is not None:
            return in_units(self.output, dimension, values)
        return (np.degrees(values), "deg") if dimension == "angle" else (values, "")

    def second(self, dimension: str) -> UnitsOfText | None:
        """Other units that people read beside these; None of most quantities."""
        found = self.output
        if found is None or DIMENSIONS.get(dimension or "number") not in found.beside:
            return None
        return UnitsOfText(OutputUnits(found.system, found.chosen | found.beside))


# -- Rows: a name, a value, its unit -------------------------------------------------------------


def labelled(heading: Heading, group: Sequence[tuple[Value, Any]], units: UnitsOfText) -> list[str]:
    """A table of single quantities; parts of another dimension are beside the unit."""
    rows: list[tuple[str, str, dict[str, str], dict[str, str]]] = []
    symbols: dict[str, str] = {}
    for words, one, value, dimension, floor in (row for pair in group for row in rows_of(*pair)):
        for name, read in ((words, units), ("", units.second(dimension))):
            if read is None:
                continue
            cells, others, unit = {}, {}, ""
            for column in one.columns or (Value("", heading.of, value=lambda whole: whole),):
                own, title, part = str(column.dimension), str(column.words), column.read(value)
                if own and absent(one.columns[0].read(value)):
                    continue
                cell, symbol = text_of(part, own or dimension, read, one, floor)
                if own:
                    others[title], symbols[title] = cell, symbol
                else:
                    cells[title], unit = cell, symbol
            rows.append((name, unit, cells, others))
    titles = dict.fromkeys(title for row in rows for title in row[2])
    columns = [Column(heading.words, [row[0] for row in rows], text=True)]
    columns += [Column(title, [row[2].get(title, "") for row in rows]) for title in titles]
    columns.append(Column("unit", [row[1] for row in rows], text=True))
    columns += [
        Column(title, [row[3].get(title, "") for row in rows], symbol)
        for title, symbol in symbols.items()
    ]
    return table(columns) if rows else []


def value_rows(result: Any, units: UnitsOfText) -> list[tuple[str, str, str]]:
    """Words, value and unit of each single quantity of a result, for a table elsewhere."""
    rows = []
    for one, owner in expanded(result):
        if isinstance(one, Value) and one.words:
            for words, entry, value, dimension, floor in rows_of(one, owner):
                rows.append((words, *text_of(value, dimension, units, entry, floor)))
    return rows


def rows_of(one: Value, owner: Any) -> Iterator[tuple[str, Value, Any, str, float]]:
    """Words, value, dimension and rounding of the rows of a quantity, of a mapping one a key."""
    value, dimension, floor = (
        one.read(owner),
        called(one.dimension, owner),
        called(one.floor, owner),
    )
    if one.by_key:
        for name, part in value.items():
            words = str(of_name(one.words, name, name)).replace("{}", str(name))
            yield words, one, part, of_name(dimension, name, ""), of_name(floor, name, 0.0)
        return
    first = one.columns[0].read(value) if one.columns and value is not None else value
    if not absent(first) or (one.missing is not None and (value is not None or not one.columns)):
        yield str(one.words), one, value, dimension, floor


def absent(value: Any) -> bool:
    """Whether there is no value to show."""
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def text_of(
    value: Any, dimension: str, units: UnitsOfText, one: Value, floor: float
) -> tuple[str, str]:
    """The cell of one value, and its unit."""
    if absent(value):
        return one.missing or "", ""
    if isinstance(value, bool | str):
        return value if isinstance(value, str) else "yes" if value else "no", ""
    if isinstance(value, tuple):
        parts = [text_of(part, dimension, units, one, floor) for part in value]
        return " … ".join(cell for cell, _ in parts), parts[0][1]
    found, symbol = units.of(dimension, 0.0 if abs(value) <= floor else value)
    return (degrees(found) if symbol == "deg" else number(found)), symbol


def degrees(value: float) -> str:
    """An angle, to a thousandth of a degree.

    >>> degrees(-1e-9)
    '0.000'
    """
    return f"{round(float(value), 3) + 0.0:.3f}"


# -- Tables --------------------------------------------------------------------------------------


def columns_of(
    one: Value, values: Sequence[Any], owner: Any, units: UnitsOfText
) -> Iterator[Column]:
    """The column of values of one quantity, and one of a second unit of it."""
    words = str(one.words).format(owner)
    dimension, floor = called(one.dimension, owner), called(one.floor, owner)
    if dimension == "text" or any(isinstance(value, str) for value in values):
        whole = ["; ".join(v) if isinstance(v, list | tuple) else v for v in values]
        texts = [(one.missing or "") if v is None else str(v) for v in whole]
        yield Column(words, texts, text=True)
        return
    there = np.array([value for value in values if not absent(value)] or [0.0], dtype=float)
    there = np.where(np.abs(there) <= floor, 0.0, there)
    for title, read in ((words, units), ("", units.second(dimension))):
        if read is not None:
            found, symbol = read.of(dimension, there)
            cells = iter(cells_of(dimension, symbol, found))
            texts = [missing_of(one, value) if absent(value) else next(cells) for value in values]
            yield Column(title, texts, symbol)


def cells_of(dimension: str, symbol: str, values: np.ndarray) -> Iterable[str]:
    """Numbers of a column: parts of a whole to a hundredth of a percent."""
    if dimension == "share":
        return [f"{value:.2f}" for value in values]
    each = degrees if symbol == "deg" else number if dimension == "each" else None
    return map(each, values) if each else numbers(values)


def missing_of(one: Value, value: Any) -> str:
    """The cell where there is no value."""
    if one.missing is not None:
        return one.missing
    return "infinite" if value is not None and math.isinf(value) else "–"


def table_of(one: ItemTable | ColumnTable, owner: Any, units: UnitsOfText) -> list[str]:
    """A table of items or of columns, the names of a mapping first; how many rows it leaves out."""
    shown = [column for column in one.columns if isinstance(column, Value) and column.words]
    if isinstance(one, ItemTable):
        rows: Any = one.read(owner)
        items = list(rows.values()) if isinstance(rows, Mapping) else rows
        values: list[Any] = [[column.read(item) for item in items] for column in shown]
    else:
        values = [column.read(owner) for column in shown]
        rows = values[0]
        if isinstance(rows, Mapping):
            values = [[column.get(name) for name in rows] for column in values]
    names = list(map(str, rows)) if isinstance(rows, Mapping) else []
    count = len(rows)
    kept: Any = range(count)
    if isinstance(one, ColumnTable) and not names:
        kept = one.kept(owner) if one.kept else evenly(count)
    columns = [Column(one.words.format(owner), names, text=True)] if names else []
    for column, whole in zip(shown, values, strict=True):
        columns += columns_of(column, [whole[k] for k in kept], owner, units)
    left = [f"{len(kept)} of {count} instants; all of them with --json"]
    more = isinstance(one, ColumnTable) and one.kept is None and len(kept) < count
    return [*table(columns), *(left if more else [])] if count else []


def evenly(count: int) -> Any:
    """At most `SHOWN` of so many rows, the first and the last among them.

    >>> evenly(25)
    [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24]
    """
    last, most = count - 1, min(SHOWN, count)
    return sorted({round(n * last / (most - 1 or 1)) for n in range(most)})
