"""Chapters of what a report is of: the sketch, the inputs, assumptions and method, the mobility."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mbody.analysis.driven.driven import analyse_at
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.freedom.mobility import Mobility
from mbody.analysis.freedom.mobility import mobility as mobility_of
from mbody.engines.crosscheck import Crosscheck, crosscheck
from mbody.errors import ModelError, SolveError
from mbody.files.model.write import as_data
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import Instants
from mbody.quantities.evaluate import place_in_turn
from mbody.quantities.output_units import OutputUnits
from mbody.quantities.units import NUMBER
from mbody.solution.declared_result import ResultTable
from mbody.solution.result_table import shown_table
from mbody.solution.solution import Solution
from mbody.summaries.analyses import constituents, counts, many
from mbody.summaries.text_table import Column, force_floor, force_names, number, quantities
from mbody.system.system import driver_states
from mbody.views.drawing import draw
from mbody.views.free_bodies import force_peak, when
from mbody.views.page import digest_of
from mbody.views.shapes import cycle

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# -- A document as plain blocks, which every format writes: text, tables, pictures, notices,
#    files -------------------------------------------------------------------------------------
#
# Text may have an index, as in ``F_{32}``, **bold** words between two stars, and `code` between
# backticks; all else is taken as it is.

#: Rows of a table of links or joints: more of them are not read.
ROWS = 40
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWERS = str.maketrans("23456789", "²³⁴⁵⁶⁷⁸⁹")
_RICH = re.compile(r"\*\*(?P<bold>.+?)\*\*|`(?P<code>[^`]+)`|(?P<base>\w+)_\{(?P<index>[^{}]*)\}")


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    items: Sequence[str]


@dataclass(frozen=True)
class Grid:
    """A table; columns without any cell are left out.

    `title`: What it shows.
    `columns`: The first names the rows.
    """

    title: str
    columns: Sequence[Column]

    @property
    def filled_columns(self) -> list[Column]:
        """The columns that have cells."""
        return [column for column in self.columns if any(column.cells)]

    @property
    def widths(self) -> list[int]:
        """Letters of the longest cell of each column, of its title and unit."""
        heads = [max(len(_bare(one.title)), len(_bare(one.unit))) for one in self.filled_columns]
        cells = zip(*self.rows, strict=True)
        return [
            max(head, *(len(_bare(cell)) for cell in own))
            for head, own in zip(heads, cells, strict=True)
        ]

    @property
    def rows(self) -> Iterator[tuple[str, ...]]:
        """The cells of each row."""
        columns = [
            column.cells if column.text else [typeset(cell) for cell in column.cells]
            for column in self.filled_columns
        ]
        return zip(*columns, strict=True)


def _bare(text: str) -> str:
    return "".join(part + index for _, part, index in parts_of(text))


@dataclass(frozen=True)
class Picture:
    """A figure with its caption.

    `name`: Of its file, where a format has one.
    `caption`: What it shows; read aloud where the picture cannot be seen.
    """

    name: str
    figure: Figure
    caption: str


@dataclass(frozen=True)
class Notice:
    """A sentence that must be seen: "good", "doubt" or "note"."""

    kind: str
    text: str


@dataclass(frozen=True)
class FileText:
    """The text of a file, as it is."""

    title: str
    text: str
    language: str = ""


@dataclass(frozen=True)
class DisplayedEquations:
    """Equations below each other, the parts of each in plain text and in LaTeX.

    `lines`: An equation a line, a term a part; between parts a line may be broken.
    """

    lines: Sequence[Sequence[tuple[str, str]]]

    def broken(self, width: int) -> Iterator[list[tuple[str, str]]]:
        """The equations in lines of at most so many letters of text, where terms are not longer."""
        for line in self.lines:
            row: list[tuple[str, str]] = []
            for part in line:
                if row and sum(len(text) + 1 for text, _ in (*row, part)) > width:
                    yield row
                    row = [("   ", r"\qquad")]
                row.append(part)
            yield row


Block: TypeAlias = Text | Items | Grid | Picture | Notice | FileText | DisplayedEquations


@dataclass(frozen=True)
class Chapter:
    """A part of a document under a heading.

    `key`: The name by which it is chosen.
    """

    key: str
    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class ReportDocument:
    """A whole document.

    `about`: The lines below the title.
    """

    title: str
    about: Sequence[tuple[str, str]]
    chapters: Sequence[Chapter] = field(default_factory=list)

    @property
    def pictures(self) -> list[Picture]:
        """All pictures, in order."""
        blocks = (block for chapter in self.chapters for block in chapter.blocks)
        return [block for block in blocks if isinstance(block, Picture)]


def first_rows(grid: Grid) -> list[Block]:
    """A table with its first rows, and a sentence that says so where it has more."""
    count = max((len(column.cells) for column in grid.columns), default=0)
    if count <= ROWS:
        return [grid]
    columns = [replace(column, cells=column.cells[:ROWS]) for column in grid.columns]
    note = f"The first {ROWS} of {count}; the model file and the results have all."
    return [Grid(grid.title, columns), Text(note)]


def typeset(number: str) -> str:
    """A number with a minus sign and a power of ten, as it is printed.

    >>> typeset("-4.75e+06"), typeset("1.2e-16"), typeset("rad")
    ('−4.75·10⁶', '1.2·10⁻¹⁶', 'rad')
    """
    found = re.fullmatch(r"(-?[\d.]+)e([+-]\d+)(.*)", number)
    if found:
        power = str(int(found[2])).translate(_RAISED)
        return f"{found[1].replace('-', '−')}·10{power}{found[3]}"
    return re.sub(r"^-(?=[\d.])", "−", number)


def printed(text: str) -> str:
    """Words with the signs of print: minus, powers of ten, powers, and dots of products.

    >>> printed("at -40 rad/s^2, 2*half, (-1, 3-4-5), 2.5e-16 of it")
    'at −40 rad/s², 2·half, (−1, 3-4-5), 2.5·10⁻¹⁶ of it'
    """
    text = re.sub(r"(?<![\w.])-?\d+(?:\.\d+)?e[+-]\d+\b", lambda found: typeset(found[0]), text)
    text = re.sub(r"(?<![\w.)\]-])-(?=\.?\d)|(?:(?<=\()|(?<== ))-(?=\w)", "−", text)
    text = re.sub(
        r"(?<=[\w)])\^([2-9])(?!\d|\.\d)", lambda found: found[1].translate(_POWERS), text
    )
    return re.sub(r"(?<=[\w)²³])\*(?=[\w(])", "·", text)


def parts_of(text: str) -> Iterator[tuple[str, str, str]]:
    """A text in parts: (kind, text, index), the kinds "plain", "bold", "code" and "index".

    >>> list(parts_of("F_{32} is `A.force`"))
    [('index', 'F', '32'), ('plain', ' is ', ''), ('code', 'A.force', '')]
    """
    done = 0
    for found in _RICH.finditer(text):
        if found.start() > done:
            yield "plain", printed(text[done : found.start()]), ""
        if found["base"]:
            yield "index", found["base"], found["index"]
        else:
            kind = "bold" if found["bold"] else "code"
            yield kind, found[kind], ""
        done = found.end()
    if done < len(text):
        yield "plain", printed(text[done:]), ""


# -- Subject of a report: a result over the cycle, its names and peaks, and further analyses ---

Array = np.ndarray

#: So few instants of a model are marked, each with its free-body diagrams.
FEW = 6
#: Instants of a cycle at which other engines are asked.
COMPARED = 100


@dataclass(eq=False)
class Subject:
    """A result with what chapters of a report need of it more than once.

    `run`: Over the cycle, over time, or at one instant.
    `described`: The description, as it was given.
    `marked`: Instants of its own at which free-body diagrams are drawn.
    `plots`, `polar`: What is plotted; by default all measures, and the joints of the greatest
      forces.
    `against`: Engines of the cross-check.
    `command`: That repeats the report.
    `other`: Another design that it is compared with.
    `label`: Name of the design in a comparison.
    """

    run: Solution
    marked: list[int]
    described: Mechanism
    plots: Sequence[str] = ()
    polar: Sequence[str] = ()
    against: Any = None
    command: str = ""
    other: Subject | None = None
    label: str = ""
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def mechanism(self) -> Mechanism:
        """The description."""
        return self.run.mechanism

    @property
    def many(self) -> bool:
        """Whether there are several instants."""
        return len(self.run) > 1

    @property
    def course(self) -> str:
        """Word for the range of the instants: motion or cycle."""
        return "motion" if self.run.analysis == "simulate" else "cycle"

    @functools.cached_property
    def units(self) -> OutputUnits:
        """The units that are shown."""
        return self.mechanism.shown

    def unit(self, dimension: str) -> str:
        """The unit of a dimension."""
        return self.units.of(dimension)

    def shown(self, value: Any, dimension: str) -> float:
        """One value of the model in the unit that is shown."""
        return float(self.units.converted(value, dimension))

    def column(self, title: str, values: Any, dimension: str, floor: float = 0.0) -> Column:
        """A column of values of the model."""
        return quantities(title, values, dimension, self.units, floor)

    @functools.cached_property
    def mobility(self) -> Mobility:
        """Degrees of freedom."""
        return mobility_of(self.mechanism)

    @functools.cached_property
    def crosscheck(self) -> Crosscheck:
        """The cross-checks by other engines."""
        return crosscheck(self.run.system, self.against, ours=self.compared)

    @functools.cached_property
    def compared(self) -> Solution:
        """The result at as many instants as other engines are asked for: of a cycle enough."""
        step = -(-len(self.run) // COMPARED)
        if step < 2 or self.run.analysis == "simulate":
            return self.run
        return self.run.take(range(0, len(self.run), step))

    @functools.cached_property
    def names(self) -> dict[str, tuple[str, str]]:
        """Textbook names of joint forces and efforts, with the body on which they act."""
        return force_names(self.mechanism)

    @functools.cached_property
    def floor(self) -> float:
        """Rounding level of forces."""
        return force_floor(self.run)

    @property
    def table(self) -> ResultTable:
        """All histories, in the units that are shown."""
        return shown_table(self.run)

    @property
    def loaded(self) -> bool:
        """Whether any force is more than rounding; without masses and loads there is none."""
        return self.run.has_forces and self.floor > 0.0

    @functools.cached_property
    def _file(self) -> tuple[str, str]:
        text, digest, why = digest_of(self.described)
        if why:
            self.failed["text"] = why
        return text, digest

    @property
    def text(self) -> str:
        """The model as a file; empty where it has Python code."""
        return self._file[0]

    @property
    def digest(self) -> str:
        """SHA-256 of the model's text; empty where it has none."""
        return self._file[1]

    def where(self, instants: Sequence[int]) -> list[tuple[str, list[str], str]]:
        """Columns that say where instants are: title, cells, unit."""
        if not self.many:
            return []
        columns = []
        for driver in self.mechanism.drivers[:1]:
            value = self.run.driven(driver.name)[0]
            if np.ptp(value) > 0.0:
                name = getattr(driver, "body", driver.name)
                kind, own = "length", value[list(instants)]
                if driver.angular:
                    kind, own = "angle", np.radians([place_in_turn(float(one)) for one in own])
                shown = self.units.converted(own, kind)
                unit = self.unit(kind)
                cells = [f"{round(v, 2) + 0.0:g}" if unit == "deg" else number(v) for v in shown]
                columns.append((f"at {name}", cells, unit))
        if np.ptp(self.run.t) > 0.0:
            cells = [number(self.shown(self.run.t[k], "time")) for k in instants]
            columns.append(("at t", cells, self.unit("time")))
        return columns

    def place(self, instant: int) -> str:
        """Drivers or time of one instant, in words."""
        return ", ".join(
            f"{title} = {cells[0]}{'°' if unit == 'deg' else f' {unit}'}"
            for title, cells, unit in self.where([instant])
        )


def book(name: str) -> str:
    """A name of `force_names` with its index.

    >>> book("F32"), book("F(12,3)"), book("T12,motor"), book("F_P")
    ('F_{32}', 'F_{12,3}', 'T_{12,motor}', 'F_P')
    """
    parts = re.fullmatch(r"([A-Z])(\d\d|\(\d+,\d+\))(?:,(.*))?", name)
    if parts is None:
        return name
    suffix = f",{parts[3]}" if parts[3] else ""
    return f"{parts[1]}_{{{parts[2].strip('()')}{suffix}}}"


def run_of(
    mechanism: Mechanism, wanted: Instants | None, to: Any, assembly: str | int | None = None
) -> tuple[Solution, list[int]]:
    """The result that a report shows, and the instants that were asked for in it.

    A mechanism that asks for single instants is analysed over its whole revolution as well where it
    can turn, so that peaks are those of the cycle; the instants are then marked in it. With an
    assembly mode, which is one of the first instant, they stay alone.
    """
    if to is not None or (mechanism.simulation is not None and wanted is None):
        if assembly is not None:
            raise ModelError(
                "an assembly mode is of driven analyses, and this is a free motion: leave it out, "
                "or choose instants"
            )
        run = simulate(mechanism, to)
        return run, [force_peak(run)] if len(run) else []
    if not mechanism.drivers:
        raise ModelError(
            f"'{mechanism.name}' has no driver, and no table [simulate]: there is nothing to "
            "report: drive a body, or say until when it moves (--to TIME)",
            mechanism.name,
        )
    ask = wanted or mechanism.ask
    single = ask is not None and not ask.over
    alone = ask is not None and single and all(len(row) == 1 for row in ask.at.values())
    if alone and assembly is None and _revolves(mechanism):
        try:
            whole = analyse_at(mechanism, "kinetostatics", cycle(mechanism, ask))
            asked = analyse_at(mechanism, "kinetostatics", ask)
            return whole, [_nearest(whole, asked)]
        except SolveError:
            pass  # it cannot turn round: its own instants are reported
    run = analyse_at(mechanism, "kinetostatics", ask or cycle(mechanism, None), assembly)
    if single and len(run) <= FEW:
        return _between(mechanism, run, ask, wanted, assembly)
    return run, [force_peak(run)]


def _between(
    mechanism: Mechanism,
    run: Solution,
    ask: Instants | None,
    wanted: Instants | None,
    assembly: str | int | None,
) -> tuple[Solution, list[int]]:
    """The few instants of a model with as many between as make smooth curves, and where they are;
    instants that the user chose stay alone.
    """
    count = len(run)
    smooth = cycle(mechanism, ask)
    if wanted is not None or smooth is ask or count < 2 or smooth.over:
        return run, list(range(count))
    try:
        whole = analyse_at(mechanism, "kinetostatics", smooth, assembly)
    except SolveError:
        return run, list(range(count))
    # of equal steps from one to the next
    return whole, [round(n * (len(whole) - 1) / (count - 1)) for n in range(count)]


def _revolves(mechanism: Mechanism) -> bool:
    """Whether one driver of an angle moves by its law."""
    from mbody.system.assembler import assemble

    system, moving = assemble(mechanism), []
    for driver in system.independent_drivers:
        if driver_states(driver, mechanism, system.numbers):
            return False
        _, rate, change = system.law_of(driver).derivatives(0.0)
        if rate or change:
            moving.append(driver.angular)
    return moving == [True]


def _nearest(whole: Solution, asked: Solution) -> int:
    """The instant of the whole revolution at which the driver is as nearly as it can be."""
    for driver in whole.mechanism.drivers:
        value = whole.driven(driver.name)[0]
        if np.ptp(value) > 0.0:
            away = value - float(asked.driven(driver.name)[0][0])
            away = np.abs(np.remainder(away + math.pi, math.tau) - math.pi)
            return int(np.argmin(away))
    return 0


#: Free motions and parts of the input that are listed.
MOST_LISTED = 40
#: Instants beside the first that a sketch of a whole revolution shows, faded.
FADED = 3
#: Fields of a body that the table of links has.
OWN = ("mass", "weight", "inertia", "cg", "points", "guess")

METHODS = {
    "dop853": "the explicit Runge–Kutta method of order 8 of Dormand and Prince, with its error "
    "estimate and step control",
    "dopri5": "the explicit Runge–Kutta method of order 5 of Dormand and Prince",
    "radau5": "the implicit Runge–Kutta method Radau IIA of order 5, for stiff motions",
    "generalized-alpha": "the generalized-α method",
    "rattle": "the symplectic method RATTLE",
    "rattle4": "the symplectic method RATTLE, composed to order 4",
    "moreau": "time stepping with impulses, Moreau's midpoint rule, of order one",
}


def sketch(subject: Subject) -> list[Block]:
    """The drawing of the mechanism, at the instant of the diagrams."""
    run, k = subject.run, subject.marked[0] if subject.marked else 0
    instants = [k]
    if subject.many:
        step = max(1, (len(run) - 1) // (FADED + 1))
        instants += [(k + n * step) % len(run) for n in range(1, FADED + 1)]
    figure = draw(run, list(dict.fromkeys(instants)))
    more = f"; faded: other positions of the {subject.course}" if len(instants) > 1 else ""
    caption = f"{subject.mechanism.name}: {when(run, k)}{more}"
    return [Picture("sketch", figure, caption)]


# -- inputs ------------------------------------------------------------------------------------


def inputs(subject: Subject) -> list[Block]:
    """Everything that was given, with units."""
    machine = subject.mechanism
    symbols = ", ".join(machine.units.of(key) for key in ("length", "force", "time", "mass"))
    blocks: list[Block] = [
        Text(
            f"Units: {machine.units.name} ({symbols}). Numbers without a unit are in these, and "
            "angles in degrees; results are in the units that their tables name."
        )
    ]
    try:
        data = as_data(machine)
    except ModelError as error:
        return [*blocks, Notice("note", f"The inputs are Python code in part: {error}.")]
    if data.get("parameters"):
        blocks.append(_parameters(subject, data["parameters"]))
    if data.get("inputs"):
        blocks.append(_signals(subject, data["inputs"]))
    blocks += first_rows(_bodies(subject, data))
    if shapes := _shapes(data):
        blocks += first_rows(shapes)
    for section, title in (
        ("joints", "Joints"),
        ("contacts", "Contacts"),
        ("couplings", "Couplings"),
        ("drivers", "Drivers"),
        ("states", "States"),
        ("quantities", "Quantities"),
        ("loads", "Loads"),
    ):
        if data.get(section) and section == "states":
            blocks.append(_states(data[section]))
        elif data.get(section) and section == "quantities":
            formulas = [_flat(text) for text in data[section].values()]
            columns = [Column("quantity", list(data[section]), text=True)]
            blocks.append(Grid(title, [*columns, Column("formula", formulas, text=True)]))
        elif data.get(section):
            blocks += first_rows(_elements(title, data[section]))
    if data.get("gravity"):
        blocks.append(Text(f"Gravity: {_flat(data['gravity'])}."))
    return blocks


def _parameters(subject: Subject, given: dict[str, Any]) -> Grid:
    """Parameters with their value in the units that are shown."""
    scope = subject.mechanism.parameters.scope()
    values, units = [], []
    for name in given:
        known = scope.names[name]
        kind = known.dimension or NUMBER
        values.append(number(float(subject.units.converted(float(known.value), kind))))
        units.append(subject.units.of(kind))
    columns = [
        Column("parameter", list(given), text=True),
        Column("given as", [str(value) for value in given.values()], text=True),
        Column("value", values),
        Column("unit", units, text=True),
    ]
    return Grid("Parameters", columns)


def _signals(subject: Subject, given: dict[str, Any]) -> Grid:
    """Inputs with their values where nobody gives others, and their units."""
    units = [
        "" if one.dimension is None else subject.mechanism.units.of(one.dimension)
        for one in subject.mechanism.inputs
    ]
    columns = [
        Column("input", list(given), text=True),
        Column("given as", [_flat(value) for value in given.values()], text=True),
        Column("unit", units, text=True),
    ]
    return Grid("Inputs", columns)


def _states(given: dict[str, Any]) -> Grid:
    """Auxiliary states with their rates and starts."""
    columns = [
        Column("state", list(given), text=True),
        Column("rate", [_flat(table["rate"]) for table in given.values()], text=True),
        Column("start", [_flat(table.get("start", 0)) for table in given.values()], text=True),
    ]
    return Grid("States", columns)


def _bodies(subject: Subject, data: dict[str, Any]) -> Grid:
    """Mass, moment of inertia, mass centre and points of every link."""
    machine, system = subject.mechanism, subject.run.system
    mass = system.mass[:-3, 0].reshape(-1, 3)
    names = ["1 ground", *(f"{n} {body.name}" for n, body in enumerate(machine.bodies, 2))]
    centres, points = [""], [_points(data.get("ground", {}).get("points", {}))]
    for body in machine.bodies:
        own = data["bodies"].get(body.name, {})
        centres.append(_place_text(own["cg"]) if "cg" in own else "")
        points.append(_points(own.get("points", {})))
    columns = [
        Column("link", names, text=True),
        quantities("mass", mass[:, 0], "mass", subject.units, before=[""]),
        quantities("I_{G}", mass[:, 2], "inertia", subject.units, before=[""]),
        Column("mass centre", centres, text=True),
        Column("points in link axes", points, text=True),
    ]
    return Grid("Links", columns)


def _shapes(data: dict[str, Any]) -> Grid | None:
    """Shapes of the ground and of links that may touch."""
    owners = {"ground": data.get("ground", {}), **data["bodies"]}
    rows = [
        (f"{body}.{name}", _flat(table))
        for body, own in owners.items()
        for name, table in own.get("shapes", {}).items()
    ]
    if not rows:
        return None
    names, words = zip(*rows, strict=True)
    columns = [Column("shape", list(names), text=True), Column("of", list(words), text=True)]
    return Grid("Shapes", columns)


def _points(given: Any) -> str:
    return "; ".join(f"{name} {_place_text(place)}" for name, place in given.items())


def _place_text(given: Any) -> str:
    """A place in link axes, as it was given."""
    if isinstance(given, dict):
        return f"{given.get('r')} @ {given.get('angle')}"
    return f"({', '.join(map(str, given))})"


def _elements(title: str, given: dict[str, Any]) -> Grid:
    """Elements with their kind, what they join, and their numbers."""
    kinds, joined, others_given = [], [], []
    for table in given.values():
        kind, *others = table
        kinds.append(kind.replace("_", " "))
        first = table[kind]
        joined.append(", ".join(map(_end, first)) if isinstance(first, list) else _flat(first))
        others_given.append("; ".join(f"{name} = {_flat(table[name])}" for name in others))
    return Grid(
        title,
        [
            Column(title.lower().removesuffix("s"), list(given), text=True),
            Column("kind", kinds, text=True),
            Column("of", joined, text=True),
            Column("with", others_given, text=True),
        ],
    )


def _end(value: Any) -> str:
    """A place as words.

    >>> _end("crank.A"), _end({"body": "ground", "point": [0, 2], "angle": 90})
    ('crank.A', 'ground (0, 2) at 90')
    """
    if not isinstance(value, dict):
        return str(value)
    point = value.get("point")
    words = str(value.get("body", ""))
    if point is not None:
        words += f".{point}" if isinstance(point, str) else f" {_place_text(point)}"
    return words + (f" at {value['angle']}" if "angle" in value else "")


def _flat(value: Any) -> str:
    """A table in a table as words."""
    if isinstance(value, dict):
        return ", ".join(
            f"{name.replace('_', ' ')}: {_flat(part)}"
            if isinstance(part, dict)
            else f"{name} = {_flat(part)}"
            for name, part in value.items()
        )
    if isinstance(value, list):
        parts = ", ".join(_flat(part) for part in value[:MOST_LISTED])
        return f"({parts}{', …' if len(value) > MOST_LISTED else ''})"
    return re.sub(r"\s+", " ", str(value))


# -- assumptions and method --------------------------------------------------------------------


def method(subject: Subject) -> list[Block]:
    """Chapter on assumptions and numerical methods."""
    run = subject.run
    assumed = ["All links are rigid, and the motion is plane.", *_with_friction(subject)]
    if not any(type(load).__name__ == "Gravity" for load in subject.mechanism.loads):
        assumed.append("Weights do not act: the model has no gravity.")
    weightless = [
        body.name
        for n, body in enumerate(subject.mechanism.bodies)
        if not float(run.system.mass[3 * n, 0])
    ]
    if weightless:
        names = ", ".join(weightless[:12]) + (", …" if len(weightless) > 12 else "")
        assumed.append(f"These links have no mass: {names}.")
    return [
        Text("**Assumptions**"),
        Items(assumed),
        Text("**Method**"),
        Items(list(_steps(subject))),
    ]


def _with_friction(subject: Subject) -> Iterator[str]:
    """Sentences on the assumptions about clearance, friction and contact."""
    run, machine = subject.run, subject.mechanism
    frictional = [name for name in run.losses if name not in {one.name for one in machine.contacts}]
    if frictional:
        names = ", ".join(frictional[:12]) + (", …" if len(frictional) > 12 else "")
        yield (
            f"Joints have no clearance. Coulomb friction acts in {names}, from the whole reaction, "
            "other joints have none."
        )
    elif machine.joints:
        yield "Joints have no clearance and no friction, other than the loads above describe."
    closed = [one.name for one in machine.contacts if one.closed]
    if closed:
        yield f"Contacts are kept closed: {', '.join(closed)}; what slides has Coulomb friction."
    elif machine.contacts or machine.groups:
        yield (
            "Contacts press and do not pull; what sticks is a constraint, what slides has Coulomb "
            "friction; impacts take no time."
            if run.modes or run.stepped is not None
            else "Contacts are left out of this analysis."
        )


def _steps(subject: Subject) -> Iterator[str]:
    run = subject.run
    yield (
        "Every link has three coordinates (x, y of its mass centre, and its angle); joints and "
        "drivers are equations Φ(q, t) = 0 between them (Nikravesh; Haug)."
    )
    if run.analysis == "simulate":
        settings = subject.mechanism.simulation
        name = settings.method if settings is not None else "dop853"
        yield (
            f"The motion is integrated from its beginning by {METHODS.get(name, name)}; "
            "positions and velocities are projected onto the constraints."
        )
        yield "At every instant M·a + Φ_{q}ᵀ·λ = F is solved; λ are the forces of the joints."
    else:
        yield (
            "Positions solve Φ = 0 by Newton's method, and are followed from the first instant, so "
            "that they stay on one branch; velocities and accelerations follow from the "
            "derivatives of Φ."
        )
        inertia = "" if run.analysis == "statics" else " − M·a"
        yield (
            f"Forces solve Φ_{{q}}ᵀ·λ = F{inertia}: inverse dynamics. λ are the forces of the "
            "joints and the efforts of the drivers; no equation is left out."
        )
    yield (
        "F_{ij} is the force of link i on link j, at the joint; the ground is link 1. Torques are "
        "positive counter-clockwise, directions are from the x axis."
    )
    if run.regularization:
        yield (
            "Some joints hold the mechanism twice: their forces are not unique, those of least "
            "norm are given."
        )


# -- mobility ----------------------------------------------------------------------------------


def mobility(subject: Subject) -> list[Block]:
    """Grübler's count, the rank, redundant joints, and what that says of the forces."""
    found = subject.mobility
    titles, found_counts = counts(found)
    titles = [title.replace(" - ", " − ") for title in titles]
    columns = [Column("count", titles, text=True)]
    columns += [Column(title, cells) for title, cells in found_counts.items()]
    blocks: list[Block] = [Text(f"{constituents(found)}."), Grid("Mobility", columns)]
    redundant = found.driven.redundant if found.drivers else found.of_joints.redundant
    if redundant:
        names = ", ".join(found.redundant) if found.redundant else "some joints"
        blocks.append(
            Notice(
                "note",
                f"{many(redundant, 'redundant row')} ({names}): the forces that these share are "
                "not unique. Tables mark those that are not.",
            )
        )
    elif redundant == 0:
        blocks.append(Notice("good", "No row is redundant: every joint force is unique."))
    motions = found.motions[:12]
    if motions:
        blocks.append(
            Text("Free motions without the drivers:" if found.drivers else "Free motions:")
        )
        blocks.append(Items([motion.words for motion in motions]))
    known = {doubt.message for doubt in subject.run.doubts}
    blocks += [Notice("note", note) for note in found.notes if note not in known]
    return blocks
