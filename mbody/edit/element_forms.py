"""What the page asks for in a form of any element, made of the codecs of the file's fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mbody.files.model.fields import (
    ANGLE,
    BODY,
    FLAG,
    PLACE,
    ByName,
    Codec,
    Forms,
    LawCodec,
    ListCodec,
    NumberCodec,
    RowCodec,
    TableCodec,
    WordCodec,
    Wrapper,
)
from mbody.files.model.problems import SECTIONS
from mbody.files.model.schema import Section, file_table, table_of_kind
from mbody.files.model.study_tables import MEASURE
from mbody.quantities.units import NUMBER, Dimension, UnitSystem

Form = dict[str, Any]

#: Inputs for a list of tables, such as the parts of a cam's program.
PARTS = 4


def element_forms(units: UnitSystem, angle: str = "deg") -> Form:
    """Forms of the tables of the file whose entries have names: what they are, and their entries;
    `angle`: unit of plain angles.

    >>> from mbody.quantities.units import unit_system
    >>> form = element_forms(unit_system("mm-N-s"))["joints"]["entry"]["kinds"]["belt"]
    >>> [one["key"] for one in form["fields"]][3:6]
    ['tension', 'radius_i', 'radius_j']
    >>> form["fields"][4]["unit"]
    'mm'
    """

    def unit(of: Dimension | None) -> str:
        return angle if of == ANGLE else units.of(of) if of is not None and of != NUMBER else ""

    tables: dict[str, Any] = {
        key: one for key, one in file_table().keys.items() if isinstance(one.codec, ByName)
    }
    elements_first = sorted(tables, key=lambda name: name not in SECTIONS)
    return {
        name: {"about": tables[name].about, "entry": form_of(tables[name].codec.item, unit)}
        for name in elements_first
    }


def form_of(codec: Codec, unit: Callable[[Dimension | None], str]) -> Form:
    """The form of a field: a table has `fields`, a choice `kinds`, a row or list `items`; any other
    is one input, which takes a `place`, a `body`, a word of `choices`, a number in its `unit`.
    """
    if codec is PLACE or codec is BODY:
        return {"takes": codec.takes(), "picks": "place" if codec is PLACE else "body"}
    if isinstance(codec, Section):
        every: Any = codec.kinds.items()
        return {"kinds": {k: form_of(table_of_kind(cls, k).inner, unit) for k, cls in every}}
    if isinstance(codec, LawCodec):
        number, table = (form.codec for form in codec.forms)
        found = {one["key"]: one for one in form_of(table, unit)["fields"]}
        return {"kinds": {"": form_of(number, unit), **found}, "named": True}
    if isinstance(codec, TableCodec):
        fields = [
            {"key": key, "about": one.about, "needed": one.needed, **form_of(one.codec, unit)}
            for key, one in codec.keys.items()
        ]
        return {"fields": fields, "about": codec.about}
    if isinstance(codec, RowCodec):
        return {"items": [form_of(one, unit) for one in codec.items], "row": True}
    if isinstance(codec, ListCodec) and isinstance(codec.item, TableCodec):
        return {"items": [form_of(codec.item, unit)] * PARTS}
    if isinstance(codec, Forms):
        return form_of(codec.forms[-1 if codec is MEASURE else 0].codec, unit)
    if isinstance(codec, NumberCodec):
        return {"unit": unit(codec.dimension), "takes": "a number"}
    if codec is FLAG or isinstance(codec, WordCodec):
        return {"choices": [*codec.words] if isinstance(codec, WordCodec) else ["true", "false"]}
    return form_of(codec.inner, unit) if isinstance(codec, Wrapper) else {"takes": codec.takes()}
