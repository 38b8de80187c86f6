"""Model files: round trips to the last bit, the schema, errors with lines, tables, other units."""

import copy
import dataclasses
import json
import math
import os
import time
import tomllib

import jsonschema
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import mbody
from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Damper,
    Distance,
    DistanceDriver,
    Fixed,
    Force,
    Gravity,
    Marker,
    Measure,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
    from_toml,
    gallery,
    kinetostatics,
    polar,
    to_toml,
)
from mbody.files.model import in_units, json_schema
from mbody.files.model.write import as_data
from mbody.laws import (
    SHAPES,
    Cam,
    ConstantAcceleration,
    ConstantSpeed,
    Dwell,
    Harmonic,
    Polynomial,
    Rise,
    Table,
)
from mbody.makers import makers
from mbody.model.body import Guess, SecondMoments, SlenderRod
from mbody.model.joints import CustomJoint
from mbody.model.loads import CentrifugalField
from mbody.model.study import Instants
from mbody.quantities.units import unit_system
from tests.linkages import random_linkage, times_within
from tests.model_text import model_from, text_from
from tests.test_errors import says

# -- random mechanisms ------------------------------------------------------------------------

ODD = ("crank", "a b", "Kurbel-Ö", "曲柄", 'quo"te', "it's", "back\\slash", "#1", "a=b", "[x]")
ODD += ("{y}", "-", "1", "true", "inf", "2024-01-01", "😀", "a,b", "x: y", " led", "'", "$schema")
EXTREME = (5e-324, 1e308, -0.0, 0.0, 1 / 3, 0.1, -2.5e-300, 1e15, 1e16, 123456789.0, 2.0**60)
NAMES = ("P", "tip", "Spitze ü", '"', "p-1", "#", "x", "9")
numbers = st.one_of(st.sampled_from(EXTREME), st.floats(allow_nan=False, allow_infinity=False))
positive = st.one_of(
    st.sampled_from([x for x in EXTREME if x > 0.0]), st.floats(5e-324, 1e308, exclude_min=False)
)
small = st.floats(-100.0, 100.0)
angles = st.one_of(
    st.integers(-720, 720).map(math.radians),
    st.sampled_from([math.radians(22.5), 1 / 3, 5e-324, 1e308, -0.0, 2.0]),
    st.floats(-10.0, 10.0),
)
PARAMETERS = {"a": 2.5, "l": "15 in", "phi": "30 deg", "half": "l/2", "F": "3 lbf", "T": "2 s"}
LENGTHS = st.sampled_from(["l/2", "half + 1 mm", "3 in", "2*a", "hypot(l, half)", "1/4 in"])
TURNS = st.sampled_from(["phi", "2*phi + 1 deg", "60 deg", "0.5 rad", "atan2(l, half)", "0.3*a"])


def mixed(plain, text):
    return st.one_of(plain, plain, text)


lengths, turns = mixed(numbers, LENGTHS), mixed(angles, TURNS)
points = st.one_of(st.tuples(lengths, lengths), st.builds(polar, lengths, turns))


@st.composite
def tables(draw, x, y):
    count = draw(st.integers(4, 9))
    ends = np.cumsum(draw(st.lists(st.floats(0.01, 5.0), min_size=count, max_size=count)))
    values = draw(st.lists(y, min_size=count, max_size=count))
    periodic = draw(st.booleans())
    if periodic:
        values[-1] = values[0]
    outside = draw(st.sampled_from(["error", "hold", "line"]))
    between = draw(st.sampled_from([None, "linear", "pchip", "spline"]))
    end = None
    if between in (None, "spline"):
        end = draw(st.sampled_from([None, "natural", "not-a-knot", "clamped"]))
    return Table(ends, values, periodic, end, outside, between)


@st.composite
def cams(draw):
    rise = draw(st.floats(0.1, 9.0))
    shape, other = draw(st.sampled_from(SHAPES)), draw(st.sampled_from(SHAPES))
    first = Rise(shape, rise, draw(st.floats(0.0, 1.0)), 0.5, draw(small))
    rest = [Dwell(draw(st.floats(0.1, 1.0)))] if draw(st.booleans()) else []
    return Cam([first, *rest, Rise(other, -rise, 0.0, 1 / 3)], 4.0)


def laws(value, texts):
    """Every kind of law, with numbers of its values drawn from `value`."""
    return st.one_of(
        value,
        st.builds(ConstantSpeed, value, numbers),
        st.builds(ConstantAcceleration, value, numbers, mixed(numbers, st.just("a"))),
        st.lists(numbers, min_size=1, max_size=5).map(Polynomial),
        st.builds(Harmonic, value, numbers, numbers, turns),
        tables(small, small),
        st.builds(Rise, st.sampled_from(SHAPES), value, numbers, positive, value),
        cams(),
        st.sampled_from(texts),
    )


angle_laws = laws(turns, ["60 deg + 25 rad/s*t", "phi*sin(3 rad/s*t)", "0.3*sin(2*t)", "a*t^2"])
length_laws = laws(lengths, ["l + 3 mm/s*t", "half*(1 + sin(t/(1 s)))", "2 + sin(3*t)", "exp(t)"])
force_laws = laws(mixed(numbers, st.just("F")), ["F*sin(5 rad/s*t)", "80*t^2 + 1", "9 N*cos(a*t)"])
speed_laws = laws(numbers, ["300 rpm", "2 rad/s + 3 rad/s^2*t", "a*sin(t)"])
momentum_laws = laws(numbers, ["3 kg*m^2/s", "F*l*t", "2*t"])
torque_laws = laws(numbers, ["F*l*sin(5 rad/s*t)", "t", "2 N*m*cos(3*t)"])
of_length = laws(numbers, ["3*x + 2*x^3", "20 N/mm*x", "F*atan(x/l)/(1 rad)"])
of_rate = laws(numbers, ["3*x", "F*x/(1 m/s)", "tan(0.1*x)"])
of_angle = laws(numbers, ["F*l*sin(x)", "2*x", "max(x, 0)"])


@st.composite
def machines(draw):
    """A mechanism of two bodies and a random choice of all that a file can hold."""
    names = draw(st.permutations(ODD))
    one, two, *rest = names
    texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
    machine = Mechanism(
        draw(texts),
        units=draw(st.sampled_from(["SI", "mm-N-s", "in-lbf-s", "cm-kN-s"])),
        g=draw(st.one_of(st.none(), st.floats(1e-3, 1e5), st.just("9.81 m/s^2"))),
        ground={key: draw(points) for key in draw(st.sets(st.sampled_from(NAMES)))},
        parameters=PARAMETERS,
        source=draw(texts),
        note=draw(texts),
    )
    for name in (one, two):
        mass = draw(st.sampled_from(["mass", "weight", None]))
        inertia = st.sampled_from(["a", "3 kg*m^2"])
        spread = st.one_of(
            st.sampled_from([None, "point", SecondMoments(2.0, 1 / 3, 0.1)]),
            st.builds(SlenderRod, angles),
        )
        guess = st.one_of(
            st.none(), angles, st.tuples(numbers, numbers, turns), st.builds(Guess, x=numbers)
        )
        machine.add(
            Body(
                name,
                inertia=draw(mixed(st.one_of(st.just(-0.0), positive), inertia)),
                cg=draw(points),
                points={key: draw(points) for key in draw(st.sets(st.sampled_from(NAMES)))},
                guess=draw(guess),
                spread=draw(spread),
                **({mass: draw(mixed(positive, st.just("a")))} if mass else {}),
            )
        )

    def place(name):
        bodies = machine[name].points if name != "ground" else machine.ground.points
        where = st.one_of(points, st.just((0.0, 0.0)))
        if bodies:
            where = st.one_of(where, st.sampled_from(sorted(bodies)))
        marker = st.builds(Marker, st.just(name), where, st.one_of(st.just(0.0), turns))
        return draw(marker)

    def pair():
        i, j = draw(st.permutations([one, two, "ground"]))[:2]
        return {"i": place(i), "j": place(j)}

    def bodies():
        return dict(zip(("body", "by"), draw(st.permutations([one, two, "ground"])), strict=False))

    def stiff(key, strategy, more):
        if draw(st.booleans()):
            return {"law": draw(strategy)}
        return {key: draw(numbers.map(abs)), **{k: draw(v) for k, v in more.items()}}

    other = st.sampled_from([two, "ground"])
    apart = mixed(positive, st.just("l + t*a m/s"))
    kinds = (
        lambda: Revolute(rest.pop(), **pair()),
        lambda: Prismatic(rest.pop(), **pair()),
        lambda: Fixed(rest.pop(), **pair()),
        lambda: Distance(rest.pop(), **pair(), length=draw(mixed(positive, st.just("l")))),
        lambda: AngleDriver(rest.pop(), one, draw(angle_laws), draw(other)),
        lambda: DistanceDriver(rest.pop(), **pair(), law=draw(apart)),
        lambda: CoordinateDriver(rest.pop(), **pair(), law=draw(length_laws)),
        lambda: Force(rest.pop(), place(one), draw(force_laws), draw(turns), draw(st.booleans())),
        lambda: Torque(rest.pop(), **bodies(), value=draw(torque_laws)),
        lambda: Gravity(draw(st.sampled_from(["gravity", rest.pop()])), draw(small), draw(small)),
        lambda: CentrifugalField(rest.pop(), place("ground"), draw(speed_laws)),
        lambda: CentrifugalField(
            rest.pop(),
            place("ground"),
            momentum=draw(momentum_laws),
            inertia=draw(numbers.map(abs)),
        ),
        lambda: Spring(rest.pop(), **pair(), **stiff("stiffness", of_length, {"preload": numbers})),
        lambda: Damper(rest.pop(), **pair(), **stiff("coefficient", of_rate, {})),
        lambda: TorsionSpring(
            rest.pop(), **bodies(), **stiff("stiffness", of_angle, {"free_angle": turns})
        ),
        lambda: TorsionDamper(rest.pop(), **bodies(), **stiff("coefficient", of_rate_angle, {})),
    )
    for make in draw(st.lists(st.sampled_from(kinds), min_size=1, max_size=6)):
        element = make()
        if element.name not in machine:
            machine.add(element)
    machine.measures |= draw(
        st.dictionaries(
            st.sampled_from(ODD),
            st.sampled_from([Measure("t*2"), Measure("t", "ms"), Measure("half + t*l/T", "ft")]),
            max_size=3,
        )
    )
    drivers = [d.name for d in machine.drivers]
    if drivers:
        angular = machine[drivers[0]].rows == "a"
        asks = [
            Instants(over="turn", instants=9),
            Instants(over=drivers[0]),
            Instants(at={"t": [0, "T/2", "30 ms"]}),
        ]
        asks += [Instants(at={drivers[0]: [draw(angles), "0.25", "phi" if angular else "l"]})]
        machine.ask = draw(st.sampled_from([None, *asks]))
    return machine


of_rate_angle = laws(numbers, ["2*x", "F*l*x/(1 rad/s)"])


def bits(value):
    """All that a value holds, floats to the last bit and the sign of zero."""
    if dataclasses.is_dataclass(value):
        return type(value).__name__, [
            bits(getattr(value, f.name)) for f in dataclasses.fields(value)
        ]
    if isinstance(value, dict):
        return {key: bits(part) for key, part in value.items()}
    if isinstance(value, (tuple, list)):
        return [bits(part) for part in value]
    return float(value).hex() if isinstance(value, float) else value


def whole(machine):
    elements = [
        bits(own) for own in (machine.bodies, machine.joints, machine.drivers, machine.loads)
    ]
    return [bits(machine.ground), machine.g.hex(), *elements, bits(machine.measures)]


@settings(max_examples=120, suppress_health_check=list(HealthCheck))
@given(machines())
def test_any_mechanism_comes_back_to_the_last_bit(machine):
    for as_json in (False, True):
        text = text_from(machine, as_json)
        again = model_from(text, as_json)
        assert whole(again) == whole(machine)
        open_angles = {f.angle for f in again.formulas.values()}
        assert again == machine, open_angles
        assert text_from(again, as_json) == text  # and writes the same
        data = json.loads(text) if as_json else tomllib.loads(text)
        SCHEMA.validate(data)


SCHEMA = jsonschema.Draft202012Validator(json_schema())


@pytest.mark.parametrize("seed", range(5))
def test_linkages_run_alike_to_the_last_bit(seed, tmp_path):
    """Every kind of joint and load: the same numbers, in the same order, give the same bits."""
    machine, turn = random_linkage(seed, 2, sliders=seed % 2 == 0, extras=seed > 1)
    times = times_within(machine, 0.6 * turn, 4)
    run = kinetostatics(machine, t=times)
    for ending in ("toml", "json"):
        file = tmp_path / f"model.{ending}"
        mbody.save(machine, file)
        again = mbody.load(file)
        assert again == machine and whole(again) == whole(machine)
        other = kinetostatics(again, t=times)
        np.testing.assert_array_equal(other.effort("motor"), run.effort("motor"))
        for joint in machine.joints:
            for key in ("fx", "fy", "torque"):
                a, b = (getattr(r.reaction(joint.name), key) for r in (run, other))
                np.testing.assert_array_equal(a, b)


def test_text_stays_text():
    machine = gallery.load("norton_fourbar")
    text = to_toml(machine)
    for words in (
        'weight  = "1.5 lbf"',
        '"9*cos(45 deg) + 3*cos(100 deg)"',
        '"-40 rad/s^2"',
        "t = 0",
    ):
        assert words in text
    assert "rad" not in text.replace("rad/s", "")


def test_plain_radians_of_python_are_said():
    machine = Mechanism("m", parameters={"phi": 0.3})
    machine.add(Body("b", points={"A": polar(1.0, "2*phi")}), Revolute("O", "ground", "b"))
    machine.add(AngleDriver("d", "b", "0.3*sin(2*t)"))
    text = to_toml(machine)
    assert 'angle = "rad"' in text and from_toml(text) == machine
    # beside plain degrees of a file, what is in radians says so
    mixture = from_toml('parameters = { phi = 3 }\n[bodies.c]\npoints.A = { r = 1, angle = "phi" }')
    mixture.add(Body("b", points={"A": polar(1.0, "2*phi")}))
    again = from_toml(to_toml(mixture))
    assert again["b"].points["A"].angle == 6.0
    assert again["c"].points["A"].angle == math.radians(3.0)


def test_python_code_is_refused():
    machine = makers.four_bar(1, 3, 2, 3.5)
    for element, words in (
        (Torque("T", "crank", value=math.sin), ("'T' follows a Function of Python",)),
        (CustomJoint("C", "crank", "rocker"), ("'C' is a CustomJoint, Python code of your own",)),
    ):
        other = copy.copy(machine)
        other.add(element)
        with says(ModelError, *words, "model file does not carry"):
            to_toml(other)


def test_words_of_numpy():
    machine = makers.four_bar(1, 3, 2, 3.5)
    machine.add(Force("F", "rocker", Table([0, 1], [1, 1], periodic=np.True_), follows=np.True_))
    assert from_toml(to_toml(machine)) == machine
    assert model_from(text_from(machine, True), True) == machine


def test_titles_are_text(tmp_path):
    with says(ModelError, "the source of a mechanism must be text, not 3"):
        Mechanism("m", source=3)
    with says(ModelError, "a name may not hold a dot"):
        Mechanism("m", measures={"a.b": "t"})
    with says(ModelError, "cannot be written", "is no character"):
        mbody.save(Mechanism("\ud800"), tmp_path / "m.toml")
    with says(ModelError, "cannot be written"):
        mbody.save(Mechanism("m"), tmp_path / "no" / "m.toml")
    long = Mechanism("m" * 300)
    assert from_toml(to_toml(long)) == long


# -- the schema -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", gallery.names())
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


# -- errors -----------------------------------------------------------------------------------

CRANK = 'name = "m"\n[bodies.crank]\nmass = 1\n[joints]\nO = { revolute = ["ground", "crank"] }\n'


def problems(text, is_json=False):
    with pytest.raises(ModelError) as caught:
        model_from(text, is_json, name="file")
    assert all(f"line {line}: " in str(caught.value) for line, *_ in caught.value.problems if line)
    return [(line, field) for line, field, _ in caught.value.problems]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[bodies.crank]\nmass = 1\nfoo = 2\n", [(3, "bodies.crank.foo")]),
        ("[bodies.crank]\r\nmass = 1\r\nfoo = 2\r\n", [(3, "bodies.crank.foo")]),
        ("bodies.crank.mass = 1\nbodies.crank.foo = 2\n", [(2, "bodies.crank.foo")]),
        ("[bodies]\ncrank.mass = 1\n\ncrank.foo = 2\n", [(4, "bodies.crank.foo")]),
        ("[bodies]\n# [x] = {\ncrank = { mass = 1, foo = 2 }\n", [(3, "bodies.crank.foo")]),
        ("[bodies.'a b']\nmass = 1\n\"foo\" = 2\n", [(3, "bodies.a b.foo")]),
        ('[bodies."ü\\"]"]\nmass = "]"\nfoo = 2', [(2, 'bodies.ü"].mass'), (3, 'bodies.ü"].foo')]),
        ("[bodies.c.points]\nA = [\n  0, # ]\n  0,\n]\nB = [1]\n", [(6, "bodies.c.points.B.1")]),
        ("[bodies.crank.points]\nA = [\n  0,\n  'x y',\n]\n", [(2, "bodies.crank.points.A.1")]),
        ('note = """\n[bodies]\nfoo = "1"\n"""\n[ground]\nfoo = 1\n', [(6, "ground.foo")]),
        ("note = '''\n[ground]\n'''\nfoo = 1\n", [(4, "foo")]),
        ('note = "[\\"{ # "   # a [ bracket\nfoo = 1\n', [(2, "foo")]),
        ("[ bodies . crank ]\nmass = '2 s'\n\n[bodies.\"crank\".points]\nA = 3\n",
         [(2, "bodies.crank.mass"), (5, "bodies.crank.points.A")]),
        ("[drivers.m]\nangle = 'c'\n[drivers.m.law.constant_speed]\nvalue = 1\nspeed = '2 m'\n",
         [(5, "drivers.m.law.constant_speed.speed")]),
        ("[drivers.m.law.cam]\nperiod = 1\n[[drivers.m.law.cam.segments]]\ndwell = 'x'\n", None),
        ("[measures]\na = 't +'\n[ask]\nover = 'x'\n", [(2, "measures.a"), (4, "ask")]),
        ("g = -3\n", [(1, "g")]),
        ("units = 'inch'\n", [(1, "units")]),
        ("[parameters]\na = 1\nb = '2*zz'\n", [(3, "parameters.b")]),
        (CRANK + "A = { revolute = ['crank', 'crank.Q'] }\n", [(6, "joints.A")]),
    ],
)  # fmt: skip
def test_lines_of_toml(text, expected):
    found = problems(text)
    if expected is None:  # an array of tables: the line of its header or nearer
        assert found[0][0] in (1, 3, 4)
    elif expected == [(2, "measures.a"), (4, "ask")]:
        assert found[0] == (2, "measures.a") and found[1][0] in (3, 4)
    else:
        assert found == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('{"bodies":\n {"crank":\n {"mass": 1,\n "foo": 2}}}', [(4, "bodies.crank.foo")]),
        ('{"note": "{\\"foo\\": [",\n\n"foo": 2}', [(3, "foo")]),
        ('{"bodies": {"a\\u0062":\r\n{"foo": [1,\r\n2]}}}', [(2, "bodies.ab.foo")]),
        ('{"a": [[1, {"b":\n 2}],\n 3],\n "g": 1}', [(1, "a")]),
        (
            '{"drivers": {"m": {"angle": "c", "law": {"cam": {"period": 1, "segments": [\n'
            '{"dwell": 1},\n{"dwell":\n"x y"}]}}}}}',
            [(3, "drivers.m.law.cam.segments.1.dwell")],
        ),
    ],
)
def test_lines_of_json(text, expected):
    assert problems(text, is_json=True) == expected


def test_all_that_is_wrong_at_once():
    text = CRANK + (
        'A = { revolut = ["ground", "crank"] }\n'
        'B = { revolute = ["ground.Q", "crank"] }\n'
        '[loads]\nS = { spring = ["ground", "crank.P"], stiffness = "10 lb/in" }\n'
        "T = { torque = 3, bodi = 'crank' }\n[bodies.rod]\nmas = 3\nmass = '2 m'\n"
    )
    with pytest.raises(ModelError) as caught:
        from_toml(text, name="file")
    told = str(caught.value)
    assert told.startswith("file:\n  line 6: joints.A: names no kind of joint")
    for words in (
        "it has 'revolut', did you mean 'revolute'?",
        "line 9: loads.S.stiffness: '10 lb/in' is",
        "did you mean '10 lbf/in'?",
        "line 10: loads.T.bodi: there is no such key, did you mean 'body'?",
        "line 12: bodies.rod.mas: there is no such key, did you mean 'mass'?",
        "line 13: bodies.rod.mass: '2 m' is a length (m), where a mass (kg) is wanted",
    ):
        assert words in told
    # what the shape has right is tried too, all of it; what follows from it is not told
    good_shape = CRANK + (
        'A = { revolute = ["rod.A", "crank"] }\nB = { revolute = ["ground.Q", "crank"] }\n'
        "[bodies.rod]\nmass = -1\n[loads]\nF = { force = 1, at = 'crank.Z' }\n"
    )
    assert [field for _, field in problems(good_shape)] == ["joints.B", "bodies.rod", "loads.F"]


def test_very_many_errors_are_counted_in_time():
    text = CRANK + "[loads]\n" + "".join(f"F{n} = {{ forc = 1 }}\n" for n in range(5000))
    began = time.perf_counter()
    with pytest.raises(ModelError, match="and 4980 more") as caught:
        from_toml(text)
    assert str(caught.value).count("\n") == 21
    assert time.perf_counter() - began < 5.0  # 1.0 here; reading all again for each took a minute


@pytest.mark.parametrize(
    "text",
    [
        'note = "' + "a" * 900_000 + '"\n',
        'note = "' + "a." * 300_000 + '"\n',
        'note = "' + "a ." * 200_000 + '"\n',
        'note = "' + "'" * 500_000 + '"\n',
        "x" * 900_000,
        "a." * 400_000 + "a = 1",
        "a = " + "[" * 400_000,
        "[" * 400_000,
        "a = '" + '"' * 500_000 + "'",
    ],
    ids=range(9),
)
def test_large_texts_are_read_or_refused_in_time(text):
    began = time.perf_counter()
    try:
        assert from_toml(text).name == "mechanism"
    except ModelError as error:
        assert len(str(error)) < 400
    assert time.perf_counter() - began < 3.0  # linear: 0.2 here


@pytest.mark.parametrize(
    ("text", "is_json", "words"),
    [
        ("a = \n", False, "file: it is no TOML: line 1"),
        ("a = 1\na = 2\n", False, "it is no TOML: line 2"),
        ("{", True, "it is no JSON: line 1"),
        ('{"g": NaN}', True, "NaN is no number of a model"),
        ('{"g": 1, "g": 2}', True, "the key 'g' stands twice"),
        ("[1]", True, "a model is a table, not list"),
        ("g = nan", False, "line 1: g: is nan, it must be finite"),
        ("g = inf", False, "line 1: g: is inf, it must be finite"),
        ("g = " + "9" * 400, False, "line 1: g: is inf"),
        ("g = 2024-01-01", False, "line 1: g: must be a number or text such as '2 mm'"),
        ("bodies = 3", False, "line 1: bodies: must be a table, not 3"),
        ("[bodies.'a.b']", False, "'a.b': a name may not hold a dot"),
        ("[bodies.' ']", False, "needs a name"),
        ("[ask]\nat = { t = [] }", False, "at.t is empty"),
        ("[ask]\nat = { t = 0 }\nover = 'turn'", False, "give at or over, not both"),
        ("[ask]\nat = { t = 0, m = 1 }\n", False, "there is no driver 'm'"),
        (" " * 6_000_001, False, "more than 6 MB"),
        ("a = " + "{b=" * 31 + "1" + "}" * 31, False, "nested too deep: at most 30"),
        ('{"a":' * 100_000, True, "nested too deep"),
    ],
)
def test_what_is_no_model(text, is_json, words):
    with pytest.raises(ModelError) as caught:
        model_from(text, is_json, name="file")
    assert words in str(caught.value) and str(caught.value).startswith("file: ")


# -- tables beside the model --------------------------------------------------------------------

TABLED = """
[bodies.crank]
[joints]
O = { revolute = ["ground", "crank"] }
[drivers.motor]
angle = "crank"
law = { table = { file = "FILE" } }
"""


def tabled(folder, content, name="lift.csv", head=""):
    folder.mkdir(exist_ok=True)
    if content is not None:
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    (folder / "m.toml").write_text(head + TABLED.replace("FILE", name))
    return mbody.load(folder / "m.toml")["motor"].law


@pytest.mark.parametrize(
    "content",
    [
        "0,0\n1,30\n2,-90\n",
        "time,angle\n0,0\n1,30\n2,-90\n",
        "\ufefft [s],phi [deg],remark\r\n\r\n 0 , 0 ,x\r\n1,3e1,y\r\n2,-90.0,z\r\n",
        '"t","phi"\n"0","0"\n"1","30"\n"2","-90"',
    ],
)
def test_tables_with_and_without_a_header(content, tmp_path):
    """The same points as in the model itself: plain angles are degrees, or what the file says."""
    inline = TABLED.replace('file = "FILE"', "x = [0, 1, 2], y = [0, 30, -90]")
    law = tabled(tmp_path, content)
    assert law == from_toml(inline)["motor"].law
    assert law.y == (0.0, math.radians(30.0), math.radians(-90.0))
    head = 'angle = "rad"\n'
    assert tabled(tmp_path, content, head=head) == from_toml(head + inline)["motor"].law
    machine = mbody.load(tmp_path / "m.toml")
    assert from_toml(to_toml(machine)) == machine


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "at least 2 points"),
        ("0,0\n", "at least 2 points"),
        ("t,phi\nx,phi\n0,1\n", "row 2 has no two numbers: ['x', 'phi']"),
        ("0,0\n1\n", "row 2 has no two numbers: ['1']"),
        ("0;0\n1;30\n", "row 2 has no two numbers"),
        ("0,nan\n1,2\n2,3\n", "row 1 has no two numbers"),
        ("0,x\n1,2\n2,3\n", "row 1 has no two numbers"),  # half a row is no header
        ("0,0\n1,inf\n", "row 2 has no two numbers"),
        ("0,0\n0,1\n", "x must increase"),
        (b"\xff\xfe0,0", "no text of comma-separated values"),
        (b"0,0\n" * 2_500_001, "larger than 10 MB"),
    ],
)
def test_tables_that_are_none(content, words, tmp_path):
    with pytest.raises(ModelError) as caught:
        tabled(tmp_path, content)
    assert words in str(caught.value) and "line 7: drivers.motor.law" in str(caught.value)


def test_tables_lie_below_the_model(tmp_path):
    (tmp_path / "secret.csv").write_text("0,0\n1,1\n")
    home = tmp_path / "home"
    (home / "data").mkdir(parents=True)
    good = "0,0\n1,1\n"
    assert tabled(home, good, "data/lift.csv").y[1] == math.radians(1.0)
    assert tabled(home, None, "data/../data/lift.csv").x == (0.0, 1.0)
    (home / "inside.csv").symlink_to(home / "data" / "lift.csv")
    assert tabled(home, None, "inside.csv").x == (0.0, 1.0)
    (home / "out.csv").symlink_to(tmp_path / "secret.csv")
    (home / "up").symlink_to(tmp_path)
    (home / "loop.csv").symlink_to(home / "loop.csv")
    os.mkfifo(home / "pipe.csv")
    outside = ("../secret.csv", "data/../../secret.csv", "out.csv", "up/secret.csv")
    for name in (*outside, str(tmp_path / "secret.csv"), str(home / "data" / "lift.csv")):
        with says_in_file("lies outside the folder of the model"):
            tabled(home, None, name)
    for name in ("no.csv", "data", "", ".", "loop.csv", "pipe.csv", "a\\\\u0000b", "x" * 300):
        with says_in_file("there is no file", "lies outside"):
            tabled(home, None, name)
    with says_in_file("a model from text has no folder"):
        from_toml(TABLED.replace("FILE", "data/lift.csv"))
    both = TABLED.replace('file = "FILE"', 'file = "data/lift.csv", x = [0, 1]')
    with says_in_file("give x and y, or the file that has them"):
        from_toml(both, folder=home)


class says_in_file:
    """The block ends in a ModelError that holds one of the words."""

    def __init__(self, *words):
        self.words = words

    def __enter__(self):
        return self

    def __exit__(self, kind, error, _):
        assert kind is ModelError, error
        assert any(word in str(error) for word in self.words), error
        return True


def test_files_that_cannot_be_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "bytes.toml").write_bytes(b"name = '\xff'")
    (tmp_path / "large.toml").write_bytes(b"#" * 6_000_001)
    for name, words in (
        ("none.toml", "there is no file"),
        (".", "is a folder"),
        ("pipe.toml", "is no ordinary file"),
        ("bytes.toml", "is no text: byte 9 is not UTF-8"),
        ("large.toml", "more than 6 MB"),
    ):
        with says_in_file(words):
            mbody.load(tmp_path / name)
    (tmp_path / "bom.JSON").write_bytes(b'\xef\xbb\xbf{"name": "x"}')
    assert mbody.load(tmp_path / "bom.JSON").name == "x"


def test_parameters_from_outside():
    text = 'name = "m"\n[parameters]\na = "1 in"\nb = "2*a"\n[bodies.c]\npoints.A = ["b", 0]\n'
    assert from_toml(text)["c"].points["A"][0] == pytest.approx(0.0508, rel=1e-15)
    assert from_toml(text, parameters={"a": "1 m"})["c"].points["A"][0] == 2.0
    assert from_toml(text, parameters={"b": 5})["c"].points["A"][0] == 5.0
    for given_parameters, words in (
        ({"z": 1}, "model: there is no parameter 'z' (there are: 'a', 'b')"),
        ({"a": None}, "parameter 'a' must be a number, not None"),
        ({"a": "1 kg"}, "is a mass (kg), where a length"),
        ({"a": "2 +"}, "parameter 'a'"),
    ):
        with says_in_file(words):
            from_toml(text, parameters=given_parameters)


# -- other units ------------------------------------------------------------------------------


def ratio(dimension, old, new):
    return float(unit_system(old).unit(dimension).ratio / unit_system(new).unit(dimension).ratio)


def compare(run, other, tolerance):
    """Efforts, reactions and motion of one mechanism in two unit systems."""
    old, new = run.mechanism.units, other.mechanism.units
    force, torque, length = (ratio(key, old, new) for key in ("force", "torque", "length"))
    greatest = max(run.reaction(joint.name).magnitude.max() for joint in run.mechanism.joints)
    for driver in run.mechanism.drivers:
        a, b = run.effort(driver.name), other.effort(driver.name)
        size = torque if driver.rows == "a" else force
        arm = run.system.length if driver.rows == "a" else 1.0
        assert_allclose(b, a * size, atol=tolerance * size * max(np.abs(a).max(), greatest * arm))
    for joint in run.mechanism.joints:
        a, b = run.reaction(joint.name), other.reaction(joint.name)
        for key, size, arm, sure in zip(
            ("fx", "fy", "torque"), (force, force, torque), (1.0, 1.0, run.system.length), a.unique,
            strict=True,
        ):  # fmt: skip
            if sure:
                one, two = getattr(a, key), getattr(b, key)
                assert_allclose(two, one * size, atol=tolerance * size * greatest * arm)
    rate = ratio("frequency", old, new)
    for body in run.mechanism.bodies:
        a, b = run[body.name], other[body.name]
        for key, size in (("x", length), ("angle", 1.0), ("vy", length * rate),
                          ("alpha", rate**2)):  # fmt: skip
            one = getattr(a, key)
            scale = np.abs(one).max() + (run.system.length if key == "x" else 1.0)
            assert_allclose(getattr(b, key), one * size, atol=tolerance * size * scale)


#: Loops are closed to a last correction of 1e-12 of the size at most, mostly to rounding.
CLOSED = 1e-12


def at_its_instants(machine):
    ask = machine.ask
    if ask.over:
        return kinetostatics(machine, turn=True, instants=13)
    return kinetostatics(machine, t=[machine.number(t, "time", "ask", "t") for t in ask.at["t"]])


@pytest.mark.parametrize("name", [n for n in gallery.names() if gallery.load(n).ask])
def test_the_gallery_in_other_units(name):
    machine = gallery.load(name)
    run = at_its_instants(machine)
    for units in ("SI", "in-lbf-s", "cm-kN-s"):
        other = in_units(machine, units)
        assert other.units.name == units
        compare(run, at_its_instants(other), 20 * CLOSED)
        back = in_units(other, machine.units)
        compare(run, at_its_instants(back), 20 * CLOSED)
        assert back.units == machine.units and back.measures == machine.measures
        assert {k: len(v) for k, v in back.ask.at.items()} == {
            k: len(v) for k, v in machine.ask.at.items()
        }


@pytest.mark.parametrize("seed", range(5))
def test_linkages_in_other_units(seed):
    machine, turn = random_linkage(seed, 2, sliders=seed % 2 == 0, extras=seed > 1)
    times = times_within(machine, 0.6 * turn, 4)
    run = kinetostatics(machine, t=times)
    for units in ("mm-N-s", "ft-lbf-s", "mm-N-ms"):
        other = in_units(machine, units)
        there = kinetostatics(other, t=times * ratio("time", "SI", units))
        compare(run, there, 50 * CLOSED)  # two closures, times the condition of the loops
        compare(run, kinetostatics(in_units(other, "SI"), t=times), 50 * CLOSED)


def test_a_batch_of_units_for_laws_and_parameters():
    """Laws with units go along; parameters of any dimension, also where one is called as a unit."""
    machine = Mechanism(
        "m",
        units="SI",
        parameters={"f": "5 Hz", "m": "2 kg", "T": "3 N*(1 m)", "rho": "5 g/cm^3", "q": "sqrt(2 m)",
                    "n": 3.0, "k": "2 N*(1 m)/(1 rad)"},
    )  # fmt: skip
    machine.add(Body("b", mass="m", points={"A": ("q^2/2", 1)}), Revolute("O", "ground", "b"))
    machine.add(AngleDriver("d", "b", "0.5 rad*sin(2*pi*f*t)"))
    machine.add(
        Torque("M", "b", value="T*cos(n*f*t)"), Spring("s", "ground", "b.A", law="0.009 N/mm*x")
    )
    machine.ask = Instants(at={"t": [0.1, "50 ms", "0.2"]})
    other = in_units(machine, "mm-N-ms")
    assert [v for v in other.ask.at["t"]] == [100.0, 50.0, 200.0]
    assert other["b"].points["A"] == pytest.approx((1000.0, 1000.0), rel=1e-15)
    for name, old in machine.scope.names.items():
        new = other.scope.names[name]
        size = ratio(old.dimension, "SI", "mm-N-ms") if old.dimension else 1.0
        assert new.dimension == old.dimension
        assert new.value == pytest.approx(old.value * size, rel=2e-15)
    assert other["d"].law(30.0) == pytest.approx(machine["d"].law(0.03), rel=1e-14)
    assert other["M"].value(30.0) == pytest.approx(1000 * machine["M"].value(0.03), rel=1e-14)
    assert other["s"].law(20.0) == pytest.approx(machine["s"].law(0.02), rel=1e-14)
    assert in_units(machine, "SI") is machine


@pytest.mark.parametrize(
    ("law", "units"),
    [("5*sin(x)", "mm-N-s"), ("5 N*sin(x)", "mm-N-s"), ("5 N*cos(2*tan(x))", "in-lbf-s")],
)
def test_plain_laws_do_not_change_their_meaning(law, units):
    machine = Mechanism("m")
    machine.add(Body("b"), Spring("s", "ground", "b", law=law))
    with says_in_file("is of plain numbers, which cannot be taken to other units"):
        in_units(machine, units)


def test_plain_times_go_where_time_is_the_same():
    machine = Mechanism("m")
    machine.add(Body("b"), Force("F", "b", "5 N*sin(3*t)"))
    assert in_units(machine, "mm-N-s")["F"].value(0.4) == machine["F"].value(0.4)
    with says_in_file("plain numbers"):
        in_units(machine, "mm-N-ms")


# 1 in = 0.0254 m, 1 lbf = 4.4482216152605 N, 386 in/s² = 9.8044 m/s²; exact, all of it
NORTON_SI = """
name  = "Norton, example 11-3, told in SI units"
units = "SI"
g     = "9.8044 m/s^2"

[ground]
points = { O2 = [0, 0], O4 = ["482.6 mm", 0] }

[bodies.crank]
weight  = "6.67233242289075 N"
inertia = "0.0451939316110466800 kg*m^2"
cg      = { r = "76.2 mm", angle = "30 deg" }
points  = { O2 = [0, 0], A = ["0.127 m", 0] }

[bodies.coupler]
weight  = "34.25130643750585 N"
inertia = "0.16947724354142505 kg*m^2"
cg      = { r = "22.86 cm", angle = "45 deg" }
points  = { A = [0, 0], B = ["0.381 m", 0], P = [
    "228.6 mm*cos(45 deg) + 76.2 mm*cos(100 deg)",
    "228.6 mm*sin(45 deg) + 76.2 mm*sin(100 deg)",
] }
guess   = "25 deg"

[bodies.rocker]
weight  = "25.7996853685109 N"
inertia = "0.09038786322209336 kg*m^2"
cg      = ["127 mm", "0 m"]
points  = { O4 = [0, 0], B = ["0.254 m", 0] }
guess   = "110 deg"

[joints]
O2 = { revolute = ["ground.O2", "crank.O2"] }
A  = { revolute = ["crank.A", "coupler.A"] }
B  = { revolute = ["coupler.B", "rocker.B"] }
O4 = { revolute = ["ground.O4", "rocker.O4"] }

[drivers.motor]
angle = "crank"
law   = "60 deg + 25 rad/s*t - 20 rad/s^2*t^2"

[loads]
F_P = { force = "355.85772922084 N", at = "coupler.P", angle = "330 deg" }
T_4 = { torque = "13.5581794833140040 N*m", body = "rocker" }

[measures]
T12 = { of = "motor.effort", unit = "lbf*in" }
"""


def test_norton_in_si_is_norton_in_inches():
    """The same machine by two ways: the book's inches, and text in SI units by hand."""
    inches, metres = gallery.load("norton_fourbar"), from_toml(NORTON_SI)
    for t in ([0.0], [0.0, 0.1, 0.2]):
        book, ours = (kinetostatics(machine, t=t) for machine in (inches, metres))
        compare(book, ours, 1e-12)
        compare(ours, kinetostatics(in_units(inches, "SI"), t=t), 1e-12)
        compare(book, kinetostatics(in_units(metres, "in-lbf-s"), t=t), 1e-12)
    torque = kinetostatics(metres).effort("motor")[0]
    assert torque == pytest.approx(243.23759076122965 * 4.4482216152605 * 0.0254, rel=1e-12)
    told = kinetostatics(metres).data()["measures"]["T12"][0]
    assert told == pytest.approx(243.23759076122965, rel=1e-12)
