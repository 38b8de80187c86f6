"""Describing bodies, joints, drivers and loads."""

import math

from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CamFollower,
    CouplingTerm,
    Damper,
    Distance,
    DistanceDriver,
    Force,
    Gear,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    Revolute,
    Rolling,
    Spring,
    Torque,
    TorsionDamper,
    assemble,
    makers,
)
from mbody.laws import ConstantSpeed
from mbody.makers import polar
from mbody.model.body import Guess, SecondMoments, SlenderRod
from mbody.model.loads import CustomLoad, TorsionSpring
from tests.errors.models import crank_alone

NAN, INF = math.nan, math.inf

#: What is no place, where one is wanted.
PLACES = {
    "no place": 3,
    "an empty place": "",
    "a place without its point": "a.",
    "a place at nan": Marker("a", (NAN, 0.0)),
    "a place at an infinite angle": Marker("a", polar(1.0, INF)),
    "a place at a list": Marker("a", ([1], 0.0)),
    "a place at one number": Marker("a", 5),
    "a place of no direction": Marker("a", "P", NAN),
    "a place whose direction is a mass": Marker("a", "P", "30 kg"),
}

#: What a coupling does not take for its terms.
TERMS = {
    "a coupling of nothing": [],
    "a coupling of a name": "crank",
    "a coupling of names": ["crank"],
    "a term of nothing": [CouplingTerm(1.0)],
    "a term of two coordinates": [CouplingTerm(1.0, angle="a", distance=("a.P", "b.Q"))],
    "a term of one place": [CouplingTerm(1.0, distance=["a.P"])],
    "a term of no place": [CouplingTerm(1.0, coordinate=3)],
    "a term within a body": [CouplingTerm(1.0, angle="a", relative_to="a")],
    "a term whose factor is nan": [CouplingTerm(NAN, angle="a")],
    "a term whose factor is a mass": [CouplingTerm("3 kg", angle="a")],
    "a term of a number": [CouplingTerm(1.0, angle=3)],
}

#: What cannot be added to a mechanism with the body 'crank'.
ADDED = {
    "a body that is not there": Revolute("O", "ground.O", "rod"),
    "a point that the ground has not": Revolute("O", "ground.Q", "crank"),
    "a point that a body has not": Revolute("O", "ground.O", "crank.B"),
    "a point of a point": Revolute("O", "ground.O", "crank.A.B"),
    "a force on a body that is not there": Force("F", "rod.A", 1.0),
    "a torque on a body that is not there": Torque("T", "rod", value=1.0),
    "a torque by a body that is not there": Torque("T", "crank", by="rod", value=1.0),
    "a motor on a point": AngleDriver("motor", "crank.A", 1.0),
    "a coupling of a body that is not there": AngleCoupling("C", [CouplingTerm(1.0, angle="rod")]),
    "a rope to a point that is not there": LengthCoupling(
        "R", [CouplingTerm(1.0, distance=("ground", "crank.C"))]
    ),
    "a motor relative to nothing": AngleDriver("motor", "crank", 1.0, relative_to="rod"),
    "a spring at no point": Spring("S", "ground.O", "crank.C", stiffness=1.0),
    "a name twice": Body("crank"),
    "a load by the name of a body": Gravity("crank", y=-9.81),
    "a second ground": Body("ground"),
    "a name alone": "crank",
    "nothing": None,
    "a class": Body,
    "a list": [Body("rod")],
}

SCENARIOS = {
    # -- names
    "no name": lambda: Body(""),
    "a name with a dot": lambda: Body("crank.A"),
    "a very long name": lambda: Body("crank" * 50),
    "a name that cannot be printed": lambda: Body("cra\x07nk"),
    "a load named inertia": lambda: Torque("inertia", "a", value=1.0),
    # -- numbers
    "a mass that is nan": lambda: Body("b", mass=NAN),
    "a mass that is a list": lambda: Body("b", mass=[1.0]),
    "a mass that is a force": lambda: Body("b", mass="3 lbf"),
    "a mass of time": lambda: Body("b", mass="3*t"),
    "a negative mass": lambda: Body("b", mass=-1),
    "a negative weight": lambda: Body("b", weight=-2.5),
    "a negative inertia": lambda: Body("b", inertia=-1e-3),
    "mass and weight": lambda: Body("b", mass=1, weight=1),
    "a negative damping": lambda: Damper("it", "a.P", "b.Q", coefficient=-3),
    "a negative torsional damping": lambda: TorsionDamper("it", "a", coefficient=-3),
    "a negative free length": lambda: Spring("it", "a.P", "b.Q", stiffness=1.0, free_length=-3),
    "no stiffness": lambda: Spring("it", "a.P", "b.Q"),
    "two stiffnesses": lambda: Spring("it", "a.P", "b.Q", stiffness=1.0, law=abs),
    "two dampings": lambda: TorsionDamper("it", "a", coefficient=1.0, law=abs),
    "a rod without length": lambda: Distance("it", "a.P", "b.Q", 0),
    "a rod of negative length": lambda: Distance("it", "a.P", "b.Q", -2),
    "a rod whose length changes": lambda: Distance("it", "a.P", "b.Q", abs),
    "a flat face with a roller": lambda: CamFollower("it", "a.P", "b.Q", 1, roller=0.1, flat=True),
    "a flat face that is text": lambda: CamFollower("it", "a.P", "b.Q", 1, flat="yes"),
    "a ring as small as its wheel": lambda: Gear(
        "it", "a.P", "b.Q", radius_i=2, radius_j=2, internal=True
    ),
    "a ring that is text": lambda: Gear("it", "a.P", "b.Q", radius_i=2, radius_j=1, internal="no"),
    "a wheel without a radius": lambda: Rolling("it", "a.P", "b.Q"),
    "a wheel inside a line": lambda: Rolling("it", "a.P", "b.Q", radius=1, internal=True),
    "a phase on a line": lambda: Rolling("it", "a.P", "b.Q", radius=1, phase=0.2),
    "an offset on a wheel": lambda: Rolling("it", "a.P", "b.Q", radius=1, on_radius=2, offset=0.2),
    "a cylinder of negative length": lambda: DistanceDriver("it", "a.P", "b.Q", -1),
    "a law that is a class": lambda: AngleDriver("it", "a", ConstantSpeed),
    "a law that is a list": lambda: AngleDriver("it", "a", [0.0, 1.0]),
    "a law that is nan": lambda: Torque("it", "a", value=NAN),
    "a law of another dimension": lambda: Torque("it", "a", value="3 lbf"),
    "follows that is text": lambda: Force("it", "a.P", 1.0, follows="yes"),
    "components as text": lambda: Force.components("it", "a", "3", 4.0),
    "components that are nan": lambda: Force.components("it", "a", 3.0, NAN),
    # -- bodies
    "a mass centre of three numbers": lambda: Body("b", cg=(1.0, 2.0, 3.0)),
    "a mass centre at nan": lambda: Body("b", cg=(0.0, NAN)),
    "a point that is text": lambda: Body("b", points={"A": "x"}),
    "a point at infinity": lambda: Body("b", points={"A": (INF, 0)}),
    "a point by no distance": lambda: Body("b", points={"A": polar([1], 0)}),
    "points without names": lambda: Body("b", points=[(1, 2)]),
    "a point with a dot": lambda: Body("b", points={"A.B": (1, 2)}),
    "a point with a number for a name": lambda: Body("b", points={3: (1, 2)}),
    "a point called cg": lambda: Body("b", points={"cg": (1, 2)}),
    "a guess that is a mass": lambda: Body("b", guess="30 kg"),
    "a guess of two numbers": lambda: Body("b", guess=(1, 2)),
    "a guess at nan": lambda: Body("b", guess=Guess(x=NAN)),
    "a spread along nan": lambda: Body("b", spread=SlenderRod(NAN)),
    "a spread of nan": lambda: Body("b", spread=SecondMoments(1, NAN)),
    "a spread of no mass": lambda: Body("b", spread=SecondMoments(1, 1, 2)),
    "a spread that is none": lambda: Body("b", spread=3),
    "a marker at a point that is not there": lambda: Body("b").at("Q"),
    "a marker in seconds": lambda: Body("b").at(1.0, "2 s"),
    "a marker of no direction": lambda: Body("b").at(0.0, 0.0, angle=NAN),
    # -- places and bodies
    **{name: lambda at=at: Revolute("it", at, "b.Q") for name, at in PLACES.items()},
    **{name: lambda terms=terms: LengthCoupling("it", terms) for name, terms in TERMS.items()},
    "a length among angles": lambda: AngleCoupling(
        "it", [CouplingTerm(1.0, distance=("a.P", "b.Q"))]
    ),
    "no body": lambda: AngleDriver("it", 3, 1.0),
    "a pin of a body with itself": lambda: Revolute("A", "crank.A", "crank.B"),
    "a spring from a body to itself": lambda: Spring("s", "crank.A", "crank", stiffness=1.0),
    "a load from a body to itself": lambda: CustomLoad("c", "crank.A", "crank"),
    "a cylinder within a body": lambda: DistanceDriver("m", "crank.A", "crank", 1.0),
    "a motor within a body": lambda: AngleDriver("m", "crank", 0.0, relative_to="crank"),
    "a motor of the ground": lambda: AngleDriver("m", "ground", 0.0),
    "a torque within a body": lambda: Torque("t", "crank", by="crank", value=1.0),
    "a torsion spring within a body": lambda: TorsionSpring(
        "s", "crank", by="crank", stiffness=1.0
    ),
    # -- the mechanism
    **{f"adding {name}": lambda it=it: crank_alone().add(it) for name, it in ADDED.items()},
    "a body among very many": lambda: many_bodies().add(Force("F", "x", 1.0)),
    "adding to what is assembled": lambda: assemble(crank_alone()).mechanism.add(Body("late")),
    "another unit system": lambda: Mechanism("m", units="inch"),
    "no unit system": lambda: Mechanism("m", units=["SI"]),
    "a downward g": lambda: Mechanism("m", g=-9.81),
    "a g that is a length": lambda: Mechanism("m", g="9.81 m"),
    "a g that is nan": lambda: Mechanism("m", g=NAN),
    "a ground without names": lambda: Mechanism("m", ground=[(0, 0)]),
    "a ground at nan": lambda: Mechanism("m", ground={"O": (0, NAN)}),
    "no title": lambda: Mechanism(None),
    "an element that is not there": lambda: crank_alone()["rod"],
    "an element that is a list": lambda: crank_alone()[["rod"]],
    # -- ready-made mechanisms
    "a four-bar of force": lambda: makers.four_bar("1 N", 3, 2, 3.5),
    "a four-bar with a parameter": lambda: makers.four_bar(1, "3*a", 2, 3.5),
    "a four-bar without a coupler": lambda: makers.four_bar(1, 0, 2, 3.5),
    "a four-bar of two masses": lambda: makers.four_bar(1, 3, 2, 3.5, masses=(1, 2)),
    "a slider-crank without a rod": lambda: makers.slider_crank(1, 0),
    "a slider-crank without a speed": lambda: makers.slider_crank(1, 3, speed=NAN),
    "a bar of negative length": lambda: makers.bar("b", -1.0),
    "a bar with a unit and a mass without": lambda: makers.bar("b", "60 mm", mass=2.0),
}


def many_bodies():
    machine = Mechanism("m")
    machine.add(*(Body(f"b{n}") for n in range(100)))
    return machine
