"""Model files and tables beside them."""

import contextlib
import math
import os
import tempfile
from pathlib import Path
from unittest import mock

from mbody import Body, Mechanism, Torque, load, save
from mbody.cli import command
from mbody.files.model import Limits, from_toml, in_units, to_toml
from mbody.model.loads import CustomLoad
from tests.errors.models import by_law, four_bar
from tests.model_text import model_from

ARM = """\
[ground]
points = { O = [0, 0] }

[bodies.arm]
mass = 2
points = { A = [1, 0] }
"""
JOINT = f"{ARM}\n[joints]\nO = {{ %s }}\n"
FORCE = f"{ARM}\n[loads]\nF = {{ %s }}\n"
MOTOR = f"{ARM}\n[drivers]\nmotor = {{ angle = 'arm', law = %s }}\n"
TORQUE = f"{ARM}\n[loads]\nT = {{ torque = %s, body = 'arm' }}\n"
TABLE = TORQUE % "{ table = { file = '%s' } }"

#: Models that are wrong somewhere.
TEXTS = {
    "no TOML": "name = ",
    "no TOML in a line": "name 'x'\nunits = 'SI'",
    "very long keys": ".".join("abcdefghijklmnopqrstuvwxyz") + " = 1",
    "very deep tables": "a = " + "[" * 40 + "]" * 40,
    "tables too deep for Python": "a = " + "[" * 100_000,
    "an unknown key": "nmae = 'x'\n" + ARM,
    "an unknown key like no other": f"{ARM}zzz = 3\n",
    "a title that is a number": "name = 3",
    "bodies that are a list": "bodies = [1]",
    "a body that is a number": "[bodies]\narm = 3",
    "a body without a name": "[bodies.'']\nmass = 1",
    "a body with a dot": "[bodies.'a.b']\nmass = 1",
    "a mass that is a table": "[bodies.arm]\nmass = { kg = 2 }",
    "a mass that is nan": "[bodies.arm]\nmass = nan",
    "a mass that is a force": "[bodies.arm]\nmass = '2 N'",
    "a mass of time": "[bodies.arm]\nmass = '2*t'",
    "a mass of no parameter": "[bodies.arm]\nmass = '2*m1'",
    "a negative mass": "[bodies.arm]\nmass = -2",
    "a point that is a number": "[ground]\npoints = { O = 3 }",
    "a point of one number": "[ground]\npoints = { O = [3] }",
    "a point of three numbers": "[ground]\npoints = { O = [1, 2, 3] }",
    "a point without an angle": "[ground]\npoints = { O = { r = 3 } }",
    "a guess that is true": "[bodies.arm]\nguess = true",
    "a spread that is another": "[bodies.arm]\nspread = 'line'",
    "a spread that is a number": "[bodies.arm]\nspread = 3",
    "another unit of angles": "angle = 'grad'",
    "another unit system": "units = 'inch'",
    "a downward g": "g = -9.81",
    "a parameter that is none": "[parameters]\na = '2 +'",
    "a parameter of formulas": "[parameters]\nsin = 2",
    "ground at a point that is none": "[ground]\npoints = { cg = [0, 0] }",
    "a title and a g that are none": "[bodies.ground]\n",
    "a joint of no kind": JOINT % "pin = ['ground.O', 'arm']",
    "a joint of nearly a kind": JOINT % "revolut = ['ground.O', 'arm']",
    "a joint of two kinds": JOINT % "revolute = ['ground', 'arm'], fixed = []",
    "a joint that is a list": f"{ARM}\n[joints]\nO = ['ground.O', 'arm']",
    "a joint of one place": JOINT % "revolute = ['ground.O']",
    "a joint of one place as text": JOINT % "revolute = 'ground.O'",
    "a joint of three places": JOINT % "revolute = ['ground', 'arm', 'arm']",
    "a joint of numbers": JOINT % "revolute = [1, 2]",
    "a joint of a body that is not there": JOINT % "revolute = ['ground', 'am']",
    "a place at no point": JOINT % "fixed = ['arm', { body = 'ground', point = 3 }]",
    "a joint with itself": JOINT % "fixed = ['arm', 'arm.A']",
    "a force that follows": FORCE % "force = 1, at = 'arm', follows = 'maybe'",
    "a force that follows a number": FORCE % "force = 1, at = 'arm', follows = 3",
    "a force at no place": FORCE % "force = 1",
    "a law of no kind": MOTOR % "{ speed = 3 }",
    "a law that is a list": MOTOR % "[1, 2]",
    "a law of two kinds": MOTOR % "{ constant = { value = 1 }, polynomial = [1, 2] }",
    "a law of nothing": MOTOR % "{}",
    "a law without a number": MOTOR % "{ constant_speed = { value = 3 } }",
    "coefficients that are a number": MOTOR % "{ polynomial = 3 }",
    "a segment of two kinds": TORQUE % "{ cam = { segments = [{}], period = 1 } }",
    "a rise of another shape": TORQUE
    % "{ rise = { shape = 'line', height = 1, start = 0, duration = 1 } }",
    "a table of x alone": TORQUE % "{ table = { x = [0, 1] } }",
    "very many errors": "[parameters]\n" + "\n".join(f"e{n} = 'a b'" for n in range(500)),
    "very many joints of nothing": "[joints]\n"
    + "\n".join(f"e{n} = {{ revolute = ['ground', 'b{n}'] }}" for n in range(500)),
    "a number of very many digits": "a = " + "9" * 5000,
    "points and a file": TORQUE % "{ table = { x = [0, 1], y = [0, 1], file = 'a.csv' } }",
    "a file from text": TABLE % "a.csv",
    "a measure that is none": f"{ARM}\n[measures]\nhigh = 'arm.z'",
    "a measure that is a number": f"{ARM}\n[measures]\nhigh = 3",
    "instants that are text": "[ask]\nover = 'turn'\ninstants = 'many'",
    "instants at true": "[ask]\nat = { t = true }",
    "instants that are a fraction": "[ask]\nover = 'turn'\ninstants = 2.5",
    "instants of nothing": f"{ARM}\n[ask]\ninstants = 5",
    "many problems": "unit = 'SI'\n[bodies.arm]\nmas = 2\ncg = [0, '3 kg']\n"
    "[joints]\nO = { revolute = ['ground'] }\n",
    "very many problems": "\n".join(f"wrong{n} = {n}" for n in range(30)),
}

JSON = {
    "no JSON": '{"name": }',
    "a list": "[1, 2]",
    "a key twice": '{"name": "a", "name": "b"}',
    "infinity": '{"g": Infinity}',
}

#: Tables beside a model, by their text.
TABLES = {
    "no table of numbers": "x,y\n0,1\nlow,2\n",
    "a table of one column": "0\n1\n",
    "a table of very many rows": "0,1\n" * 100_001,
    "a table of bytes": b"\xff\xfe\x00",
    "a table of one point": "x,y\n0,1\n",
}


@contextlib.contextmanager
def folder(name=None, content=b""):
    """A folder that is the current one, with a file in it."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as there:
        os.chdir(there)
        try:
            if name:
                Path(name).write_bytes(content if isinstance(content, bytes) else content.encode())
            yield Path(there)
        finally:
            os.chdir(before)


def with_file(name, content, model="mine.toml"):
    """Read a model from a folder that holds that file."""

    def go():
        with folder(name, content):
            load(model)

    return go


def with_table(content, name="a.csv", largest=None):
    def go():
        with folder("a.csv", content) as there:
            limit = mock.patch("mbody.files.model.fields.LARGEST", largest or 10_000_000)
            with limit:
                from_toml(TABLE % name, folder=there)

    return go


def with_limits(text):
    def go():
        with mock.patch.dict("os.environ", MBODY_LIMITS=text):
            from_toml("")

    return go


def too_large_for_the_command():
    """The same at the command, which names the variable of its environment."""
    with folder("mine.toml", ARM), mock.patch.dict("os.environ", MBODY_LIMITS="1e-6"):
        command._run(["check", "mine.toml"])


def refused():
    """A file that this user may not read; to root nothing is forbidden."""
    with mock.patch("os.stat", side_effect=PermissionError(13, "Permission denied")):
        load("secret.toml")


def unreadable_table():
    with folder("a.csv", "0,1\n") as there:
        refuse = mock.patch.object(
            Path, "open", side_effect=PermissionError(13, "Permission denied")
        )
        with refuse:
            from_toml(TABLE % "a.csv", folder=there)


def own_load():
    return four_bar(CustomLoad("own", "ground.O2", "rocker.B"))


def in_other_units(law):
    return in_units(by_law(law), "mm-N-s")


SCENARIOS = {
    **{name: lambda text=text: from_toml(text) for name, text in TEXTS.items()},
    **{name: lambda text=text: model_from(text, True) for name, text in JSON.items()},
    "a text that is too long": lambda: from_toml("#" * 6_000_001),
    "a text of more values than are allowed": lambda: from_toml(
        "name = 'x'\nunits = 'SI'", limits=Limits(values=2)
    ),
    "a model that is too large to be read again": lambda: save(
        four_bar(), "mine.toml", limits=Limits(operations=1, values=10)
    ),
    "a model of too many bytes to be read again": lambda: save(
        four_bar(), "mine.toml", limits=Limits(size=100)
    ),
    "limits that are none": lambda: from_toml("", limits=3),
    "limits below nothing": lambda: Limits(size=-1),
    "limits of the environment that are none": with_limits("much"),
    "other parameters": lambda: from_toml("[parameters]\na = 1", parameters={"b": 2}),
    "other parameters of none": lambda: from_toml(ARM, parameters={"b": 2}),
    "another parameter that is none": lambda: from_toml(
        "[parameters]\na = 1", parameters={"a": []}
    ),
    # -- files
    "a folder": lambda: load("/"),
    "no ordinary file": lambda: load("/dev/null"),
    "no file": lambda: load("none.toml"),
    "a file that may not be read": refused,
    "a file of a very long name": lambda: load("x" * 300 + ".toml"),
    "a file of a name that no file has": lambda: load("a\0b.toml"),
    "a file that is too large": with_file("mine.toml", b"#" * 6_000_001),
    "a file that is too large for the command": too_large_for_the_command,
    "a file of bytes": with_file("mine.toml", b"name = '\xff'"),
    "a file that is wrong": with_file(
        "mine.json", '{\n"bodies": {"arm": {"mass": "2 N"}}}', "mine.json"
    ),
    **{name: with_table(content) for name, content in TABLES.items()},
    "a table with a unit that there is not": with_table("t [s],angle [degg]\n0,1\n1,2\n"),
    "a table that is not there": with_table("", "b.csv"),
    "a table elsewhere": with_table("", "../b.csv"),
    "a table that is too large": with_table("0,1\n1,2\n" * 999_999, largest=1_000_000),
    "a table that may not be read": unreadable_table,
    # -- writing
    "a load of one's own": lambda: to_toml(own_load()),
    "a function": lambda: to_toml(four_bar(Torque("T", "rocker", value=math.sin))),
    "a model that is no text": lambda: from_toml(3),
    "a title that is no text": lambda: save(Mechanism("\ud800"), os.devnull),
    "a number too large for other units": lambda: in_units(far_away(), "um-N-s"),
    "a place that cannot be written": lambda: save(four_bar(), "/nowhere/mine.toml"),
    "plain numbers in other units": lambda: in_other_units("3*sin(2*t)"),
    "another unit system that is not there": lambda: in_units(four_bar(), "imperial"),
}


def far_away():
    machine = Mechanism("far")
    machine.add(Body("b", points={"P": (1e305, 0.0)}))
    return machine
