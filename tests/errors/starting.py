"""First instants of motions: places and rates that do not fit, singular positions."""

import math
from dataclasses import replace

import numpy as np

import mbody
from mbody import gallery, makers
from mbody.engineering import close_loops
from mbody.laws import ConstantSpeed
from mbody.solution.histories import Record
from tests.errors.models import four_bar


def folded(start, *more, lengths=(1.0, 2.0, 1.0, 2.0)):
    """A linkage whose links are all in line."""
    a, b, c, d = lengths
    machine = mbody.Mechanism("folded", ground={"O": (0.0, 0.0), "C": (d, 0.0)})
    machine.add(
        *(
            mbody.Body(
                name,
                mass=mass,
                inertia=mass * length**2 / 12.0,
                cg=(0.5 * length, 0.0),
                points={"E": (length, 0.0)},
                guess=0.0,
            )
            for name, mass, length in (("crank", 1.0, a), ("coupler", 2.0, b), ("rocker", 1.0, c))
        ),
        mbody.Revolute("O", "ground.O", "crank"),
        mbody.Revolute("A", "crank.E", "coupler"),
        mbody.Revolute("B", "coupler.E", "rocker.E"),
        mbody.Revolute("C", "ground.C", "rocker"),
        *more,
    )
    machine.simulation = mbody.SimulationSettings(0.1, start, instants=3)
    return machine


def windows(**rates):
    """Two windows of equal rods in line: a branch of theirs is shaky all along."""
    machine = gallery.load("n_windows_2")
    start = {name: {"angle": 0.0, "omega": rate} for name, rate in rates.items()}
    machine.simulation = mbody.SimulationSettings(0.1, start, instants=3)
    return machine


def chain(count, **rates):
    """So many windows in line, posts 1 and rods 2 long: each doubles the branches."""
    machine = mbody.Mechanism("chain", ground={f"P{k}": (2.0 * k, 0.0) for k in range(count + 1)})
    for k in range(count + 1):
        machine.add(
            makers.bar(f"c{k}", 1.0, mass=1.0, guess=0.0),
            mbody.Revolute(f"O{k}", f"ground.P{k}", f"c{k}.A"),
        )
    for k in range(count):
        machine.add(
            makers.bar(f"r{k}", 2.0, mass=1.0, guess=0.0),
            mbody.Revolute(f"A{k}", f"c{k}.B", f"r{k}.A"),
            mbody.Revolute(f"B{k}", f"r{k}.B", f"c{k + 1}.B"),
        )
    start = {name: {"angle": 0.0, "omega": rate} for name, rate in rates.items()}
    machine.simulation = mbody.SimulationSettings(0.1, start, instants=3)
    return machine


def three_cranks(off):
    """Three parallel cranks, one longer by `off`."""
    machine = mbody.Mechanism("three cranks", ground={f"P{k}": (2.0 * k, 0.0) for k in range(3)})
    machine.add(
        *(makers.bar(f"c{k}", 1.0 + off * (k == 2), mass=1.0, guess=0.7) for k in range(3)),
        mbody.Body("coupler", points={f"Q{k}": (2.0 * k, 0.0) for k in range(3)}, guess=0.0),
        *(mbody.Revolute(f"O{k}", f"ground.P{k}", f"c{k}.A") for k in range(3)),
        *(mbody.Revolute(f"A{k}", f"c{k}.B", f"coupler.Q{k}") for k in range(3)),
        mbody.AngleDriver("motor", "c0", ConstantSpeed(0.7, 3.0)),
    )
    return machine


def unlike_a_motion():
    """Velocities that joints allow to first order, and no motion has."""
    machine = folded({})
    start = close_loops(machine, rates={"crank": 6.0, "coupler": 0.0})
    rows = start.record.table(slice(None)).copy()
    rows[0, 9:18] = [0.0, 3.0, 6.0, 0.0, 7.5, 1.5, 0.0, 4.5, 9.0]
    record = Record([rows[:, :, None]], 1, batch=False)
    return mbody.simulate(machine, 0.1, start=replace(start, record=record))


def rope():
    """A weight draws a block through the pulley of its rope."""
    machine = mbody.Mechanism("rope", ground={"P": (1.0, 0.0), "Q": (1.0, -0.2)})
    up = 0.5 * math.pi
    machine.add(
        mbody.Body("block", mass=1.0, guess=(0.0, 0.0, 0.0)),
        mbody.Body("weight", mass=2.0, guess=(1.0, -1.0, 0.0)),
        mbody.Prismatic("guide", "ground", "block"),
        mbody.Prismatic(
            "fall", mbody.Marker("ground", (1.0, 0.0), up), mbody.Marker("weight", (0.0, 0.0), up)
        ),
        mbody.LengthCoupling(
            "line",
            [
                mbody.CouplingTerm(1.0, distance=("ground.P", "block")),
                mbody.CouplingTerm(1.0, distance=("ground.Q", "weight")),
            ],
            1.8,
        ),
        mbody.Gravity("gravity", y=-9.81),
    )
    return machine


def winch():
    """A winch draws a block into itself."""
    machine = mbody.Mechanism("winch", ground={"P": (1.0, 0.0)})
    machine.add(
        mbody.Body("block", mass=1.0, guess=(0.0, 0.0, 0.0)),
        mbody.Prismatic("guide", "ground", "block"),
        mbody.DistanceDriver("pull", "ground.P", "block", ConstantSpeed(1.0, -0.5)),
    )
    return machine


def unjoined(*points):
    """A four-bar whose rocker is not joined to the ground."""
    made = four_bar()
    machine = mbody.Mechanism("unjoined", ground=made.ground.points)
    machine.add(*(element for element in made if element.name not in points))
    return machine


def begun(start):
    machine = four_bar(motor=False)
    machine.simulation = mbody.SimulationSettings(0.1, start)
    return lambda: mbody.simulate(machine)


def full(**changed):
    """Every place of a four-bar, some of them changed."""
    found = close_loops(four_bar(motor=False))
    start = {
        name: {"angle": float(found[name].angle[0])} for name in ("crank", "coupler", "rocker")
    }
    for name, angle in changed.items():
        start[name]["angle"] += angle
    return start


CRANK = {"crank": {"angle": 0.0, "omega": 6.0}}
MOTOR = mbody.AngleDriver("motor", "crank", ConstantSpeed(0.0, 6.0))
TIED = 2.0 * math.sqrt(3.0) - 3.0

SCENARIOS = {
    "places that do not fit together": begun(full(rocker=0.05)),
    "a folded start that only a driver moves": lambda: mbody.simulate(folded({}, MOTOR)),
    "a start from which more go than are counted": lambda: mbody.simulate(chain(7, c0=1.0)),
    "folded rates of no motion": lambda: mbody.simulate(
        folded({**CRANK, "coupler": {"omega": 3.0}})
    ),
    "folded rates that are all wrong": lambda: mbody.simulate(
        folded({**CRANK, "coupler": {"omega": 3.0}, "rocker": {"omega": 9.0}})
    ),
    "velocities of no motion": unlike_a_motion,
    "rest where branches are alike": lambda: mbody.simulate(
        folded(
            {}, mbody.Torque("one", "crank", value=TIED), mbody.Torque("other", "rocker", value=1.0)
        )
    ),
    "a motion along a shaky branch": lambda: mbody.simulate(windows(c0=0.0, c1=0.0, c2=1.0)),
    "a folded start under a spring that is too stiff": lambda: mbody.simulate(
        folded(
            {**CRANK, "coupler": {"omega": 0.0}}, mbody.TorsionSpring("k", "crank", stiffness=1e24)
        )
    ),
    "a folded start with a load of no value": lambda: mbody.simulate(
        folded(
            {**CRANK, "coupler": {"omega": 0.0}},
            mbody.Force("push", "rocker.E", "1 N*sqrt(1 - t/(1e-9 s))"),
        )
    ),
    "cranks that nearly repeat each other": lambda: mbody.kinematics(three_cranks(1e-5), t=0.0),
    "a block drawn through its pulley": lambda: mbody.simulate(rope(), 2.0),
    "a block that follows its winch to the end": lambda: mbody.kinematics(
        winch(), t=np.array([0.0, 3.0])
    ),
}

SENTENCES = r"""
places that do not fit together | SolveError | rocker | the places of the start do not fit together: the nearest position that joints and drivers allow has rocker.angle = 96.51396 deg (not 99.11521), crank.angle = 60.81542 deg (not 60), coupler.angle = 21.79859 deg (not 21.96428); correct them, or leave out places that follow from others
a folded start that only a driver moves | SolveError | coupler | the start of 'folded' at t = 0 s is a singular position, where branches of the motion meet, and 2 of them follow the drivers: give a rate that tells them apart, coupler.omega = 0 or -12 rad/s
a start from which more go than are counted | SolveError | c7 | the start of 'chain' at t = 0 s is a singular position, where branches of the motion meet, and at least … of them have the rates that are given (c0.omega = 1 rad/s): give rates…
folded rates of no motion | SolveError | coupler | no motion of 'folded' has the rates of the start: its position at t = 0 s is singular, where joints allow those rates to first order only; with crank.omega = 6 rad/s, coupler.omega can be 0 or -12 rad/s, not 3: give a rate that a motion has
folded rates that are all wrong | SolveError | - | no motion of 'folded' has the rates of the start: its position at t = 0 s is singular, where joints allow those rates to first order only; begin with the nearest that one has, crank.omega = 7.5, coupler.omega = 0, rocker.omega = 7.5 rad/s
velocities of no motion | SolveError | - | no motion of 'folded' has the velocities of the start at t = 0 s: the position is singular, where joints allow those velocities to first order only; begin with the nearest that one has, crank.omega = 7.5, coupler.omega = 0, rocker.omega = 7.5 rad/s
rest where branches are alike | SolveError | - | the motion of 'folded' is not determined at t = 0 s: the position is singular, 2 branches of the motion meet there, and the loads drive it along several of them alike; give a rate that chooses the branch, or begin a little beside
a motion along a shaky branch | SolveError | - | the motion of 'Windows: 2 four-bars in a row, one freedom' is not determined at t = 0 s: the position is singular, and conditions of second order do not determine the branches of its motion; begin a little beside it
a folded start under a spring that is too stiff | SolveError | - | the motion cannot be followed out of the singular position at t = 0 s: the loads jump there, or are too stiff; begin a little beside it
a folded start with a load of no value | SolveError | push | load 'push' has no value at t = 0.00854102 s: '1 N*sqrt(1 - t/(1e-9 s))' has no finite value there; choose one that has, by max or min
cranks that nearly repeat each other | SolveError | A1 | joints of 'three cranks' nearly repeat each other ('A1', 'O1', 'O0', 'A0', 'O2', 'A2'): all along the motion that they would allow a gap of about 1.3e-06 m is left, so that the loops close at isolated positions only; make the lengths agree to all digits, or leave out the joint that is one too many
a block drawn through its pulley | SolveError | line | the motion cannot go on at t = 0.553003 s: the distance that 'line' measures between 'ground' and 'block' comes down to 9.4e-09 m, and at 0 it has no direction; stop before, or move one of its places aside
a block that follows its winch to the end | SolveError | pull | the motion cannot go on at -4.99767e-10 m, t = 2 s, of 'block': the distance that 'pull' measures between 'ground' and 'block' comes down to 5e-10 m, and at 0 it has no direction; stop before, or move one of its places aside
"""
