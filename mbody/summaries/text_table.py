"""Numbers and tables as text: six significant digits, aligned columns, at most `WIDTH` wide."""

from __future__ import annotations

import functools
import itertools
import math
import re
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.tolerances import PRINTED_NONE, PRINTED_NONE_REDUNDANT
from mbody.model.contact import Contact, Rope, joined
from mbody.quantities.output_units import OutputUnits, read_by_people
from mbody.quantities.units import DIMENSIONS, name_of
from mbody.solution.contact_forces import acting_contacts
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

if TYPE_CHECKING:
    from mbody.model.coupling import Coupling
    from mbody.model.driver import Driver
    from mbody.model.mechanism import Mechanism
    from mbody.quantities.units import Dimension, UnitSystem
    from mbody.solution.declared_result import ResultColumn
    from mbody.solution.histories import EventRecord, Reaction
    from mbody.solution.solution import Solution


# -- The text of a result that declares what it is made of: rows, tables, sentences, notes -----

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


WIDTH = 100
DIGITS = 6  # significant, of the greatest number of a column
LEAST = 3  # significant, of the smallest one
GAPS = "   ", "  "  # between columns, and where space is short


def there(values: Any) -> np.ndarray:
    """The values that there are, of any shape in a row; forces without a limit are none (NaN).

    >>> there([1.0, math.nan, 3.0]).max()
    np.float64(3.0)
    """
    array = np.asarray(values, dtype=float).reshape(-1)
    finite = np.isfinite(array)
    return array[finite] if finite.any() else array[:1]


#: What stands where there is no number, or none that is finite.
_NO_NUMBER = {"nan": "–", "inf": "∞", "-inf": "−∞"}


def numbers(values: Any, floor: float = 0.0) -> list[str]:
    """The cells of one column: decimal points in line, what is not above `floor` is 0.

    >>> numbers([243.237591, -1.3412, 1e-13], floor=1e-9)
    ['243.238', '-1.341', '0.000']
    """
    array = np.atleast_1d(np.asarray(values, dtype=float))
    array = np.where(np.abs(array) <= floor, 0.0, array)
    sizes = np.abs(array[np.isfinite(array) & (array != 0.0)])
    if not sizes.size:
        return [_NO_NUMBER.get(text := f"{value:g}", text) for value in array + 0.0]
    top, least = (math.floor(math.log10(size)) for size in (sizes.max(), sizes.min()))
    decimals = max(0, DIGITS - 1 - top, LEAST - 1 - least)
    if top > DIGITS or decimals > DIGITS + 3 or decimals > DIGITS + 2 - max(top, 0):
        return [number(value) for value in array]
    cells = [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in array.tolist()]
    cells = [_NO_NUMBER.get(cell, cell) for cell in cells]
    spare = min(len(cell) - len(cell.rstrip("0")) for cell in cells) if decimals else 0
    keep = spare if spare < decimals else decimals + 1
    return [cell[: len(cell) - keep] if spare and "." in cell else cell for cell in cells]


def number(value: float) -> str:
    """One number, six significant digits.

    >>> number(-0.0), number(19.0), number(243.2375908)
    ('0', '19', '243.238')
    """
    return _NO_NUMBER.get(text := f"{float(value) + 0.0:.{DIGITS}g}", text)


def angles(values: Any, units: OutputUnits | None = None) -> list[str]:
    """Angles [rad] as cells of a column, 0 … 360 deg, or a turn in the unit that is shown.

    >>> angles([-1e-12, np.pi / 3])
    ['0.000', '60.000']
    """
    radians = np.atleast_1d(np.asarray(values, dtype=float))
    if units is None or units.of("angle") == "deg":
        return [f"{round(one % 360.0, 3) % 360.0:.3f}" for one in np.degrees(radians)]
    turn = 2.0 * math.pi / units.size("angle")
    places = max(0, DIGITS - 1 - math.floor(math.log10(turn)))
    shown = (round(one % turn, places) % turn for one in radians / units.size("angle"))
    return [f"{one:.{places}f}" for one in shown]


def polars(x: Any, y: Any, floor: float = 0.0, units: OutputUnits | None = None) -> list[str]:
    """Vectors as cells of a column, "magnitude @ direction"; one that is not above `floor` is 0.

    >>> polars([0.0, 3.0], [2.0, 0.0])
    ['2 @  90.000°', '3 @   0.000°']
    """
    x, y = np.atleast_1d(x), np.atleast_1d(y)
    size, unit = np.hypot(x, y), "deg" if units is None else units.of("angle")
    mark = "°" if unit == "deg" else f" {unit}"
    directions = angles(np.arctan2(np.where(np.abs(y) <= floor, 0.0, y), x), units)
    return [
        f"{cell} @ {direction:>7}{mark}" if s > floor else f"{cell}{'':10}{'':{len(mark)}}"
        for cell, direction, s in zip(numbers(size, floor), directions, size, strict=True)
    ]


@dataclass
class Column:
    """One column: heading, unit, cells; text is at the left and may be cut where space is short,
    unless it is to be kept whole."""

    title: str
    cells: Sequence[str]
    unit: str = ""
    text: bool = False
    whole: bool = False

    @property
    def width(self) -> int:
        """Characters of the widest cell or heading."""
        return max(map(len, (self.title, self.unit, *self.cells)))


def quantities(
    title: str,
    values: Any,
    dimension: str,
    units: OutputUnits,
    floor: float = 0.0,
    before: Sequence[str] = (),
) -> Column:
    """A column of values and a `floor` that are in units of the model, in those that are shown.

    >>> from mbody.quantities.output_units import read_by_people
    >>> from mbody.quantities.units import unit_system
    >>> quantities("mass", [0.03], "mass", read_by_people(unit_system("mm-N-s")))
    Column(title='mass', cells=['30'], unit='kg', text=False, whole=False)
    """
    shown = numbers(units.converted(values, dimension), floor / units.size(dimension))
    return Column(title, [*before, *shown], units.of(dimension))


def vectors(
    title: str,
    x: Any,
    y: Any,
    dimension: str,
    units: OutputUnits,
    floor: float = 0.0,
    before: Sequence[str] = (),
) -> Column:
    """A column of vectors by magnitude and direction, as `quantities`."""
    x, y = (units.converted(one, dimension) for one in (x, y))
    cells = polars(x, y, floor / units.size(dimension), units)
    return Column(title, [*before, *cells], units.of(dimension))


def directions(title: str, values: Any, units: OutputUnits, before: Sequence[str] = ()) -> Column:
    """A column of angles within one turn."""
    return Column(title, [*before, *angles(values, units)], units.of("angle"))


def turned(title: str, values: Any, units: OutputUnits) -> Column:
    """A column of angles that may be more than a turn."""
    return turns(title, units.converted(values, "angle"), units.of("angle"))


def turns(title: str, values: Any, unit: str) -> Column:
    """A column of angles in a unit that may be more than a turn."""
    if unit != "deg":
        return Column(title, numbers(values), unit)
    degrees = np.atleast_1d(np.asarray(values, dtype=float))
    return Column(title, [f"{one + 0.0:.3f}" for one in degrees.round(3)], "deg")


def first_values(
    title: str, columns: Sequence[ResultColumn], solution: Solution, before: Sequence[str] = ()
) -> Column:
    """The first instant of one quantity of several elements; what is rounding is 0."""
    values, one = [column.values[0] for column in columns], columns[0]
    return Column(title, [*before, *numbers(values, rounding(solution, one))], one.unit)


def first_vectors(
    title: str,
    x: Sequence[ResultColumn],
    y: Sequence[ResultColumn],
    solution: Solution,
    before: Sequence[str] = (),
) -> Column:
    """As `first_values` of vectors, by magnitude and direction."""
    at = [[column.values[0] for column in own] for own in (x, y)]
    cells = polars(at[0], at[1], rounding(solution, x[0]), solution.mechanism.shown)
    return Column(title, [*before, *cells], x[0].unit)


def with_unit(value: float, dimension: str, units: OutputUnits) -> str:
    """One value in units of the model as text in the unit that is shown.

    >>> from mbody.quantities.output_units import read_by_people
    >>> from mbody.quantities.units import unit_system
    >>> with_unit(np.pi / 6, "angle", read_by_people(unit_system("SI")))
    '30 deg'
    """
    return f"{number(units.converted(value, dimension))} {units.of(dimension)}"


def beside(values: Any, dimension: str, units: OutputUnits, floor: float = 0.0) -> list[Column]:
    """The column of a quantity in the unit that is shown beside its own, where there is one."""
    found = units.beside.get(DIMENSIONS[dimension])
    if found is None:
        return []
    return [Column("", numbers(np.asarray(values) / found[1], floor / found[1]), found[0])]


def table(columns: Iterable[Column]) -> list[str]:
    r"""Headings, units, a rule, rows; columns without any cell are left out.

    >>> print(*table([Column("LINK", ["2 crank"], text=True), Column("ω", ["25"], "rad/s")]),
    ...       sep="\n")
    LINK          ω
              rad/s
    ───────────────
    2 crank      25
    """
    filled = [column for column in columns if any(column.cells)]
    widths = [column.width for column in filled]
    texts = [n for n, column in enumerate(filled) if column.text and not column.whole]

    def excess(gap: str) -> int:
        return sum(widths) + len(gap) * (len(widths) - 1) - WIDTH

    gap = GAPS[excess(GAPS[0]) > 0]
    while texts and excess(gap) > 0:
        longest = max(texts, key=lambda n: widths[n])
        if widths[longest] <= max(8, len(filled[longest].title)):
            break
        widths[longest] -= 1

    def line(cells: Iterable[str]) -> str:
        parts = [
            cut(cell, width).ljust(width) if column.text else cell.rjust(width)
            for cell, width, column in zip(cells, widths, filled, strict=True)
        ]
        return gap.join(parts).rstrip()

    head = [line(column.title for column in filled)]
    if any(column.unit for column in filled):
        head.append(line(column.unit for column in filled))
    rows = [line(cells) for cells in zip(*(column.cells for column in filled), strict=True)]
    return [*head, "─" * max(map(len, (*head, *rows))), *rows]


def even(lines: Sequence[str]) -> list[str]:
    """Lines with all rules as wide as the widest.

    >>> even(["──", "text", "───"])
    ['───', 'text', '───']
    """
    rule = max((line for line in lines if line.startswith("─")), key=len, default="")
    return [rule if line.startswith("─") else line for line in lines]


def cut(text: str, width: int) -> str:
    """The text, its end replaced by an ellipsis where it is too long.

    >>> cut("connecting rod", 8)
    'connect…'
    """
    return text if len(text) <= width else text[: max(0, width - 1)] + "…"


def paragraph(text: str, mark: str = "") -> list[str]:
    """Lines of a text, at most `WIDTH` wide, those after the first indented below its mark."""
    return textwrap.wrap(mark + text, WIDTH, subsequent_indent=" " * len(mark)) or [mark]


# -- Textbook names, heading and closing lines of summaries ------------------------------------

Array = np.ndarray

#: Below a table of joint forces that shows torques.
ABOUT = "torques about the joint's place on its body j"

#: Times of an event that a summary shows.
LISTED_TIMES = 5


def force_names(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Textbook names of joint forces and driver efforts: ground is 1, links 2, 3, … as described.

    F_ij is the force of link i on link j: of the ground on a link, else of the higher on the lower
    number. With ten links or more it is written F(12,3); where several joints or drivers share a
    pair of links their own name follows.

    >>> import mbody
    >>> force_names(mbody.makers.four_bar(1, 3, 2, 3.5))["A"]
    ('F32', 'crank')
    """
    link = {name: n for n, name in enumerate(["ground", *(b.name for b in mechanism.bodies)], 1)}
    found: dict[str, tuple[str, str, bool]] = {}

    def pair(letter: str, by: str, on: str) -> str:
        between = f"{link[by]}{link[on]}" if len(link) < 10 else f"({link[by]},{link[on]})"
        return letter + between

    for joint in joined(mechanism):
        by, on = sorted(joint.bodies, key=lambda body: -link[body])
        if on == "ground":
            by, on = on, by
        found[joint.name] = (pair("F", by, on), on, False)
    for driver in mechanism.drivers:
        by, on = driver.bodies
        angular = driver.angular
        found[driver.name] = (pair("T" if angular else "F", by, on), on, not angular)
    times = Counter(name for name, _, _ in found.values())
    return {
        element: (f"{name},{element}" if named or times[name] > 1 else name, on)
        for element, (name, on, named) in found.items()
    }


def forces_on(mechanism: Mechanism, body: str) -> dict[str, str]:
    """Textbook names of the forces and efforts that joints and drivers have on one body.

    As `force_names`, but F_ij is always the force on this body: that on the other one has its
    numbers exchanged.

    >>> import mbody
    >>> forces_on(mbody.makers.four_bar(1, 3, 2, 3.5), "coupler")
    {'A': 'F23', 'B': 'F43'}
    """
    ends = {joint.name: joint.bodies for joint in joined(mechanism)}
    ends |= {driver.name: driver.bodies for driver in mechanism.drivers}
    return {
        element: name if on == body else _exchanged(name)
        for element, (name, on) in force_names(mechanism).items()
        if body in ends[element]
    }


def _exchanged(name: str) -> str:
    """The name of the opposite force.

    >>> _exchanged("F32"), _exchanged("T(12,3),motor")
    ('F23', 'T(3,12),motor')
    """
    # as `force_names` writes them: two digits, or two numbers in brackets
    name = re.sub(r"^([A-Z])(\d)(\d)", r"\1\3\2", name)
    return re.sub(r"^([A-Z])\((\d+),(\d+)\)", r"\1(\3,\2)", name)


def heading(solution: Solution, when: str) -> list[str]:
    """Title; analysis, instants and units."""
    machine = solution.mechanism
    return title(machine.name, f"{solution.analysis} {when}", machine.shown)


def title(mechanism: str, words: str, units: OutputUnits | UnitSystem) -> list[str]:
    """Name of the mechanism; its analysis, and the units of all that follows."""
    if not isinstance(units, OutputUnits):
        units = read_by_people(units)
    symbols = ", ".join(units.of(one) for one in ("length", "force", "time", "mass"))
    return [*paragraph(mechanism), *paragraph(f"{words}; units {units.name}: {symbols}")]


def noted(notes: Iterable[str]) -> list[str]:
    """A block of notes, each a paragraph; nothing where there are none."""
    lines = [line for note in notes for line in paragraph(note, "NOTE   ")]
    return ["", *lines] if lines else []


def closing(solution: Solution, residuals: bool = True) -> list[str]:
    """Residuals, the balance of energy, events, status, doubts and notes."""
    lines = []
    if residuals:
        checks = solution.checks
        found = {"constraint": checks.constraint}
        if solution.has_forces:
            found |= {"equilibrium": checks.equilibrium, "virtual work": checks.virtual_work}
        parts = [f"{name} {size:.1e}" if size else f"{name} 0" for name, size in found.items()]
        lines += ["", "RESIDUALS   " + "   ".join(parts) + "   (relative)"]
    if solution.energy is not None and solution.stats is not None:
        counts = ", ".join(f"{count} {name}" for name, count in solution.stats.items() if count)
        lines += ["", f"ENERGY   balance {solution.checks.energy:.1e} (relative)   {counts}"]
    if solution.events:
        lines += ["", *_events(solution)]
    return [*lines, *certified(solution)]


def certified(result: Any) -> list[str]:
    """The status of a result where it is not completed, all its doubts, and its notes."""
    doubts = [one.message for one in result.doubts]
    lines = []
    if result.status != "completed":
        said = result.status.startswith("doubtful:")
        lines = ["", *paragraph(result.status, "STATUS   ")]
        lines += [line for one in doubts[said:] for line in paragraph(one, "DOUBT   ")]
    return [*lines, *noted(note for note in result.notes if note not in doubts)]


def _events(solution: Solution) -> list[str]:
    """Number of occurrences of each event, and the times of the first few; of a batch the designs
    in which it occurs, the first time and the last.
    """
    units, lines = solution.mechanism.shown, list[str]()
    named: dict[str, list[EventRecord]] = {}
    for one in solution.events:
        name = f"{one.name} of {one.contact}" if one.contact else one.name
        named.setdefault(name, []).append(one)
    for name, events in named.items():
        times = [units.converted(one.t, "time") for one in events]
        texts = ", ".join(f"{t:.6g}" for t in times[:LISTED_TIMES]) + (
            ", …" if len(times) > LISTED_TIMES else ""
        )
        if solution.record.batch:
            name += f" in {len({one.design for one in events})} of {solution.record.count} designs"
            ends = sorted({min(times), max(times)})
            texts = " … ".join(f"{t:.6g}" for t in ends)
        many = f", {len(times)} times" if len(times) > 1 else ""
        lines += paragraph(f"{name} at t = {texts} {units.of('time')}{many}", "EVENT   ")
    return lines


def link_names(mechanism: Mechanism) -> list[str]:
    """Numbers and names of all links, the ground first."""
    names = ["ground", *(body.name for body in mechanism.bodies)]
    wide = len(str(len(names)))
    return [f"{n:>{wide}} {name}" for n, name in enumerate(names, 1)]


def _once(function: Callable[[Solution], float]) -> Callable[[Solution], float]:
    """A number of a result that many of its tables need: computed once."""
    key = f"_{function.__name__}"

    @functools.wraps(function)
    def read(solution: Solution) -> float:
        fields = solution.__dict__
        if key not in fields:
            fields[key] = function(solution)
        found: float = fields[key]
        return found

    return read


@_once
def acceleration_scale(solution: Solution) -> float:
    """The greatest of ω², |α|, a/l, (v/l)², of all bodies: beside it smaller ones are rounding."""
    length, parts = solution.system.length, [0.0]
    for body in solution:
        h = solution[body]
        parts += [np.abs(h.alpha).max(), np.abs(h.omega).max() ** 2]
        parts += [np.hypot(h.ax, h.ay).max() / length, (np.hypot(h.vx, h.vy).max() / length) ** 2]
    return float(max(parts))


@_once
def force_floor(solution: Solution) -> float:
    """Rounding level beside the greatest joint force or effort."""
    length, peak = solution.system.length, 0.0
    reactions = (solution.reaction(one.name) for one in acting_contacts(solution))
    joints = (solution.joint_wrench(joint.name) for joint in solution.mechanism.joints)
    for fx, fy, *_ in itertools.chain(joints, ((one.fx, one.fy) for one in reactions)):
        peak = np.fmax(peak, np.fmax.reduce(np.hypot(fx, fy), axis=None))
    machine = solution.mechanism
    elements: tuple[Driver | Coupling, ...] = (*machine.drivers, *machine.couplings)
    for element in elements:
        size = float(np.fmax.reduce(np.abs(solution.effort(element.name)), axis=None))
        peak = np.fmax(peak, size / length if element.angular else size)
    return float(peak) * (PRINTED_NONE_REDUNDANT if solution.regularization else PRINTED_NONE)


#: Of what scales the rounding level of a quantity is made: forces, lengths, rates.
_SCALES = {
    "length": (0, 1, 0),
    "angle": (0, 0, 0),
    "velocity": (0, 1, 1),
    "angular velocity": (0, 0, 1),
    "acceleration": (0, 1, 2),
    "angular acceleration": (0, 0, 2),
    "force": (1, 0, 0),
    "torque": (1, 1, 0),
    "power": (1, 1, 1),
}


def floor_of(solution: Solution, dimension: Dimension) -> float:
    """Rounding level of a quantity beside the greatest of its kind in the mechanism; 0 where there
    is nothing to compare with.
    """
    length, found = solution.system.length, _SCALES.get(name_of(dimension))
    if found is None:
        return 0.0
    forces, lengths, rates = found
    floor = PRINTED_NONE * length**lengths
    if forces:
        floor = (force_floor(solution) if solution.has_forces else 0.0) * length**lengths
    return float(floor * np.sqrt(acceleration_scale(solution)) ** rates) if rates else float(floor)


def rounding(solution: Solution, column: ResultColumn) -> float:
    """Rounding level of a column of the table that people read."""
    units, dimension = solution.mechanism.shown, column.dimension
    return floor_of(solution, dimension) / units.size(dimension)


def torque_cells(solution: Solution, torque: Array, floor: float) -> list[str]:
    """Torques at the joints as cells, blank where none is more than that rounding of forces."""
    floor *= solution.system.length
    if not (np.abs(torque) > floor).any():
        return [""] * len(torque)
    return list(quantities("", torque, "torque", solution.mechanism.shown, floor).cells)


def joint_torque(mechanism: Mechanism, reaction: Reaction) -> Array:
    """The torque of a reaction as summaries show it: none of a contact, whose force acts at the
    place where it touches.
    """
    force_alone = isinstance(mechanism[reaction.joint], Contact | Rope)
    return np.asarray(0.0 * reaction.torque if force_alone else reaction.torque)


def uniqueness_text(reaction: Reaction) -> str:
    """Which components of a reaction are not determined; empty if all are."""
    if reaction.unique is None:
        return "uniqueness unknown"
    pairs = zip(("x", "y", "T"), reaction.unique, strict=True)
    parts = list(pairs)
    said = [
        f"{word}: {', '.join(found)}"
        for word, kind in (("not unique", False), ("uniqueness unknown", None))
        if (found := [name for name, unique in parts if unique is kind])
    ]
    return "; ".join(said)
