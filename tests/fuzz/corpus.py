"""What inputs are made of: the gallery's files, formulas, and values that somebody may write."""

import functools
import json
import tomllib

from mbody import gallery
from mbody.quantities.units import SYMBOLS

NAMES = ("a", "b", "crank", "coupler", "rocker", "ground", "A", "B", "motor", "p", "q", "t", "x")
UNITS = (*SYMBOLS, "furlong", "nonsense", "kelvin", "mW", "µrad", "%", "")
FUNCTIONS = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "abs", "exp", "log"),
    *(
        "atan2",
        "hypot",
        "min",
        "max",
        "sign",
        "step",
        "clamp",
        "deadband",
        "eval",
        "__import__",
        "int",
    ),
)
NUMBERS = (
    *("0", "1", "2", "-1", "0.5", ".5", "3.", "1e3", "1e-3", "1E400", "1e-400", "1e308", "5e-324"),
    *("0.1", "1/3", "00012", "9" * 30, "0." + "3" * 30, "1e", "0x10", "1_000", "nan", "inf", "١"),
)
SIGNS = ("+", "-", "*", "/", "^", "**", "·", "−", "²", "³", "(", ")", ",", ".", " ", "  ", "=", "'")
ODD = (
    *("", " ", "\0", "\ud800", "\u202e", "\u2028", "🙂", "é", "\x7f", "\\", '"', "\n", "°", '"""'),
    *("../../etc/passwd", "/dev/zero", "C:\\x", "x" * 300, "__class__", "{0}", "%s", "$(id)"),
)
FORMULAS = (
    *("1.5 lbf", "60 deg", "300 rpm", "20 lbf/in", '0.25"', "1/4 in", "12 in-lbf", "5 kg*m^2"),
    *("(a + b) mm", "-40 rad/s^2", "9*cos(45 deg) + 3*cos(100 deg)", "2*pi*p/3", "sqrt(a^2+b^2)"),
    *(
        "80 lbf * sin(5 rad/s * t)",
        "60 deg + 25 rad/s*t - 20 rad/s^2*t^2",
        "min(t, 1 s)",
        "10 lb/in",
    ),
    *("100*x + 5*x^3", "hypot(a, b)", "atan2(1, 2)", "exp(-t)*cos(10*t)", "p", "(2*a)^(1/2)"),
    *("coupler.P.y - ground.O2.y", "motor.effort", "A.force/2", "1 N*m/rad", "1 m s^-1", "2^-3^2"),
)
#: Values of every kind that JSON or TOML may hold.
VALUES = (
    *(
        0,
        1,
        -1,
        0.5,
        -0.0,
        1e308,
        1e-320,
        5e-324,
        10**30,
        2**1100,
        1e400,
        float("nan"),
        True,
        False,
    ),
    *(None, "", "a", [], {}, [1, 2], [1], [1, 2, 3], [[1, 2]], ["1 in", "2 in"], {"r": 1}),
    *({"r": 1, "angle": "30 deg"}, {"body": "crank", "point": [1, 0], "angle": 30}, [{}], {"": 1}),
    *("turn", "crank.A", "ground", "point", "rad", "deg", "cm-kN-s", {"slender": 0}, [None]),
    *({"constant": 1}, {"harmonic": {"mean": 0, "amplitude": 1, "frequency": 2}}, {"value": 1}),
    *({"polynomial": [1, "2 rad/s"]}, {"table": {"x": [0, 1, 2], "y": [0, 1, 0]}}, {"table": {}}),
    *({"table": {"file": "../x.csv"}}, {"rise": {"shape": "3-4-5", "height": 1}}, {"x": 1, "y": 2}),
    {"rise": {"shape": "cycloidal", "height": "1 rad", "start": 0, "duration": "2 s"}},
    {"cam": {"segments": [{"dwell": 1}, {"rise": {"shape": "3-4-5"}}], "period": 4}},
    {"revolute": ["ground", "crank"]},
    {"constant_acceleration": {"value": 60, "speed": "25 rad/s", "acceleration": -40}},
)
DRAFT = """\
name = "everything"
units = "mm-N-s"
angle = "rad"
g = "9.81 m/s^2"
[parameters]
l = "15 in"
w = 2
h = "l/2 + 3 mm"
[ground]
points = { O = [0, 0], Q = { r = "l", angle = "30 deg" } }
[bodies.a]
mass = "2 kg"
inertia = "3 kg*m^2"
cg = [1, "h"]
points = { A = [10, 0], "Ä B" = ["l", "-h"] }
guess = { angle = "30 deg", x = 1 }
spread = { xx = 1, yy = 2, xy = 0.5 }
[bodies.b]
weight = "7.7 lbf"
cg = { r = "h", angle = 0.5 }
points = { A = [0, 0] }
guess = [1, 2, "90 deg"]
spread = { slender = "45 deg" }
[joints]
O = { revolute = ["ground.O", "a"] }
S = { prismatic = [{ body = "ground", point = "Q", angle = "w*20 deg" }, "b"] }
D = { distance = ["a.A", "b.A"], length = "2*l" }
[drivers]
m = { angle = "a", law = "w*t + 1" }
c = { coordinate = ["ground", "b"], law = { table = { x = [0, 1, 2], y = ["0 mm", 1, 0] } } }
k = { distance = ["a", "b"], law = { polynomial = ["3 mm", "w * 1 mm/s"] } }
[loads]
F = { force = "80 lbf*sin(5 rad/s*t)", at = "a.A", angle = "330 deg", follows = true }
T = { torque = { harmonic = { mean = 0, amplitude = "w", frequency = 3 } }, body = "b" }
r = { centrifugal_field = { body = "ground", point = "Q", angle = "w*20 deg" }, speed = "w*t" }
s = { spring = ["a.A", "b.A"], stiffness = "20 lbf/in", free_length = "h" }
n = { spring = ["a", "b"], law = "100*x + 5*x^3" }
d = { damper = ["a.A", "ground.O"], coefficient = 0.5 }
t = { torsion_spring = "a", stiffness = "3 N*m/rad" }
v = { torsion_damper = "a", law = "2*x" }
[gravity]
y = "-9.81 m/s^2"
[measures]
lift = "a.A.y - ground.O.y"
power = { of = "m.power", unit = "W" }
[ask]
over = "m"
instants = 7
"""


@functools.cache
def models() -> tuple[str, ...]:
    """Models that are right, as TOML."""
    return (DRAFT, *(gallery.path(name).read_text(encoding="utf-8") for name in gallery.names()))


@functools.cache
def tables() -> tuple[str, ...]:
    """The same as JSON."""
    return tuple(json.dumps(tomllib.loads(text)) for text in models())
