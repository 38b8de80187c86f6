"""The schema of model files: it knows the gallery, and refuses what the reader refuses."""

import dataclasses
import json
import tomllib

import jsonschema
import pytest

import mbody
from mbody import ModelError, gallery
from mbody.core.other_words import KINDS
from mbody.files.model import in_units, json_schema
from mbody.files.model.problems import SECTIONS, also_written
from mbody.files.model.write import as_data
from mbody.teaching.exercises import SURROUNDINGS, element_reference
from tests.support.cases import first_fast
from tests.support.model_files import SCHEMA
from tests.support.model_text import model_from, text_from


@first_fast("name", gallery.names(), 9)
def test_the_schema_knows_the_gallery(name):
    data = tomllib.loads(gallery.path(name).read_text("utf-8"))
    SCHEMA.validate(data)
    SCHEMA.validate(as_data(gallery.load(name)))
    SCHEMA.validate({**data, "$schema": "./mbody.schema.json"})


def test_the_schema_is_a_schema():
    jsonschema.Draft202012Validator.check_schema(json_schema())
    json.dumps(json_schema(), allow_nan=False)


def norton():
    return tomllib.loads(gallery.path("norton_fourbar").read_text("utf-8"))


def put(path, value):
    def change(data):
        *way, last = path
        for key in way:
            data = data[key]
        data[last] = value

    return change


@pytest.mark.parametrize(
    "change",
    [
        put(["bodys"], {}),
        put(["bodies", "crank", "wait"], 3),
        put(["bodies", "crank", "mass"], [1]),
        put(["bodies", "crank", "mass"], True),
        put(["bodies", "crank", "points", "A"], [1, 2, 3]),
        put(["bodies", "crank", "points", "A"], {"r": 1}),
        put(["bodies", "crank", "guess"], [1, 2]),
        put(["bodies", "crank", "spread"], "points"),
        put(["joints", "A"], {"revolut": ["crank.A", "coupler.A"]}),
        put(["joints", "A"], {"revolute": ["crank.A"]}),
        put(["joints", "A"], {"revolute": ["crank.A", 3]}),
        put(["joints", "A"], {"revolute": ["crank.A", "coupler.A"], "fixed": ["a", "b"]}),
        put(["joints", "A"], {"distance": ["crank.A", "coupler.A"]}),
        put(["drivers", "motor", "law"], {"constant_speed": {"value": 1}}),
        put(["drivers", "motor", "law"], {"constant_speed": {"value": 1, "speed": 2}, "cam": {}}),
        put(["drivers", "motor", "law"], {}),
        put(["drivers", "motor", "law"], {"rise": {"shape": "345", "height": 1, "start": 0,
                                                   "duration": 1}}),
        put(["loads", "F_P", "follows"], 3.5),
        put(["loads", "F_P"], {"at": "coupler.P"}),
        put(["angle"], "grad"),
        put(["ask"], {"at": {"t": 0}, "instants": 1.5}),
        put(["measures", "a"], {"unit": "mm"}),
        put(["measures", "a"], 3),
        put(["name"], 3),
        put(["gravity"], {"z": 1}),
    ],
)  # fmt: skip
def test_schema_and_reader_refuse_the_same(change):
    data = norton()
    change(data)
    assert not SCHEMA.is_valid(data)
    with pytest.raises(ModelError):
        model_from(json.dumps(data), True)


def test_other_words_for_kinds_are_taken():
    """Every one by reader and schema, for the same element; none is a kind itself."""
    known = {kind for kinds in SECTIONS.values() for kind in kinds}
    assert not KINDS.keys() & known and set(KINDS.values()) <= known
    for section, kinds in SECTIONS.items():
        for kind, cls in kinds.items():
            assert not KINDS.keys() & {field.name for field in dataclasses.fields(cls)}
            example = element_reference(kind)
            (own,) = [one for one in example if one.section == section]
            for word in also_written(kind):
                data = tomllib.loads(f"{SURROUNDINGS}{own.file}\n")
                one = model_from(json.dumps(data), True)
                data[section] = {
                    name: {word if key == kind else key: v for key, v in entry.items()}
                    for name, entry in data[section].items()
                }
                SCHEMA.validate(data)
                assert text_from(model_from(json.dumps(data), True), True) == text_from(one, True)


def test_units_of_results_are_kept():
    text = 'units = "mm-N-s"\n[output_units]\nmass = "kg"\nspeed = "rpm"\n'
    text += '[bodies.a]\nmass = "2 kg"\n'
    machine = mbody.from_toml(text)
    assert machine.output_units == {"mass": "kg", "speed": "rpm"}
    for one in (mbody.from_toml(mbody.to_toml(machine)), in_units(machine, "in-lbf-s")):
        assert one.output_units == machine.output_units
        assert one.shown.of("mass") == "kg" and one.shown.of("angular velocity") == "rpm"
    SCHEMA.validate(as_data(machine))
