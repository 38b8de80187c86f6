"""Random linkages with rough joints and closed contacts, and what Coulomb's law says of them by
trying all 3ᵐ modes with dense equations: own formulas, nothing of the engine.

    python -m tests.coulomb_enumeration 1000

compares so many of them with the first instant of a motion.
"""

from __future__ import annotations

import itertools
import math
import sys
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

import mbody
from mbody import (
    Body,
    Contact,
    Force,
    Gravity,
    Mechanism,
    PinSlot,
    Prismatic,
    Revolute,
    SimulationSettings,
)

G = 9.81
STEP = 1e-30


@dataclass
class Linkage:
    """A mechanism at one state, with its own equations.

    `rows`: constraints, functions of q; `normals`, `tangents`: of contacts; `rubs`: of joints the
    kind, its row of sliding, the numbers of the rows that press it, the arm and μ.
    """

    machine: Mechanism
    mass: np.ndarray
    load: np.ndarray
    q: np.ndarray
    v: np.ndarray
    rows: list = field(default_factory=list)
    normals: list = field(default_factory=list)
    tangents: list = field(default_factory=list)
    mu: list = field(default_factory=list)
    rubs: list = field(default_factory=list)


def place(q, body, point):
    """A point of a body; body −1 is the ground."""
    x, y = point
    if body < 0:
        return np.array([x, y], dtype=complex)
    a, b, t = q[3 * body : 3 * body + 3]
    return np.array([a + np.cos(t) * x - np.sin(t) * y, b + np.sin(t) * x + np.cos(t) * y])


def angle(q, body):
    return q[3 * body + 2] if body >= 0 else 0.0


def gradient(functions, q):
    found = np.zeros((len(functions), len(q)))
    for k in range(len(q)):
        z = q.astype(complex)
        z[k] += 1j * STEP
        found[:, k] = [np.imag(f(z)) / STEP for f in functions]
    return found


def curvature(functions, q, v):
    """−J̇ v of the functions, by differences of their directional derivatives of second order."""
    if not functions:
        return np.zeros(0)
    h = 1e-4

    def along(s):
        z = (q + s * v).astype(complex) + 1j * STEP * v
        return np.array([np.imag(f(z)) / STEP for f in functions])

    # of order 6
    parts = [(along(k * h) - along(-k * h)) * c for k, c in ((1, 45.0), (2, -9.0), (3, 1.0))]
    return -sum(parts) / (60.0 * h)


def linkage(rng: np.random.Generator, *, most_contacts=2, greatest=0.9) -> Linkage:
    """A chain of one to three links from the ground or free, pinned or sliding, with points that
    lie on the floor or on walls, at a random state in which some of it rests exactly.
    """
    count = int(rng.integers(1, 4))
    free = bool(rng.random() < 0.25)
    loop = not free and count > 1 and rng.random() < 0.4
    contacts = int(rng.integers(1 if free else 0, most_contacts + 1))
    q, points = np.zeros(3 * count), [dict() for _ in range(count)]
    ground, shapes, joints = {}, {}, []
    rows, rubs = [], []
    here, before = rng.uniform(-0.2, 0.2, 2), -1
    mass = np.repeat(rng.uniform(0.5, 2.0, count), 3)
    for b in range(count):
        t = rng.uniform(-math.pi, math.pi)
        length = rng.uniform(0.3, 1.0)
        mass[3 * b + 2] = mass[3 * b] * length**2 * rng.uniform(0.03, 0.3)
        c, s = math.cos(t), math.sin(t)
        at = np.array([-0.5 * length, rng.uniform(-0.1, 0.1)])
        q[3 * b : 3 * b + 2] = here - [c * at[0] - s * at[1], s * at[0] + c * at[1]]
        q[3 * b + 2] = t
        points[b]["A"], points[b]["B"] = tuple(at), (0.5 * length, 0.0)
        names = ("ground.P0" if before < 0 else f"b{before}.B", f"b{b}.A")
        mu = float(rng.uniform(0.0, greatest)) if rng.random() < 0.8 else None
        first = len(rows)
        last = tuple(here) if before < 0 else points[before]["B"]
        if before < 0:
            ground["P0"] = tuple(here)
        if before < 0 and free:
            pass
        elif rng.random() < 0.7:
            arm = float(rng.uniform(0.02, 0.2))
            more = {} if mu is None else {"friction": mu, "pin_radius": arm}
            joints.append(Revolute(f"j{b}", *names, **more))
            for k in range(2):
                rows.append(
                    lambda z, k=k, i=before, j=b, p=last, r=tuple(at): (
                        place(z, j, r)[k] - place(z, i, p)[k]
                    )
                )
            if mu:

                def turn(z, i=before, j=b):
                    return angle(z, j) - angle(z, i)

                rho = mu * arm / math.sqrt(1.0 + mu * mu)
                rubs.append(("pin", turn, (first, first + 1), rho, mu))
        else:
            span = None if rng.random() < 0.5 else float(rng.uniform(0.2, 1.0))
            more = {} if mu is None else {"friction": mu, "length": span}
            # the direction of the guide on the link before, at which the angle is what it is
            base = angle(q, before)
            joints.append(
                Prismatic(
                    f"j{b}",
                    mbody.Marker(names[0].split(".")[0], names[0].split(".")[1], float(t - base)),
                    mbody.Marker(f"b{b}", "A", 0.0),
                    **more,
                )
            )
            for k in range(2):

                def across(z, k=k, i=before, j=b, p=last, r=tuple(at), d=float(t - base)):
                    way = place(z, j, r) - place(z, i, p)
                    u = angle(z, i) + d
                    if k == 2:
                        return way[0] * np.cos(u) + way[1] * np.sin(u)
                    if k == 0:
                        return -way[0] * np.sin(u) + way[1] * np.cos(u)
                    return angle(z, j) - u

                rows.append(across)
            if mu:
                rubs.append(("guide", lambda z, f=across: f(z, k=2), (first, first + 1), span, mu))
        before, here = b, place(q, b, points[b]["B"]).real
    if loop:
        # the end of the chain in a slot of the ground
        u = float(rng.uniform(-math.pi, math.pi))
        ground["S"], mu = tuple(here), float(rng.uniform(0.05, greatest))
        slot = PinSlot("slot", mbody.Marker("ground", "S", u), f"b{count - 1}.B", friction=mu)
        joints.append(slot)

        def way(z, normal, j=count - 1, p=tuple(here), r=points[count - 1]["B"], u=u):
            d = place(z, j, r) - np.array(p)
            return (
                d[1] * np.cos(u) - d[0] * np.sin(u)
                if normal
                else d[0] * np.cos(u) + d[1] * np.sin(u)
            )

        rubs.append(("slot", lambda z: way(z, False), (len(rows), len(rows)), 0.0, mu))
        rows.append(lambda z: way(z, True))
    normals, tangents, mus, touching = [], [], [], []
    for k in range(contacts):
        b = int(rng.integers(0, count))
        at = tuple(rng.uniform(-0.5, 0.5, 2))
        points[b][f"C{k}"] = at
        spot = place(q, b, at).real
        # the floor, mostly below
        u = float(rng.normal(0.0, 0.5)) if rng.random() < 0.7 else float(rng.uniform(-3.0, 3.0))
        ground[f"F{k}"], shapes[f"f{k}"] = tuple(spot), {"line": {"point": f"F{k}", "angle": u}}
        mu = float(rng.uniform(0.0, greatest)) if rng.random() < 0.9 else 0.0
        touching.append(Contact(f"c{k}", f"ground.f{k}", f"b{b}.C{k}", friction=mu))
        mus.append(mu)

        def gap(z, across, b=b, at=at, spot=tuple(spot), u=u):
            d = place(z, b, at) - np.array(spot)
            return (
                d[1] * math.cos(u) - d[0] * math.sin(u)
                if across
                else d[0] * math.cos(u) + d[1] * math.sin(u)
            )

        normals.append(lambda z, f=gap: f(z, True))
        tangents.append(lambda z, f=gap: f(z, False))
    load = np.zeros(3 * count)
    load[1::3] = -mass[::3] * G
    push = rng.normal(0.0, 8.0, 2)
    load[-3:-1] += push
    # a random motion that keeps what is closed, and rests along some of it
    everything = [*tangents, *(one[1] for one in rubs)]
    resting = [f for f in everything if rng.random() < 0.6]
    holds = gradient([*rows, *normals, *resting], q)
    v = rng.normal(0.0, 1.0, 3 * count)
    for _ in range(2):
        v = v - np.linalg.pinv(holds, rcond=1e-9) @ (holds @ v) if len(holds) else v
    if np.abs(v).max() < 1e-10:
        v[:] = 0.0
    machine = Mechanism("linkage", ground=ground, ground_shapes=shapes)
    start = {}
    for b in range(count):
        x, y, t = (float(part) for part in q[3 * b : 3 * b + 3])
        name = f"b{b}"
        machine.add(
            Body(
                name,
                mass=float(mass[3 * b]),
                inertia=float(mass[3 * b + 2]),
                points={p: tuple(map(float, r)) for p, r in points[b].items()},
            )
        )
        vx, vy, w = (float(part) for part in v[3 * b : 3 * b + 3])
        start[name] = {"x": x, "y": y, "angle": t, "vx": vx, "vy": vy, "omega": w}
    machine.add(*joints, *touching, Gravity("gravity", y=-G))
    size, heading = math.hypot(*push), math.atan2(push[1], push[0])
    machine.add(Force("push", f"b{count - 1}", size, angle=heading))
    machine.simulation = SimulationSettings(until=1e-7, rtol=1e-9, start=start)
    return Linkage(machine, mass, load, q, v, rows, normals, tangents, mus, rubs)


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
        """Every set of modes: (normals closed, senses of what rubs, NaN of what is open)."""
        j, m = self.j, self.m
        rates = self.rates[j + m :]
        for closed in itertools.product((True, False), repeat=m):
            options = []
            for k in range(m + self.p):
                if k < m and (not closed[k] or self.mu[k] == 0.0):
                    options.append((np.nan,))
                else:
                    options.append((0.0, 1.0, -1.0) if rates[k] == 0.0 else (np.sign(rates[k]),))
            for senses in itertools.product(*options):
                yield np.array(closed, dtype=bool), np.array(senses)

    def equations(self, closed, senses, u):
        """Residual and its matrix; rows of forces that are none, of what holds, of what slides."""
        n, j, m = len(u), self.j, self.m
        value, by = self.sizes(u)
        A, r = np.zeros((n, n)), np.zeros(n)
        holds = np.concatenate([np.ones(j, dtype=bool), closed, senses == 0.0])
        A[holds], r[holds] = self.D[holds], self.D[holds] @ u + self.c[holds]
        for k in range(n):
            if holds[k]:
                continue
            A[k, k], r[k] = 1.0, u[k]
            if k >= j + m and np.isfinite(sense := senses[k - j - m]):
                # friction against the sliding
                A[k] += sense * by[k - j - m]
                r[k] += sense * value[k - j - m]
        return r, A

    def margins(self, closed, senses, u):
        """Not negative where signs and limits are kept, in parts of the greatest."""
        j, m = self.j, self.m
        a = self.D @ u + self.c
        force = 1e-300 + np.abs(u).max(initial=0.0)
        size = 1e-300 + np.abs(self.c).max(initial=0.0)
        value, _ = self.sizes(u)
        found = [u[j + k] / force if closed[k] else a[j + k] / size for k in range(m)]
        for k, sense in enumerate(senses):
            if sense == 0.0:
                found += [(value[k] + s * u[j + m + k]) / force for s in (1.0, -1.0)]
            elif np.isfinite(sense) and self.rates[j + m + k] == 0.0:
                found.append(sense * a[j + m + k] / size)
        return np.array(found)

    def solutions(self, rng):
        """Accelerations of all solutions, with the least margin of each; sets of dependent rows by
        minimization.
        """
        found = []
        for closed, senses in self.ways():
            for start in range(2 if any(one[0] == "pin" for one in self.rubs) else 1):
                u = np.zeros(len(self.c)) if not start else rng.normal(0.0, 30.0, len(self.c))
                u, regular = self.newton(closed, senses, u)
                if not regular:
                    u = self.spread(closed, senses, rng, [a for a, _ in found])
                if u is None:
                    continue
                margin = float(self.margins(closed, senses, u).min(initial=np.inf))
                if margin >= -1e-7:
                    found.append((self.free + self.W @ u, margin))
                if not regular:
                    break
        return found

    def newton(self, closed, senses, u):
        for _ in range(40):
            r, A = self.equations(closed, senses, u)
            if np.linalg.cond(A) > 1e10:
                return None, False
            step = np.linalg.solve(A, -r)
            u = u + step
            if np.abs(step).max(initial=0.0) <= 1e-12 * (1.0 + np.abs(u).max(initial=0.0)):
                return u, True
        return None, True

    def spread(self, closed, senses, rng, known):
        """Forces of rows that depend on each other, with the greatest least margin; None where
        there are none, or where their accelerations are known.
        """
        u = np.zeros(len(self.c))
        for _ in range(40):
            r, A = self.equations(closed, senses, u)
            step = np.linalg.lstsq(A, -r, rcond=1e-10)[0]
            u = u + step
            if np.abs(step).max() <= 1e-12 * (1.0 + np.abs(u).max()):
                break
        r, A = self.equations(closed, senses, u)
        if np.abs(r).max() > 1e-8 * (1.0 + np.abs(u).max()):
            return None
        _, sizes, vt = np.linalg.svd(A)
        Z = vt[int((sizes > 1e-10 * sizes[0]).sum()) :].T
        if self.margins(closed, senses, u).min(initial=np.inf) >= 0.0:
            return u
        a = self.free + self.W @ u
        near = 1e-7 * (1.0 + np.abs(a).max())
        if np.abs(self.W @ Z).max() < 1e-9 and any(np.abs(a - b).max() < near for b in known):
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
                    "fun": lambda x: self.margins(closed, senses, u + Z @ x[:-1]) - x[-1],
                },
                options={"maxiter": 100},
            )
            new = u + Z @ done.x[:-1]
            r, _ = self.equations(closed, senses, new)
            if np.abs(r).max() > 1e-7 * (1.0 + np.abs(new).max()):
                continue  # friction of what slides depends on what is open
            if self.margins(closed, senses, new).min() > self.margins(closed, senses, best).min():
                best = new
        return best

    def admits(self, a, rng):
        """Whether some forces that fulfil the law give these accelerations."""
        j, m = self.j, self.m
        along = self.J @ a - self.gamma
        size = 1e-300 + np.abs(self.c).max()
        along = np.where(np.abs(along) < 1e-7 * size, 0.0, along)
        closed = along[j : j + m] == 0.0
        senses = np.sign(np.where(self.rates[j + m :] == 0.0, along[j + m :], self.rates[j + m :]))
        senses[:m] = np.where(closed & (self.mu > 0.0), senses[:m], np.nan)
        none = np.concatenate([np.zeros(j, dtype=bool), ~closed, np.isnan(senses)])
        A = np.vstack([self.W, np.eye(len(self.c))[none]])
        b = np.concatenate([a - self.free, np.zeros(none.sum())])
        u = np.linalg.lstsq(A, b, rcond=1e-10)[0]
        _, sizes, vt = np.linalg.svd(A)
        Z = vt[int((sizes > 1e-10 * sizes[0]).sum()) :].T
        slips = np.concatenate([np.zeros(j + m, dtype=bool), np.nan_to_num(senses) != 0.0])

        def slip(x):
            new = u + Z @ x
            value, _ = self.sizes(new)
            return (new[j + m :] + senses * value)[slips[j + m :]]

        def good(x):
            new = u + Z @ x
            force = 1e-300 + np.abs(new).max()
            kept = self.margins(closed, senses, new).min(initial=0.0) > -1e-6
            return kept and np.abs(slip(x)).max(initial=0.0) < 1e-6 * force

        if np.abs(A @ u - b).max() > 1e-7 * size:
            return False
        for _ in range(6):
            start = rng.normal(0.0, np.abs(u).max(), Z.shape[1])
            laws = [{"type": "ineq", "fun": lambda x: self.margins(closed, senses, u + Z @ x)}]
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
    law = Coulomb(one)
    found = law.solutions(rng)
    size = 1.0 + max((float(np.abs(a).max()) for a, _ in found), default=0.0)
    kinds = []
    for a, margin in sorted(found, key=lambda each: -each[1]):
        if all(np.abs(a - other).max() > 1e-6 * size for other, _ in kinds):
            kinds.append((a, margin))
    theirs = "inconsistent" if not kinds else "indeterminate" if len(kinds) > 1 else ""
    ours, a, modes = engine(one)
    least = min((np.abs(a - other).max() / size for other, _ in kinds), default=0.0)
    if ours == "inconsistent" or (least > 1e-6 and len(kinds) > 1 and law.admits(a, rng)):
        least = 0.0
    margin = min((m for _, m in kinds), default=0.0)
    return Comparison(ours, theirs, float(least), margin, modes)


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
    main(*map(int, sys.argv[1:]))
