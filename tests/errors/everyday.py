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
    "a body that is misspelt": ('"crank.A", "coupler"', '"crnk.A", "coupler"'),
    "a point that is not on the link": ('"crank.A"', '"crank.C"'),
    "a joint of one link": ('["crank.A", "coupler"]', '["crank.A"]'),
    "a joint of a link with itself": ('["crank.A", "coupler"]', '["crank.A", "crank"]'),
    "pinned for a revolute joint": ("A = { revolute", "A = { pinned"),
    "a rate for a speed": ('speed = "60 rpm"', 'rate = "60 rpm"'),
    "a speed along a line": ('"60 rpm"', '"60 m/s"'),
    "a unit in capitals": ('"60 rpm"', '"60 RPM"'),
    "a unit outside of quotes": ('"60 rpm"', "60 rpm"),
    "a comma for a point": ('"0.1 kg"', '"0,1 kg"'),
    "a word for a number": ('"0.1 kg"', '"heavy"'),
    "a mass below zero": ('"0.1 kg"', "-1"),
    "a point in space": ("A = [30, 0]", "A = [30, 0, 0]"),
    "a law that is a number": (
        '{ constant_speed = { value = 60, speed = "60 rpm" } }',
        "{ constant = 1 }",
    ),
    "links for bodies": ("[bodies]", "[links]"),
    "a mass for a weight": ('mass = "0.1 kg"', 'weight = "0.1 kg"'),
    "a ground that is a list": ("points = { O2 = [0, 0], O4 = [100, 0] }", "points = [[0, 0]]"),
}
#: What is added to it.
MORE = {
    "gravity in the last table": FILE + "gravity = 9.81\n",
    "a spring without a number": LOADS + 's = { spring = ["ground.O2", "rocker.B"] }\n',
    "a spring in newtons": LOADS
    + 's = { spring = ["ground.O2", "rocker.B"], stiffness = "10 N" }\n',
    "a force by fx": LOADS + 'F = { force = ["10 N", 0], on = "rocker.B", fx = "10 N" }\n',
    "a start of a link that is misspelt": FILE
    + "[simulate]\nuntil = 1\nstart = { crnk = { angle = 10 } }\n",
    "a motion without an end": FILE + "[simulate]\nstart = { crank = { angle = 10 } }\n",
    "a measure of nothing": FILE + '[measures]\nv = "crank.speed"\n',
}


@functools.cache
def run():
    return mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))


def four():
    return mbody.from_toml(FILE)


CALLS = {
    "links that are too short": lambda: mbody.kinematics(
        mbody.from_toml(FILE.replace("B = [90, 0]", "B = [9, 0]"))
    ),
    "a motion that nothing drives": lambda: mbody.kinematics(
        mbody.from_toml(FILE.partition("[drivers]")[0])
    ),
    "a time that is left out": lambda: mbody.simulate(four()),
    "a time that is over": lambda: mbody.simulate(mbody.gallery.load("double_pendulum"), -1),
    "a joint that is misspelt": lambda: run().reaction("AA"),
    "a point read as a link": lambda: run()["crank.A"],
    "a quantity by another word": lambda: run().measure("crank.speed"),
    "a sum of unlike quantities": lambda: run().measure("crank.omega + crank.x"),
    "a point in text": lambda: mbody.Body("a", points={"A": "1,2"}),
    "bodies for places": lambda: mbody.Revolute("O", mbody.Body("a"), mbody.Body("b")),
    "a list of elements": lambda: four().add([mbody.Body("x")]),
    "a link twice": lambda: four().add(mbody.Body("crank")),
    "points of the ground in a list": lambda: mbody.Mechanism("m", ground=[(0, 0)]),
    "a number that is misspelt": lambda: mbody.sweep(four(), {"crank.A.xx": [1, 2]}),
    "no bounds": lambda: mbody.optimize(four(), minimize="peak(motor.effort)", by=["crank.A.x"]),
    "minimise for minimize": lambda: mbody.optimize(
        four(), minimise="peak(motor.effort)", by={"crank.A.x": (20, 40)}
    ),
    "a length of a link": lambda: mbody.gradient(four(), "motor.effort", ["crank.length"]),
    "a file that is elsewhere": lambda: mbody.load("elsewhere.toml"),
    "a name of the gallery that is misspelt": lambda: mbody.gallery.load("norton_four_bar"),
    "a joint in the place of a driver": lambda: four().without("A"),
}
WORDS = {
    "a picture for a word processor": ["draw", "norton_fourbar", "-o", "a.doc"],
    "an analysis of nothing": ["kinetostatics"],
    "turn for over": ["kinetostatics", "norton_fourbar", "--turn"],
    "over nothing": ["kinetostatics", "norton_fourbar", "--over"],
    "a position without a name": ["kinetostatics", "norton_fourbar", "--at", "60"],
    "a time that is a length": ["kinetostatics", "norton_fourbar", "--at", "t=1 m"],
    "a motion to nowhere": ["simulate", "norton_fourbar"],
    "a time that is a word": ["simulate", "double_pendulum", "--to", "abc"],
    "a report in no folder": ["report", "norton_fourbar", "-o", "/nowhere/a.md"],
    "dynamics for simulate": ["dynamics", "double_pendulum"],
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
a body that is misspelt | ModelError | A | model: line 10: joints.A: refers to body 'crnk', which is not there (there are: 'ground', 'crank', 'coupler', 'rocker'): add bodies first
a point that is not on the link | ModelError | A | model: line 10: joints.A: refers to point 'C' of 'crank', which is not there (it has: 'A'): name one of these, or add it to the body
a joint of one link | ModelError | A | model: line 10: joints.A.revolute: must be a list of 2, not ['crank.A'] (mbody explain revolute shows an example)
a joint of a link with itself | ModelError | A | model: line 10: joints.A: would join 'crank' to itself: give places on two bodies
pinned for a revolute joint | ModelError | A | model: line 10: joints.A: names no kind of joint (there are: band_brake, belt, cam_follower, clutch, distance, fixed, friction_force, gear, pin_slot, prismatic, rack_pinion, revolute, rolling): it has 'pinned', did you mean 'pin'?
a rate for a speed | ModelError | motor | model:⏎  line 14: drivers.motor.law.constant_speed.speed: is missing: give it⏎  line 14: drivers.motor.law.constant_speed.rate: there is no such key (there are: speed)
a speed along a line | ModelError | motor | model: line 14: drivers.motor.law.constant_speed.speed: '60 m/s' is a velocity (m/s), where an angular velocity (rad/s) is wanted
a unit in capitals | ModelError | motor | model: line 14: drivers.motor.law.constant_speed.speed: '60 RPM' is not a formula: there is no unit 'RPM', did you mean 'rpm'?
a unit outside of quotes | ModelError | - | model: it is no TOML: line 14: a number with a unit stands in quotes: "60 rpm"
a comma for a point | ModelError | crank | model: line 5: bodies.crank.mass: '0,1 kg' is not a formula: write a decimal point, not a comma
a word for a number | ModelError | crank | model: line 5: bodies.crank.mass: there is no parameter 'heavy' (there are none)
a mass below zero | ModelError | crank | model: line 5: bodies.crank.mass: is -1, it must not be negative: give 0 or more
a point in space | ModelError | crank | model: line 5: bodies.crank.points.A: must be a list of 2, not [30, 0, 0]
a law that is a number | ModelError | motor | model: line 14: drivers.motor.law.constant: must be a table, not 1
links for bodies | ModelError | - | model: line 4: links: there is no such key, did you mean 'bodies'?
a mass for a weight | ModelError | crank | model: line 5: bodies.crank.weight: '0.1 kg' is a mass (kg), where a force (N) is wanted: did you mean '0.1 kgf'?
a ground that is a list | ModelError | ground | model: line 3: ground.points: must be a table, not [[0, 0]]
gravity in the last table | ModelError | gravity | model: line 15: drivers.gravity: is read as one of [drivers], below whose line it stands: put it above all tables, or give it a table of its own
a spring without a number | ModelError | s | model: line 16: loads.s: has neither stiffness nor law: give one of them
a spring in newtons | ModelError | s | model: line 16: loads.s.stiffness: '10 N' is a force (N), where a stiffness (N/m) is wanted
a force by fx | ModelError | F | model:⏎  line 16: loads.F.force: must be a number, a formula or a table with one of constant, constant_speed, constant_acceleration, polynomial, harmonic, table, rise, cam, not ['10 N', 0] (mbody explain force shows an example)⏎  line 16: loads.F.at: is missing: give it⏎  line 16: loads.F.on: there is no such key (there are: at, angle, follows)⏎  line 16: loads.F.fx: there is no such key (there are: at, angle, follows)
a start of a link that is misspelt | ModelError | - | model: line 15: simulate: there is no body 'crnk' to start (there are: crank, coupler, rocker)
a motion without an end | ModelError | - | model: line 15: simulate.until: is missing: give it
a measure of nothing | ModelError | v | model: line 16: measures.v: measure 'crank.speed': 'crank' has no 'speed' (it has: x, y, vx, vy, ax, ay, angle, omega, alpha)
links that are too short | SolveError | A | loops do not close at t = 0 s: the smallest gap is 19.88 mm at 'A' (between 'crank' and 'coupler'): check lengths, or give a better guess
a motion that nothing drives | SolveError | - | kinematics needs 0 free degrees of freedom, 'mechanism' has 1 degree left: add a driver, for example on 'crank'
a time that is left out | ModelError | - | simulate needs the last time: give until
a time that is over | ModelError | - | until is -1 s, the motion begins at 0 s: give a later time
a joint that is misspelt | ModelError | AA | there is no joint 'AA' (there are: 'O2', 'A', 'B', 'O4')
a point read as a link | ModelError | crank.A | there is no body 'crank.A' (there are: 'crank', 'coupler', 'rocker', 'ground'); motions of points are run.point('crank.A')
a quantity by another word | ModelError | - | measure 'crank.speed': 'crank' has no 'speed' (it has: x, y, vx, vy, ax, ay, angle, omega, alpha)
a sum of unlike quantities | ModelError | - | measure 'crank.omega + crank.x': it adds an angular velocity (rad/s) and a length (m)
a point in text | ModelError | a | 'a': A must be a pair (x, y) or polar(r, angle), not '1,2'
bodies for places | ModelError | O | 'O': i must be a place such as crank.at('A') or "crank.A", not Body(name='a', mass=None, weight=None, inertia=0.0, cg=(0...
a list of elements | ModelError | - | a mechanism takes bodies, joints, couplings, drivers, loads, inputs, states, quantities and controllers, not [Body(name='x'... section=None)]: give them one by one, add(*elements)
a link twice | ModelError | crank | the name 'crank' is taken by a Body: names are unique, choose another
points of the ground in a list | ModelError | ground | 'ground': points must be a dict such as {"A": (x, y)}, not [(0, 0)]
a number that is misspelt | ModelError | crank.A.xx | there is no number 'crank.A.xx' to change (there are: 'crank.mass', 'crank.inertia', 'crank.cg.x', 'crank.cg.y', 'crank.A.x', 'crank.A.y')
no bounds | ModelError | - | optimize: by must be a dict of bounds such as {"crank.A.x": (0.1, 0.3)}, not ['crank.A.x']
minimise for minimize | ModelError | - | optimize: kinetostatics has no option 'minimise': did you mean minimize=?
a length of a link | ModelError | crank.length | there is no number 'crank.length' (there are: 'crank.inertia', 'crank.cg.y', 'crank.cg.x', 'crank.A.y', 'crank.A.x', 'crank.mass')
a file that is elsewhere | ModelError | - | there is no file 'elsewhere.toml'
a name of the gallery that is misspelt | ModelError | - | the gallery has no model 'norton_four_bar': did you mean 'norton_fourbar'?
a joint in the place of a driver | ModelError | A | there is no driver 'A' to release: it is a joint (drivers are: 'motor')
a picture for a word processor | ModelError | - | cannot write 'a.doc': a picture is a file that ends in .svg, .png or .pdf
an analysis of nothing | UsageError | - | kinetostatics needs MODEL, as in mbody kinetostatics norton_fourbar (see mbody kinetostatics --help)
turn for over | UsageError | - | kinetostatics has no option --turn: did you mean --over? (see mbody kinetostatics --help)
over nothing | UsageError | - | argument --over: expected one argument (see mbody kinetostatics --help)
a position without a name | UsageError | - | --at takes NAME=VALUE, such as crank=60, not '60'
a time that is a length | ModelError | t | 't': '1 m' is a length (m), where a time (s) is wanted
a motion to nowhere | ModelError | - | simulate needs the last time: give --to TIME, or the file a table [simulate] with until = …
a time that is a word | ModelError | simulate | 'simulate': until: there is no parameter 'abc' (there are: 'l', 'm')
a report in no folder | ModelError | - | cannot write '/nowhere/a.md' (No such file or directory): choose a folder that exists and may be written to
dynamics for simulate | UsageError | - | there is no command 'dynamics': did you mean simulate (free motion over time) or kinetostatics (motion, all joint forces)?
"""
