"""Inputs, auxiliary states and sampled controllers in a motion that is led on step by step."""

import math
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import mbody

G = 9.81


def arm(*more, u="0 N*m"):
    """A rod that a torque u turns, under gravity."""
    machine = mbody.Mechanism("arm")
    machine.add(
        mbody.Body("arm", mass=1.0, inertia=0.1, cg=(0.5, 0.0), guess=0.2),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Gravity("gravity", y=-G),
        mbody.Input("u", u),
        *more,
        mbody.Torque("motor", "arm", value="u - 0.3*arm.omega"),
    )
    return machine


INERTIA = 0.1 + 0.25


def truth(us, every, first=(0.2, 0.0)):
    """Angle and rate at the ends of intervals of constant torque, by another integrator."""
    y, found = np.array(first), []
    for u in us:

        def slope(t, y, u=u):
            fall = -G * 0.5 * math.cos(y[0])
            return [y[1], (u - 0.3 * y[1] + fall) / INERTIA]

        y = solve_ivp(slope, (0.0, every), y, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        found.append(y)
    return np.array(found)


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_inputs_act_from_one_step_to_the_next(rtol):
    """At either tolerance: steps of 10 ms are far shorter than these ask for."""
    sim = mbody.Simulator(arm(), rtol=rtol)
    us = np.random.default_rng(1).uniform(-5.0, 5.0, 100)
    found = []
    for u in us:
        sim.inputs["u"] = u
        sim.step(0.01)
        found.append([sim["arm"].angle, sim["arm"].omega])
    assert_allclose(found, truth(us, 0.01), rtol=0, atol=1e-9)
    assert sim.inputs["u"] == us[-1] and sim.measure("u") == us[-1]
    assert sim.status == "completed"


def test_a_controller_outside_is_that_inside():
    """PD at 1 kHz: by a loop of steps, and by `Controller` in `simulate`, bit for bit or nearly."""

    def law(t, angle, rate):
        return -30.0 * (angle - 1.0) - 4.0 * rate

    sampled = mbody.Controller("pd", law, "1 ms", reads=["arm.angle", "arm.omega"], sets=["u"])
    run = mbody.simulate(arm(sampled), 0.5, rtol=1e-8, times=[0.5])
    sim = mbody.Simulator(arm(), rtol=1e-8)
    for n in range(500):
        sim.inputs["u"] = law(sim.t, sim["arm"].angle, sim["arm"].omega)
        sim.until(0.5 if n == 499 else 1e-3 * (n + 1))
    assert sim["arm"].angle == pytest.approx(run["arm"].angle[-1], abs=1e-12)
    assert sim["arm"].omega == pytest.approx(run["arm"].omega[-1], abs=1e-11)
    # and the controller of the mechanism, called by the steps
    own = mbody.Simulator(arm(sampled), rtol=1e-8)
    for _ in range(100):
        own.step(0.005)
    assert own["arm"].angle == pytest.approx(run["arm"].angle[-1], abs=1e-12)
    assert own.inputs["u"] == own.measure("u") != 0.0
    with pytest.raises(mbody.ModelError, match="the input 'u' is set by the controller 'pd'"):
        own.inputs["u"] = 1.0


class Integral:
    """A controller with a memory."""

    def __init__(self):
        self.sum = 0.0

    def __call__(self, t, angle):
        self.sum += 1e-2 * (1.0 - angle)
        return 10.0 * (1.0 - angle) + 5.0 * self.sum


def test_a_state_has_the_memory_of_controllers():
    """Set back it gives the same bits, in the middle between two samples."""
    sampled = mbody.Controller(
        "pi", Integral(), "10 ms", reads=["arm.angle"], sets=["u"], delay="3 ms"
    )
    sim = mbody.Simulator(arm(sampled))
    for _ in range(37):
        sim.step(0.0017)
    state = pickle.loads(pickle.dumps(sim.state))
    ends = []
    for _ in range(2):
        sim.state = state
        for _ in range(50):
            sim.step(0.0017)
        ends.append(np.append(sim.q, sim.v))
    assert np.array_equal(*ends)
    run = mbody.simulate(arm(sampled), sim.t, times=[sim.t])
    assert sim["arm"].angle == pytest.approx(run["arm"].angle[-1], abs=1e-7)


def test_auxiliary_states_are_integrated_set_and_kept():
    state = mbody.State("integral", rate="1 rad - arm.angle", start="0.1 rad*s")
    machine = arm(state)
    machine.add(mbody.Torque("slow", "arm", value="2 N*m/rad/s*integral"))
    run = mbody.simulate(machine, 0.5, rtol=1e-10, times=[0.5])
    sim = mbody.Simulator(machine, rtol=1e-10)
    assert_allclose(sim.own, [0.1])
    sim.until(0.5)
    pages = [one.record.table(slice(None))[-1] for one in (run, sim.solution())]
    assert np.array_equal(*pages)
    assert sim.own[0] == sim.measure("integral") == run.measure("integral")[-1]
    kept = sim.state
    sim.step(0.1)
    there = np.concatenate([sim.q, sim.own])
    sim.state = kept
    sim.step(0.1)
    assert np.array_equal(np.concatenate([sim.q, sim.own]), there)
    assert sim.reset({"integral": 0.3, "arm": {"angle": 0.5}}) < 1e-14
    assert_allclose(sim.own, [0.3])
    assert sim.reset({"arm.angle": 0.5}) < 1e-14
    assert_allclose(sim.own, [0.1])
    other = mbody.Simulator(machine, rtol=1e-9)
    other.reset(kept)
    assert_allclose(other.own, kept.own)


def test_inputs_in_states_and_resets():
    sim = mbody.Simulator(arm(u="1 N*m"))
    assert sim.inputs["u"] == 1.0 and dict(sim.inputs) == {"u": 1.0}
    sim.inputs["u"] = "300 N*cm"
    assert sim.inputs["u"] == pytest.approx(3.0)
    sim.step(0.01)
    state = sim.state
    assert_allclose(state.inputs, [3.0])
    sim.inputs["u"] = -2
    sim.step(0.01)
    sim.state = state
    assert sim.inputs["u"] == pytest.approx(3.0)
    sim.step(0.01)
    first = sim["arm"].angle
    sim.state = state
    sim.step(0.01)
    assert sim["arm"].angle == first
    sim.reset()
    assert sim.inputs["u"] == 1.0


def test_an_input_counts_at_once():
    """Accelerations and reactions are those of the input that was set last."""
    sim = mbody.Simulator(arm())
    for u in (0.0, 3.0, -1.0):
        sim.inputs["u"] = u
        angle = sim["arm"].angle
        expected = (u - 0.5 * G * math.cos(angle)) / INERTIA
        assert sim["arm"].alpha == pytest.approx(expected, rel=1e-12)
        assert sim.accelerations()[2] == pytest.approx(expected, rel=1e-12)
        assert -sim.bias(minimal=True)[0] == pytest.approx(expected * INERTIA, rel=1e-11)
    before = sim.q
    other = sim.accelerations({"u": 7.0}, minimal=True)
    assert other[0] == pytest.approx((7.0 - 0.5 * G * math.cos(angle)) / INERTIA, rel=1e-12)
    assert_allclose(sim.accelerations([7.0], minimal=True), other, rtol=1e-14)
    assert sim.inputs["u"] == -1.0 and np.array_equal(sim.q, before)
    assert sim["arm"].alpha == pytest.approx((-1.0 - 0.5 * G * math.cos(angle)) / INERTIA)
    sim.step(0.01)
    assert_allclose(
        [sim["arm"].angle, sim["arm"].omega], truth([-1.0], 0.01)[0], rtol=0, atol=1e-10
    )


def test_laws_of_time_go_on_by_their_corners():
    """An input of a table that jumps, and one with corners: steps end there, as in simulate."""
    t, u = np.array([0.0, 0.1, 0.2, 0.3, 1.0]), np.array([0.0, 2.0, -1.0, 3.0, 3.0])
    for kind in ("hold", "linear"):
        table = mbody.laws.Table(t, u, interpolation=kind, outside="hold")
        machine = arm(u=table)
        run = mbody.simulate(machine, 0.5, rtol=1e-10, times=[0.5])
        sim = mbody.Simulator(machine, rtol=1e-10)
        sim.until(0.15)
        assert sim.inputs["u"] == pytest.approx(2.0 if kind == "hold" else 0.5)
        for _ in range(7):
            sim.step(0.05)
        assert sim["arm"].angle == pytest.approx(run["arm"].angle[-1], abs=1e-9)
        with pytest.raises(mbody.ModelError, match="the input 'u' follows its law"):
            sim.inputs["u"] = 1.0


def test_a_cart_pole_loop():
    """A pole on a cart is kept upright by a force that Python computes, at 1 kHz."""
    machine = mbody.Mechanism("cart pole")
    machine.add(
        mbody.Body("cart", mass=1.0, guess=(0.0, 0.0, 0.0)),
        mbody.Body("pole", mass=0.2, inertia=0.01, cg=(0.3, 0.0), guess=(0.0, 0.0, 1.5)),
        mbody.Prismatic("rail", "ground", "cart"),
        mbody.Revolute("pin", "cart", "pole"),
        mbody.Gravity("gravity", y=-G),
        mbody.Input("u", "0 N"),
        mbody.Force("motor", "cart", value="u"),
    )
    sim = mbody.Simulator(machine, rtol=1e-6)
    sim.reset({"pole.angle": math.pi / 2.0 + 0.1})
    for _ in range(3000):
        lean, rate = sim["pole"].angle - math.pi / 2.0, sim["pole"].omega
        sim.inputs["u"] = -(30.0 * lean + 6.0 * rate) + 1.0 * sim["cart"].x + 2.0 * sim["cart"].vx
        sim.step(1e-3)
    assert abs(sim["pole"].angle - math.pi / 2.0) < 0.02
    assert sim.status == "completed"
