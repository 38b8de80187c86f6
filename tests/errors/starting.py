"""First instants of motions: places and rates that do not fit, singular positions."""

import math
from dataclasses import replace

import numpy as np

from mbody import (
    AngleDriver,
    Body,
    CouplingTerm,
    DistanceDriver,
    Force,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Torque,
    TorsionSpring,
    gallery,
    kinematics,
    makers,
    simulate,
)
from mbody.engineering import close_loops
from mbody.laws import ConstantSpeed
from mbody.solution.histories import Record
from tests.errors.models import four_bar


def folded(start, *more, lengths=(1.0, 2.0, 1.0, 2.0)):
    """A linkage whose links are all in line."""
    a, b, c, d = lengths
    machine = Mechanism("folded", ground={"O": (0.0, 0.0), "C": (d, 0.0)})
    machine.add(
        *(
            Body(
                name,
                mass=mass,
                inertia=mass * length**2 / 12.0,
                cg=(0.5 * length, 0.0),
                points={"E": (length, 0.0)},
                guess=0.0,
            )
            for name, mass, length in (("crank", 1.0, a), ("coupler", 2.0, b), ("rocker", 1.0, c))
        ),
        Revolute("O", "ground.O", "crank"),
        Revolute("A", "crank.E", "coupler"),
        Revolute("B", "coupler.E", "rocker.E"),
        Revolute("C", "ground.C", "rocker"),
        *more,
    )
    machine.simulation = SimulationSettings(0.1, start, instants=3)
    return machine


def windows(**rates):
    """Two windows of equal rods in line: a branch of theirs is shaky all along."""
    machine = gallery.load("n_windows_2")
    start = {name: {"angle": 0.0, "omega": rate} for name, rate in rates.items()}
    machine.simulation = SimulationSettings(0.1, start, instants=3)
    return machine


def chain(count, **rates):
    """So many windows in line, posts 1 and rods 2 long: each doubles the branches."""
    machine = Mechanism("chain", ground={f"P{k}": (2.0 * k, 0.0) for k in range(count + 1)})
    for k in range(count + 1):
        machine.add(
            makers.bar(f"c{k}", 1.0, mass=1.0, guess=0.0),
            Revolute(f"O{k}", f"ground.P{k}", f"c{k}.A"),
        )
    for k in range(count):
        machine.add(
            makers.bar(f"r{k}", 2.0, mass=1.0, guess=0.0),
            Revolute(f"A{k}", f"c{k}.B", f"r{k}.A"),
            Revolute(f"B{k}", f"r{k}.B", f"c{k + 1}.B"),
        )
    start = {name: {"angle": 0.0, "omega": rate} for name, rate in rates.items()}
    machine.simulation = SimulationSettings(0.1, start, instants=3)
    return machine


def three_cranks(off):
    """Three parallel cranks, one longer by `off`."""
    machine = Mechanism("three cranks", ground={f"P{k}": (2.0 * k, 0.0) for k in range(3)})
    machine.add(
        *(makers.bar(f"c{k}", 1.0 + off * (k == 2), mass=1.0, guess=0.7) for k in range(3)),
        Body("coupler", points={f"Q{k}": (2.0 * k, 0.0) for k in range(3)}, guess=0.0),
        *(Revolute(f"O{k}", f"ground.P{k}", f"c{k}.A") for k in range(3)),
        *(Revolute(f"A{k}", f"c{k}.B", f"coupler.Q{k}") for k in range(3)),
        AngleDriver("motor", "c0", ConstantSpeed(0.7, 3.0)),
    )
    return machine


def unlike_a_motion():
    """Velocities that joints allow to first order, and no motion has."""
    machine = folded({})
    start = close_loops(machine, rates={"crank": 6.0, "coupler": 0.0})
    rows = start.record.table(slice(None)).copy()
    rows[0, 9:18] = [0.0, 3.0, 6.0, 0.0, 7.5, 1.5, 0.0, 4.5, 9.0]
    record = Record([rows[:, :, None]], 1, batch=False)
    return simulate(machine, 0.1, start=replace(start, record=record))


def rope():
    """A weight draws a block through the pulley of its rope."""
    machine = Mechanism("rope", ground={"P": (1.0, 0.0), "Q": (1.0, -0.2)})
    up = 0.5 * math.pi
    machine.add(
        Body("block", mass=1.0, guess=(0.0, 0.0, 0.0)),
        Body("weight", mass=2.0, guess=(1.0, -1.0, 0.0)),
        Prismatic("guide", "ground", "block"),
        Prismatic("fall", Marker("ground", (1.0, 0.0), up), Marker("weight", (0.0, 0.0), up)),
        LengthCoupling(
            "line",
            [
                CouplingTerm(1.0, distance=("ground.P", "block")),
                CouplingTerm(1.0, distance=("ground.Q", "weight")),
            ],
            1.8,
        ),
        Gravity("gravity", y=-9.81),
    )
    return machine


def winch():
    """A winch draws a block into itself."""
    machine = Mechanism("winch", ground={"P": (1.0, 0.0)})
    machine.add(
        Body("block", mass=1.0, guess=(0.0, 0.0, 0.0)),
        Prismatic("guide", "ground", "block"),
        DistanceDriver("pull", "ground.P", "block", ConstantSpeed(1.0, -0.5)),
    )
    return machine


def unjoined(*points):
    """A four-bar whose rocker is not joined to the ground."""
    made = four_bar()
    machine = Mechanism("unjoined", ground=made.ground.points)
    machine.add(*(element for element in made if element.name not in points))
    return machine


def begun(start):
    machine = four_bar(motor=False)
    machine.simulation = SimulationSettings(0.1, start)
    return lambda: simulate(machine)


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
MOTOR = AngleDriver("motor", "crank", ConstantSpeed(0.0, 6.0))
TIED = 2.0 * math.sqrt(3.0) - 3.0

SCENARIOS = {
    "places that do not fit together": begun(full(rocker=0.05)),
    "places that do not fit at all": begun(full(crank=0.5, coupler=0.5, rocker=0.5)),
    "rates that a driver contradicts": lambda: simulate(
        folded({"crank": {"angle": 0.3, "omega": 5.0}}, replace(MOTOR, law=ConstantSpeed(0.3, 6.0)))
    ),
    "a folded start without the rate that chooses": lambda: simulate(folded(CRANK)),
    "a folded start that only a driver moves": lambda: simulate(folded({}, MOTOR)),
    "folded links that are closed with one rate": lambda: close_loops(
        folded({}), rates={"crank": 6.0}
    ),
    "a start from which many branches go": lambda: simulate(chain(3, c0=1.0)),
    "a start from which more go than are counted": lambda: simulate(chain(7, c0=1.0)),
    "folded rates of no motion": lambda: simulate(folded({**CRANK, "coupler": {"omega": 3.0}})),
    "folded rates of no motion beside a driver": lambda: simulate(
        folded({"coupler": {"angle": 0.0, "omega": 3.0}}, MOTOR)
    ),
    "folded rates that are all wrong": lambda: simulate(
        folded({**CRANK, "coupler": {"omega": 3.0}, "rocker": {"omega": 9.0}})
    ),
    "velocities of no motion": unlike_a_motion,
    "rest where branches are alike": lambda: simulate(
        folded({}, Torque("one", "crank", value=TIED), Torque("other", "rocker", value=1.0))
    ),
    "a motion along a shaky branch": lambda: simulate(windows(c0=0.0, c1=0.0, c2=1.0)),
    "a folded start under a spring that is too stiff": lambda: simulate(
        folded({**CRANK, "coupler": {"omega": 0.0}}, TorsionSpring("k", "crank", stiffness=1e24))
    ),
    "a folded start with a load of no value": lambda: simulate(
        folded(
            {**CRANK, "coupler": {"omega": 0.0}},
            Force("push", "rocker.E", "1 N*sqrt(1 - t/(1e-9 s))"),
        )
    ),
    "cranks that nearly repeat each other": lambda: kinematics(three_cranks(1e-5), t=0.0),
    "a block drawn through its pulley": lambda: simulate(rope(), 2.0),
    "a block drawn into its winch": lambda: simulate(winch(), 3.0),
    "a block that follows its winch to the end": lambda: kinematics(
        winch(), t=np.array([0.0, 3.0])
    ),
    "a joint with the ground that is missing": lambda: kinematics(unjoined("O4"), t=0.0),
    "joints that are missing": lambda: kinematics(unjoined("O4", "O2"), t=0.0),
}
