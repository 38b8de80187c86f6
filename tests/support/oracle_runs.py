"""Random linkages, what the slow oracle says of them, and how a run is compared with it.

Tolerances, all as parts of the greatest number of the same sort at that instant or over the run:

- positions 1e-13: both sides close the loops to rounding, 1e-16 of a model length or a radian, and
  the smallest singular value of Φ_q is at least 0.03 within the safe turn;
- velocities and accelerations 1e-11: one or two solves with a matrix whose condition reaches some
  hundreds, from γ, whose terms cancel to about a tenth; the oracle (least squares by singular
  values) loses as much as the engine;
- forces 1e-10 of the instant's greatest force: the promise of the project.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import Mechanism
from mbody.engineering import close_loops
from mbody.engines.oracle import Reference
from mbody.kernels.forces import free_motion
from tests.support.linkages import random_linkage, times_within

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
    (`tests/driven/test_turns.py`): loops alone leave whole turns open.
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


def without(mechanism, *names):
    """A copy without these elements."""
    rest = Mechanism(mechanism.name, units=mechanism.units, g=mechanism.g)
    rest.ground = mechanism.ground
    rest.add(*(element for element in mechanism if element.name not in names))
    return rest


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
