"""Linear programs of forces that no equation decides, beside those of another solver (HiGHS)."""

import numpy as np
import pytest
from scipy.optimize import linprog

from mbody.kernels.friction import PIN
from mbody.kernels.linear_program import INCONSISTENT, OPTIMAL, UNBOUNDED
from mbody.solution.shared_forces import BentLimit, Lines, greatest, reported
from tests.support.impact_cones import nearest_of_cone

STATUS = {0: OPTIMAL, 2: INCONSISTENT, 3: UNBOUNDED, 4: UNBOUNDED}


def program(rng, kind):
    """A random program: aim (n,), A (m, n), b (m,)."""
    n, m = rng.integers(1, 7), rng.integers(1, 40)
    A, b, aim = rng.normal(size=(m, n)), rng.uniform(0.0, 1.0, m), rng.normal(size=n)
    if kind == "whole numbers":  # many equal ratios
        A, b = rng.integers(-2, 3, (m, n)) * 1.0, rng.integers(0, 3, m) * 1.0
        aim = rng.integers(-2, 3, n) * 1.0
    elif kind == "without a place at first":
        b = rng.normal(size=m) + 0.5
    elif kind == "ratios":
        A *= 10.0 ** rng.uniform(-2, 2, A.shape) * 10.0 ** rng.uniform(-9, 9, (m, 1))
        b = np.where(rng.random(m) < 0.3, 0.0, b) * np.abs(A).max(axis=1)
    if rng.random() < 0.7:
        A, b = np.vstack([A, np.eye(n), -np.eye(n)]), np.append(b, np.ones(2 * n))
    return aim, A, b


@pytest.mark.parametrize(
    "kind", ["any", "whole numbers", "without a place at first", "ratios", "repeated"]
)
def test_linear_programs_beside_another_solver(kind):
    rng, seen = np.random.default_rng(7), set()
    for _ in range(60):
        aim, A, b = program(rng, kind)
        if kind == "repeated":
            A, b = np.vstack([A, A, 3.0 * A]), np.concatenate([b, b, 3.0 * b])
        found, x, _ = greatest(aim, A, b)
        scale = 1.0 / np.maximum(np.abs(A).max(axis=1), 1e-300)
        other = linprog(-aim, A * scale[:, None], b * scale, bounds=(None, None), method="highs")
        assert found == STATUS[other.status]
        seen.add(found)
        if found == OPTIMAL:
            assert ((A @ x - b) * scale).max() <= 1e-12 * max(1.0, np.abs(x).max())
            assert aim @ x == pytest.approx(-other.fun, abs=2e-6, rel=1e-7)
    assert {OPTIMAL, UNBOUNDED} <= seen


def scene(rng, whole=False):
    """Contacts between random bodies and the ground, pins without friction: columns, forces that
    are there, which are of contacts, limits as arguments of `Lines.add`.
    """
    bodies, columns, own, lines = rng.integers(1, 4), [], [], []

    def wrench(one, place, along):
        found = np.zeros(3 * bodies)
        found[3 * one : 3 * one + 3] = *along, place[0] * along[1] - place[1] * along[0]
        return found

    def pair(along, place):
        one, two = rng.integers(bodies), rng.integers(-1, bodies)
        both = [wrench(one, place, v) for v in along]
        if two not in (-1, one):
            both = [x - wrench(two, place, v) for x, v in zip(both, along, strict=True)]
        return both

    for k in range(rng.integers(2, 6)):
        place = np.array([rng.integers(-2, 3), -1.0]) if whole else rng.normal(size=2)
        angle = np.pi / 2 if whole else rng.uniform(0.0, 2.0 * np.pi)
        n = np.array([np.cos(angle), np.sin(angle)])
        mu, i = rng.choice([0.0, 0.3, 0.3, rng.uniform(0.1, 1.5)]), len(columns)
        both = pair([n, np.array([n[1], -n[0]])], place)
        lines.append(((k, 0.0), {i: 1.0}))
        if mu:
            lines += [((k, s), {i: mu, i + 1: s}) for s in (1.0, -1.0)]
        columns += both if mu else both[:1]
    own = [True] * len(columns)
    for _ in range(rng.integers(0, 3)):
        columns += pair(np.eye(2), rng.normal(size=2))
        own += [False, False]
    forces = np.abs(rng.normal(size=len(columns))) * 10.0 ** rng.uniform(-3, 3)
    return np.array(columns).T, np.round(forces) if whole else forces, np.array(own), lines


def limits_of(count, lines):
    found = Lines(count)
    for line in lines:
        found.add(*line)
    return found.made()


@pytest.mark.parametrize("whole", [False, True])
def test_the_greatest_least_margin_is_that_of_a_program_of_all_forces(whole):
    rng, seen = np.random.default_rng(3), 0
    for _ in range(60):
        columns, forces, own, lines = scene(rng, whole)
        limits = limits_of(len(forces), lines)
        found, parts, margins = reported(columns, forces, own, limits)
        load = columns @ forces
        assert columns @ found == pytest.approx(load, abs=1e-9 * np.abs(forces).max(initial=1e-9))
        if len(parts) != 1 or not forces.any():
            continue
        ((part,), (margin,)) = parts, margins
        A = np.hstack([-limits.lines[part.limits], np.ones((len(part.limits), 1))])
        balance = np.hstack([columns, np.zeros((len(columns), 1))]) / part.size
        other = linprog(
            np.append(np.zeros(len(forces)), -1.0), A, np.zeros(len(A)), balance,
            load / part.size**2, [(None, None)] * len(forces) + [(None, 100.0)], method="highs",
        )  # fmt: skip
        least = limits.at(found)[part.limits].min() / part.size
        assert least == pytest.approx(margin.least, abs=1e-9)
        bound = np.abs(found / part.units).max() < 2.9 * part.size
        if other.status == 0 and bound and margin.least < 2.9:
            seen += 1
            assert margin.least == pytest.approx(-other.fun, abs=1e-7)
            # of all such forces the least: −z is a sum of what limits and margin push
            z, G = (margin.y - part.start) / part.size, limits.lines[part.limits] @ part.free
            on = limits.at(found)[part.limits] <= (margin.least + 1e-9) * part.size
            G = G[on] / part.size
            if not on.any():
                assert np.abs(z).max() < 1e-9
                continue
            # those that must be at the margin push either way
            push = linprog(
                np.zeros(on.sum()), A_eq=np.vstack([G.T, np.ones(on.sum())]),
                b_eq=np.append(np.zeros(G.shape[1]), 1.0),
            )  # fmt: skip
            fixed = push.x > 1e-9 if push.status == 0 else np.zeros(on.sum(), bool)
            left = nearest_of_cone(np.vstack([G, -G[fixed]]).T, z)[1]
            assert left <= 1e-7 * max(1.0, np.linalg.norm(z))
    assert seen >= 8


def test_order_and_units_change_no_force():
    rng, seen = np.random.default_rng(11), 0
    for _ in range(40):
        columns, forces, own, lines = scene(rng)
        n = len(forces)
        order, unit, length = rng.permutation(n), 2.0 ** rng.integers(-20, 20), 8.0
        place = np.argsort(order)
        moved = [(one, {int(place[k]): v for k, v in parts.items()}) for one, parts in lines]
        again = limits_of(n, [moved[k] for k in rng.permutation(len(moved))])
        other = columns[:, order]
        other[2::3] *= length
        first, parts, _ = reported(columns, forces, own, limits_of(n, lines))
        second, _, _ = reported(other, unit * forces[order], own[order], again)
        if parts:
            seen += 1
            size = max(part.size for part in parts)
            off = np.abs(second[place] / unit - first) / parts[0].units
            assert off.max() <= 1e-8 * size
    assert seen >= 20


def test_no_forces_nearby_have_a_greater_margin_of_rough_pins():
    """A bar on two pins, both rough: 4 forces of the pins and 2 torques on 3 coordinates."""
    rng, rho = np.random.default_rng(2), 0.3
    columns = np.zeros((3, 6))
    columns[0, [0, 2]] = columns[1, [1, 3]] = columns[2, 4:] = 1.0
    columns[2, [1, 3]] = -1.0, 1.0
    arm = np.array([rho, 0.0, 0.0] * 2)
    own = np.arange(6) >= 4

    def margin(f):
        limit = rho * np.hypot(f[[0, 2]], f[[1, 3]])
        return (limit - np.abs(f[4:])).min()

    for _ in range(5):
        forces, lines = rng.normal(size=6), Lines(6)
        for k in range(2):
            lines.bent.append(BentLimit(k, 4 + k, (2 * k, 2 * k + 1), PIN, arm, 1.0))
        found, (part,), (least,) = reported(columns, forces, own, lines.made())
        assert margin(found) == pytest.approx(least.least * part.size)
        for _ in range(100):
            moved = found + 1e-3 * part.size * part.free @ rng.normal(size=part.free.shape[1])
            inside = np.abs(moved / part.units).max() <= np.abs(found / part.units).max()
            assert margin(moved) <= margin(found) + 1e-9 * part.size or not inside


def test_what_stops_a_table_on_its_feet():
    """Three feet, pushed along: all slip together; loaded beyond the last one, the first opens."""
    feet = np.array([-1.0, 0.0, 1.0])
    columns = np.zeros((3, 6))
    columns[1, :3], columns[2, :3] = 1.0, feet
    columns[0, 3:], columns[2, 3:] = 1.0, 1.0
    lines = [((k, 0.0), {k: 1.0}) for k in range(3)]
    lines += [((k, s), {k: 0.5, 3 + k: s}) for k in range(3) for s in (1.0, -1.0)]
    limits, own = limits_of(6, lines), np.ones(6, dtype=bool)
    pushed = np.array([2.0, 2.0, 2.0, 1.0, 1.0, 0.7])
    _, (part,), (margin,) = reported(columns, pushed, own, limits)
    assert margin.least * part.size == pytest.approx(0.1)  # μ ΣN − ΣT, shared by three
    assert sorted(margin.active) == [(0, -1.0), (1, -1.0), (2, -1.0)]
    tipped = np.array([-1.0, 3.0, 3.0, 0.0, 0.0, 0.0])  # N₃ − N₁ = 4, ΣN = 5, ½ N ≥ θ
    _, (part,), (margin,) = reported(columns, tipped, own, limits)
    assert margin.least * part.size == pytest.approx(1 / 6)
    assert {who for who, _ in margin.active} == {0, 1}
