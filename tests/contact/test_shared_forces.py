"""Forces that no equation decides, by linear programs over the laws of contact alone.

Reported is a set that keeps every limit by most; `unique` and `range` are those of all sets. The
programs here know nothing of the package: points, directions, balances of forces and moments.
"""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

import mbody
from mbody import Body, Contact, Force, Gravity, Mechanism, SimulationSettings, Torque

G = 9.81
MOST = 1e3  # A margin of what wedges itself, in loads.


class Held:
    """One body on contacts: places (n, 2), normals (n, 2), coefficients (n,); ropes pull alone."""

    def __init__(self, places, normals, mu, centre, load, torque):
        p, n = np.asarray(places, float) - centre, np.asarray(normals, float)
        t = np.column_stack([n[:, 1], -n[:, 0]])
        columns = np.vstack([n, t])
        arms = np.vstack([p, p])
        moments = arms[:, 0] * columns[:, 1] - arms[:, 1] * columns[:, 0]
        self.size = float(np.hypot(*load)) + abs(torque) / float(np.abs(p).max())
        self.count, self.n, self.t = len(p), n, t
        length = float(np.abs(p).max())
        self.A = np.vstack([columns.T, moments / length])
        self.b = -np.array([*load, torque / length])
        m = len(p)
        self.limits = np.vstack(
            [
                np.hstack([np.eye(m), np.zeros((m, m))]),
                np.hstack([np.diag(mu), np.eye(m)]),
                np.hstack([np.diag(mu), -np.eye(m)]),
            ]
        )

    def program(self, aim, margin=False):
        """The least aim · (N, T) in units of the load; with `margin` the greatest least margin."""
        k = 2 * self.count
        more = np.full((len(self.limits), int(margin)), 1.0)
        A_ub = np.hstack([-self.limits, more])
        A_eq = np.hstack([self.A, np.zeros((3, int(margin)))])
        aim = np.append(np.zeros(k), -1.0) if margin else aim
        bounds = [(None, None)] * k + [(None, MOST)] * int(margin)
        return linprog(aim, A_ub, np.zeros(len(A_ub)), A_eq, self.b / self.size, bounds)

    def ends(self, place, direction):
        """Between what the force at a place along a direction lies."""
        aim = np.zeros(2 * self.count)
        aim[place], aim[self.count + place] = self.n[place] @ direction, self.t[place] @ direction
        found = [self.program(sign * aim) for sign in (1.0, -1.0)]
        ends = [one.fun if one.status == 0 else -np.inf for one in found]
        return self.size * ends[0], -self.size * ends[1]

    def check(self, forces, unique, ranges):
        """Reported forces (n, 2) at the places, `unique` (n, 2), ranges (n, 2, 2)."""
        forces = np.asarray(forces)
        normal, along = (forces * self.n).sum(axis=1), (forces * self.t).sum(axis=1)
        f = np.concatenate([normal, along])
        assert self.A @ f == pytest.approx(self.b, abs=1e-9 * self.size)
        margins = self.limits @ f
        assert margins.min() >= -1e-9 * self.size
        best = self.program(None, margin=True)
        assert best.status == 0 and -best.fun >= -1e-9
        if -best.fun < 0.5:  # what wedges itself could have any
            assert margins.min() >= -best.fun * self.size - 1e-8 * self.size
        for k in range(self.count):
            for m, direction in enumerate(np.eye(2)):
                low, high = self.ends(k, direction)
                wide = high - low > 1e-7 * self.size
                if abs(high - low) < 1e-5 * self.size and wide:
                    continue
                assert unique[k][m] == (not wide)
                assert ranges[k][m] == pytest.approx((low, high), abs=1e-6 * self.size)


def line(angle):
    return {"line": {"point": "O", "angle": angle}}


def on_two_lines(seed, mass=1.0, size=1.0, turn=0.0):
    """A rod or a disc on two rough lines, at rest: mechanism, places, normals, centre."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-0.3, 0.5) + turn, -math.pi / 2 + rng.uniform(-0.4, 0.6) + turn
    mu = rng.uniform(0.4, 1.2, 2)
    force, torque = rng.normal(size=2) * 6.0 * mass, rng.normal() * 0.3 * mass * size
    c, s = math.cos(turn), math.sin(turn)
    force = np.array([c * force[0] - s * force[1], s * force[0] + c * force[1]])
    normals = np.array([(-math.sin(x), math.cos(x)) for x in (a, b)])
    made = Mechanism("two lines", ground={"O": (0, 0)}, ground_shapes={"p": line(a), "q": line(b)})
    if seed % 2:
        r = 0.1 * size
        centre = np.linalg.solve(normals, [r, r])
        shapes = {"s": {"disc": "C", "radius": r}}
        body = Body(
            "d", mass=mass, inertia=0.005 * mass * size**2, points={"C": (0, 0)}, shapes=shapes
        )
        ends, angle, places = ("d.s", "d.s"), 0.0, centre - r * normals
    else:
        L, angle = 0.5 * size, math.pi - rng.uniform(0.3, 1.2) + turn
        along = [np.array([math.cos(x), math.sin(x)]) for x in (a, b)]
        reach = np.array([math.cos(angle), math.sin(angle)]) * L
        first = np.linalg.solve(np.array([-along[0], along[1]]).T, reach)[0] * along[0]
        centre, places = first + reach / 2, np.array([first, first + reach])
        points = {"a": (-L / 2, 0), "b": (L / 2, 0)}
        body = Body("d", mass=mass, inertia=0.02 * mass * size**2, points=points)
        ends = "d.a", "d.b"
    size_of = float(np.hypot(*force))
    made.add(
        body,
        Contact("p", "ground.p", ends[0], friction=float(mu[0])),
        Contact("q", "ground.q", ends[1], friction=float(mu[1])),
        Gravity("g", x=G * s, y=-G * c),
        Force("F", "d", size_of, angle=math.atan2(force[1], force[0])),
        Torque("T", "d", value=float(torque)),
    )
    start = dict(x=centre[0], y=centre[1], angle=angle, vx=0.0, vy=0.0, omega=0.0)
    made.simulation = SimulationSettings(until=1.0, start={"d": start})
    load = force + mass * G * np.array([s, -c])
    return made, Held(places, normals, mu, centre, load, torque)


def rests(held):
    return held.program(None, margin=True).fun <= -1e-6


def moves(run):
    """Whether it was taken to move, as it may as well: several accelerations are consistent."""
    return any(run.mode(name)[-1] not in ("stick", "roll") for name in "pq")


def reported(run, names):
    forces = [(run.reaction(name).fx[-1], run.reaction(name).fy[-1]) for name in names]
    unique = [run.reaction(name).unique for name in names]
    ranges = []
    for name in names:
        found = run.range(name)
        low, high = found.low, found.high
        ranges.append([(low.fx[-1], high.fx[-1]), (low.fy[-1], high.fy[-1])])
    return forces, unique, ranges


@pytest.mark.parametrize("first", range(0, 60, 12))
def test_a_body_that_sticks_on_two_lines(first):
    seen = 0
    for seed in range(first, first + 12):
        made, held = on_two_lines(seed)
        if not rests(held):
            continue
        run = mbody.simulate(made, 0.01, instants=2)
        if moves(run):
            continue
        held.check(*reported(run, "pq"))
        seen += 1
    assert seen >= 2


@pytest.mark.parametrize(("mass", "size"), [(1e-6, 1e-4), (1e6, 1e4), (1e-6, 1e4), (1e6, 1e-4)])
def test_no_size_and_no_mass_changes_what_is_reported(mass, size):
    seen = 0
    for seed in range(8):
        made, held = on_two_lines(seed, mass, size)
        if not rests(held):
            continue
        run = mbody.simulate(made, 0.01 * math.sqrt(size), instants=2)
        if moves(run):
            continue
        held.check(*reported(run, "pq"))
        alike = reported(mbody.simulate(on_two_lines(seed)[0], 0.01, instants=2), "pq")[0]
        found = np.array(reported(run, "pq")[0]) / mass
        assert found == pytest.approx(np.array(alike), abs=1e-8 * held.size / mass)
        seen += 1
    assert seen >= 2


def test_what_is_reported_turns_with_the_scene():
    for seed in (s for s in range(10) if rests(on_two_lines(s)[1])):
        plain = reported(mbody.simulate(on_two_lines(seed)[0], 0.01, instants=2), "pq")[0]
        made, held = on_two_lines(seed, turn=0.7)
        run = mbody.simulate(made, 0.01, instants=2)
        if moves(run):
            continue
        held.check(*reported(run, "pq"))
        c, s = math.cos(0.7), math.sin(0.7)
        turned = np.array(plain) @ np.array([[c, s], [-s, c]])
        assert np.array(reported(run, "pq")[0]) == pytest.approx(turned, abs=1e-8 * held.size)
