"""The fields of a model file: numbers, points, places, each checked as it is read.

Every check gives what the description takes: a float, a `Formula`, a `Marker`. Plain
angles are in the unit of the file.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Tag,
    ValidationInfo,
    WithJsonSchema,
)

from mbody.errors import ModelError, brief
from mbody.files.model.problems import ENOUGH
from mbody.model.body import Guess, SecondMoments, SlenderRod
from mbody.model.coupling import CouplingTerm
from mbody.model.element import Marker, Polar
from mbody.model.element_names import check_name
from mbody.model.touching_shapes import Disc, Line, Polygon, Ring, Segment
from mbody.quantities import Formula, FormulaError, read
from mbody.quantities.number import NotANumber, NotFinite, float_or_formula
from mbody.quantities.units import DIMENSIONS, Dimension, name_of

__all__ = [
    "Context",
    "Strict",
    "entered_in",
    "formula_text",
    "guess",
    "limits",
    "name_in",
    "number",
    "place",
    "point",
    "points",
    "shape",
    "shapes",
    "spread",
    "term",
]

ANGLE = DIMENSIONS["angle"]


@dataclass(frozen=True)
class Context:
    """What reading needs to know: the unit of plain angles, the folder of the file, and the values
    that were refused so far.
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
    turns: bool | None = None,
) -> float | Formula:
    """One number of a file: a float, or a formula where it is text; `curves` as of `parse`, `turns`
    whether it is an angle, where that is known: to compare dimensions takes longer than all else.
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
    turns = dimension == ANGLE if turns is None else turns
    return math.radians(result) if turns else result


def _json_number(what: str) -> WithJsonSchema:
    return WithJsonSchema({"type": ["number", "string"], "description": what})


@functools.cache
def number(dimension: Dimension | None, law_of: Dimension | None = None) -> Any:
    """A number of that dimension: plain, or text with units and parameters."""
    turns = dimension == ANGLE

    def check(value: Any, info: ValidationInfo) -> Any:
        result = entered_in(value, dimension, info, curves=law_of is not None, turns=turns)
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


term = Annotated[
    TermIn,
    AfterValidator(
        lambda t: CouplingTerm(t.factor, t.angle, t.relative_to, t.distance, t.coordinate)
    ),
]


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


def _shape_kind(value: Any) -> str | None:
    kinds = ("disc", "ring", "line", "segment", "polygon")
    return next((f"<{k}>" for k in kinds if isinstance(value, dict) and k in value), None)


shapes = dict[
    name_in,
    Annotated[
        Annotated[
            DiscIn,
            AfterValidator(lambda s: Disc(s.disc, s.radius, s.begin, s.end)),
            Tag("<disc>"),
        ]
        | Annotated[
            RingIn,
            AfterValidator(lambda s: Ring(s.ring, s.radius, s.begin, s.end)),
            Tag("<ring>"),
        ]
        | Annotated[
            LineIn, AfterValidator(lambda s: Line(s.line.point, s.line.angle)), Tag("<line>")
        ]
        | Annotated[SegmentIn, AfterValidator(lambda s: Segment(s.segment)), Tag("<segment>")]
        | Annotated[
            PolygonIn, AfterValidator(lambda s: Polygon(tuple(s.polygon))), Tag("<polygon>")
        ],
        Discriminator(
            _shape_kind,
            custom_error_type="form",
            custom_error_message=(
                "must be a shape: { disc = point, radius = … }, { ring = point, radius = … }, "
                "{ segment = [A, B] }, { polygon = [A, B, C] } or { line = { point = … } }"
            ),
        ),
    ],
]
