"""Engines: cycles, orders, firing orders, shafts, flywheels."""

import functools
import math

import numpy as np

import mbody
from mbody import gallery
from mbody.engineering import (
    balance_shafts,
    firing_angles,
    harmonics,
    rocking_couple,
    size_flywheel,
)
from mbody.laws import ConstantSpeed
from mbody.model.simulation import Instants
from tests.errors.command import said
from tests.errors.models import four_bar
from tests.errors.results import batch

TURN = 2.0 * math.pi


@functools.cache
def turn(speed=1.0):
    return mbody.kinetostatics(four_bar(speed=speed), turn=True, instants=33)


def slowing():
    """A crank that slows down over its turn."""
    return mbody.kinetostatics(gallery.load("norton_fourbar"), turn=True, instants=33)


def wavering():
    """A crank whose speed changes over the turn, and comes back."""
    angle = np.linspace(0.0, TURN, 33)
    drive = {"motor": (angle, 1.0 + 0.1 * np.sin(angle), 0.1 * np.cos(angle))}
    return mbody.kinetostatics(four_bar(speed=1.0), drive=drive)


def on_an_arm():
    """A wheel that is driven against an arm."""
    machine = mbody.Mechanism("wheel on an arm")
    machine.add(
        mbody.Body("arm", points={"P": (1.0, 0.0)}),
        mbody.Body("wheel", mass=1.0, cg=(0.1, 0.0)),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Revolute("P", "arm.P", "wheel"),
        mbody.AngleDriver("hold", "arm", ConstantSpeed(0.0, 0.0)),
        mbody.AngleDriver("fan", "wheel", ConstantSpeed(0.0, 2.0), relative_to="arm"),
        mbody.Torque("brake", "wheel", value="-1 N*m - 1 N*m*sin(wheel.angle)"),
    )
    return mbody.kinetostatics(machine, turn="fan")


SCENARIOS = {
    "turns of no driver": lambda: mbody.kinematics(four_bar(speed=1.0), t=0.0, turns=2),
    "turns of instants": lambda: Instants(at={"t": 0.0}, turns=2),
    "turns of a position": said(
        ["kinematics", "norton_fourbar", "--at", "crank=3", "--turns", "2"]
    ),
    "harmonics of two values": lambda: harmonics(turn(), [1.0, 2.0]),
    "harmonics at unequal steps": lambda: harmonics(
        [0.0, 1.0, 3.0, 4.0, TURN], [1.0, 2.0, 3.0, 4.0, 1.0]
    ),
    "a harmonic of too high an order": lambda: harmonics(turn(), "O2.fx", highest=30),
    "a harmonic that there is not": lambda: harmonics(turn(), "O2.fx").of(0.5),
    "shafts at a speed that changes": lambda: balance_shafts(wavering()),
    "shafts of half an order": lambda: balance_shafts(turn(), [0.5]),
    "a couple of no body": lambda: rocking_couple(turn(), {"piston": 1.0}),
    "orders of shaking in words": said(["shaking", "v_twin", "--orders", "all"]),
    "a firing order with a cylinder twice": lambda: firing_angles("1-3-4-3-2"),
    "a firing order in words": lambda: firing_angles("one, two"),
    "a firing order of halves": lambda: firing_angles([1.0, 2.5]),
    "firing intervals that are not the cycle": lambda: firing_angles("1-2", intervals=[1.0, 2.0]),
    "firing away from the dead centre": lambda: firing_angles(
        "1-2-3", cranks={1: 0.0, 2: 0.0, 3: 0.0}
    ),
    "cranks of other cylinders": lambda: firing_angles("1-2", cranks={1: 0.0, 3: 0.0}),
    "a flywheel of a batch": lambda: size_flywheel(batch(), 0.02),
    "a flywheel simulated on an arm": lambda: size_flywheel(on_an_arm(), 0.02, "fan").simulated(),
    "a half order that there is not": lambda: harmonics(
        np.linspace(0.0, 2.0 * TURN, 33), np.ones(33)
    ).of(0.3),
    "a flywheel sized at rest": lambda: size_flywheel(turn(0.0), 0.02),
    "a flywheel at a speed that changes": lambda: size_flywheel(slowing(), 0.02),
}

SENTENCES = r"""
turns of no driver | ModelError | - | turns goes with turn, which says whose they are: turn=True, turns=2
turns of instants | ModelError | - | ask: turns goes with over, which says whose they are
turns of a position | UsageError | - | --turns is of whole turns, --at of single instants: give one of them; in equal steps --at crank=0:360:25
harmonics of two values | ModelError | - | harmonics of (2,) values at (33,) angles: give one value an instant
harmonics at unequal steps | ModelError | - | harmonics need equal steps of the driver's angle, these are off by up to 40.8 deg: analyse with turn=True
a harmonic of too high an order | ModelError | - | 32 instants of 1 turn show orders up to 8, not 30: take four instants a period or more
a harmonic that there is not | ModelError | - | there is no order 0.5 of a cycle of 1 turn: orders are whole numbers up to 8
shafts at a speed that changes | ModelError | motor | balance shafts are for a constant speed, 'motor' has 0.9 to 1.1 rad/s: give its law a constant speed
shafts of half an order | ModelError | - | there is no shaft of order 0.5: orders of this cycle are multiples of 1, above 0
a couple of no body | ModelError | piston | there is no moving body 'piston' (there are: 'crank', 'coupler', 'rocker')
orders of shaking in words | UsageError | - | --orders takes numbers above 0 such as 2, not 'all'
a firing order with a cylinder twice | ModelError | - | the firing order 1-3-4-3-2 does not fit 5 cylinders: cylinder 3 fires twice, cylinder 5 does not fire; name each from 1 to 5 once
a firing order in words | ModelError | - | a firing order is numbers of cylinders such as '1-3-4-2', not 'one, two'
a firing order of halves | ModelError | - | a firing order is whole numbers such as [1, 3, 4, 2], not [1.0, 2.5]
firing intervals that are not the cycle | ModelError | - | 2 intervals of 171.887 deg in all do not make the cycle of 2 cylinders, 720 deg: give one after each firing
firing away from the dead centre | ModelError | - | cylinder 2 fires 240 deg after cylinder 1, where its piston is 120 deg of the crank away from the dead centre: choose another firing order, or give the intervals
cranks of other cylinders | ModelError | - | there are cranks of the cylinders 1, 3, and the firing order has 1, 2: give one a cylinder
a flywheel of a batch | ModelError | - | a flywheel is of one design, this is a batch of 2 designs: take one of them, run.design(n)
a flywheel simulated on an arm | ModelError | fan | 'fan' turns 'wheel' against 'arm': a flywheel is simulated on a shaft that turns in the ground
a half order that there is not | ModelError | - | there is no order 0.3 of a cycle of 2 turns: orders are multiples of 1/2 up to 4
a flywheel sized at rest | ModelError | motor | driver 'motor' has no speed, which a flywheel needs: give its law a speed
a flywheel at a speed that changes | ModelError | motor | a flywheel is sized at a constant speed, 'motor' has 11.061 to 25 rad/s: give its law a constant speed
"""
