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
}

SENTENCES = r"""
tolerances of a batch | ModelError | - | tolerances takes one design: choose one of the batch with design(n)
tolerances of two quantities | ModelError | - | tolerances: measure must be one quantity, not ['A.force', 'B.force']
tolerances of a history | ModelError | A.force | tolerances: 'A.force' is a history of 2 instants: say how it becomes one number, such as peak(A.force)
tolerances of nothing | ModelError | - | tolerances: scatter must be a dict such as {"crank.A.x": "0.1 mm"}, not {}
a negative tolerance | ModelError | crank.A.x | tolerances: the width of 'crank.A.x' is -0.01: give 0 or more
a tolerance that is a mass | ModelError | crank.A.x | tolerances: 'crank.A.x': '3 kg' is a mass (kg), where a length (m) is wanted
a tolerance below zero | ModelError | crank.mass | tolerances: 'crank.mass' is 1 ± 2 kg, and it must not be negative: give it a tolerance below its mean
a tolerance upside down | ModelError | crank.A.x | tolerances: 'crank.A.x' goes from 1.1 to 0.9 m: give low, then high
half a random design | ModelError | - | tolerances: count must be a whole number of random designs from 2 on, or 0, not 0.5
a band that is no pair | ModelError | - | tolerances: within is a pair (low, high), not 3.0
a band in another unit | ModelError | - | tolerances: within: '1 m' is a length (m), the quantity is in N
a band upside down | ModelError | - | tolerances: the band goes from 2e+06 to 1e+06 N: give its lowest value, then its greatest
a band beside the quantity | ModelError | A.force | tolerances: 'A.force' is 3.15103 N at the means, which is not between 1e+06 and 2e+06: move the design or the band
costs of another number | ModelError | crank.mass | tolerances: cost of 'crank.mass', which does not scatter (these do: 'crank.A.x')
a tolerance of zero that is allocated | ModelError | crank.A.x | tolerances: 'crank.A.x' has the tolerance 0, which says nothing of what another costs: give its cost, or leave it out of scatter
a cost of nothing | ModelError | crank.A.x | tolerances: the cost of 'crank.A.x' is 0.0: give a positive number
a band that nothing leaves | ModelError | - | tolerances: none of 'crank.inertia' changes the quantity: any tolerance will do
tolerances without scatter | UsageError | - | choose what scatters: --scatter NAME=WIDTH
a band without an end | UsageError | - | --within: bounds are LOW:HIGH, not '3'
"""
