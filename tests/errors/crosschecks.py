"""Cross-checks: engines that there are not, results that cannot be judged."""

import sys
from unittest import mock

from mbody import Body, Revolute, assemble, crosscheck, kinetostatics
from tests.errors.command import said
from tests.errors.models import four_bar
from tests.errors.results import batch, motion


def without_pinocchio():
    with mock.patch.dict(sys.modules, pinocchio=None):
        crosscheck(four_bar(), "pinocchio")


def two_designs():
    return assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]})


def other():
    """A result of a four-bar with a wheel beside it."""
    machine = four_bar(Body("wheel", mass=1.0, inertia=1.0))
    machine.add(Revolute("W", "ground", "wheel"))
    return machine


SCENARIOS = {
    "an engine that nobody knows": lambda: crosscheck(four_bar(), ["XYZ"]),
    "engines that are no names": lambda: crosscheck(four_bar(), 5),
    "an engine that is not installed": without_pinocchio,
    "a cross-check on a batch": lambda: crosscheck(two_designs()),
    "a result of a batch": lambda: crosscheck(four_bar(), ours=batch()),
    "a result without forces": lambda: crosscheck(four_bar(), ours=motion()),
    "a result of another mechanism": lambda: crosscheck(other(), ours=kinetostatics(four_bar())),
    "--against without a name": said(["crosscheck", "norton_fourbar", "--against", ","]),
}

SENTENCES = r"""
an engine that nobody knows | ModelError | - | there is no engine 'XYZ': there are: 'balance', 'oracle', 'pinocchio', 'pymunk', 'mujoco'
engines that are no names | ModelError | - | against takes names of engines ('balance', 'oracle', 'pinocchio', 'pymunk', 'mujoco'), not 5
an engine that is not installed | SolveError | - | Pinocchio is not installed: pip install pin (on Windows it is not packaged: use WSL, or leave it out of against)
a cross-check on a batch | ModelError | - | crosscheck takes one design: choose one of the batch with design(n)
a result of a batch | ModelError | - | crosscheck checks one design, this is a batch of 2 designs: take one of them, run.design(n)
a result without forces | ModelError | - | kinematics computes no forces to check: give a result of kinetostatics, statics or simulate
a result of another mechanism | ModelError | - | the result is of another mechanism, its bodies are 'crank', 'coupler', 'rocker', not 'crank', 'coupler', 'rocker', 'wheel': analyse the same one
--against without a name | UsageError | - | --against takes names with commas between them
"""
