"""The schema of model files: it knows the gallery, and refuses what the reader refuses."""

import json
import tomllib

import jsonschema
import pytest

from mbody import ModelError, gallery
from mbody.files.model import json_schema
from mbody.files.model.write import as_data
from tests.support.cases import first_fast
from tests.support.model_files import SCHEMA
from tests.support.model_text import model_from


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
