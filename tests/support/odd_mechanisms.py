"""Mechanisms of every kind of element, and odd ones, to be drawn."""

import math
from dataclasses import dataclass

import mbody
from mbody import makers
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
    machine = mbody.Mechanism("planetary gear", units="mm-N-s", ground={"O": (0, 0)})
    machine.add(
        mbody.Body("sun", mass=1e-3, inertia=1.0),
        mbody.Body("arm", mass=1e-3, points={"C": (30, 0)}),
        mbody.Body("planet"),
        mbody.Revolute("O", "ground.O", "sun"),
        mbody.Revolute("P", "ground.O", "arm"),
        mbody.Revolute("C", "arm.C", "planet"),
        mbody.Gear("mesh", "sun", "planet", radius_i=20, radius_j=10),
        mbody.Gear("ring", "ground.O", "planet", radius_i=40, radius_j=10, internal=True),
        mbody.AngleDriver("motor", "sun", ConstantSpeed(0, 10)),
        mbody.Torque("load", "arm", value=-500),
    )
    return machine


def rack():
    machine = mbody.Mechanism("rack", units="mm-N-s", ground={"O": (0, 20)})
    end = mbody.Marker("rack", (40, 0))
    machine.add(
        mbody.Body("pinion", mass=1e-3),
        mbody.Body("rack", mass=1e-3),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Prismatic("guide", "ground", "rack"),
        mbody.RackPinion("mesh", "rack", "pinion", radius=20),
        mbody.AngleDriver("motor", "pinion", ConstantSpeed(0.5, -1)),
        mbody.Spring(
            "k", mbody.Marker("ground", (-90, 0)), mbody.Marker("rack", (-40, 0)), stiffness=1.0
        ),
        mbody.Damper("c", mbody.Marker("ground", (90, 15)), end, coefficient=1.0),
        mbody.Force("F", end, 5, angle=math.pi),
    )
    return machine


def wheel():
    machine = mbody.Mechanism("wheel and bob")
    machine.add(
        mbody.Body("wheel", mass=2),
        mbody.Body("bob", mass=1, cg=(0.5, 0), points={"A": (0, 0)}),
        mbody.Rolling("road", "ground", "wheel", radius=0.3),
        mbody.Revolute("A", "wheel", "bob.A"),
        mbody.Gravity("g", y=-9.81),
        mbody.TorsionSpring("kt", "bob", by="wheel", stiffness=2.0),
        mbody.TorsionDamper("ct", "bob", coefficient=1.0),
        mbody.AngleDriver("m", "wheel", ConstantSpeed(0, -1)),
        mbody.AngleDriver("m2", "bob", -1.0),
    )
    return machine


def yoke():
    machine = mbody.Mechanism("Scotch yoke", units="mm-N-s")
    machine.add(
        mbody.Body("crank", points={"A": (30, 0)}),
        mbody.Body("yoke", mass=1e-3),
        mbody.Revolute("O", "ground", "crank"),
        mbody.PinSlot("A", mbody.Marker("yoke", (0, 0), math.pi / 2), "crank.A"),
        mbody.Prismatic("g", "ground", mbody.Marker("yoke", (60, 0))),
        mbody.CoordinateDriver("ram", "ground", "yoke", ConstantSpeed(20, -3)),
    )
    return machine


def rods():
    machine = mbody.Mechanism("rod, weld and users' own", ground={"O": (0, 0), "W": (4, 0)})
    machine.add(
        mbody.Body("a", mass=1, points={"A": (1, 0)}, guess=1.0),
        mbody.Body("b", mass=1, points={"B": (0, 2)}, guess=(4, 0, 0)),
        mbody.Body("c", mass=1, points={"C": (-1, 1)}, guess=(4, 2, 0.5)),
        mbody.Revolute("O", "ground.O", "a"),
        mbody.Fixed("weld", "ground.W", "b"),
        mbody.Revolute("C", "b.B", "c.C"),
        Held("held", "b", "c"),
        mbody.Distance("rod", "a.A", "b.B", length=3.6),
        Wind("wind", "ground", "a.A"),
    )
    return machine


def one():
    machine = mbody.Mechanism("one body")
    machine.add(mbody.Body("b", mass=1.0))
    return machine


def chain():
    machine, here = mbody.Mechanism("chain"), "ground"
    for n in range(60):
        machine.add(
            makers.bar(f"b{n}", 1.0, guess=-1.2 + n / 25), mbody.Revolute(f"j{n}", here, f"b{n}.A")
        )
        here = f"b{n}.B"
    return machine


def tackle():
    machine = mbody.Mechanism("tackle", ground={"top": (0, 5), "eye": (2, 5), "axis": (3, 5)})
    block = mbody.Marker("ground", (0, 0), UP), mbody.Marker("block", (0, 0), UP)
    parts = [
        mbody.CouplingTerm(2.0, distance=("ground.top", "block")),
        mbody.CouplingTerm(0.5, angle="drum"),
        mbody.CouplingTerm(1.0, coordinate=(mbody.Marker("ground", (2, 0), UP), "block")),
    ]
    machine.add(
        mbody.Body("block", mass=1, guess=(0, 1, 0)),
        mbody.Body("drum", mass=1, inertia=1),
        mbody.Prismatic("guide", *block),
        mbody.Revolute("axis", "ground.axis", "drum"),
        mbody.LengthCoupling("rope", parts, value=9.0),
        mbody.AngleDriver("winch", "drum", ConstantSpeed(0, 1)),
    )
    return machine


def shafts():
    machine = mbody.Mechanism("shafts", ground={"A": (0, 0), "B": (3, 0)})
    machine.add(
        makers.bar("a", 1.0),
        makers.bar("b", 1.0),
        mbody.Revolute("pin", "ground.A", "a.A"),
        mbody.Revolute("pivot", "ground.B", "b.A"),
        mbody.AngleCoupling(
            "chain", [mbody.CouplingTerm(2.0, angle="a"), mbody.CouplingTerm(-1.0, angle="b")]
        ),
        mbody.AngleDriver("motor", "a", ConstantSpeed(0.4, 1)),
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
