"""Small mechanisms whose rest positions have a closed form."""

import math

from mbody import Body, Gravity, Marker, Mechanism, Revolute, makers
from mbody.model.loads import CentrifugalField

UPRIGHT = Marker("ground", (0.0, 0.0), 0.5 * math.pi)
g = 9.81


def pendulum(*more, inertia=0.0):
    """2 kg, half a metre below its pin."""
    machine = Mechanism("pendulum")
    body = Body("rod", mass=2.0, inertia=inertia, cg=(0.5, 0.0), guess=-1.5, spread="point")
    machine.add(body, Revolute("O", "ground", "rod"), Gravity("gravity", y=-g), *more)
    return machine


def angles(found, body):
    """Angles of a body [rad] at all rest positions, −π … π."""
    return [math.remainder(float(one[body].angle[0]), 2.0 * math.pi) for one in found]


def four_bar(*more):
    made = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0))
    machine = Mechanism("hanging four-bar", ground=made.ground.points)
    machine.add(*made.bodies, *made.joints, Gravity("gravity", y=-g), *more)
    return machine


def whirling(speed):
    return pendulum(CentrifugalField("field", UPRIGHT, speed=speed))
