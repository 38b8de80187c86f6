"""Errors of model files: lines of TOML and JSON, many errors at once, large texts."""

import time

import pytest

from mbody import ModelError, from_toml
from tests.support.model_text import model_from

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
        ("[bodies.c.points]\nA = [\n  0, # ]\n  0,\n]\nB = [1]\n", [(6, "bodies.c.points.B")]),
        ("[bodies.crank.points]\nA = [\n  0,\n  'x y',\n]\n", [(4, "bodies.crank.points.A.1")]),
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
    # what the shape has right is tried too, all of it; what follows from it is not reported
    good_shape = CRANK + (
        'A = { revolute = ["rod.A", "crank"] }\nB = { revolute = ["ground.Q", "crank"] }\n'
        "[bodies.rod]\nmass = -1\n[loads]\nF = { force = 1, at = 'crank.Z' }\n"
    )
    assert [field for _, field in problems(good_shape)] == [
        "joints.B",
        "bodies.rod.mass",
        "loads.F",
    ]


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
