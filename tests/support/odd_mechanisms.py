"""Mechanisms of every kind of element, and odd ones, to be drawn."""

import math
from dataclasses import dataclass

from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CoordinateDriver,
    CouplingTerm,
    Damper,
    Distance,
    Fixed,
    Force,
    Gear,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
    makers,
)
from mbody.laws import ConstantSpeed
from mbody.model.joints import CustomJoint
from mbody.model.loads import CustomLoad

UP = math.pi / 2.0


@dataclass(frozen=True)
class Held(CustomJoint):
    """Keeps an angle between two bodies."""

    rows = "l"

    def physics(self, i, j, p, t):
        zero = (0.0, 0.0)
        blocks = (0.0, 0.0, -1.0, *[0.0] * 5, 1.0, *[0.0] * 3)
        return (j[2] - i[2] - 0.5, 0.0), blocks, zero, zero


class Wind(CustomLoad):
    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, 1.0, 0.0, 0.0


def planetary():
    machine = Mechanism("planetary gear", units="mm-N-s", ground={"O": (0, 0)})
    machine.add(
        Body("sun", mass=1e-3, inertia=1.0),
        Body("arm", mass=1e-3, points={"C": (30, 0)}),
        Body("planet"),
        Revolute("O", "ground.O", "sun"),
        Revolute("P", "ground.O", "arm"),
        Revolute("C", "arm.C", "planet"),
        Gear("mesh", "sun", "planet", radius_i=20, radius_j=10),
        Gear("ring", "ground.O", "planet", radius_i=40, radius_j=10, internal=True),
        AngleDriver("motor", "sun", ConstantSpeed(0, 10)),
        Torque("load", "arm", value=-500),
    )
    return machine


def rack():
    machine = Mechanism("rack", units="mm-N-s", ground={"O": (0, 20)})
    end = Marker("rack", (40, 0))
    machine.add(
        Body("pinion", mass=1e-3),
        Body("rack", mass=1e-3),
        Revolute("O", "ground.O", "pinion"),
        Prismatic("guide", "ground", "rack"),
        RackPinion("mesh", "rack", "pinion", radius=20),
        AngleDriver("motor", "pinion", ConstantSpeed(0.5, -1)),
        Spring("k", Marker("ground", (-90, 0)), Marker("rack", (-40, 0)), stiffness=1.0),
        Damper("c", Marker("ground", (90, 15)), end, coefficient=1.0),
        Force("F", end, 5, angle=math.pi),
    )
    return machine


def wheel():
    machine = Mechanism("wheel and bob")
    machine.add(
        Body("wheel", mass=2),
        Body("bob", mass=1, cg=(0.5, 0), points={"A": (0, 0)}),
        Rolling("road", "ground", "wheel", radius=0.3),
        Revolute("A", "wheel", "bob.A"),
        Gravity("g", y=-9.81),
        TorsionSpring("kt", "bob", by="wheel", stiffness=2.0),
        TorsionDamper("ct", "bob", coefficient=1.0),
        AngleDriver("m", "wheel", ConstantSpeed(0, -1)),
        AngleDriver("m2", "bob", -1.0),
    )
    return machine


def yoke():
    machine = Mechanism("Scotch yoke", units="mm-N-s")
    machine.add(
        Body("crank", points={"A": (30, 0)}),
        Body("yoke", mass=1e-3),
        Revolute("O", "ground", "crank"),
        PinSlot("A", Marker("yoke", (0, 0), math.pi / 2), "crank.A"),
        Prismatic("g", "ground", Marker("yoke", (60, 0))),
        CoordinateDriver("ram", "ground", "yoke", ConstantSpeed(20, -3)),
    )
    return machine


def rods():
    machine = Mechanism("rod, weld and users' own", ground={"O": (0, 0), "W": (4, 0)})
    machine.add(
        Body("a", mass=1, points={"A": (1, 0)}, guess=1.0),
        Body("b", mass=1, points={"B": (0, 2)}, guess=(4, 0, 0)),
        Body("c", mass=1, points={"C": (-1, 1)}, guess=(4, 2, 0.5)),
        Revolute("O", "ground.O", "a"),
        Fixed("weld", "ground.W", "b"),
        Revolute("C", "b.B", "c.C"),
        Held("held", "b", "c"),
        Distance("rod", "a.A", "b.B", length=3.6),
        Wind("wind", "ground", "a.A"),
    )
    return machine


def one():
    machine = Mechanism("one body")
    machine.add(Body("b", mass=1.0))
    return machine


def chain():
    machine, here = Mechanism("chain"), "ground"
    for n in range(60):
        machine.add(
            makers.bar(f"b{n}", 1.0, guess=-1.2 + n / 25), Revolute(f"j{n}", here, f"b{n}.A")
        )
        here = f"b{n}.B"
    return machine


def tackle():
    machine = Mechanism("tackle", ground={"top": (0, 5), "eye": (2, 5), "axis": (3, 5)})
    block = Marker("ground", (0, 0), UP), Marker("block", (0, 0), UP)
    parts = [
        CouplingTerm(2.0, distance=("ground.top", "block")),
        CouplingTerm(0.5, angle="drum"),
        CouplingTerm(1.0, coordinate=(Marker("ground", (2, 0), UP), "block")),
    ]
    machine.add(
        Body("block", mass=1, guess=(0, 1, 0)),
        Body("drum", mass=1, inertia=1),
        Prismatic("guide", *block),
        Revolute("axis", "ground.axis", "drum"),
        LengthCoupling("rope", parts, value=9.0),
        AngleDriver("winch", "drum", ConstantSpeed(0, 1)),
    )
    return machine


def shafts():
    machine = Mechanism("shafts", ground={"A": (0, 0), "B": (3, 0)})
    machine.add(
        makers.bar("a", 1.0),
        makers.bar("b", 1.0),
        Revolute("pin", "ground.A", "a.A"),
        Revolute("pivot", "ground.B", "b.A"),
        AngleCoupling("chain", [CouplingTerm(2.0, angle="a"), CouplingTerm(-1.0, angle="b")]),
        AngleDriver("motor", "a", ConstantSpeed(0.4, 1)),
    )
    return machine


ODD = {
    planetary: {"wheel:mesh.i", "wheel:mesh.j", "wheel:ring.i", "torque:load", "driver:motor"},
    rack: {"rack:mesh", "wheel:mesh.j", "spring:k", "damper:c", "block:guide", "rail:guide"},
    wheel: {"wheel:road.j", "road:road", "spring:kt", "damper:ct", "gravity:g", "driver:m2"},
    yoke: {"block:g", "pin:A", "driver:ram"},
    rods: {"rod:rod", "wall:weld", "joint:held", "load:wind", "at:wind"},
    one: {"link:b", "cg:b"},
    chain: {"pin:j0", "pin:j59"},
    tackle: {"rope:rope.0", "rope:rope.2", "pulley:rope.1", "coupling:rope"},
    shafts: {"belt:chain", "coupling:chain"},
}
