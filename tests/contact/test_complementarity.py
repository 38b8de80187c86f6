"""Linear complementarity problems against enumeration, and the laws of contact that they state."""

import itertools
import math

import numpy as np
import pytest

from tests.support.contact_problems import FrictionProblem, Tangent, cone
from tests.support.lemke import lemke

RNG = np.random.default_rng


def every_solution(A, b):
    """All solutions whose support has a regular matrix, those without duplicates."""
    found = []
    for mask in itertools.product((False, True), repeat=len(b)):
        support, z = np.flatnonzero(mask), np.zeros(len(b))
        if len(support):
            part = A[np.ix_(support, support)]
            if np.linalg.cond(part) > 1e12:
                continue
            z[support] = np.linalg.solve(part, -b[support])
        w, big = A @ z + b, float(np.abs(z).max())
        if z.min() < -1e-10 * big or w.min() < -1e-10 * np.abs(b).max():
            continue
        if not any(np.allclose(z, other, rtol=0.0, atol=1e-8 * big) for other in found):
            found.append(z)
    return found


def test_lemke_agrees_with_all_supports():
    """Of positive definite matrices there is one solution, and enumeration finds it."""
    rng = RNG(3)
    for _ in range(100):
        n = int(rng.integers(1, 7))
        R = rng.normal(size=(n, n))
        A, b = R @ R.T + 0.1 * np.eye(n), rng.normal(size=n)
        (only,) = every_solution(A, b)
        assert lemke(A, b) == pytest.approx(only, abs=1e-10)


def decide(D, mu, sliding, normal, tangential):
    """The verdict on contacts alone, and their modes: "open", "stick", "slip+" or "slip-"."""
    m = len(mu)
    tangents = tuple(cone(k, mu[k], sliding[k]) for k in range(m))
    c = np.concatenate([normal, tangential])
    found, complete = FrictionProblem(m, tangents, c, D, np.zeros(2 * m)).solutions()
    assert complete
    if not found:
        return "inconsistent", ()
    normals, along = found[0].modes()
    modes = tuple(t if n == "closed" else n for n, t in zip(normals, along, strict=True))
    return "indeterminate" if len(found) > 1 else "", modes


def by_modes(D, normal, tangential, mu, static):
    """Modes of contacts at rest by trying all of them: the definition of Coulomb's law."""
    m = len(normal)
    found = []
    for modes in itertools.product(("open", "stick", "slip+", "slip-"), repeat=m):
        rows = [k for k in range(m) if modes[k] != "open"]
        holding = [*rows, *(m + k for k in rows if modes[k] == "stick")]
        push = np.zeros((2 * m, len(holding)))
        for n, row in enumerate(holding):
            push[row, n] = 1.0
        for n, k in enumerate(rows):
            if modes[k] in ("slip+", "slip-"):
                push[m + k, n] = -mu[k] if modes[k] == "slip+" else mu[k]
        free = np.concatenate([normal, tangential])
        system = (D @ push)[holding]
        if len(holding) and np.linalg.cond(system) > 1e12:
            continue
        forces = push @ (np.linalg.solve(system, -free[holding]) if len(holding) else np.zeros(0))
        a = free + D @ forces
        good = all(forces[k] >= -1e-12 for k in rows)
        for k in range(m):
            if modes[k] == "open":
                good &= a[k] >= -1e-12
            elif modes[k] == "stick":
                good &= abs(forces[m + k]) <= static[k] * forces[k] + 1e-12
            else:
                good &= a[m + k] * (1.0 if modes[k] == "slip+" else -1.0) >= -1e-12
        if good:
            found.append((modes, a))
    return found


@pytest.mark.parametrize("count", [1, 2, 3])
def test_what_begins_to_slide_has_its_kinetic_friction(count):
    """Random contacts at rest with more static than kinetic friction: what is decided is among the
    modes of Coulomb's law, static where it sticks and kinetic where it slides.
    """
    rng, found = RNG(100 + count), 0
    for _ in range(150 if count < 3 else 40):
        R = rng.normal(size=(2 * count, 2 * count + 2))
        D, mu = R @ R.T, rng.uniform(0.1, 0.6, count)
        static = mu * rng.uniform(1.0, 1.6, count)
        c = np.concatenate([rng.normal(size=count) - 1.5, 2.0 * rng.normal(size=count)])
        right = by_modes(D, c[:count], c[count:], mu, static)
        tangents = tuple(Tangent(k, static[k], begun=cone(k, mu[k])) for k in range(count))
        problem = FrictionProblem(count, tangents, c, D, np.zeros(2 * count))
        solutions, _ = problem.solutions(begins=True)
        if not right or not solutions:
            continue
        one = solutions[0]
        normals, along = one.modes()
        modes = tuple(t if n == "closed" else n for n, t in zip(normals, along, strict=True))
        found += 1
        assert modes in [each for each, _ in right]
    assert found > 20


def rod(angle: float, rate: float) -> tuple[np.ndarray, float]:
    """Delassus's matrix of the lower end of a rod of mass 1 and half length 1, and its free normal
    acceleration, with g = 9.81.
    """
    s, c = math.sin(angle), math.cos(angle)
    D = np.array([[1.0 + 3.0 * c * c, -3.0 * s * c], [-3.0 * s * c, 1.0 + 3.0 * s * s]])
    return D, rate * rate * s - 9.81


def decided(angle: float, rate: float, mu: float):
    D, normal = rod(angle, rate)
    return decide(D, [mu], [-1.0], [normal], [0.0])


@pytest.mark.parametrize("mu", [1.34, 1.4, 1.7, 3.0])
def test_the_map_of_painleves_rod(mu):
    """A(θ) = 1 + 3 cos²θ − 3 μ sin θ cos θ < 0 where tan θ lies between (3 μ ∓ √(9 μ² − 16))/2: no
    acceleration where the end is pressed on, two where it would lift; outside one. To 1e-10.
    """
    root = math.sqrt(9.0 * mu * mu - 16.0)
    first, last = (math.atan((3.0 * mu + sign * root) / 2.0) for sign in (-1.0, 1.0))
    for angle, inside in (
        (first - 1e-10, False),
        (first + 1e-10, True),
        (0.5 * (first + last), True),
        (last - 1e-10, True),
        (last + 1e-10, False),
    ):
        slow, fast = decided(angle, 0.0, mu), decided(angle, 5.0, mu)
        assert slow[0] == ("inconsistent" if inside else "")
        assert fast == ("indeterminate" if inside else "", ("open",))
        if not inside:
            assert slow[1] == ("slip-",)


# -- Without dimensions ------------------------------------------------------------------------


def redundant(rng, count, rank):
    """Contacts of which so many rows do not depend on others, that can be at rest."""
    R = rng.normal(size=(2 * count, rank))
    return R @ R.T, R @ rng.normal(size=rank), rng.uniform(0.1, 1.5, count)


def law_violated(problem, one):
    """What a solution violates Signorini's and Coulomb's laws by, in parts of each row's own
    scale: by the laws in words, not by the projection that the kernel uses.
    """
    m, D, c = problem.normals, problem.delassus, problem.without
    s = 1.0 / np.sqrt(np.diag(D))
    f, w = one.forces / s, (c + D @ one.forces) * s
    f, w = (
        f / max(np.abs(c * s).max(), np.abs(f).max()),
        w / max(np.abs(c * s).max(), np.abs(f).max()),
    )
    worst = max(-f[:m].min(), -w[:m].min(), np.abs(f[:m] * w[:m]).max())
    for k, tangent in enumerate(problem.tangents, start=m):
        most = tangent.friction * f[tangent.normal] * s[tangent.normal] / s[k]
        worst = max(worst, abs(f[k]) - most, abs(w[k]) * min(1.0, most - abs(f[k])), f[k] * w[k])
    return worst


@pytest.mark.parametrize("count", [1, 2, 4, 8])
def test_redundant_contacts_have_forces_that_keep_every_law(count):
    rng = RNG(count)
    for _ in range(60 if count < 8 else 15):
        D, c, mu = redundant(rng, count, int(rng.integers(1, 2 * count + 1)))
        tangents = tuple(cone(k, mu[k]) for k in range(count))
        problem = FrictionProblem(count, tangents, c, D, np.zeros(2 * count))
        one = problem.solve()
        assert one is not None
        # a residual of 1e-9 at most, of which the products have the square root of the scale
        assert law_violated(problem, one) < 1e-8
        assert one.residual < 1e-9


@pytest.mark.parametrize("length", [-20, 0, 13])
@pytest.mark.parametrize("mass", [-30, 0, 30])
def test_powers_of_two_change_no_digit(length, mass):
    """Rows in other units of length, masses 2³⁰ times as large: the same bits of all forces."""
    rng = RNG(7)
    for _ in range(20):
        D, c, mu = redundant(rng, 3, int(rng.integers(2, 7)))
        tangents = tuple(cone(k, mu[k]) for k in range(3))
        here = FrictionProblem(3, tangents, c, D, np.zeros(6)).solve()
        there = FrictionProblem(3, tangents, c * 2.0**length, D * 2.0**-mass, np.zeros(6)).solve()
        assert np.array_equal(there.forces, here.forces * 2.0 ** (length + mass))
        assert there.modes() == here.modes()


def test_a_part_does_not_depend_on_what_else_there_is():
    """Two problems that nothing connects, 1e24 apart in forces: each as by itself."""
    rng = RNG(11)
    for _ in range(20):
        parts = [redundant(rng, 2, 4) for _ in range(2)]
        scale = 1e24
        D, c = np.zeros((8, 8)), np.zeros(8)
        for k, (own, rate, _) in enumerate(parts):
            rows = np.r_[2 * k : 2 * k + 2, 4 + 2 * k : 6 + 2 * k]
            D[np.ix_(rows, rows)], c[rows] = own / scale**k, rate
        mu = np.concatenate([part[2] for part in parts])
        both = FrictionProblem(
            4, tuple(cone(k, mu[k]) for k in range(4)), c, D, np.zeros(8)
        ).solve()
        for k, (own, rate, coefficient) in enumerate(parts):
            tangents = tuple(cone(n, coefficient[n]) for n in range(2))
            alone = FrictionProblem(2, tangents, rate, own / scale**k, np.zeros(4)).solve()
            rows = np.r_[2 * k : 2 * k + 2, 4 + 2 * k : 6 + 2 * k]
            assert np.array_equal(both.forces[rows], alone.forces)


def test_forces_are_within_their_cones_to_the_last_digit():
    """Nothing presses that pulls by rounding, nor is there friction of what does not press."""
    rng, solved, open_ones = RNG(5), 0, 0
    for _ in range(300):
        m = int(rng.integers(1, 4))
        R = rng.normal(size=(2 * m, int(rng.integers(m, 2 * m + 1))))
        mu, c = rng.uniform(0.1, 1.5, m), rng.normal(size=2 * m)
        tangents = tuple(cone(k, mu[k]) for k in range(m))
        found = FrictionProblem(m, tangents, c, R @ R.T, np.zeros(2 * m)).solve()
        if found is not None:
            normal, along = found.forces[:m], found.forces[m:]
            assert (normal >= 0.0).all() and (np.abs(along) <= mu * normal).all()
            solved, open_ones = solved + 1, open_ones + int((normal == 0.0).sum())
    assert solved > 250 and open_ones > 100
