"""Problems of contacts in several parts, their impacts and what stops them, beside enumeration."""

import itertools

import numpy as np
import pytest

from mbody.analysis.contact.contact_tables import ClosedContacts
from tests.support.contact_problems import FrictionProblem, cone, impulses, outcomes


def random_part(rng, size, leaning=0.0):
    """Delassus's matrix of some contacts, normals before tangents, that lean as Painlevé's rod."""
    R = rng.normal(size=(2 * size, 2 * size + 2))
    R[size:] += leaning * R[:size]
    R *= 10.0 ** rng.uniform(-1, 1)
    return R @ R.T


def joined(parts):
    """The matrix of contacts in parts that nothing joins, and the rows of each part."""
    m = sum(len(part) // 2 for part in parts)
    D, rows, first = np.zeros((2 * m, 2 * m)), [], 0
    for part in parts:
        own = np.arange(first, first + len(part) // 2)
        rows.append(np.concatenate([own, m + own]))
        D[np.ix_(rows[-1], rows[-1])] = part
        first += len(own)
    return D, rows


def every_solution(D, c, mu, given):
    """Forces and accelerations of all modes that keep the laws: the definition, by dense linear
    equations. `mu`, `given` (m,): coefficients, normal impulses that count beside.
    """
    m, found = len(mu), []
    for closed in itertools.product((False, True), repeat=m):
        acts = [mu[k] > 0.0 and (closed[k] or given[k] > 0.0) for k in range(m)]
        choices = [("stick", 1.0, -1.0) if one else (None,) for one in acts]
        for modes in itertools.product(*choices):
            holds = [*np.flatnonzero(closed), *(m + k for k in range(m) if modes[k] == "stick")]
            push, known = np.zeros((2 * m, len(holds))), np.zeros(2 * m)
            push[holds, np.arange(len(holds))] = 1.0
            for k in np.flatnonzero([one in (1.0, -1.0) for one in modes]):
                push[m + k, : sum(closed)] = -mu[k] * modes[k] * push[k, : sum(closed)]
                known[m + k] = -mu[k] * modes[k] * given[k]
            f = known
            rows = (D @ push)[holds]
            # of rows that depend on each other some are at their limits in other modes
            if len(holds) and np.linalg.matrix_rank(rows) < len(holds):
                continue
            if len(holds):
                f = known - push @ np.linalg.solve(rows, (c + D @ known)[holds])
            w, size, big = c + D @ f, 1e-9 * np.abs(c).max(), 1e-9 * np.abs(f).max()
            good = bool((f[:m] >= -big).all() and (w[:m] >= -size).all())
            for k in range(m):
                if modes[k] == "stick":
                    good &= bool(abs(f[m + k]) <= mu[k] * (f[k] + given[k]) + big)
                elif modes[k] is not None:
                    good &= bool(modes[k] * w[m + k] >= -size)
            if good:
                found.append((f, w))
    return found


def test_every_solution_of_parts_is_found():
    """Another solution of the whole differs in one of its parts; each is one of the part alone."""
    rng, several = np.random.default_rng(3), 0
    for _ in range(60):
        sizes = rng.integers(1, 3, size=int(rng.integers(1, 4)))
        parts = [random_part(rng, int(size), 2.0) for size in sizes]
        D, rows = joined(parts)
        m = len(D) // 2
        mu, c = rng.uniform(0.3, 4.0, m), rng.normal(size=2 * m)
        c[:m] -= 0.3
        problem = FrictionProblem(m, tuple(cone(k, mu[k]) for k in range(m)), c, D, np.zeros(2 * m))
        found, complete = problem.solutions()
        assert complete
        own = []
        for part in rows:
            size = len(part) // 2
            right = every_solution(D[np.ix_(part, part)], c[part], mu[part[:size]], np.zeros(size))
            own.append([w for _, w in right])
        kinds = [len({tuple(np.round(w, 6) + 0.0) for w in one}) for one in own]
        if min(kinds) == 0:
            assert not found
            continue
        assert len(found) == 1 + sum(kinds) - len(kinds)
        several += len(found) > 1
        for one in found:
            assert one.accelerations == pytest.approx(c + D @ one.forces, abs=1e-9)
            for part, right in zip(rows, own, strict=True):
                w = one.accelerations[part]
                assert any(np.allclose(w, each, rtol=0.0, atol=1e-7) for each in right)
    assert several > 3


@pytest.mark.parametrize("law", ["poisson", "newton", "mixed"])
def test_impulses_are_those_of_both_stages(law):
    """Compression and expansion beside all modes of each; frictionless contacts among them."""
    rng, compared = np.random.default_rng(4), 0
    for _ in range(80):
        parts = [random_part(rng, int(rng.integers(1, 3))) for _ in range(int(rng.integers(1, 3)))]
        D, _ = joined(parts)
        m = len(D) // 2
        mu, before = rng.uniform(0.2, 1.0, m), rng.normal(size=2 * m)
        mu[rng.random(m) < 0.2] = 0.0
        e = rng.uniform(0.0, 0.9, m)
        newton = rng.random(m) < 0.5 if law == "mixed" else np.full(m, law == "newton")
        thrown = before.copy()
        thrown[:m] += np.where(newton, e * np.minimum(before[:m], 0.0), 0.0)
        right = []
        for first, _ in every_solution(D, thrown, mu, np.zeros(m)):
            given = np.where(newton, 0.0, e * first[:m])
            whole = first + np.append(given, np.zeros(m))
            right += [whole + more for more, _ in every_solution(D, thrown + D @ whole, mu, given)]
        found = impulses(ClosedContacts(D, mu), before, e, newton)
        assert (found is None) == (not right)
        if found is not None:
            size = 1e-8 * np.abs(found).max()
            assert any(np.allclose(found, one, rtol=0.0, atol=size) for one in right)
            compared += 1
    assert compared > 50


def test_velocities_after_an_impact_are_counted():
    """Of what strikes at one contact or at two, of bodies that lean on each other or not: as many
    as all sets of modes have; with redundant contacts, whose impulses are open, one.
    """
    rng, counts = np.random.default_rng(8), []
    for n in range(240):
        size, leaning = int(rng.integers(1, 3)), rng.choice([0.0, 2.0])
        mu, before = rng.uniform(0.3, 4.0, size), rng.normal(size=2 * size)
        before[:size] = -np.abs(before[:size])
        D = random_part(rng, size, leaning)
        right = {tuple(np.round(w, 6) + 0.0) for _, w in every_solution(D, before, mu, 0.0 * mu)}
        counts.append(outcomes(ClosedContacts(D, mu), before))
        assert counts[-1] == len(right), n
        if size == 1 and right:
            twice = np.array([0, 0, 1, 1])
            both = ClosedContacts(D[np.ix_(twice, twice)], np.repeat(mu, 2))
            assert outcomes(both, before[twice]) == len(right)
    assert counts.count(2) + counts.count(3) > 5
