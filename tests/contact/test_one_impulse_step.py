"""One step with impulses as a dense complementarity problem, made of masses and geometry alone."""

import math

import numpy as np
import pytest

import mbody
from tests.contact.test_many_contacts import stepped
from tests.support.lemke import lemke
from tests.support.piles import RADIUS, G, chain, pile


def dense_step(M, f, v, W, mu, gap, h, G_joints=None):
    """v⁺ of M (v⁺ − v) = h f + Gᵀ p + Wᵀ P with G (v + v⁺) = 0: the problem of Anitescu, Potra."""
    m, free = len(mu), v + h * np.linalg.solve(M, f)
    if G_joints is None:
        inverse = np.linalg.inv(M)
    else:
        k = len(G_joints)
        whole = np.block([[M, G_joints.T], [G_joints, np.zeros((k, k))]])
        inverse = np.linalg.inv(whole)[: len(M), : len(M)]
        right = np.concatenate([M @ v + h * f, -G_joints @ v])
        free = np.linalg.solve(whole, right)[: len(M)]
    D, b = W @ inverse @ W.T, W @ free
    N, T, zero, one = slice(0, m), slice(m, 2 * m), np.zeros((m, m)), np.eye(m)
    A = np.block(
        [
            [D[N, N], D[N, T], -D[N, T], zero],
            [D[T, N], D[T, T], -D[T, T], one],
            [-D[T, N], -D[T, T], D[T, T], one],
            [np.diag(mu), -one, -one, zero],
        ]
    )
    z = lemke(A, np.concatenate([b[N] + np.maximum(gap, 0.0) / h, b[T], -b[T], np.zeros(m)]))
    P = np.concatenate([z[:m], z[m : 2 * m] - z[2 * m : 3 * m]])
    return free + inverse @ W.T @ P


def disc_rows(q, near):
    """Rows of all discs (n, 3) that are near the floor or each other, and their gaps."""
    normal, tangent, gaps = [], [], []
    for i in range(len(q)):
        for j in range(-1, i):
            if j < 0:
                n, gap = np.array([0.0, 1.0]), q[i, 1] - RADIUS
            else:
                d = q[i, :2] - q[j, :2]
                n, gap = d / np.hypot(*d), np.hypot(*d) - 2 * RADIUS
            if gap > near:
                continue
            t, a, b = np.array([n[1], -n[0]]), np.zeros(q.shape), np.zeros(q.shape)
            # forces act half way between the surfaces
            a[i, :2], b[i, :2], b[i, 2] = n, t, RADIUS + 0.5 * gap
            if j >= 0:
                a[j, :2], b[j, :2], b[j, 2] = -n, -t, RADIUS + 0.5 * gap
            normal.append(a.ravel())
            tangent.append(b.ravel())
            gaps.append(gap)
    return np.array([*normal, *tangent]), np.array(gaps)


@pytest.mark.parametrize("seed", range(4))
def test_one_step_of_a_collapsing_pile_is_that_of_the_dense_problem(seed):
    rng, h = np.random.default_rng(seed), 2e-3
    places = [(2.01 * RADIUS * k, RADIUS + 1e-5) for k in range(3)]
    places += [(RADIUS * (2 * k + 1) * 1.005, RADIUS * (1 + math.sqrt(3)) + 2e-4) for k in range(2)]
    machine = pile(2, 0.3, 0.2, places)
    rates = rng.normal(scale=0.3, size=(5, 3))
    machine.simulation = mbody.SimulationSettings(
        h,
        {
            f"d{n}": dict(zip(("vx", "vy", "omega"), map(float, row), strict=True))
            for n, row in enumerate(rates)
        },
    )
    run = stepped(machine, h, h, rtol=1e-13, instants=2)
    q = np.column_stack([*np.array(places).T, np.zeros(5)])
    M = np.diag(np.tile([1.0, 1.0, 0.5 * RADIUS**2], 5))
    W, gap = disc_rows(q + 0.5 * h * rates, 0.02)
    mu = np.array([0.2 if row[row != 0.0].size == 1 else 0.3 for row in W[: len(gap)]])
    after = dense_step(M, np.tile([0.0, -G, 0.0], 5), rates.ravel(), W, mu, gap, h)
    found = [getattr(run[f"d{n}"], part)[-1] for n in range(5) for part in ("vx", "vy", "omega")]
    assert np.abs(np.array(found) - after).max() < 1e-9
    assert run.stats["contacts"] >= 2


def test_one_step_of_a_chain_is_that_of_the_dense_problem():
    """Three links that strike the floor: joints by the dense matrix, v⁺ before its projection."""
    h, machine = 1e-3, chain(3, angle=0.0, height=1e-5)
    fall = {f"l{n}": {"vy": -0.5, "omega": 0.0} for n in range(3)}
    machine.simulation = mbody.SimulationSettings(h, fall)
    run = stepped(machine, h, h, rtol=1e-13, instants=2)
    q = np.array([[0.05 + 0.1 * n, 1e-5 - 0.5 * h * 0.5, 0.0] for n in range(3)])
    normal, tangent, joints = [], [], []
    for n in range(3):
        for s in (-0.05, 0.05):
            a, b = np.zeros((3, 3)), np.zeros((3, 3))
            a[n], b[n] = (0.0, 1.0, s), (1.0, 0.0, 0.5 * q[n, 1])  # half way to the floor
            normal.append(a.ravel())
            tangent.append(b.ravel())
    for n in range(2):
        for row, turn in (((1.0, 0.0), 0.0), ((0.0, 1.0), 0.05)):
            a = np.zeros((3, 3))
            a[n], a[n + 1] = (*row, turn), (-row[0], -row[1], turn)
            joints.append(a.ravel())
    M = np.diag(np.tile([0.1, 0.1, 0.1 * 0.1**2 / 12.0], 3))
    v = np.tile([0.0, -0.5, 0.0], 3)
    gap = np.repeat(q[:, 1], 2)
    W = np.array([*normal, *tangent])
    weights = np.tile([0.0, -0.1 * G, 0.0], 3)
    after = dense_step(M, weights, v, W, np.full(6, 0.5), gap, h, np.array(joints))
    found = np.array(
        [getattr(run[f"l{n}"], part)[-1] for n in range(3) for part in ("vx", "vy", "omega")]
    )
    assert np.abs(found - after).max() < 1e-9
