"""Assembling, and the same system with other numbers."""

import math

import mbody
from mbody import Damper, Mechanism, Spring, assemble
from mbody.laws import Harmonic, Table
from tests.errors.models import four_bar, tappet

#: Other numbers that a four-bar does not take.
VALUES = {
    "a number that is not text": {3: 1.0},
    "a negative mass": {"crank.mass": -1.0},
    "a mass that is nan": {"crank.mass": [1.0, math.nan]},
    "a mass that is text": {"crank.mass": "1 kg"},
    "masses in rows": {"crank.mass": [[1.0]]},
    "masses of unequal number": {"crank.mass": [1.0, 2.0], "rocker.mass": [1.0]},
}

#: Elements and other numbers that they do not take.
SIGNS = {
    "a negative damping": (
        Damper("dashpot", "ground", "rocker.B", coefficient=1.0),
        {"dashpot.coefficient": [1.0, -2.0]},
    ),
    "a negative free length": (
        Spring("spring", "ground", "rocker.B", stiffness=1.0, free_length=1.0),
        {"spring.free_length": -0.5},
    ),
}


#: Three lobes, and what is wrong with them.
LOBES = Harmonic(mean=10.0, amplitude=10.0, frequency=3.0)
CAMS = {
    "a cam with a corner": (Harmonic(40.0, 5.0, 1.5), {}),
    "a cam through its own centre": (Harmonic(0.0, 5.0, 1.0), {}),
    "a cam that is no function": (lambda x: 1.0 / 0.0, {}),
    "a cam of a short table": (Table([0.0, 3.0], [40.0, 50.0]), {}),
    "a cam that undercuts a flat follower": (LOBES, {"flat": True, "base_radius": 40.0}),
    "a pitch curve that undercuts its roller": (Harmonic(70.0, 10.0, 3.0), {"roller": 50.0}),
}


def with_values(values):
    return lambda: assemble(four_bar()).with_values(values)


def with_parameters(law, **values):
    """A crank whose motor has a law of the parameters a and b, with other values of them."""
    machine = Mechanism("m", parameters={"a": 2.0, "b": "1/a"})
    machine.add(
        mbody.Body("crank", mass="a", inertia="b"), mbody.AngleDriver("motor", "crank", law)
    )
    return assemble(machine).with_values(values)


SCENARIOS = {
    "values that are no dict": with_values(5),
    **{name: with_values(values) for name, values in VALUES.items()},
    **{
        name: lambda element=element, values=values: assemble(four_bar(element)).with_values(values)
        for name, (element, values) in SIGNS.items()
    },
    **{
        name: lambda law=law, how=how: assemble(tappet(law, **how))
        for name, (law, how) in CAMS.items()
    },
    "a parameter that makes a formula infinite": lambda: with_parameters("1/(a - 3)", a=3.0),
    "a design that is not there": lambda: assemble(four_bar()).design(1),
}

SENTENCES = r"""
values that are no dict | ModelError | - | values must be a dict such as {"crank.mass": 2.0}, not 5
a number that is not text | ModelError | 3 | there is no number '3' to change (there are numbers of: 'ground', 'crank', 'coupler', 'rocker', 'O2', 'A', 'B', 'O4' and 1 more)
a negative mass | ModelError | crank.mass | 'crank.mass' is -1 kg, it must not be negative: give 0 or more
a mass that is nan | ModelError | crank.mass | 'crank.mass'[1] is nan, it must be finite
a mass that is text | ModelError | crank.mass | 'crank.mass' must be a number or an array, not '1 kg'
masses in rows | ModelError | crank.mass | 'crank.mass' must be a number or one row of them, not of shape (1, 1)
masses of unequal number | ModelError | rocker.mass | 'rocker.mass' has 1 values, others have 2: give arrays of one length
a negative damping | ModelError | dashpot.coefficient | 'dashpot.coefficient' is -2 N·s/m, it must not be negative: give 0 or more
a negative free length | ModelError | spring.free_length | 'spring.free_length' is -0.5 m, it must not be negative: give 0 or more
a cam with a corner | ModelError | contact | 'contact': the slope of its profile does not close: 7.5 mm/rad at 0 deg, -7.5 mm/rad at 360 deg: give a law that repeats after one turn
a cam through its own centre | ModelError | contact | 'contact': the radius of its profile is -5 mm at 270 deg, it must be positive: give a greater base_radius, or raise the profile
a cam that is no function | ModelError | contact | the function of 'contact' failed: ZeroDivisionError: float division by zero
a cam of a short table | ModelError | contact | 'contact': profile: Table: the table covers 0 to 3, but 3.00197 was requested: add points, or choose outside="hold" or "line"
a cam that undercuts a flat follower | ModelError | contact | 'contact': the cam undercuts its flat follower: the radius of curvature of the cam is -30 mm at 30 deg: raise base_radius by more than 30 mm
a pitch curve that undercuts its roller | ModelError | contact | 'contact': the cam undercuts its roller of 50 mm: the radius of curvature of the pitch curve is 37.65 mm at 30 deg: raise the profile by more than 16.59 mm, or take a smaller roller
a parameter that makes a formula infinite | ModelError | motor.law | 'motor.law': '1/(a - 3)' evaluates to inf, it must be finite
a design that is not there | ModelError | - | there is no design 1: give 0 to 0
"""
