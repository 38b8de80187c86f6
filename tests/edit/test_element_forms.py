"""Forms of the page have every kind and every field of the file, with its unit."""

import pytest

from mbody.edit.places import element_forms
from mbody.files.model.problems import LAWS, SECTIONS
from mbody.files.model.schema import json_schema
from mbody.quantities.units import unit_system

FORMS = element_forms(unit_system("in-lbf-s"), "deg")
DEFS = json_schema()["$defs"]


@pytest.mark.parametrize("section", SECTIONS)
def test_every_kind_has_the_fields_of_the_schema(section):
    kinds = FORMS[section]["entry"]["kinds"]
    assert [*kinds] == [*SECTIONS[section]]
    for kind, cls in SECTIONS[section].items():
        fields = {one["key"]: one for one in kinds[kind]["fields"]}
        schema = DEFS[cls.__name__]
        assert fields.keys() <= schema["properties"].keys()
        known = set(schema["properties"]) - set(fields)
        assert all(schema["properties"][word]["description"] == kind for word in known)
        for key, field in fields.items():
            assert field["about"] == schema["properties"][key].get("description", "")


def test_units_are_those_of_plain_numbers_of_the_file():
    kinds = FORMS["drivers"]["entry"]["kinds"]
    law = next(one for one in kinds["angle"]["fields"] if one["key"] == "law")
    assert [*law["kinds"]] == ["", *LAWS]
    units = [one["unit"] for one in law["kinds"]["constant_acceleration"]["fields"]]
    assert units == ["deg", "rad/s", "rad/s²"]
    program = law["kinds"]["cam"]["fields"]
    assert [one["key"] for one in program[0]["items"][0]["fields"]] == ["rise", "dwell"]
