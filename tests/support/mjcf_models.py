"""Mechanisms with the elements that the gallery does not have, free and driven, for MJCF."""

import copy
import math

import mbody
from mbody.laws import ConstantSpeed, Harmonic
from mbody.model.loads import CustomLoad


def crank_and_lever(units="SI"):
    """A crank whose pin slides in a slot of a lever."""
    machine = mbody.Mechanism("slotted lever", units=units, ground={"O": (0, 0), "C": (0, -2)})
    crank = {"O": (0, 0), "A": (1, 0)}
    machine.add(
        mbody.Body("crank", mass=1.3, inertia=0.2, cg=(0.4, 0.1), points=crank, guess=0.5),
        mbody.Body("lever", mass=2.1, inertia=0.9, cg=(1.2, -0.1), points={"C": (0, 0)}, guess=1.4),
        mbody.Revolute("O", "ground.O", "crank.O"),
        mbody.Revolute("C", "ground.C", "lever.C"),
        mbody.PinSlot("slot", mbody.Marker("lever", (0, 0.1), 0.05), "crank.A"),
        mbody.Gravity("g", y=-9.81),
    )
    return machine


def rod_in_slot(*, turned):
    """A rod whose end slides in a slot of the ground, or whose slot slides on a pin there."""
    machine = mbody.Mechanism("rod", ground={"O": (0, 0), "P": (2.5, 0.3)})
    ends = {"A": (0, 0), "B": (2.2, 0)}
    slot = ("rod", (0, 0.05), 0.02) if turned else ("ground", (0, -0.2), 0.1)
    crank = {"O": (0, 0), "A": (1, 0)}
    machine.add(
        mbody.Body("crank", mass=1.3, inertia=0.2, cg=(0.4, 0.1), points=crank, guess=0.9),
        mbody.Body("rod", mass=2.1, inertia=0.9, cg=(1, -0.1), points=ends, guess=(0.7, 0.8, -0.3)),
        mbody.Revolute("O", "ground.O", "crank.O"),
        mbody.Revolute("A", "crank.A", "rod.A"),
        mbody.PinSlot("slot", mbody.Marker(*slot), "ground.P" if turned else "rod.B"),
        mbody.Gravity("g", y=-9.81),
    )
    return machine


def loaded():
    """A rod, and loads of every kind that MJCF has; a body named as MuJoCo's ground."""
    machine = mbody.Mechanism(
        "loads & <rods>", units="mm-N-s", ground={"O": (0, 0), "C": (300, 0), "S": (100, 400)}
    )
    a, b = {"O": (0, 0), "A": (100, 0)}, {"A": (0, 0), "B": (250, 0), "P": (90, 50)}
    c = {"C": (0, 0), "B": (150, 0)}
    machine.add(
        mbody.Body("a", mass=1.3e-3, inertia=2, cg=(40, 10), points=a, guess=1.1),
        mbody.Body("b", mass=2.1e-3, inertia=9, cg=(120, -10), points=b, guess=0.2),
        mbody.Body("world", mass=1.1e-3, inertia=4, cg=(70, 0), points=c, guess=1.8),
        mbody.Revolute("O", "ground.O", "a.O"),
        mbody.Revolute("A", "a.A", "b.A"),
        mbody.Distance("rod", "b.B", "world.B", length=40.0),
        mbody.Revolute("C", "ground.C", "world.C"),
        mbody.Spring("s", "ground.S", "b.P", stiffness=0.5, free_length=100, preload=3.0),
        mbody.Damper("d", "a.A", "world.B", coefficient=0.02),
        mbody.TorsionSpring("t1", "world", by="a", stiffness=800.0, free_angle=-0.3, preload=50.0),
        mbody.TorsionSpring("t2", "b", by="a", stiffness=800.0, free_angle=0.4),
        mbody.TorsionDamper("t3", "b", coefficient=30.0),
        mbody.Force("f1", "b.P", 2.0, angle=0.4),
        mbody.Force("f2", "world.B", 1.5, angle=0.4, follows=True),
        mbody.Torque("t4", "b", by="world", value=100.0),
        mbody.Gravity("g", x=1000.0, y=-9810.0),
    )
    return machine


def coupled():
    """Angles that are coupled across bodies."""
    machine = mbody.Mechanism("coupled", ground={"O": (0, 0), "C": (3, 0)})
    turns = [
        mbody.CouplingTerm(2.0, angle="b"),
        mbody.CouplingTerm(-1.5, angle="c", relative_to="a"),
    ]
    machine.add(
        mbody.Body("a", mass=1.3, inertia=2, cg=(0.4, 0.1), points={"A": (1, 0)}, guess=1.1),
        mbody.Body("b", mass=2.3, inertia=1, cg=(0.2, 0.1), guess=0.2),
        mbody.Body("c", mass=1.3, inertia=0.5, cg=(0.4, 0.1), guess=0.3),
        mbody.Revolute("O", "ground.O", "a"),
        mbody.Revolute("A", "a.A", "b"),
        mbody.Revolute("C", "ground.C", "c"),
        mbody.AngleCoupling("cp", terms=turns, value=-0.5),
        mbody.Gravity("g", y=-9.81),
    )
    return machine


def welded(*, closed):
    """Welds, and one more that closes a loop of them."""
    machine = mbody.Mechanism("welded")
    machine.add(
        mbody.Body("a", mass=1.3, inertia=2, cg=(0.4, 0.1), points={"A": (1, 0)}, guess=1.1),
        mbody.Body("b", mass=2.3, inertia=1, cg=(0.2, 0.1), guess=0.2),
        mbody.Body("c", mass=1.3, inertia=0.5, cg=(0.4, 0.1), guess=0.3),
        mbody.Revolute("O", "ground", "a"),
        mbody.Fixed("w1", mbody.Marker("a", "A", 0.3), "b"),
        mbody.Fixed("w2", "b", "c"),
        mbody.Gravity("g", y=-9.81),
    )
    if closed:
        machine.add(mbody.Fixed("w3", mbody.Marker("a", "A", 0.3), "c"))
    return machine


def slides():
    """A slide on a slide."""
    machine = mbody.Mechanism("slides")
    machine.add(
        mbody.Body("x", mass=1.3, inertia=2, cg=(0.4, 0.1), guess=(0.5, 0, 0.2)),
        mbody.Body("y", mass=2.3, inertia=1, points={"P": (0.3, 0.2)}, guess=(0.5, 0.7, 0.2)),
        mbody.Prismatic("px", mbody.Marker("ground", (0, 0), 0.2), "x"),
        mbody.Prismatic("py", mbody.Marker("x", (0.1, 0), 1.2), mbody.Marker("y", (0, 0), 1.2)),
        mbody.Gravity("g", y=-9.81),
        mbody.Spring("s", "ground", "y.P", stiffness=40.0, free_length=0.3),
    )
    return machine


class Drag(CustomLoad):
    """Air on a body."""

    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, -0.5 * j[5], -0.5 * j[6], -0.3 * j[7]


def driven(machine, *drivers):
    made = copy.copy(machine)
    made.add(*drivers)
    return made


FREE = {
    "pin in a slot": crank_and_lever(),
    "in feet": crank_and_lever("ft-lbf-s"),
    "slot of the ground": rod_in_slot(turned=False),
    "pin of the ground": rod_in_slot(turned=True),
    "loads": loaded(),
    "coupling": coupled(),
    "welds": welded(closed=False),
    "a loop of welds": welded(closed=True),
    "slides": slides(),
}
ALONG = mbody.Marker("ground", (0, 0), 0.2)
MIXED = {
    "a driver among loads": driven(loaded(), mbody.AngleDriver("m", "a", Harmonic(1.1, 0.2, 9.0))),
    "loads of time": driven(
        rod_in_slot(turned=True),
        mbody.Force("push", "rod.B", Harmonic(0.0, 5.0, 7.0)),
        mbody.Torque("twist", "crank", value=Harmonic(0.0, 3.0, 5.0)),
    ),
    "a slide driven": driven(
        slides(),
        mbody.CoordinateDriver("m", mbody.Marker("x", (0, 0), 1.2), "y.P", ConstantSpeed(0.8, 0.3)),
    ),
    "a slide driven the other way": driven(
        slides(),
        mbody.CoordinateDriver(
            "m", mbody.Marker("x", (0, 0), 1.2 + math.pi), "y.P", ConstantSpeed(-0.8, 0.3)
        ),
    ),
    "loads that MuJoCo does not have": driven(
        crank_and_lever(),
        Drag("drag", "ground", "lever"),
        mbody.Gravity("shake", x=Harmonic(0.0, 2.0, 5.0)),
        mbody.Spring("stop", "ground.O", "lever.C", law=lambda x: 3.0 * x**3),
        mbody.TorsionSpring("hard", "crank", law=lambda x: 2.0 * x**3),
    ),
    "a distance": driven(
        slides(), mbody.DistanceDriver("m", "ground", "y.P", Harmonic(1.1, 0.2, 3.0))
    ),
}
DRIVEN = {
    "angle": driven(crank_and_lever(), mbody.AngleDriver("m", "crank", ConstantSpeed(0.5, 3.0))),
    "relative angle": driven(
        rod_in_slot(turned=True),
        mbody.AngleDriver("m", "rod", ConstantSpeed(-0.3, 3.0), relative_to="crank"),
    ),
    "coordinates": driven(
        slides(),
        mbody.CoordinateDriver("m1", ALONG, "x", ConstantSpeed(0.5, 0.3)),
        mbody.CoordinateDriver(
            "m2", mbody.Marker("x", (0, 0), 1.2), "y.P", ConstantSpeed(0.8, 0.3)
        ),
    ),
    "distance": driven(
        rod_in_slot(turned=True),
        mbody.DistanceDriver("m", "ground.P", "crank.A", ConstantSpeed(2.2, -0.3)),
    ),
    "coordinate of a point": driven(
        rod_in_slot(turned=False),
        mbody.CoordinateDriver("m", ALONG, "rod.B", ConstantSpeed(2.5, 0.3)),
    ),
    "coordinate of a moving body": driven(
        crank_and_lever(),
        mbody.CoordinateDriver(
            "m", mbody.Marker("lever", (0, 0.1), 0.05), "crank.A", ConstantSpeed(2.8, 0.3)
        ),
    ),
    "loads of time": driven(
        crank_and_lever(),
        mbody.AngleDriver("m", "crank", ConstantSpeed(0.5, 3.0)),
        mbody.Force("push", "lever.C", Harmonic(0.0, 2.0, 3.0)),
        mbody.Torque("twist", "lever", value=Harmonic(1.0, 2.0, 3.0), by="crank"),
    ),
}
