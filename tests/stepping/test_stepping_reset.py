"""Resets: positions and rates by name, the nearest state that fits, and how far it is."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize_scalar

import mbody
from mbody import gallery
from mbody.engineering import close_loops
from mbody.laws import ConstantSpeed


def four_bar(**options):
    return mbody.Simulator(gallery.load("free_fourbar"), **options)


def test_a_reset_is_the_start_again():
    sim = four_bar(rtol=1e-8)
    first = np.append(sim.q, sim.v)
    sim.until(0.3)
    there = np.append(sim.q, sim.v)
    assert sim.reset() == 0.0
    assert sim.t == 0.0 and np.array_equal(np.append(sim.q, sim.v), first)
    sim.until(0.3)
    assert np.array_equal(np.append(sim.q, sim.v), there)


@pytest.mark.parametrize(
    "given",
    [
        {"crank": {"angle": 1.2, "omega": 2.5}},
        {"crank.angle": 1.2, "crank.omega": 2.5},
        {"crank.angle": f"{math.degrees(1.2)!r} deg", "crank": {"omega": 2.5}},
    ],
)
def test_positions_and_rates_by_name(given):
    sim = four_bar()
    sim.until(0.2)
    assert sim.reset(given) < 1e-14
    assert sim.t == 0.0 and sim.notes == ()
    assert sim["crank"].angle == pytest.approx(1.2, abs=1e-14)
    assert sim["crank"].omega == pytest.approx(2.5, abs=1e-13)
    # by the route of start
    rest = close_loops(gallery.load("free_fourbar"), guess={"crank": 1.2}, rates={"crank": 2.5})
    turned = sim["crank"].angle - rest["crank"].angle[0]
    other = mbody.Simulator(gallery.load("free_fourbar"), start=rest)
    if abs(turned) < 1e-9:
        assert_allclose(sim.q, other.q, atol=1e-9)
    jacobian = sim.jacobian()
    assert np.abs(jacobian @ sim.v).max() < 1e-12 * np.abs(jacobian).max() * np.abs(sim.v).max()
    assert sim.solution().checks.constraint < 1e-12


def test_the_loops_stay_on_their_branch():
    """From 60° to 100° and back to 60°: the same position, not the crossed one."""
    sim = four_bar()
    first = sim.q
    sim.reset({"crank.angle": math.radians(100.0)})
    sim.reset({"crank.angle": sim.state.q[2] * 0.0 + math.radians(60.0)})
    assert_allclose(sim.q, first, rtol=0, atol=1e-12 * np.abs(first).max())


def test_a_reset_that_does_not_fit_goes_to_the_nearest_state():
    """The least sum of the squares of both differences on the circle of positions."""
    sim = four_bar()
    crank, rocker = 1.0, 1.6
    far = sim.reset({"crank.angle": crank, "rocker.angle": rocker})
    found = sim["crank"].angle, sim["rocker"].angle
    assert far == pytest.approx(max(abs(found[0] - crank), abs(found[1] - rocker)), rel=1e-9)
    assert far > 0.01
    note = next(note for note in sim.notes if "reset" in note)
    assert "the nearest state that fits was taken, with crank.angle = " in note
    assert f"{math.degrees(found[1]):.7g} deg, not {math.degrees(rocker):.7g} deg" in note
    other = four_bar()

    def size(angle):
        other.reset({"crank.angle": angle})
        return (other["crank"].angle - crank) ** 2 + (other["rocker"].angle - rocker) ** 2

    best = minimize_scalar(size, bracket=(found[0] - 0.05, found[0] + 0.05), tol=1e-12)
    assert found[0] == pytest.approx(best.x, abs=1e-6)  # a minimum is found to half the digits
    assert sim.solution().checks.constraint < 1e-12
    sim.step(1e-3)


def test_a_reset_at_another_time_and_to_a_state():
    sim, other = four_bar(), four_bar(method="radau5")
    sim.reset({"crank.omega": 1.0}, t=2.0)
    assert sim.t == 2.0
    sim.until(2.1)
    assert other.reset(sim.state) < 1e-12
    assert other.t == 2.1
    assert_allclose(other.q, sim.q, rtol=0, atol=1e-12 * np.abs(sim.q).max())
    state = sim.state
    sim.step(0.1)
    assert sim.reset(state) == 0.0 and sim.t == state.t
    assert np.array_equal(sim.q, state.q)


def test_a_state_of_another_design_is_taken_to_the_nearest():
    """Its loops do not close here: the distance is that of the projection."""
    system = mbody.assemble(gallery.load("free_fourbar"))
    longer = system.with_values({"coupler.B.x": 15.02})
    sim, other = mbody.Simulator(system), mbody.Simulator(longer)
    state = sim.state
    far = other.reset(state)
    size = np.abs((other.q - state.q) / longer.coordinate_units).max()
    assert far == pytest.approx(size, rel=1e-12) and 1e-4 < far < 1e-2
    assert any("was moved by" in note or "was turned by" in note for note in other.notes)
    assert other.solution().checks.constraint < 1e-12


def test_a_reset_that_fails_leaves_the_state():
    """A crane whose rope a driver lengthens until no position has it."""
    machine = mbody.Mechanism("crane", ground={"T": (0.0, 2.0)})
    machine.add(
        mbody.Body("boom", mass=1.0, points={"P": (1.0, 0.0)}, cg=(0.5, 0.0), guess=0.3),
        mbody.Revolute("O", "ground", "boom"),
        mbody.DistanceDriver("winch", "ground.T", "boom.P", ConstantSpeed(2.0, 0.5)),
    )
    sim = mbody.Simulator(machine)
    sim.until(0.1)
    q, t = sim.q, sim.t
    with pytest.raises(mbody.SolveError, match="the loops of 'crane' do not close near"):
        sim.reset(t=5.0)
    assert sim.t == t and np.array_equal(sim.q, q)
    sim.step(1e-3)


def test_drivers_move_on_while_it_is_reset():
    """At another time a driver has another angle, and its rate."""
    machine = gallery.load("norton_fourbar")
    sim = mbody.Simulator(machine)
    sim.reset(t=0.05)
    angle, rate, _ = machine.drivers[0].law.derivatives(np.array([0.05]))
    assert sim["crank"].angle == pytest.approx(angle[0], abs=1e-12)
    assert sim["crank"].omega == pytest.approx(rate[0], rel=1e-12)


def test_a_double_pendulum_at_any_angles():
    machine = mbody.Mechanism("arm")
    machine.add(
        mbody.Body("upper", mass=1.0, points={"E": (1.0, 0.0)}, cg=(0.5, 0.0)),
        mbody.Body("lower", mass=1.0, cg=(0.5, 0.0)),
        mbody.Revolute("shoulder", "ground", "upper"),
        mbody.Revolute("elbow", "upper.E", "lower"),
    )
    sim = mbody.Simulator(machine)
    rng = np.random.default_rng(3)
    for p, q in rng.uniform(-9.0, 9.0, (10, 2)):
        assert sim.reset({"upper.angle": float(p), "lower.angle": float(q)}) < 1e-13
        assert sim["upper"].angle == pytest.approx(p, abs=1e-13)
        assert sim["lower"].x == pytest.approx(math.cos(p) + 0.5 * math.cos(q), abs=1e-12)


def test_what_is_not_named_stays():
    """A cart below its pole: the cart stays where it is, and rests."""
    machine = mbody.Mechanism("cart pole")
    machine.add(
        mbody.Body("cart", mass=1.0, guess=(0.3, 0.0, 0.0)),
        mbody.Body("pole", mass=0.2, cg=(0.3, 0.0), guess=(0.3, 0.0, 1.5)),
        mbody.Prismatic("rail", "ground", "cart"),
        mbody.Revolute("pin", "cart", "pole"),
    )
    sim = mbody.Simulator(machine)
    sim.reset({"pole.angle": 1.0, "pole.omega": 2.0})
    assert sim["cart"].x == pytest.approx(0.3, abs=1e-14) and abs(sim["cart"].vx) < 1e-14
    assert sim["pole"].vx == pytest.approx(-0.6 * math.sin(1.0), abs=1e-13)
    sim.reset({"cart.vx": 1.5})
    assert sim["pole"].angle == pytest.approx(1.5, abs=1e-14) and abs(sim["pole"].omega) < 1e-14
    assert sim["cart"].vx == pytest.approx(1.5, abs=1e-14)
