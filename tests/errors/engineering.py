"""Engineering: fluctuation and flywheel, shaking force, indicator diagram."""

import functools

import numpy as np

import mbody
from mbody.engineering import (
    energy_fluctuation,
    fluctuation,
    flywheel,
    indicator,
    inflection_circle,
    instant_centres,
    shaking_force,
    velocity_polygon,
)
from mbody.laws import ConstantSpeed
from mbody.model.loads import ReciprocatingCylinder
from mbody.solution.doubts import Doubt, doubted
from tests.errors.models import four_bar
from tests.errors.results import batch, motion, run

TURN = 2.0 * np.pi


@functools.cache
def turn(speed=1.0):
    return mbody.kinetostatics(four_bar(speed=speed), turn=True, instants=13)


def brake():
    """A run whose load grows from turn to turn."""
    machine = four_bar(mbody.Torque("brake", "rocker", value=lambda t: -1.0 - t))
    return mbody.kinetostatics(machine, turn=True, instants=13)


def two_motors():
    """A four-bar, and a wheel beside it with a motor of its own."""
    machine = four_bar(mbody.Body("wheel"), mbody.Revolute("W", "ground", "wheel"))
    machine.add(mbody.AngleDriver("fan", "wheel", ConstantSpeed(0.0, 1.0)))
    return machine


@functools.cache
def compressor():
    """A four-bar as a compressor: a piston on the rocker."""
    air = ReciprocatingCylinder(
        *("air", "ground.O2", "rocker.B"),
        **{"area": 0.1, "near": 5.0, "far": 1.0, "clearance": 0.1, "delivery": 2.0},
        **{"exponent": 1.3, "ambient": 1.0},
    )
    return mbody.kinetostatics(four_bar(air))


def at_rest():
    """A wheel on a pin, that nothing turns."""
    machine = mbody.Mechanism("a wheel at rest")
    machine.add(mbody.Body("wheel", mass=1.0, inertia=1.0), mbody.Revolute("W", "ground", "wheel"))
    return machine


def designs():
    system = mbody.assemble(compressor().mechanism).with_values({"air.area": [0.1, 0.2]})
    return mbody.kinetostatics(system)


LEAPT = (
    "from t = 0.3 s on it is not certain on which branch the motion goes on: rows of 'A' "
    "become dependent there; begin a little beside"
)


def in_doubt():
    """A turn that may have left its branch."""
    return doubted(turn(), [Doubt("branch", LEAPT, 0.3)])


SCENARIOS = {
    "a fluctuation of half of a diagram": lambda: energy_fluctuation([0.0, 1.0]),
    "a fluctuation of one instant": lambda: fluctuation(run()),
    "a fluctuation that does not repeat": lambda: fluctuation(brake()),
    "a fluctuation of one of two motors": lambda: fluctuation(mbody.kinetostatics(two_motors())),
    "a flywheel for no fluctuation": lambda: flywheel(turn(), 0.0),
    "a flywheel at rest": lambda: flywheel(turn(0.0), 0.02),
    "a flywheel of a motion in doubt": lambda: flywheel(in_doubt(), 0.02),
    "a shaking force of kinematics": lambda: shaking_force(motion()),
    "a shaking force of a batch": lambda: shaking_force(batch()),
    "a shaking moment about a link": lambda: shaking_force(run(), "crank.A"),
    "a diagram of no cylinder": lambda: indicator(run(), "oil"),
    "a diagram of a batch": lambda: indicator(designs(), "air"),
    "centres of a batch": lambda: instant_centres(batch()),
    "centres of what does not move": lambda: instant_centres(mbody.simulate(at_rest(), 0.1)),
    "a centre of one body": lambda: instant_centres(turn())["crank", "piston"],
    "a side of no point": lambda: velocity_polygon(turn()).between("crank.A", "rocker.P"),
    "an inflection circle of a batch": lambda: inflection_circle(batch(), "rocker"),
    "a diagram of the other side": lambda: indicator(compressor(), "air", opposite=True),
}

SENTENCES = r"""
a fluctuation of half of a diagram | ModelError | - | energy_fluctuation takes angles and torques, or a result: give both
a fluctuation of one instant | ModelError | - | a fluctuation needs whole turns in one direction, both ends included; these 1 instants are 0 deg: analyse with turn=True
a fluctuation that does not repeat | ModelError | - | the torque is 1.75884 at the beginning of the cycle and 3.76969 at its end: a fluctuation needs a periodic cycle: give the driver a constant speed, and use whole cycles of the loads (turns=2 where they take two turns)
a fluctuation of one of two motors | ModelError | - | several drivers turn a body here (there are: 'motor', 'fan'): name one of them
a flywheel for no fluctuation | ModelError | - | the coefficient of fluctuation of speed is (ω_max − ω_min)/ω, between 0 and 2, not 0.0: a common one is 0.02
a flywheel at rest | ModelError | motor | driver 'motor' has no speed, which a flywheel needs: give its law a speed
a flywheel of a motion in doubt | ModelWarning | - | flywheel: the motion for its size is doubtful: from t = 0.3 s on it is not certain on which branch the motion goes on: rows of 'A' become dependent there; begin a little beside
a shaking force of kinematics | ModelError | - | kinematics computes no forces: use kinetostatics
a shaking force of a batch | ModelError | - | the shaking force is of one design, this is a batch of 2 designs: take one of them, run.design(n)
a shaking moment about a link | ModelError | - | the shaking moment is taken about a place on the ground, not on 'crank': name one such as "ground.O2"
a diagram of no cylinder | ModelError | - | there is no cylinder with valves 'oil' (there are: none)
a diagram of a batch | ModelError | air | the diagram of 'air' is of one design, this is a batch of 2 designs: take one of them, run.design(n)
centres of a batch | ModelError | - | instant centres are of one design, this is a batch of 2 designs: take one of them, run.design(n)
centres of what does not move | ModelError | - | nothing moves in 'a wheel at rest', so that there are no instant centres: give a driver a speed, or take instants at which it moves
a centre of one body | ModelError | - | there is no instant centre of ('crank', 'piston'): give two of the bodies 'crank', 'coupler', 'rocker', 'ground', as in centres["coupler", "ground"]
a side of no point | ModelError | - | 'rocker.P' is not in the polygon, which has 'ground.O2', 'crank.O2', 'crank.A', 'coupler.A', 'coupler.B', 'rocker.B', 'ground.O4', 'rocker.O4'
an inflection circle of a batch | ModelError | - | an inflection circle is of one design, this is a batch of 2 designs: take one of them, run.design(n)
a diagram of the other side | ModelError | air | 'air' is single-acting, it has no opposite side: give it an opposite_area
"""
