"""The engine against the slow oracle, on random linkages with loads of every kind."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import Gravity, Torque, assemble, kinematics, kinetostatics, makers, statics
from mbody.analysis.driven.path_following import Runner
from mbody.analysis.driven.time_grid import time_grid
from mbody.analysis.position.assembly_analysis import closed
from mbody.core.lanes import LANES
from mbody.engineering import close_loops
from mbody.engines.oracle import Reference
from mbody.solution.histories import Record
from tests.support.oracle_runs import (
    FINE,
    FORCE,
    MOTION,
    POSITION,
    STRIDE,
    accelerations,
    assert_checked,
    assert_forces,
    assert_motion,
    every,
    forces_of,
    greatest,
    instants,
    motion_of,
    reaction,
    some,
    truth,
    turning,
    without,
)


@every
def test_kinematics(linkage):
    mechanism, wanted = instants(linkage)[0], truth(linkage)
    links = len(mechanism.bodies) + 1
    assert links == {3: 8, 4: 10}[linkage[1]] + (2 if "extras" in linkage[2] else 0)
    assert_motion(kinematics(mechanism, wanted.t), *wanted[2:5])


@every
def test_kinetostatics(linkage):
    mechanism, wanted = instants(linkage)[0], truth(linkage)
    assert max(f["residual"] / greatest(f) for f in wanted.forces) < FORCE  # the oracle's own
    run = kinetostatics(mechanism, wanted.t)
    assert_motion(run, *wanted[2:5])
    assert_forces(run, wanted.forces)
    assert_checked(run)
    assert all(run.reaction(joint.name).unique == (True,) * 3 for joint in mechanism.joints)
    by_oracle = -wanted.a @ wanted.oracle.mass_matrix()
    mine = np.column_stack([part for name in run for part in run.inertia(name)])
    assert_allclose(mine, by_oracle, rtol=0, atol=MOTION * np.abs(by_oracle).max())


@every
def test_statics(linkage):
    wanted = truth(linkage)
    still = np.zeros_like(wanted.q)
    run = statics(instants(linkage)[0], wanted.t)
    assert_motion(run, wanted.q, still, still)
    assert_forces(run, forces_of(wanted.oracle, wanted.q, still, still, wanted.t))
    assert_checked(run)


@some
@pytest.mark.parametrize("still", [False, True], ids=["moving", "still"])
def test_breakdown_by_cause(linkage, still):
    mechanism, wanted = instants(linkage)[0], truth(linkage)
    oracle, t, q, v, a, _ = wanted
    if still:
        v = a = np.zeros_like(q)
    run = (statics if still else kinetostatics)(mechanism, t)
    causes = ["inertia", *(load.name for load in mechanism.loads)]
    # by the oracle: the multipliers of each cause alone, (causes, instants, rows)
    lam = np.zeros((len(causes), len(t), oracle.m))
    for k, instant in enumerate(zip(q, v, t)):
        right = [-oracle.mass_matrix() @ a[k]]
        right += [oracle.applied(*instant, only=name) for name in causes[1:]]
        lam[:, k] = np.linalg.solve(oracle.phi_q(q[k], t[k]).T, np.transpose(right)).T
    parts = [oracle.reaction_matrices(*instant) for instant in zip(q, t)]
    top = np.abs(lam).max()
    for joint in mechanism.joints:
        found = run.breakdown(joint.name)
        assert list(found) == causes
        whole = reaction(run.reaction(joint.name))
        mine = np.array([reaction(part) for part in found.values()])
        alone = np.einsum("trm,ctm->ctr", [p[joint.name] for p in parts], lam)
        assert_allclose(mine, alone, rtol=0, atol=FORCE * top)
        assert_allclose(mine.sum(axis=0), whole, rtol=0, atol=FORCE * top)
    found = np.array(list(run.breakdown("motor").values()))
    assert_allclose(found, -lam[:, :, oracle.rows["motor"].start], rtol=0, atol=FORCE * top)
    assert_allclose(found.sum(axis=0), run.effort("motor"), rtol=0, atol=FORCE * top)
    joint = mechanism.joints[0]
    on_i = run.breakdown(joint.name, on=joint.i.body)["inertia"]
    assert_allclose(reaction(on_i), -reaction(run.breakdown(joint.name)["inertia"]))


# -- lanes ------------------------------------------------------------------------------------


def by_scalar(system, analysis, times):
    """The same instants, one after the other."""
    runner, asked = Runner(system, analysis), time_grid(system, times, None, None, None)
    start = closed(system, float(asked.t[0]), {})
    record = Record([runner.scalar(start, asked)], len(times), batch=False)
    return runner.solution(start, asked, record)


@every
def test_lanes_are_the_scalar_path(linkage):
    mechanism, fine = instants(linkage)
    wanted, system = truth(linkage), assemble(mechanism)
    run = kinetostatics(system, fine)
    assert run.record.blocks[0].shape[2] == LANES
    one = by_scalar(system, "kinetostatics", fine)
    assert one.record.blocks[0].shape[2] == 1
    assert_motion(run, *motion_of(one))
    for joint in mechanism.joints:
        whole = reaction(one.reaction(joint.name))
        top = max(greatest(f) for f in wanted.forces)
        assert_allclose(reaction(run.reaction(joint.name)), whole, rtol=0, atol=FORCE * top)
    assert_motion(run, *wanted[2:5], at=slice(None, None, STRIDE))
    assert_forces(run, wanted.forces, slice(None, None, STRIDE))
    assert_checked(run)


# -- branches, however coarse the output -----------------------------------------------------


@turning
def test_a_turn_of_five_instants_is_that_of_3601(linkage):
    mechanism = instants(linkage)[0]
    few = kinematics(mechanism, turn=True, instants=5)
    many = kinematics(mechanism, turn="motor", instants=3601)
    assert many.record.blocks[0].shape[2] == LANES
    assert_allclose(few.t, many.t[::900])
    assert_motion(few, *motion_of(many, slice(None, None, 900)))
    # the crank comes round, everything else comes back
    first, last = motion_of(few)[0][[0, -1]]
    back = last - first
    turned = np.round(back[2::3] / (2.0 * math.pi))
    back[2::3] -= 2.0 * math.pi * turned
    assert turned[0] == 1.0 and np.abs(back).max() < 1e-12


# -- closing and free motion ------------------------------------------------------------------


@some
def test_close_loops_from_a_rough_guess(linkage):
    wanted = truth(linkage)
    run = close_loops(instants(linkage)[0])
    q, v, _ = motion_of(run)
    assert_allclose(q[0], wanted.q[0], rtol=0, atol=POSITION * np.abs(wanted.q).max())
    assert_allclose(v[0], wanted.v[0], rtol=0, atol=MOTION * np.abs(wanted.v).max())


@every
@pytest.mark.parametrize("light", [False, True], ids=["as drawn", "two without mass"])
def test_free_motion(linkage, light):
    """Forward dynamics without the motor."""
    wanted = truth(linkage)
    machine = without(instants(linkage)[0], "motor")
    if light:
        machine = massless(machine, "L2", "L4")
    corrected = any(body.massless for body in machine.bodies)
    assert corrected or not light
    oracle, system = Reference(machine), assemble(machine)
    for q, v, t in zip(wanted.q, wanted.v, wanted.t):
        a, lam = oracle.dynamics(q, v, t)
        g = oracle.phi_q_all(q, t)
        pushes = {
            joint.name: -g[rows, 3 * k : 3 * k + 3].T @ lam[rows]
            for joint in machine.joints
            for rows, k in [(oracle.rows[joint.name], oracle.index[joint.j.body])]
        }
        top = max(np.abs(push).max() for push in pushes.values())
        # a body without mass gets an artificial mass of 1e-7 of the greatest, which corrections
        # take back
        for passes in (2, 4) if corrected else (0, 2):
            mine, forces = accelerations(system, q, v, t, passes)
            assert_allclose(mine, a, rtol=0, atol=FORCE * np.abs(a).max())
            for name, push in pushes.items():
                assert_allclose(forces[name], push, rtol=0, atol=FORCE * top)


def massless(mechanism, *names):
    """A copy in which these bodies have no mass."""
    copy = without(mechanism, *(element.name for element in mechanism))
    for e in mechanism:
        light = e.name in names
        copy.add(dataclasses.replace(e, mass=None, weight=None, inertia=0.0) if light else e)
    return copy


@some
def test_a_given_motion_put_back_as_torque(linkage):
    """Kinetostatics, then the motor's effort as a torque on the free linkage: the same motion."""
    wanted = truth(linkage)
    mechanism = instants(linkage)[0]
    run = kinetostatics(mechanism, wanted.t)
    for k in (0, 3, 6):
        machine = without(mechanism, "motor")
        machine.add(Torque("motor", "L1", value=float(run.effort("motor")[k])))
        system = assemble(machine)
        a, _ = accelerations(system, wanted.q[k], wanted.v[k], float(wanted.t[k]), 4)
        assert_allclose(a, wanted.a[k], rtol=0, atol=1e-9 * np.abs(wanted.a).max())


@pytest.mark.parametrize("start", [0.0, 0.5 * math.pi, math.pi])
@pytest.mark.parametrize("make", [makers.four_bar, makers.slider_crank])
def test_a_turn_from_where_numbers_of_the_jacobian_vanish(make, start):
    """A crank along an axis has zeros in Φ_q that do not stay zero as it turns."""
    sizes = (1.0, 3.0, 2.0, 3.5) if make is makers.four_bar else (1.0, 3.0)
    machine = make(*sizes, masses=(1.0, 2.0, 3.0), start=start, speed=5.0)
    machine.add(Gravity("gravity", y=-9.81))
    run = kinetostatics(machine, turn=True, instants=FINE)
    assert run.record.blocks[0].shape[2] == LANES
    oracle, at = Reference(machine), slice(None, None, STRIDE)
    q, v, a = (part[::10] for part in oracle.motion(run.t[:: STRIDE // 10]))
    assert_motion(run, q, v, a, at)
    assert_forces(run, forces_of(oracle, q, v, a, run.t[at]), at)
    assert_checked(run)
