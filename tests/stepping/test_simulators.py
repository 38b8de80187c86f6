"""Many motions on lanes: the numbers of each alone, in any company, by any number of threads."""

import dataclasses
import pickle

import numpy as np
import pytest

import mbody
from tests.support.many_motions import cart_pole, driven_four_bar, parallelogram

#: Beside a single `Simulator`, in lengths and angles: the two sum up in another order, which steps
#: of 20 ms over four seconds of a tumbling four-bar make larger; 7e-12 is the worst that was seen.
ROUNDING = 1e-10


def torques(n, count):
    return np.random.default_rng(1).uniform(-8.0, 8.0, (count, n))


@pytest.mark.parametrize(("method", "rtol"), [("dopri5", 1e-6), ("dop853", 1e-10)])
def test_each_motion_is_that_of_a_simulator(method, rtol):
    system, n = mbody.assemble(driven_four_bar()), 21
    sims = mbody.Simulators(system, n, method=method, rtol=rtol)
    alone = mbody.Simulators(system, 1, method=method, rtol=rtol)
    sim = mbody.Simulator(system, method=method, rtol=rtol)
    for k, u in enumerate(torques(n, 200)):
        dt = 1e-3 if k < 100 else 0.02
        sims.inputs["u"], alone.inputs["u"], sim.inputs["u"] = u, u[17], float(u[17])
        for one in (sims, alone, sim):
            one.step(dt)
        assert np.array_equal(sims.q[17], alone.q[0])
        assert np.array_equal(sims.v[17], alone.v[0])
    assert sims.t[17] == sim.t
    assert np.abs(sims.q[17] - sim.q).max() < ROUNDING
    assert set(sims.status) == {"completed"} and sims.ok.all()
    for text in ("coupler.B.y", "pin", "crank.alpha", "O2.fx", "2*u", "t"):
        assert sims.measure(text)[17] == pytest.approx(sim.measure(text), rel=1e-9, abs=1e-9)
    assert sims["crank"].angle[17] == sims.q[17, 2]
    assert sims["coupler.B"].vx[17] == pytest.approx(sim["coupler.B"].vx, abs=1e-9)
    assert sims.reaction("B").magnitude[17] == pytest.approx(sim.reaction("B").magnitude, rel=1e-9)


def test_states_are_kept_and_set_back():
    sims = mbody.Simulators(driven_four_bar(), 5, rtol=1e-8)
    sims.step(0.01)
    kept = pickle.loads(pickle.dumps(sims.state))
    sims.step(0.02)
    after = sims.q
    sims.state = kept
    assert np.array_equal(sims.t, np.full(5, 0.01))
    sims.step(0.02)
    assert np.array_equal(sims.q, after)


def test_reset_by_mask_numbers_and_names():
    system = mbody.assemble(driven_four_bar())
    sims, sim = mbody.Simulators(system, 6, rtol=1e-8), mbody.Simulator(system, rtol=1e-8)
    first = sims.q
    sims.inputs["u"] = 2.0
    sims.step(0.05)
    sims.reset(sims["crank"].angle > 100.0)
    assert (sims.t == 0.05).all()
    sims.reset(np.array([True, False] * 3))
    assert np.array_equal(sims.t == 0.0, [True, False] * 3)
    assert np.array_equal(sims.q[0], first[0]) and sims.inputs["u"][0] == 0.0
    angles = np.array([0.3, 1.5, 2.6])
    far = sims.reset([1, 3, 5], {"crank.angle": angles, "crank.omega": 3.0})
    assert (far == 0.0).all() and np.abs(sims["crank"].angle[[1, 3, 5]] - angles).max() < 1e-12
    sim.reset({"crank.angle": 2.6, "crank.omega": 3.0})
    assert np.abs(sims.q[5] - sim.q).max() < 1e-12 and np.abs(sims.v[5] - sim.v).max() < 1e-11


def test_reset_leaves_the_rest_as_a_simulator_does():
    sims, sim = mbody.Simulators(cart_pole(), 2), mbody.Simulator(cart_pole())
    to = {"pole.angle": np.array([0.1, 0.2])}
    sims.reset(None, to)
    sim.reset({"pole.angle": 0.2})
    assert np.abs(sims.q[1] - sim.q).max() < 1e-12


def test_designs_of_a_batch_go_side_by_side():
    system = mbody.assemble(driven_four_bar())
    lengths = np.array([0.3, 0.4, 0.55])
    batch = system.with_values({"crank.inertia": lengths})
    sims = mbody.Simulators(batch, rtol=1e-8)
    sims.inputs["u"] = np.array([1.0, 2.0, 3.0])
    sims.step(0.1)
    for k in range(3):
        sim = mbody.Simulator(batch.design(k), rtol=1e-8)
        sim.inputs["u"] = float(k + 1)
        sim.step(0.1)
        assert np.abs(sims.q[k] - sim.q).max() < ROUNDING
        assert sims.measure("pin")[k] == pytest.approx(sim.measure("pin"), rel=1e-9)


def test_motions_through_a_change_point_go_alone_and_come_back():
    """A parallelogram turns through its flat position, where lanes cannot choose a branch."""
    system = mbody.assemble(parallelogram())
    sims, sim = mbody.Simulators(system, 3, rtol=1e-9), mbody.Simulator(system, rtol=1e-9)
    sims.reset(None, {"crank.angle": [1.0, 0.5, 1.5], "crank.omega": -6.0})
    sim.reset({"crank.angle": 0.5, "crank.omega": -6.0})
    for _ in range(40):
        sims.step(0.01)
        sim.step(0.01)
    assert sims["crank"].angle[1] < -1.0
    # of one branch: what differs is the steps after the change point, within their tolerance
    assert np.abs(sims.q[1] - sim.q).max() < 1e-7


def test_a_motion_that_fails_is_left_and_said():
    """A torque that has no value from an angle on: that motion stops, its neighbour goes on."""
    machine = mbody.Mechanism("wheel")
    machine.add(
        mbody.Body("wheel", mass=1.0, inertia=0.1, cg=(0, 0), guess=0.0),
        mbody.Revolute("O", "ground", "wheel"),
        mbody.Input("u", "1 N*m"),
        mbody.Torque("motor", "wheel", value="u*sqrt(1 - wheel.angle)"),
    )
    sims = mbody.Simulators(machine, 2, rtol=1e-6)
    sims.inputs["u"] = [1.0, -1.0]
    for _ in range(3):
        sims.step(0.5)
    assert np.array_equal(sims.ok, [False, True])
    assert sims.status[0].startswith("failed: ") and sims.status[1] == "completed"
    assert np.isfinite(sims.q).all() and sims.t[0] < 1.5 and sims.t[1] == 1.5
    sims.reset([0])
    assert sims.ok.all() and sims.t[0] == 0.0


def test_other_mechanisms_go_alone_with_the_same_numbers():
    machine = mbody.gallery.load("simple_pendulum")
    events = [mbody.Event("pendulum.omega")]
    machine.simulation = dataclasses.replace(machine.simulation, events=events)
    sims, sim = mbody.Simulators(machine, 2), mbody.Simulator(machine)
    for one in (sims, sim):
        one.step(0.25)
    assert np.array_equal(sims.q[1], sim.q)
    stiff = mbody.Simulators(driven_four_bar(), 2, method="radau5", rtol=1e-6)
    one = mbody.Simulator(driven_four_bar(), method="radau5", rtol=1e-6)
    stiff.inputs["u"], one.inputs["u"] = [1.0, 2.0], 2.0
    stiff.step(0.01)
    one.step(0.01)
    # the derivative at the start is evaluated once more
    assert np.abs(stiff.q[1] - one.q).max() < 1e-12
    assert stiff.measure("pin")[1] == pytest.approx(one.measure("pin"), rel=1e-9)


def test_the_method_follows_from_the_tolerance():
    """From 1e-6 on dopri5 in the place of dop853; another method of the description stays."""
    system, implicit = mbody.assemble(driven_four_bar()), driven_four_bar()
    implicit.simulation = dataclasses.replace(implicit.simulation, method="radau5")

    def angles(of, **how):
        sims = mbody.Simulators(of, 2, **how)
        sims.step(0.05)
        return sims.q

    for rtol, method in ((1e-5, "dopri5"), (1e-6, "dopri5"), (1e-7, "dop853"), (None, "dop853")):
        other = "dop853" if method == "dopri5" else "dopri5"
        found = angles(system, rtol=rtol)
        assert np.array_equal(found, angles(system, rtol=rtol, method=method))
        assert not np.array_equal(found, angles(system, rtol=rtol, method=other))
    radau = angles(system, rtol=1e-5, method="radau5")
    assert np.array_equal(angles(implicit, rtol=1e-5), radau)
