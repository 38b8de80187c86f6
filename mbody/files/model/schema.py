"""The shape of a model file: pydantic models made from the element classes, and the JSON Schema."""

from __future__ import annotations

import dataclasses
import functools
import re
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    StrictBool,
    StrictInt,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    create_model,
)

from mbody.core.tolerances import RTOL_DEFAULT
from mbody.files.model import fields
from mbody.files.model.fields import cross_section, curve, law
from mbody.files.model.problems import LAWS, SECTIONS, written_fields
from mbody.files.model.study_tables import FitIn, OptimizeIn, ReportIn
from mbody.model.body import Body
from mbody.model.element import Element
from mbody.quantities.units import DIMENSIONS, UNIT_SYSTEMS, dimension_of

# -- Descriptions of fields, from the docstrings of element classes ----------------------------


def described(cls: type) -> dict[str, str]:
    """The description of each parameter of a class and its bases, from their docstrings; where one
    refers to a base, as "see `FrictionalJoint`", with the words of that base.

    >>> from mbody.model.loads import Damper
    >>> described(Damper)["name"]
    'Unique in the mechanism.'
    >>> from mbody.model.joints import Gear
    >>> described(Gear)["backlash"][:45]
    'Play between the teeth along the pitch lines '
    """
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        text = base.__dict__.get("__doc__") or ""
        _, _, tail = text.partition("Parameters\n    ----------\n")
        block = re.split(r"\n    [A-Z][a-z]+\n    -----", tail)[0]
        for names, lines in re.findall(
            r"^    (\S[^:\n]*?)(?: : .*)?\n((?:        .*\n?)+)", block, re.M
        ):
            words = " ".join(lines.split())
            several = names.split(",")
            for name in map(str.strip, several):
                found[name] = _with_base_text(words, found.get(name, ""), len(several) > 1)
    return found


def _with_base_text(words: str, of_base: str, shared: bool) -> str:
    """A description with that of a base in place of a reference to it; of a description that
    several parameters share, the base's says which is which.
    """
    found = re.search(r"; see `\w+`\.", words)
    if not of_base or found is None:
        return words
    own, tail = words[: found.start()], words[found.end() :]
    return f"{of_base}{tail}" if shared else f"{own}. {of_base}{tail}"


STUDIES = ("measures", "solve", "optimize", "gravity", "ask", "simulate", "fit", "report")
TABLES = ("parameters", "curves", "inputs", "bodies", *SECTIONS, "states", *STUDIES)


@dataclasses.dataclass(frozen=True)
class FormatParts:
    """Parts of the format that a file uses: tables, kinds of elements by section, kinds of laws.

    To make the checks of everything takes a quarter of a second, of a textbook's four-bar a tenth
    of that.
    """

    tables: tuple[str, ...]
    kinds: frozenset[tuple[str, str]]
    laws: tuple[str, ...]


def everything() -> FormatParts:
    """All that a file may use."""
    kinds = {(section, kind) for section, known in SECTIONS.items() for kind in known}
    return FormatParts(TABLES, frozenset(kinds), tuple(LAWS))


def used_by(data: dict[str, Any]) -> FormatParts | None:
    """Parts of the format that a file uses; None where it names no known kind of an element, which
    is a mistake.
    """
    tables = tuple(name for name in TABLES if name in data)
    kinds = set()
    for section in SECTIONS:
        entries = data.get(section, {})
        for value in entries.values() if isinstance(entries, dict) else [None]:
            found = _kind_in(section, value)
            if found is None:
                return None
            kinds.add((section, found))
        if not entries:
            tables = tuple(name for name in tables if name != section)
    keys: set[str] = set()
    level: list[Any] = [data]
    while level:
        table = level.pop()
        if isinstance(table, dict):
            keys.update(table)
            level += table.values()
        elif isinstance(table, list):
            level += table
    return FormatParts(tables, frozenset(kinds), tuple(word for word in LAWS if word in keys))


def _field(field: dataclasses.Field[Any], words: tuple[str, ...]) -> Any:
    """The type of one field of an element, with laws of these kinds."""
    meta = field.metadata
    if "dimension" in meta:
        return fields.number(dimension_of(meta["dimension"]))
    if "law" in meta:
        return law(dimension_of(meta["law"]), dimension_of(meta["of"]), words)
    if "limits" in meta:
        return fields.limits(dimension_of(meta["limits"]))
    if "place" in meta:
        return fields.place
    if "body" in meta:
        return str
    if "terms" in meta:
        return list[fields.term]
    return {"bool": StrictBool, "int": StrictInt, "str": str}[str(field.type)]


@functools.cache
def _entry(kind: str, cls: type[Element], words: tuple[str, ...]) -> Any:
    """The table of one kind of element: its kind with the main fields, then the others."""
    descriptions = described(cls)
    own = {field.name: field for field in written_fields(cls)}
    main = [own.pop(name) for name in cls.main]
    first = (
        _field(main[0], words)
        if len(main) == 1
        else tuple[tuple(_field(part, words) for part in main)]
    )
    about = "; ".join(descriptions.get(part.name, part.name) for part in main)
    columns: dict[str, Any] = {kind: (first, Field(..., description=about))}
    for name, field in own.items():
        columns[name] = (
            _field(field, words),
            Field(
                ... if field.default is dataclasses.MISSING or "place" in field.metadata else None,
                description=descriptions.get(name),
            ),
        )
    lines = (cls.__doc__ or "").split("\n\n")[0].split("\n")
    about = " ".join(line.strip() for line in lines)
    return create_model(cls.__name__, __base__=fields.Strict, __doc__=about, **columns)


def _kind_in(section: str, value: Any) -> str | None:
    """The kind of element that a table of a section is."""
    # "angle" is a kind of driver and a field of forces and places: the first kind counts
    return next((k for k in SECTIONS[section] if isinstance(value, dict) and k in value), None)


def _choice(section: str, used: FormatParts) -> Any:
    """Any one kind of a section, chosen by its key."""
    kinds = SECTIONS[section]

    def choose(value: Any) -> str | None:
        found = _kind_in(section, value)
        return None if found is None else f"<{found}>"

    entries = {
        kind: _entry(kind, kinds[kind], used.laws)
        for kind in kinds
        if (section, kind) in used.kinds
    }
    if len(entries) == 1:  # nothing to choose
        return next(iter(entries.values()))
    tagged = [Annotated[entry, Tag(f"<{kind}>")] for kind, entry in entries.items()]
    union: Any = tagged[0]
    for one in tagged[1:]:
        union = union | one
    what = section.removesuffix("s")
    return Annotated[
        union,
        Discriminator(
            choose,
            custom_error_type="kind",
            custom_error_message=f"names no kind of {what} (there are: {', '.join(kinds)})",
        ),
    ]


@functools.cache
def _body(words: tuple[str, ...]) -> Any:
    descriptions = described(Body)
    columns: dict[str, Any] = {}
    special = {"cg": fields.point, "points": fields.points, "guess": fields.guess}
    special |= {"spread": fields.spread, "shapes": fields.shapes, "section": cross_section}
    for field in dataclasses.fields(Body):
        if field.name == "name":
            continue
        kind = special.get(field.name) or _field(field, words)
        columns[field.name] = (kind, Field(None, description=descriptions.get(field.name)))
    return create_model("Body", __base__=fields.Strict, __doc__="One rigid link.", **columns)


class Ground(fields.Strict):
    """The fixed link."""

    points: fields.points = Field(default_factory=dict)
    shapes: fields.shapes = Field(default_factory=dict)


@functools.cache
def _gravity(words: tuple[str, ...]) -> Any:
    component = law(DIMENSIONS["acceleration"], DIMENSIONS["time"], words)
    about = "The weight of every body: components of the gravitational acceleration."
    return create_model(
        "GravityIn", __base__=fields.Strict, __doc__=about, x=(component, None), y=(component, None)
    )


class MeasureIn(fields.Strict):
    """A quantity to be measured, in a unit."""

    of: str
    unit: str = ""


measure = Annotated[
    Annotated[str, Tag("<text>")] | Annotated[MeasureIn, Tag("<table>")],
    fields.shape({"<text>": str, "<table>": dict}, "must be a formula or { of = …, unit = … }"),
]
values = Annotated[
    Annotated[fields.number(None), Tag("<value>")]
    | Annotated[list[fields.number(None)], Tag("<values>")],
    fields.shape(
        {"<value>": (int, float, str), "<values>": list}, "must be a number, text or a list"
    ),
]


class AskIn(fields.Strict):
    """The instants that an analysis is made for, unless the command gives others."""

    at: dict[str, values] = Field(default_factory=dict)
    over: str = ""
    instants: StrictInt | None = None
    turns: StrictInt = 1


class UnknownIn(fields.Strict):
    """An unknown: where its search begins, its bounds, and the unit that it is shown in."""

    start: fields.number(None) = None
    low: fields.number(None) = None
    high: fields.number(None) = None
    unit: str = ""


texts = Annotated[
    Annotated[str, Tag("<text>")] | Annotated[list[str], Tag("<texts>")],
    fields.shape({"<text>": str, "<texts>": list}, "must be text or a list of texts"),
]
unknowns = Annotated[
    Annotated[str, Tag("<text>")]
    | Annotated[list[str], Tag("<texts>")]
    | Annotated[dict[str, UnknownIn], Tag("<table>")],
    fields.shape(
        {"<text>": str, "<texts>": list, "<table>": dict},
        "must be a name, a list of names, or { name = { start = …, unit = … } }",
    ),
]


class SolveIn(fields.Strict):
    """A question: unknown numbers and the conditions that they are to meet."""

    unknowns: unknowns
    conditions: texts = Field(default_factory=list)
    side_conditions: texts = Field(default_factory=list)
    greatest: str = ""
    least: str = ""
    analysis: str = "kinetostatics"
    at: dict[str, fields.number(None)] = Field(default_factory=dict)
    note: str = ""


@functools.cache
def _auxiliary_state() -> Any:
    from mbody.model.states import STEADY

    def _first_value(value: Any, info: ValidationInfo) -> Any:
        """The first value of an auxiliary state: a number with its unit, or the word."""
        return value if value == STEADY else fields.entered_in(value, None, info)

    class OwnStateIn(fields.Strict):
        """A first-order equation of one's own: its rate, where it begins, and a typical value."""

        rate: fields.formula_text
        start: Annotated[
            Any,
            BeforeValidator(_first_value),
            WithJsonSchema(
                {
                    "type": ["number", "string"],
                    "description": f'number with its unit, or "{STEADY}"',
                }
            ),
        ] = 0.0
        size: fields.number(None) = None

    return OwnStateIn


class StateIn(fields.Strict):
    """Initial values of a body."""

    angle: fields.number(DIMENSIONS["angle"]) = None
    omega: fields.number(DIMENSIONS["angular velocity"]) = None
    x: fields.number(DIMENSIONS["length"]) = None
    vx: fields.number(DIMENSIONS["velocity"]) = None
    y: fields.number(DIMENSIONS["length"]) = None
    vy: fields.number(DIMENSIONS["velocity"]) = None


class EventIn(fields.Strict):
    """A zero crossing that is recorded, or ends the motion."""

    of: str
    direction: StrictInt = 0
    stop: StrictBool = False


@functools.cache
def _simulate() -> Any:
    from mbody.model.simulation import METHODS

    class SimulateIn(fields.Strict):
        """A motion: how it begins, and how long it goes on."""

        until: fields.number(DIMENSIONS["time"])
        start: dict[str, StateIn] = Field(default_factory=dict)
        rtol: float = RTOL_DEFAULT
        instants: StrictInt = 201
        method: Literal[METHODS] = METHODS[0]
        step: fields.number(DIMENSIONS["time"]) | None = None
        every: fields.number(DIMENSIONS["time"]) | None = None
        release: dict[fields.name_in, fields.number(DIMENSIONS["time"])] = Field(
            default_factory=dict
        )
        events: dict[fields.name_in, EventIn] = Field(default_factory=dict)

    return SimulateIn


@functools.cache
def model(used: FormatParts) -> Any:
    """The whole file, or as much of it as a file uses."""
    tables: dict[str, Any] = {
        "parameters": dict[str, fields.number(None)],
        "curves": dict[fields.name_in, curve],
        "inputs": dict[fields.name_in, law(None, DIMENSIONS["time"], used.laws)],
        "bodies": dict[fields.name_in, _body(used.laws)],
        "states": dict[fields.name_in, _auxiliary_state()] if "states" in used.tables else Any,
        "measures": dict[fields.name_in, measure],
        "solve": dict[fields.name_in, SolveIn],
        "optimize": dict[fields.name_in, OptimizeIn],
        "gravity": _gravity(used.laws),
        "ask": AskIn,
        "simulate": _simulate() if "simulate" in used.tables else Any,
        "fit": FitIn,
        "report": ReportIn,
    }
    sections = [section for section in SECTIONS if section in used.tables]
    tables |= {section: dict[fields.name_in, _choice(section, used)] for section in sections}
    tables = {name: tables[name] if name in used.tables else Any for name in TABLES}
    about = {
        "parameters": "Named numbers that formulas may use.",
        "curves": "Tables that formulas call by name, of one or of two variables.",
        "inputs": "Numbers that formulas use and that may change during a motion, by name.",
        "bodies": "The moving links by name.",
        "states": "States of one's own, integrated with the motion, by name.",
        "joints": "The joints between the links, by name.",
        "couplings": "Sums of coordinates that keep their value, as belts, by name.",
        "drivers": "Motors: coordinates that follow a law of time, by name.",
        "contacts": "Contacts between shapes of bodies, and ropes, by name.",
        "loads": "Forces, torques, springs and dampers, by name.",
        "measures": "Quantities to be measured on every result, by name.",
        "solve": "Questions that `mbody solve` answers, by name.",
        "optimize": "What `mbody optimize` is to make least or greatest, by name.",
    }
    systems = ", ".join(UNIT_SYSTEMS)
    columns: dict[str, Any] = {
        "name": (str, Field("mechanism", description="Title of the mechanism.")),
        "source": (str, Field("", description="Book, page or repository that it comes from.")),
        "note": (str, Field("", description="What to look at.")),
        "units": (str, Field("SI", description=f"Units of plain numbers: {systems}.")),
        "angle": (Literal["deg", "rad"], Field("deg", description="Unit of plain angles.")),
        "g": (
            fields.number(DIMENSIONS["acceleration"]),
            Field(None, description="Turns weights into masses; standard gravity by default."),
        ),
        "ground": (Ground, Field(None, description="The fixed link.")),
        "gravity": (tables["gravity"], Field(None, description="Gravity on every body.")),
        "ask": (tables["ask"], Field(None, description="The instants to analyse.")),
        "simulate": (tables["simulate"], Field(None, description="The motion that is followed.")),
        "fit": (tables["fit"], Field(None, description="What `mbody fit` finds from data.")),
        "report": (tables["report"], Field(None, description="What `mbody report` writes.")),
        "schema_": (str, Field(None, alias="$schema", description="Where this schema lies.")),
    }
    columns |= {
        name: (tables[name], Field(default_factory=dict, description=text))
        for name, text in about.items()
    }
    return create_model(
        "Model", __base__=fields.Strict, __doc__="A planar mechanism, as mbody reads it.", **columns
    )


@functools.cache
def json_schema() -> dict[str, Any]:
    """The JSON Schema of model files, for the completion of editors."""
    schema: dict[str, Any] = model(everything()).model_json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": "mbody model",
    }
