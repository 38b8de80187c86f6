"""Exact derivatives of motions over time, against a complex step through dense equations, which
scipy integrates.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbody
from mbody import Body, Gravity, Mechanism, Revolute, TorsionDamper
from mbody.derivatives.free_instants import first_state
from mbody.model.simulation import SimulationSettings
from tests.support.complex_oracle import ComplexOracle, derivative
from tests.support.complex_reading import STEP


def pendulum(rtol=1e-10, until=1.0, **start):
    own = {"bob": {"angle": 0.3, "omega": 1.0} | start}
    machine = Mechanism(
        "pendulum", simulation=SimulationSettings(until, own, rtol=rtol, instants=2)
    )
    machine.add(
        Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.1), guess=0.3),
        Revolute("O", "ground", "bob"),
        Gravity("gravity", y=-9.81),
        TorsionDamper("damper", "bob", coefficient=0.2),
    )
    return machine


def four_bar(rtol=1e-10, until=0.3):
    machine = mbody.gallery.load("free_fourbar")
    start = {"crank": {"angle": np.radians(60.0), "omega": 0.0}}
    machine.simulation = SimulationSettings(until, start, rtol=rtol, instants=2)
    return machine


MACHINES = {
    "pendulum": (
        pendulum,
        ["bob.mass", "bob.cg.x", "damper.coefficient", "start.bob.angle", "start.bob.omega"],
    ),
    "four_bar": (
        four_bar,
        ["crank.A.x", "coupler.cg.r", "rocker.weight", "rocker.inertia", "start.crank.angle"],
    ),
}


def truth(run, names, until):
    """Derivatives of the last state (2·coordinates, names) by a complex step each."""
    system = run.system
    first, n, found = first_state(run, names, given=False), system.coordinates, []
    for k, name in enumerate(names):
        oracle = ComplexOracle(system, name, 0.0)

        def rates(t, y, oracle=oracle):
            return np.concatenate([y[n:], oracle.accelerations(y[:n], y[n:], t)])

        start = first.y.astype(complex) + 1j * STEP * first.tangents[:, k]
        end = solve_ivp(rates, (0.0, until), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        found.append(derivative(end))
    return np.array(found).T


@pytest.mark.parametrize("name", MACHINES)
def test_the_last_state_as_by_a_complex_step(name):
    """1e-8 at rtol 1e-12, and in proportion to it."""
    make, names = MACHINES[name]
    exact, errors = None, []
    for rtol in (1e-8, 1e-10, 1e-12):
        machine = make(rtol)
        until = float(machine.simulation.until)
        bodies = [body.name for body in machine.bodies]
        places = [f"last({b}.{k})" for b in bodies for k in ("x", "y", "angle")]
        rates = [f"last({b}.{k})" for b in bodies for k in ("vx", "vy", "omega")]
        found = mbody.gradient(machine, [*places, *rates], names, analysis="simulate")
        if exact is None:
            exact = truth(mbody.simulate(machine), names, until)
        scale = np.abs(exact).max(axis=0)
        errors.append(float((np.abs(found.jacobian - exact) / scale).max()))
    # errors of some ten steps add up, and tangents grow by as much as the motion is unstable
    assert errors[0] < 1e-6 and errors[1] < 1e-8 and errors[2] < 1e-10, errors
    assert errors[2] < 1e-2 * errors[0], errors


def test_a_held_start_any_instant_and_means():
    """Against differences of four places at rtol 1e-13."""
    machine = mbody.assemble(pendulum(rtol=1e-12, until=0.4))
    begin = mbody.simulate(machine, 0.2, rtol=1e-12)
    measures = {
        "force": "at(O.force, 2)",
        "mean": "mean(bob.omega)",
        "all": "max(bob.angle)",
        "drag": "last(damper.torque)",
    }
    names = ["bob.mass", "gravity.y", "damper.coefficient"]
    how = {"start": begin, "instants": 5, "rtol": 1e-12}
    found = mbody.gradient(machine, measures, names, analysis="simulate", **how)
    for name in names:
        value = float(machine.values[name])
        step, ends = 1e-3 * abs(value), []
        for k in (-2.0, -1.0, 1.0, 2.0):
            run = mbody.simulate(machine.with_values({name: value + k * step}), **how)
            drag = run.load("damper").torque[-1]
            place = run["bob"].angle[found_place(run)]
            mean = np.trapezoid(run["bob"].omega, run.t) / np.ptp(run.t)
            ends.append([run.reaction("O").magnitude[2], mean, place, drag])
        far, near, up, most = np.array(ends)
        numeric = (8.0 * (up - near) - (most - far)) / (12.0 * step)
        exact = [found[measure][name] for measure in measures]
        np.testing.assert_allclose(exact, numeric, rtol=1e-8, atol=1e-9)


def found_place(run):
    return int(run["bob"].angle.argmax())


def test_many_numbers_take_several_passes():
    system = mbody.assemble(four_bar(1e-8, 0.05))
    found = mbody.gradient(system, "last(crank.angle)", analysis="simulate")
    assert len(found.by) > 15
    names = [name for name in found.by if found["last(crank.angle)"][name]][-3:]
    for name in names:
        alone = mbody.gradient(system, "last(crank.angle)", name, analysis="simulate")
        a, b = (one["last(crank.angle)"][name] for one in (found, alone))
        assert a == pytest.approx(b, rel=1e-5)


@pytest.mark.parametrize(
    ("model", "measure", "names"),
    [
        ("simple_pendulum", "last(pendulum.angle)", ["pendulum.mass", "gravity.x", "l"]),
        ("double_pendulum", "last(lower.omega)", ["m", "gravity.x", "l"]),
    ],
)
def test_numbers_that_do_not_count_at_the_beginning(model, measure, names):
    """Tangents of rounding, and those that rise from zero by a power of time, are no stiffness.

    A mass, or all masses together, make no difference; others against differences of four places.
    """
    system = mbody.assemble(mbody.gallery.load(model))
    how = {"until": 0.2, "instants": 3, "rtol": 1e-12}
    found = mbody.gradient(system, measure, analysis="simulate", **how)
    assert set(names) < set(found.by)
    assert abs(found[measure][names[0]]) < 1e-12 * abs(found[measure][names[2]])
    body, _, of = measure[5:-1].partition(".")
    for name in names[1:]:
        value, ends = float(system.values[name]), []
        for k in (-2.0, -1.0, 1.0, 2.0):
            run = mbody.simulate(system.with_values({name: value + k * 1e-3}), **how)
            ends.append(run.measure(f"{body}.{of}")[-1])
        numeric = (8.0 * (ends[2] - ends[1]) - (ends[3] - ends[0])) / 12e-3
        assert found[measure][name] == pytest.approx(numeric, rel=1e-7)
