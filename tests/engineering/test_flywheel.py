"""Flywheels that are sized by quadrature, against closed forms and against the free motion."""

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Gravity, Mechanism, Revolute, Torque, makers
from mbody.engineering import flywheel, size_flywheel
from mbody.laws import ConstantAcceleration, ConstantSpeed
from tests.support.engines import engine

#: The motion is followed to 1e-10 a step; extremes between 720 instants by a parabola, and those of
#: the quadrature between 8 × 720 places, are better than 1e-8 of the fluctuation.
PROVEN = 1e-6


def shaft(speed):
    machine = Mechanism("shaft")
    machine.add(
        Body("crank", mass=1.0, inertia=0.5),
        Revolute("O", "ground", "crank"),
        AngleDriver("motor", "crank", ConstantSpeed(0.3, speed)),
        Torque("load", "crank", value="-40 N*m - 15 N*m*sin(2*crank.angle)"),
    )
    return machine


@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_a_shaft_alone(speed):
    """ω²_max − ω²_min = 2ΔE/I is 2Cω² of the mean of both: ΔE/(Cω²) less what is on the shaft."""
    run = mbody.kinetostatics(shaft(speed), turn=True, instants=721)
    found = size_flywheel(run, 0.1)
    whole = 15.0 / (0.1 * 25.0)
    assert found.simple == pytest.approx(whole, rel=1e-7)
    assert found.inertia == pytest.approx(whole - 0.5, rel=1e-6)
    assert found.coefficient == pytest.approx(0.1, rel=1e-12)
    proof = found.simulated()
    assert proof.coefficient == pytest.approx(0.1, rel=PROVEN)
    assert np.mean([abs(proof.speed).max(), abs(proof.speed).min()]) == pytest.approx(5.0, rel=1e-6)
    assert found.simple == flywheel(run, 0.1)


def gas_engine(speed):
    """One cylinder with a gas force that follows the crank, weights on."""
    machine = engine([0.0], mass=2.0, r=0.1, speed=speed, rod=1.0, start=0.2)
    machine.add(
        mbody.Force("gas", "piston1", value="-800 N - 600 N*sin(crank.angle - 1 rad)"),
        Gravity("g", y=-9.81),
    )
    return machine


MACHINES = {
    "engine": lambda: gas_engine(20.0),
    "engine, backwards": lambda: gas_engine(-20.0),
    "four-bar": lambda: makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=9.0),
    "norton": lambda: mbody.gallery.load("norton_fourbar"),
    "slider-crank": lambda: makers.slider_crank(1, 4, masses=(0, 1, 1), speed=10.0),
}


def steady(machine):
    """With a constant speed where the law has another."""
    driver = machine["motor"]
    if isinstance(driver.law, ConstantAcceleration):
        machine = machine.without("motor").copied()
        machine.add(AngleDriver("motor", "crank", ConstantSpeed("60 deg", 25.0)))
    return machine


@pytest.mark.parametrize("coefficient", [0.3, 0.01])
@pytest.mark.parametrize("name", MACHINES)
def test_the_free_motion_fluctuates_as_wanted(name, coefficient):
    """Large fluctuations too: the links' energy goes with the square of the speed."""
    run = mbody.kinetostatics(steady(MACHINES[name]()), turn=True, instants=721)
    found = size_flywheel(run, coefficient)
    assert found.inertia > 0.0
    proof = found.simulated()
    assert proof.coefficient == pytest.approx(coefficient, rel=PROVEN)
    assert proof.status == "completed"
    fast, slow = abs(proof.speed).max(), abs(proof.speed).min()
    assert 0.5 * (fast + slow) == pytest.approx(abs(found.speed), rel=1e-5)
    # the textbook's is off by the order of the coefficient times what the links carry
    assert abs(found.simple - found.inertia) > PROVEN * found.inertia


def test_links_that_suffice():
    """A heavy crank: no flywheel, the coefficient is that of the links alone, as simulated."""
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(400, 3, 2), speed=9.0)
    found = size_flywheel(mbody.kinetostatics(machine, turn=True), 0.5)
    assert found.inertia == 0.0 and found.coefficient == found.without < 0.5
    assert "no flywheel is needed" in found.notes[-1]
    assert found.simulated().coefficient == pytest.approx(found.coefficient, rel=PROVEN)


def test_two_turns():
    """A four-stroke torque: over both turns, by quadrature and by the motion."""
    machine = shaft(6.0).copied()
    machine.add(Torque("stroke", "crank", value="20 N*m*cos(crank.angle/2)"))
    run = mbody.kinetostatics(machine, turn=True, turns=2)
    found = size_flywheel(run, 0.05)
    assert len(found.angle) == 720 * 8 + 1
    assert found.simulated().coefficient == pytest.approx(0.05, rel=PROVEN)
