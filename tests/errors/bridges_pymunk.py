"""pymunk as a cross-check: what it cannot be asked."""

import sys
from unittest import mock

import numpy as np

import mbody
from mbody.engines.pymunk import crosscheck_result
from tests.errors.models import four_bar


def asked(run):
    return lambda: crosscheck_result(run().system, run())


def missing():
    run = mbody.kinetostatics(four_bar())
    with mock.patch.dict(sys.modules, {"pymunk": None}):
        crosscheck_result(run.system, run)


def many():
    return mbody.kinetostatics(
        mbody.assemble(four_bar()).with_values({"crank.mass": np.array([1.0, 2.0])})
    )


SCENARIOS = {
    "pymunk is asked of a batch": asked(many),
    "pymunk is asked of a motion without forces": asked(lambda: mbody.kinematics(four_bar())),
    "pymunk is not installed": missing,
}

SENTENCES = r"""
pymunk is asked of a batch | ModelError | - | pymunk takes one design: choose one of the batch with design(n)
pymunk is asked of a motion without forces | ModelError | - | kinematics computes no forces for pymunk to check: use kinetostatics or simulate
pymunk is not installed | SolveError | - | pymunk is not installed: pip install pymunk
"""
