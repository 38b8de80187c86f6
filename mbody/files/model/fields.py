"""The fields of a model file: numbers, points, places, each checked as it is read.

Every check gives what the description takes: a float, a `Formula`, a `Marker`. Plain
angles are in the unit of the file.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import io
import math
import os
import re
from array import array
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StrictBool,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    create_model,
)

from mbody.errors import ModelError, brief
from mbody.files.model.problems import ENOUGH, LAWS
from mbody.laws import SHAPES, Cam, Dwell, Law, Polynomial, Rise, Table, Table2
from mbody.laws.base import dimension_by
from mbody.laws.table import End, Interpolation, Outside
from mbody.model.body import (
    Body,
    Guess,
    RectangleSection,
    RoundSection,
    SecondMoments,
    SlenderRod,
    TubeSection,
)
from mbody.model.element import Marker, Polar, check_name
from mbody.model.touching_shapes import CurveShape, Disc, Line, Polygon, Ring, Segment
from mbody.quantities import Formula, FormulaError, parse_unit, read
from mbody.quantities.formula import NotANumber, NotFinite, float_or_formula
from mbody.quantities.units import DIMENSIONS, Dimension, name_of

if TYPE_CHECKING:
    from mbody.model.coupling import CouplingTerm

# -- Tables in files of their own, which a model names: only below its own folder --------------

LARGEST = 10_000_000  # bytes
MOST = 100_000  # rows
LONGEST = 10_000  # characters of a line, more than a row of numbers takes


def columns(name: str, folder: Path | None) -> tuple[list[float | str], list[float | str]]:
    """The first two columns of a CSV file beside the model file, (rows,) each: numbers, as text
    with the unit where the heading of a column has one, as "angle [deg]".
    """
    path, what = path_in_folder(name, folder), f"the table {brief(name)}"
    x, y = array("d"), array("d")
    try:
        with path.open("rb") as stream:
            if os.fstat(stream.fileno()).st_size > LARGEST:
                raise ModelError(f"{what} is larger than {LARGEST // 1_000_000} MB")
            text = io.TextIOWrapper(stream, "utf-8-sig", newline="")
            lines = iter(lambda: text.readline(LONGEST), "")
            headed = False
            units = ["", ""]
            for n, row in enumerate(csv.reader(lines), 1):
                if n > MOST:
                    raise ModelError(f"{what} has more than {MOST} rows: leave some of them out")
                if _numbers(row):
                    x.append(float(row[0]))
                    y.append(float(row[1]))
                elif any(map(str.strip, row)):
                    if headed or x or any(map(_is_number, row[:2])):  # it is no row of headings
                        raise ModelError(f"{what}: row {n} has no two numbers: {brief(row[:3])}")
                    headed = True
                    units = [unit_of(cell) for cell in (*row, "", "")[:2]]
    except OSError as error:
        raise ModelError(f"{what} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise ModelError(f"{what} is no text of comma-separated values") from None
    return _with_unit(x.tolist(), units[0], what), _with_unit(y.tolist(), units[1], what)


def unit_of(heading: str) -> str:
    """The unit in a heading, in brackets at its end; empty where it has none.

    >>> unit_of("angle [deg]"), unit_of("force"), unit_of("part [-]")
    ('deg', '', '')
    """
    found = re.search(r"\[([^\[\]]*)\]\s*$", heading)
    unit = found[1].strip() if found else ""
    return "" if unit in ("-", "–", "1") else unit


def _with_unit(values: list[float], unit: str, what: str) -> list[float | str]:
    """Numbers as they are, or as text with their unit."""
    if not unit:
        return [*values]
    try:
        parse_unit(unit)
    except FormulaError as error:
        why = str(error).rpartition(" is not a formula: ")[2]
        raise ModelError(
            f"{what}: its heading has [{unit[:40]}]: {why.rstrip('?')}: write a unit as in "
            "'angle [deg]', or leave it out"
        ) from None
    return [f"{value!r} {unit}" for value in values]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(row: list[str]) -> bool:
    first = row[:2]
    return len(first) == 2 and all(_is_number(c) and math.isfinite(float(c)) for c in first)


def path_in_folder(name: str, folder: Path | None) -> Path:
    """The path of a file that a model names, which must lie in or below the model's folder."""
    if folder is None:
        raise ModelError(f"{brief(name)} cannot be read: a model from text has no folder beside it")
    try:
        whole = (folder / name).resolve()
        inside = whole.is_relative_to(folder.resolve()) and not Path(name).is_absolute()
        ordinary = whole.is_file()
    except (OSError, ValueError, RuntimeError):
        inside, ordinary = True, False
    if not inside:
        raise ModelError(
            f"{brief(name)} lies outside the folder of the model: name a file below it"
        )
    if not ordinary:
        raise ModelError(f"there is no file {brief(name)} beside the model")
    return whole


ANGLE = DIMENSIONS["angle"]


@dataclass(frozen=True)
class Context:
    """State of reading: the unit of plain angles, the folder of the file, and the values refused so
    far.
    """

    angle: str = "deg"
    folder: Path | None = None
    refused: list[Any] = field(default_factory=list)


class Strict(BaseModel):
    """A table of a model file: unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True, defer_build=True)


def entered_in(
    value: Any,
    dimension: Dimension | None,
    info: ValidationInfo,
    *,
    curves: bool = False,
    is_angle: bool | None = None,
) -> float | Formula:
    """One number of a file: a float, or a formula where it is text; `curves` as of `parse`,
    `is_angle` whether it is an angle, where that is known: to compare dimensions takes longer than
    all else.
    """
    angle, refused = info.context.angle, info.context.refused
    if len(refused) >= ENOUGH:
        raise ValueError("unread")  # too much else is wrong: this is not reported
    refused.append(value)  # until it is let in
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
    refused.pop()
    if angle != "deg" or not isinstance(result, float):
        return result
    is_angle = dimension == ANGLE if is_angle is None else is_angle
    return math.radians(result) if is_angle else result


def _json_number(what: str) -> WithJsonSchema:
    return WithJsonSchema({"type": ["number", "string"], "description": what})


@functools.cache
def number(dimension: Dimension | None, law_of: Dimension | None = None) -> Any:
    """A number of that dimension: plain, or text with units and parameters."""
    is_angle = dimension == ANGLE

    def check(value: Any, info: ValidationInfo) -> Any:
        result = entered_in(value, dimension, info, curves=law_of is not None, is_angle=is_angle)
        if isinstance(result, Formula) and result.variable and law_of is None:
            raise ModelError(f"is {brief(result.text)}, but only a law may change with time")
        return result

    named = name_of(dimension) if dimension else ""
    return Annotated[Any, BeforeValidator(check), _json_number(named or "number")]


def _formula_text(value: Any, info: ValidationInfo) -> Any:
    """Text that is a formula, as it was written; a plain number as it is."""
    if isinstance(value, str):
        entered_in(value, None, info, curves=True)
        return value
    return entered_in(value, None, info, curves=True)


#: A formula of measured quantities, which is read when all is there that it measures.
formula_text = Annotated[Any, BeforeValidator(_formula_text), _json_number("formula")]


# -- places -----------------------------------------------------------------------------------


class PolarIn(Strict):
    """A point by distance and angle in link axes."""

    r: number(DIMENSIONS["length"])
    angle: number(ANGLE)


def shape(kinds: dict[str, type | tuple[type, ...]], wanted: str) -> Any:
    """Choose among the forms of a field by what was written."""

    def choose(value: Any) -> str | None:
        for tag, types in kinds.items():
            if isinstance(value, types) and not isinstance(value, bool):
                return tag
        return None

    return Discriminator(choose, custom_error_type="form", custom_error_message=wanted)


Length = number(DIMENSIONS["length"])
point = Annotated[
    Annotated[tuple[Length, Length], Tag("<pair>")]
    | Annotated[PolarIn, AfterValidator(lambda p: Polar(p.r, p.angle)), Tag("<polar>")],
    shape({"<pair>": (list, tuple), "<polar>": dict}, "must be [x, y] or { r = …, angle = … }"),
]


def _checked_name(value: str) -> str:
    check_name(value, "element")
    return value


name_in = Annotated[str, AfterValidator(_checked_name)]
points = dict[name_in, point]


class PlaceIn(Strict):
    """A place on a body with a direction."""

    body: str
    point: Annotated[
        Annotated[str, Tag("<name>")]
        | Annotated[tuple[Length, Length], Tag("<pair>")]
        | Annotated[PolarIn, AfterValidator(lambda p: Polar(p.r, p.angle)), Tag("<polar>")],
        shape(
            {"<name>": str, "<pair>": (list, tuple), "<polar>": dict},
            "must be the name of a point, [x, y] or { r = …, angle = … }",
        ),
    ] = (0.0, 0.0)
    angle: number(ANGLE) = 0.0


def _marker(given: PlaceIn) -> Marker:
    return Marker(given.body, given.point, given.angle)


place = Annotated[
    Annotated[str, Tag("<text>")] | Annotated[PlaceIn, AfterValidator(_marker), Tag("<table>")],
    shape(
        {"<text>": str, "<table>": dict},
        'must be a place: "crank.A", or { body = "crank", point = …, angle = … }',
    ),
]


@functools.cache
def limits(dimension: Dimension) -> Any:
    """The least and the greatest value of a coordinate: a pair, or a table where one is missing."""
    one = number(dimension)

    class LimitsIn(Strict):
        """Limits of a coordinate, of which one may be missing."""

        low: one = None
        high: one = None

    return Annotated[
        Annotated[tuple[one, one], Tag("<pair>")]
        | Annotated[LimitsIn, AfterValidator(lambda p: (p.low, p.high)), Tag("<table>")],
        shape(
            {"<pair>": (list, tuple), "<table>": dict},
            "must be [low, high], or { low = … } or { high = … }",
        ),
    ]


class TermIn(Strict):
    """One coordinate of a coupling with its factor."""

    factor: number(None)
    angle: str | None = None
    relative_to: str = "ground"
    distance: tuple[place, place] | None = None
    coordinate: tuple[place, place] | None = None


def _term(given: TermIn) -> CouplingTerm:
    from mbody.model.coupling import CouplingTerm

    t = given
    return CouplingTerm(t.factor, t.angle, t.relative_to, t.distance, t.coordinate)


term = Annotated[TermIn, AfterValidator(_term)]


class GuessIn(Strict):
    """A rough first pose of the link axes."""

    angle: number(ANGLE) = None
    x: Length = None
    y: Length = None


guess = Annotated[
    Annotated[number(ANGLE), Tag("<angle>")]
    | Annotated[tuple[Length, Length, number(ANGLE)], Tag("<pose>")]
    | Annotated[GuessIn, AfterValidator(lambda g: Guess(g.angle, g.x, g.y)), Tag("<table>")],
    shape(
        {"<angle>": (int, float, str), "<pose>": (list, tuple), "<table>": dict},
        "must be an angle, [x, y, angle] or { angle = …, x = …, y = … }",
    ),
]


class SlenderIn(Strict):
    """Mass along a line."""

    slender: number(ANGLE)


class SecondMomentsIn(Strict):
    """Second moments of mass about the mass centre, link axes."""

    xx: number(DIMENSIONS["inertia"])
    yy: number(DIMENSIONS["inertia"])
    xy: number(DIMENSIONS["inertia"]) = 0.0


spread = Annotated[
    Annotated[Literal["point"], Tag("<text>")]
    | Annotated[SlenderIn, AfterValidator(lambda s: SlenderRod(s.slender)), Tag("<slender>")]
    | Annotated[
        SecondMomentsIn, AfterValidator(lambda s: SecondMoments(s.xx, s.yy, s.xy)), Tag("<moments>")
    ],
    Discriminator(
        lambda value: (
            "<text>"
            if value == "point"
            else "<slender>"
            if isinstance(value, dict) and "slender" in value
            else "<moments>"
            if isinstance(value, dict)
            else None
        ),
        custom_error_type="form",
        custom_error_message='must be "point", { slender = angle } or { xx = …, yy = …, xy = … }',
    ),
]


class RoundIn(Strict):
    """A circle, or an arc of it."""

    radius: Length
    begin: number(ANGLE) | None = None
    end: number(ANGLE) | None = None


class DiscIn(RoundIn):
    """A full circle about a point, or the arc from begin to end, counter-clockwise."""

    disc: str


class RingIn(RoundIn):
    """A hollow circle about a point, or an arc of it, touched from within."""

    ring: str


class StraightIn(Strict):
    """A point of an endless line, and its direction; what touches it is on its left."""

    point: str
    angle: number(ANGLE) = 0.0


class LineIn(Strict):
    """An endless straight line."""

    line: StraightIn


class SegmentIn(Strict):
    """A straight line between two points, touched on its left."""

    segment: tuple[str, str]


class PolygonIn(Strict):
    """A full polygon by its corners."""

    polygon: list[str]


class CurveIn(Strict):
    """A smooth curve from a point, touched on its left: a named curve y(x), or two, x and y."""

    curve: str | tuple[str, str]
    point: str


def _shape_kind(value: Any) -> str | None:
    kinds = ("disc", "ring", "line", "segment", "polygon", "curve")
    return next((f"<{k}>" for k in kinds if isinstance(value, dict) and k in value), None)


shapes = dict[
    name_in,
    Annotated[
        Annotated[
            DiscIn, AfterValidator(lambda s: Disc(s.disc, s.radius, s.begin, s.end)), Tag("<disc>")
        ]
        | Annotated[
            RingIn, AfterValidator(lambda s: Ring(s.ring, s.radius, s.begin, s.end)), Tag("<ring>")
        ]
        | Annotated[
            LineIn, AfterValidator(lambda s: Line(s.line.point, s.line.angle)), Tag("<line>")
        ]
        | Annotated[SegmentIn, AfterValidator(lambda s: Segment(s.segment)), Tag("<segment>")]
        | Annotated[
            PolygonIn, AfterValidator(lambda s: Polygon(tuple(s.polygon))), Tag("<polygon>")
        ]
        | Annotated[
            CurveIn, AfterValidator(lambda s: CurveShape(s.curve, s.point)), Tag("<curve>")
        ],
        Discriminator(
            _shape_kind,
            custom_error_type="form",
            custom_error_message=(
                "must be a shape: { disc = point, radius = … }, { ring = point, radius = … }, "
                "{ segment = [A, B] }, { polygon = [A, B, C] }, { line = { point = … } } or "
                "{ curve = name, point = … }"
            ),
        ),
    ],
]


# -- The laws of a model file: a number, a formula, or a table with one kind of law ------------


@functools.cache
def law(
    dimension: Dimension | None, argument: Dimension, words: tuple[str, ...] = tuple(LAWS)
) -> Any:
    """A law of that dimension, None for any: a number, a formula, or a table with one of these
    kinds of law.
    """
    if not words:
        return number(dimension, argument)
    value = Annotated[number(dimension, argument), Tag("<value>")]
    table = Annotated[
        _law_table(dimension, argument, words), AfterValidator(_picked), Tag("<table>")
    ]
    return Annotated[
        value | table,
        shape(
            {"<value>": (int, float, str), "<table>": dict},
            "must be a number, a formula or a table with one of " + ", ".join(LAWS),
        ),
    ]


def _picked(given: BaseModel) -> Law:
    """The one law that a table names."""
    found = {name: value for name, value in given if value is not None}
    if len(found) != 1:
        has = f"it has {' and '.join(found)}" if found else "it has none"
        raise ModelError(f"must be one law of {', '.join(LAWS)}; {has}")
    made: Law = next(iter(found.values()))
    return made


@functools.cache
def _law_table(
    dimension: Dimension | None, argument: Dimension, words: tuple[str, ...]
) -> type[BaseModel]:
    kinds = {
        word: (
            _law_of_kind(LAWS[word], dimension, argument) | None,
            Field(None, description=_first(LAWS[word])),
        )
        for word in words
    }
    title = f"law: {_called(dimension)} of {name_of(argument)}"
    made: Any = create_model(
        title, __base__=Strict, __doc__="A table with one kind of law.", **kinds
    )
    made.model_config["json_schema_extra"] = {"minProperties": 1, "maxProperties": 1}
    return made


def _called(dimension: Dimension | None) -> str:
    """The name of a dimension in the title of a table."""
    return "any quantity" if dimension is None else name_of(dimension)


def _by(
    powers: tuple[int, int, int], value: Dimension | None, argument: Dimension
) -> Dimension | None:
    """The dimension of a number of a law, None where any is taken."""
    if value is None:
        return None if powers[0] else dimension_by(powers, argument, argument)
    return dimension_by(powers, value, argument)


def _first(cls: type) -> str:
    return (cls.__doc__ or "").split("\n\n")[0].replace("\n    ", " ")


def _law_of_kind(cls: type[Law], dimension: Dimension | None, argument: Dimension) -> Any:
    if cls is Polynomial:
        coefficient = _Coefficients(dimension, argument)
        return Annotated[
            list[Any],
            AfterValidator(coefficient),
            WithJsonSchema({"type": "array", "items": {"type": ["number", "string"]}}),
        ]
    if cls is Cam:
        return _cam(dimension, argument)
    model = _numbers_of(cls, dimension, argument)
    if cls is Table:
        return Annotated[model, AfterValidator(_Points(dimension, argument))]
    return Annotated[model, AfterValidator(functools.partial(_law_of, cls))]


def _law_of(cls: type[Law], given: BaseModel) -> Law:
    return cls(**{name: value for name, value in given if name in given.model_fields_set})


@dataclass(frozen=True)
class _Coefficients:
    """Coefficients in ascending powers, each with a dimension of its own."""

    dimension: Dimension | None
    of: Dimension

    def __call__(self, values: list[Any], info: ValidationInfo) -> Polynomial:
        return Polynomial(
            [
                entered_in(v, self.dimension and self.dimension / self.of**n, info)
                for n, v in enumerate(values)
            ]
        )


CHOICES = {("Rise", "shape"): SHAPES, ("Table", "end"): get_args(End)}
CHOICES[("Table", "outside")] = get_args(Outside)
CHOICES[("Table", "interpolation")] = get_args(Interpolation)


def _numbers_of(
    cls: type[Law], dimension: Dimension | None, argument: Dimension
) -> type[BaseModel]:
    """The table of one kind of law, from the fields of its class."""
    found: dict[str, Any] = {}
    for parameter in dataclasses.fields(cls):
        powers = parameter.metadata.get("powers")
        default = ... if parameter.default is dataclasses.MISSING else parameter.default
        if powers:
            kind = number(_by(powers, dimension, argument))
            if cls is Table:
                kind, default = list[kind], []
        elif (cls.__name__, parameter.name) in CHOICES:
            kind = Literal[tuple(CHOICES[cls.__name__, parameter.name])]
        else:
            kind = StrictBool
        found[parameter.name] = (kind, default)
    if cls is Table:
        found["file"] = (str, None)
    title = f"{cls.__name__}: {_called(dimension)} of {name_of(argument)}"
    return create_model(title, __base__=Strict, __doc__=_first(cls), **found)


def _cam(dimension: Dimension | None, argument: Dimension) -> Any:
    rise = Annotated[
        _numbers_of(Rise, dimension, argument), AfterValidator(functools.partial(_law_of, Rise))
    ]
    segment = create_model(
        f"segment: {_called(dimension)} of {name_of(argument)}",
        __base__=Strict,
        __doc__="A part of a cam's program: a rise or a dwell.",
        rise=(rise | None, None),
        dwell=(number(argument) | None, None),
    )
    cam = create_model(
        f"Cam: {_called(dimension)} of {name_of(argument)}",
        __base__=Strict,
        __doc__=_first(Cam),
        segments=(list[Annotated[segment, AfterValidator(_segment)]], ...),
        period=(number(argument), ...),
    )
    return Annotated[cam, AfterValidator(functools.partial(_law_of, Cam))]


def _segment(given: Any) -> Rise | Dwell:
    if (given.rise is None) == (given.dwell is None):
        raise ModelError("a segment is either { rise = { … } } or { dwell = duration }")
    return Dwell(given.dwell) if given.rise is None else given.rise


@dataclass(frozen=True)
class _Points:
    """A table of points, from the model file or, in the same units, from a file beside it."""

    dimension: Dimension | None
    of: Dimension

    def __call__(self, given: Any, info: ValidationInfo) -> Table:
        fields = {name: value for name, value in given if name in given.model_fields_set}
        path = fields.pop("file", None)
        if path is not None:
            if "x" in fields or "y" in fields:
                raise ModelError("give x and y, or the file that has them, not both")
            read = zip(("x", "y"), columns(path, info.context.folder), strict=True)
            dimensions = {"x": self.of, "y": self.dimension}
            fields |= {k: [entered_in(v, dimensions[k], info) for v in row] for k, row in read}
        if "x" not in fields or "y" not in fields:
            raise ModelError("needs both x and y, or the file that has them")
        return Table(**fields)


# -- Curves of a model file: tables of one or two variables that formulas call by name ---------

_FIELDS: dict[str, Any] = {
    "x": (list[number(None)], Field(None, description="places")),
    "y": (list[number(None)], Field(None, description="values; of two variables the other places")),
    "z": (list[list[number(None)]], Field(None, description="values, a row for each x")),
    "file": (str, Field(None, description="CSV file beside this one with the columns x and y")),
    "interpolation": (Literal[get_args(Interpolation)], None),
    "outside": (Literal[get_args(Outside)], None),
    "end": (Literal[get_args(End)], None),
    "periodic": (StrictBool, None),
}
CurveIn = create_model(
    "CurveIn",
    __base__=Strict,
    __doc__="A table of one variable, x and y or a file, or of two, x, y and rows z.",
    **_FIELDS,
)


def _table_of_curve(given: Any, info: Any) -> Table | Table2:
    fields = {name: value for name, value in given if name in given.model_fields_set}
    path = fields.pop("file", None)
    if path is not None:
        if {"x", "y", "z"} & fields.keys():
            raise ModelError("give x and y, or the file that has them, not both")
        read = zip(("x", "y"), columns(path, info.context.folder), strict=True)
        fields |= {key: [entered_in(v, None, info) for v in row] for key, row in read}
    if "x" not in fields or "y" not in fields:
        raise ModelError("needs both x and y, or the file that has them")
    if "z" not in fields:
        return Table(**fields)
    for key in ("end", "periodic"):
        if key in fields:
            raise ModelError(f"has z, of two variables, and {key}, which only one has: leave out")
    return Table2(**fields)


#: A curve of a file.
curve = Annotated[CurveIn, AfterValidator(_table_of_curve)]


# -- Cross-sections in model files: { rectangle = [h, b] }, { tube = [D, d] }, { round = d } ---


class _BarIn(Strict):
    """A section; the bar goes along two points, without them from joint to joint."""

    along: tuple[str, str] | None = None


class RectangleSectionIn(_BarIn):
    """Height in the plane, thickness across it."""

    rectangle: tuple[Length, Length]


class TubeSectionIn(_BarIn):
    """Outer and inner diameter."""

    tube: tuple[Length, Length]


class RoundSectionIn(_BarIn):
    """Diameter."""

    round: Length


cross_section = Annotated[
    Annotated[
        RectangleSectionIn,
        AfterValidator(lambda s: RectangleSection(*s.rectangle, along=s.along or ())),
        Tag("<rectangle>"),
    ]
    | Annotated[
        TubeSectionIn,
        AfterValidator(lambda s: TubeSection(*s.tube, along=s.along or ())),
        Tag("<tube>"),
    ]
    | Annotated[
        RoundSectionIn,
        AfterValidator(lambda s: RoundSection(s.round, along=s.along or ())),
        Tag("<round>"),
    ],
    Discriminator(
        lambda value: next(
            (
                f"<{k}>"
                for k in ("rectangle", "tube", "round")
                if isinstance(value, dict) and k in value
            ),
            None,
        ),
        custom_error_type="form",
        custom_error_message="must be { rectangle = [height, thickness] }, "
        "{ tube = [outer, inner] } or { round = diameter }",
    ),
]


def section_table(writer: Any, body: Body) -> dict[str, Any]:
    """The section of a body as a file has it; `writer` writes numbers."""
    found: Any = body.section
    name = f"{body.name}.section"
    sizes = [
        writer.number(f"{name}.{k}", getattr(found, k), DIMENSIONS["length"]) for k in found.sizes
    ]
    word = {RectangleSection: "rectangle", TubeSection: "tube"}.get(type(found), "round")
    table: dict[str, Any] = {word: sizes[0] if word == "round" else sizes}
    if found.along:
        table["along"] = list(found.along)
    return table
