"""Hostile input at the door: it ends in a sentence, soon, and in little memory."""

import json
import threading

import pytest

from mbody import Body, Mechanism, ModelError
from mbody.files.model import from_toml, in_units, to_toml
from mbody.quantities.units import SYMBOLS
from tests.fuzz.properties import guarded, sentence
from tests.support.cases import first_fast
from tests.support.model_text import model_from, text_from

BODY = "[bodies]\na = {}\n"
MOTOR = BODY + '[drivers.m]\nangle = "a"\n'


def refused(text, *words, is_json=False, **more):
    """The sentence with which a model is refused."""
    with pytest.raises(ModelError) as caught:
        guarded(lambda: model_from(text, is_json, **more))
    sentence(caught.value)
    told = str(caught.value)
    assert all(word in told for word in words), told
    return told


def entries(section, entry, count=9000):
    """A section of many entries; N in an entry is its number."""
    lines = (f"e{n} = " + entry.replace("N", str(n)) for n in range(count))
    return f"[{section}]\n" + "\n".join(lines) + "\n"


def law(text):
    return f"{MOTOR}law = {text}\n"


# -- texts that are refused -----------------------------------------------------------------------

LONG = "x" * 900_000
HEX = "0x" + "f" * 900_000
TOML = {
    "empty table names": ('[""]\n', "there is no such key"),
    "not TOML": ("what = is this", "it is no TOML: line 1"),
    "a table twice": ("[bodies.a]\n[bodies.a]\n", "line 2: '[bodies.a]' is there a second time"),
    "a key twice": ("name = 'a'\nname = 'b'\n", "line 2: 'name' is there a second time"),
    "an unknown key": ("[bodies.a]\nmas = 1\n", "line 2: bodies.a.mas", "did you mean 'mass'?"),
    "a wrong dimension": ('[bodies.a]\nmass = "3 mm"\n', "is a length (m)", "a mass (kg)"),
    "an angle in kg": ('[bodies.a]\nguess = "3 kg"\n', "line 2", "is a mass (kg)", "an angle"),
    "no such unit": ('[bodies.a]\nmass = "3 kgg"\n', "there is no unit 'kgg'", "mean 'kg'"),
    "nan": ("[bodies.a]\nmass = nan\n", "line 2: bodies.a.mass: is nan, it must be finite"),
    "inf": ("[bodies.a]\nmass = -inf\n", "is -inf, it must be finite"),
    "1e400": ("[bodies.a]\nmass = 1e400\n", "is inf, it must be finite"),
    "text 1e400": ('[bodies.a]\nmass = "1e400"\n', "evaluates to inf, it must be finite"),
    "a long exponent": ('[bodies.a]\nmass = "1e999999999999"\n', "too large or too small"),
    "a huge whole number": (f"[bodies.a]\nmass = {'9' * 900_000}\n", "very many digits"),
    "a huge hexadecimal number": (f"[bodies.a]\nmass = {HEX}\n", "very many digits"),
    "a huge number for text": (f"name = {HEX}\n", "very many digits"),
    "a huge number of instants": (f'[ask]\nover = "turn"\ninstants = {HEX}\n', "many digits"),
    "a date": ("[bodies.a]\nmass = 2020-01-01\n", "must be a number or text"),
    "a call": ("[bodies.a]\nmass = \"__import__('os')\"\n", "there is no function '__import__'"),
    "another call": ('[bodies.a]\nmass = "exit()"\n', "there is no function 'exit'"),
    "an attribute": ('[bodies.a]\nmass = "().__class__"\n', "contains '.', which is not allowed"),
    "a long formula": (f'[bodies.a]\nmass = "{"1+" * 2000}1"\n', "4001 characters", "at most 2000"),
    "a formula without end": (f'[bodies.a]\nmass = "{LONG}"\n', "at most 2000 are read"),
    "brackets": (f'[bodies.a]\nmass = "{"(" * 900}1"\n', "nested more than 40 deep"),
    "signs": (f'[bodies.a]\nmass = "{"-" * 150}1"\n', "nested more than 40 deep"),
    "powers": (f'[bodies.a]\nmass = "{"(" * 38}1 mm{")^9" * 38}"\n', "is a quantity in m"),
    "many units": (f'[bodies.a]\nmass = "1 {"km " * 600}"\n', "is a quantity in m"),
    "many small units": (f'[bodies.a]\nmass = "1 {"um " * 600}"\n', "is a quantity in m"),
    "many degrees": (f'[bodies.a]\nmass = "(1+1) {"rev " * 490}"\n', "is a quantity in rad"),
    "a law of many parts": (law(f'"{"+".join(["sin(t)"] * 190)}"'), "operations", "at most 200"),
    "parameters in a ring": (entries("parameters", '"eN"'), "depend on each other"),
    "a long key": (f"{LONG} = 1\n", "line 1: xxx", "there is no such key"),
    "a long name": (f"[bodies.{LONG}]\n", "has 900000 characters: give at most 200"),
    "a long unit system": (f'units = "{LONG}"\n', "there is no unit system 'xxx"),
    "a long choice": (f'angle = "{LONG}"\n', "must be 'deg' or 'rad', not 'xxx"),
    "a long body": (
        f'{BODY}[joints]\nj = {{ revolute = ["a", "{LONG}"] }}\n',
        "refers to body 'xxx",
    ),
    "a long point": (
        f'{BODY}[joints]\nj = {{ revolute = ["ground", "a.{LONG}"] }}\n',
        "refers to point 'xxx",
    ),
    "one bare word": ("a" * 900_000, "it is no TOML"),
    "bare words": ("a\n" * 450_000, "it is no TOML: line 1"),
    "quotes": ('"' * 900_000, "it is no TOML"),
    "single quotes": ("'" * 900_000, "it is no TOML"),
    "texts without end": ('"""' + '\n\\"""' * 150_000, "it is no TOML"),
    "other texts without end": ("'''\n''" * 150_000, "it is no TOML"),
    "a key of many parts": ("a." * 400_000, "more than 20 parts"),
    "a quoted key of many parts": ('"a" . ' * 100_000 + "b = 1", "more than 20 parts"),
    "blanks": ("a" + " " * 900_000, "it is no TOML"),
    "returns": ("\r" * 900_000, "it is no TOML: line 1"),
    "lists in lists": ("name = " + "[" * 100_000, "nested too deep: at most 30"),
    "tables in tables": ("name = " + "{a=" * 100_000, "nested too deep: at most 30"),
    "31 levels": ("name = " + "[" * 31 + "]" * 31, "nested too deep: at most 30"),
    "many keys": ("".join(f"k{n} = 1\n" for n in range(48_000)), "line 1: k0", "and 47980 more"),
    "too many keys": ("".join(f"k{n} = 1\n" for n in range(310_000)), "more than 300000 values"),
    "many units that are none": (entries("parameters", '"1 zN"', 40_000), "and 39980 more"),
    "many wrong masses": (entries("bodies", "{ mass = -1 }"), "must not be negative", "and more"),
    "many wrong keys": (entries("bodies", "{ m = 1 }"), "bodies.e0.m", "and 8980 more"),
    "many wrong joints": (entries("joints", '{ revolute = ["x", "y"] }'), "body 'x'", "and more"),
    "many wrong kinds": (entries("joints", "{ revolut = 1 }"), "did you mean 'revolute'?"),
    "a kind among many keys": (
        "[joints]\nj = {" + ", ".join(f"k{n} = 1" for n in range(40_000)) + "}",
        "names no kind of joint",
    ),
    "many wrong measures": (entries("measures", '"qN"'), "no parameter 'q0'", "and more"),
    "many wrong points": (
        "[bodies.a.points]\n" + "".join(f"k{n} = [1]\n" for n in range(20_000)),
        "must be a list of 2, not [1]",
    ),
    "many operations": (entries("loads", f'{{ force = "{"+".join("t" * 190)}" }}', 1000), "150000"),
    "a table law without points": (law("{ table = {} }"), "needs both x and y"),
    "a table law without values": (law("{ table = { x = [1, 2] } }"), "needs both x and y"),
    "an endless segment list": (
        law("{ cam = { period = 1, segments = [" + "{ dwell = 1 }," * 20_000 + "] } }"),
        "the segments last 20000 in all",
    ),
    "a file from text": (law('{ table = { file = "x.csv" } }'), "has no folder beside it"),
    "a measure in nothing": (MOTOR + '[measures]\nm = { of = "a.x", unit = "m*0" }', "is no unit"),
    "a bidi override in a name": ('[bodies."\u202egnp"]\n', "cannot be printed"),
    "a direction in a formula": ('[bodies.a]\nmass = "1\u202e"\n', "contains '\\u202e'"),
}


@first_fast("case", TOML, 33)
def test_toml(case):
    text, *words = TOML[case]
    refused(text, *words)


JSON = {
    "nothing": ("", "it is no JSON: line 1"),
    "a list": ("[1]", "a model is a table, not list"),
    "text": ('"x"', "a model is a table, not str"),
    "null": ("null", "a model is a table, not NoneType"),
    "a key twice": ('{"name": "a", "name": "b"}', "the key 'name' is given twice"),
    "NaN": ('{"g": NaN}', "NaN is no number of a model"),
    "1e400": ('{"g": 1e400}', "line 1: g: is inf, it must be finite"),
    "a long exponent": ('{"g": 1e99999999999999}', "is inf"),
    "a huge whole number": ('{"g": ' + "9" * 900_000 + "}", "very many digits"),
    "401 digits": ('{"g": 1' + "0" * 400 + "}", "is inf"),
    "lists in lists": ("[" * 500_000, "nested too deep"),
    "tables in tables": ('{"a":' * 150_000, "nested too deep"),
    "closed lists": ('{"name": ' + "[" * 900 + "]" * 900 + "}", "nested too deep"),
    "half a character": ('{"name": "\\ud800"}', "'\\ud800' holds half a character"),
    "half a character in a key": ('{"bodies": {"\\udfff": {}}}', "holds half a character"),
    "half a character in a place": ('{"joints": [{"a": ["\\ud800"]}]}', "half a character"),
    "NUL in a name": ('{"bodies": {"\\u0000": {}}}', "cannot be printed"),
    "NUL in a unit system": ('{"units": "\\u0000"}', "there is no unit system '\\x00'"),
    "many keys": (json.dumps({f"k{n}": 1 for n in range(45_000)}), "and 44980 more"),
    "many values": (json.dumps({"name": [1] * 310_000}), "more than 300000 values"),
    "a list for a name": (json.dumps({"name": [1] * 40_000}), "must be text, not [1, 1"),
}


@pytest.mark.parametrize("case", JSON)
def test_json(case):
    text, *words = JSON[case]
    refused(text, *words, is_json=True)


def test_a_text_that_is_too_long():
    refused("#" * 6_000_001, "has more than 6 MB")


@pytest.mark.parametrize(
    "value", [True, None, b"1", 1j, [1], float("nan"), 10**5000, "q", "1 +"], ids=type
)
def test_parameters_that_are_none(value):
    refused("[parameters]\np = 1\n", "p", parameters={"p": value})
    refused("[parameters]\np = 1\n", "there is no parameter 'q'", parameters={"q": 1})


# -- what looks hostile and is not ----------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        'name = "' + "a." * 60 + '"',
        "note = '''" + "a.b.c." * 60 + "'''",
        "# " + "a." * 60,
        'note = """' + '\\"' * 300_000 + '"""',
        "note = '''" + "'a" * 300_000 + "'''",
        'name = "\\u0000\\u202e\\u007f\\U0001F642"',
        'name = \'-- """ --\'',
        '[bodies."a b # [c] = \\"d\\""]\nmass = 1',
        'angle = "rad"\n[parameters]\nw = 2\n' + law('"w*t + 1"'),
        'angle = "rad"\n[parameters]\nw = 2\n[bodies.a]\nguess = "2*w"\nspread = { slender = 1 }',
        'angle = "rad"\n[parameters]\nl = "15 in"\n[bodies.a]\ncg = ["l", "l/2"]',
        'angle = "rad"\n[parameters]\nf = "15 deg"\n[bodies.a]\nguess = "2*f"',
        'angle = "rad"\n' + MOTOR + '[ask]\nat = { a = ["1 + 0.5", "90 deg", 1] }',
        law(f'"{"+".join(["t"] * 200)}"'),
        law(f'"{"(" * 39}sin(t){")" * 39}"'),
    ],
)
def test_unusual_models_are_read_and_written(text):
    made = from_toml(text)
    for as_json in (False, True):
        assert model_from(text_from(made, as_json), as_json) == made


def test_a_plain_angle_of_time_stays_in_radians():
    made = from_toml('angle = "rad"\n' + law('"2*t + 1"'))
    assert made["m"].law.derivatives(0.5) == (2.0, 2.0, 0.0)
    assert 'angle = "rad"' in to_toml(made)


def test_a_number_that_other_units_cannot_hold():
    made = from_toml('units = "km-N-s"\n[bodies.a]\ncg = [1e307, 0]')
    with pytest.raises(ModelError, match=r"1e\+307 is too large a number in mm"):
        in_units(made, "mm-N-s")


def test_lines_of_errors_in_long_texts():
    text = 'note = """' + "x = 1\n" * 100_000 + '"""\n[bodies.a]\nmass = -1\n'
    refused(text, "line 100003: bodies.a.mass: is -1")
    text = '{"note": "\\"",\n"bodies": {"\\u0061": {\n"mass": -1}}}'
    refused(text, "bodies.a.mass: is -1", is_json=True)


def test_an_element_is_added_as_a_whole_or_not_at_all():
    machine = Mechanism(parameters={"p": 1.0})
    machine.add(Body("a", mass="p"))
    before = dict(machine.formulas), set(machine.fixed_parameters)
    for new in ([Body("b", mass="-p")], [Body("b", mass="p"), Body("c", mass="q")]):
        with pytest.raises(ModelError):
            machine.add(*new)
        assert list(machine) == [machine["a"]]
        assert (machine.formulas, machine.fixed_parameters) == before


# -- formulas and units ---------------------------------------------------------------------------


@pytest.mark.parametrize("power", [1, -1])
def test_units_beyond_every_double(power):
    unit = SYMBOLS["km"] ** (200 * power)
    assert unit.factor == (float("inf") if power > 0 else 0.0)
    assert (SYMBOLS["rev"] ** 1000).factor == float("inf")


def test_reading_models_in_threads_is_safe():
    """No shared state: two texts read at once come out as they are."""
    found = {}

    def reads(n):
        for _ in range(20):
            found[n] = from_toml(f"[bodies.b{n}]\nmass = {n + 1}\n")[f"b{n}"].mass

    threads = [threading.Thread(target=reads, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {n: n + 1.0 for n in range(4)}
