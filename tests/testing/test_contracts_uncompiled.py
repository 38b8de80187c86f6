"""The physics of the built-in kinds by complex steps, in a process without compiler."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

import mbody
from mbody.kernels.constraints import KINDS
from tests.support.paths import ROOT

PLAIN = r"""
import json
import sys
import traceback

import numpy as np

import mbody
from mbody.kernels import constraints
from mbody.model.primitives import CONSTRAINTS
from mbody.testing import check_joint, check_load

assert constraints.rows.__class__.__name__ == "function", "this must run without compiler"
H = 1e-30


def side(q, v):
    return *q, np.cos(q[2]), np.sin(q[2]), *v


def physics(kind, q, v, p, f):
    i, j = side(q[:3], v[:3]), side(q[3:], v[3:])
    one = CONSTRAINTS[kind]
    if one.argument:
        # the direction of turning is 1 or -1; the law, of period π, is asked at the angle of the
        # ray
        n = 5 if kind == "roller" else 6
        p = (*p[:n], np.sign(p[n]), *p[n + 1 :])
        x, y = one.argument(i, j, p)
        angle = 2.0 * np.arctan(y / x) + 0.4
        f = 0.3 * np.sin(angle), 0.6 * np.cos(angle), -1.2 * np.sin(angle)
    return one.function(i, j, p, f)


def matrix(blocks):
    return np.array(blocks).reshape(2, 2, 3).transpose(1, 0, 2).reshape(2, 6)


def worst(found, expected):
    return float(np.abs(found - expected).max() / max(1.0, np.abs(expected).max()))


result = {}
for kind in CONSTRAINTS:
    if kind == "contour":  # its place: tests/contact/test_curves.py
        continue
    rng, errors = np.random.default_rng(3), np.zeros(3)
    for _ in range(50):
        q, v, p = rng.normal(size=6), rng.normal(size=6), tuple(rng.normal(size=7))
        f = rng.normal(size=3)
        _, blocks, nu, gamma = physics(kind, q, v, p, f)
        for m in range(6):
            phi = physics(kind, q + 1j * H * np.eye(6)[m], v, p, f)[0]
            errors[0] = max(errors[0], worst(matrix(blocks)[:, m], np.imag(phi) / H))
        # along the motion q + v s at t + s, where the law has moved on too
        later = f + 1j * H * np.array([f[1], f[2], 0.0])
        phi = physics(kind, q, v, p, later)[0]
        errors[1] = max(errors[1], worst(np.array(nu), -np.imag(phi) / H))
        _, ahead, nu, _ = physics(kind, q + 1j * H * v, v, p, later)
        rate = matrix(ahead) @ v - np.array(nu)
        errors[2] = max(errors[2], worst(np.array(gamma), -np.imag(rate) / H))
    result[kind] = errors.tolist()

machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
try:
    rough = {"coupler": 1.3, "rocker": 2.8}
    run = mbody.kinetostatics(machine, t=[0.0, 0.02, 0.04], guess=rough)
    b = run.reaction("B")
    found = run["rocker"].angle, run["rocker"].alpha, run.effort("motor"), b.fx, b.fy
    result["run"], result["failure"] = [history.tolist() for history in found], ""
except Exception:
    result["failure"] = traceback.format_exc()
result["contracts"] = [
    check_joint(mbody.Revolute("A", "a.P", "b.Q"), states=2).worst,
    check_load(mbody.Spring("s", "a.P", "b.Q", stiffness=2.0), states=2).worst,
]
json.dump(result, sys.stdout)
"""


#: Differenced in tests of their own.
ELSEWHERE = ("user", "sum", "formula", "contour")


@pytest.fixture(scope="module")
def plain():
    environment = {**os.environ, "MBODY_CORE": "plain", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", PLAIN], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ELSEWHERE])
def test_physics_by_complex_step(plain, kind):
    # exact derivatives: what differs is rounding of a few operations, on numbers of size one but
    # for what is divided by a small distance (the worst of 600 states has 5e-14)
    blocks, nu, gamma = plain[kind]
    # of these the rate is that of sliding wherever it is, no derivative of Φ; γ is checked with it
    assert blocks < 1e-13 or kind in ("face_slip", "roller_slip", "slipping", "belt")
    assert nu < 1e-13
    # the slope of a cam's profile goes with the angle here, not with time as in this test
    assert gamma < 1e-13 or kind == "roller_slip"


def test_kernels_without_compiler(plain):
    assert not plain["failure"], plain["failure"]
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
    rough = {"coupler": 1.3, "rocker": 2.8}
    run = mbody.kinetostatics(machine, t=[0.0, 0.02, 0.04], guess=rough)
    b = run.reaction("B")
    found = run["rocker"].angle, run["rocker"].alpha, run.effort("motor"), b.fx, b.fy
    for mine, other in zip(found, plain["run"], strict=True):
        assert np.abs(mine - other).max() < 1e-12 * max(1.0, np.abs(mine).max())


def test_contracts_hold_without_compiler(plain):
    assert max(plain["contracts"]) < 1e-8
