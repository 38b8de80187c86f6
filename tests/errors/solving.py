"""Analyses: what is asked, closing the loops, following the motion."""

import math

import numpy as np

import mbody
from mbody import makers
from mbody.engineering import close_loops
from mbody.laws import ConstantAcceleration, ConstantSpeed, Polynomial, Table
from tests import near_grashof
from tests.errors.models import FOLDED, by_law, by_rocker, four_bar

NAN = math.nan
TABLE = Table([0.0, 1.0, 2.0], [1.0, 2.0, 4.0])

TIMES = {
    "t that is nan": NAN,
    "t that is infinite": -math.inf,
    "one t that is nan": [0.0, NAN],
    "no t": [],
    "t in rows": [[0.0, 1.0], [2.0, 3.0]],
    "t that is none": [0.0, None],
}

DRIVE = {
    "drive of a number": {3: 1.0},
    "a value that is nan": {"motor": NAN},
    "a rate that is nan": {"motor": (1.0, NAN)},
    "an acceleration that is text": {"motor": (1.0, 0.0, "0")},
    "four values in a tuple": {"motor": (1, 2, 3, 4)},
    "no values": {"motor": []},
    "more rates than values": {"motor": ([1.0, 2.0], [1.0, 2.0, 3.0])},
    "drive that is a name": "motor",
}

GUESSES = {
    "a guess of a driver": {"motor": 1.0},
    "a guess of the ground": {"ground": 1.0},
    "a guess that is nan": {"coupler": NAN},
    "a guess at nan": {"coupler": (0.0, NAN, 0.0)},
    "guesses in a list": ["coupler"],
}

TURNS = {
    "a turn of a number": {"turn": 3},
    "a turn with values": {"turn": True, "drive": {"motor": 1.0}},
    "instants without a turn": {"instants": 5},
}


def second(law, body="crank"):
    return four_bar(mbody.AngleDriver("second", body, law))


def parallelogram(start):
    machine = makers.four_bar(1, 3, 1, 3, masses=(1, 3, 1), start=start, speed=2.0)
    machine.add(mbody.Gravity("gravity", y=-9.81))
    return machine


def two_drivers_in_line():
    machine = parallelogram(0.5)
    machine.add(
        mbody.Body("wheel", guess=0.0),
        mbody.Revolute("axle", mbody.Marker("ground", (0.0, 2.0)), "wheel"),
        mbody.AngleDriver("other", "wheel", 0.0),
    )
    return machine


def turning_back_in_line():
    made = parallelogram(math.pi - 1.0)
    machine = mbody.Mechanism("four-bar", ground=made.ground.points)
    machine.add(*(one for one in made if one.name != "motor"))
    machine.add(mbody.AngleDriver("motor", "crank", Polynomial([math.pi - 1.0, 2.0, -1.0])))
    return machine


def cylinder():
    machine = mbody.Mechanism("m", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("b"),
        mbody.Revolute("O", "ground.O", "b"),
        mbody.DistanceDriver("jack", "ground.O", "b", 2.0),
    )
    return machine


def press(start, speed=-0.5):
    """A slider-crank that its slider drives."""
    driven = makers.slider_crank(1.0, 3.0, start=0.0)
    machine = mbody.Mechanism("press", ground={"O": (0.0, 0.0), "guide": (0.0, 0.0)})
    ram = mbody.CoordinateDriver("ram", "ground.O", "slider.B", ConstantSpeed(start, speed))
    machine.add(*driven.bodies, *driven.joints, ram)
    return machine


def welded():
    machine = mbody.Mechanism("welded")
    machine.add(
        mbody.Body("b"), mbody.Fixed("weld", "ground", "b"), mbody.AngleDriver("motor", "b", 0.0)
    )
    return machine


def free(count=1):
    machine = mbody.Mechanism("free")
    machine.add(*(mbody.Body(f"b{n}", mass=1.0) for n in range(count)))
    machine.add(*(mbody.Prismatic(f"g{n}", "ground", f"b{n}") for n in range(1, count)))
    return machine


def structure():
    """Thirty bodies welded to the ground, one of them pinned a metre beside its place too."""
    machine = mbody.Mechanism("structure", ground={"O": (1.0, 0.0)})
    machine.add(*(mbody.Body(f"b{n}", points={"A": (0.0, 0.0)}) for n in range(30)))
    machine.add(*(mbody.Fixed(f"w{n}", "ground", f"b{n}") for n in range(30)))
    machine.add(mbody.Revolute("pin", "ground.O", "b0.A"))
    return machine


def unbalanced():
    """Very many rows, one weld twice, and a weight that nothing holds."""
    machine = mbody.Mechanism("m")
    machine.add(*(mbody.Body(f"b{n}", mass=1.0) for n in range(502)))
    machine.add(*(mbody.Fixed(f"w{n}", "ground", f"b{n}") for n in range(501)))
    machine.add(mbody.Fixed("twice", "ground", "b0"), mbody.Gravity("gravity", y=-9.81))
    return machine


def batch(**values):
    return mbody.assemble(four_bar()).with_values(
        {k.replace("_", "."): v for k, v in values.items()}
    )


def gears_apart():
    """Two gears whose centres are too far from each other."""
    machine = mbody.Mechanism("pair", ground={"A": (0.0, 0.0), "B": (3.1, 0.0)}, units="mm-N-s")
    machine.add(
        mbody.Body("a"),
        mbody.Body("b"),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        mbody.Gear("mesh", "a", "b", radius_i=2.0, radius_j=1.0),
        mbody.AngleDriver("motor", "a", 0.0),
    )
    return machine


def racked(height, radius=0.5):
    """A pinion whose centre is that high above its rack."""
    machine = mbody.Mechanism("rack", ground={"O": (0.0, height)})
    machine.add(
        mbody.Body("rack"),
        mbody.Body("pinion"),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Prismatic("guide", "ground", "rack"),
        mbody.RackPinion("mesh", "rack", "pinion", radius=radius),
        mbody.AngleDriver("motor", "pinion", 0.0),
    )
    return machine


def rope(length):
    """A rope between two places that are one."""
    machine = mbody.Mechanism("hoist", ground={"hook": (0.0, 0.0)})
    terms = [mbody.CouplingTerm(1.0, distance=("ground.hook", "block"))]
    machine.add(
        mbody.Body("block"),
        mbody.Fixed("weld", "ground", "block"),
        mbody.LengthCoupling("rope", terms, length),
    )
    return machine


#: From the position of the first one the way to the second ends where its dyad is stretched.
APART = [
    near_grashof.Linkage(
        "four-bar", start, 1.0, [place], [near_grashof.Dyad(lengths, 1, (0.5, 0.5))]
    )
    for start, place, lengths in (
        (4.9, 0.13 + 0.65j, (0.75, 0.92)),
        (0.76, -2.05 - 2.14j, (1.43, 2.6)),
    )
]

SCENARIOS = {
    "gears that do not mesh": lambda: mbody.kinetostatics(gears_apart()),
    "a rack on the wrong side": lambda: mbody.kinetostatics(racked(-0.5)),
    "a rope without a direction": lambda: mbody.kinetostatics(rope(1.0)),
    "an analysis of a class": lambda: mbody.kinematics(mbody.Mechanism),
    **{name: lambda t=t: mbody.kinematics(four_bar(), t) for name, t in TIMES.items()},
    **{name: lambda d=d: mbody.kinematics(four_bar(), drive=d) for name, d in DRIVE.items()},
    **{name: lambda g=g: mbody.kinematics(four_bar(), guess=g) for name, g in GUESSES.items()},
    **{name: lambda kw=kw: mbody.kinematics(four_bar(), **kw) for name, kw in TURNS.items()},
    "a turn without a driver": lambda: mbody.kinematics(four_bar(motor=False), turn=True),
    "a turn of a cylinder": lambda: mbody.kinematics(press(3.9), turn=True),
    "a turn of a law that turns back": lambda: mbody.kinematics(
        by_law(ConstantAcceleration(0.0, 5.0, -40.0)), turn=True
    ),
    "a turn of a batch": lambda: mbody.kinetostatics(batch(crank_mass=[1.0, 2.0]), turn=True),
    "rates of a body that is not there": lambda: close_loops(four_bar(), rates={"rod": 1.0}),
    "a rough rate that is nan": lambda: close_loops(four_bar(), rates={"crank": NAN}),
    "a rough rate that is a length": lambda: close_loops(four_bar(), rates={"crank": "2 m"}),
    "rates that are a number": lambda: close_loops(four_bar(), rates=5),
    "loops at two times": lambda: close_loops(four_bar(), t=[0.0, 1.0]),
    "a range of one of two drivers": lambda: mbody.driver_range(second(1.6, "rocker")),
    "a range of a driver that is not there": lambda: mbody.driver_range(four_bar(), "engine"),
    "a range at times": lambda: mbody.driver_range(four_bar(), t=[0.0, 1.0]),
    "a range of a batch": lambda: mbody.driver_range(batch(crank_mass=[1.0, 2.0])),
    # -- laws over the times
    "a table of a spring that ends": lambda: mbody.kinetostatics(
        four_bar(mbody.Spring("spring", "ground.O2", "rocker.B", law=TABLE))
    ),
    "a formula that overflows": lambda: mbody.kinetostatics(
        four_bar(mbody.Torque("push", "rocker", value="1 N*m*exp(999 + rocker.angle/(1 rad))"))
    ),
    "a formula with an infinite rate": lambda: mbody.kinetostatics(by_law("sqrt(t)"), t=[0.0, 1.0]),
    "a law without a value where loops are closed": lambda: close_loops(
        four_bar(mbody.AngleDriver("second", "rocker", "sqrt(t - 1)")), drive={"motor": 1.0}
    ),
    "a law that is infinite where loops are closed": lambda: mbody.kinematics(
        by_law(ConstantAcceleration(0.0, 0.0, 1e308)), t=[10.0]
    ),
    # -- closing the loops
    "a large structure that is too wide": lambda: close_loops(structure()),
    "loads that nothing balances": lambda: mbody.statics(unbalanced()),
    "a driver too many": lambda: mbody.kinematics(second(2.0, "rocker")),
    "a driver twice": lambda: mbody.kinematics(second(ConstantSpeed(math.pi / 3.0, 1.0))),
    "very many bodies that are free": lambda: mbody.kinematics(free(800)),
    "a guess on another branch": lambda: mbody.kinematics(
        four_bar(), guess={"coupler": 1.5, "rocker": 1.0}
    ),
    "a design on another branch": lambda: near_grashof.batch_of(APART, 5),
    # -- dead centres and other stops
    "a dead centre on the way": lambda: mbody.kinematics(
        press(3.9, 0.5), t=np.linspace(0.0, 1.0, 20)
    ),
    "a turn beyond zero": lambda: mbody.kinematics(
        makers.four_bar(2, 3, 4, 5.5, start=1.0), turn=True
    ),
    "a start at a dead centre": lambda: mbody.kinematics(by_rocker(FOLDED)),
    "a start at the end of a stroke": lambda: mbody.kinematics(press(4.0)),
    "velocities at the end of a stroke": lambda: close_loops(press(4.0)),
    "a change point at which the motion turns back": lambda: mbody.kinematics(
        turning_back_in_line(), t=[0.0, 2.1]
    ),
    "a change point with two drivers": lambda: mbody.kinematics(
        two_drivers_in_line(), drive={"motor": [0.5, math.pi, 4.0], "other": [0.0, 0.5, 1.0]}
    ),
    "a law that jumps": lambda: mbody.kinematics(
        by_law(lambda t: t + (t > 0.5) * 2.0), t=[0.0, 1.0]
    ),
    "a design that cannot close": lambda: mbody.kinetostatics(
        batch(coupler_B_x=[3.0, 3.1, 10.0])
    ).design(2),
    "designs none of which can close": lambda: mbody.kinetostatics(batch(coupler_B_x=[10.0, 11.0])),
}

SENTENCES = r"""
gears that do not mesh | SolveError | mesh | 'mesh' does not fit: by its radii the centres must be 3 mm apart, they are 3.1 mm: move them, or change the radii
a rack on the wrong side | SolveError | mesh | 'mesh' does not fit: by its radius the centre must be 0.5 m to the left of the rack's line, it is 0.5 m to the right: turn the marker on the rack by 180 deg, move it, or change the radius
a rope without a direction | SolveError | rope | 'rope' has no direction to begin with: two ends of it, on 'ground' and 'block', are guessed to be at one place; give a guess for the bodies
an analysis of a class | ModelError | - | an analysis takes a Mechanism or a System, not <class 'mbody.model.mechanism.Mechanism'>
t that is nan | ModelError | - | t is nan, it must be finite
t that is infinite | ModelError | - | t is -inf, it must be finite
one t that is nan | ModelError | - | t[1] is nan, it must be finite
no t | ModelError | - | t is empty: give at least one number
t in rows | ModelError | - | t must be a number or one row of them, not of shape (2, 2)
t that is none | ModelError | - | t must be a number or an array of them, not [0.0, None]
drive of a number | ModelError | 3 | there is no driver 3 (there are: 'motor')
a value that is nan | ModelError | motor | value of driver 'motor' is nan, it must be finite
a rate that is nan | ModelError | motor | rate of driver 'motor' is nan, it must be finite
an acceleration that is text | ModelError | motor | acceleration of driver 'motor' must be a number or an array of them, not '0'
four values in a tuple | ModelError | motor | driver 'motor' takes a value, or (value, rate, acceleration), not 4 of them
no values | ModelError | motor | value of driver 'motor' is empty: give at least one number
more rates than values | ModelError | - | driver values and times have different numbers of instants, [2, 3]: give as many of each, or one
drive that is a name | ModelError | - | drive must be a dict such as {"motor": 0.5}, not 'motor'
a guess of a driver | ModelError | motor | a guess is for bodies, 'motor' is none
a guess of the ground | ModelError | ground | the ground does not move: a guess is for moving bodies
a guess that is nan | ModelError | coupler | 'coupler': guess.angle is nan, it must be finite
a guess at nan | ModelError | coupler | 'coupler': guess.y is nan, it must be finite
guesses in a list | ModelError | - | guess must be a dict such as {"coupler": 0.3}, not ['coupler']
a turn of a number | ModelError | 3 | there is no driver 3 to turn (there are: 'motor')
a turn with values | ModelError | - | turn goes alone: leave out drive
instants without a turn | ModelError | - | instants goes with turn; times and driver values say how many they are
a turn without a driver | ModelError | - | turn=True goes with one driver, 'four-bar' has 0 (none): add one
a turn of a cylinder | ModelError | ram | driver 'ram' drives no angle, it cannot turn: give times t, or drive
a turn of a law that turns back | ModelError | motor | driver 'motor' does not make a whole turn by its law: the law turns back at t = 0.125 where it has reached 0.3125 rad; it does not reach 6.28319 rad: request values before that, or change the law or the start
a turn of a batch | ModelError | - | a turn of a batch of designs: give times or driver values instead
rates of a body that is not there | ModelError | rod | there is no moving body 'rod' to give a rate
a rough rate that is nan | ModelError | crank | 'crank': rate is nan, it must be finite
a rough rate that is a length | ModelError | crank | 'crank': rate: '2 m' is a length (m), where an angular velocity (rad/s) is wanted
rates that are a number | ModelError | - | rates must be a dict such as {"crank": 2.0}, not 5
loops at two times | ModelError | - | close_loops takes one instant: give one time and one value a driver
a range of one of two drivers | ModelError | - | 'four-bar' has 2 drivers ('motor', 'second'): name the one whose range you want
a range of a driver that is not there | ModelError | engine | there is no driver 'engine' (there are: 'motor')
a range at times | ModelError | - | driver_range takes one finite time, not [0.0, 1.0]
a range of a batch | ModelError | - | driver_range takes one design: choose one of the batch with design(n)
a table of a spring that ends | SolveError | spring | load 'spring' has no value at t = 0 s: its law does not reach so far; extend it, or let it hold its last value
a formula that overflows | SolveError | push | load 'push' has no value at t = 0 s: '1 N*m*exp(999 + rocker.angle/(1 rad))' has no finite value there; choose one that has, by max or min
a formula with an infinite rate | ModelError | motor | the law of driver 'motor', Expression('sqrt(t)'), has an infinite rate at t = 0 s: begin after it, or choose another law
a law without a value where loops are closed | ModelError | second | the law of driver 'second': 'sqrt(t - 1)' has no value at 0: evaluate it elsewhere, or choose a formula that has one there, for example with max or min
a law that is infinite where loops are closed | SolveError | motor | the law of 'motor' has no finite value at t = 10 s: begin elsewhere, or choose another law
a large structure that is too wide | SolveError | pin | loops of 'structure' do not close at t = 0 s: the search ended with a gap of 0.5 m at 'pin': check lengths, or give a better guess
loads that nothing balances | SolveError | - | reactions leave 0.032 of the loads of 'm' unbalanced: its position is singular, or it can still move
a driver too many | SolveError | second | 2 drivers ('motor', 'second') for 1 degree of freedom of 'four-bar': remove 1
a driver twice | SolveError | second | driver 'second' repeats what joints and other drivers already impose (rank 9 of 10): remove it
very many bodies that are free | SolveError | - | kinematics needs 0 free degrees of freedom, 'free' has 802 degrees left: add a driver, for example on 'b0'
a guess on another branch | ModelWarning | - | the guess is on another branch than the position found: 'coupler' came out 64.0 deg from where the guess puts it; guess nearer to the branch that you want
a design on another branch | ModelWarning | - | 1 design is closed on another branch than the first one: 1; analyse them alone, with a guess
a dead centre on the way | SolveError | ram | dead centre at 4 m, t = 0.2 s, of 'slider': driver 'ram' cannot drive it any further; 'slider' can move from 2 to 4 m; drive 'crank', or stop before
a turn beyond zero | SolveError | motor | dead centre at 132.1 deg of 'crank': driver 'motor' cannot drive it any further; 'crank' can turn from -132.1021565 deg to 132.1021565 deg; drive 'coupler', or stop before
a start at a dead centre | SolveError | motor | dead centre at 151 deg of 'rocker': driver 'motor' cannot drive it through there; drive 'crank', or start elsewhere
a start at the end of a stroke | SolveError | ram | dead centre at 4 m of 'slider': driver 'ram' cannot drive it through there; drive 'crank', or start elsewhere
velocities at the end of a stroke | SolveError | ram | no velocities agree with 'ram' at this position: it is at a dead centre, or drivers contradict each other; close the loops elsewhere
a change point at which the motion turns back | SolveError | motor | branches of 'four-bar' meet at 180 deg, t = 0.999619 s, of 'crank', driven by 'motor', in 'O2', 'A', 'B', 'O4': on which of them the motion goes on is not certain; stop before, or change a length so that they stay apart
a change point with two drivers | SolveError | motor | branches of 'four-bar' meet at 180 deg of 'crank', driven by 'motor', in 'O2', 'A', 'B', 'O4': on which of them the motion goes on is not certain; leave that instant out, the motion goes through there between others
a law that jumps | SolveError | motor | the motion of 'four-bar' cannot be followed beyond 28.65 deg, t = 0.5 s, of 'crank': does the law of 'motor' jump there?
a design that cannot close | SolveError | A | loops do not close at t = 0 s: the smallest gap is 4.878 m at 'A' (between 'crank' and 'coupler'): check lengths, or give a better guess
designs none of which can close | SolveError | A | design 0 of the batch: loops do not close at t = 0 s: the smallest gap is 4.878 m at 'A' (between 'crank' and 'coupler'): check lengths, or give a better guess
"""
