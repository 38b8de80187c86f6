"""Quadrics with linear conditions: closed forms, products of planes, and counts by Bézout."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody.analysis.singular.singular_positions import is_flat, solutions, tangent, through, values


def product(one, other):
    """The quadric (one · y)(other · y) = 0."""
    return 0.5 * (np.outer(one, other) + np.outer(other, one))


def windows(count, ratio):
    """(y₁ − y₀)(y₁ − ratio y₀) = 0, and so on: 2ⁿ lines."""
    A = np.zeros((count, count + 1, count + 1))
    for k in range(count):
        one, other = np.zeros((2, count + 1))
        one[k : k + 2] = -1.0, 1.0
        other[k : k + 2] = -ratio, 1.0
        A[k] = product(one, other)
    return A


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("ratio", [-3.0, 0.4, -1.0])
def test_every_line_is_found(count, ratio):
    first = np.eye(count + 1)[:1]
    found = solutions(windows(count, ratio), first, np.array([2.0]))
    assert found.complete and found.flat and len(found.points) == 2**count
    for y in found.points:
        parts = y[1:] / y[:-1]
        assert_allclose(np.minimum(np.abs(parts - 1.0), np.abs(parts - ratio)), 0.0, atol=1e-9)


def test_two_planes_and_what_is_in_both():
    """In space: (x − y)(x + y) = 0; the z axis lies in both."""
    A = product(np.array([1.0, -1.0, 0.0]), np.array([1.0, 1.0, 0.0]))[None]
    both = through(A, np.array([0.0, 0.0, 5.0]))
    assert [len(T) for T in both.spaces] == [2, 2] and not len(both.odd)
    (one,) = through(A, np.array([3.0, 3.0, 5.0])).spaces
    assert_allclose(one @ [1.0, -1.0, 0.0], 0.0, atol=1e-12)
    assert len(through(A, np.zeros(3)).spaces) == 2
    # the shortest velocity of each plane with x = 1
    found = solutions(A, np.array([[1.0, 0.0, 0.0]]), np.ones(1))
    assert sorted(y[1] for y in found.points) == pytest.approx([-1.0, 1.0])
    assert max(abs(y[2]) for y in found.points) < 1e-9


def test_a_round_cone_has_no_branches():
    """x² + y² = z²: lines of it are velocities, but no tangent space stays in it."""
    A = np.diag([1.0, 1.0, -1.0])[None]
    found = through(A, np.zeros(3))
    assert not found.spaces and len(found.odd)
    assert not solutions(A, np.array([[0.0, 0.0, 1.0]]), np.ones(1)).flat


def test_no_real_solution():
    """x² + y² = 0 holds at the origin alone."""
    A = np.diag([1.0, 1.0])[None]
    assert not solutions(A, np.array([[1.0, 0.0]]), np.ones(1)).points


def test_a_double_root_is_one():
    A = product(np.array([2.0, -1.0]), np.array([2.0, -1.0]))[None]
    (y,) = solutions(A, np.array([[1.0, 0.0]]), np.ones(1)).points
    assert_allclose(y, [1.0, 2.0], atol=1e-7)


@pytest.mark.parametrize("seed", range(20))
def test_against_numpy_roots(seed):
    """Two random quadrics in the plane z = 1: the resultant's real roots (numpy) are found, all."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(2, 2))
    # quadrics through two given points, so that there are real ones
    A = []
    for _ in range(2):
        M = random.normal(size=(3, 3))
        M = 0.5 * (M + M.T)
        hom = np.column_stack([points, np.ones(2)])
        # correct two entries so that both points are on it
        E = np.zeros((2, 3, 3))
        E[0, 0, 0], E[1, 1, 1] = 1.0, 1.0
        system = np.array([[h @ e @ h for e in E] for h in hom])
        M += np.tensordot(np.linalg.solve(system, [-(h @ M @ h) for h in hom]), E, 1)
        A.append(M)
    A = np.array(A)
    found = solutions(A, np.array([[0.0, 0.0, 1.0]]), np.ones(1))
    # eliminate y: each is a(x) y² + b(x) y + c(x)
    P = np.polynomial.polynomial

    def coefficients(M):
        return ([M[1, 1]], [2.0 * M[1, 2], 2.0 * M[0, 1]], [M[2, 2], 2.0 * M[0, 2], M[0, 0]])

    (a, b, c), (d, e, f) = coefficients(A[0]), coefficients(A[1])
    first = P.polysub(P.polymul(a, f), P.polymul(c, d))
    cross = P.polymul(
        P.polysub(P.polymul(a, e), P.polymul(b, d)), P.polysub(P.polymul(b, f), P.polymul(c, e))
    )
    roots = P.polyroots(P.polysub(P.polymul(first, first), cross))
    real = np.sort(roots[np.abs(roots.imag) < 1e-7].real)
    assert_allclose(np.sort([y[0] for y in found.points]), real, rtol=0, atol=1e-6)
    for y in found.points:
        assert np.abs(values(A, y)).max() < 1e-9 * (y @ y)
        assert is_flat(A, tangent(A, y))
