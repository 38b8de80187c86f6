"""Forces that no equation decides, by linear programs over the laws of contact alone.

Reported is a set that keeps every limit by most; `unique` and `range` are those of all sets. The
programs here know nothing of the package: points, directions, balances of forces and moments.
"""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

import mbody
from mbody import Body, Contact, Force, Gravity, Mechanism, Rope, SimulationSettings, Torque
from tests.campaign.scene_checks import faults_of
from tests.campaign.scenes import random_scene

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


@pytest.mark.parametrize("first", range(0, 36, 12))
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


# -- Feet of a table that is held, and ropes -----------------------------------------------------


def on_feet(feet, mu, force, cg=0.0, rate=0.0):
    """A table on a floor, its place held or led along it."""
    made = Mechanism("table", ground={"O": (0, 0)}, ground_shapes={"floor": line(0.0)})
    points = {f"f{k}": (x, -1.0) for k, x in enumerate(feet)} | {"c": (0, -1.0)}
    made.add(
        Body("top", mass=10.0, inertia=2.0, cg=(cg, 0.0), points=points, guess=(0.0, 1.0, 0.0)),
        Gravity("g", y=-G),
        Force("F", "top", force, angle=0.0),
        *(Contact(f"p{k}", "ground.floor", f"top.f{k}", friction=mu) for k in range(len(feet))),
        mbody.CoordinateDriver("pull", "ground.O", "top.c", f"{rate} m/s*t"),
    )
    return made


def feet_program(feet, mu, force, cg, k):
    """Between what N of foot k, its friction and the effort lie."""
    n = len(feet)
    A = np.zeros((3, 2 * n + 1))
    A[0, n:], A[1, :n], A[2, :n], A[2, n:] = 1.0, 1.0, np.array(feet) - cg, 1.0
    cone = [
        s * np.eye(2 * n + 1)[n + j] - mu * np.eye(2 * n + 1)[j] for j in range(n) for s in (1, -1)
    ]
    bounds = [(0, None)] * n + [(None, None)] * (n + 1)
    aim = np.eye(2 * n + 1)[k]
    every = [
        linprog(s * aim, cone, np.zeros(len(cone)), A, [-force, 98.1, 0.0], bounds) for s in (1, -1)
    ]
    return every[0].fun, -every[1].fun


@pytest.mark.parametrize(
    ("feet", "mu", "force", "cg"),
    [
        ((-1.0, 0.0, 1.0), 0.3, 50.0, 0.0),
        ((-1.0, -0.5, 0.5, 1.0), 0.2, -30.0, 0.2),
        ((-2.0, 0.1, 1.0), 0.0, 10.0, -0.4),
    ],
)
def test_feet_of_a_table_that_is_held(feet, mu, force, cg):
    run, n = mbody.statics(on_feet(feet, mu, force, cg)), len(feet)
    press = np.array([float(run.contact(f"p{k}")[0]) for k in range(n)])
    assert run.status == "completed" and press.min() > 0.0 and press.sum() == pytest.approx(98.1)
    best = linprog(
        np.append(np.zeros(n), -1.0),
        np.hstack([-np.eye(n), np.ones((n, 1))]),
        np.zeros(n),
        np.hstack([[np.ones(n), np.array(feet) - cg], np.zeros((2, 1))]),
        [98.1, force],
        [(None, None)] * (n + 1),
    )
    assert press.min() == pytest.approx(-best.fun, rel=1e-9)
    for k in range(n):
        found, unique = run.range(f"p{k}"), run.reaction(f"p{k}").unique
        for key, place in (("fy", k), ("fx", n + k)):
            low, high = feet_program(feet, mu, force, cg, place)
            ends = getattr(found.low, key)[0], getattr(found.high, key)[0]
            assert ends == pytest.approx((low, high), abs=1e-7)
            assert unique[("fx", "fy").index(key)] == (high - low < 1e-7)
    low, high = feet_program(feet, mu, force, cg, 2 * n)
    found = run.range("pull")
    assert (found.low[0], found.high[0]) == pytest.approx((low, high), abs=1e-7)
    assert run.unique_effort("pull") == (mu == 0.0)


def test_feet_that_slide_share_their_load():
    run = mbody.kinetostatics(on_feet((-1.0, 0.0, 1.0), 0.3, 50.0, 0.1, rate=0.1), t=[0.0, 1.0])
    for k in range(3):
        own = run.reaction(f"p{k}")
        assert own.fx == pytest.approx(-0.3 * own.fy, abs=1e-9) and not own.unique[0]
    assert run.effort("pull") == pytest.approx(0.3 * 98.1 - 50.0) and run.unique_effort("pull")


def sliding_feet(mu, push, rate, feet=(-0.5, 0.5)):
    """A body of 1 kg and its weight of 10 N, 0.5 m above its feet, each with its own friction."""
    made = Mechanism("body", ground={"O": (0, 0)}, ground_shapes={"floor": line(0.0)})
    points = {f"f{k}": (x, -0.5) for k, x in enumerate(feet)}
    made.add(Body("b", mass=1.0, inertia=0.2, points=points), Gravity("g", y=-10.0))
    made.add(Force("F", "b", push, angle=0.0))
    for k, one in enumerate(mu):
        made.add(Contact(f"p{k}", "ground.floor", f"b.f{k}", friction=one))
    start = {"b": {"x": 0.0, "y": 0.5, "angle": 0.0, "vx": rate, "vy": 0.0, "omega": 0.0}}
    made.simulation = mbody.SimulationSettings(0.05, start=start)
    return mbody.simulate(made, 0.05, instants=3)


@pytest.mark.parametrize(
    ("mu", "push", "rate", "mode", "press"),
    [
        ((0.2, 0.6), 0.0, 1.0, "slip+", 7.5),  # N₂ − N₁ = μ₁ N₁ + μ₂ N₂, N₁ + N₂ = 10
        ((0.6, 0.2), 4.5, 0.0, "slip+", 20.0 / 3.0),
        ((0.2, 0.6), 4.5, 0.0, "stick", 7.25),  # N₂ − N₁ = 4.5
    ],
)
def test_feet_of_different_friction(mu, push, rate, mode, press):
    """The same edge, but what sticks longer carries more: forces are unique where they slide."""
    run = sliding_feet(mu, push, rate)
    friction = mu[0] * (10.0 - press) + mu[1] * press
    expected = push - friction if mode != "stick" else 0.0
    assert run.status == "completed" and not run.events
    assert run["b"].ax == pytest.approx(expected, abs=1e-9)
    assert run["b"].alpha == pytest.approx(0.0, abs=1e-9)
    for k, force in enumerate((10.0 - press, press)):
        own = run.reaction(f"p{k}")
        assert set(run.mode(f"p{k}")) == {mode}
        assert own.fy == pytest.approx(force) and own.unique[:2] == (mode != "stick", True)


def test_no_share_keeps_a_table_that_tips():
    run = mbody.statics(on_feet((-1.0, 0.0, 1.0), 0.3, 0.0, cg=1.5))
    (doubt,) = run.doubts
    assert doubt.kind == "inadmissible" and run.status.startswith("doubtful: no forces were found")
    assert set(doubt.elements) <= {"p0", "p1", "p2"} and doubt.t == 0.0


def test_four_ropes_that_hold_a_bar():
    """Of parallel ropes at rest none pushes; two more than needed."""
    ends = {f"P{k}": (0.5 * k - 0.75, 0.0) for k in range(4)}
    made = Mechanism("ropes", ground={f"O{k}": (0.5 * k, 0.0) for k in range(4)})
    made.add(
        Body("bar", mass=4.0, inertia=1.0, points=ends),
        Gravity("g", y=-G),
        *(Rope(f"r{k}", f"ground.O{k}", f"bar.P{k}", 2.0) for k in range(4)),
    )
    start = dict(x=0.75, y=-2.0, angle=0.0, vx=0.0, vy=0.0, omega=0.0)
    made.simulation = SimulationSettings(until=0.1, start={"bar": start})
    run = mbody.simulate(made, instants=2)
    assert [run.contact(f"r{k}")[-1] for k in range(4)] == pytest.approx([G] * 4)
    low, high = run.range("r0").low.fy[-1], run.range("r0").high.fy[-1]
    assert (low, high) == pytest.approx((0.0, 2.0 * G), abs=1e-8)
    assert not run.reaction("r0").unique[1] and any("not unique" in note for note in run.notes)


# -- Pins with friction at rest ------------------------------------------------------------------


def four_bar(seed, mass=1.0, size=1.0):
    """A four-bar whose pins are rough: mechanism, ρ of every pin."""
    rng = np.random.default_rng(seed)
    while True:
        a, b, c, d = rng.uniform(0.15, 0.7, 4)
        turn = rng.uniform(0.3, 2.8)
        far = math.hypot(d - a * math.cos(turn), a * math.sin(turn))
        if abs(b - c) + 0.05 < far < b + c - 0.05:
            break
    mu, radius = rng.uniform(0.3, 0.9, 4), rng.uniform(0.02, 0.05, 4) * size
    a, b, c, d = (x * size for x in (a, b, c, d))
    made = Mechanism("four-bar", ground={"O": (0, 0), "C": (d, 0)})
    ends = {"O": "ground.O crank.O", "A": "crank.A coupler.A"}
    ends |= {"B": "coupler.B rocker.B", "C": "ground.C rocker.C"}
    made.add(
        *(
            Body(
                name,
                mass=mass,
                inertia=0.02 * mass * size**2,
                cg=(x / 2, 0),
                points={first: (0, 0), last: (x, 0)},
                guess=guess,
            )
            for name, x, first, last, guess in (
                ("crank", a, "O", "A", turn),
                ("coupler", b, "A", "B", 0.3),
                ("rocker", c, "C", "B", 1.8),
            )
        ),
        Gravity("g", y=-G),
        *(
            mbody.Revolute(name, *pair.split(), friction=float(m), pin_radius=float(r))
            for (name, pair), m, r in zip(ends.items(), mu, radius, strict=True)
        ),
    )
    made.simulation = SimulationSettings(until=1.0)
    return made, radius * mu / np.sqrt(1.0 + mu * mu)


@pytest.mark.parametrize(("mass", "size"), [(1.0, 1.0), (1e-6, 1e-4), (1e6, 1e4)])
def test_pins_at_rest_keep_their_friction(mass, size):
    seen = 0
    for seed in (2, 10, 15, 26, 33):
        made, rho = four_bar(seed, mass, size)
        run = mbody.simulate(made, 1.5 * math.sqrt(size), instants=4)
        pins = [run.reaction(name) for name in "OABC"]
        weight = mass * G
        for k in range(len(run)):
            for name, pin, most in zip("OABC", pins, rho, strict=True):
                limit = most * math.hypot(pin.fx[k], pin.fy[k])
                if run.mode(name)[k] == "stick":
                    assert abs(pin.torque[k]) <= limit + 1e-9 * weight * size
                else:
                    assert abs(pin.torque[k]) == pytest.approx(limit, abs=1e-8 * weight * size)
        assert run.checks.equilibrium < 1e-9
        if all(run.mode(name)[-1] == "stick" for name in "OABC"):
            assert all(pin.unique == (False, False, False) for pin in pins)
            found = run.range("O")
            assert found.low.torque[-1] <= pins[0].torque[-1] <= found.high.torque[-1]
            assert max(abs(found.low.torque[-1]), abs(found.high.torque[-1])) > abs(
                pins[0].torque[-1]
            )
            seen += 1
    assert seen


def test_steps_read_what_is_reported():
    made, held = next(pair for pair in map(on_two_lines, range(10)) if rests(pair[1]))
    run = mbody.simulate(made, 0.02, instants=2)
    sim = mbody.Simulator(made)
    sim.step(0.02)
    for name in "pq":
        now, whole = sim.reaction(name), run.reaction(name)
        assert (now.fx, now.fy) == pytest.approx((whole.fx[-1], whole.fy[-1]), abs=1e-9 * held.size)
        assert now.unique == whole.unique
        assert sim.measure(f"{name}.contact") == pytest.approx(run.contact(name)[-1])


def test_a_file_keeps_what_is_not_unique(tmp_path):
    made, _ = next(pair for pair in map(on_two_lines, range(10)) if rests(pair[1]))
    run = mbody.simulate(made, 0.01, instants=2)
    mbody.save_run(run, tmp_path / "run.npz")
    again = mbody.load_run(tmp_path / "run.npz")
    assert again.reaction("p").unique == run.reaction("p").unique
    assert np.isnan(again.range("p").low.fx).all()
    ranges = run.data()["ranges"]["reactions"]["p"]
    assert ranges["low"][-1][0] == run.range("p").low.fx[-1]


@pytest.mark.parametrize(("mass", "size"), [(3.0, 1.0), (2e-4, 3e3)])
def test_a_guide_that_sticks_beside_its_limit(mass, size):
    """It slides to its stop and sticks there: N − T = F, |T| ≤ μ m g."""
    mu, push = 0.4, 0.3 * mass * G
    machine = Mechanism("slider", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("slider", mass=mass, inertia=mass * size**2, points={"C": (0.0, 0.0)}),
        mbody.Prismatic("guide", "ground.O", "slider.C", friction=mu, limits=(0.0, size)),
        Force("push", "slider.C", push),
        Gravity("gravity", y=-G),
    )
    start = {"slider": {"x": 0.9 * size, "vx": math.sqrt(size)}}
    machine.simulation = SimulationSettings(0.5 * math.sqrt(size), start, rtol=1e-9)
    run = mbody.simulate(machine)
    assert run["slider"].vx[-1] == 0.0 and run.mode("guide")[-1] == "stick"
    assert not run.doubts
    stop = run.contact("guide_high")[-1]
    assert 0.0 <= stop <= push + mu * mass * G


def test_a_ladder_at_the_edge_of_its_static_limits_rests():
    """No motion begins: both ends keep their cones, though sliding would have less friction."""
    scene = random_scene(1136)
    run = mbody.simulate(scene.mechanism("ladder"), scene.until, rtol=scene.rtol, instants=3)
    assert {run.mode(name)[-1] for name in ("floor a P1", "wall a P0")} == {"stick"}
    assert not faults_of(scene, run)


@pytest.mark.parametrize("until", [0.2, 0.25, 1.0])
def test_feet_without_a_force_of_their_own_slide_until_all_stop(until):
    """Of three feet no equation decides all forces: v₀ − μ g t, whatever step an instant is in."""
    v, mu = 1.0, 0.4
    places = {"left": (-0.5, 0.0), "middle": (0.1, 0.0), "right": (0.5, 0.0)}
    machine = Mechanism("table", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": line(0.0)})
    machine.add(
        Body("top", mass=2.0, inertia=0.1, points=places),
        *(Contact(name, "ground.floor", f"top.{name}", friction=mu) for name in places),
        Gravity("gravity", y=-G),
    )
    start = {"top": dict(x=0.0, y=0.0, angle=0.0, vx=v, vy=0.0, omega=0.0)}
    machine.simulation = SimulationSettings(until, start, instants=14)
    run = mbody.simulate(machine)
    assert run["top"].vx == pytest.approx(np.maximum(v - mu * G * run.t, 0.0), abs=1e-9)
    words = np.where(run.t < v / (mu * G), "slip", "stick")
    for name in places:
        assert [word[:5].rstrip("+-") for word in run.mode(name)] == words.tolist()


# -- Many designs, and what is not examined ------------------------------------------------------


def test_a_joint_that_rests_in_one_design_alone():
    made, _ = four_bar(2)
    made.add(mbody.AngleDriver("motor", "crank", 2.0))
    off = {f"{name}.friction": 0.0 for name in "OABC"}
    system = mbody.assemble(made).with_values(off)
    smooth = mbody.statics(system)
    assert smooth.reaction("A").unique == (True, True, True) and smooth.unique_effort("motor")
    several = mbody.statics(system.with_values({"A.friction": [0.0, 0.0, 0.4, 0.0]}))
    alone = mbody.statics(system.with_values({"A.friction": 0.4}))
    assert several.reaction("A").unique == alone.reaction("A").unique == (False, False, False)
    assert not several.unique_effort("motor")


def test_steps_with_impulses_say_that_nothing_was_examined():
    made = on_two_lines(0)[0]
    run = mbody.simulate(made, 0.01, method="moreau", step=1e-3)
    assert run.reaction("p").unique is None
    assert any(note.startswith("whether forces are unique") for note in run.notes)
    free = mbody.Mechanism("free")
    free.add(Body("b", mass=1.0, inertia=1.0, points={"P": (0, 0)}), Gravity("g", y=-G))
    free.simulation = SimulationSettings(until=0.1)
    run = mbody.simulate(free, method="moreau", step=1e-2)
    assert not any(note.startswith("whether forces are unique") for note in run.notes)


def test_many_simulators_say_what_is_unique():
    made, _ = four_bar(15)
    made.simulation = SimulationSettings(until=1.0)
    many = mbody.Simulators(mbody.assemble(made), 2)
    assert many.reaction("O").unique == mbody.Simulator(made).reaction("O").unique
    many.until(1.5)
    one = mbody.Simulator(made)
    one.until(1.5)
    assert many.reaction("O").unique == one.reaction("O").unique == (False, False, False)
    smooth = mbody.Simulators(mbody.gallery.load("double_pendulum"), 2)
    joint = smooth.system.mechanism.joints[0].name
    assert smooth.reaction(joint).unique == (True, True, True)
