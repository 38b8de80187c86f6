"""Curves that formulas call beyond their points: doubts that name the curve, how far, and when."""

import itertools

import numpy as np
import pytest

import mbody
from mbody.laws import Table, Table2

pytestmark = pytest.mark.processor


def shaft(*more, curves, **how):
    machine = mbody.Mechanism("shaft", curves=curves, **how)
    machine.add(*more)
    machine.add(mbody.Body("shaft", mass=1.0, inertia=2.0), mbody.Revolute("O", "ground", "shaft"))
    return machine


def constant(outside, **more):
    """A torque of 6 N·m up to 12 rad/s, of which nobody knows what it is beyond."""
    curve = Table([0.0, 6.0, 12.0], [6.0, 6.0, 6.0], outside=outside, **more)
    machine = shaft(curves={"pull": curve})
    machine.add(mbody.Torque("motor", "shaft", value="pull(2*shaft.omega)"))
    return machine


@pytest.mark.parametrize(
    ("outside", "instead"), [("hold", "the value at its end"), ("line", "the tangent at its end")]
)
def test_a_curve_that_is_left(outside, instead):
    """2 ω = 6 t: 12 rad/s are left at t = 2; instants are 0.05 apart."""
    run = mbody.simulate(constant(outside), 5.0, instants=101)
    (doubt,) = run.doubts
    assert doubt.kind == "extrapolation"
    assert doubt.elements == ("motor",)
    assert doubt.t == pytest.approx(2.05)
    assert doubt.message == (
        "'motor': the curve 'pull' covers 0 to 12, this result goes from 0 to 30 and takes "
        f"{instead} beyond it, from t = 2.05 s on: add points to the curve"
    )
    assert run.status == f"doubtful: {doubt.message}"
    assert doubt.message in run.notes
    assert mbody.simulate(constant(outside), 1.99).doubts == ()


def test_each_number_of_a_table_of_two_variables():
    z = [[1.0, 1.0], [1.0, 1.0]]
    machine = shaft(mbody.Input("u", "0.2 + t/2"), curves={"map": Table2([0, 3], [0, 1], z)})
    machine.add(mbody.Torque("motor", "shaft", value="map(shaft.omega, u)"))
    assert mbody.simulate(machine, 1.5).doubts == ()
    machine = shaft(
        mbody.Input("u", "0.2 + t/2"), curves={"map": Table2([0, 3], [0, 1], z, outside="hold")}
    )
    machine.add(mbody.Torque("motor", "shaft", value="map(shaft.omega, u)"))
    (doubt,) = mbody.simulate(machine, 4.0, instants=81).doubts
    assert "the second number of the curve 'map' covers 0 to 1" in doubt.message
    assert doubt.t == pytest.approx(1.65)
    both = mbody.simulate(machine, 8.0, instants=81).doubts
    assert ["first number" in one.message for one in both] == [True, False]


def test_rates_of_states_and_laws_of_springs():
    curves = {"heat": Table([0.0, 1.0], [0.0, 1.0], outside="line")}
    machine = shaft(curves=curves)
    machine.add(mbody.State("warm", rate="heat(3*t)", start=0.0))
    run = mbody.simulate(machine, 1.0)
    assert [one.elements for one in run.doubts] == [("warm",)]
    machine = mbody.Mechanism("spring", curves=curves, ground={"A": (0.0, 0.0), "B": (2.0, 0.0)})
    machine.add(mbody.Body("arm", mass=1.0, inertia=1.0, points={"P": (0.0, 1.0)}))
    machine.add(mbody.Revolute("O", "ground.B", "arm"))
    machine.add(mbody.Spring("pull", "ground.A", "arm.P", law="heat(x)", free_length=0.5))
    (doubt,) = mbody.simulate(machine, 0.1).doubts
    assert doubt.message.startswith("'pull': the curve 'heat' covers 0 to 1, this result goes")


def test_a_periodic_curve_and_one_that_ends_have_no_doubt():
    curve = Table([0.0, 1.0, 2.0], [5.0, 6.0, 5.0], periodic=True, interpolation="spline")
    machine = shaft(curves={"pull": curve})
    machine.add(mbody.Torque("motor", "shaft", value="pull(shaft.angle)"))
    # a step may leap over a knot of the spline, which the balance of energy says; this is of ranges
    doubts = mbody.simulate(machine, 3.0).doubts
    assert [one for one in doubts if one.kind == "extrapolation"] == []


def test_steps_of_a_simulator_and_driven_motions():
    sim = mbody.Simulator(constant("hold"))
    for _ in itertools.repeat(None, 4):
        sim.step(0.4)
    assert sim.doubts == ()
    sim.step(0.6)
    (doubt,) = sim.doubts
    assert "the curve 'pull' covers 0 to 12" in doubt.message
    assert 2.0 <= doubt.t <= 2.2

    machine = constant("hold")
    machine.add(mbody.AngleDriver("drive", "shaft", law="t^2"))
    found = mbody.kinetostatics(machine, t=np.linspace(0.0, 5.0, 51))
    (doubt,) = found.doubts  # 2 ω = 4 t
    assert doubt.t == pytest.approx(3.1)
