"""The engine against the slow oracle, on random linkages with loads of every kind.

Tolerances, all as parts of the greatest number of the same sort at that instant or over the run:

- positions 1e-13: both sides close the loops to rounding, 1e-16 of a model length or a radian, and
  the smallest singular value of Φ_q is at least 0.03 within the safe turn;
- velocities and accelerations 1e-11: one or two solves with a matrix whose condition reaches some
  hundreds, from γ, whose terms cancel to about a tenth; the oracle (least squares by singular
  values) loses as much as the engine;
- forces 1e-10 of the instant's greatest force: the promise of the project.
"""

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Distance,
    DistanceDriver,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SolveError,
    Torque,
    assemble,
    kinematics,
    kinetostatics,
    statics,
)
from mbody.analysis.driven.runner import Runner
from mbody.analysis.driven.time_grid import plan
from mbody.analysis.position.assembly_analysis import closed
from mbody.compiler.lanes import LANES
from mbody.engineering import close_loops
from mbody.engines.oracle import Reference
from mbody.kernels.accelerations import free_motion
from mbody.laws import ConstantSpeed, Harmonic, Polynomial
from mbody.makers import makers
from mbody.model.element import Marker
from mbody.solution.histories import Record
from tests.linkages import random_linkage, times_within

POSITION, MOTION, FORCE = 1e-13, 1e-11, 1e-10

PLAIN, SLIDERS, EXTRAS = (), ("sliders",), ("extras",)
LINKAGES = [
    (seed, loops, kind)
    for loops in (3, 4)  # eight links, ten links
    for kind, seeds in ((PLAIN, (0, 1, 2)), (SLIDERS, (0, 1)), (EXTRAS, (0, 1)))
    for seed in seeds
] + [(0, 3, SLIDERS + EXTRAS), (0, 4, SLIDERS + EXTRAS)]

# instants of the fine run; every STRIDE-th is compared with the oracle
FINE, STRIDE = 241, 40


def named(linkage):
    seed, loops, kind = linkage
    return "-".join(["eight" if loops == 3 else "ten", *kind, str(seed)])


def over(linkages):
    """All tests of one linkage run one after the other: its truth is made once a process."""
    return pytest.mark.parametrize("linkage", linkages, ids=named, scope="module")


every, some = over(LINKAGES), over(LINKAGES[::3])
turning = over(
    [(1, 3, PLAIN), (1, 3, SLIDERS), (0, 3, EXTRAS), (0, 4, PLAIN), (0, 4, SLIDERS), (1, 4, EXTRAS)]
)


class Truth(NamedTuple):
    """What the oracle says: times (n,), motion (n, 3 bodies), forces an instant."""

    oracle: Reference
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    forces: list


@functools.cache
def instants(linkage):
    seed, loops, kind = linkage
    mechanism, turn = random_linkage(seed, loops, **dict.fromkeys(kind, True))
    return mechanism, times_within(mechanism, turn, FINE)


@functools.cache
def truth(linkage):
    mechanism, fine = instants(linkage)
    oracle = Reference(mechanism)
    # six steps between two instants that are compared
    near = [*range(0, FINE, STRIDE // 5)]
    q, v, a = (part[::5] for part in oracle.motion(fine[near], first(mechanism, oracle)))
    t = fine[::STRIDE]
    return Truth(oracle, t, q, v, a, forces_of(oracle, q, v, a, t))


def first(mechanism, oracle):
    """The oracle's rough first position, turned as often as mbody settles by the torsion springs
    (`tests/test_turns.py`): loops alone leave whole turns open.
    """
    q, run = oracle.guess(), close_loops(mechanism)
    ours = np.array([run[body.name].angle[0] for body in mechanism.bodies])
    q[2::3] += 2.0 * math.pi * np.round((ours - q[2::3]) / (2.0 * math.pi))
    return q


def forces_of(oracle, q, v, a, t, drive=None):
    return [oracle.kinetostatics(*instant, drive) for instant in zip(q, v, a, t)]


def motion_of(run, at=slice(None)):
    """(q, v, a) as the oracle orders them, (instants, 3 bodies)."""
    histories = [run[name] for name in run]
    fields = (("x", "y", "angle"), ("vx", "vy", "omega"), ("ax", "ay", "alpha"))
    return [
        np.column_stack([getattr(body, f)[at] for body in histories for f in sort])
        for sort in fields
    ]


def assert_motion(run, q, v, a, at=slice(None)):
    for mine, wanted, tolerance in zip(motion_of(run, at), (q, v, a), (POSITION, MOTION, MOTION)):
        assert_allclose(mine, wanted, rtol=0, atol=tolerance * max(1.0, np.abs(wanted).max()))


def reaction(part):
    """(instants, 3)."""
    return np.column_stack([part.fx, part.fy, part.torque])


def assert_forces(run, forces, at=slice(None)):
    """Every reaction and every effort to FORCE of the instant's greatest force."""
    top = np.array([greatest(f) for f in forces])
    for joint in run.mechanism.joints:
        wanted = np.array([f["reactions"][joint.name] for f in forces])
        off = np.abs(reaction(run.reaction(joint.name))[at] - wanted).max(axis=1)
        assert (off <= FORCE * top).all(), (joint.name, (off / top).max())
    for driver in run.mechanism.drivers:
        wanted = np.array([f["efforts"][driver.name] for f in forces])
        off = np.abs(run.effort(driver.name)[at] - wanted)
        assert (off <= FORCE * top).all(), (driver.name, (off / top).max())


def greatest(forces):
    parts = [*forces["reactions"].values(), list(forces["efforts"].values())]
    return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def assert_checked(run):
    # Newton ends at rounding; forces are corrected until 1e-14 of the terms or no better
    checks = run.checks
    assert checks.constraint < 1e-14 and checks.equilibrium < 1e-11 and checks.virtual_work < 1e-11


# -- one freedom, eight and ten links ---------------------------------------------------------


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
    runner, asked = Runner(system, analysis), plan(system, times, None, None, None)
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


@some
def test_lanes_of_statics_and_kinematics(linkage):
    mechanism, fine = instants(linkage)
    wanted, still = truth(linkage), np.zeros_like(truth(linkage).q)
    at = slice(None, None, STRIDE)
    run = kinematics(mechanism, fine)
    assert run.record.blocks[0].shape[2] == LANES
    assert_motion(run, *wanted[2:5], at=at)
    run = statics(mechanism, fine)
    assert run.record.blocks[0].shape[2] == LANES
    assert_motion(run, wanted.q, still, still, at=at)
    assert_forces(run, forces_of(wanted.oracle, wanted.q, still, still, wanted.t), at)


# -- values of the driver given directly ------------------------------------------------------


def driven(oracle, q, t, value, rate, acceleration):
    """(q, v, a) by the oracle with other values than the laws', from q near by."""
    q = np.array([oracle.close(*x) for x in zip(q, t, value)])
    v = np.array([oracle.velocities(*x) for x in zip(q, t, rate)])
    a = np.array([oracle.accelerations(*x) for x in zip(q, v, t, acceleration)])
    return q, v, a


def dicts(**columns):
    """[{name: value of that instant}] from arrays (instants,)."""
    return [dict(zip(columns, map(float, row))) for row in zip(*columns.values())]


@some
@pytest.mark.parametrize("count", [7, FINE], ids=["scalar", "lanes"])
def test_one_driver_by_value(linkage, count):
    mechanism, fine = instants(linkage)
    wanted, at = truth(linkage), slice(None, None, STRIDE if count == FINE else 1)
    t = fine if count == FINE else wanted.t
    value = mechanism["motor"].law(t)
    rate, acceleration = np.linspace(2.0, -3.0, count), np.linspace(-20.0, 30.0, count)
    run = kinetostatics(mechanism, t, drive={"motor": (value, rate, acceleration)})
    assert run.record.blocks[0].shape[2] == (LANES if count == FINE else 1)
    parts = [dicts(motor=x[at]) for x in (value, rate, acceleration)]
    q, v, a = driven(wanted.oracle, wanted.q, wanted.t, *parts)
    assert_motion(run, q, v, a, at)
    assert_forces(run, forces_of(wanted.oracle, q, v, a, wanted.t), at)
    assert_checked(run)
    # a value alone: at rest
    run = kinetostatics(mechanism, t, drive={"motor": value})
    still = np.zeros_like(q)
    assert_motion(run, q, still, still, at)
    assert_forces(run, forces_of(wanted.oracle, q, still, still, wanted.t), at)


def five_bar():
    machine = Mechanism("five-bar", ground={"O": (0.0, 0.0), "P": (1.5, 0.0)})
    machine.add(
        makers.bar("left", 0.7, mass=2.0, guess=1.9),
        makers.bar("left arm", 1.3, mass=1.0, guess=0.5),
        makers.bar("right arm", 1.2, mass=1.5, guess=2.5),
        makers.bar("right", 0.6, mass=2.5, guess=1.0),
        Revolute("O", "ground.O", "left.A"),
        Revolute("P", "right.A", "ground.P"),
        Revolute("A", "left.B", "left arm.A"),
        Revolute("B", "right arm.A", "right.B"),
        Revolute("C", "left arm.B", "right arm.B"),
        AngleDriver("left motor", "left", Harmonic(1.9, 0.4, 3.0, 0.2)),
        AngleDriver("right motor", "right", Polynomial([-0.9, -0.8, 0.3, 0.2]), relative_to="left"),
        Gravity("gravity", x=0.5, y=-9.81),
        Force("tool", "left arm.B", Polynomial([10.0, -4.0]), angle=0.4),
    )
    return machine


@pytest.mark.parametrize("count", [9, 241], ids=["scalar", "lanes"])
def test_two_motors_by_their_laws(count):
    machine = five_bar()
    t = np.linspace(0.0, 1.2, count)
    at = slice(None, None, 30 if count == 241 else 1)
    oracle = Reference(machine)
    q, v, a = (part[::10] for part in oracle.motion(np.linspace(0.0, 1.2, 81)))
    run = kinetostatics(machine, t)
    assert_motion(run, q, v, a, at)
    assert_forces(run, forces_of(oracle, q, v, a, t[at]), at)
    assert_checked(run)


@pytest.mark.parametrize("alone", [False, True], ids=["both given", "one keeps its law"])
def test_two_motors_by_value(alone):
    machine = five_bar()
    oracle, count = Reference(machine), 9
    t = np.linspace(0.0, 1.2, count)
    s = np.linspace(0.0, 1.0, count)
    given = {
        "left motor": (1.9 - 0.8 * s, np.full(count, 3.0), 5.0 * s),
        "right motor": (-0.9 + 0.5 * s**2, -2.0 * s, np.full(count, -7.0)),
    }
    if alone:
        law = machine["right motor"].law
        given["right motor"] = tuple(np.array([law.derivatives(x) for x in t]).T)
    ask = {"left motor": given["left motor"]} if alone else given
    run = kinetostatics(machine, t, drive=ask)
    parts = [dicts(**{name: values[k] for name, values in given.items()}) for k in range(3)]
    q, near = [], oracle.close(oracle.guess(), 0.0, parts[0][0])
    for k in range(count):
        near = oracle.close(near, t[k], parts[0][k])
        q.append(near)
    q, v, a = driven(oracle, q, t, *parts)
    assert_motion(run, q, v, a)
    assert_forces(run, forces_of(oracle, q, v, a, t))
    assert_checked(run)


# -- other drivers ----------------------------------------------------------------------------


def without(mechanism, *names):
    """A copy without these elements."""
    rest = Mechanism(mechanism.name, units=mechanism.units, g=mechanism.g)
    rest.ground = mechanism.ground
    rest.add(*(element for element in mechanism if element.name not in names))
    return rest


def slider_driven():
    machine = without(makers.slider_crank(1.0, 3.0, offset=0.2, masses=(2.0, 3.0, 1.0)), "motor")
    machine.add(
        CoordinateDriver("ram", "ground.O", "slider.B", Polynomial([3.4, 0.5, -1.1, 0.2])),
        Gravity("gravity", y=-9.81),
        Torque("load", "crank", value=Harmonic(3.0, 20.0, 5.0)),
    )
    return machine


def cylinder_driven():
    machine = Mechanism("cylinder", ground={"O": (0.0, 0.0), "C": (1.2, -0.4)})
    machine.add(
        Body(
            "rocker",
            mass=4.0,
            inertia=0.6,
            cg=(0.5, 0.1),
            points={"O": (0.0, 0.0), "P": (0.9, 0.2)},
            guess=1.2,
        ),
        makers.bar("link", 0.8, mass=1.0, guess=0.2),
        Body("slide", mass=2.0, inertia=0.1, cg=(0.05, 0.0), points={"B": (0.0, 0.0)}),
        Revolute("O", "rocker.O", "ground.O"),
        Revolute("P", "rocker.P", "link.A"),
        Revolute("B", "slide.B", "link.B"),
        Prismatic("guide", Marker("ground", (0.0, 1.0), 0.1), Marker("slide", "B", 0.3)),
        DistanceDriver("cylinder", "rocker.P", "ground.C", Harmonic(1.45, 0.2, 4.0, 0.1)),
        Gravity("gravity", y=-9.81),
        Force("push", "slide.B", -30.0),
    )
    return machine


@pytest.mark.parametrize("make", [slider_driven, cylinder_driven])
@pytest.mark.parametrize("count", [9, 241], ids=["scalar", "lanes"])
def test_drivers_of_lengths(make, count):
    machine = make()
    oracle, t = Reference(machine), np.linspace(0.0, 1.2, count)
    at = slice(None, None, 30 if count == 241 else 1)
    q, v, a = (part[::20] for part in oracle.motion(np.linspace(0.0, 1.2, 161)))
    run = kinetostatics(machine, t)
    assert run.record.blocks[0].shape[2] == (LANES if count == 241 else 1)
    assert_motion(run, q, v, a, at)
    assert_forces(run, forces_of(oracle, q, v, a, t[at]), at)
    assert_checked(run)


# -- branches, however coarse the output -----------------------------------------------------


@every
def test_coarse_instants_stay_on_the_branch(linkage):
    mechanism, fine = instants(linkage)
    coarse = kinetostatics(mechanism, fine[:: (FINE - 1) // 2])
    whole = truth(linkage)
    assert_motion(coarse, whole.q[::3], whole.v[::3], whole.a[::3])
    assert_forces(coarse, whole.forces[::3])


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


def accelerations(system, q, v, t, passes):
    """a of free motion, and {joint: force and torque (3,) about the mass centre of body j}."""
    work, layout, n3 = system.work(masses=True), system.layout, system.coordinates
    work.q[:n3, 0], work.v[:n3, 0], work.time[:] = q, v, t
    free_motion(system.runtime(), work, 0.0, passes)
    pushes = {}
    for joint in system.mechanism.joints:
        nodes = [layout.primitive_node[e] for e in system.primitives_of[joint.name]]
        pushes[joint.name] = -sum(
            work.block[12 * k + 6 : 12 * k + 12, 0].reshape(2, 3).T @ work.lam[2 * k : 2 * k + 2, 0]
            for k in nodes
        )
    return work.a[:n3, 0].copy(), pushes


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
        # a body without mass stands in with 1e-7 of the greatest, which corrections take back
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


def test_a_driver_law_of_constant_speed_over_a_turn():
    """`turn` along a law at constant speed has equal times and no angular acceleration."""
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 2.0, 3.0), start=0.4, speed=7.0)
    run = kinetostatics(machine, turn=True, instants=FINE)
    assert_allclose(np.diff(run.t), 2.0 * math.pi / 7.0 / (FINE - 1))
    assert np.abs(run["crank"].alpha).max() < 1e-9
    oracle = Reference(machine)
    assert machine["motor"].law == ConstantSpeed(0.4, 7.0)
    q, v, a = (part[::20] for part in oracle.motion(run.t[::2]))
    assert_motion(run, q, v, a, slice(None, None, 40))
    assert_forces(run, forces_of(oracle, q, v, a, run.t[::40]), slice(None, None, 40))


@pytest.mark.parametrize("start", [0.0, 0.5 * math.pi, math.pi])
@pytest.mark.parametrize("make", [makers.four_bar, makers.slider_crank])
def test_a_turn_from_where_numbers_of_the_jacobian_vanish(make, start):
    """A crank along an axis has zeros in Φ_q that come to life as it turns."""
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


# -- the order of the rows --------------------------------------------------------------------


def rod_four_bar(*drivers):
    """Crank 1 and rocker 2 on a base of 3.5, a massless rod of 3 between them."""
    machine = Mechanism("rod", ground={"O2": (0.0, 0.0), "O4": (3.5, 0.0)})
    machine.add(
        makers.bar("crank", 1.0, mass=1.0, guess=1.0),
        makers.bar("rocker", 2.0, mass=1.0, guess=1.7),
        Revolute("O2", "ground.O2", "crank.A"),
        Revolute("O4", "ground.O4", "rocker.A"),
        Distance("rod", "crank.B", "rocker.B", length=3.0),
        *drivers,
    )
    return machine


def test_rows_come_in_the_order_of_the_description():
    """Joints, then drivers, as `System.row_table` says; sentences about drivers rest on it."""
    system = assemble(rod_four_bar(AngleDriver("motor", "crank", 1.0)))
    names = [system.owners[primitive][0].name for primitive in system.row_table[0]]
    assert names == ["O2", "O2", "O4", "O4", "rod", "motor"]


def test_a_driver_that_cannot_reach_beside_a_rod():
    """The rocker comes no lower than where crank and rod are stretched, 4 from O2."""
    lowest = math.pi - math.acos((3.5**2 + 2.0**2 - 4.0**2) / (2.0 * 3.5 * 2.0))
    assert abs(lowest - 1.5887) < 1e-4
    with pytest.raises(
        SolveError, match=rf"0\.2 rad at t = 0 s: it comes within {lowest - 0.2:.3g} rad"
    ):
        kinematics(rod_four_bar(AngleDriver("motor", "rocker", 0.2)))
