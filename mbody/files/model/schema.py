"""The shape of a model file: its tables, made from the element classes, and the JSON Schema."""

from __future__ import annotations

import dataclasses
import functools
import re
from typing import Any

from mbody.core.other_words import KINDS
from mbody.files.model import study_tables
from mbody.files.model.fields import (
    ALWAYS,
    BODY,
    CURVE,
    FLAG,
    GUESS,
    PLACE,
    POINT,
    POINTS,
    REFUSED,
    SECTION,
    SHAPES_OF_BODY,
    SPREAD,
    TEXT,
    WHOLE,
    ByName,
    Codec,
    FileReading,
    FormulaText,
    Key,
    NumberCodec,
    RowCodec,
    TableCodec,
    Terms,
    WordCodec,
    Wrapper,
    ends,
    first_paragraph,
    law_of,
    quantity,
)
from mbody.files.model.problems import (
    SECTIONS,
    KeyPath,
    also_written,
    kind_in,
    no_kind,
    written_fields,
)
from mbody.model.body import Body, Guess
from mbody.model.element import STEADY, Element
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


# -- Elements, from the fields of their classes ------------------------------------------------

#: Fields of bodies that are declared by no dimension.
_OF_BODIES = {
    "cg": POINT,
    "points": POINTS,
    "shapes": SHAPES_OF_BODY,
    "guess": GUESS,
    "spread": SPREAD,
    "section": SECTION,
}


def codec_of(field: dataclasses.Field[Any]) -> Codec:
    """What reads, writes and describes a field of an element."""
    meta = field.metadata
    if "dimension" in meta:
        return NumberCodec(dimension_of(meta["dimension"]))
    if "law" in meta:
        return law_of(dimension_of(meta["law"]), dimension_of(meta["of"]))
    if "limits" in meta:
        return ends(dimension_of(meta["limits"]))
    if "place" in meta:
        return PLACE
    if "terms" in meta:
        return Terms(Terms.table)
    if "body" in meta or field.name in _OF_BODIES:
        return _OF_BODIES.get(field.name, BODY)
    return {"bool": FLAG, "int": WHOLE, "str": TEXT}[str(field.type)]


def default_of(field: dataclasses.Field[Any]) -> Any:
    """What counts without it."""
    made = field.default_factory
    return field.default if made is dataclasses.MISSING else made()


class ElementTable(Wrapper):
    """The table of a kind of element: its kind with the main fields, then the others; it is read
    as the arguments of the class. Bodies have no kind.
    """

    def __init__(self, cls: type[Element], kind: str = "") -> None:
        about = described(cls)
        names = [*_OF_BODIES]
        fields = sorted(
            written_fields(cls), key=lambda f: names.index(f.name) if f.name in names else -1
        )
        own = {field.name: field for field in fields}
        self.cls, self.kind = cls, kind
        main = {name: codec_of(own.pop(name)) for name in (cls.main if kind else ())}
        keys: dict[str, Key] = {}
        if kind:
            codecs = [*main.values()]
            first = codecs[0] if len(codecs) == 1 else RowCodec(tuple(codecs), tuple(main))
            words = "; ".join(about.get(name, name) for name in main)
            of = tuple(main) if len(main) > 1 else next(iter(main))
            keys[kind] = Key(first, words, needed=True, default=ALWAYS, of=of)
        for name, field in own.items():
            needed = field.default is dataclasses.MISSING and (
                field.default_factory is dataclasses.MISSING
            )
            default = Guess() if codec_of(field) is GUESS else default_of(field)
            keys[name] = Key(
                codec_of(field), about.get(name, ""), needed or "place" in field.metadata, default
            )
        self.inner = TableCodec(cls.__name__, first_paragraph(cls), keys)

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        found = super().schema(defs)
        table, words = defs[self.cls.__name__], also_written(self.kind)
        if words and self.kind in table["required"]:
            own = table["properties"]
            own |= {word: {**own[self.kind], "description": self.kind} for word in words}
            table["required"].remove(self.kind)
            table["oneOf"] = [{"required": [word]} for word in (self.kind, *words)]
        return found


@functools.cache
def table_of_kind(cls: Any, kind: str = "") -> ElementTable:
    """The table of elements of a class."""
    return ElementTable(cls, kind)


class Section(Codec):
    """An element of a section, whose table is chosen by its kind; it is read as its class with the
    arguments.
    """

    def __init__(self, section: str) -> None:
        self.section, self.kinds = section, SECTIONS[section]

    def read(self, given: Any, path: KeyPath, at: FileReading) -> Any:
        kind = kind_in(self.section, given)
        if kind is None:
            return at.refuse(path, lambda: no_kind(self.section, str(path[-1]), given))
        cls = self.kinds[kind] if kind in self.kinds else self.kinds[KINDS[kind]]
        table = table_of_kind(cls, kind)
        found = table.read(given, path, at)
        return found if found is REFUSED else (table.cls, found)

    def schema(self, defs: dict[str, Any]) -> dict[str, Any]:
        kinds = self.kinds.items()
        return {"oneOf": [table_of_kind(cls, kind).schema(defs) for kind, cls in kinds]}


# -- The file ----------------------------------------------------------------------------------


GROUND = TableCodec(
    "Ground", "The fixed link.", {"points": Key(POINTS), "shapes": Key(SHAPES_OF_BODY)}
)
_TIME = DIMENSIONS["time"]
_COMPONENT = Key(law_of(DIMENSIONS["acceleration"], _TIME), default=0.0)
GRAVITY = TableCodec(
    "GravityIn",
    "The weight of every body: components of the gravitational acceleration.",
    {"x": _COMPONENT, "y": _COMPONENT},
)
STATE = TableCodec(
    "OwnStateIn",
    "A first-order equation of one's own: its rate, where it begins, and a typical value.",
    {
        "rate": Key(FormulaText(), needed=True),
        "start": Key(NumberCodec(word=STEADY)),
        "size": Key(NumberCodec()),
    },
)


@functools.cache
def file_table() -> TableCodec:
    """The whole file."""
    about = {
        "joints": "The joints between the links, by name.",
        "couplings": "Sums of coordinates that keep their value, as belts, by name.",
        "drivers": "Motors: coordinates that follow a law of time, by name.",
        "contacts": "Contacts between shapes of bodies, and ropes, by name.",
        "loads": "Forces, torques, springs and dampers, by name.",
    }
    systems = ", ".join(UNIT_SYSTEMS)
    studies = study_tables.STUDIES
    gravity = quantity("acceleration")
    keys = {
        "name": Key(TEXT, "Title of the mechanism."),
        "source": Key(TEXT, "Book, page or repository that it comes from."),
        "note": Key(TEXT, "What to look at."),
        "units": Key(TEXT, f"Units of plain numbers: {systems}."),
        "angle": Key(WordCodec(("deg", "rad")), "Unit of plain angles."),
        "g": Key(gravity, "Turns weights into masses; standard gravity by default."),
        "ground": Key(GROUND, "The fixed link."),
        "gravity": Key(GRAVITY, "Gravity on every body."),
        "ask": Key(studies["ask"], "The instants to analyse."),
        "simulate": Key(studies["simulate"], "The motion that is followed."),
        "fit": Key(studies["fit"], "What `mbody fit` finds from data."),
        "report": Key(studies["report"], "What `mbody report` writes."),
        "$schema": Key(TEXT, "Where this schema lies."),
    }
    by_name: dict[str, tuple[Codec, str]] = {
        "curves": (CURVE, "Tables that formulas call by name, of one or of two variables."),
        "inputs": (
            law_of(None, _TIME),
            "Numbers that formulas use and that may change during a motion, by name.",
        ),
        "bodies": (table_of_kind(Body), "The moving links by name."),
        "states": (STATE, "States of one's own, integrated with the motion, by name."),
        "quantities": (FormulaText(), "Formulas that later formulas name."),
        **{name: (Section(name), text) for name, text in about.items()},
        "measures": (studies["measures"], "Quantities to be measured on every result, by name."),
        "solve": (studies["solve"], "Questions that `mbody solve` answers, by name."),
        "optimize": (
            studies["optimize"],
            "What `mbody optimize` is to make least or greatest, by name.",
        ),
    }
    parameters = ByName(NumberCodec(), elements=False)
    units = ByName(TEXT, elements=False)
    keys["output_units"] = Key(units, 'Units of results by quantity, as mass = "kg".')
    keys["parameters"] = Key(parameters, "Named numbers that formulas may use.")
    keys |= {name: Key(ByName(codec), text) for name, (codec, text) in by_name.items()}
    return TableCodec("Model", "A planar mechanism, as mbody reads it.", keys)


@functools.cache
def json_schema() -> dict[str, Any]:
    """The JSON Schema of model files, for the completion of editors."""
    defs: dict[str, Any] = {}
    file_table().schema(defs)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **defs.pop("Model"),
        "title": "mbody model",
        "$defs": defs,
    }
