"""States of one's own, integrated with the motion: closed forms, restarts, lanes, sentences."""

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Gravity,
    Input,
    Mechanism,
    Revolute,
    State,
    Torque,
    assemble,
    simulate,
)
from tests.support.linear_systems import exponential

pytestmark = pytest.mark.processor

INERTIA = 0.1 + 1.0 * 0.2**2


def crank(*more):
    machine = Mechanism("crank", parameters={"target": "30 deg"})
    machine.add(
        Body("crank", mass=1.0, inertia=0.1, cg=(0.2, 0.0)), Revolute("O", "ground", "crank")
    )
    machine.add(*more)
    return machine


def pid(**start):
    """A crank with a PID of which the integral is a state."""
    return crank(
        State("integral", rate="target - crank.angle", start="0 rad*s", **start),
        Torque("motor", "crank", value="50 N*m/rad*(target - crank.angle) + 40 N*m/rad/s*integral"
               " - 2 N*m*s/rad*crank.omega"),
    )  # fmt: skip


def exact(t):
    """Angle, rate and integral of the closed loop, from zero."""
    A = np.array([[0, 1, 0], [-50 / INERTIA, -2 / INERTIA, 40 / INERTIA], [-1, 0, 0]])
    b = np.array([0, 50 / INERTIA, 1]) * np.radians(30)
    rest = -np.linalg.solve(A, b)
    return np.array([rest - exponential(A * one) @ rest for one in t])


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-11])
def test_a_continuous_pid_is_the_matrix_exponential(method, rtol):
    run = simulate(pid(), 1.0, method=method, rtol=rtol, instants=21)
    found = np.column_stack([run["crank"].angle, run["crank"].omega, run.measure("integral")])
    # some dozens of steps of that error; rates are a hundred times as great as the rest
    assert np.abs(found - exact(run.t)).max(axis=0) == pytest.approx([0, 0, 0], abs=600 * rtol)
    assert run.status == "completed"


def test_a_motion_goes_on_to_the_last_bit():
    first = simulate(pid(), 0.37, rtol=1e-9)
    rest = simulate(pid(), 1.0, start=first, rtol=1e-9)
    whole = simulate(pid(), 1.0, rtol=1e-9)
    assert rest["crank"].angle[-1] == whole["crank"].angle[-1]
    assert rest.measure("integral")[-1] == whole.measure("integral")[-1]


def test_a_chain_of_states_in_any_order():
    """Three integrators and a filter: each names the next."""
    machine = crank(
        State("a", rate="b", start=0.0),
        State("b", rate="c", start=0.0),
        State("c", rate="6", start=0.0),
        State("lag", rate="(t - lag)/0.25", start=1.0),
    )
    run = simulate(machine, 2.0, rtol=1e-11)
    t = run.t
    np.testing.assert_allclose(run.measure("a"), t**3, atol=1e-10)
    np.testing.assert_allclose(run.measure("lag"), t - 0.25 + 1.25 * np.exp(-t / 0.25), atol=1e-9)


def test_a_steady_start_has_no_rate():
    machine = crank(
        State("filtered", rate="(u - filtered^3)/(0.1)", start="steady"),
        Input("u", 8.0),
        Gravity("gravity", y=-9.81),
    )
    run = simulate(machine, 0.5)
    np.testing.assert_allclose(run.measure("filtered"), 2.0, atol=1e-9)


def test_states_begin_as_numbers_say_that_follow_parameters():
    machine = crank(State("i", rate="0 rad/s", start="2*target", size=3.0))
    system = assemble(machine)
    assert simulate(system, 0.1).measure("i")[-1] == pytest.approx(np.pi / 3)
    assert simulate(system.with_values(target=0.5), 0.1).measure("i")[-1] == 1.0
    assert simulate(system.with_values({"i.start": 7.0}), 0.1).measure("i")[-1] == 7.0


def test_thermal_losses_of_a_brake():
    """What a brake takes heats it: the state is the energy account of the result."""
    machine = crank(
        State("heat", rate="0.3 N*m*s/rad*crank.omega^2/(1 rad)", start="0 J", size="1 J"),
        Torque("brake", "crank", value="-0.3 N*m*s/rad*crank.omega"),
        Gravity("gravity", y=-9.81),
    )
    run = simulate(machine, 2.0, rtol=1e-10)
    np.testing.assert_allclose(run.measure("heat"), -run.energy.by["brake"], atol=1e-8)


def test_loops_and_events_with_states():
    """A slider-crank whose motor has a winding; an event of the state is located."""
    machine = mbody.makers.slider_crank(0.1, 0.3, masses=(1.0, 0.8, 0.5)).without("motor")
    machine.add(
        State("current", rate="(12 - 2*current - 0.5*crank.omega)/0.02", start=0.0),
        Torque("motor", "crank", value="0.5*current"),
    )
    run = simulate(machine, 0.3, rtol=1e-10, events=[mbody.Event("current - 4", direction=1)])
    at = run.events[0]
    assert at.state.measure("current")[-1] == pytest.approx(4.0, abs=1e-9)
    plain = simulate(machine, 0.3, rtol=1e-10)
    np.testing.assert_allclose(run["crank"].angle, plain["crank"].angle, atol=1e-9)
    # the winding by a route of its own: its equation, by differences of the result
    fine = simulate(machine, 0.3, rtol=1e-11, instants=3001)
    i, w = fine.measure("current"), fine["crank"].omega
    rate = (i[2:] - i[:-2]) / (fine.t[2:] - fine.t[:-2])
    np.testing.assert_allclose(rate, ((12 - 2 * i - 0.5 * w) / 0.02)[1:-1], atol=2e-2)
