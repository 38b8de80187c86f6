"""Auxiliary states and inputs of motions that begin at a singular position."""

import numpy as np
import pytest

import mbody
from mbody import Input, State, Torque, simulate
from mbody.laws import Table
from tests.errors.starting import chain

pytestmark = pytest.mark.processor

#: A motor on the cranks of a parallelogram, which begins flat and turns at 6 rad/s.
R, L, K, U, FIRST = 0.5, 0.02, 0.3, 6.0, 6.0


def flat(*more):
    machine = chain(1, c0=FIRST, c1=FIRST)
    machine.add(*more)
    return machine


def driven(voltage="u", *more):
    return flat(
        Input("u", U),
        State("current", rate=f"({voltage} - {R}*current - {K}*c0.omega)/{L}", start=0.0),
        State("turned", rate="c0.omega", start=0.25),
        Torque("motor", "c0", value=f"{K}*current"),
        *more,
    )


def inertia():
    """Of the parallelogram about its cranks, which is constant: from its kinetic energy."""
    run = simulate(flat(), 1e-3)
    return 2.0 * run.energy.kinetic[-1] / FIRST**2


def closed(t, voltage=U, first=(0.0, FIRST)):
    """Current and rate by the eigenvalues of their two equations."""
    A = np.array([[-R / L, -K / L], [K / inertia(), 0.0]])
    rest = -np.linalg.solve(A, [voltage / L, 0.0])
    roots, vectors = np.linalg.eig(A)
    parts = np.linalg.solve(vectors, np.array(first) - rest)
    return rest[:, None] + (vectors @ (parts[:, None] * np.exp(np.outer(roots, t)))).real


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_motor_starts_from_a_flat_parallelogram(method):
    run = simulate(driven(), 0.2, rtol=1e-10, method=method, instants=41)
    current, rate = closed(run.t)
    np.testing.assert_allclose(run.measure("current"), current, atol=1e-8)
    np.testing.assert_allclose(run["c0"].omega, rate, atol=1e-8)
    turned = run["c0"].angle - run["c0"].angle[0]
    np.testing.assert_allclose(run.measure("turned"), 0.25 + turned, atol=1e-9)
    np.testing.assert_allclose(run.measure("u"), U)
    assert run.energy.error < 1e-8


def test_inputs_alone_change_nothing():
    plain = simulate(flat(), 0.1)
    run = simulate(flat(Input("u", 0.0), Torque("push", "c0", value="u")), 0.1)
    np.testing.assert_array_equal(run["c0"].angle, plain["c0"].angle)
    np.testing.assert_array_equal(run["c0"].alpha, plain["c0"].alpha)


def test_the_first_part_ends_where_an_input_jumps():
    """Voltage off at 20 ms: within what the first part would cover."""
    held = Table([0.0, 0.02], [U, 0.0], interpolation="hold")
    run = simulate(driven(), 0.1, inputs={"u": held}, rtol=1e-10, instants=51)
    at = run.t < 0.02 - 1e-9
    np.testing.assert_allclose(run.measure("current")[at], closed(run.t[at])[0], atol=1e-8)
    there = closed(np.array([0.02]))[:, 0]
    later = closed(run.t[~at] - 0.02, 0.0, there)
    np.testing.assert_allclose(run.measure("current")[~at], later[0], atol=1e-8)
    np.testing.assert_allclose(run["c0"].omega[~at], later[1], atol=1e-8)


def test_a_stiff_state_from_a_singular_position():
    """A filter of 0.1 ms: the first part is shorter, the motion as right."""
    machine = flat(State("lag", rate="(c0.omega - lag)/(0.1 ms)", start="0 rad/s"))
    run = simulate(machine, 0.05, rtol=1e-9, instants=101)
    np.testing.assert_allclose(run.measure("lag"), FIRST * (1 - np.exp(-run.t / 1e-4)), atol=1e-6)


def test_a_steady_start_at_a_singular_position():
    machine = flat(State("lag", rate="(2*c0.omega - lag)/(50 ms)", start="steady", size=1.0))
    run = simulate(machine, 0.05)
    np.testing.assert_allclose(run.measure("lag"), 2.0 * FIRST, atol=1e-8)


def test_a_simulator_leads_out_of_a_singular_position():
    sim = mbody.Simulator(driven(), rtol=1e-10)
    sim.inputs["u"] = 2.0 * U
    times = np.array([0.001, 0.05, 0.1])
    found = []
    for t in times:
        sim.until(t)
        found.append((sim.measure("current"), sim["c0"].omega))
    np.testing.assert_allclose(np.transpose(found), closed(times, 2.0 * U), atol=1e-7)
