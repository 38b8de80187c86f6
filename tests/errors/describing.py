"""Describing bodies, joints, drivers and loads."""

import math

import mbody
from mbody import makers
from mbody.laws import ConstantSpeed
from mbody.makers import polar
from mbody.model.body import Guess, SecondMoments, SlenderRod
from mbody.model.loads import CustomLoad
from tests.errors.models import crank_alone

NAN, INF = math.nan, math.inf

#: What is no place, where one is wanted.
PLACES = {
    "no place": 3,
    "an empty place": "",
    "a place at nan": mbody.Marker("a", (NAN, 0.0)),
    "a place at an infinite angle": mbody.Marker("a", polar(1.0, INF)),
    "a place of no direction": mbody.Marker("a", "P", NAN),
    "a place whose direction is a mass": mbody.Marker("a", "P", "30 kg"),
}

#: What a coupling does not take for its terms.
TERMS = {
    "a coupling of nothing": [],
    "a coupling of names": ["crank"],
    "a term of nothing": [mbody.CouplingTerm(1.0)],
    "a term of one place": [mbody.CouplingTerm(1.0, distance=["a.P"])],
    "a term within a body": [mbody.CouplingTerm(1.0, angle="a", relative_to="a")],
    "a term whose factor is nan": [mbody.CouplingTerm(NAN, angle="a")],
    "a term whose factor is a mass": [mbody.CouplingTerm("3 kg", angle="a")],
}

#: What cannot be added to a mechanism with the body 'crank'.
ADDED = {
    "a body that is not there": mbody.Revolute("O", "ground.O", "rod"),
    "a point that the ground has not": mbody.Revolute("O", "ground.Q", "crank"),
    "a point that a body has not": mbody.Revolute("O", "ground.O", "crank.B"),
    "a point of a point": mbody.Revolute("O", "ground.O", "crank.A.B"),
    "a force on a body that is not there": mbody.Force("F", "rod.A", 1.0),
    "a torque on a body that is not there": mbody.Torque("T", "rod", value=1.0),
    "a torque by a body that is not there": mbody.Torque("T", "crank", by="rod", value=1.0),
    "a motor on a point": mbody.AngleDriver("motor", "crank.A", 1.0),
    "a coupling of a body that is not there": mbody.AngleCoupling(
        "C", [mbody.CouplingTerm(1.0, angle="rod")]
    ),
    "a rope to a point that is not there": mbody.LengthCoupling(
        "R", [mbody.CouplingTerm(1.0, distance=("ground", "crank.C"))]
    ),
    "a motor relative to nothing": mbody.AngleDriver("motor", "crank", 1.0, relative_to="rod"),
    "a spring at no point": mbody.Spring("S", "ground.O", "crank.C", stiffness=1.0),
    "a name twice": mbody.Body("crank"),
    "a load by the name of a body": mbody.Gravity("crank", y=-9.81),
    "a second ground": mbody.Body("ground"),
    "a name alone": "crank",
    "nothing": None,
    "a class": mbody.Body,
    "a list": [mbody.Body("rod")],
}

SCENARIOS = {
    # -- names
    "no name": lambda: mbody.Body(""),
    "a very long name": lambda: mbody.Body("crank" * 50),
    "a name that cannot be printed": lambda: mbody.Body("cra\x07nk"),
    "a load named inertia": lambda: mbody.Torque("inertia", "a", value=1.0),
    "an argument of a former version": lambda: mbody.Mechanism("m", inputs={}),
    # -- numbers
    "a mass that is nan": lambda: mbody.Body("b", mass=NAN),
    "a negative mass": lambda: mbody.Body("b", mass=-1),
    "a negative weight": lambda: mbody.Body("b", weight=-2.5),
    "a negative inertia": lambda: mbody.Body("b", inertia=-1e-3),
    "mass and weight": lambda: mbody.Body("b", mass=1, weight=1),
    "a negative torsional damping": lambda: mbody.TorsionDamper("it", "a", coefficient=-3),
    "a negative free length": lambda: mbody.Spring(
        "it", "a.P", "b.Q", stiffness=1.0, free_length=-3
    ),
    "two stiffnesses": lambda: mbody.Spring("it", "a.P", "b.Q", stiffness=1.0, law=abs),
    "a rod of negative length": lambda: mbody.Distance("it", "a.P", "b.Q", -2),
    "a rod whose length changes": lambda: mbody.Distance("it", "a.P", "b.Q", abs),
    "a flat face with a roller": lambda: mbody.CamFollower(
        "it", "a.P", "b.Q", 1, roller=0.1, flat=True
    ),
    "a ring as small as its wheel": lambda: mbody.Gear(
        "it", "a.P", "b.Q", radius_i=2, radius_j=2, internal=True
    ),
    "a ring that is text": lambda: mbody.Gear(
        "it", "a.P", "b.Q", radius_i=2, radius_j=1, internal="no"
    ),
    "a wheel without a radius": lambda: mbody.Rolling("it", "a.P", "b.Q"),
    "a wheel inside a line": lambda: mbody.Rolling("it", "a.P", "b.Q", radius=1, internal=True),
    "an offset on a wheel": lambda: mbody.Rolling(
        "it", "a.P", "b.Q", radius=1, on_radius=2, offset=0.2
    ),
    "a cylinder of negative length": lambda: mbody.DistanceDriver("it", "a.P", "b.Q", -1),
    "a law that is a class": lambda: mbody.AngleDriver("it", "a", ConstantSpeed),
    "a law that is nan": lambda: mbody.Torque("it", "a", value=NAN),
    "a law of another dimension": lambda: mbody.Torque("it", "a", value="3 lbf"),
    "follows that is text": lambda: mbody.Force("it", "a.P", 1.0, follows="yes"),
    "components as text": lambda: mbody.Force.components("it", "a", "3", 4.0),
    "components that are nan": lambda: mbody.Force.components("it", "a", 3.0, NAN),
    # -- bodies
    "a mass centre at nan": lambda: mbody.Body("b", cg=(0.0, NAN)),
    "a point at infinity": lambda: mbody.Body("b", points={"A": (INF, 0)}),
    "a point by no distance": lambda: mbody.Body("b", points={"A": polar([1], 0)}),
    "points without names": lambda: mbody.Body("b", points=[(1, 2)]),
    "a point with a dot": lambda: mbody.Body("b", points={"A.B": (1, 2)}),
    "a point called cg": lambda: mbody.Body("b", points={"cg": (1, 2)}),
    "a guess that is a mass": lambda: mbody.Body("b", guess="30 kg"),
    "a guess of two numbers": lambda: mbody.Body("b", guess=(1, 2)),
    "a guess at nan": lambda: mbody.Body("b", guess=Guess(x=NAN)),
    "a spread along nan": lambda: mbody.Body("b", spread=SlenderRod(NAN)),
    "a spread of nan": lambda: mbody.Body("b", spread=SecondMoments(1, NAN)),
    "a spread of no mass": lambda: mbody.Body("b", spread=SecondMoments(1, 1, 2)),
    "a spread that is none": lambda: mbody.Body("b", spread=3),
    "a marker at a point that is not there": lambda: mbody.Body("b").at("Q"),
    "a marker in seconds": lambda: mbody.Body("b").at(1.0, "2 s"),
    "a marker of no direction": lambda: mbody.Body("b").at(0.0, 0.0, angle=NAN),
    # -- places and bodies
    **{name: lambda at=at: mbody.Revolute("it", at, "b.Q") for name, at in PLACES.items()},
    **{
        name: lambda terms=terms: mbody.LengthCoupling("it", terms) for name, terms in TERMS.items()
    },
    "a length among angles": lambda: mbody.AngleCoupling(
        "it", [mbody.CouplingTerm(1.0, distance=("a.P", "b.Q"))]
    ),
    "no body": lambda: mbody.AngleDriver("it", 3, 1.0),
    "a load from a body to itself": lambda: CustomLoad("c", "crank.A", "crank"),
    "a motor within a body": lambda: mbody.AngleDriver("m", "crank", 0.0, relative_to="crank"),
    "a torque within a body": lambda: mbody.Torque("t", "crank", by="crank", value=1.0),
    # -- the mechanism
    **{f"adding {name}": lambda it=it: crank_alone().add(it) for name, it in ADDED.items()},
    "adding to what is assembled": lambda: mbody.assemble(crank_alone()).mechanism.add(
        mbody.Body("late")
    ),
    "a mass whose force has no name": lambda: mbody.Mechanism("m", units="in-lb-s"),
    "a downward g": lambda: mbody.Mechanism("m", g=-9.81),
    "a g that is a length": lambda: mbody.Mechanism("m", g="9.81 m"),
    "a g that is nan": lambda: mbody.Mechanism("m", g=NAN),
    "a ground at nan": lambda: mbody.Mechanism("m", ground={"O": (0, NAN)}),
    "no title": lambda: mbody.Mechanism(None),
    "an element that is a list": lambda: crank_alone()[["rod"]],
    # -- ready-made mechanisms
    "a four-bar of force": lambda: makers.four_bar("1 N", 3, 2, 3.5),
    "a four-bar without a coupler": lambda: makers.four_bar(1, 0, 2, 3.5),
    "a four-bar of two masses": lambda: makers.four_bar(1, 3, 2, 3.5, masses=(1, 2)),
    "a slider-crank without a rod": lambda: makers.slider_crank(1, 0),
    "a slider-crank without a speed": lambda: makers.slider_crank(1, 3, speed=NAN),
    "a bar of negative length": lambda: makers.bar("b", -1.0),
    "a bar with a unit and a mass without": lambda: makers.bar("b", "60 mm", mass=2.0),
}


SENTENCES = r"""
no name | ModelError | - | every Body needs a name, not ''
a very long name | ModelError | crankcrankcrankcrank… | the name 'crankcrankcrankcrank…' has 250 characters: give at most 200
a name that cannot be printed | ModelError | - | the name 'cra\x07nk' has characters that cannot be printed: leave them out
a load named inertia | ModelError | inertia | a load may not be named 'inertia', which is a cause of its own in the breakdown of forces: choose another name
an argument of a former version | ModelError | - | Mechanism(inputs=) is a former name: now it is machine.add(mbody.Input("u", "0 N*m")), an element as others are
a mass that is nan | ModelError | b | 'b': mass is nan, it must be finite
a negative mass | ModelError | b | 'b': mass is -1, it must not be negative: give 0 or more
a negative weight | ModelError | b | 'b': weight is -2.5, it must not be negative: give 0 or more
a negative inertia | ModelError | b | 'b': inertia is -0.001, it must not be negative: give 0 or more
mass and weight | ModelError | b | 'b': give mass or weight, not both
a negative torsional damping | ModelError | it | 'it': coefficient is -3, it must not be negative: give 0 or more
a negative free length | ModelError | it | 'it': free_length is -3, it must not be negative: give 0 or more
two stiffnesses | ModelError | it | 'it' has both stiffness and law: give one of them
a rod of negative length | ModelError | it | 'it': length is -2, it must be positive; a Revolute keeps two places together
a rod whose length changes | ModelError | it | 'it': length must be one positive number; a DistanceDriver takes a law of time
a flat face with a roller | ModelError | it | 'it': a flat face has no roller: leave out roller = 0.1, or flat
a ring as small as its wheel | ModelError | it | 'it': a ring of 2 and a wheel of 2 cannot mesh: the ring must be the greater one
a ring that is text | ModelError | it | 'it': internal must be True or False, not 'no'
a wheel without a radius | ModelError | it | 'it': radius is 0, it must be positive: give more than 0
a wheel inside a line | ModelError | it | 'it': a wheel rolls inside a greater one: give on_radius another value than the radius
an offset on a wheel | ModelError | it | 'it': offset goes with a line, phase with another wheel: leave out offset
a cylinder of negative length | ModelError | it | 'it': law is -1, a distance must be positive; a CoordinateDriver takes a signed displacement
a law that is a class | ModelError | it | 'it': law: a law is made from its numbers: ConstantSpeed(...), not the class ConstantSpeed itself
a law that is nan | ModelError | it | 'it': value is nan, it must be finite
a law of another dimension | ModelError | it | 'it': value: '3 lbf' is a force (N), where a torque (N·m) is wanted
follows that is text | ModelError | it | 'it': follows must be True or False, not 'yes'
components as text | ModelError | it | 'it': x must be a plain number here, not '3'
components that are nan | ModelError | it | 'it': y is nan, it must be finite
a mass centre at nan | ModelError | b | 'b': cg.y is nan, it must be finite
a point at infinity | ModelError | b | 'b': A.x is inf, it must be finite
a point by no distance | ModelError | b | 'b': A.r must be a number (length), not [1]
points without names | ModelError | b | 'b': points must be a dict such as {"A": (x, y)}, not [(1, 2)]
a point with a dot | ModelError | b | 'b': 'A.B' is no name of a point: give text without a dot
a point called cg | ModelError | b | 'b': the name of a point may not be 'cg', which is a number of the body: choose another
a guess that is a mass | ModelError | b | 'b': guess.angle: '30 kg' is a mass (kg), where an angle (rad) is wanted
a guess of two numbers | ModelError | b | 'b': guess must be an angle or (x, y, angle), not (1, 2)
a guess at nan | ModelError | b | 'b': guess.x is nan, it must be finite
a spread along nan | ModelError | b | 'b': spread.angle is nan, it must be finite
a spread of nan | ModelError | b | 'b': spread.yy is nan, it must be finite
a spread of no mass | ModelError | b | 'b': no mass can be spread like SecondMoments(xx=1.0, yy=1.0, xy=2.0): xx and yy are not negative, and xy² is at most xx·yy
a spread that is none | ModelError | b | 'b': spread must be "point", SlenderRod(angle) or SecondMoments(xx, yy, xy), not 3
a marker at a point that is not there | ModelError | b | body 'b' has no point 'Q' (it has: none)
a marker in seconds | ModelError | b | 'b': marker.y: '2 s' is a time (s), where a length (m) is wanted
a marker of no direction | ModelError | b | 'b': marker angle is nan, it must be finite
no place | ModelError | it | 'it': i must be a place such as crank.at('A') or "crank.A", not 3
an empty place | ModelError | it | 'it': i is '', it must name a body, or a body and one of its points: "crank" or "crank.A"
a place at nan | ModelError | it | 'it': i.x is nan, it must be finite
a place at an infinite angle | ModelError | it | 'it': i.angle is inf, it must be finite
a place of no direction | ModelError | it | 'it': i.angle is nan, it must be finite
a place whose direction is a mass | ModelError | it | 'it': i.angle: '30 kg' is a mass (kg), where an angle (rad) is wanted
a coupling of nothing | ModelError | it | 'it': terms must be a list of CouplingTerm, not []
a coupling of names | ModelError | it | 'it': terms[0] must be a CouplingTerm, not 'crank'
a term of nothing | ModelError | it | 'it': terms[0] must be one of angle, distance, coordinate; it is none of them
a term of one place | ModelError | it | 'it': terms[0] needs two places (i, j), not ['a.P']
a term within a body | ModelError | it | 'it': terms[0] measures 'a' from itself: name two bodies
a term whose factor is nan | ModelError | it | 'it': terms[0].factor is nan, it must be finite
a term whose factor is a mass | ModelError | it | 'it': terms[0].factor: '3 kg' is a mass (kg), where a length (m) is wanted
a length among angles | ModelError | it | 'it': terms[0] is a length, but this couples angles: use a LengthCoupling, which takes both
no body | ModelError | it | 'it': body must name a body, not 3
a load from a body to itself | ModelError | c | 'c' would join 'crank' to itself: give places on two bodies
a motor within a body | ModelError | m | 'm' would drive 'crank' relative to itself: name two bodies
a torque within a body | ModelError | t | 't' would turn 'crank' against itself: name two bodies
adding a body that is not there | ModelError | O | 'O' refers to body 'rod', which is not there (there are: 'ground', 'crank'): add bodies first
adding a point that the ground has not | ModelError | O | 'O' refers to point 'Q' of 'ground', which is not there (it has: 'O'): name one of these, or add it to the body
adding a point that a body has not | ModelError | O | 'O' refers to point 'B' of 'crank', which is not there (it has: 'A'): name one of these, or add it to the body
adding a point of a point | ModelError | O | 'O' refers to point 'A.B' of 'crank', which is not there (it has: 'A'): name one of these, or add it to the body
adding a force on a body that is not there | ModelError | F | 'F' refers to body 'rod', which is not there (there are: 'ground', 'crank'): add bodies first
adding a torque on a body that is not there | ModelError | T | 'T' refers to body 'rod', which is not there (there are: 'ground', 'crank'): add bodies first
adding a torque by a body that is not there | ModelError | T | 'T' refers to body 'rod', which is not there (there are: 'ground', 'crank'): add bodies first
adding a motor on a point | ModelError | motor | 'motor' refers to body 'crank.A', which is not there (there are: 'ground', 'crank'): add bodies first
adding a coupling of a body that is not there | ModelError | C | 'C' refers to body 'rod', which is not there (there are: 'ground', 'crank'): add bodies first
adding a rope to a point that is not there | ModelError | R | 'R' refers to point 'C' of 'crank', which is not there (it has: 'A'): name one of these, or add it to the body
adding a motor relative to nothing | ModelError | motor | 'motor' refers to body 'rod', which is not there (there are: 'ground', 'crank'): add bodies first
adding a spring at no point | ModelError | S | 'S' refers to point 'C' of 'crank', which is not there (it has: 'A'): name one of these, or add it to the body
adding a name twice | ModelError | crank | the name 'crank' is taken by a Body: names are unique, choose another
adding a load by the name of a body | ModelError | crank | the name 'crank' is taken by a Body: names are unique, choose another
adding a second ground | ModelError | ground | the name 'ground' is taken by a fixed link: names are unique, choose another
adding a name alone | ModelError | - | a mechanism takes bodies, joints, couplings, drivers, loads, inputs, states, quantities and controllers, not 'crank'
adding nothing | ModelError | - | a mechanism takes bodies, joints, couplings, drivers, loads, inputs, states, quantities and controllers, not None
adding a class | ModelError | - | a mechanism takes bodies, joints, couplings, drivers, loads, inputs, states, quantities and controllers, not <class 'mbody...el.body.Body'>: make one, Body(...)
adding a list | ModelError | - | a mechanism takes bodies, joints, couplings, drivers, loads, inputs, states, quantities and controllers, not [Body(name='ro... section=None)]: give them one by one, add(*elements)
adding to what is assembled | ModelError | - | 'm' has been assembled: add to the mechanism that you described, and assemble it again
a mass whose force has no name | ModelError | - | 'in-lb-s' names a mass, whose unit of force lb·in/s² has no name: choose 'in-lbf-s', write masses with their unit, as "2 lb", and let results show them so by output_units, mass = "lb"
a downward g | ModelError | m | 'm': g is -9.81 m/s², it must be positive: it only turns weights into masses, a Gravity load has the direction
a g that is a length | ModelError | m | 'm': g: '9.81 m' is a length (m), where an acceleration (m/s²) is wanted: did you mean '9.81 m/s^2'?
a g that is nan | ModelError | m | 'm': g is nan, it must be finite
a ground at nan | ModelError | ground | 'ground': O.y is nan, it must be finite
no title | ModelError | - | the title of a mechanism must be text, not None
an element that is a list | ModelError | ['rod'] | 'm' has no element ['rod'] (it has: 'crank')
a four-bar of force | ModelError | four-bar | 'four-bar': crank: '1 N' is a force (N), where a length (m) is wanted
a four-bar without a coupler | ModelError | four-bar | 'four-bar': coupler is 0, it must be positive
a four-bar of two masses | ModelError | four-bar | 'four-bar': masses must be three numbers, not (1, 2)
a slider-crank without a rod | ModelError | slider-crank | 'slider-crank': rod is 0, it must be positive
a slider-crank without a speed | ModelError | slider-crank | 'slider-crank': speed is nan, it must be finite
a bar of negative length | ModelError | b | 'b': length is -1, it must be positive
a bar with a unit and a mass without | ModelError | b | 'b': inertia: '2 * (60 mm)^2 / 12' is an area (m²), where an inertia (N·m·s²) is wanted
"""
