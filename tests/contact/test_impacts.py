"""Stops and limits of joints: impact, rest and lift, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.files.saved import load_run, save_run
from tests.contact.test_decision_kernels import every_solution
from tests.support.falling import ball, blocks

G = 9.81
KEYS = ("vx", "vy", "omega")


@pytest.mark.parametrize("mu", [0.0, 0.3, 0.7])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rod_on_a_pin_strikes_a_floor_with_friction(mu, side):
    """Its end slides until it stops: N = J |ω|/(x + μ y) by both arms about the pin; then e N
    throws it back against as much: ω⁺ = −e ω (x − μ y)/(x + μ y), none where friction wedges.
    """
    length, inertia, e, drop = 0.8, 0.3, 0.6, 0.5
    rod = mbody.Body("rod", mass=1.0, inertia=inertia, points={"P": (0.0, 0.0), "Q": (length, 0.0)})
    shapes = {"floor": {"line": {"point": "O", "angle": 0.0}}}
    machine = mbody.Mechanism("rod", ground={"O": (0.0, -drop)}, ground_shapes=shapes)
    machine.add(
        rod,
        mbody.Revolute("pin", "ground", "rod.P"),
        mbody.Contact("touch", "ground.floor", "rod.Q", friction=mu, restitution=e),
    )
    x, angle = math.sqrt(length**2 - drop**2), -math.asin(drop / length)
    at = angle + 0.3 if side > 0.0 else math.pi - angle - 0.3
    start = {"rod": {"angle": at, "omega": -side * 0.9}}
    machine.simulation = mbody.SimulationSettings(0.5, start)
    run = mbody.simulate(machine, 0.5)
    (hit,) = (one for one in run.events if one.name == "impact")
    before, after = hit.state["rod"].omega[0], hit.after["rod"].omega[0]
    back = e * max(x - mu * drop, 0.0) / (x + mu * drop)
    assert after == pytest.approx(-back * before, rel=1e-9)
    N, T = hit.impulse("touch")
    assert x * N + side * drop * T == pytest.approx(inertia * abs(before - after), rel=1e-9)


def test_a_double_pendulum_strikes_its_elbow():
    """In its two angles: H(θ) Δω = Jᵀ p, J Δω = −(1 + e) J ω; the joints' impulses drop out."""
    machine = mbody.Mechanism("arm")
    a, b, m1, m2, i1, i2 = 0.7, 0.4, 2.0, 1.5, 0.2, 0.1
    machine.add(
        mbody.Body("upper", mass=m1, inertia=i1, cg=(0.3, 0.0), points={"E": (a, 0.0)}, guess=0.1),
        mbody.Body("lower", mass=m2, inertia=i2, cg=(b, 0.0), guess=(0.7, 0.0, 0.8)),
        mbody.Revolute("shoulder", "ground", "upper"),
        mbody.Revolute("elbow", "upper.E", "lower"),
        mbody.Gravity("gravity", y=-G),
    )
    start = {"upper": {"angle": 0.1}, "lower": {"angle": 0.8, "omega": -3.0}}
    machine.simulation = mbody.SimulationSettings(1.0, start)
    machine.add(mbody.Stop("elbow stop", "lower.angle - upper.angle", 0.5))
    run = mbody.simulate(machine, 1.0, rtol=1e-11)
    assert run.events
    for hit in run.events:
        if hit.name != "impact":
            continue
        one, two = hit.state["upper"], hit.state["lower"]
        assert two.angle[0] == pytest.approx(one.angle[0], abs=1e-11)
        H = np.array(
            [
                [i1 + m1 * 0.09 + m2 * a * a, m2 * a * b * math.cos(two.angle[0] - one.angle[0])],
                [0.0, i2 + m2 * b * b],
            ]
        )
        H[1, 0] = H[0, 1]
        J, omega = np.array([-1.0, 1.0]), np.array([one.omega[0], two.omega[0]])
        way = np.linalg.solve(H, J)
        expected = omega - 1.5 * (J @ omega) * way / (J @ way)
        after = [hit.after["upper"].omega[0], hit.after["lower"].omega[0]]
        assert after == pytest.approx(expected, abs=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-9 * run.energy.size
    gap = run["lower"].angle - run["upper"].angle
    assert gap.min() > -1e-9 and run.checks.constraint < 1e-12


@pytest.mark.parametrize("name", ["free_fourbar", "n_windows_2"])
def test_one_free_motion_is_turned_round(name):
    """v⁺ = −e v⁻ of every link, whatever the coordinate of the stop, with redundant rows too."""
    machine, e = gallery.load(name), 0.6
    stops = {"free_fourbar": "130 deg - rocker.angle", "n_windows_2": "b1.y + 0.5 m"}
    machine.add(mbody.Stop("buffer", stops[name], e))
    run = mbody.simulate(machine, 1.0, rtol=1e-11)
    hit = run.events[0]
    for body in run:
        before, after = hit.state[body], hit.after[body]
        for key in ("vx", "vy", "omega"):
            was, now = getattr(before, key)[0], getattr(after, key)[0]
            # free directions by a dense factor, 1e-12 of the greatest rates
            assert now == pytest.approx(-e * was, rel=1e-9, abs=1e-9)
    assert hit.after.checks.constraint < 1e-12
    assert np.abs(run.energy.balance).max() < 1e-8 * run.energy.size
    assert run.energy.by["buffer"][-1] < 0.0


def test_a_row_of_equal_blocks_is_struck_at_once():
    """Elastic, the second and the third touching: all contacts that are closed take part. By
    Poisson's law 1/3 each after compression, then gap 0 gives back 2/3, gap 1 its 1/3.
    """
    machine = blocks(0.0, 0.3, 0.4)
    machine.add(*(mbody.Stop(f"gap{n}", f"b{n + 1}.x - b{n}.x - 0.1 m", 1.0) for n in range(2)))
    run = mbody.simulate(machine, 1.0)
    speeds = [run[f"b{n}"].vx[-1] for n in range(3)]
    assert speeds == pytest.approx([-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0], abs=1e-12)
    assert run.energy.kinetic[-1] == pytest.approx(run.energy.kinetic[0], rel=1e-12)
    assert [(one.name, one.contact) for one in run.events] == [("impact", "gap0")]


def test_into_a_corner():
    """Both stops are struck at one instant: one impact, by the name of that which came first."""
    machine = mbody.Mechanism("corner")
    machine.add(mbody.Body("ball", mass=2.0, inertia=0.3))
    machine.simulation = mbody.SimulationSettings(
        1.0, {"ball": {"x": 1.0, "y": 1.0, "vx": -1.0, "vy": -1.0}}
    )
    machine.add(mbody.Stop("wall", "ball.x", 0.5), mbody.Stop("floor", "ball.y", 0.5))
    run = mbody.simulate(machine, 3.0)
    assert [one.t for one in run.events] == pytest.approx([1.0], abs=1e-12)
    assert [run["ball"].vx[-1], run["ball"].vy[-1]] == pytest.approx([0.5, 0.5], abs=1e-11)


def test_what_lies_on_a_stop_rests_and_lifts_off():
    """A load that grows beyond the weight lifts it, when it is that: 2 N/s · t = m g."""
    machine = ball(height=0.0)
    machine.add(
        mbody.Stop("floor", "ball.y", 0.5),
        mbody.Force("crane", "ball", "2 N/s*t", angle=0.5 * math.pi),
    )
    weight = machine["ball"].mass * G
    run = mbody.simulate(machine, weight, rtol=1e-11)
    (lifts,) = run.events
    assert (lifts.name, lifts.contact) == ("open", "floor")
    assert lifts.t == pytest.approx(0.5 * weight, abs=1e-11)
    resting = run.t < lifts.t
    assert run.contact("floor")[resting] == pytest.approx(weight - 2.0 * run.t[resting], abs=1e-11)
    # then ÿ = 2 (t − t₁)/m
    gone = run.t - lifts.t
    rise = np.where(gone > 0.0, gone**3 / (3.0 * machine["ball"].mass), 0.0)
    assert run["ball"].y == pytest.approx(rise, abs=1e-8)


def test_rest_on_a_stop_that_moves():
    """Carried by a floor y = a sin ωt as long as its acceleration is above −g: it leaves it where
    sin ωt = g/(a ω²).
    """
    machine = ball(height=0.0)
    a, w = 0.2, 9.0
    machine.add(mbody.Stop("floor", f"ball.y - {a} m*sin({w} rad/s*t)"))
    machine.simulation = mbody.SimulationSettings(
        0.3, {"ball": {"y": 0.0, "vy": a * w}}, rtol=1e-11
    )
    run = mbody.simulate(machine)
    (leaves,) = run.events
    assert leaves.t == pytest.approx(math.asin(G / (a * w * w)) / w, abs=1e-11)
    on = run.t < leaves.t
    assert run["ball"].y[on] == pytest.approx(a * np.sin(w * run.t[on]), abs=1e-13)
    mass = machine["ball"].mass
    force = mass * (G - a * w * w * np.sin(w * run.t[on]))
    assert run.contact("floor")[on] == pytest.approx(force, abs=1e-10)
    assert run.energy.error < 1e-9
    # what the floor gave: ½ m v² − ½ m (a ω)² + m g y, where it left
    at = leaves.state["ball"]
    given = 0.5 * mass * (at.vy[0] ** 2 - (a * w) ** 2) + mass * G * at.y[0]
    assert run.energy.by["floor.moving"][-1] == pytest.approx(given, rel=1e-9)


@pytest.mark.parametrize("e", [0.0, 0.3])
def test_a_stop_of_several_bodies(e):
    """Against the dense equations: M Δv = gᵀ p and g Δv = −(1 + e) g v of impacts; of rest
    M a = f + gᵀ λ and g a + ġ v = 0.
    """
    machine = mbody.Mechanism("three")
    masses = [[1.0, 1.0, 0.1], [2.0, 2.0, 0.2], [3.0, 3.0, 0.3]]
    for n, (mass, _, inertia) in enumerate(masses):
        machine.add(mbody.Body(f"b{n}", mass=mass, inertia=inertia))
    machine.add(
        mbody.Stop("s", "b0.x + 0.3*b1.x*cos(b2.angle) + b2.y", restitution=e),
        mbody.Gravity("g", x=-1.0, y=-2.0),
    )
    start = {
        "b0": {"x": 1.0},
        "b1": {"x": 0.5, "angle": 0.0, "omega": 0.2},
        "b2": {"y": 0.7, "angle": 0.0, "omega": 1.0},
    }
    machine.simulation = mbody.SimulationSettings(2.0, start, rtol=1e-11)
    run = mbody.simulate(machine)

    def rows(at):
        """g, M⁻¹ gᵀ, v and ġ v at an instant."""
        x, turned = at["b1"].x[0], at["b2"].angle[0]
        c, s = math.cos(turned), math.sin(turned)
        g = np.array([1.0, 0, 0, 0.3 * c, 0, 0, 0, 1.0, -0.3 * x * s])
        v = np.array([getattr(at[f"b{n}"], key)[0] for n in range(3) for key in KEYS])
        return g, g / np.ravel(masses), v, -0.3 * v[8] * (2.0 * v[3] * s + x * v[8] * c)

    impacts = [one for one in run.events if one.name == "impact"]
    assert impacts and run.energy.error < 1e-9
    for hit in impacts:
        g, way, before, _ = rows(hit.state)
        expected = before - (1.0 + e) * (g @ before) * way / (g @ way)
        assert rows(hit.after)[2] == pytest.approx(expected, abs=1e-10)
    resting = np.flatnonzero(np.array(run.mode("s")) == "stick")
    assert len(resting) > 5 or e > 0.0
    weight = np.array([-1.0, -2.0, 0.0] * 3)
    for k in resting[::20]:
        g, way, _, turning = rows(run.at(run.t[k]))
        force = -(g @ weight + turning) / (g @ way)
        assert run.contact("s")[k] == pytest.approx(force, rel=1e-8)


def test_bounces_to_rest_against_a_limit_of_a_joint():
    """A pendulum of a point mass, almost level on its limit, falls as y = −½ g t² does to first
    order; here against the energy: ω⁻ = √(2 g/l (cos θ₁ − cos θ₀)), ω⁺ = −e ω⁻.
    """
    e, length = 0.5, 0.4
    machine = mbody.Mechanism("pendulum", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("bob", mass=2.0, inertia=0.0, cg=(0.0, -length), points={"O": (0.0, 0.0)}),
        mbody.Revolute("A", "ground.O", "bob.O", limits=("-90 deg", "30 deg"), restitution=e),
        mbody.Gravity("gravity", y=-G),
    )
    start = {"bob": {"angle": "-60 deg"}}
    machine.simulation = mbody.SimulationSettings(8.0, start, rtol=1e-12)
    run = mbody.simulate(machine)
    impacts = [one for one in run.events if one.name == "impact"]
    swing = math.cos(math.radians(30.0)) - math.cos(math.radians(60.0))
    omega = math.sqrt(2.0 * G / length * swing)
    assert {one.contact for one in impacts} == {"A_high"}
    for n, hit in enumerate(impacts[:4]):
        assert hit.state["bob"].angle[0] == pytest.approx(math.radians(30.0), abs=1e-12)
        assert hit.state["bob"].omega[0] == pytest.approx(omega * e**n, rel=1e-9)
        assert hit.after["bob"].omega[0] == pytest.approx(-omega * e ** (n + 1), rel=1e-9)
    assert run.energy.error < 1e-9


def test_a_slider_rests_at_the_end_of_its_guide():
    """x = ½ a t² up to 0.5 m, rebounds of e, rest after t₁ (1 + e)/(1 − e), pressed by m a."""
    e, mass = 0.3, 1.5
    machine = mbody.Mechanism("slider")
    machine.add(
        mbody.Body("block", mass=mass, inertia=1.0),
        mbody.Prismatic("guide", "ground", "block", limits=(None, "0.5 m"), restitution=e),
        mbody.Gravity("pull", x=2.0),
    )
    machine.simulation = mbody.SimulationSettings(2.5, rtol=1e-11)
    run = mbody.simulate(machine)
    last = run.events[-1]
    assert (last.name, last.contact) == ("rest", "guide_high")
    # the last impacts, at speeds of 1e-6, are of positions to 1e-16
    assert last.t == pytest.approx(math.sqrt(0.5) * (1.0 + e) / (1.0 - e), abs=1e-10)
    assert run.contact("guide_high")[-1] == pytest.approx(2.0 * mass, rel=1e-12)
    assert run.reaction("guide_high").fx[-1] == pytest.approx(-2.0 * mass, rel=1e-12)
    assert run.energy.error < 1e-10 and run["block"].x[-1] == pytest.approx(0.5, abs=1e-12)


def test_limits_are_numbers_by_name_and_in_files():
    machine = mbody.Mechanism("slider", parameters={"reach": "0.4 m"})
    machine.add(
        mbody.Body("block", mass=1.0, inertia=1.0),
        mbody.Prismatic("guide", "ground", "block", limits=("-reach", "reach"), restitution=0.2),
        mbody.Gravity("pull", x=2.0),
    )
    machine.simulation = mbody.SimulationSettings(1.0)
    again = mbody.from_toml(mbody.to_toml(machine))
    assert again == machine and mbody.to_toml(again) == mbody.to_toml(machine)
    system = mbody.assemble(again).with_values({"guide.limits.high": 0.1})
    hit = mbody.simulate(system).events[0]
    assert hit.contact == "guide_high" and hit.t == pytest.approx(math.sqrt(0.1), abs=1e-12)
    doubled = mbody.assemble(again).with_values({"reach": 0.8})
    assert mbody.simulate(doubled).events[0].t == pytest.approx(math.sqrt(0.8), abs=1e-12)
    one = mbody.Mechanism("slider")
    one.add(
        mbody.Body("block", mass=1.0, inertia=1.0),
        mbody.Prismatic("guide", "ground", "block", limits=[None, 0.4]),
    )
    text = mbody.to_toml(one)
    assert "limits = { high = 0.4 }" in text and mbody.from_toml(text) == one


def test_kinetostatics_leaves_limits_out():
    machine = gallery.load("slider_crank")
    joint = machine.joints[0]
    limited = mbody.Mechanism(machine.name, units=machine.units, ground=machine.ground.points)
    for element in machine:
        same = element is joint
        limited.add(replace(element, limits=(-0.1, 0.1)) if same else element)
    notes = mbody.kinetostatics(limited, turn=True, instants=4).notes
    assert any(f"limits of '{joint.name}': left out of kinetostatics" in note for note in notes)


def dropped_box(friction: float) -> mbody.Mechanism:
    """A box that strikes the floor with two corners, and a bar beside it that strikes nothing."""
    machine = mbody.Mechanism(
        "box", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    corners = {"A": (-0.2, -0.1), "B": (0.2, -0.1), "C": (0.2, 0.1), "D": (-0.2, 0.1)}
    box = {"box": {"polygon": ("A", "B", "C", "D")}}
    machine.add(
        mbody.Body("box", mass=3.0, inertia=0.05, points=corners, shapes=box),
        mbody.Body("bar", mass=1.0, inertia=0.1, points={"P": (0.0, 0.0)}),
        mbody.Contact("foot", "ground.floor", "box.box", friction=friction),
        mbody.Contact("end", "ground.floor", "bar.P"),
        mbody.Gravity("gravity", y=-G),
    )
    start = {"box": {"x": 0.0, "y": 0.3, "vx": 5.0}, "bar": {"x": 3.0, "y": 9.0}}
    machine.simulation = mbody.SimulationSettings(0.25, start)
    return machine


def test_an_impact_says_what_its_contacts_gave(tmp_path):
    """Both corners together stop a box and drag on it by Coulomb's law; also as data and from a
    file.
    """
    run = mbody.simulate(dropped_box(0.2))
    hit = run.events[0]
    whole = 3.0 * math.sqrt(2.0 * G * 0.2)
    assert hit.impulse("foot") == pytest.approx((whole, -0.2 * whole), rel=1e-12)
    assert hit.impulse("end") == (0.0, 0.0)
    data = run.data()["events"][0]
    assert data["impulses"] == {"foot": list(hit.impulse("foot"))}
    save_run(run, tmp_path / "run.npz")
    assert load_run(tmp_path / "run.npz").events[0].impulses == hit.impulses


def rocker(friction, size=1.0, mass=1.0):
    """A body on two feet in a groove, that turns about the left one, while the right one strikes:
    walls of 60°, feet at (±0.8, −1) about its mass centre, J = 0.3, by size and mass.
    """
    a, h, wall = 0.8 * size, size, math.pi / 3.0
    places = {"R": (a, -h), "L": (-a, -h)}
    shapes = {"right": {"line": {"point": "R", "angle": wall}}}
    shapes["left"] = {"line": {"point": "L", "angle": -wall}}
    machine = mbody.Mechanism("groove", ground=places, ground_shapes=shapes)
    machine.add(
        mbody.Body("rocker", mass=mass, inertia=0.3 * mass * size**2, points=places),
        mbody.Contact("right", "ground.right", "rocker.R", friction=friction),
        mbody.Contact("left", "ground.left", "rocker.L", friction=friction),
    )
    start = {"rocker": {"x": 0, "y": 0, "angle": 0, "vx": h, "vy": -a, "omega": -1.0}}
    machine.simulation = mbody.SimulationSettings(0.01, start)
    return machine


@pytest.mark.parametrize(("size", "mass"), [(1.0, 1.0), (1e-3, 1e6)])
def test_a_body_that_rocks_in_a_groove_goes_on_or_is_wedged(size, mass):
    """Housner's ratio of rates (J + m (h² − a²))/(J + m (h² + a²)) about the right foot; where the
    line of both feet is within both cones, at 90° − 60° = atan μ, rest is another outcome.
    """
    rows, a, h, wall = [], 0.8, 1.0, math.pi / 3.0
    for s in (1.0, -1.0):
        rows.append((-s * math.sin(wall), math.cos(wall)))
    rows += [(y, -x) for x, y in rows]
    feet = [(a, -h), (-a, -h)] * 2
    R = np.array([(x, y, px * y - py * x) for (x, y), (px, py) in zip(rows, feet, strict=True)])
    D, before = R @ np.diag([1.0, 1.0, 1.0 / 0.3]) @ R.T, R @ (h, -a, -1.0)
    ratio = (0.3 + h * h - a * a) / (0.3 + h * h + a * a)
    for friction, names in ((0.57, ()), (0.585, ("right", "left"))):
        run = mbody.simulate(rocker(friction, size, mass))
        (hit,) = run.events
        assert hit.after["rocker"].omega[0] == pytest.approx(-ratio, rel=1e-10)
        every = [w for _, w in every_solution(D, before, np.full(2, friction), np.zeros(2))]
        rates = {round(abs(w[1]), 9) for w in every}
        assert rates == {round(2.0 * a * math.cos(wall) * ratio, 9), *([0.0] if names else [])}
        assert [one.elements for one in run.doubts] == ([names] if names else [])
        assert run.status.startswith("doubtful: at t = 0 s the impact" if names else "completed")


@pytest.mark.parametrize(("friction", "e"), [(0.0, 0.0), (0.4, 0.0), (0.0, 0.5)])
def test_impulses_that_are_one_choice_of_many_are_named(friction, e, tmp_path):
    """A box that falls flat on both feet: how they share what stops it sideways is open, unless one
    contact has both; its motion is not. Three feet in a row share what stops it downwards.
    """
    places = {"A": (-0.5, -0.2), "B": (0.0, -0.2), "C": (0.5, -0.2)}
    found = {}
    for feet in ("AC", "ABC"):
        shapes = {"floor": {"line": {"point": "O", "angle": 0.0}}}
        machine = mbody.Mechanism("box", ground={"O": (0, 0)}, ground_shapes=shapes)
        machine.add(mbody.Body("box", mass=2.0, inertia=0.1, points=places))
        machine.add(
            *(
                mbody.Contact(
                    f"foot {k}", "ground.floor", f"box.{k}", friction=friction, restitution=e
                )
                for k in feet
            )
        )
        start = {"box": {"x": 0.0, "y": 0.2, "angle": 0.0, "vx": 0.1, "vy": -1.0}}
        machine.simulation = mbody.SimulationSettings(0.01, start)
        run = mbody.simulate(machine)
        (hit, *_) = run.events
        assert hit.after["box"].vy[0] == pytest.approx(e, abs=1e-11) and not run.doubts
        assert sum(hit.impulse(f"foot {k}")[0] for k in feet) == pytest.approx(
            2.0 * (1.0 + e), rel=1e-10
        )
        found[feet] = hit.shared
        assert any("impulses of" in note for note in run.notes) == bool(hit.shared)
        save_run(run, tmp_path / "run.npz")
        assert load_run(tmp_path / "run.npz").events[0].shared == hit.shared
    assert found["AC"] == (("foot A", "foot C") if friction else ())
    assert found["ABC"] == ("foot A", "foot B", "foot C")
