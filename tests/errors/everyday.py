"""Mistakes of every day: a file, a call and a command as they are written in haste."""

import functools

import mbody
from mbody.cli import command

#: A four-bar as a user would write it.
FILE = """units = "mm-N-s"
[ground]
points = { O2 = [0, 0], O4 = [100, 0] }
[bodies]
crank = { mass = "0.1 kg", points = { A = [30, 0] } }
coupler = { mass = "0.2 kg", points = { B = [90, 0] } }
rocker = { mass = "0.2 kg", points = { B = [60, 0] } }
[joints]
O2 = { revolute = ["ground.O2", "crank"] }
A = { revolute = ["crank.A", "coupler"] }
B = { revolute = ["coupler.B", "rocker.B"] }
O4 = { revolute = ["ground.O4", "rocker"] }
[drivers]
motor = { angle = "crank", law = { constant_speed = { value = 60, speed = "60 rpm" } } }
"""
LOADS = FILE + "[loads]\n"

#: What is written in the place of something in the file.
SLIPS = {
    "a speed along a line": ('"60 rpm"', '"60 m/s"'),
    "a unit in capitals": ('"60 rpm"', '"60 RPM"'),
    "a mass below zero": ('"0.1 kg"', "-1"),
    "a mass for a weight": ('mass = "0.1 kg"', 'weight = "0.1 kg"'),
}
#: What is added to it.
MORE = {
    "a spring in newtons": LOADS
    + 's = { spring = ["ground.O2", "rocker.B"], stiffness = "10 N" }\n',
    "a force by fx": LOADS + 'F = { force = ["10 N", 0], on = "rocker.B", fx = "10 N" }\n',
    "a measure of nothing": FILE + '[measures]\nv = "crank.speed"\n',
}


@functools.cache
def run():
    return mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))


def four():
    return mbody.from_toml(FILE)


CALLS = {
    "a motion that nothing drives": lambda: mbody.kinematics(
        mbody.from_toml(FILE.partition("[drivers]")[0])
    ),
    "a point read as a link": lambda: run()["crank.A"],
    "a point in text": lambda: mbody.Body("a", points={"A": "1,2"}),
    "no bounds": lambda: mbody.optimize(four(), minimize="peak(motor.effort)", by=["crank.A.x"]),
    "a file that is elsewhere": lambda: mbody.load("elsewhere.toml"),
    "a name of the gallery that is misspelt": lambda: mbody.gallery.load("norton_four_bar"),
}
WORDS = {
    "a picture for a word processor": ["draw", "norton_fourbar", "-o", "a.doc"],
    "an analysis of nothing": ["kinetostatics"],
    "a position without a name": ["kinetostatics", "norton_fourbar", "--at", "60"],
    "a time that is a length": ["kinetostatics", "norton_fourbar", "--at", "t=1 m"],
    "a report in no folder": ["report", "norton_fourbar", "-o", "/nowhere/a.md"],
}
SCENARIOS = {
    **{
        name: lambda slip=slip: mbody.from_toml(FILE.replace(*slip)) for name, slip in SLIPS.items()
    },
    **{name: lambda text=text: mbody.from_toml(text) for name, text in MORE.items()},
    **CALLS,
    **{name: lambda words=words: command._run(words) for name, words in WORDS.items()},
}

SENTENCES = r"""
a speed along a line | ModelError | motor | model: line 14: drivers.motor.law.constant_speed.speed: '60 m/s' is a velocity (m/s), where an angular velocity (rad/s) is wanted
a unit in capitals | ModelError | motor | model: line 14: drivers.motor.law.constant_speed.speed: '60 RPM' is not a formula: there is no unit 'RPM', did you mean 'rpm'?
a mass below zero | ModelError | crank | model: line 5: bodies.crank.mass: is -1, it must not be negative: give 0 or more
a mass for a weight | ModelError | crank | model: line 5: bodies.crank.weight: '0.1 kg' is a mass (kg), where a force (N) is wanted: did you mean '0.1 kgf'?
a spring in newtons | ModelError | s | model: line 16: loads.s.stiffness: '10 N' is a force (N), where a stiffness (N/m) is wanted
a force by fx | ModelError | F | model:⏎  line 16: loads.F.force: must be a number, a formula or a table with one of constant, constant_speed, constant_acceleration, polynomial, harmonic, table, rise, cam, not ['10 N', 0] (mbody explain force shows an example)⏎  line 16: loads.F.at: is missing: give it⏎  line 16: loads.F.on: there is no such key (there are: at, angle, follows)⏎  line 16: loads.F.fx: there is no such key (there are: at, angle, follows)
a measure of nothing | ModelError | v | model: line 16: measures.v: measure 'crank.speed': 'crank' has no 'speed' (it has: x, y, vx, vy, ax, ay, angle, omega, alpha)
a motion that nothing drives | SolveError | - | kinematics needs 0 free degrees of freedom, 'mechanism' has 1 degree left: add a driver, for example on 'crank'
a point read as a link | ModelError | crank.A | there is no body 'crank.A' (there are: 'crank', 'coupler', 'rocker', 'ground'); motions of points are run.point('crank.A')
a point in text | ModelError | a | 'a': A must be a pair (x, y) or polar(r, angle), not '1,2'
no bounds | ModelError | - | optimize: by must be a dict of bounds such as {"crank.A.x": (0.1, 0.3)}, not ['crank.A.x']
a file that is elsewhere | ModelError | - | there is no file 'elsewhere.toml'
a name of the gallery that is misspelt | ModelError | - | the gallery has no model 'norton_four_bar': did you mean 'norton_fourbar'?
a picture for a word processor | ModelError | - | cannot write 'a.doc': a picture is a file that ends in .svg, .png or .pdf
an analysis of nothing | UsageError | - | kinetostatics needs MODEL, as in mbody kinetostatics norton_fourbar (see mbody kinetostatics --help)
a position without a name | UsageError | - | --at takes NAME=VALUE, such as crank=60, not '60'
a time that is a length | ModelError | t | 't': '1 m' is a length (m), where a time (s) is wanted
a report in no folder | ModelError | - | cannot write '/nowhere/a.md' (No such file or directory): choose a folder that exists and may be written to
"""
