"""The text of a result that declares what it is made of: rows, tables, sentences, notes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mbody.quantities.output_units import OutputUnits
from mbody.quantities.units import DIMENSIONS
from mbody.solution.declared_result import (
    Columns,
    Entry,
    Heading,
    Part,
    Quantity,
    Rows,
    Sentence,
    entries,
    of_name,
)
from mbody.summaries.text_table import Column, certified, even, number, numbers, paragraph, table

#: Rows of a table of histories that are shown.
SHOWN = 13
POWERS = {"²": 2, "³": 3}


def summary(result: Any) -> str:
    """A result as text, at most 100 characters wide; its `repr` where it has no words.

    >>> import mbody
    >>> engine = mbody.makers.slider_crank(1, 4, masses=(0, 0, 1), speed=10.0)
    >>> found = mbody.engineering.fluctuation(mbody.kinetostatics(engine, turn=True))
    >>> summary(found).splitlines()[2].split()
    ['FLUCTUATION', 'unit']
    """
    units, heading = UnitsOfText(result), Heading("")
    blocks: list[list[str]] = []
    group: list[tuple[Quantity, Any]] = []
    for one, owner in [*expanded(result), (heading, result)]:
        if isinstance(one, Quantity):
            group += [(one, owner)] if one.words else []
            continue
        blocks.append(labelled(heading, group, units))
        group = []
        if isinstance(one, Heading):
            heading = one
        elif isinstance(one, Sentence):
            said = one.read(owner)
            texts = [said] if isinstance(said, str) else said
            blocks.append([line for text in texts if text for line in paragraph(text)])
        elif isinstance(one, Rows):
            blocks.append(rows_table(one, owner, units))
        elif isinstance(one, Columns):
            blocks.append(columns_table(one, owner, units))
    if not any(blocks):
        return repr(result)
    lines = first_line(result)
    for block in filter(None, blocks):
        lines += [*[""][: len(lines)], *block]
    return "\n".join(even([*lines, *(certified(result) if hasattr(result, "doubts") else [])]))


def expanded(result: Any) -> Iterator[tuple[Entry, Any]]:
    """All that is declared, with what it is read of."""
    for one in entries(result):
        if isinstance(one, Part):
            # its headings would begin tables of their own
            parts = expanded(one.read(result))
            yield from (part for part in parts if not isinstance(part[0], Heading))
        else:
            yield one, result


def first_line(result: Any) -> list[str]:
    """The name of the model, and what the result is about."""
    machine, about = machine_of(result), result.about_text.format(result)
    name = getattr(result, "model", "") if machine is None else machine.name
    text = ": ".join(part for part in (str(name), about) if part)
    return paragraph(text) if text else []


def machine_of(result: Any) -> Any:
    """The mechanism of a result; None where it does not know one."""
    found = getattr(result, "mechanism", None)
    return getattr(getattr(result, "run", None), "mechanism", None) if found is None else found


class UnitsOfText:
    """Numbers in the units that people read, and the symbols of these."""

    def __init__(self, result: Any) -> None:
        machine = machine_of(result)
        self.output: Any = None if machine is None else OutputUnits(machine.units)

    def of(self, dimension: str, values: Any, unit: str = "") -> tuple[Any, str]:
        """Values of a quantity in their unit, and its symbol."""
        output = self.output
        if not dimension:
            return values, unit
        if dimension == "share":
            return np.multiply(values, 100.0), "%"
        if output is None:
            return (np.degrees(values), "deg") if dimension == "angle" else (values, "")
        output = output.having({dimension: unit}) if unit else output
        # a product is read by its factors: kg·mm², where the system alone has N·s²·mm
        factors = [(part.rstrip("²³"), POWERS.get(part[-1], 1)) for part in dimension.split("·")]
        whole = math.prod(
            (DIMENSIONS[name] ** n for name, n in factors), start=DIMENSIONS["number"]
        )
        if whole in output.chosen or len(factors) == 1:
            found, symbol = output.converted(values, whole), output.of(whole)
            return (np.degrees(values), "deg") if symbol == "rad" else (found, symbol)
        for name, n in factors:
            for _ in range(n):
                values = output.converted(values, name)
        return values, "·".join(output.of(name) + ("", "", "²", "³")[n] for name, n in factors)


# -- Rows: a name, a value, its unit -------------------------------------------------------------


def labelled(
    heading: Heading, group: Sequence[tuple[Quantity, Any]], units: UnitsOfText
) -> list[str]:
    """A table of single quantities; parts of another dimension are beside the unit."""
    rows = [row for one, owner in group for row in rows_of(one, owner)]
    if not rows:
        return []
    names, symbols = [row[0] for row in rows], [""] * len(rows)
    values: dict[str, list[str]] = {}
    beside: dict[str, tuple[str, list[str]]] = {}
    for n, (_, one, value, dimension, floor) in enumerate(rows):
        for column in one.columns or (Quantity("", heading.of, value=lambda whole: whole),):
            own, words, part = str(column.dimension), str(column.words), column.read(value)
            there = not absent(part) and not (own and absent(one.columns[0].read(value)))
            cell, symbol = text_of(part if there else None, own or dimension, units, one, floor)
            if own:
                _, cells = beside.setdefault(words, (symbol, [""] * len(rows)))
            else:
                cells, symbols[n] = values.setdefault(words, [""] * len(rows)), symbol
            cells[n] = cell
    columns = [Column(title, cells) for title, cells in values.items()]
    unit = Column("unit", symbols, text=True)
    others = [Column(title, cells, symbol) for title, (symbol, cells) in beside.items()]
    return table([Column(heading.words, names, text=True), *columns, unit, *others])


def rows_of(one: Quantity, owner: Any) -> Iterator[tuple[str, Quantity, Any, str, float]]:
    """Words, value, dimension and rounding of the rows of a quantity, of a mapping one a key."""
    value, dimension, floor = one.read(owner), one.dimension_of(owner), one.floor_of(owner)
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
    value: Any, dimension: str, units: UnitsOfText, one: Quantity, floor: float
) -> tuple[str, str]:
    """The cell of one value, and its unit."""
    if absent(value):
        return one.missing or "", ""
    if isinstance(value, bool | str):
        return value if isinstance(value, str) else "yes" if value else "no", ""
    if isinstance(value, tuple):
        parts = [text_of(part, dimension, units, one, floor) for part in value]
        return " … ".join(cell for cell, _ in parts), parts[0][1]
    found, symbol = units.of(dimension, 0.0 if abs(value) <= floor else value, one.unit)
    return (degrees(found) if symbol == "deg" else number(found)), symbol


def degrees(value: float) -> str:
    """An angle, to a thousandth of a degree.

    >>> degrees(-1e-9)
    '0.000'
    """
    return f"{round(float(value), 3) + 0.0:.3f}"


# -- Tables --------------------------------------------------------------------------------------


def column_of(
    one: Quantity, values: Sequence[Any], dimension: str, units: UnitsOfText, floor: float
) -> Column:
    """A column of values of one quantity."""
    words, missing = str(one.words), "–" if one.missing is None else one.missing
    if dimension == "text" or any(isinstance(value, str) for value in values):
        whole = ["; ".join(v) if isinstance(v, list | tuple) else v for v in values]
        return Column(words, [missing if v is None else str(v) for v in whole], text=True)
    there = np.array([value for value in values if not absent(value)] or [0.0], dtype=float)
    found, symbol = units.of(dimension, np.where(np.abs(there) <= floor, 0.0, there), one.unit)
    cells = iter(map(degrees, found) if symbol == "deg" else numbers(found))
    return Column(words, [missing if absent(value) else next(cells) for value in values], symbol)


def rows_table(one: Rows, owner: Any, units: UnitsOfText) -> list[str]:
    """A table of items, those of a mapping after their names."""
    items, columns = one.read(owner), []
    if isinstance(items, Mapping):
        columns.append(Column(one.words, list(map(str, items)), text=True))
        items = list(items.values())
    for column in one.columns if len(items) else ():
        if column.words:
            values, floor = [column.read(item) for item in items], column.floor_of(owner)
            columns.append(column_of(column, values, column.dimension_of(owner), units, floor))
    return table(columns) if len(items) else []


def columns_table(one: Columns, owner: Any, units: UnitsOfText) -> list[str]:
    """A table of what are columns already; how many rows are left out."""
    shown = [column for column in one.columns if column.words]
    values: list[Any] = [column.read(owner) for column in shown]
    names = list(values[0]) if isinstance(values[0], Mapping) else []
    if names:
        values = [[column.get(name) for name in names] for column in values]
    count = len(values[0])
    kept = one.kept(owner) if one.kept else range(count) if names else evenly(count)
    columns = [Column(one.words, [str(names[k]) for k in kept], text=True)] if names else []
    for column, whole in zip(shown, values, strict=True):
        part, floor = [whole[k] for k in kept], column.floor_of(owner)
        columns.append(column_of(column, part, column.dimension_of(owner), units, floor))
    more = one.kept is None and len(kept) < count
    left = [f"{len(kept)} of {count} instants; all of them with --json"] if more else []
    return [*table(columns), *left] if count else []


def evenly(count: int) -> Sequence[int]:
    """At most `SHOWN` of so many rows, the first and the last among them.

    >>> evenly(25)
    [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24]
    """
    last, most = count - 1, min(SHOWN, count)
    return sorted({round(n * last / (most - 1 or 1)) for n in range(most)})
