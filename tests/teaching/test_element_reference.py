"""What `mbody explain` prints: every kind, its fields, and examples that are read and compared."""

import ast
import dataclasses
import re
import textwrap
import tomllib

import pytest

import mbody
from mbody import laws
from mbody.errors import ModelError
from mbody.files.model import json_schema
from mbody.files.model.problems import LAWS, SECTIONS, also_written, written_fields
from mbody.model import contact, coupling, driver, joints, loads, stop
from mbody.model import stop as freewheel
from mbody.model.body import Body
from mbody.model.element import Marker
from mbody.teaching import element_reference, reference_overview
from mbody.teaching.exercises import OTHER_TABLES, SURROUNDINGS
from tests.support.cases import each

KINDS = [(section, kind) for section, kinds in SECTIONS.items() for kind in kinds]
#: What the examples in Python name.
NAMES = {"laws": laws, "Marker": Marker, "Body": Body} | {
    name: value
    for module in (joints, loads, driver, coupling, contact, freewheel, stop)
    for name, value in vars(module).items()
    if isinstance(value, type)
}


def one(section, kind):
    (found,) = (one for one in element_reference(kind) if one.section == section)
    return found


def surroundings():
    return mbody.from_toml(SURROUNDINGS)


@each(("section", "kind"), KINDS)
def test_both_examples_are_the_same_element(section, kind):
    found = one(section, kind)
    assert max(map(len, found.file.splitlines())) <= 130
    read = mbody.from_toml(f"{SURROUNDINGS}{found.file}\n")
    (name,) = {element.name for element in read} - {element.name for element in surroundings()}
    machine = surroundings()
    machine.add(eval(found.python, dict(NAMES)))
    assert type(read[name]) is found.cls
    assert machine[name] == read[name]


def values(law):
    return [law(t) for t in (0.1, 0.7, 1.6)]


@each("kind", LAWS)
def test_both_examples_are_the_same_law(kind):
    found = one("laws", kind)
    text = f"[drivers]\nmotor = {{ angle = 'arm', {found.file} }}\n"
    read = mbody.from_toml(SURROUNDINGS + text)["motor"].law
    machine = surroundings()
    machine.add(mbody.AngleDriver("motor", "arm", eval(found.python, dict(NAMES))))
    assert type(read) is found.cls is type(machine["motor"].law)
    # plain numbers of files are degrees, of Python radians: the examples have units where it counts
    assert values(read) == pytest.approx(values(machine["motor"].law), rel=1e-12)


def test_the_body():
    (found,) = element_reference("Body")
    read = mbody.from_toml('units = "mm-N-s"\n' + found.file)["arm"]
    machine = mbody.Mechanism("m", units="mm-N-s")
    machine.add(eval(found.python, dict(NAMES)))
    assert machine["arm"] == read


@each(("section", "kind"), KINDS)
def test_fields_are_those_of_the_schema(section, kind):
    found = one(section, kind)
    definition = json_schema()["$defs"][found.cls.__name__]
    main_fields = set(found.cls.main)
    words = {kind, *also_written(kind)}
    assert words | {field.name for field in found.fields} - main_fields == set(
        definition["properties"]
    )
    if len(words) > 1:
        assert {one["required"][0] for one in definition["oneOf"]} == words
    required = {field.name for field in found.fields if field.needed} - main_fields
    assert set(definition.get("required", [])) - {kind} <= required
    assert len(found.fields) == len(written_fields(found.cls))


@each(("section", "kind"), KINDS)
def test_what_need_not_be_given_may_be_left_out(section, kind):
    """The example has what is needed; without any one of the needed fields it is refused."""
    found = one(section, kind)
    read = mbody.from_toml(f"{SURROUNDINGS}{found.file}\n")
    (name,) = {element.name for element in read} - {element.name for element in surroundings()}
    needed = {field.name for field in found.fields if field.needed}
    given = {field.name: getattr(read[name], field.name) for field in dataclasses.fields(found.cls)}
    for left_out in needed - set(found.cls.main):
        rest = {key: value for key, value in given.items() if key != left_out}
        with pytest.raises((ModelError, TypeError)):
            machine = surroundings()
            machine.add(found.cls(**rest))


@each(("section", "kind"), KINDS)
def test_every_field_has_a_meaning_and_lines_are_short(section, kind):
    found = one(section, kind)
    assert found.about
    unexplained = [field.name for field in found.fields if not field.meaning]
    assert not unexplained
    prose = str(found).partition("IN A MODEL FILE")[0]
    assert max(map(len, prose.splitlines())) <= 100


@each(("section", "kind"), [*KINDS, *(("laws", kind) for kind in LAWS)])
def test_long_examples_go_on_below_and_are_the_same(section, kind):
    """A hundred letters a line, and what is printed reads as the example in one line."""
    found = one(section, kind)
    text = str(found)
    assert max(map(len, text.splitlines())) <= 100
    file, _, python = text.partition("IN A MODEL FILE")[2].partition("IN PYTHON")
    assert tomllib.loads(textwrap.dedent(file)) == tomllib.loads(found.file)
    shown = ast.parse(textwrap.dedent(python.partition("MEASURES")[0]).strip())
    assert ast.dump(shown) == ast.dump(ast.parse(found.python))


def test_a_name_of_a_class_or_of_several_tables():
    assert element_reference("TorsionSpring")[0].kind == "torsion_spring"
    assert [found.section for found in element_reference("angle")] == ["couplings", "drivers"]


def test_what_is_said_of_several_fields_is_said_once():
    for reference in (one(*pair) for pair in KINDS):
        text = " ".join(str(reference).split())
        for field in reference.fields:
            meaning = " ".join(field.meaning.split())
            if len(meaning) > 60:
                assert text.count(meaning) == 1, (reference.kind, field.name)


@each(("section", "kind"), KINDS)
def test_no_field_refers_to_a_class_that_is_not_explained(section, kind):
    explained = {one.__name__ for kinds in (*SECTIONS.values(), LAWS) for one in kinds.values()}
    for field in one(section, kind).fields:
        for name in re.findall(r"see `(\w+)`", field.meaning):
            assert name in explained, (field.name, field.meaning)


@pytest.mark.parametrize("table", OTHER_TABLES)
def test_the_other_tables_have_an_example_that_reads(table):
    """Within a model of an arm with a motor; the word of one of its rows finds the table, too."""
    arm = "[bodies.arm]\nmass = 1\ninertia = 0.1\npoints = { B = [100, 0] }\n"
    arm += '[joints]\nO = { revolute = ["ground", "arm"] }\n[drivers]\nmotor = { angle = "arm" }\n'
    needed = {"states": '[inputs]\nu = "0 N*m"\n'}.get(table, "")
    example = OTHER_TABLES[table][1]
    assert example.startswith(f"[{table}")
    mbody.from_toml(f'units = "mm-N-s"\n{needed}{example}\n{arm}')
    assert example in reference_overview(table)
