"""Mechanisms whose bodies lie on each other, for the analyses of driven motions and of rest."""

from __future__ import annotations

import math

import mbody
from mbody.laws import ConstantAcceleration, ConstantSpeed

G = 9.81

LADDER = """
name = "ladder"
g = 9.81
[ground]
points = { O = [0, 0] }
[ground.shapes]
floor = { line = { point = "O" } }
wall = { line = { point = "O", angle = -90 } }
[bodies.ladder]
weight = 200
inertia = 6
points = { foot = [-1, 0], top = [1, 0] }
[contacts]
foot = { contact = ["ground.floor", "ladder.foot"], friction = 0.25 }
top = { contact = ["ground.wall", "ladder.top"], friction = 0.15 }
[gravity]
y = -9.81
[simulate]
until = 1
start = { ladder = { x = "cos(1 rad) m", y = "sin(1 rad) m", angle = "pi rad - 1 rad" } }
"""

HELD_LADDER = (
    LADDER
    + """
[drivers.hold]
coordinate = ["ground.O", "ladder.foot"]
law = "2*cos(1 rad) m"
"""
)


def box(mu: float = 0.2, slope: float = 0.5, height: float = 0.0) -> mbody.Mechanism:
    """A box half as high as long on an incline, drawn along it at a height above its middle."""
    plane = {"plane": {"line": {"point": "O", "angle": slope}}}
    machine = mbody.Mechanism("box", g=G, ground={"O": (0, 0)}, ground_shapes=plane)
    a, b = 0.5, 0.25
    corners = {"A": (-a, -b), "B": (a, -b), "C": (a, b), "D": (-a, b)}
    machine.add(
        mbody.Body(
            "box",
            weight=50.0,
            inertia=1.0,
            points={**corners, "P": (0.0, height)},
            shapes={"rim": {"polygon": ["A", "B", "C", "D"]}},
            guess=(-b * math.sin(slope), b * math.cos(slope), slope),
        ),
        mbody.Contact("under", "ground.plane", "box.rim", friction=mu),
        mbody.CoordinateDriver("pull", mbody.Marker("ground", (0.0, 0.0), slope), "box.P", 0.0),
        mbody.Gravity("gravity", y=-G),
    )
    return machine


def vehicle(mu: float = 0.8, slows: float = -3.0) -> mbody.Mechanism:
    """Two wheels on a road and a body on them, whose rear axle is driven along the road."""
    road = {"road": {"line": {"point": "O"}}}
    machine = mbody.Mechanism("vehicle", ground={"O": (0, 0)}, ground_shapes=road)
    for name, x in (("rear", 0.0), ("front", 2.5)):
        rim = {"rim": {"disc": "C", "radius": 0.3}}
        machine.add(
            mbody.Body(
                name, mass=20, inertia=1.0, points={"C": (0, 0)}, shapes=rim, guess=(x, 0.3, 0.0)
            )
        )
    machine.add(
        mbody.Body(
            "body",
            mass=1000,
            inertia=1500,
            cg=(1.1, 0.4),
            points={"R": (0, 0), "F": (2.5, 0)},
            guess=(0.0, 0.3, 0.0),
        ),
        mbody.Revolute("R", "rear.C", "body.R"),
        mbody.Revolute("F", "front.C", "body.F"),
        mbody.Contact("back", "ground.road", "rear.rim", friction=mu),
        mbody.Contact("ahead", "ground.road", "front.rim", friction=mu),
        mbody.Gravity("gravity", y=-G),
        mbody.CoordinateDriver(
            "along", "ground.O", "body.R", ConstantAcceleration(0.0, 20.0, slows)
        ),
    )
    return machine


def lamp() -> mbody.Mechanism:
    """A lamp on two ropes."""
    machine = mbody.Mechanism("lamp", ground={"A": (0, 0), "B": (2, 0)})
    machine.add(
        mbody.Body("lamp", mass=5, inertia=0.1, points={"P": (0, 0)}, guess=(0.8, -1.2, 0.0)),
        mbody.Rope("left", "ground.A", "lamp.P", length=math.hypot(0.8, 1.2)),
        mbody.Rope("right", "ground.B", "lamp.P", length=1.2 * math.sqrt(2.0)),
        mbody.AngleDriver("turn", "lamp", 0.0),
        mbody.Gravity("gravity", y=-G),
    )
    return machine


def eccentric(mu: float) -> mbody.Mechanism:
    """A disc that turns about a point off its centre and lifts a roller that does not turn, on a
    guide.
    """
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    tip = {"tip": {"disc": "P", "radius": 0.05}}
    machine = mbody.Mechanism("eccentric", ground={"O": (0, 0)})
    machine.add(
        mbody.Body("cam", mass=2.0, inertia=0.05, points={"O": (0, 0), "C": (0.05, 0)}, shapes=rim),
        mbody.Body(
            "follower",
            mass=1.0,
            inertia=0.01,
            points={"P": (0, 0)},
            shapes=tip,
            guess=(0.0, 0.245, 0.0),
        ),
        mbody.Revolute("O", "ground.O", "cam.O"),
        mbody.Contact("lifts", "cam.rim", "follower.tip", friction=mu),
        mbody.AngleDriver("motor", "cam", ConstantSpeed(0.0, 5.0)),
        mbody.AngleDriver("upright", "follower", 0.0),
        mbody.CoordinateDriver("guide", "ground.O", "follower.P", 0.0),
        mbody.Gravity("gravity", y=-G),
    )
    return machine


def yoke(joint: bool, mu: float) -> mbody.Mechanism:
    """A crank pin that lifts a straight guide: by a contact, or by a joint of the same rows."""
    machine = mbody.Mechanism("yoke", ground={"O": (0, 0)})
    shapes = {"foot": {"line": {"point": "S", "angle": math.pi}}}
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=0.02, points={"O": (0, 0), "A": (0.1, 0)}),
        mbody.Body(
            "yoke",
            mass=4.0,
            inertia=0.1,
            points={"S": (0, 0)},
            shapes=shapes,
            guess=(0.0, 0.05, 0.0),
        ),
        mbody.Revolute("O", "ground.O", "crank.O"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed("30 deg", 3.0)),
        mbody.AngleDriver("upright", "yoke", 0.0),
        mbody.CoordinateDriver("guide", "ground.O", "yoke.S", 0.0),
        mbody.Gravity("gravity", y=-G),
        mbody.Force("load", "yoke.S", 20.0, angle="-90 deg"),
    )
    if joint:
        machine.add(
            mbody.PinSlot("pin", mbody.Marker("yoke", "S", math.pi), "crank.A", friction=mu)
        )
    else:
        machine.add(mbody.Contact("pin", "yoke.foot", "crank.A", friction=mu))
    return machine


def sledge() -> mbody.Mechanism:
    """A point that is drawn along a table of 1 m."""
    table = {"table": {"segment": ("O", "E")}}
    ground = {"O": (0, 0), "E": (1, 0)}
    machine = mbody.Mechanism("sledge", ground=ground, ground_shapes=table)
    machine.add(
        mbody.Body("sledge", mass=2.0, inertia=0.1, points={"C": (0, 0)}, guess=(0.5, 0.0, 0.0)),
        mbody.Contact("under", "ground.table", "sledge.C", friction=0.2),
        mbody.AngleDriver("upright", "sledge", 0.0),
        mbody.CoordinateDriver("pull", "ground.O", "sledge.C", ConstantSpeed(0.5, 1.0)),
        mbody.Gravity("gravity", y=-G),
    )
    return machine


def crank_over_a_floor() -> mbody.Mechanism:
    """A crank that its driver leads through a floor."""
    floor = {"floor": {"line": {"point": "F"}}}
    ground = {"O": (0, 0), "F": (0, -0.5)}
    machine = mbody.Mechanism("crank over a floor", ground=ground, ground_shapes=floor)
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=0.1, points={"O": (0, 0), "A": (0.8, 0)}),
        mbody.Revolute("O", "ground.O", "crank.O"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(0.0, 1.0)),
        mbody.Contact("tip", "ground.floor", "crank.A"),
    )
    return machine


#: Roads of a disc.
LINE, RING = {"line": {"point": "O"}}, {"ring": "O", "radius": 1.0}


def rolling_disc(shape, x, y, angle):
    """A disc of 0.2 m on a line, or in a ring of 1 m, that begins with this place and angle."""
    machine = mbody.Mechanism("disc", ground={"O": (0, 0)}, ground_shapes={"road": shape})
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    machine.add(
        mbody.Body("disc", mass=2.0, inertia=0.04, points={"C": (0, 0)}, shapes=rim),
        mbody.Contact("road", "ground.road", "disc.rim", friction=0.9),
        mbody.Gravity("gravity", y=-G),
    )
    begun = {"disc": {"x": x, "y": y, "angle": angle}}
    machine.simulation = mbody.SimulationSettings(until=0.5, start=begun)
    return machine
