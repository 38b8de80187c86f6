"""What Coulomb's law says of random linkages with frictional joints and closed contacts, by trying
all 3ᵐ modes with dense equations: own formulas, nothing of the engine.

    python -m tests.coulomb_enumeration 1000

compares so many of them with the first instant of a motion,

    python -m tests.coulomb_enumeration 1000 0 0.4

with instants of motions of 0.4 s, from the seed 0 on.
"""

from __future__ import annotations

import itertools
import math
import sys
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

import mbody
from tests.support.coulomb_linkages import Linkage, curvature, gradient, linkage

__all__ = ["Comparison", "Coulomb", "Followed", "compare", "follow"]

#: Starts of Newton's method for the forces of one set of modes: limits of joints bend, or have a
#: corner, so that there may be several.
STARTS = 12
#: How often solutions are sought again, from other starts, where the engine says that there are
#: several and one was found.
AGAIN = 4
#: Instants of a motion that are compared; a gap below this that does not grow is closed.
COMPARED, CLOSED = 6, 1e-9
#: The linkages move by some metres a second: slower than this is at rest.
AT_REST = 1e-10


class Coulomb:
    """The equations of one linkage; forces u = (λ of joints, N, T, friction of joints)."""

    def __init__(self, one: Linkage) -> None:
        q, v = one.q, one.v
        self.m, self.j, self.p = len(one.normals), len(one.rows), len(one.rubs)
        functions = [*one.rows, *one.normals, *one.tangents, *(rub[1] for rub in one.rubs)]
        self.J = gradient(functions, q) if functions else np.zeros((0, len(q)))
        self.gamma = curvature(functions, q, v)
        self.free = one.load / one.mass
        self.D = self.J @ (self.J / one.mass).T
        self.W = (self.J / one.mass).T
        self.c = self.J @ self.free - self.gamma
        self.mu, self.rubs = np.array(one.mu), one.rubs
        rates = self.J @ v
        self.rates = np.where(
            np.abs(rates) < 1e-9 * (1e-300 + np.abs(v).max(initial=0.0)), 0.0, rates
        )

    def sizes(self, u):
        """Greatest friction: of contacts μ N, of joints by what presses them; with derivatives."""
        n = len(u)
        value, by = np.zeros(self.m + self.p), np.zeros((self.m + self.p, n))
        for k in range(self.m):
            value[k], by[k, self.j + k] = self.mu[k] * u[self.j + k], self.mu[k]
        for k, (kind, _, (a, b), arm, mu) in enumerate(self.rubs, start=self.m):
            x, y = u[a], u[b]
            if kind == "pin":
                whole = math.hypot(x, y)
                value[k] = arm * whole
                by[k, a], by[k, b] = (arm * x / whole, arm * y / whole) if whole else (0.0, 0.0)
            elif kind == "guide" and arm and 2.0 * abs(y) / arm > abs(x):
                value[k], by[k, b] = 2.0 * mu * abs(y) / arm, 2.0 * mu / arm * np.sign(y)
            else:
                value[k], by[k, a] = mu * abs(x), mu * np.sign(x)
        return value, by

    def ways(self):
        """Every set of modes: (normals closed, directions of what rubs, NaN of what is open)."""
        j, m = self.j, self.m
        rates = self.rates[j + m :]
        for closed in itertools.product((True, False), repeat=m):
            options = []
            for k in range(m + self.p):
                if k < m and (not closed[k] or self.mu[k] == 0.0):
                    options.append((np.nan,))
                else:
                    options.append((0.0, 1.0, -1.0) if rates[k] == 0.0 else (np.sign(rates[k]),))
            for slip_signs in itertools.product(*options):
                yield np.array(closed, dtype=bool), np.array(slip_signs)

    def equations(self, closed, slip_signs, u):
        """Residual and its matrix; rows of forces that are none, of what holds, of what slides."""
        n, j, m = len(u), self.j, self.m
        value, by = self.sizes(u)
        A, r = np.zeros((n, n)), np.zeros(n)
        holds = np.concatenate([np.ones(j, dtype=bool), closed, slip_signs == 0.0])
        A[holds], r[holds] = self.D[holds], self.D[holds] @ u + self.c[holds]
        for k in range(n):
            if holds[k]:
                continue
            A[k, k], r[k] = 1.0, u[k]
            if k >= j + m and np.isfinite(slip_sign := slip_signs[k - j - m]):
                # friction against the sliding
                A[k] += slip_sign * by[k - j - m]
                r[k] += slip_sign * value[k - j - m]
        return r, A

    def margins(self, closed, slip_signs, u):
        """Not negative where signs and limits are kept, in parts of the greatest."""
        j, m = self.j, self.m
        a = self.D @ u + self.c
        force = 1e-300 + np.abs(u).max(initial=0.0)
        size = 1e-300 + np.abs(self.c).max(initial=0.0)
        value, _ = self.sizes(u)
        found = [u[j + k] / force if closed[k] else a[j + k] / size for k in range(m)]
        for k, slip_sign in enumerate(slip_signs):
            if slip_sign == 0.0:
                found += [(value[k] + s * u[j + m + k]) / force for s in (1.0, -1.0)]
            elif np.isfinite(slip_sign) and self.rates[j + m + k] == 0.0:
                found.append(slip_sign * a[j + m + k] / size)
        return np.array(found)

    def solutions(self, rng):
        """Accelerations of all solutions, with the least margin of each; sets of dependent rows by
        minimization.
        """
        found = []
        if not len(self.c):  # nothing holds or touches it
            return [(self.free, np.inf)]
        for closed, slip_signs in self.ways():
            for start in range(STARTS if self.rubs else 1):
                u = rng.normal(0.0, 3.0 * 10.0 ** (start % 4), len(self.c)) * (start > 0)
                u, regular = self.newton(closed, slip_signs, u)
                if not regular:
                    u = self.spread(closed, slip_signs, rng, [a for a, _ in found])
                if u is None:
                    continue
                margin = float(self.margins(closed, slip_signs, u).min(initial=np.inf))
                if margin >= -1e-7:
                    found.append((self.free + self.W @ u, margin))
                if not regular:
                    break
        return found

    def newton(self, closed, slip_signs, u):
        """Forces of independent rows, None where it does not converge: what does takes ten steps at
        most. False where the rows depend on each other.
        """
        for _ in range(20):
            r, A = self.equations(closed, slip_signs, u)
            if np.linalg.cond(A) > 1e10:
                return None, False
            step = np.linalg.solve(A, -r)
            u = u + step
            if np.abs(step).max(initial=0.0) <= 1e-12 * (1.0 + np.abs(u).max(initial=0.0)):
                return u, True
        return None, True

    def spread(self, closed, slip_signs, rng, known):
        """Forces of rows that depend on each other, with the greatest least margin; None where
        there are none, or where their accelerations are known.
        """
        u = np.zeros(len(self.c))
        for _ in range(40):
            r, A = self.equations(closed, slip_signs, u)
            step = np.linalg.lstsq(A, -r, rcond=1e-10)[0]
            u = u + step
            if np.abs(step).max() <= 1e-12 * (1.0 + np.abs(u).max()):
                break
        r, A = self.equations(closed, slip_signs, u)
        if np.abs(r).max() > 1e-8 * (1.0 + np.abs(u).max()):
            return None
        _, sizes, vt = np.linalg.svd(A)
        Z = vt[int((sizes > 1e-10 * sizes[0]).sum()) :].T
        if self.margins(closed, slip_signs, u).min(initial=np.inf) >= 0.0:
            return u
        a = self.free + self.W @ u
        near = 1e-7 * (1.0 + np.abs(a).max())
        given = np.abs(self.W @ Z).max(initial=0.0) < 1e-9
        if given and any(np.abs(a - b).max() < near for b in known):
            return None
        best = u
        for _ in range(4):
            y = rng.normal(0.0, np.abs(u).max(), Z.shape[1])
            done = minimize(
                lambda x: -x[-1],
                np.append(y, -1.0),
                method="SLSQP",
                bounds=[(None, None)] * len(y) + [(None, 1.0)],
                constraints={
                    "type": "ineq",
                    "fun": lambda x: self.margins(closed, slip_signs, u + Z @ x[:-1]) - x[-1],
                },
                options={"maxiter": 100},
            )
            new = u + Z @ done.x[:-1]
            r, _ = self.equations(closed, slip_signs, new)
            if np.abs(r).max() > 1e-7 * (1.0 + np.abs(new).max()):
                continue  # friction of what slides depends on what is open
            if (
                self.margins(closed, slip_signs, new).min()
                > self.margins(closed, slip_signs, best).min()
            ):
                best = new
        return best

    def admits(self, a, rng):
        """Whether some forces that fulfil the law give these accelerations."""
        j, m = self.j, self.m
        along = self.J @ a - self.gamma
        size = 1e-300 + np.abs(self.c).max()
        along = np.where(np.abs(along) < 1e-7 * size, 0.0, along)
        closed = along[j : j + m] == 0.0
        slip_signs = np.sign(
            np.where(self.rates[j + m :] == 0.0, along[j + m :], self.rates[j + m :])
        )
        slip_signs[:m] = np.where(closed & (self.mu > 0.0), slip_signs[:m], np.nan)
        none = np.concatenate([np.zeros(j, dtype=bool), ~closed, np.isnan(slip_signs)])
        A = np.vstack([self.W, np.eye(len(self.c))[none]])
        b = np.concatenate([a - self.free, np.zeros(none.sum())])
        u = np.linalg.lstsq(A, b, rcond=1e-10)[0]
        _, sizes, vt = np.linalg.svd(A)
        Z = vt[int((sizes > 1e-10 * sizes[0]).sum()) :].T
        slips = np.concatenate([np.zeros(j + m, dtype=bool), np.nan_to_num(slip_signs) != 0.0])

        def slip(x):
            new = u + Z @ x
            value, _ = self.sizes(new)
            return (new[j + m :] + slip_signs * value)[slips[j + m :]]

        def good(x):
            new = u + Z @ x
            force = 1e-300 + np.abs(new).max()
            kept = self.margins(closed, slip_signs, new).min(initial=0.0) > -1e-6
            return kept and np.abs(slip(x)).max(initial=0.0) < 1e-6 * force

        if np.abs(A @ u - b).max() > 1e-7 * size:
            return False
        for _ in range(6):
            start = rng.normal(0.0, np.abs(u).max(), Z.shape[1])
            laws = [{"type": "ineq", "fun": lambda x: self.margins(closed, slip_signs, u + Z @ x)}]
            if slips.any():
                laws.append({"type": "eq", "fun": slip})
            found = minimize(lambda x: 1e-3 * x @ x, start, method="SLSQP", constraints=laws)
            if good(found.x):
                return True
        return good(np.zeros(Z.shape[1]))


@dataclass
class Comparison:
    """What both say: "", "inconsistent", "indeterminate", and by how much accelerations differ."""

    ours: str
    theirs: str
    difference: float
    margin: float
    modes: dict

    @property
    def agrees(self) -> bool:
        return self.ours == self.theirs and self.difference < 1e-6


def engine(one: Linkage):
    """Verdict, accelerations and modes of the first instant."""
    run = mbody.simulate(one.machine, instants=2)
    names = [event.name for event in run.events]
    bodies = [f"b{k}" for k in range(len(one.q) // 3)]
    a = np.array([getattr(run[b], part)[0] for b in bodies for part in ("ax", "ay", "alpha")])
    verdict = next((n for n in names if n in ("inconsistent", "indeterminate")), "")
    return verdict, a, {name: modes[0] for name, modes in run.modes.items()}


def compare(one: Linkage, rng: np.random.Generator) -> Comparison:
    law, (ours, a, modes) = Coulomb(one), engine(one)
    found: list = []
    for _ in range(1 + AGAIN):
        found += law.solutions(rng)
        size = 1.0 + max((float(np.abs(a).max()) for a, _ in found), default=0.0)
        kinds: list = []
        for b, margin in sorted(found, key=lambda each: -each[1]):
            if all(np.abs(b - other).max() > 1e-6 * size for other, _ in kinds):
                kinds.append((b, margin))
        theirs = "inconsistent" if not kinds else "indeterminate" if len(kinds) > 1 else ""
        if ours == theirs or ours != "indeterminate":
            break
    least = min((np.abs(a - other).max() / size for other, _ in kinds), default=0.0)
    if ours == "inconsistent" or (least > 1e-6 and len(kinds) > 1 and law.admits(a, rng)):
        least = 0.0
    margin = min((m for _, m in kinds), default=0.0)
    return Comparison(ours, theirs, float(least), margin, modes)


@dataclass
class Followed:
    """Instants of one motion: how many, at how many of them some joint or contact rubs or holds,
    by how much accelerations differ at the worst, what happened, and how the motion ended.
    """

    instants: int
    holding: int
    difference: float
    events: Counter
    status: str


def follow(one: Linkage, rng: np.random.Generator, until: float) -> Followed:
    """A motion, whose accelerations at some instants must be among those that the law allows at
    the positions and velocities there.
    """
    one.machine.simulation = replace(one.machine.simulation, until=until, rtol=1e-10)
    run = mbody.simulate(one.machine, times=np.sort(rng.uniform(0.0, until, COMPARED)))
    found = Followed(0, 0, 0.0, Counter(e.name for e in run.events), run.status)
    bodies = [run[f"b{k}"] for k in range(len(one.q) // 3)]

    def whole(k: int, *parts: str) -> np.ndarray:
        return np.array([getattr(body, part)[k] for body in bodies for part in parts])

    rested = False
    for k in range(len(run.t)):
        if min((abs(float(run.t[k] - e.t)) for e in run.events), default=1.0) < 1e-6:
            continue  # at a change of modes rounding decides which of them an instant shows
        q, v = whole(k, "x", "y", "angle"), whole(k, "vx", "vy", "omega")
        a = whole(k, "ax", "ay", "alpha")
        if np.abs(v).max() < AT_REST:
            if rested:
                continue  # as before
            v[:], rested = 0.0, True
        rates = gradient(one.normals, q) @ v if one.normals else np.zeros(0)
        still = 1e-8 * (1e-300 + np.abs(v).max())
        closed = [
            n
            for n, gap in enumerate(one.normals)
            if abs(float(np.real(gap(q.astype(complex))))) < CLOSED and abs(rates[n]) <= still
        ]
        parts = {
            name: [getattr(one, name)[n] for n in closed] for name in ("normals", "tangents", "mu")
        }
        law = Coulomb(replace(one, q=q, v=v, **parts))
        size = 1.0 + float(np.abs(a).max())
        least = min(
            (float(np.abs(a - b).max()) / size for b, _ in law.solutions(rng)), default=np.inf
        )
        if least > 1e-6 and law.admits(a, rng):
            least = 0.0
        found.instants += 1
        found.holding += bool(closed or one.rubs)
        found.difference = max(found.difference, least)
    return found


def follow_many(count: int, first: int, until: float) -> None:
    instants, ends, events, wrong = 0, Counter(), Counter(), []
    for seed in range(first, first + count):
        rng = np.random.default_rng(seed)
        one = linkage(rng)
        try:
            found = follow(one, rng, until)
        except mbody.errors.SolveError as error:
            ends["error"] += 1
            print(f"{seed}: {error}")
            continue
        instants += found.instants
        ends[found.status.partition(":")[0]] += 1
        events.update(found.events)
        if not found.difference < 1e-6:
            wrong.append(seed)
            print(f"{seed}: {found}")
    print(f"{count} motions, {instants} instants: {dict(ends)}, {dict(events)}; differ: {wrong}")


def main(count: int, first: int = 0) -> None:
    kinds, wrong = Counter(), []
    for seed in range(first, first + count):
        rng = np.random.default_rng(seed)
        one = linkage(rng)
        try:
            found = compare(one, rng)
        except mbody.errors.SolveError as error:
            wrong.append(seed)
            print(f"{seed}: {error}")
            continue
        kinds[found.theirs or "one"] += 1
        if not found.agrees:
            wrong.append(seed)
            print(f"{seed}: {found}")
    print(f"{count} linkages: {dict(kinds)}; {len(wrong)} differ: {wrong}")


if __name__ == "__main__":
    if len(sys.argv) > 3:
        follow_many(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
    else:
        main(*map(int, sys.argv[1:]))
