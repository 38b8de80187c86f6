"""MJCF and MuJoCo: files that are written, cross-checks that are asked for."""

import sys
from unittest import mock

from mbody import assemble, kinematics, kinetostatics
from mbody.engines.mjcf import to_mjcf
from mbody.engines.mujoco import crosscheck_result
from tests.errors.command import said
from tests.errors.models import four_bar


def without_mujoco():
    with mock.patch.dict(sys.modules, {"mujoco": None}):
        crosscheck_result(assemble(four_bar()), kinetostatics(four_bar()))


def batch():
    return assemble(four_bar()).with_values({"crank.mass": [1.0, 2.0]})


SCENARIOS = {
    "a file of a batch": lambda: to_mjcf(batch()),
    "MuJoCo without its package": without_mujoco,
    "MuJoCo on a batch": lambda: crosscheck_result(batch(), kinetostatics(batch())),
    "MuJoCo on kinematics": lambda: crosscheck_result(assemble(four_bar()), kinematics(four_bar())),
    "a file in a folder that is not there": said(
        ["export", "hoekens", "--to", "mjcf", "-o", "/no/where.xml"]
    ),
}

SENTENCES = r"""
a file of a batch | ModelError | - | a file has one design, this is a batch of 2 designs: export one of them, system.design(n)
MuJoCo without its package | SolveError | - | a cross-check by MuJoCo needs the package mujoco, which is not installed: pip install mujoco
MuJoCo on a batch | ModelError | - | MuJoCo takes one design: choose one of the batch with design(n)
MuJoCo on kinematics | ModelError | - | kinematics computes no forces to check: use kinetostatics, statics or simulate
a file in a folder that is not there | ModelError | - | cannot write '/no/where.xml' (No such file or directory): choose a folder that exists and may be written to
"""
