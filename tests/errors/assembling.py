"""Assembling, and the same system with other numbers."""

import math

import numpy as np

import mbody
from mbody import Damper, Distance, Mechanism, Spring, assemble
from mbody.laws import Harmonic, Table
from tests.errors.models import four_bar, tappet

#: Other numbers that a four-bar does not take.
VALUES = {
    "a body that is not there": {"cranck.mass": 1.0},
    "a number that is not there": {"crank.mas": 1.0},
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
    "no length": (Distance("rod", "ground", "rocker.B", length=1.0), {"rod.length": 0.0}),
}


#: Three lobes, and what is wrong with them.
LOBES = Harmonic(mean=10.0, amplitude=10.0, frequency=3.0)
CAMS = {
    "a cam whose profile does not close": ("40 mm + 5 mm/rad*x", {}),
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
    "no bodies": lambda: assemble(Mechanism("m")),
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
    "a roller that grows": lambda: assemble(
        tappet(LOBES, base_radius=50.0, roller=10.0)
    ).with_values({"contact.roller": 500.0}),
    "arrays of other lengths": lambda: (
        assemble(four_bar())
        .with_values({"crank.mass": np.ones(3)})
        .with_values({"rocker.mass": np.ones(4)})
    ),
    "a parameter in a table": lambda: with_parameters(Table([0, 1], ["a", "b"]), a=3.0),
    "a parameter that makes an infinite number": lambda: with_parameters("a", a=0.0),
    "a parameter that makes a formula infinite": lambda: with_parameters("1/(a - 3)", a=3.0),
    "a design that is not there": lambda: assemble(four_bar()).design(1),
    "a design by name": lambda: assemble(four_bar()).design("x"),
}
