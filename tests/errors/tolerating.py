"""Tolerances: what scatters, of which quantity, within which band."""

import mbody
from mbody.sweeps import Normal, Uniform
from tests.errors.command import said
from tests.errors.models import four_bar


def tolerances(scatter=None, measure="A.force", **options):
    scatter = {"crank.A.x": 0.01} if scatter is None else scatter
    return mbody.tolerances(four_bar(), measure, scatter, **{"t": 0.0, "count": 0, **options})


def batch():
    system = mbody.assemble(four_bar()).with_values({"crank.A.x": [0.9, 1.1]})
    return mbody.tolerances(system, "A.force", {"crank.mass": 0.1})


COMMAND = ["tolerances", "norton_fourbar", "peak(A.force)"]

SCENARIOS = {
    "tolerances of a batch": batch,
    "tolerances of two quantities": lambda: tolerances(measure=["A.force", "B.force"]),
    "tolerances of a history": lambda: tolerances(t=[0.0, 0.01]),
    "tolerances of nothing": lambda: tolerances({}),
    "a tolerance of no number": lambda: tolerances({"crank.A.z": 0.1}),
    "a negative tolerance": lambda: tolerances({"crank.A.x": -0.01}),
    "a tolerance that is a mass": lambda: tolerances({"crank.A.x": Normal("3 kg")}),
    "a tolerance below zero": lambda: tolerances({"crank.mass": (-1.0, 3.0)}),
    "a tolerance upside down": lambda: tolerances({"crank.A.x": (1.1, 0.9)}),
    "half a random design": lambda: tolerances(count=0.5),
    "a band that is no pair": lambda: tolerances(within=3.0),
    "a band in another unit": lambda: tolerances(within=("1 m", "2 m")),
    "a band upside down": lambda: tolerances(within=(2e6, 1e6)),
    "a band beside the quantity": lambda: tolerances(within=(1e6, 2e6)),
    "costs of another number": lambda: tolerances(within=(0.0, 1e6), cost={"crank.mass": 1.0}),
    "a tolerance of zero that is allocated": lambda: tolerances(
        {"crank.A.x": Uniform(0.0)}, within=(0.0, 1e6)
    ),
    "a cost of nothing": lambda: tolerances(within=(0.0, 1e6), cost={"crank.A.x": 0.0}),
    "a band that nothing leaves": lambda: tolerances({"crank.inertia": 0.01}, within=(0.0, 1e6)),
    "tolerances without scatter": said(COMMAND),
    "a band without an end": said([*COMMAND, "--scatter", "crank.A.x=0.1", "--within", "3"]),
    "half a random design in the command": said(
        [*COMMAND, "--scatter", "crank.A.x=0.1", "--count", "0.5"]
    ),
}
