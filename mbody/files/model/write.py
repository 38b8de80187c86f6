"""A mechanism as a model file: the same tables that `read` takes, as TOML or JSON.

What was written as text stays text. A float comes back to the last digit: angles are written in
degrees where the degrees are short, else with their unit in radians.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mbody.errors import ModelError
from mbody.files.model import problems
from mbody.files.model.fields import ANGLE, CURVE, POINTS, SHAPES_OF_BODY, ByName, law_of, plain
from mbody.files.model.problems import SECTIONS, TEXT_ATTRIBUTE, KeyPath, kind_in
from mbody.files.model.read import built, check_size
from mbody.files.model.schema import GRAVITY, table_of_kind
from mbody.files.model.study_tables import tables_of_studies
from mbody.files.model.toml_text import toml, toml_value
from mbody.files.toml_spans import Spans, spliced, value_at
from mbody.laws import Constant
from mbody.model.body import Body
from mbody.model.element import STEADY, Element
from mbody.model.joint_limits import as_described
from mbody.model.mechanism import Mechanism
from mbody.model.states import Input, Quantity, State
from mbody.quantities import Formula, FormulaError, Scope, evaluate, parse, parse_unit
from mbody.quantities.formula import LeftOut
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, UnitSystem

# -- The text of a model file with what has changed: comments, order, formulas and units of all
#    else stay as they were written ------------------------------------------------------------

#: Parts by which two numbers may differ that are one: a change of units and back, each rounded.
CONVERTED = 4.0 * 2.0**-52

#: A number with its unit, or without one; formulas have further signs.
NUMBER_TEXT = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*((?:[A-Za-zµ°%][^+()]*)?)"
)


def kept_text(mechanism: Mechanism) -> str | None:
    """The text of the TOML file that a mechanism was read from, None of another."""
    return vars(mechanism).get(TEXT_ATTRIBUTE)


def shortest(value: float, within: float = CONVERTED) -> float:
    """The decimal of fewest digits that is within that part of a number.

    >>> shortest(0.1124 / 0.001)
    112.4
    """
    for digits in range(1, 17):
        short = float(f"{value:.{digits}g}")
        if abs(short - value) <= within * abs(value):
            return short
    return value


# -- What has changed --------------------------------------------------------------------------


def _changes(before: Any, after: Any, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Paths at which tables differ."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in {**before, **after}:
            if key in before and key in after:
                yield from _changes(before[key], after[key], (*path, key))
            else:
                yield (*path, key)
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for n, pair in enumerate(zip(before, after, strict=True)):
            yield from _changes(*pair, (*path, n))
    elif repr(before) != repr(after):
        yield path


def _own_path(path: KeyPath, written: Any) -> KeyPath:
    """A path by the word that the file has for the kind of an element."""
    entry = value_at(written, path[:2])
    if len(path) > 2 and path[0] in SECTIONS and path[2] in SECTIONS[path[0]]:
        return (*path[:2], kind_in(path[0], entry) or path[2], *path[3:])
    return path


def changed_text(
    text: str, before: dict[str, Any], after: dict[str, Any], units: UnitSystem
) -> tuple[str, dict[str, Any]] | None:
    """The text with the values of `after` where they differ from those of `before`, and the tables
    that it is to be read as; None where it cannot be changed so.

    `before`, `after`: The tables of the mechanism as it was read from the text, and as it is.
    """
    spans = Spans(text)
    made = spans.tree
    wanted, sections = json.loads(json.dumps(after)), {}
    edits: dict[tuple[int, int], str] = {}
    anew: set[KeyPath] = set()
    for path in _changes(before, after):
        own, value = _own_path(path, made), value_at(after, path)
        above = value_at(made, own[:-1])
        if value is None and own in spans.entries and not spans.entries[own].inline:
            start, end, _ = spans.statement(own)
            edits[start, end] = ""
        elif value is not None and own in spans.entries:
            above[own[-1]] = kept = in_unit_of(above[own[-1]], value, units)
            if kept != value:
                value_at(wanted, path[:-1])[path[-1]] = kept
            anew.add(own)
        elif own[:-1] in spans.entries and isinstance(above, dict):
            above |= {own[-1]: value}
            if value is None:
                del above[own[-1]]
            anew.add(own[:-1])
        elif value is not None and len(own) == 1 and isinstance(value, dict):
            sections[own[0]] = value
        elif value is not None and own[:-1] in spans.tables:
            start, end, line = spans.inserted(own[:-1], own[-1], value)
            edits[start, end] = edits.get((start, end), "") + line
        else:  # of another form than in the text: the nearest that holds it is written anew
            inside = [own[:n] for n in range(len(own) - 1, 0, -1) if own[:n] in spans.entries]
            if not inside:
                return None
            nearest = inside[0]
            value_at(made, nearest[:-1])[nearest[-1]] = value_at(after, path[: len(nearest)])
            anew.add(nearest)
    whole = [path for path in anew if not any(path[:n] in anew for n in range(len(path)))]
    splices = [(start, end, new) for (start, end), new in edits.items()]
    splices += [spans.replaced(path, toml_value(value_at(made, path))) for path in whole]
    text = spliced(text, splices)
    return text + ("\n" + toml(sections) if sections else ""), wanted


def unit_of_text(written: Any, units: UnitSystem) -> tuple[str, float] | None:
    """The unit that the text of a number has, and its size in the unit that a plain number has in a
    file, which is a degree of angles; None where it has none.

    >>> from mbody.quantities.units import unit_system
    >>> unit_of_text("3 in", unit_system("mm-N-s"))
    ('in', 25.4)
    """
    number = NUMBER_TEXT.fullmatch(written) if isinstance(written, str) else None
    if number is None or not number[2]:
        return None
    try:
        unit = evaluate(parse_unit(number[2]), Scope(units), with_units=True)
    except FormulaError:
        return None
    size = float(unit.value)
    if unit.dimension == DIMENSIONS["angle"]:
        size = math.degrees(size)
    whole = unit.dimension is not None and math.isfinite(size) and size > 0.0
    return (number[2], size) if whole else None


def in_unit_of(written: Any, value: Any, units: UnitSystem) -> Any:
    """A plain number of a file in the unit that its text has, where it has one."""
    unit = unit_of_text(written, units)
    if unit is None or isinstance(value, (str, bool)) or not isinstance(value, (int, float)):
        return value
    return f"{plain(shortest(value / unit[1]))!r} {unit[0]}"


# -- Numbers and words, as people write them and exact to the last digit -----------------------


def short_angle(value: float) -> Any:
    """An angle [rad] in degrees where few digits give it exactly, else in radians."""
    degrees = math.degrees(value)
    for digits in range(14):
        short = round(degrees, digits)
        if math.radians(short) == value:
            return plain(short)
    return f"{value!r} rad"


def save(
    mechanism: Mechanism, path: str | os.PathLike[str], *, limits: problems.Limits | None = None
) -> None:
    """Write a mechanism to a model file, TOML or (by its ending) JSON; `load` reads it back.

    Of a mechanism that was read from TOML, what did not change stays as it was written: comments,
    order, formulas and units.

    Parameters
    ----------
    mechanism : Mechanism
    path : str or Path
    limits : Limits, optional
        How large the file may be, as of `load`.

    Raises
    ------
    ModelError
        When it has Python code, which no file can contain, `load` would refuse it for its size, or
        the file cannot be written.

    Examples
    --------
    >>> import mbody, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "mine.json")
    ...     save(mbody.makers.slider_crank("40 mm", "120 mm"), file)
    ...     mbody.load(file)["rod"].points["B"]
    (0.12, 0.0)
    """
    file, data = Path(path), as_data(mechanism)
    is_json = file.suffix.lower() == ".json"
    text = _json(data) if is_json else as_it_was(mechanism, file.parent) or toml(data)
    try:
        raw = text.encode()
        check_size(data, len(raw), problems.limits_of(limits), file.name)
        file.write_bytes(raw)
    except OSError as error:
        raise ModelError(f"the file '{file}' cannot be written: {error.strerror}") from None
    except UnicodeEncodeError as error:
        odd = error.object[error.start]
        raise ModelError(f"the file '{file}' cannot be written: {odd!a} is no character") from None


def as_it_was(mechanism: Mechanism, folder: Path | None = None) -> str | None:
    """The text of the file that a mechanism was read from with what has changed; None where there
    is none, or where it would not be read as the mechanism from that folder.
    """
    text, data = kept_text(mechanism), as_data(mechanism)
    if text is None:
        return None
    try:
        before = as_data(built(tomllib.loads(text), folder=folder))
        found = changed_text(text, before, data, mechanism.units)
        if found is None or as_data(built(tomllib.loads(found[0]), folder=folder)) != found[1]:
            return None
    except (ModelError, tomllib.TOMLDecodeError):
        return None
    return found[0]


def to_toml(mechanism: Mechanism) -> str:
    """The text of a model file in TOML; `save` writes JSON too.

    Raises
    ------
    ModelError
        When it has Python code, which no file can contain.

    >>> from mbody import Body, Mechanism
    >>> machine = Mechanism("an arm", units="mm-N-s")
    >>> machine.add(Body("arm", mass="2 kg", points={"A": (100.0, 0.0)}))
    >>> print(to_toml(machine))
    name  = "an arm"
    units = "mm-N-s"
    <BLANKLINE>
    [bodies.arm]
    mass   = "2 kg"
    points = { A = [100, 0] }
    <BLANKLINE>
    """
    return toml(as_data(mechanism))


def to_json(mechanism: Mechanism) -> str:
    """The text of a model file in JSON; errors as of `to_toml`."""
    return _json(as_data(mechanism))


def _json(data: dict[str, Any]) -> str:
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


def as_data(mechanism: Mechanism) -> dict[str, Any]:
    """The tables of a model file."""
    return Writer(mechanism).whole()


class Writer:
    """Turns elements into tables, with the text that their numbers were made of."""

    def __init__(self, mechanism: Mechanism) -> None:
        mechanism = as_described(mechanism)
        self.mechanism, self.formulas = mechanism, mechanism.formulas
        self.units, self.scope = mechanism.units, mechanism.parameters.scope()
        #: Formulas of studies as they were written, each with the dimension that it has there.
        self.asked: list[Formula] = []
        self.angle = "deg"
        tables_of_studies(self)
        # text of plain radians reads as it is only where the file has that unit
        formulas = [*self.formulas.values(), *self.asked]
        open_angles = {f.angle for f in formulas if self.is_open(f)}
        self.angle = "rad" if open_angles == {"rad"} else "deg"

    def is_open(self, formula: Formula) -> bool:
        """Whether it is a plain angle, with the unit of the file."""
        return formula.dimension == ANGLE and not formula.has_units(self.scope)

    def written(self, value: float, dimension: Dimension) -> Any:
        """A float as the file has it."""
        degrees = dimension == ANGLE and self.angle == "deg"
        return short_angle(value) if degrees else plain(value)

    def parameter(self, name: str) -> Any:
        """A parameter: a number or its text."""
        own = self.mechanism.parameters[name]
        text = self.text(own) if isinstance(own, Formula) else None
        return self.parameter_text(name) if text is None else text

    def parameter_text(self, name: str) -> Any:
        """The value of a parameter: a number with its unit, a plain one as it is."""
        return self.with_unit(float(self.scope.names[name].value), self.scope.names[name].dimension)

    def with_unit(self, value: float, dimension: Dimension | None) -> Any:
        """A value in the units of the mechanism with its unit; a plain one as it is."""
        scope = self.scope
        if dimension is None:
            return plain(value)
        text = f"{value!r} {scope.system.of(dimension)}".strip()
        with contextlib.suppress(FormulaError):
            if evaluate(parse(text), scope).dimension == dimension:
                return text
        # a parameter has the name of a unit, or a power is no digit: unit by unit
        powers = [(symbol, p) for symbol, p in scope.system.powers(dimension) if p]
        units = (f"(1 {symbol})" + (f"^({p})" if p != 1 else "") for symbol, p in powers)
        return " * ".join([repr(value), *units])

    def whole(self) -> dict[str, Any]:
        """All tables."""
        machine = self.mechanism
        for controller in machine.controllers:
            raise ModelError(
                f"'{controller.name}' is a Controller, Python code of your own, which a model file "
                "does not carry",
                controller.name,
            )
        data: dict[str, Any] = {"name": machine.name}
        for key in ("source", "note"):
            if getattr(machine, key):
                data[key] = getattr(machine, key)
        data["units"] = self.units.name
        if self.angle == "rad":
            data["angle"] = "rad"
        if not isinstance(machine.g, LeftOut):
            data["g"] = self.written(machine.g, DIMENSIONS["acceleration"])
        if machine.output_units:
            data["output_units"] = machine.output_units
        if machine.parameters:
            data["parameters"] = {name: self.parameter(name) for name in machine.parameters}
        if machine.curves:
            data["curves"] = ByName(CURVE).write(self, "", dict(machine.curves))
        if machine.inputs:
            data["inputs"] = {one.name: self.input(one) for one in machine.inputs}
        if machine.ground.points:
            data["ground"] = {"points": POINTS.write(self, "ground.points", machine.ground.points)}
        if machine.ground.shapes:
            shapes = SHAPES_OF_BODY.write(self, "ground.shapes", machine.ground.shapes)
            data["ground"]["shapes"] = shapes
        bodies = table_of_kind(Body)
        data["bodies"] = {body.name: bodies.write(self, body.name, body) for body in machine.bodies}
        for section in problems.SECTIONS:
            # drivers may follow them, and loads measure them
            if section == "drivers" and machine.described_states:
                data["states"] = {one.name: self.state(one) for one in machine.described_states}
            if section == "drivers" and machine.quantities:
                data["quantities"] = {one.name: self.quantity(one) for one in machine.quantities}
            elements = getattr(machine, section)
            if section == "contacts":
                elements = (*elements, *machine.groups)
            # the section of gravity is the last of the loads
            gravity = next(
                (e for e in elements[-1:] if problems.kind_of(e) == e.name == "gravity"), None
            )
            table = {e.name: self.element(e) for e in elements if e is not gravity}
            if table:
                data[section] = table
            if gravity is not None:
                data["gravity"] = GRAVITY.write(self, gravity.name, gravity)
        return data | tables_of_studies(self)

    def curve_number(self, name: str, value: Any, dimension: Dimension | None) -> Any:
        """A number of a curve that is no text."""
        number = value.value(self.scope) if isinstance(value, Formula) else value
        return plain(number)

    def wanted(self, value: Any, dimension: Dimension) -> Any:
        """A number of a question, as it was written."""
        if not isinstance(value, Formula):
            return self.written(value, dimension)
        whole = value.of(dimension)
        self.asked.append(whole)
        text = self.text(whole)
        return self.written(whole.value(self.scope), dimension) if text is None else text

    def element(self, element: Element) -> dict[str, Any]:
        """The table of a joint, driver or load."""
        kind = problems.kind_of(element)
        if kind is None:
            raise ModelError(
                f"'{element.name}' is a {type(element).__name__}, Python code of your own, which a "
                "model file does not carry",
                element.name,
            )
        cls: Any = type(element)
        return table_of_kind(cls, kind).write(self, element.name, element)

    def input(self, given: Input) -> Any:
        """The law of an input, which has the dimension of its text."""
        name = f"{given.name}.value"
        dimension = given.dimension or NUMBER
        if isinstance(given.value, Constant):
            return self.open_number(name, given.value.value, given.dimension)
        return law_of(dimension, DIMENSIONS["time"]).write(self, name, given.value)

    def state(self, own: State) -> dict[str, Any]:
        """The table of an auxiliary state."""
        rate: Any = self.formulas.get(f"{own.name}.rate", own.rate)
        measure = (own.dimension or NUMBER) / DIMENSIONS["time"]
        table: dict[str, Any] = {"rate": self.formula_text(own.name, rate, measure)}
        if own.start == STEADY:
            table["start"] = STEADY
        for key in ("start", "size"):
            value, name = getattr(own, key), f"{own.name}.{key}"
            if (
                isinstance(value, float) and (key, value) != ("start", 0.0)
            ) or name in self.formulas:
                table[key] = self.open_number(name, value, own.dimension)
        return table

    def quantity(self, own: Quantity) -> Any:
        """The formula of a quantity."""
        formula = self.formulas[f"{own.name}.formula"]
        return self.formula_text(own.name, formula, own.dimension or NUMBER)

    def formula_text(self, element: str, formula: Formula, dimension: Dimension) -> Any:
        """The formula of measured quantities that an element has as text."""
        return self.text(formula)

    def open_number(self, name: str, value: float, dimension: Dimension | None) -> Any:
        """A number whose text tells what it measures."""
        formula = self.formulas.get(name)
        text = None if formula is None else self.text(formula)
        return self.with_unit(value, dimension) if text is None else text

    def number(self, name: str, value: float, dimension: Dimension) -> Any:
        """The text that a number was made of, else the number."""
        formula = self.formulas.get(name)
        text = None if formula is None else self.text(formula)
        return self.written(value, dimension) if text is None else text

    def law_text(self, formula: Formula, name: str, measured: bool) -> Any:
        """The text of a formula of a variable, or of measured quantities."""
        return self.text(formula)

    def text(self, formula: Formula) -> Any:
        """The text of a formula as a file has it, None where it was no text."""
        try:
            if parse(formula.text, curves=True) != formula.tree:
                return None
        except FormulaError:
            return None
        if self.is_open(formula) and formula.angle != self.angle:
            return f"({formula.text}) {formula.angle}"
        return formula.text
