"""Friction of a given size: clutches, brakes and packings, against closed forms and the oracle."""

import math

import numpy as np
import pytest

import mbody
from mbody import makers
from mbody.engines.oracle.friction import DenseFriction
from mbody.engines.oracle.mechanics import Reference
from mbody.laws import Polynomial

pytestmark = pytest.mark.processor


def driven_wheel(**clutch):
    machine = mbody.Mechanism("a braked wheel", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Input("press", 100.0),
        mbody.Body("wheel", mass=1.0, inertia=0.5),
        mbody.Revolute("pin", "ground.O", "wheel"),
        mbody.Clutch("brake", "ground.O", "wheel", **clutch),
        mbody.AngleDriver("motor", "wheel", Polynomial((0.0, 3.0, 1.0))),
    )
    return machine


def test_a_brake_takes_its_torque_against_the_rate():
    run = mbody.kinetostatics(driven_wheel(torque=12.0), t=[0.0, 0.5])
    np.testing.assert_allclose(run.effort("motor"), 12.0 + 0.5 * 2.0, rtol=1e-14)
    np.testing.assert_allclose(run.reaction("brake").torque, -12.0, rtol=1e-14)
    np.testing.assert_allclose(run.losses["brake"], [36.0, 48.0], rtol=1e-14)
    assert run.mode("brake") == ["slip+", "slip+"]


def test_its_torque_may_follow_measured_quantities_and_inputs():
    machine = driven_wheel(torque="0.04*press*(1 + abs(wheel.omega)/10)")
    run = mbody.kinetostatics(machine, t=[0.0, 0.5])
    np.testing.assert_allclose(-run.reaction("brake").torque, 4.0 * np.array([1.3, 1.4]))


def test_what_slips_fast_has_the_torque_of_slipping():
    machine = driven_wheel(torque=10.0, static=1.5, stribeck=2.0)
    run = mbody.kinetostatics(machine, t=[0.0, 0.5])
    rate = np.array([3.0, 4.0])
    np.testing.assert_allclose(
        -run.reaction("brake").torque, 10.0 * (1.0 + 0.5 * np.exp(-((rate / 2.0) ** 2)))
    )


def packed():
    """A slider-crank whose slider runs in a packing that a formula tightens."""
    machine = makers.slider_crank(0.05, 0.2, masses=(1.0, 2.0, 3.0), start=0.3, speed=20.0)
    machine.add(
        mbody.FrictionForce(
            "packing", "ground", "slider", force="30 + 4*abs(slider.vx)", static=1.2
        )
    )
    return machine


def test_a_packing_equals_the_dense_equations_over_a_turn():
    run = mbody.kinetostatics(packed(), turn="motor", instants=37)
    reference = Reference(run.system.mechanism)
    names = list(run)
    parts = [
        np.column_stack([getattr(run[b], f) for b in names for f in fields])
        for fields in (("x", "y", "angle"), ("vx", "vy", "omega"), ("ax", "ay", "alpha"))
    ]
    efforts, largest = [], float(np.abs(run.effort("motor")).max())
    for q, v, a, t in zip(*parts, run.t, strict=True):
        dense = DenseFriction(reference, q, v, a, float(t))
        found = dense.solve()
        efforts.append(-found.lam[reference.rows["motor"]][0])
    np.testing.assert_allclose(run.effort("motor"), efforts, atol=1e-12 * largest)


def test_lanes_and_designs_agree_with_single_instants():
    machine = packed()
    whole = mbody.kinetostatics(machine, turn="motor", instants=721)
    some = [5, 300, 600]
    few = mbody.kinetostatics(machine, t=whole.t[some])
    np.testing.assert_allclose(whole.effort("motor")[some], few.effort("motor"), rtol=1e-11)
    forces = [20.0, 30.0, 45.0]
    machine = makers.slider_crank(0.05, 0.2, masses=(1.0, 2.0, 3.0), start=0.3, speed=20.0)
    machine.add(mbody.FrictionForce("packing", "ground", "slider", force=30.0))
    table = mbody.sweep(
        machine, {"packing.force": forces}, measure="peak(motor.effort)", turn="motor"
    )
    for force, found in zip(forces, table["peak(motor.effort)"], strict=True):
        one = mbody.kinetostatics(
            mbody.assemble(machine).with_values({"packing.force": force}), turn="motor"
        )
        assert found == pytest.approx(np.abs(one.effort("motor")).max(), rel=1e-9)


def test_at_rest_there_is_a_range():
    machine = mbody.Mechanism("a packed rod")
    machine.add(
        mbody.Body("rod", mass=2.0),
        mbody.Prismatic("guide", "ground", "rod"),
        mbody.FrictionForce("packing", "ground", "rod", force=30.0, static=1.5),
        mbody.CoordinateDriver("hold", "ground", "rod", 0.0),
    )
    run = mbody.kinetostatics(machine, t=[0.0])
    band = run.range("hold")
    assert band.low[0] == pytest.approx(-45.0, abs=1e-12)
    assert band.high[0] == pytest.approx(45.0, abs=1e-12)
    assert math.isclose(run.effort("hold")[0], 0.0, abs_tol=1e-12)
