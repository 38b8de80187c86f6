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
from mbody.model.study import Instants
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
