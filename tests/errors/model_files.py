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
from tests.support.model_text import model_from

ARM = """\
[ground]
points = { O = [0, 0] }

[bodies.arm]
mass = 2
points = { A = [1, 0] }
"""
JOINT = f"{ARM}\n[joints]\nO = {{ %s }}\n"
MOTOR = f"{ARM}\n[drivers]\nmotor = {{ angle = 'arm', law = %s }}\n"
TORQUE = f"{ARM}\n[loads]\nT = {{ torque = %s, body = 'arm' }}\n"
TABLE = TORQUE % "{ table = { file = '%s' } }"

#: Models that are wrong somewhere.
TEXTS = {
    "a table twice": "[bodies.a]\n[bodies.a]",
    "a unit without quotes": "[parameters]\nspeed = 120 rpm",
    "a decimal comma": "[bodies.a]\nmass = 0,2",
    "units in the last table": "[bodies.a]\n[joints]\nunits = 'SI'",
    "gravity as a list": "gravity = [0, -9.81]\n[bodies.a]",
    "very long keys": ".".join("abcdefghijklmnopqrstuvwxyz") + " = 1",
    "very deep tables": "a = " + "[" * 40 + "]" * 40,
    "tables too deep for Python": "a = " + "[" * 100_000,
    "bodies that are a list": "bodies = [1]",
    "a body with a dot": "[bodies.'a.b']\nmass = 1",
    "a mass that is a table": "[bodies.arm]\nmass = { kg = 2 }",
    "a mass that is nan": "[bodies.arm]\nmass = nan",
    "a mass that is a force": "[bodies.arm]\nmass = '2 N'",
    "a mass of time": "[bodies.arm]\nmass = '2*t'",
    "a negative mass": "[bodies.arm]\nmass = -2",
    "a negative mass with its unit": "units = 'mm-N-s'\n[bodies.arm]\nmass = '-0.2 kg'",
    "a negative mass by a formula": "[parameters]\nm = '1 kg'\n[bodies.arm]\nmass = 'm - 3 kg'",
    "a driver without its body, and a measure of it": "[ground]\npoints = { O = [0, 0] }\n"
    "[drivers]\nmotor = { angle = 'arm' }\n[measures]\ntorque = 'motor.effort'",
    "a spread that is another": "[bodies.arm]\nspread = 'line'",
    "another unit of angles": "angle = 'grad'",
    "a downward g": "g = -9.81",
    "a parameter of formulas": "[parameters]\nsin = 2",
    "an output unit of no quantity": f"[output_units]\nmas = 'kg'\n{ARM}",
    "a joint of nearly a kind": JOINT % "revolut = ['ground.O', 'arm']",
    "a joint of two kinds": JOINT % "revolute = ['ground', 'arm'], fixed = []",
    "a joint that is a list": f"{ARM}\n[joints]\nO = ['ground.O', 'arm']",
    "a joint of one place as text": JOINT % "revolute = 'ground.O'",
    "a law of two kinds": MOTOR % "{ constant = { value = 1 }, polynomial = [1, 2] }",
    "a law of nothing": MOTOR % "{}",
    "coefficients that are a number": MOTOR % "{ polynomial = 3 }",
    "a segment of two kinds": TORQUE % "{ cam = { segments = [{}], period = 1 } }",
    "a table of x alone": TORQUE % "{ table = { x = [0, 1] } }",
    "very many errors": "[parameters]\n" + "\n".join(f"e{n} = 'a b'" for n in range(500)),
    "very many joints of nothing": "[joints]\n"
    + "\n".join(f"e{n} = {{ revolute = ['ground', 'b{n}'] }}" for n in range(500)),
    "a number of very many digits": "a = " + "9" * 5000,
    "points and a file": TORQUE % "{ table = { x = [0, 1], y = [0, 1], file = 'a.csv' } }",
    "a file from text": TABLE % "a.csv",
    "many problems": "unit = 'SI'\n[bodies.arm]\nmas = 2\ncg = [0, '3 kg']\n"
    "[joints]\nO = { revolute = ['ground'] }\n",
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
            limit = mock.patch("mbody.files.model.csv_columns.LARGEST", largest or 10_000_000)
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
    "a model that is too large to be read again": lambda: save(
        four_bar(), "mine.toml", limits=Limits(operations=1, values=10)
    ),
    "limits that are none": lambda: from_toml("", limits=3),
    "limits below nothing": lambda: Limits(size=-1),
    "limits of the environment that are none": with_limits("much"),
    "another parameter in another unit": lambda: from_toml(
        "[parameters]\na = '2 m'", parameters={"a": "3 kg"}
    ),
    "other parameters of none": lambda: from_toml(ARM, parameters={"b": 2}),
    # -- files
    "a folder": lambda: load("/"),
    "no ordinary file": lambda: load("/dev/null"),
    "a file that may not be read": refused,
    "a file of a name that no file has": lambda: load("a\0b.toml"),
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
}


def far_away():
    machine = Mechanism("far")
    machine.add(Body("b", points={"P": (1e305, 0.0)}))
    return machine


SENTENCES = r"""
a table twice | ModelError | - | model: it is no TOML: line 2: '[bodies.a]' is there a second time, or its table was closed: keep one of them
a unit without quotes | ModelError | - | model: it is no TOML: line 2: a number with a unit stands in quotes: "120 rpm"
a decimal comma | ModelError | - | model: it is no TOML: line 2: a number has no comma: decimals stand behind a point, as in 0.5
units in the last table | ModelError | units | model: line 3: joints.units: is read as one of [joints], below whose line it stands: put it above all tables, or give it a table of its own
gravity as a list | ModelError | gravity | model: line 1: gravity: must be a table, not [0, -9.81] (mbody explain gravity shows one)
very long keys | ModelError | - | model: a dotted key has more than 20 parts
very deep tables | ModelError | - | model: tables are nested too deep: at most 30
tables too deep for Python | ModelError | - | model: tables are nested too deep: at most 30
bodies that are a list | ModelError | - | model: line 1: bodies: must be a table, not [1] (mbody explain bodies shows one)
a body with a dot | ModelError | a.b | model: line 1: bodies.a.b: 'a.b': a name may not hold a dot, which parts body and point: write 'a_b'
a mass that is a table | ModelError | arm | model: line 2: bodies.arm.mass: must be a number or text such as '2 mm', not {'kg': 2}
a mass that is nan | ModelError | arm | model: line 2: bodies.arm.mass: is nan, it must be finite
a mass that is a force | ModelError | arm | model: line 2: bodies.arm.mass: '2 N' is a force (N), where a mass (kg) is wanted
a mass of time | ModelError | arm | model: line 2: bodies.arm.mass: is '2*t', but only a law may change with time
a negative mass | ModelError | arm | model: line 2: bodies.arm.mass: is -2, it must not be negative: give 0 or more
a negative mass with its unit | ModelError | arm | model: line 3: bodies.arm.mass: is -0.2 kg, it must not be negative: give 0 or more
a negative mass by a formula | ModelError | arm | model: line 4: bodies.arm.mass: is 'm - 3 kg' = -2 kg, it must not be negative: give 0 or more
a driver without its body, and a measure of it | ModelError | motor | model: line 4: drivers.motor: refers to body 'arm', which is not there (there are: 'ground'): add bodies first
a spread that is another | ModelError | arm | model: line 2: bodies.arm.spread: must be "point", { slender = angle } or { xx = …, yy = …, xy = … }, not 'line'
another unit of angles | ModelError | - | model: line 1: angle: must be 'deg' or 'rad', not 'grad'
a downward g | ModelError | - | model: line 1: g: g is -9.81 m/s², it must be positive: it only turns weights into masses, a Gravity load has the direction
a parameter of formulas | ModelError | sin | model: line 2: parameters.sin: the name 'sin' is reserved for formulas: choose another name for the parameter
an output unit of no quantity | ModelError | - | model: line 2: output_units.mas: there is no quantity 'mas', did you mean 'mass'?
a joint of nearly a kind | ModelError | O | model: line 9: joints.O: names no kind of joint (there are: band_brake, belt, cam_follower, clutch, distance, fixed, friction_force, gear, pin_slot, prismatic, rack_pinion, revolute, rolling): it has 'revolut', did you mean 'revolute'?
a joint of two kinds | ModelError | O | model:⏎  line 9: joints.O.fixed: must be a list of 2, not [] (mbody explain fixed shows an example)⏎  line 9: joints.O.revolute: names a second kind of element beside 'fixed': keep one of them
a joint that is a list | ModelError | O | model: line 9: joints.O: names no kind of joint (there are: band_brake, belt, cam_follower, clutch, distance, fixed, friction_force, gear, pin_slot, prismatic, rack_pinion, revolute, rolling)
a joint of one place as text | ModelError | O | model: line 9: joints.O.revolute: must be a list, not 'ground.O' (mbody explain revolute shows an example)
a law of two kinds | ModelError | motor | model: line 9: drivers.motor.law: must be one law of constant, constant_speed, constant_acceleration, polynomial, harmonic, table, rise, cam; it has constant and polynomial
a law of nothing | ModelError | motor | model: line 9: drivers.motor.law: must be one law of constant, constant_speed, constant_acceleration, polynomial, harmonic, table, rise, cam; it has none
coefficients that are a number | ModelError | motor | model: line 9: drivers.motor.law.polynomial: must be a list, not 3
a segment of two kinds | ModelError | T | model: line 9: loads.T.torque.cam.segments.0: a segment is either { rise = { … } } or { dwell = duration }
a table of x alone | ModelError | T | model: line 9: loads.T.torque.table: needs both x and y, or the file that has them
very many errors | ModelError | e0 | model:⏎  line 2: parameters.e0: 'a b' is not a formula: there is no unit 'b', did you mean 'lb'?⏎  line 3: parameters.e1: 'a b' is not a formula: there is no unit 'b', did you mean 'lb'?⏎…⏎  and 480 more
very many joints of nothing | ModelError | e0 | model:⏎  line 2: joints.e0: refers to body 'b0', which is not there (there are: 'ground'): add bodies first⏎  line 3: joints.e1: refers to body 'b1', which is not there (there are: 'ground'): add bodies first⏎…⏎  and more
a number of very many digits | ModelError | - | model: a whole number has very many digits, more than a computer holds
points and a file | ModelError | T | model: line 9: loads.T.torque.table: give x and y, or the file that has them, not both
a file from text | ModelError | T | model: line 9: loads.T.torque.table: 'a.csv' cannot be read: a model from text has no folder beside it
many problems | ModelError | arm | model:⏎  line 1: unit: there is no such key, did you mean 'units'?⏎  line 3: bodies.arm.mas: there is no such key, did you mean 'mass'?⏎  line 4: bodies.arm.cg.1: '3 kg' is a mass (kg), where a length (m) is wanted⏎  line 6: joints.O.revolute: must be a list of 2, not ['ground'] (mbody explain revolute shows an example)
no JSON | ModelError | - | model: it is no JSON: line 1: expecting value
a list | ModelError | - | model: a model is a table, not list
a key twice | ModelError | - | model: the key 'name' is given twice in one table: keep one
infinity | ModelError | - | model: Infinity is no number of a model: numbers must be finite
a text that is too long | ModelError | - | model: it has more than 6 MB: raise the limits if you trust it, by limits=mbody.files.model.Limits(size=1e+07) of load and save
a model that is too large to be read again | ModelError | - | 'mine.toml': it has more than 10 values: raise the limits if you trust it, by limits=mbody.files.model.Limits(values=2e+02) of load and save; else the file could be written but not read
limits that are none | ModelError | - | limits must be mbody.files.model.Limits(size=..., values=...), not 3
limits below nothing | ModelError | - | limits: size must be a positive number, not -1
limits of the environment that are none | ModelError | - | the environment variable MBODY_LIMITS must be a positive number, such as 10, not 'much'
another parameter in another unit | ModelError | a | model: parameter 'a' is a length (m), and '3 kg' is a mass (kg): give what measures the same
other parameters of none | ModelError | b | model: there is no parameter 'b' (there are none)
a folder | ModelError | - | '/' is a folder: name a model file in it
no ordinary file | ModelError | - | '/dev/null' is no ordinary file: give a model file
a file that may not be read | ModelError | - | the file 'secret.toml' may not be read: change its permissions
a file of a name that no file has | ModelError | - | the file 'a\x00b.toml' cannot be read: no file has such a name
a file that is too large for the command | ModelError | - | 'mine.toml' has more than 6e-06 MB: raise the limits if you trust it, by MBODY_LIMITS=1 before the command
a file of bytes | ModelError | - | 'mine.toml' is no text: byte 9 is not UTF-8; models are TOML or JSON, files of other programs that `mbody import` reads are text too: save it as UTF-8
a file that is wrong | ModelError | arm | mine.json: line 2: bodies.arm.mass: '2 N' is a force (N), where a mass (kg) is wanted
no table of numbers | ModelError | T | model: line 9: loads.T.torque.table: the table 'a.csv': row 3 has no two numbers: ['low', '2']
a table of very many rows | ModelError | T | model: line 9: loads.T.torque.table: the table 'a.csv' has more than 100000 rows: leave some of them out
a table of bytes | ModelError | T | model: line 9: loads.T.torque.table: the table 'a.csv' is no text of comma-separated values
a table of one point | ModelError | T | model: line 9: loads.T.torque.table: Table: at least 2 points are needed, there is 1
a table with a unit that there is not | ModelError | T | model: line 9: loads.T.torque.table: the table 'a.csv': its heading has [degg]: there is no unit 'degg', did you mean 'deg': write a unit as in 'angle [deg]', or leave it out
a table that is not there | ModelError | T | model: line 9: loads.T.torque.table: there is no file 'b.csv' beside the model
a table elsewhere | ModelError | T | model: line 9: loads.T.torque.table: '../b.csv' lies outside the folder of the model: name a file below it
a table that is too large | ModelError | T | model: line 9: loads.T.torque.table: the table 'a.csv' is larger than 1 MB
a table that may not be read | ModelError | T | model: line 9: loads.T.torque.table: the table 'a.csv' cannot be read: Permission denied
a load of one's own | ModelError | own | 'own' is a CustomLoad, Python code of your own, which a model file does not carry
a function | ModelError | T | 'T' follows a Function of Python, which a model file does not carry: write a formula of t, or a table
a model that is no text | ModelError | - | model: a model is text, not 3
a title that is no text | ModelError | - | the file '/dev/null' cannot be written: '\ud800' is no character
a number too large for other units | ModelError | - | 1e+305 is too large a number in um: choose others
a place that cannot be written | ModelError | - | the file '/nowhere/mine.toml' cannot be written: No such file or directory
plain numbers in other units | ModelError | - | the law '3*sin(2*t)' is of plain numbers, which cannot be taken to other units: give its numbers their units
"""
