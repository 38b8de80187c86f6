"""Size: a chain of 1000 links and a hub of 1000 joints, against sparse and recursive mechanics.

Work and memory are counted, not timed: the counts are the same on every machine.
"""

import functools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import bmat, coo_matrix, diags
from scipy.sparse.linalg import splu

import mbody
from mbody import makers
from mbody.core.lanes import LANES
from mbody.engineering import close_loops
from mbody.kernels.forces import free_motion
from mbody.laws import Harmonic
from tests.support.cases import first_fast

MANY = 1000
G = 9.81
PUSH = 7.0


def chain(links):
    """Bars of different lengths one on the other, about upright; a torque turns the last one."""
    machine = mbody.Mechanism("chain")
    lengths = 1.0 + 0.5 * np.cos(np.arange(links))
    angles = 1.2 + 0.3 * np.sin(np.arange(links))
    for k in range(links):
        mass = 1.0 + 0.4 * math.sin(3.0 * k)
        bar = makers.bar(f"b{k}", float(lengths[k]), mass=mass, guess=float(angles[k]))
        machine.add(bar, mbody.Revolute(f"j{k}", f"b{k - 1}.B" if k else "ground", f"b{k}.A"))
    machine.add(mbody.Gravity("gravity", y=-G), mbody.Torque("push", f"b{links - 1}", value=PUSH))
    return machine


def hub(spokes):
    """A pinned disc with that many bars hinged on its rim."""
    machine = mbody.Mechanism("hub")
    around = 2.0 * math.pi * np.arange(spokes) / spokes
    rim = {f"P{k}": (math.cos(x), math.sin(x)) for k, x in enumerate(around)}
    machine.add(mbody.Body("hub", mass=5.0, inertia=2.0, points=rim))
    machine.add(mbody.Revolute("O", "ground", "hub"))
    for k, x in enumerate(around):
        length, mass = 1.0 + 0.3 * math.sin(2.0 * k), 1.0 + 0.5 * math.cos(k)
        machine.add(makers.bar(f"b{k}", length, mass=mass, guess=float(x) + 0.4 * math.sin(k)))
        machine.add(mbody.Revolute(f"j{k}", f"b{k}.A", f"hub.P{k}"))
    machine.add(mbody.Gravity("gravity", y=-G), mbody.Torque("push", "hub", value=PUSH))
    return machine


def driven(make, size):
    """Every body with its own motor on the ground."""
    machine = make(size)
    for k, body in enumerate(machine.bodies):
        law = Harmonic(body.guess.angle or 0.0, 0.2, 2.0 + math.cos(k), float(k))
        machine.add(mbody.AngleDriver(f"m {body.name}", body.name, law))
    return machine


@functools.cache
def pose(make):
    """System with q and v that suit its pins, far from rest; both from `close_loops`."""
    system = mbody.assemble(make(MANY))
    rng = np.random.default_rng(0)
    rates = {body.name: float(rng.normal()) for body in system.mechanism.bodies}
    run = close_loops(system, rates=rates)
    table = run.record.table(slice(0, 2 * system.coordinates))[0]
    return system, *table.reshape(2, -1)


# -- free motion against a sparse solve -------------------------------------------------------


def pinned(mechanism, q, v):
    """By hand: Φ, Φ_q (sparse), γ, masses and loads of bars and discs on pins.

    Φ = r_j + p_j − r_i − p_i for every pin, p the arm from the mass centre turned into the world;
    γ = ω_j² p_j − ω_i² p_i.
    """
    index = {body.name: k for k, body in enumerate(mechanism.bodies)}
    rows, columns, parts, phi, gamma = [], [], [], [], []
    for n, joint in enumerate(mechanism.joints):
        gap, bend = np.zeros(2), np.zeros(2)
        for sign, marker in ((-1.0, joint.i), (1.0, joint.j)):
            if marker.body == "ground":
                continue
            k = 3 * index[marker.body]
            body = mechanism[marker.body]
            place = body.points[marker.point] if isinstance(marker.point, str) else marker.point
            sx, sy = np.subtract(place, body.cg)
            c, s = math.cos(q[k + 2]), math.sin(q[k + 2])
            px, py = c * sx - s * sy, s * sx + c * sy
            gap += sign * (q[k : k + 2] + np.array([px, py]))
            bend += sign * v[k + 2] ** 2 * np.array([px, py])
            rows += [2 * n, 2 * n + 1, 2 * n, 2 * n + 1]
            columns += [k, k + 1, k + 2, k + 2]
            parts += [sign, sign, -sign * py, sign * px]
        phi.append(gap)
        gamma.append(bend)
    jacobian = coo_matrix((parts, (rows, columns)), (2 * len(mechanism.joints), len(q))).tocsc()
    masses = np.array([x for b in mechanism.bodies for x in (b.mass, b.mass, b.inertia)])
    loads = np.array([x for b in mechanism.bodies for x in (0.0, -G * b.mass, 0.0)])
    loads[3 * index[mechanism["push"].body] + 2] += PUSH
    return np.ravel(phi), jacobian, np.ravel(gamma), masses, loads


@pytest.mark.parametrize("make", [chain, hub])
def test_free_motion_of_a_thousand(make):
    system, q, v = pose(make)
    phi, jacobian, gamma, masses, loads = pinned(system.mechanism, q, v)
    assert len(phi) >= 2 * MANY and np.abs(v[2::3]).max() > 1.0
    # ends of the chain lie a thousand lengths out: rounding there is 1e-13
    assert np.abs(phi).max() < 1e-12
    assert np.abs(jacobian @ v).max() < 1e-12 * np.abs(v).max()
    both = bmat([[diags(masses), jacobian.T], [jacobian, None]]).tocsc()
    solver, right = splu(both), np.concatenate([loads, gamma])
    found = solver.solve(right)
    found += solver.solve(right - both @ found)  # its pivots leave 1e-11 otherwise
    a, pull = found[: len(q)], found[len(q) :]
    work = system.work(masses=True)
    work.q[: len(q), 0], work.v[: len(q), 0] = q, v
    free_motion(system.runtime(), work, 0.0, 2)
    mine = work.a[: len(q), 0]
    # the equations themselves to rounding; the two solutions differ by that times the condition,
    # 1e3 or so, since every link resists by its own mass
    force = np.abs(jacobian.T @ pull).max()
    assert_allclose(jacobian @ mine, gamma, rtol=0, atol=1e-13 * np.abs(gamma).max())
    assert_allclose(mine, a, rtol=0, atol=1e-12 * np.abs(a).max())
    assert_allclose(loads - masses * mine, jacobian.T @ pull, rtol=0, atol=1e-12 * force)


# -- kinetostatics against recursive Newton–Euler ---------------------------------------------


def recursive(mechanism, t):
    """({joint: (outer body, force on it (2,))}, {body: torque of its motor}), by hand at time t.

    Outwards: places and accelerations from each pin to the next; inwards: forces and torques.
    """
    where = {"ground": (np.zeros(2), np.zeros(2), (0.0, 0.0, 0.0))}  # of the link origins
    pins = []
    for joint in mechanism.joints:
        inner, outer = joint.i, joint.j
        if inner.body not in where:
            inner, outer = outer, inner
        spot, pull = spread(where[inner.body], marked(mechanism, inner))
        law = mechanism[f"m {outer.body}"].law.derivatives(t)
        arm, bend = spread((np.zeros(2), np.zeros(2), law), marked(mechanism, outer))
        where[outer.body] = (spot - arm, pull - bend, law)
        pins.append((joint.name, inner.body, outer.body, spot))
    forces, torques = {}, {}
    # force and moment about the world's origin that each body needs from its pin and motor
    need = {}
    for body in mechanism.bodies:
        centre, acceleration = spread(where[body.name], body.cg)
        force = body.mass * (acceleration + np.array([0.0, G]))
        moment = body.inertia * where[body.name][2][2] + cross(centre, force)
        need[body.name] = [force, moment]
    need[mechanism["push"].body][1] -= PUSH
    for name, inner, outer, spot in reversed(pins):
        force, moment = need[outer]
        forces[name] = outer, force
        torques[outer] = moment - cross(spot, force)
        if inner != "ground":
            need[inner][0] = need[inner][0] + force
            need[inner][1] += cross(spot, force)
    return forces, torques


def marked(mechanism, marker):
    if not isinstance(marker.point, str):
        return marker.point
    return mechanism[marker.body].points[marker.point]


def spread(origin, place):
    """Place and acceleration of a point of a body from those of its origin."""
    spot, pull, (angle, rate, change) = origin
    c, s = math.cos(angle), math.sin(angle)
    arm = np.array([c * place[0] - s * place[1], s * place[0] + c * place[1]])
    return spot + arm, pull + change * np.array([-arm[1], arm[0]]) - rate**2 * arm


def cross(a, b):
    return float(a[0] * b[1] - a[1] * b[0])


@pytest.mark.parametrize("make", [chain, hub])
@first_fast(("size", "instants"), [(MANY, 3), (MANY, 101), (25, 101)], 1)
def test_kinetostatics_of_a_thousand(make, size, instants):
    machine = driven(make, size)
    t = np.linspace(0.0, 0.5, instants)
    run = mbody.kinetostatics(machine, t)
    # lanes are for mechanisms of some tens of bodies
    assert run.record.blocks[0].shape[2] == (LANES if size < MANY else 1)
    for k in (0, instants // 2, instants - 1):
        forces, torques = recursive(machine, float(t[k]))
        # moments about the far origin, of up to a thousand lengths, leave that much rounding in
        # torques by hand
        top = max(np.abs(force).max() for _, force in forces.values())
        for name, (outer, force) in forces.items():
            part = run.reaction(name, on=outer)
            found = [part.fx[k], part.fy[k], part.torque[k]]
            assert_allclose(found, [*force, 0.0], rtol=0, atol=1e-11 * top)
        found = [run.effort(f"m {name}")[k] for name in torques]
        assert_allclose(found, list(torques.values()), rtol=0, atol=1e-11 * top)


# -- counted work and memory ------------------------------------------------------------------


def operations(system):
    """Multiplications of one evaluation of free motion, a division taken as eight of them.

    By `kernels.constraints`, `kernels.schur_ldl` and `kernels.accelerations`: sine and cosine of a
    body and its weight; the
    rows of a primitive; of a node 36 to form its diagonal, 22 to invert it, 6 to solve, 24 for
    products
    with G and its transpose; of a formed block 18; of a block of the factor 14, and 8 to solve; of
    an update 8; and 12 of a slot. Counted with numbers that count: 181 a link of the chain, 570 of
    the hub.
    """
    L = system.layout
    return (
        22 * L.bodies
        + 20 * len(L.primitive_kind)
        + 88 * L.nodes
        + 18 * len(L.form_block)
        + 22 * len(L.block_row)
        + 8 * len(L.update)
        + 12 * L.slots
    )


def memory(system):
    """Bytes of the index lists, the numbers and one workspace."""
    layout, work = system.layout.as_dict().values(), system.work().as_dict().values()
    parts = [*layout, *work, system.par, system.mass]
    return sum(np.asarray(part).nbytes for part in parts)


@pytest.mark.parametrize("make", [chain, hub])
def test_work_and_memory_grow_with_the_number_of_bodies(make):
    small, large = mbody.assemble(make(100)), mbody.assemble(make(MANY))
    ratio = large.layout.bodies / small.layout.bodies
    for count in (
        operations,
        memory,
        lambda s: s.layout.nodes,
        lambda s: len(s.layout.block_row),
        lambda s: len(s.layout.form_block),
    ):
        # ends have fewer neighbours, so that a short one is cheaper by a few hundredths
        assert count(large) <= 1.03 * ratio * count(small)
    layout = large.layout
    assert layout.nodes <= 2.0 * layout.bodies
    assert len(layout.block_row) <= 7.0 * layout.bodies
    assert len(layout.update) <= 12.0 * layout.bodies
    assert memory(large) < 3000 * layout.bodies
