"""A mechanism as a model file: the same tables that `read` takes, as TOML or JSON.

What was written as text stays text. A float comes back to the last digit: angles are written in
degrees where the degrees are short, else with their unit in radians.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
from pathlib import Path
from typing import Any

from mbody.errors import ModelError
from mbody.files.model.cells import alike, plain, short_angle, word
from mbody.files.model.fit_table import fit_formulas, fit_table
from mbody.files.model.kinds import LAWS, SECTIONS, kind_of, section_of, written_fields
from mbody.files.model.limits import Limits, limits_of
from mbody.files.model.optimize_table import task_formulas, task_tables
from mbody.files.model.read import check_size
from mbody.files.model.report_table import settings_table
from mbody.files.model.section_fields import section_table
from mbody.files.model.toml import toml
from mbody.files.model.write_curves import curve_table
from mbody.files.model.write_shapes import shape_tables
from mbody.files.model.write_studies import questions, requested_formulas
from mbody.laws import Cam, Constant, Dwell, Law, MeasuredFormula, Polynomial
from mbody.laws.base import dimension_by
from mbody.model.body import Body, Guess, SecondMoments, SlenderRod
from mbody.model.coupling import CouplingTerm
from mbody.model.element import ENDS, Element, Marker, Polar, place_name
from mbody.model.inputs import Input
from mbody.model.joint_contacts import as_described
from mbody.model.mechanism import Mechanism
from mbody.model.states import STEADY, State
from mbody.quantities import Formula, FormulaError, evaluate, parse
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of

__all__ = ["Writer", "as_data", "save", "to_json", "to_toml"]

ANGLE = DIMENSIONS["angle"]
WORDS = {cls: word for word, cls in LAWS.items()}


def save(
    mechanism: Mechanism, path: str | os.PathLike[str], *, limits: Limits | None = None
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
        check_size(data, len(raw), limits_of(limits), file.name)
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
            *requested_formulas(mechanism),
            *task_formulas(mechanism),
            *fit_formulas(mechanism),
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
        return self.valued(name) if text is None else text

    def valued(self, name: str) -> Any:
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
        if machine.g != machine.units.g:
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
        for section in SECTIONS:
            # drivers may follow them, and loads measure them
            if section == "drivers" and machine.described_states:
                data["states"] = {one.name: self.state(one) for one in machine.described_states}
            elements = getattr(machine, section)
            if section == "contacts":
                elements = (*elements, *machine.groups)
            # the section of gravity is the last of the loads
            apart = next((e for e in elements[-1:] if _is_gravity(e)), None)
            table = {e.name: self.element(e) for e in elements if e is not apart}
            if table:
                data[section] = table
            if apart is not None:
                data["gravity"] = self.gravity(apart)
        data |= questions(self)
        tasks = task_tables(self)
        data |= {"optimize": tasks} if tasks else {}
        fitted = fit_table(self)
        data |= {"fit": fitted} if fitted else {}
        table = settings_table(machine)
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
        if not alike(body.inertia, 0.0) or f"{name}.inertia" in self.formulas:
            table["inertia"] = self.number(f"{name}.inertia", body.inertia, DIMENSIONS["inertia"])
        if (
            not alike(body.cg, (0.0, 0.0))
            or {f"{name}.cg.x", f"{name}.cg.y"} & self.formulas.keys()
        ):
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
        kind = kind_of(element)
        if kind is None:
            raise ModelError(
                f"'{element.name}' is a {type(element).__name__}, Python code of your own, which a "
                "model file does not carry",
                element.name,
            )
        fields = {field.name: field for field in written_fields(type(element))}
        main = [self.field(element, fields.pop(name)) for name in element.main]
        table: dict[str, Any] = {kind: main if len(main) > 1 else main[0]}
        for name, field in fields.items():
            value = getattr(element, name)
            given = f"{element.name}.{name}" in self.formulas
            if given or not _is_default(field, value):
                table[name] = self.field(element, field)
        assert section_of(element)
        return table

    def input(self, given: Input) -> Any:
        """The law of an input, which has the dimension of its text."""
        name = f"{given.name}.value"
        dimension = given.dimension or NUMBER
        if isinstance(given.value, Constant):
            return self.open_number(name, given.value.value, given.dimension)
        return self.law(name, given.value, dimension, DIMENSIONS["time"])

    def state(self, own: State) -> dict[str, Any]:
        """The table of an own state."""
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

    def law(self, name: str, law: Any, value: Dimension, of: Dimension) -> Any:
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
        return {WORDS[type(law)]: self.law_numbers(name, law, value, of)}

    def law_numbers(self, name: str, law: Law, value: Dimension, of: Dimension) -> Any:
        """The numbers of a law."""
        if isinstance(law, Polynomial):
            given = enumerate(law.coefficients)
            return [self.number(f"{name}.c{n}", c, value / of**n) for n, c in given]
        if isinstance(law, Cam):
            segments = [
                {"dwell": self.number(f"{name}.segments.{n}.duration", segment.duration, of)}
                if isinstance(segment, Dwell)
                else {"rise": self.law_numbers(f"{name}.segments.{n}", segment, value, of)}
                for n, segment in enumerate(law.segments)
            ]
            return {"segments": segments, "period": self.number(f"{name}.period", law.period, of)}
        table: dict[str, Any] = {}
        for field in dataclasses.fields(law):
            own = getattr(law, field.name)
            powers = field.metadata.get("powers")
            if _is_default(field, own) and f"{name}.{field.name}" not in self.formulas:
                continue
            if powers and isinstance(own, tuple):
                place, dimension = f"{name}.{field.name}", dimension_by(powers, value, of)
                row = enumerate(own)
                table[field.name] = [self.number(f"{place}.{n}", v, dimension) for n, v in row]
            elif powers:
                dimension = dimension_by(powers, value, of)
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


def _is_gravity(element: Element) -> bool:
    return kind_of(element) == element.name == "gravity"


def _is_default(field: dataclasses.Field[Any], value: Any) -> bool:
    if isinstance(value, Constant) and isinstance(field.default, float):
        return alike(value.value, field.default)
    return field.default is not dataclasses.MISSING and alike(value, field.default)
