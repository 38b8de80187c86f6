"""Fields of a model file, each declared once: a codec reads, writes and describes it.

What is read is what the description takes: a float, a `Formula`, a `Marker`. Plain angles are in
the unit of the file. A codec that refuses a value says so to `Reading` and returns `REFUSED`.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol, get_args

import numpy as np

from mbody.errors import ModelError, brief
from mbody.files.model.problems import ENOUGH, LAWS, KeyPath, Problem, example, short, unknown_key
from mbody.laws import (
    SHAPES,
    Constant,
    Dwell,
    Law,
    MeasuredFormula,
    Polynomial,
    Rise,
    Table,
    Table2,
)
from mbody.laws.base import dimension_by
from mbody.laws.table import End, Interpolation, Outside
from mbody.model.body import (
    Guess,
    RectangleSection,
    RoundSection,
    SecondMoments,
    SlenderRod,
    TubeSection,
)
from mbody.model.element import ENDS, Marker, Polar, check_name, place_name
from mbody.model.touching_shapes import CurveShape, Disc, Line, Polygon, Ring, Segment
from mbody.quantities import Formula, FormulaError, read
from mbody.quantities.formula import LeftOut, NotANumber, NotFinite, float_or_formula
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, dimension_of, name_of

if TYPE_CHECKING:
    from mbody.model.coupling import CouplingTerm
    from mbody.model.mechanism import Mechanism

# -- What reads, writes and describes ----------------------------------------------------------

ANGLE, LENGTH = DIMENSIONS["angle"], DIMENSIONS["length"]
#: What a codec returns of a value that it has refused.
REFUSED: Any = object()
#: A default that nothing is like: the field is always written.
ALWAYS: Any = object()


class FileReading:
    """State of reading a file: unit of plain angles, folder of the file, and what was refused."""

    def __init__(self, angle: str = "deg", folder: Path | None = None) -> None:
        self.angle, self.folder = angle, folder
        self.problems: list[Problem] = []
        #: How many there are, with those that are not reported.
        self.count = 0
        #: By path what read a number or a word of choice, and what it is; None where nobody asks.
        self.entries: dict[KeyPath, tuple[Codec, Any]] | None = None

    def note(self, path: KeyPath, codec: Codec, value: Any) -> Any:
        """A number or a word that has been read."""
        if self.entries is not None:
            self.entries[path] = codec, value
        return value

    def refuse(self, path: KeyPath, sentence: str | Callable[[], str]) -> Any:
        """Note what is wrong; a sentence that takes time is made only where it is reported."""
        self.count += 1
        if len(self.problems) < ENOUGH:
            text = sentence if isinstance(sentence, str) else sentence()
            self.problems.append(Problem(path, text))
        return REFUSED

    def wrong(self, path: KeyPath, must: str, given: Any) -> Any:
        """Refuse a value that is of another kind than it must be."""
        return self.refuse(path, f"{must}, not {short(repr(given))}{example(path)}")


def alike(value: Any, default: Any) -> bool:
    """Whether a value may be left out for a default; −0 is not 0, to the last bit, and a number
    that was given is none that was left out.
    """
    if isinstance(value, Constant) and isinstance(default, float):
        value = value.value
    if isinstance(default, tuple) and isinstance(value, tuple) and len(value) == len(default):
        return all(map(alike, value, default))
    left_out = isinstance(value, LeftOut) or not isinstance(default, LeftOut)
    return bool(value == default) and repr(value) == repr(default) and left_out


def plain(value: float) -> Any:
    """A number as people write it; it reads back the same."""
    whole = value.is_integer() and abs(value) < 1e15 and not (value == 0 and str(value)[0] == "-")
    return int(value) if whole else float(value)


class NumberWriter(Protocol):
    """What writes the numbers of a mechanism to a file."""

    mechanism: Mechanism
    formulas: dict[str, Formula]

    def number(self, name: str, value: float, dimension: Dimension) -> Any:
        """A number of the mechanism: the text that it was made of, else the number."""

    def wanted(self, value: Any, dimension: Dimension) -> Any:
        """A number of a study, as it was written."""

    def text(self, formula: Formula) -> Any:
        """The text of a formula, None where it was none."""

    def law_text(self, formula: Formula, name: str, measured: bool) -> Any:
        """The text of a formula of a variable, or of measured quantities."""

    def curve_number(self, name: str, value: Any, dimension: Dimension | None) -> Any:
        """A number of a curve that is no text."""


class Codec:
    """One kind of value of a file."""

    def takes(self) -> str:
        """What is written there, in words."""
        return "see below"

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        """What the description takes of a value at a path of the file."""
        raise NotImplementedError

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        """A value as the file has it; `name` is that of its numbers."""
        return bool(value) if isinstance(value, np.bool_) else value

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        """JSON Schema; tables are among `defs`."""
        raise NotImplementedError

    def settled(self, value: Any, machine: Mechanism, angle: str) -> Any:
        """What was read where dimensions follow from the mechanism; `angle`: unit of the file."""
        return value


class Wrapper(Codec):
    """A codec that does by another what it does not do itself."""

    inner: Codec

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        return self.inner.read(given, path, at)

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return self.inner.write(to, name, value)

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        return self.inner.schema(defs)


@dataclass(frozen=True)
class PlainCodec(Codec):
    """Text, a truth, a whole or a real number without unit."""

    kinds: tuple[type, ...]
    json: str
    must: str
    words: str

    def takes(self) -> str:
        return self.words

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        right = isinstance(given, self.kinds) and (bool in self.kinds) == isinstance(given, bool)
        if right and self.json == "number":
            try:
                return float(given)
            except OverflowError:
                right = False
        return at.note(path, self, given) if right else at.wrong(path, self.must, given)

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        return {"type": self.json}


TEXT = PlainCodec((str,), "string", "must be text", "text")
BODY = PlainCodec((str,), "string", "must be text", "the name of a body")
FLAG = PlainCodec((bool,), "boolean", "must be true or false", "true or false")
WHOLE = PlainCodec((int,), "integer", "must be a whole number", "a whole number")
REAL = PlainCodec((int, float), "number", "must be a number", "a number")


@dataclass(frozen=True)
class WordCodec(Codec):
    """One of some words; `must` says of what else it may be instead."""

    words: tuple[str, ...]
    must: str = ""

    def takes(self) -> str:
        return " or ".join(f'"{one}"' for one in self.words)

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if isinstance(given, str) and given in self.words:
            return at.note(path, self, given)
        if self.must:
            return at.wrong(path, self.must, given)
        *first, last = map(repr, self.words)
        known = f"{', '.join(first)} or {last}" if first else last
        return at.refuse(path, f"must be {known}, not {brief(given, 40)}")

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        only = {"const": self.words[0]} if len(self.words) == 1 else {"enum": [*self.words]}
        return {**only, "type": "string"}


def entered_in(
    value: Any, dimension: Dimension | None, angle: str, *, curves: bool = False
) -> float | Formula:
    """One number of a file: a float, or a formula where it is text; `curves` as of `parse`."""
    try:
        result = (
            read(value, dimension, angle, curves=curves)
            if isinstance(value, str)
            else float_or_formula(value, dimension)
        )
    except NotANumber:
        raise ModelError(f"must be a number or text such as '2 mm', not {brief(value)}") from None
    except NotFinite as error:
        raise ModelError(f"is {error}, it must be finite") from None
    except FormulaError as error:
        raise ModelError(str(error)) from None
    is_angle = angle == "deg" and isinstance(result, float) and dimension == ANGLE
    return math.radians(result) if is_angle and isinstance(result, float) else result


def unit_words(dimension: Dimension) -> str:
    """The unit of a dimension in a reference, in SI."""
    from mbody.quantities.units import unit_system

    if dimension == NUMBER:
        return "without a unit"
    if dimension == ANGLE:
        return "angle [deg in files, rad in Python]"
    return f"{name_of(dimension)} [{unit_system('SI').of(dimension)}]"


@dataclass(frozen=True)
class NumberCodec(Codec):
    """A number of a dimension, None for any: plain, or text with units and parameters.

    `varies`: Whether it may be a formula of time or of another variable.
    `word`: A word that may stand for it.
    """

    dimension: Dimension | None = None
    varies: bool = False
    word: str = ""

    def takes(self) -> str:
        return "a number" + (f", {unit_words(self.dimension)}" if self.dimension else "")

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if len(at.problems) >= ENOUGH:  # too much else is wrong: this is not reported
            return at.refuse(path, "unread")
        if self.word and given == self.word:
            return at.note(path, self, given)
        try:
            found = entered_in(given, self.dimension, at.angle, curves=self.varies)
        except ModelError as error:
            return at.refuse(path, str(error))
        if isinstance(found, Formula) and found.variable and not self.varies:
            return at.refuse(path, f"is {brief(found.text)}, but only a law may change with time")
        return at.note(path, self, found)

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        dimension = self.dimension or NUMBER
        if isinstance(value, Formula):
            return to.wanted(value, dimension)
        return to.number(name, value, dimension)

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        about = name_of(self.dimension) if self.dimension else ""
        about = f'number with its unit, or "{self.word}"' if self.word else about or "number"
        return {"type": ["number", "string"], "description": about}


def quantity(dimension: str) -> NumberCodec:
    """A number of that dimension."""
    return NumberCodec(dimension_of(dimension))


class FormulaText(NumberCodec):
    """A formula of measured quantities, which is read when all is there that it measures."""

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        found = NumberCodec(varies=True).read(given, path, at)
        return given if isinstance(given, str) and found is not REFUSED else found

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        return {"type": ["number", "string"], "description": "formula"}


@dataclass(frozen=True)
class RowCodec(Codec):
    """So many values of kinds of their own; `names` are those of their numbers."""

    items: tuple[Codec, ...]
    names: tuple[str, ...] = ()

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if not isinstance(given, (list, tuple)):
            return at.wrong(path, "must be a list", given)
        if len(given) != len(self.items):
            return at.wrong(path, f"must be a list of {len(self.items)}", given)
        found = [item.read(given[n], (*path, n), at) for n, item in enumerate(self.items)]
        return REFUSED if any(one is REFUSED for one in found) else tuple(found)

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        parts = zip(self.items, self.names or range(len(value)), value, strict=True)
        return [one.write(to, f"{name}.{own}", v) for one, own, v in parts]

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        count = len(self.items)
        items = [one.schema(defs) for one in self.items]
        return {"type": "array", "prefixItems": items, "minItems": count, "maxItems": count}


@dataclass(frozen=True)
class ListCodec(Codec):
    """Values of one kind.

    `alone`: Whether one may stand without a list.
    """

    item: Codec
    alone: bool = False

    def takes(self) -> str:
        return "a list"

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if not isinstance(given, (list, tuple)):
            if not self.alone:
                return at.wrong(path, "must be a list", given)
            if not isinstance(given, str):
                return at.wrong(path, "must be text or a list of texts", given)
            return self.item.read(given, path, at)
        found = [self.item.read(one, (*path, n), at) for n, one in enumerate(given)]
        return REFUSED if any(one is REFUSED for one in found) else tuple(found)

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return [self.item.write(to, f"{name}.{n}", one) for n, one in enumerate(value)]

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        item = self.item.schema(defs)
        several = {"type": "array", "items": item}
        return {"oneOf": [item, several]} if self.alone else several


@dataclass(frozen=True)
class ByName(Codec):
    """Values of one kind by name; `elements` are names as elements have."""

    item: Codec
    elements: bool = True

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if not isinstance(given, dict):
            return at.wrong(path, "must be a table", given)
        found = {}
        sound = True
        for name, value in given.items():
            if self.elements:
                try:
                    check_name(name, "element")
                except ModelError as error:
                    sound = False
                    at.refuse((*path, name), str(error))
            found[name] = self.item.read(value, (*path, name), at)
            sound = sound and found[name] is not REFUSED
        return found if sound else REFUSED

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return {key: self.item.write(to, f"{name}.{key}", one) for key, one in value.items()}

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        return {"type": "object", "additionalProperties": self.item.schema(defs)}


@dataclass(frozen=True)
class Form:
    """One form that a field may have: `when` what was written is of these types or, of tables, has
    this key; values of the types `of` are written so.
    """

    when: tuple[type, ...] | str
    codec: Codec
    of: tuple[type, ...] = ()

    def fits(self, given: Any) -> bool:
        """Whether a value of a file has that form."""
        if isinstance(self.when, str):
            return isinstance(given, dict) and self.when in given
        return isinstance(given, self.when) and not isinstance(given, bool)


@dataclass(frozen=True)
class Forms(Codec):
    """A field of several forms."""

    must: str
    forms: tuple[Form, ...]
    words: str = "see below"

    def takes(self) -> str:
        return self.words

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        for form in self.forms:
            if form.fits(given):
                return form.codec.read(given, path, at)
        return at.wrong(path, self.must, given)

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        form = next(form for form in self.forms if isinstance(value, form.of))
        return form.codec.write(to, name, value)

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        return {"oneOf": [form.codec.schema(defs) for form in self.forms]}


@dataclass(frozen=True)
class Key:
    """A key of a table.

    `default`: Of the value; what is like it is not written.
    `of`: The attribute, or attributes, of the value that it gives, by default that of its name;
      "" for the value itself.
    """

    codec: Codec
    about: str = ""
    needed: bool = False
    default: Any = None
    of: str | tuple[str, ...] | None = None


@dataclass(frozen=True, eq=False)
class TableCodec(Codec):
    """A table with known keys, of which `make` makes the value, where there is one to make."""

    title: str
    about: str
    keys: Mapping[str, Key]
    make: Callable[..., Any] | None = None
    #: What else its schema says.
    more: Mapping[str, Any] = field(default_factory=dict)

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if not isinstance(given, dict):
            return at.wrong(path, "must be a table", given)
        found: dict[str, Any] = {}
        sound = True
        for key, one in self.keys.items():
            if key in given:
                value = one.codec.read(given[key], (*path, key), at)
                sound = sound and value is not REFUSED
                if isinstance(one.of, tuple) and sound:
                    found |= zip(one.of, value, strict=True)
                else:
                    found[str(one.of or key)] = value
            elif one.needed:
                sound = False
                at.refuse((*path, key), "is missing: give it")
        for key in given:
            if key not in self.keys:
                sound = False
                at.refuse((*path, key), lambda k=key: unknown_key(k, [*self.keys], given, path))
        if not sound:
            return REFUSED
        return found if self.make is None else made(self.make, found, path, at)

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        table = {}
        for key, one in self.keys.items():
            own = one.of if one.of is not None else key
            several = isinstance(own, tuple)
            part: Any = tuple(getattr(value, each) for each in own) if several else value
            of = f"{name}.{own}" if own and not several else name
            if own and not several:
                part = getattr(value, own, None)
            if part is not None and (of in to.formulas or not alike(part, one.default)):
                table[key] = one.codec.write(to, of, part)
        return table

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        title = re.sub(r"\W", "_", self.title)
        if title not in defs:
            defs[title] = {}  # of what refers to itself
            defs[title] = self._table(defs)
        return {"$ref": f"#/$defs/{title}"}

    def _table(self, defs: dict[str, Any]) -> dict[str, Any]:
        own = {key: one.codec.schema(defs) for key, one in self.keys.items()}
        for key, one in self.keys.items():
            own[key] |= {"description": one.about} if one.about else {}
        needed = [key for key, one in self.keys.items() if one.needed]
        table = {"type": "object", "description": self.about, "additionalProperties": False}
        table |= {"properties": own, **self.more}
        return table | ({"required": needed} if needed else {})

    def settled(self, value: Any, machine: Mechanism, angle: str) -> Any:
        return {k: self.keys[k].codec.settled(v, machine, angle) for k, v in value.items()}


def made(make: Callable[..., Any], found: Any, path: KeyPath, at: FileReading) -> Any:
    """What is made of the fields of a table."""
    try:
        return make(**found)
    except ModelError as error:
        return at.refuse(path, str(error))


@dataclass(frozen=True)
class NamedNumbers(Wrapper):
    """Numbers of a mechanism by name, each in the dimension that it has there: one, a pair of
    bounds, or one or several.
    """

    of: Callable[[Mechanism, str], Dimension]
    each: Literal["one", "pair", "several"] = "one"

    @property
    def inner(self) -> ByName:  # type: ignore[override]  # read only
        """By name numbers without a dimension."""
        one, several = NumberCodec(), ListCodec(NumberCodec())
        forms = Form((int, float, str), one), Form((list,), several)
        either = Forms("must be a number, text or a list", forms)
        return ByName({"one": one, "pair": several}.get(self.each, either), elements=False)

    def settled(self, value: Any, machine: Mechanism, angle: str) -> Any:
        for name, pair in value.items():
            if self.each == "pair" and len(pair) != 2:
                raise ModelError(f"by.{name} must be [low, high], not of {len(pair)} values", name)
        return {
            name: in_radians(one, angle == "deg" and self.of(machine, name) == ANGLE)
            for name, one in value.items()
        }

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        table: dict[str, Any] = {}
        for key, given in value.items():
            dimension = self.of(to.mechanism, key)
            if isinstance(given, tuple):
                row = [to.wanted(one, dimension) for one in given]
                table[key] = row[0] if self.each != "pair" and len(row) == 1 else row
            else:
                table[key] = to.wanted(given, dimension)
        return table


def in_radians(value: Any, degrees: bool) -> Any:
    """Plain degrees of a number or a row as radians."""
    if isinstance(value, tuple):
        return tuple(in_radians(one, degrees) for one in value)
    return math.radians(value) if degrees and isinstance(value, float) else value


# -- Points, places, shapes and sections -------------------------------------------------------

LENGTHS, ANGLES = NumberCodec(LENGTH), NumberCodec(ANGLE)


_PAIR = Form((list, tuple), RowCodec((LENGTHS, LENGTHS), ("x", "y")), (tuple,))
_POLAR = Form(
    (dict,),
    TableCodec(
        "PolarIn",
        "A point by distance and angle in link axes.",
        {"r": Key(LENGTHS, needed=True), "angle": Key(ANGLES, needed=True)},
        Polar,
    ),
    (Polar,),
)
POINT = Forms("must be [x, y] or { r = …, angle = … }", (_PAIR, _POLAR), "[x, y], length [m]")


class Points(ByName):
    """Points by name, whose numbers are called by their body and them."""

    def takes(self) -> str:
        return "points by name, each [x, y] or { r = …, angle = … }"

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        return super().write(to, name.rpartition(".")[0], value)


POINTS = Points(POINT)


class PlaceCodec(Forms):
    """A place on a body with a direction, written as text where it is a named point."""

    def write(self, to: NumberWriter, name: str, value: Marker) -> Any:
        angled = not alike(value.angle, 0.0) or f"{name}.angle" in to.formulas
        if isinstance(value.point, str) and not angled:
            return f"{value.body}.{value.point}"
        moved = {f"{name}.x", f"{name}.y"} & to.formulas.keys()
        origin = alike(value.point, (0.0, 0.0)) and not moved
        if origin and not angled:
            return value.body
        table: dict[str, Any] = {"body": value.body}
        if not origin:
            own: Any = value.point
            named = own if isinstance(own, str) else place_name(name, own)
            table["point"] = _POINT.write(to, named, own)
        if angled:
            table["angle"] = ANGLES.write(to, f"{name}.angle", value.angle)
        return table


_POINT = Forms(
    "must be the name of a point, [x, y] or { r = …, angle = … }",
    (Form((str,), TEXT, (str,)), _PAIR, _POLAR),
)
PLACE = PlaceCodec(
    'must be a place: "crank.A", or { body = "crank", point = …, angle = … }',
    (
        Form((str,), TEXT),
        Form(
            (dict,),
            TableCodec(
                "PlaceIn",
                "A place on a body with a direction.",
                {"body": Key(TEXT, needed=True), "point": Key(_POINT), "angle": Key(ANGLES)},
                lambda body, point=(0.0, 0.0), angle=0.0: Marker(body, point, angle),
            ),
        ),
    ),
    'a place, as "crank.A", or { body = "ground", point = [1, 0], angle = 30 }',
)


class LimitsCodec(Forms):
    """The least and the greatest value of a coordinate: a pair, or a table where one is missing."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        given = {end: one for end, one in zip(ENDS, value, strict=True) if one is not None}
        keys: Any = self.forms[1].codec
        table = {k: keys.keys[k].codec.write(to, f"{name}.{k}", one) for k, one in given.items()}
        return list(table.values()) if len(table) > 1 else table


def ends(dimension: Dimension) -> LimitsCodec:
    """Limits of that dimension."""
    one = NumberCodec(dimension)
    table = TableCodec(
        f"LimitsIn {name_of(dimension)}",
        "Limits of a coordinate, of which one may be missing.",
        dict.fromkeys(ENDS, Key(one)),
        lambda low=None, high=None: (low, high),
    )
    return LimitsCodec(
        "must be [low, high], or { low = … } or { high = … }",
        (Form((list, tuple), RowCodec((one, one))), Form((dict,), table)),
        f"a pair of numbers, {unit_words(dimension)}",
    )


def _coupling_term(**given: Any) -> CouplingTerm:
    from mbody.model.coupling import CouplingTerm

    return CouplingTerm(**given)


class Terms(ListCodec):
    """Coordinates of a coupling with their factors."""

    table = TableCodec(
        "TermIn",
        "One coordinate of a coupling with its factor.",
        {
            "factor": Key(NumberCodec(), needed=True),
            "angle": Key(TEXT),
            "relative_to": Key(TEXT),
            "distance": Key(RowCodec((PLACE, PLACE))),
            "coordinate": Key(RowCodec((PLACE, PLACE))),
        },
        _coupling_term,
    )

    def takes(self) -> str:
        return "a list of terms"

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        coupling = name.partition(".")[0]
        return [self._term(to, f"{coupling}.{n}", term) for n, term in enumerate(value)]

    def _term(self, to: NumberWriter, name: str, term: CouplingTerm) -> dict[str, Any]:
        coupling: Any = to.mechanism[name.partition(".")[0]]
        dimension = DIMENSIONS[coupling.factor_of(term)]
        table: dict[str, Any] = {"factor": to.number(f"{name}.factor", term.factor, dimension)}
        if term.ends:
            kind = "distance" if term.distance else "coordinate"
            sides = zip("ij", term.ends, strict=True)
            return table | {kind: [PLACE.write(to, f"{name}.{side}", end) for side, end in sides]}
        table["angle"] = term.angle
        return table if term.relative_to == "ground" else table | {"relative_to": term.relative_to}


class Guesses(Forms):
    """A rough first pose of the link axes, written as short as possible."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        table = self.forms[-1].codec.write(to, name, value)
        return table["angle"] if set(table) == {"angle"} else table


GUESS = Guesses(
    "must be an angle, [x, y, angle] or { angle = …, x = …, y = … }",
    (
        Form((int, float, str), ANGLES),
        Form((list, tuple), RowCodec((LENGTHS, LENGTHS, ANGLES))),
        Form(
            (dict,),
            TableCodec(
                "GuessIn",
                "A rough first pose of the link axes.",
                {"angle": Key(ANGLES), "x": Key(LENGTHS), "y": Key(LENGTHS)},
                Guess,
            ),
        ),
    ),
    "an angle, or { x = …, y = …, angle = … }",
)
_INERTIA = quantity("inertia")
_SPREADS = '"point", { slender = angle } or { xx = …, yy = …, xy = … }'
SPREAD = Forms(
    f"must be {_SPREADS}",
    (
        Form((str,), WordCodec(("point",), f"must be {_SPREADS}"), (str,)),
        Form(
            "slender",
            TableCodec(
                "SlenderIn",
                "Mass along a line.",
                {"slender": Key(ANGLES, needed=True, default=ALWAYS, of="angle")},
                SlenderRod,
            ),
            (SlenderRod,),
        ),
        Form(
            (dict,),
            TableCodec(
                "SecondMomentsIn",
                "Second moments of mass about the mass centre, link axes.",
                {
                    "xx": Key(_INERTIA, needed=True, default=ALWAYS),
                    "yy": Key(_INERTIA, needed=True, default=ALWAYS),
                    "xy": Key(_INERTIA, default=ALWAYS),
                },
                SecondMoments,
            ),
            (SecondMoments,),
        ),
    ),
    _SPREADS,
)


def _circle(word: str, cls: type, about: str) -> Form:
    keys = {
        word: Key(TEXT, needed=True),
        "radius": Key(LENGTHS, needed=True),
        "begin": Key(ANGLES),
        "end": Key(ANGLES),
    }
    return Form(word, TableCodec(f"{cls.__name__}In", about, keys, cls), (cls,))


_ABOUT_LINE = "A point of an endless line, and its direction; what touches it is on its left."
_ABOUT_CURVE = (
    "A smooth curve from a point, touched on its left: a named curve y(x), or two, x and y."
)
_STRAIGHT = TableCodec(
    "StraightIn",
    _ABOUT_LINE,
    {"point": Key(TEXT, needed=True), "angle": Key(ANGLES, default=ALWAYS)},
    Line,
)
_NAMES = Forms(
    "must be the name of a curve, or two",
    (Form((str,), TEXT, (str,)), Form((list, tuple), RowCodec((TEXT, TEXT)), (tuple,))),
)
SHAPE = Forms(
    "must be a shape: { disc = point, radius = … }, { ring = point, radius = … }, "
    "{ segment = [A, B] }, { polygon = [A, B, C] }, { line = { point = … } } or "
    "{ curve = name, point = … }",
    (
        _circle(
            "disc",
            Disc,
            "A full circle about a point, or the arc from begin to end, counter-clockwise.",
        ),
        _circle(
            "ring",
            Ring,
            "A hollow circle about a point, or an arc of it, touched from within.",
        ),
        Form(
            "line",
            TableCodec(
                "LineIn",
                "An endless straight line.",
                {"line": Key(_STRAIGHT, needed=True, of="")},
                lambda line: line,
            ),
            (Line,),
        ),
        Form(
            "segment",
            TableCodec(
                "SegmentIn",
                "A straight line between two points, touched on its left.",
                {"segment": Key(RowCodec((TEXT, TEXT)), needed=True)},
                Segment,
            ),
            (Segment,),
        ),
        Form(
            "polygon",
            TableCodec(
                "PolygonIn",
                "A full polygon by its corners.",
                {"polygon": Key(ListCodec(TEXT), needed=True)},
                Polygon,
            ),
            (Polygon,),
        ),
        Form(
            "curve",
            TableCodec(
                "CurveShapeIn",
                _ABOUT_CURVE,
                {"curve": Key(_NAMES, needed=True), "point": Key(TEXT, needed=True)},
                CurveShape,
            ),
            (CurveShape,),
        ),
    ),
)


class Shapes(Points):
    """Shapes by name."""

    def takes(self) -> str:
        return "shapes by name: disc, ring, line, segment, polygon, curve"


SHAPES_OF_BODY = Shapes(SHAPE)


def _section(word: str, cls: Any, about: str) -> Form:
    """A section; the bar goes along two points, without them from joint to joint."""
    several = len(cls.sizes) > 1
    of = cls.sizes if several else cls.sizes[0]
    sizes = RowCodec((LENGTHS, LENGTHS), cls.sizes) if several else LENGTHS
    keys = {
        word: Key(sizes, needed=True, of=of),
        "along": Key(RowCodec((TEXT, TEXT)), default=()),
    }
    return Form(word, TableCodec(f"{cls.__name__}In", about, keys, cls), (cls,))


SECTION = Forms(
    "must be { rectangle = [height, thickness] }, { tube = [outer, inner] } or "
    "{ round = diameter }",
    (
        _section("rectangle", RectangleSection, "Height in the plane, thickness across it."),
        _section("tube", TubeSection, "Outer and inner diameter."),
        _section("round", RoundSection, "Diameter."),
    ),
    "{ rectangle = [height, thickness] }, { tube = [outer, inner] } or { round = diameter }, "
    "with along = [point, point] where joints do not say it",
)


# -- Tables of numbers, which may be in a file beside the model ---------------------------------


class Columns(Codec):
    """The first two columns of a file beside the model, numbers of these dimensions."""

    def __init__(self, dimensions: tuple[Dimension | None, Dimension | None]) -> None:
        self.dimensions = dimensions

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if not isinstance(given, str):
            return TEXT.read(given, path, at)
        from mbody.files.model.csv_columns import columns

        def rows() -> list[list[Any]]:
            """When the table is made, whose path an error has."""
            pairs = zip(columns(given, at.folder), self.dimensions, strict=True)
            return [[entered_in(v, one, at.angle) for v in row] for row, one in pairs]

        return rows

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        return TEXT.schema(defs)


def tabulated(**fields: Any) -> Table | Table2:
    """A table of points, of one variable or of two."""
    file = fields.pop("file", None)
    if file is not None:
        if {"x", "y", "z"} & fields.keys():
            raise ModelError("give x and y, or the file that has them, not both")
        fields |= zip("xy", file(), strict=True)
    if "x" not in fields or "y" not in fields:
        raise ModelError("needs both x and y, or the file that has them")
    if "z" not in fields:
        return Table(**fields)
    for key in ("end", "periodic"):
        if key in fields:
            raise ModelError(f"has z, of two variables, and {key}, which only one has: leave out")
    return Table2(**fields)


# -- LawCodec: a number, a formula, or a table with one kind of law --------------------------------

WORDS = {cls: word for word, cls in LAWS.items()}


def first_paragraph(cls: type) -> str:
    """The first paragraph of a docstring as one line."""
    return " ".join((cls.__doc__ or "").split("\n\n")[0].split())


def _title(kind: str, dimension: Dimension | None, argument: Dimension) -> str:
    """Of a table in the schema."""
    called = "any quantity" if dimension is None else name_of(dimension)
    return f"{kind}: {called} of {name_of(argument)}"


def numbers_of_law(cls: type, dimension: Dimension | None, argument: Dimension) -> Codec:
    """What reads and writes one kind of law, whose values and argument have these dimensions; None
    for any.
    """
    if cls is Polynomial:
        return Coefficients(dimension, argument)
    keys = {}
    for part in dataclasses.fields(cls):
        missing = part.default is dataclasses.MISSING
        codec = field_of_law(cls, part, dimension, argument)
        needed = missing and cls is not Table
        keys[part.name] = Key(codec, "", needed, ALWAYS if missing else part.default)
    if cls is Table:
        keys["file"] = Key(Columns((argument, dimension)))
    make = tabulated if cls is Table else cls
    return TableCodec(_title(cls.__name__, dimension, argument), first_paragraph(cls), keys, make)


def field_of_law(
    cls: type, field: dataclasses.Field[Any], dimension: Dimension | None, argument: Dimension
) -> Codec:
    """The codec of a field of a law."""
    powers = field.metadata.get("powers")
    if powers:
        value = argument if dimension is None else dimension
        loose = dimension is None and powers[0]
        number = NumberCodec(None if loose else dimension_by(powers, value, argument))
        return ListCodec(number) if cls is Table else number
    if field.name == "segments":
        rise = numbers_of_law(Rise, dimension, argument)
        keys = {"rise": Key(rise), "dwell": Key(NumberCodec(argument))}
        about = "A part of a cam's program: a rise or a dwell."
        return SegmentsCodec(
            TableCodec(_title("segment", dimension, argument), about, keys, _segment)
        )
    kinds = {"End": End, "Outside": Outside, "Interpolation": Interpolation}
    shape = cls is Rise and field.name == "shape"
    words = tuple(SHAPES) if shape else get_args(kinds.get(str(field.type).removesuffix(" | None")))
    return WordCodec(words) if words else FLAG


def _segment(rise: Rise | None = None, dwell: Any = None) -> Rise | Dwell:
    if (rise is None) == (dwell is None):
        raise ModelError("a segment is either { rise = { … } } or { dwell = duration }")
    return Dwell(dwell) if rise is None else rise


class SegmentsCodec(ListCodec):
    """The parts of a cam's program: rises and dwells."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        item: Any = self.item
        found = []
        for n, part in enumerate(value):
            kind = "dwell" if isinstance(part, Dwell) else "rise"
            own, key = (part.duration, ".duration") if kind == "dwell" else (part, "")
            found.append({kind: item.keys[kind].codec.write(to, f"{name}.{n}{key}", own)})
        return found


class Coefficients(Codec):
    """Coefficients of a polynomial in ascending powers, each with a dimension of its own."""

    def __init__(self, dimension: Dimension | None, argument: Dimension) -> None:
        self.dimension, self.argument = dimension, argument

    def _number(self, n: int) -> NumberCodec:
        return NumberCodec(self.dimension and self.dimension / self.argument**n)

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        if not isinstance(given, list):
            return at.wrong(path, "must be a list", given)
        found = [self._number(n).read(one, path, at) for n, one in enumerate(given)]
        if any(one is REFUSED for one in found):
            return REFUSED
        return made(Polynomial, {"coefficients": found}, path, at)

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        given = enumerate(value.coefficients)
        return [self._number(n).write(to, f"{name}.c{n}", one) for n, one in given]

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        return {"type": "array", "items": {"type": ["number", "string"]}}


def _one_law(**found: Any) -> Law:
    """The one law that a table names."""
    if len(found) != 1:
        has = f"it has {' and '.join(found)}" if found else "it has none"
        raise ModelError(f"must be one law of {', '.join(LAWS)}; {has}")
    law: Law = next(iter(found.values()))
    return law


class LawCodec(Forms):
    """A law: a number, a formula, or a table with one kind."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        formula = to.formulas.get(name)
        measured = isinstance(value, MeasuredFormula)
        if formula is not None and (formula.variable or measured):
            return to.law_text(formula, name, measured)
        number, table = (form.codec for form in self.forms)
        if isinstance(value, Constant):
            return number.write(to, name, value.value)
        if type(value) not in WORDS:
            owner = name.partition(".")[0]
            raise ModelError(
                f"'{owner}' follows a {type(value).__name__} of Python, which a "
                "model file does not carry: write a formula of t, or a table",
                owner,
            )
        word = WORDS[type(value)]
        keys: Any = table
        return {word: keys.keys[word].codec.write(to, name, value)}


@functools.cache
def law_of(dimension: Dimension | None, argument: Dimension) -> LawCodec:
    """A law of that dimension, None for any, as a function of another."""
    table = TableCodec(
        _title("law", dimension, argument),
        "A table with one kind of law.",
        {
            word: Key(numbers_of_law(cls, dimension, argument), first_paragraph(cls))
            for word, cls in LAWS.items()
        },
        _one_law,
        {"minProperties": 1, "maxProperties": 1},
    )
    unit = "" if dimension is None else f", {unit_words(dimension)}"
    return LawCodec(
        "must be a number, a formula or a table with one of " + ", ".join(LAWS),
        (
            Form((int, float, str), NumberCodec(dimension, varies=True)),
            Form((dict,), table),
        ),
        f"a number, a formula or a law as a function of {name_of(argument)}{unit}",
    )


# -- Curves: tables of one or two variables that formulas call by name -------------------------


class Curves(TableCodec):
    """A curve of a file."""

    def write(self, to: NumberWriter, name: str, value: Any) -> Any:
        law: Any = value.given
        name = name.removeprefix(".")
        if not isinstance(law, (Table, Table2)):
            raise ModelError(
                f"the curve '{name}' is a {type(law).__name__}, which a model file does not "
                "carry: give it as a Table",
                name,
            )
        dimensions = (*value.takes, value.gives)
        # beside numbers with units plain ones are ratios
        other = NUMBER if any(dimensions) else None
        measures = {k: one or other for k, one in zip("xyz", dimensions, strict=False)}

        def row(own: Any, dimension: Dimension | None) -> Any:
            if isinstance(own, tuple):
                return [row(one, dimension) for one in own]
            text = to.text(own) if isinstance(own, Formula) else None
            return to.curve_number(name, own, dimension) if text is None else text

        found = {}
        for part in dataclasses.fields(law):
            own = getattr(law, part.name)
            if part.name in measures:
                found[part.name] = row(own, measures[part.name])
            elif not alike(own, part.default):
                found[part.name] = TEXT.write(to, name, own)
        return found


CURVE = Curves(
    "CurveIn",
    "A table of one variable, x and y or a file, or of two, x, y and rows z.",
    {
        "x": Key(ListCodec(NumberCodec()), "places"),
        "y": Key(ListCodec(NumberCodec()), "values; of two variables the other places"),
        "z": Key(ListCodec(ListCodec(NumberCodec())), "values, a row for each x"),
        "file": Key(Columns((None, None)), "CSV file beside this one with the columns x and y"),
        "interpolation": Key(WordCodec(get_args(Interpolation))),
        "outside": Key(WordCodec(get_args(Outside))),
        "end": Key(WordCodec(get_args(End))),
        "periodic": Key(FLAG),
    },
    tabulated,
)
