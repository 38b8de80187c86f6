"""A mechanism as a model file: the same tables that `read` takes, as TOML or JSON.

What was written as text stays text. A float comes back to the last digit: angles are written in
degrees where the degrees are short, else with their unit in radians.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from mbody.errors import ModelError
from mbody.files.model import problems, study_tables
from mbody.files.model.fields import section_table
from mbody.files.model.read import check_size
from mbody.laws import Cam, Constant, Dwell, Law, MeasuredFormula, Polynomial, Table, Table2
from mbody.laws.base import dimension_by
from mbody.model.body import Body, Guess, SecondMoments, SlenderRod
from mbody.model.coupling import CouplingTerm
from mbody.model.curves import NamedCurve
from mbody.model.element import ENDS, Element, Marker, Polar, place_name
from mbody.model.inputs import Input
from mbody.model.joint_limits import as_described
from mbody.model.mechanism import Mechanism
from mbody.model.states import STEADY, State
from mbody.model.touching_shapes import CurveShape, Disc, Line, Ring, Segment
from mbody.quantities import Formula, FormulaError, evaluate, parse
from mbody.quantities.formula import LeftOut
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of

# -- Numbers and words, as people write them and exact to the last digit -----------------------


def alike(value: Any, default: Any) -> bool:
    """Whether a value may be left out for a default; −0 is not 0, to the last bit, and a number
    that was given is none that was left out.
    """
    left_out = isinstance(value, LeftOut) or not isinstance(default, LeftOut)
    return value == default and repr(value) == repr(default) and left_out


def word(value: Any) -> Any:
    """A word or a truth as files have it."""
    return bool(value) if isinstance(value, np.bool_) else value


def plain(value: float) -> Any:
    """A number as people write it; it reads back the same."""
    whole = value.is_integer() and abs(value) < 1e15 and not (value == 0 and str(value)[0] == "-")
    return int(value) if whole else float(value)


def short_angle(value: float) -> Any:
    """An angle [rad] in degrees where few digits give it exactly, else in radians."""
    degrees = math.degrees(value)
    for digits in range(14):
        short = round(degrees, digits)
        if math.radians(short) == value:
            return plain(short)
    return f"{value!r} rad"


# -- Tables as TOML that reads like a textbook: short tables on one line, long ones as sections

WIDTH = 100
SECTIONED = ("bodies",)  # every entry is a section of its own
INLINE = ("inputs",)  # none is: sections would come after plain entries that follow them


def toml(data: dict[str, Any]) -> str:
    """The text of a model file.

    >>> print(toml({"name": "x", "joints": {"A": {"revolute": ["ground", "arm"]}}}))
    name = "x"
    <BLANKLINE>
    [joints]
    A = { revolute = ["ground", "arm"] }
    <BLANKLINE>
    """
    top = {key: value for key, value in data.items() if not isinstance(value, dict)}
    blocks = [list(_pairs(top))]
    for section, table in data.items():
        if isinstance(table, dict):
            blocks += _section(section, table)
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _section(name: str, table: dict[str, Any]) -> Iterator[list[str]]:
    """A table, and those of its entries that are sections of their own."""
    long = {
        key: value
        for key, value in table.items()
        if isinstance(value, dict)
        and name not in INLINE
        and (name in SECTIONED or len(key) + 3 + len(_value(value)) > WIDTH)
    }
    # the order of entries is kept: from the first that is long on, all are sections
    keys = list(table)
    first = next((n for n, key in enumerate(keys) if key in long), len(keys))
    nested = [key for key in keys[first:] if isinstance(table[key], dict)]
    sections = set(nested)
    own = {key: value for key, value in table.items() if key not in sections}
    if own or not table:
        yield [f"[{name}]", *_pairs(own)]
    for key in nested:
        yield [f"[{name}.{_key(key)}]", *_pairs(table[key])]


def _pairs(table: dict[str, Any]) -> Iterator[str]:
    """Lines of keys and values, the signs of equality in one column."""
    wide = max((len(_key(key)) for key in table), default=0)
    for key, value in table.items():
        line = f"{_key(key):{wide}} = {_value(value)}"
        if len(line) > WIDTH and isinstance(value, list):
            line = f"{_key(key):{wide}} = [\n{_rows(value)}\n]"
        yield line


def _rows(values: list[Any]) -> str:
    """Entries of a long list, as many on a line as fit."""
    lines, line = [], ""
    for value in values:
        cell = _value(value) + ","
        if line and len(line) + len(cell) + 1 > WIDTH - 4:
            lines.append(line)
            line = ""
        line = f"{line} {cell}" if line else cell
    return "\n".join(f"    {line}" for line in [*lines, line])


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _text(text: str) -> str:
    """A basic string: JSON's escapes are TOML's, but for a lone DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list):
        return f"[{', '.join(_value(part) for part in value)}]"
    if isinstance(value, dict):
        inside = ", ".join(f"{_key(key)} = {_value(part)}" for key, part in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    return repr(value)


# -- Curves of a mechanism as a model file has them --------------------------------------------


class NumberWriter(Protocol):
    """Interface of a writer of the numbers of curves."""

    def text(self, formula: Formula) -> Any:
        """The text of a formula as a file has it, None where it was no text."""

    def curve_number(self, name: str, value: float, dimension: Dimension | None) -> Any:
        """A number of a curve."""


def curve_table(writer: NumberWriter, name: str, named: NamedCurve) -> dict[str, Any]:
    """The table of a curve."""
    law: Any = named.given
    if not isinstance(law, (Table, Table2)):
        raise ModelError(
            f"the curve '{name}' is a {type(law).__name__}, which a model file does not carry: "
            "give it as a Table",
            name,
        )
    dimensions = (*named.takes, named.gives)
    # beside numbers with units plain ones are ratios
    other = NUMBER if any(dimensions) else None
    measures = {key: dimension or other for key, dimension in zip("xyz", dimensions, strict=False)}
    found: dict[str, Any] = {}
    for field in dataclasses.fields(law):
        value = getattr(law, field.name)
        if field.name in measures:
            found[field.name] = _row(writer, name, value, measures[field.name])
        elif not alike(value, field.default):
            found[field.name] = word(value)
    return found


def _row(writer: NumberWriter, name: str, row: Any, dimension: Dimension | None) -> Any:
    """Numbers of a curve, text as it was written."""
    if isinstance(row, tuple):
        return [_row(writer, name, one, dimension) for one in row]
    text = writer.text(row) if isinstance(row, Formula) else None
    return writer.curve_number(name, row, dimension) if text is None else text


# -- Shapes of bodies as tables of a model file ------------------------------------------------


def shape_tables(writer: Any, body: Body) -> dict[str, Any]:
    """The shapes of a body by name; `writer` writes numbers."""
    found: dict[str, Any] = {}
    for key, shape in body.shapes.items():
        name = f"{body.name}.{key}"
        if isinstance(shape, Disc | Ring):
            kind, centre = ("disc", shape.disc) if isinstance(shape, Disc) else ("ring", shape.ring)
            radius = writer.number(f"{name}.radius", shape.radius, DIMENSIONS["length"])
            found[key] = {kind: centre, "radius": radius}
            if shape.begin is not None:
                for end, value in (("begin", shape.begin), ("end", shape.end)):
                    found[key][end] = writer.number(f"{name}.{end}", value, DIMENSIONS["angle"])
        elif isinstance(shape, Line):
            angle = writer.number(f"{name}.angle", shape.angle, DIMENSIONS["angle"])
            found[key] = {"line": {"point": shape.point, "angle": angle}}
        elif isinstance(shape, CurveShape):
            curve = shape.curve if isinstance(shape.curve, str) else list(shape.curve)
            found[key] = {"curve": curve, "point": shape.point}
        elif isinstance(shape, Segment):
            found[key] = {"segment": list(shape.segment)}
        else:
            found[key] = {"polygon": list(shape.polygon)}  # type: ignore[union-attr]  # no vertex
    return found


ANGLE = DIMENSIONS["angle"]
WORDS = {cls: word for word, cls in problems.LAWS.items()}


def save(
    mechanism: Mechanism, path: str | os.PathLike[str], *, limits: problems.Limits | None = None
) -> None:
    """Write a mechanism to a model file, TOML or (by its ending) JSON; `load` reads it back.

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
    text = _json(data) if file.suffix.lower() == ".json" else toml(data)
    try:
        raw = text.encode()
        check_size(data, len(raw), problems.limits_of(limits), file.name)
        file.write_bytes(raw)
    except OSError as error:
        raise ModelError(f"the file '{file}' cannot be written: {error.strerror}") from None
    except UnicodeEncodeError as error:
        odd = error.object[error.start]
        raise ModelError(f"the file '{file}' cannot be written: {odd!a} is no character") from None


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
        # text of plain radians reads as it is only where the file has that unit
        formulas = [
            *self.formulas.values(),
            *study_tables.requested_formulas(mechanism),
            *study_tables.task_formulas(mechanism),
            *study_tables.fit_formulas(mechanism),
        ]
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
        if machine.parameters:
            data["parameters"] = {name: self.parameter(name) for name in machine.parameters}
        if machine.curves:
            data["curves"] = {n: curve_table(self, n, one) for n, one in machine.curves.items()}
        if machine.inputs:
            data["inputs"] = {one.name: self.input(one) for one in machine.inputs}
        if machine.ground.points:
            data["ground"] = {"points": self.points(machine.ground)}
        if machine.ground.shapes:
            data["ground"]["shapes"] = shape_tables(self, machine.ground)
        data["bodies"] = {body.name: self.body(body) for body in machine.bodies}
        for section in problems.SECTIONS:
            # drivers may follow them, and loads measure them
            if section == "drivers" and machine.described_states:
                data["states"] = {one.name: self.state(one) for one in machine.described_states}
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
                data["gravity"] = self.gravity(gravity)
        data |= study_tables.questions(self)
        tasks = study_tables.task_tables(self)
        data |= {"optimize": tasks} if tasks else {}
        fitted = study_tables.fit_table(self)
        data |= {"fit": fitted} if fitted else {}
        table = study_tables.settings_table(machine)
        return data | {"report": table} if table else data

    def curve_number(self, name: str, value: Any, dimension: Dimension | None) -> Any:
        """A number of a curve that is no text."""
        number = value.value(self.scope) if isinstance(value, Formula) else value
        return plain(number)

    def wanted(self, value: Any, dimension: Dimension) -> Any:
        """A number of a question, as it was written."""
        if not isinstance(value, Formula):
            return self.written(value, dimension)
        whole = value.of(dimension)
        text = self.text(whole)
        return self.written(whole.value(self.scope), dimension) if text is None else text

    # -- elements -----------------------------------------------------------------------------

    def body(self, body: Body) -> dict[str, Any]:
        """The table of a body."""
        name = body.name
        table: dict[str, Any] = {}
        for key in ("mass", "weight"):
            if getattr(body, key) is not None:
                table[key] = self.number(f"{name}.{key}", getattr(body, key), DIMENSIONS[key])
        if not isinstance(body.inertia, LeftOut):
            table["inertia"] = self.number(f"{name}.inertia", body.inertia, DIMENSIONS["inertia"])
        if isinstance(body.cg, Polar) or not isinstance(body.cg[0], LeftOut):
            table["cg"] = self.point(f"{name}.cg", body.cg)
        if body.points:
            table["points"] = self.points(body)
        if body.shapes:
            table["shapes"] = shape_tables(self, body)
        if body.guess != Guess():
            table["guess"] = self.guess(f"{name}.guess", body.guess)
        if body.spread is not None:
            table["spread"] = self.spread(f"{name}.spread", body.spread)
        if body.section is not None:
            table["section"] = section_table(self, body)
        return table

    def points(self, body: Body) -> dict[str, Any]:
        """The named points of a body."""
        return {key: self.point(f"{body.name}.{key}", p) for key, p in body.points.items()}

    def point(self, name: str, value: Any) -> Any:
        """A pair, or distance and angle."""
        length = DIMENSIONS["length"]
        if isinstance(value, Polar):
            return {
                "r": self.number(f"{name}.r", value.r, length),
                "angle": self.number(f"{name}.angle", value.angle, ANGLE),
            }
        pairs = zip("xy", value, strict=True)
        return [self.number(f"{name}.{axis}", part, length) for axis, part in pairs]

    def guess(self, name: str, guess: Guess) -> Any:
        """A rough pose, as short as possible."""
        given = {
            key: self.number(
                f"{name}.{key}", part, ANGLE if key == "angle" else DIMENSIONS["length"]
            )
            for key in ("angle", "x", "y")
            if (part := getattr(guess, key)) is not None
        }
        return given["angle"] if set(given) == {"angle"} else given

    def spread(self, name: str, spread: Any) -> Any:
        """How the mass of a body is spread."""
        if isinstance(spread, SlenderRod):
            return {"slender": self.number(f"{name}.angle", spread.angle, ANGLE)}
        if isinstance(spread, SecondMoments):
            inertia = DIMENSIONS["inertia"]
            keys = ("xx", "yy", "xy")
            return {k: self.number(f"{name}.{k}", getattr(spread, k), inertia) for k in keys}
        return spread

    def gravity(self, element: Element) -> dict[str, Any]:
        """Components of gravity."""
        fields = {field.name: field for field in dataclasses.fields(element)}
        return {
            axis: self.field(element, fields[axis])
            for axis in ("x", "y")
            if not alike(getattr(element, axis), Constant(0.0))
            or f"{element.name}.{axis}" in self.formulas
        }

    def element(self, element: Element) -> dict[str, Any]:
        """The table of a joint, driver or load."""
        kind = problems.kind_of(element)
        if kind is None:
            raise ModelError(
                f"'{element.name}' is a {type(element).__name__}, Python code of your own, which a "
                "model file does not carry",
                element.name,
            )
        fields = {field.name: field for field in problems.written_fields(type(element))}
        main = [self.field(element, fields.pop(name)) for name in element.main]
        table: dict[str, Any] = {kind: main if len(main) > 1 else main[0]}
        for name, field in fields.items():
            value = getattr(element, name)
            given = f"{element.name}.{name}" in self.formulas
            if given or not _is_default(field, value):
                table[name] = self.field(element, field)
        assert problems.section_of(element)
        return table

    def input(self, given: Input) -> Any:
        """The law of an input, which has the dimension of its text."""
        name = f"{given.name}.value"
        dimension = given.dimension or NUMBER
        if isinstance(given.value, Constant):
            return self.open_number(name, given.value.value, given.dimension)
        return self.law(name, given.value, dimension, DIMENSIONS["time"])

    def state(self, own: State) -> dict[str, Any]:
        """The table of an auxiliary state."""
        rate: Any = self.formulas.get(f"{own.name}.rate", own.rate)
        table: dict[str, Any] = {"rate": self.rate_text(own, rate)}
        if own.start == STEADY:
            table["start"] = STEADY
        for key in ("start", "size"):
            value, name = getattr(own, key), f"{own.name}.{key}"
            if (
                isinstance(value, float) and (key, value) != ("start", 0.0)
            ) or name in self.formulas:
                table[key] = self.open_number(name, value, own.dimension)
        return table

    def rate_text(self, state: State, rate: Formula) -> Any:
        """The formula of a rate."""
        return self.law_text(rate)

    def open_number(self, name: str, value: float, dimension: Dimension | None) -> Any:
        """A number whose text tells what it measures."""
        formula = self.formulas.get(name)
        text = None if formula is None else self.text(formula)
        return self.with_unit(value, dimension) if text is None else text

    def field(self, element: Element, field: dataclasses.Field[Any]) -> Any:
        """One field of an element."""
        value, name = getattr(element, field.name), f"{element.name}.{field.name}"
        meta = field.metadata
        if "dimension" in meta:
            return self.number(name, value, dimension_of(meta["dimension"]))
        if "limits" in meta:
            dimension, ends = dimension_of(meta["limits"]), zip(ENDS, value, strict=True)
            table = {
                end: self.number(f"{name}.{end}", one, dimension)
                for end, one in ends
                if one is not None
            }
            return list(table.values()) if len(table) > 1 else table
        if "law" in meta:
            return self.law(name, value, dimension_of(meta["law"]), dimension_of(meta["of"]))
        if "place" in meta:
            return self.place(name, value)
        if "terms" in meta:
            return [self.term(element, f"{element.name}.{n}", t) for n, t in enumerate(value)]
        return word(value)

    def term(self, coupling: Any, name: str, term: CouplingTerm) -> dict[str, Any]:
        """One coordinate of a coupling."""
        dimension = DIMENSIONS[coupling.factor_of(term)]
        table: dict[str, Any] = {"factor": self.number(f"{name}.factor", term.factor, dimension)}
        if term.ends:
            kind = "distance" if term.distance else "coordinate"
            sides = zip("ij", term.ends, strict=True)
            return table | {kind: [self.place(f"{name}.{side}", end) for side, end in sides]}
        table["angle"] = term.angle
        return table if term.relative_to == "ground" else table | {"relative_to": term.relative_to}

    def place(self, name: str, marker: Marker) -> Any:
        """A place, as text where it is a named point."""
        angled = not alike(marker.angle, 0.0) or f"{name}.angle" in self.formulas
        if isinstance(marker.point, str) and not angled:
            return f"{marker.body}.{marker.point}"
        moved = {f"{name}.x", f"{name}.y"} & self.formulas.keys()
        origin = alike(marker.point, (0.0, 0.0)) and not moved
        if origin and not angled:
            return marker.body
        table: dict[str, Any] = {"body": marker.body}
        if isinstance(marker.point, str):
            table["point"] = marker.point
        elif not origin:
            table["point"] = self.point(place_name(name, marker.point), marker.point)
        if angled:
            table["angle"] = self.number(f"{name}.angle", marker.angle, ANGLE)
        return table

    # -- laws and numbers ---------------------------------------------------------------------

    def law(self, name: str, law: Any, value: Dimension, argument: Dimension) -> Any:
        """A law: a number, a formula or a table."""
        formula = self.formulas.get(name)
        if formula is not None and (formula.variable or isinstance(law, MeasuredFormula)):
            return self.law_text(formula)
        if isinstance(law, Constant):
            return self.number(name, law.value, value)
        if type(law) not in WORDS:
            raise ModelError(
                f"'{name.partition('.')[0]}' follows a {type(law).__name__} of Python, which a "
                "model file does not carry: write a formula of t, or a table",
                name.partition(".")[0],
            )
        return {WORDS[type(law)]: self.law_numbers(name, law, value, argument)}

    def law_numbers(self, name: str, law: Law, value: Dimension, argument: Dimension) -> Any:
        """The numbers of a law."""
        if isinstance(law, Polynomial):
            given = enumerate(law.coefficients)
            return [self.number(f"{name}.c{n}", c, value / argument**n) for n, c in given]
        if isinstance(law, Cam):
            segments = [
                {"dwell": self.number(f"{name}.segments.{n}.duration", segment.duration, argument)}
                if isinstance(segment, Dwell)
                else {"rise": self.law_numbers(f"{name}.segments.{n}", segment, value, argument)}
                for n, segment in enumerate(law.segments)
            ]
            return {
                "segments": segments,
                "period": self.number(f"{name}.period", law.period, argument),
            }
        table: dict[str, Any] = {}
        for field in dataclasses.fields(law):
            own = getattr(law, field.name)
            powers = field.metadata.get("powers")
            if _is_default(field, own) and f"{name}.{field.name}" not in self.formulas:
                continue
            if powers and isinstance(own, tuple):
                place, dimension = f"{name}.{field.name}", dimension_by(powers, value, argument)
                row = enumerate(own)
                table[field.name] = [self.number(f"{place}.{n}", v, dimension) for n, v in row]
            elif powers:
                dimension = dimension_by(powers, value, argument)
                table[field.name] = self.number(f"{name}.{field.name}", own, dimension)
            else:
                table[field.name] = word(own)
        return table

    def number(self, name: str, value: float, dimension: Dimension) -> Any:
        """The text that a number was made of, else the number."""
        formula = self.formulas.get(name)
        text = None if formula is None else self.text(formula)
        return self.written(value, dimension) if text is None else text

    def law_text(self, formula: Formula) -> Any:
        """The text of a formula of the variable."""
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


def _is_default(field: dataclasses.Field[Any], value: Any) -> bool:
    if isinstance(value, Constant) and isinstance(field.default, float):
        return alike(value.value, field.default)
    return field.default is not dataclasses.MISSING and alike(value, field.default)
