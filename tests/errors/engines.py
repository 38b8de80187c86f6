"""Engines: cycles, orders, firing orders, shafts, flywheels."""

import functools
import math

import numpy as np

from mbody import (
    AngleDriver,
    Body,
    Mechanism,
    Revolute,
    Torque,
    gallery,
    kinematics,
    kinetostatics,
)
from mbody.engineering import (
    balance_shafts,
    firing_angles,
    harmonics,
    rocking_couple,
    shaking_orders,
    size_flywheel,
)
from mbody.laws import ConstantSpeed
from mbody.model.simulation import Instants
from tests.errors.command import said
from tests.errors.engineering import brake
from tests.errors.models import four_bar
from tests.errors.results import batch

TURN = 2.0 * math.pi


@functools.cache
def turn(speed=1.0):
    return kinetostatics(four_bar(speed=speed), turn=True, instants=33)


def slowing():
    """A crank that slows down over its turn."""
    return kinetostatics(gallery.load("norton_fourbar"), turn=True, instants=33)


def wavering():
    """A crank whose speed changes over the turn, and comes back."""
    angle = np.linspace(0.0, TURN, 33)
    drive = {"motor": (angle, 1.0 + 0.1 * np.sin(angle), 0.1 * np.cos(angle))}
    return kinetostatics(four_bar(speed=1.0), drive=drive)


def on_an_arm():
    """A wheel that is driven against an arm."""
    machine = Mechanism("wheel on an arm")
    machine.add(
        Body("arm", points={"P": (1.0, 0.0)}),
        Body("wheel", mass=1.0, cg=(0.1, 0.0)),
        Revolute("O", "ground", "arm"),
        Revolute("P", "arm.P", "wheel"),
        AngleDriver("hold", "arm", ConstantSpeed(0.0, 0.0)),
        AngleDriver("fan", "wheel", ConstantSpeed(0.0, 2.0), relative_to="arm"),
        Torque("brake", "wheel", value="-1 N*m - 1 N*m*sin(wheel.angle)"),
    )
    return kinetostatics(machine, turn="fan")


def half_speed():
    """A load that repeats every second turn, over one turn."""
    machine = four_bar(Torque("load", "rocker", value="3 N*m*sin(crank.angle/2)"), speed=1.0)
    return kinetostatics(machine, turn=True, instants=33)


SCENARIOS = {
    "turns of no driver": lambda: kinematics(four_bar(speed=1.0), t=0.0, turns=2),
    "no turn at all": lambda: kinematics(four_bar(speed=1.0), turn=True, turns=0),
    "half a turn, asked": lambda: Instants(over="turn", turns=0.5),
    "turns of instants": lambda: Instants(at={"t": 0.0}, turns=2),
    "turns of a position": said(
        ["kinematics", "norton_fourbar", "--at", "crank=3", "--turns", "2"]
    ),
    "turns in words": said(["kinematics", "v_twin", "--turns", "two"]),
    "harmonics of half a cycle": lambda: harmonics(half_speed(), "load.torque"),
    "harmonics of a load that grows": lambda: harmonics(brake(), "motor.effort"),
    "harmonics of two values": lambda: harmonics(turn(), [1.0, 2.0]),
    "harmonics at unequal steps": lambda: harmonics(
        [0.0, 1.0, 3.0, 4.0, TURN], [1.0, 2.0, 3.0, 4.0, 1.0]
    ),
    "a harmonic of too high an order": lambda: harmonics(turn(), "O2.fx", highest=30),
    "a harmonic that there is not": lambda: harmonics(turn(), "O2.fx").of(0.5),
    "shaking orders of a batch": lambda: shaking_orders(batch()),
    "shafts at a speed that changes": lambda: balance_shafts(wavering()),
    "shafts of half an order": lambda: balance_shafts(turn(), [0.5]),
    "a couple of no body": lambda: rocking_couple(turn(), {"piston": 1.0}),
    "a couple of a batch": lambda: rocking_couple(batch(), {}),
    "orders of shaking in words": said(["shaking", "v_twin", "--orders", "all"]),
    "a firing order that leaves out a cylinder": lambda: firing_angles("1-3-4", 4),
    "a firing order with a cylinder twice": lambda: firing_angles("1-3-4-3-2"),
    "a firing order of a cylinder that is not there": lambda: firing_angles("1-5", 2),
    "a firing order in words": lambda: firing_angles("one, two"),
    "a firing order of halves": lambda: firing_angles([1.0, 2.5]),
    "a firing order of no cylinders": lambda: firing_angles("1-2", 0),
    "a firing order of no turns": lambda: firing_angles("1-2", turns=0),
    "firing intervals that are not the cycle": lambda: firing_angles("1-2", intervals=[1.0, 2.0]),
    "firing away from the dead centre": lambda: firing_angles(
        "1-2-3", cranks={1: 0.0, 2: 0.0, 3: 0.0}
    ),
    "cranks of other cylinders": lambda: firing_angles("1-2", cranks={1: 0.0, 3: 0.0}),
    "a flywheel for three times the speed": lambda: size_flywheel(turn(), 3.0),
    "a flywheel of a batch": lambda: size_flywheel(batch(), 0.02),
    "a flywheel simulated on an arm": lambda: size_flywheel(on_an_arm(), 0.02, "fan").simulated(),
    "a half order that there is not": lambda: harmonics(
        np.linspace(0.0, 2.0 * TURN, 33), np.ones(33)
    ).of(0.3),
    "a flywheel sized at rest": lambda: size_flywheel(turn(0.0), 0.02),
    "a flywheel at a speed that changes": lambda: size_flywheel(slowing(), 0.02),
    "a coefficient in words": said(["flywheel", "v_twin", "--coefficient", "small"]),
}

SENTENCES = r"""
turns of no driver | ModelError | - | turns goes with turn, which says whose they are: turn=True, turns=2
no turn at all | ModelError | - | turns must be a whole number from 1 to 1000, not 0
half a turn, asked | ModelError | - | ask: turns must be a whole number from 1 to 1000, not 0.5
turns of instants | ModelError | - | ask: turns goes with over, which says whose they are
turns of a position | UsageError | - | --turns is of whole turns, --at of single instants: give one of them; in equal steps --at crank=0:360:25
turns in words | UsageError | - | --turns takes a whole number, not 'two'
harmonics of half a cycle | ModelError | - | the value of load.torque is 1.5 at the beginning of the cycle and -1.5 at its end: a harmonic needs a periodic cycle: give the driver a constant speed, and use whole cycles of the loads (turns=2 where they take two turns)
harmonics of a load that grows | ModelError | - | the value of motor.effort is 1.75884 at the beginning of the cycle and 3.76969 at its end: a harmonic needs a periodic cycle: give the driver a constant speed, and use whole cycles of the loads (turns=2 where they take two turns)
harmonics of two values | ModelError | - | harmonics of (2,) values at (33,) angles: give one value an instant
harmonics at unequal steps | ModelError | - | harmonics need equal steps of the driver's angle, these are off by up to 40.8 deg: analyse with turn=True
a harmonic of too high an order | ModelError | - | 32 instants of 1 turn show orders up to 8, not 30: take four instants a period or more
a harmonic that there is not | ModelError | - | there is no order 0.5 of a cycle of 1 turn: orders are whole numbers up to 8
shaking orders of a batch | ModelError | - | harmonics are of one design, this is a batch of 2 designs: take one of them, run.design(n)
shafts at a speed that changes | ModelError | motor | balance shafts are for a constant speed, 'motor' has 0.9 to 1.1 rad/s: give its law a constant speed
shafts of half an order | ModelError | - | there is no shaft of order 0.5: orders of this cycle are multiples of 1, above 0
a couple of no body | ModelError | piston | there is no moving body 'piston' (there are: 'crank', 'coupler', 'rocker')
a couple of a batch | ModelError | - | a rocking couple is of one design, this is a batch of 2 designs: take one of them, run.design(n)
orders of shaking in words | UsageError | - | --orders takes numbers above 0 such as 2, not 'all'
a firing order that leaves out a cylinder | ModelError | - | the firing order 1-3-4 does not fit 4 cylinders: cylinder 2 does not fire; name each from 1 to 4 once
a firing order with a cylinder twice | ModelError | - | the firing order 1-3-4-3-2 does not fit 5 cylinders: cylinder 3 fires twice, cylinder 5 does not fire; name each from 1 to 5 once
a firing order of a cylinder that is not there | ModelError | - | the firing order 1-5 does not fit 2 cylinders: cylinder 5 is not there, cylinder 2 does not fire; name each from 1 to 2 once
a firing order in words | ModelError | - | a firing order is numbers of cylinders such as '1-3-4-2', not 'one, two'
a firing order of halves | ModelError | - | a firing order is whole numbers such as [1, 3, 4, 2], not [1.0, 2.5]
a firing order of no cylinders | ModelError | - | cylinders must be a whole number from 1 on, not 0
a firing order of no turns | ModelError | - | turns must be a whole number from 1 on, not 0
firing intervals that are not the cycle | ModelError | - | 2 intervals of 171.887 deg in all do not make the cycle of 2 cylinders, 720 deg: give one after each firing
firing away from the dead centre | ModelError | - | cylinder 2 fires 240 deg after cylinder 1, where its piston is 120 deg of the crank away from the dead centre: choose another firing order, or give the intervals
cranks of other cylinders | ModelError | - | there are cranks of the cylinders 1, 3, and the firing order has 1, 2: give one a cylinder
a flywheel for three times the speed | ModelError | - | the coefficient of fluctuation of speed is (ω_max − ω_min)/ω, between 0 and 2, not 3.0: a common one is 0.02
a flywheel of a batch | ModelError | - | a flywheel is of one design, this is a batch of 2 designs: take one of them, run.design(n)
a flywheel simulated on an arm | ModelError | fan | 'fan' turns 'wheel' against 'arm': a flywheel is simulated on a shaft that turns in the ground
a half order that there is not | ModelError | - | there is no order 0.3 of a cycle of 2 turns: orders are multiples of 1/2 up to 4
a flywheel sized at rest | ModelError | motor | driver 'motor' has no speed, which a flywheel needs: give its law a speed
a flywheel at a speed that changes | ModelError | motor | a flywheel is sized at a constant speed, 'motor' has 11.061 to 25 rad/s: give its law a constant speed
a coefficient in words | UsageError | - | --coefficient takes a number, not 'small'
"""
