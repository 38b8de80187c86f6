"""Rates that a start leaves out: zero, and least kinetic energy where zero does not fit."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import (
    Body,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    Rolling,
    SimulationSettings,
    Simulator,
    simulate,
)
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import initial_state_of
from mbody.system.assembler import assemble


def first(machine, start, bodies):
    """(vx, vy, ω) of mass centres at the beginning, a row a body, and the notes."""
    machine.simulation = SimulationSettings(until=1e-3, start=start)
    run = initial_state_of(assemble(machine), machine.simulation)
    rates = [[getattr(run[name], key)[0] for key in ("vx", "vy", "omega")] for name in bodies]
    return np.array(rates), run.notes


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("cg", [(0.0, 0.0), (0.5, 0.0), (0.3, -0.6)])
def test_a_free_body_does_not_turn(cg, size):
    def thrown(**rates):
        machine = Mechanism("stick")
        cm = (cg[0] * size, cg[1] * size)
        machine.add(Body("b", mass=2.0, inertia=0.3 * size**2, cg=cm), Gravity("g", y=-9.81))
        start = {"b": {"x": 0.2 * size, "y": size, "angle": 0.7, **rates}}
        return first(machine, start, "b")

    found, notes = thrown(vx=3.0, vy=4.0)
    assert_allclose(found, [[3.0, 4.0, 0.0]], rtol=1e-14, atol=0)
    assert notes == ()
    found, notes = thrown(vx=30.0)
    assert_allclose(found, [[30.0, 0.0, 0.0]], rtol=1e-14, atol=0)
    # what is left out is as if 0 were written: of the origin
    said, left = thrown(vx=0.0, vy=0.0, omega=5.0), thrown(omega=5.0)
    assert_allclose(left[0], said[0], rtol=1e-14, atol=1e-14)


def cart(hinge, masses=(2.0, 1.0)):
    """A rod on a cart, hinged at one end; its axes there, or at its mass centre."""
    machine = Mechanism("cart", ground={"O": (0, 0)})
    cg = (0.5, 0.0) if hinge else (0.0, 0.0)
    machine.add(
        Body("cart", mass=masses[0], inertia=1.0, points={"A": (0, 0)}),
        Body("rod", mass=masses[1], inertia=0.1, cg=cg, points={"A": (cg[0] - 0.5, 0)}),
        Prismatic("rail", "ground.O", "cart.A"),
        Revolute("A", "cart.A", "rod.A"),
    )
    return machine


@pytest.mark.parametrize("masses", [(2.0, 1.0), (1e-6, 1e6), (1e6, 1e-6), (0.0, 1.0), (1.0, 0.0)])
@pytest.mark.parametrize("hinge", [True, False])
def test_a_rod_on_a_cart(hinge, masses):
    bodies, angle = ("cart", "rod"), -1.0
    arm = 0.5 * np.array([math.cos(angle), math.sin(angle)])
    found, notes = first(
        cart(hinge, masses), {"cart": {"x": 0.0, "vx": 3.0}, "rod": {"angle": angle}}, bodies
    )
    assert_allclose(found, [[3.0, 0.0, 0.0], [3.0, 0.0, 0.0]], rtol=0, atol=1e-12)
    (said,) = (note for note in notes if "of least kinetic energy" in note)
    assert "zero but for rod.vx = 3 m/s" in said
    found, _ = first(
        cart(hinge, masses), {"cart": {"x": 0.0}, "rod": {"angle": angle, "omega": 2.0}}, bodies
    )
    turned = [-2.0 * arm[1], 2.0 * arm[0], 2.0]
    assert_allclose(found, [[0.0, 0.0, 0.0], turned], rtol=0, atol=1e-12)
    found, notes = first(
        cart(hinge, masses),
        {"cart": {"x": 0.0, "vx": 1.0}, "rod": {"angle": angle, "omega": 2.0}},
        bodies,
    )
    assert_allclose(found, [[1.0, 0.0, 0.0], np.add(turned, [1.0, 0.0, 0.0])], rtol=0, atol=1e-12)
    assert not [note for note in notes if "kinetic energy" in note]  # nothing was left open


def test_the_same_by_guesses_and_in_resets():
    machine = cart(True)
    machine.simulation = SimulationSettings(until=1.0, start={"rod": {"angle": -1.0}})
    sim = Simulator(machine)
    sim.reset({"cart.vx": 3.0, "rod.angle": -1.0})
    assert abs(sim["rod"].omega) < 1e-12 and sim["rod"].vx == pytest.approx(3.0, rel=1e-12)
    assert any("zero but for rod.vx = 3 m/s" in note for note in sim.notes)
    sims = mbody.Simulators(assemble(machine), 3)
    sims.reset(to={"cart.vx": np.array([0.0, 1.0, 3.0]), "rod.angle": -1.0})
    assert_allclose(sims["rod"].omega, 0.0, rtol=0, atol=1e-12)
    assert_allclose(sims["rod"].vx, [0.0, 1.0, 3.0], rtol=0, atol=1e-12)
    machine.simulation = None
    run = close_loops(machine, guess={"rod": -1.0}, rates={"rod": 2.0})
    assert abs(run["cart"].vx[0]) < 1e-12 and run["rod"].omega[0] == pytest.approx(2.0)


def test_designs_of_a_sweep_begin_as_each_alone():
    machine = cart(False)
    start = {"cart": {"x": 0.0, "vx": 3.0}, "rod": {"angle": -1.0}}
    machine.simulation = SimulationSettings(until=0.1, start=start, instants=2)
    measures = ["first(rod.omega)", "first(rod.vx)"]
    made = mbody.sweep(machine, {"rod.mass": [0.5, 1.0, 4.0]}, "simulate", measures)
    assert_allclose([made[name] for name in measures], [[0.0] * 3, [3.0] * 3], rtol=0, atol=1e-12)


@pytest.mark.parametrize("tall", [0.0, 0.4])
def test_a_wheel_rolls_under_its_chassis(tall):
    machine = Mechanism("vehicle", ground={"O": (0, 0)})
    machine.add(
        Body("chassis", mass=5.0, inertia=1.0, cg=(0.0, tall), points={"C": (0, 0)}),
        Body("wheel", mass=1.0, inertia=0.02, points={"C": (0, 0)}, guess=(0.0, 0.3, 0.0)),
        Revolute("axle", "chassis.C", "wheel.C"),
        Rolling("road", Marker("ground", (0, 0)), "wheel.C", radius=0.3),
        Gravity("g", y=-9.81),
    )
    found, _ = first(
        machine,
        {"chassis": {"x": 0.0, "y": 0.3, "angle": 0.0, "vx": 2.0}},
        ("chassis", "wheel"),
    )
    assert_allclose(found, [[2, 0, 0], [2, 0, -2.0 / 0.3]], rtol=0, atol=1e-12)


def five_bar(masses):
    machine = Mechanism("five-bar", ground={"A": (0, 0), "E": (2, 0)})
    guesses, lengths = (2.0, 0.7, -0.7, 1.0), (1.0, 2.0, 2.0, 1.0)
    for k, (name, mass) in enumerate(zip(("a", "b", "c", "d"), masses, strict=True)):
        ends = {"i": (0, 0), "j": (lengths[k], 0)}
        cg = (0.4 * lengths[k], 0.1)
        machine.add(Body(name, mass=mass, inertia=0.2 * mass, cg=cg, points=ends, guess=guesses[k]))
    for name, i, j in (
        ("A", "ground.A", "a.i"),
        ("B", "a.j", "b.i"),
        ("C", "b.j", "c.i"),
        ("D", "c.j", "d.j"),
        ("E", "ground.E", "d.i"),
    ):
        machine.add(Revolute(name, i, j))
    return machine


@pytest.mark.parametrize("masses", [(1, 1, 1, 1), (1e-3, 5.0, 1e3, 0.2), (3.0, 1e6, 1e-6, 1.0)])
def test_a_five_bar_has_the_least_kinetic_energy(masses):
    """Over the one freedom that is left, by its own closing rates: ω of the three other links."""
    machine = five_bar(masses)
    machine.simulation = SimulationSettings(1e-3, {"a": {"angle": 2.0, "omega": 10.0}})
    run = initial_state_of(assemble(machine), machine.simulation)
    angles = {name: float(run[name].angle[0]) for name in "abcd"}
    lengths = dict(zip("abcd", (1.0, 2.0, 2.0, 1.0), strict=True))
    # e′ of each link; a + b + c = (2, 0) + d, once differentiated
    across = {n: np.array([-math.sin(t), math.cos(t)]) for n, t in angles.items()}
    along = {n: np.array([math.cos(t), math.sin(t)]) for n, t in angles.items()}

    def rates(wd):
        own = 10.0 * lengths["a"] * across["a"] - wd * lengths["d"] * across["d"]
        wb, wc = np.linalg.solve(
            np.column_stack([lengths["b"] * across["b"], lengths["c"] * across["c"]]), -own
        )
        w = dict(zip("abcd", (10.0, wb, wc, wd), strict=True))
        joint = {"a": np.zeros(2), "d": np.zeros(2), "b": 10.0 * across["a"]}
        joint["c"] = joint["b"] + wb * lengths["b"] * across["b"]
        v = {n: joint[n] + w[n] * (0.4 * lengths[n] * across[n] - 0.1 * along[n]) for n in "abcd"}
        return w, v

    def energy(wd):
        w, v = rates(wd)
        mass = dict(zip("abcd", masses, strict=True))
        return sum(0.5 * mass[n] * (v[n] @ v[n] + 0.2 * w[n] ** 2) for n in "bcd")

    # a parabola by three of its values
    low, middle, high = energy(-1.0), energy(0.0), energy(1.0)
    least = 0.5 * (low - high) / (low + high - 2.0 * middle)
    w, v = rates(least)
    assert run["d"].omega[0] == pytest.approx(least, rel=1e-6, abs=1e-6)
    for name in "bcd":
        assert run[name].omega[0] == pytest.approx(w[name], rel=1e-6, abs=1e-5)
        assert_allclose([run[name].vx[0], run[name].vy[0]], v[name], rtol=1e-5, atol=1e-5)
    assert any("least kinetic energy" in note for note in run.notes)


def test_parts_that_nothing_joins_do_not_know_of_each_other():
    start = {"a": {"angle": 2.0, "omega": 10.0}, "d": {"angle": 1.0}}
    alone, _ = first(five_bar((1, 2, 3, 4)), start, "abcd")
    machine = five_bar((1, 2, 3, 4))
    far = 1e4
    machine.add(Body("great", mass=1e9, inertia=1e12, points={"P": (far, 0)}))
    start["great"] = {"x": 0.0, "y": 5.0, "angle": 0.0, "vx": 100.0}
    found, _ = first(machine, start, (*"abcd", "great"))
    assert_allclose(found[:4], alone, rtol=0, atol=1e-9)
    assert_allclose(found[4], [100.0, 0.0, 0.0], rtol=1e-14, atol=0)


def test_a_start_beside_a_driver_has_no_note_of_what_it_says():
    machine = mbody.gallery.load("stick_slip")
    assert simulate(machine, 0.1).notes == ()


def test_branches_that_meet_take_nothing_else_along():
    """A parallelogram in line beside a free stick: its branch does not turn the stick."""
    singular = Mechanism("in line", ground={"O2": (0, 0), "O4": (2, 0)})
    singular.add(
        Body("crank", mass=1.0, inertia=0.1, points={"A": (1, 0)}, guess=0.0),
        Body("coupler", mass=1.0, inertia=0.1, points={"B": (2, 0)}, guess=(1.0, 0.0, 0.0)),
        Body("rocker", mass=1.0, inertia=0.1, points={"B": (1, 0)}, guess=0.0),
        Body("stick", mass=1.0, inertia=0.1, cg=(0.5, 0.0)),
        Revolute("O2", "ground.O2", "crank"),
        Revolute("A", "crank.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker"),
    )
    start = {
        "crank": {"angle": 0.0, "omega": 6.0},
        "coupler": {"omega": 0.0},
        "stick": {"x": 0.0, "y": 1.0, "angle": 0.0, "vx": 3.0, "vy": 4.0},
    }
    found, _ = first(singular, start, ("crank", "coupler", "rocker", "stick"))
    assert_allclose(found[:, 2], [6.0, 0.0, 6.0, 0.0], rtol=0, atol=1e-9)
    assert_allclose(found[3], [3.0, 4.0, 0.0], rtol=0, atol=1e-9)
