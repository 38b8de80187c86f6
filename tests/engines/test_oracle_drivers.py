"""Drivers of every kind against the slow oracle: by law, by value, of angles and of lengths."""

import math

import numpy as np
import pytest

import mbody
from mbody import makers
from mbody.core.lanes import LANES
from mbody.engines.oracle import Reference
from mbody.laws import Harmonic, Polynomial
from mbody.model.element import Marker
from tests.support.oracle_runs import (
    FINE,
    STRIDE,
    assert_checked,
    assert_forces,
    assert_motion,
    forces_of,
    instants,
    some,
    truth,
    without,
)


def driven(oracle, q, t, value, rate, acceleration):
    """(q, v, a) by the oracle with other values than the laws', from q near by."""
    q = np.array([oracle.close(*x) for x in zip(q, t, value)])
    v = np.array([oracle.velocities(*x) for x in zip(q, t, rate)])
    a = np.array([oracle.accelerations(*x) for x in zip(q, v, t, acceleration)])
    return q, v, a


def dicts(**columns):
    """[{name: value of that instant}] from arrays (instants,)."""
    return [dict(zip(columns, map(float, row))) for row in zip(*columns.values())]


@some
@pytest.mark.parametrize("count", [7, FINE], ids=["scalar", "lanes"])
def test_one_driver_by_value(linkage, count):
    mechanism, fine = instants(linkage)
    wanted, at = truth(linkage), slice(None, None, STRIDE if count == FINE else 1)
    t = fine if count == FINE else wanted.t
    value = mechanism["motor"].law(t)
    rate, acceleration = np.linspace(2.0, -3.0, count), np.linspace(-20.0, 30.0, count)
    run = mbody.kinetostatics(mechanism, t, drive={"motor": (value, rate, acceleration)})
    assert run.record.blocks[0].shape[2] == (LANES if count == FINE else 1)
    parts = [dicts(motor=x[at]) for x in (value, rate, acceleration)]
    q, v, a = driven(wanted.oracle, wanted.q, wanted.t, *parts)
    assert_motion(run, q, v, a, at)
    assert_forces(run, forces_of(wanted.oracle, q, v, a, wanted.t), at)
    assert_checked(run)
    # a value alone: at rest
    run = mbody.kinetostatics(mechanism, t, drive={"motor": value})
    still = np.zeros_like(q)
    assert_motion(run, q, still, still, at)
    assert_forces(run, forces_of(wanted.oracle, q, still, still, wanted.t), at)


def five_bar():
    machine = mbody.Mechanism("five-bar", ground={"O": (0.0, 0.0), "P": (1.5, 0.0)})
    machine.add(
        makers.bar("left", 0.7, mass=2.0, guess=1.9),
        makers.bar("left arm", 1.3, mass=1.0, guess=0.5),
        makers.bar("right arm", 1.2, mass=1.5, guess=2.5),
        makers.bar("right", 0.6, mass=2.5, guess=1.0),
        mbody.Revolute("O", "ground.O", "left.A"),
        mbody.Revolute("P", "right.A", "ground.P"),
        mbody.Revolute("A", "left.B", "left arm.A"),
        mbody.Revolute("B", "right arm.A", "right.B"),
        mbody.Revolute("C", "left arm.B", "right arm.B"),
        mbody.AngleDriver("left motor", "left", Harmonic(1.9, 0.4, 3.0, 0.2)),
        mbody.AngleDriver(
            "right motor", "right", Polynomial([-0.9, -0.8, 0.3, 0.2]), relative_to="left"
        ),
        mbody.Gravity("gravity", x=0.5, y=-9.81),
        mbody.Force("tool", "left arm.B", Polynomial([10.0, -4.0]), angle=0.4),
    )
    return machine


@pytest.mark.parametrize("count", [9, 241], ids=["scalar", "lanes"])
def test_two_motors_by_their_laws(count):
    machine = five_bar()
    t = np.linspace(0.0, 1.2, count)
    at = slice(None, None, 30 if count == 241 else 1)
    oracle = Reference(machine)
    q, v, a = (part[::10] for part in oracle.motion(np.linspace(0.0, 1.2, 81)))
    run = mbody.kinetostatics(machine, t)
    assert_motion(run, q, v, a, at)
    assert_forces(run, forces_of(oracle, q, v, a, t[at]), at)
    assert_checked(run)


@pytest.mark.parametrize("alone", [False, True], ids=["both given", "one keeps its law"])
def test_two_motors_by_value(alone):
    machine = five_bar()
    oracle, count = Reference(machine), 9
    t = np.linspace(0.0, 1.2, count)
    s = np.linspace(0.0, 1.0, count)
    given = {
        "left motor": (1.9 - 0.8 * s, np.full(count, 3.0), 5.0 * s),
        "right motor": (-0.9 + 0.5 * s**2, -2.0 * s, np.full(count, -7.0)),
    }
    if alone:
        law = machine["right motor"].law
        given["right motor"] = tuple(np.array([law.derivatives(x) for x in t]).T)
    ask = {"left motor": given["left motor"]} if alone else given
    run = mbody.kinetostatics(machine, t, drive=ask)
    parts = [dicts(**{name: values[k] for name, values in given.items()}) for k in range(3)]
    q, near = [], oracle.close(oracle.guess(), 0.0, parts[0][0])
    for k in range(count):
        near = oracle.close(near, t[k], parts[0][k])
        q.append(near)
    q, v, a = driven(oracle, q, t, *parts)
    assert_motion(run, q, v, a)
    assert_forces(run, forces_of(oracle, q, v, a, t))
    assert_checked(run)


def slider_driven():
    machine = without(makers.slider_crank(1.0, 3.0, offset=0.2, masses=(2.0, 3.0, 1.0)), "motor")
    machine.add(
        mbody.CoordinateDriver("ram", "ground.O", "slider.B", Polynomial([3.4, 0.5, -1.1, 0.2])),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Torque("load", "crank", value=Harmonic(3.0, 20.0, 5.0)),
    )
    return machine


def cylinder_driven():
    machine = mbody.Mechanism("cylinder", ground={"O": (0.0, 0.0), "C": (1.2, -0.4)})
    machine.add(
        mbody.Body(
            "rocker",
            mass=4.0,
            inertia=0.6,
            cg=(0.5, 0.1),
            points={"O": (0.0, 0.0), "P": (0.9, 0.2)},
            guess=1.2,
        ),
        makers.bar("link", 0.8, mass=1.0, guess=0.2),
        mbody.Body("slide", mass=2.0, inertia=0.1, cg=(0.05, 0.0), points={"B": (0.0, 0.0)}),
        mbody.Revolute("O", "rocker.O", "ground.O"),
        mbody.Revolute("P", "rocker.P", "link.A"),
        mbody.Revolute("B", "slide.B", "link.B"),
        mbody.Prismatic("guide", Marker("ground", (0.0, 1.0), 0.1), Marker("slide", "B", 0.3)),
        mbody.DistanceDriver("cylinder", "rocker.P", "ground.C", Harmonic(1.45, 0.2, 4.0, 0.1)),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Force("push", "slide.B", -30.0),
    )
    return machine


@pytest.mark.parametrize("make", [slider_driven, cylinder_driven])
@pytest.mark.parametrize("count", [9, 241], ids=["scalar", "lanes"])
def test_drivers_of_lengths(make, count):
    machine = make()
    oracle, t = Reference(machine), np.linspace(0.0, 1.2, count)
    at = slice(None, None, 30 if count == 241 else 1)
    q, v, a = (part[::20] for part in oracle.motion(np.linspace(0.0, 1.2, 161)))
    run = mbody.kinetostatics(machine, t)
    assert run.record.blocks[0].shape[2] == (LANES if count == 241 else 1)
    assert_motion(run, q, v, a, at)
    assert_forces(run, forces_of(oracle, q, v, a, t[at]), at)
    assert_checked(run)


def rod_four_bar(*drivers):
    """Crank 1 and rocker 2 on a base of 3.5, a massless rod of 3 between them."""
    machine = mbody.Mechanism("rod", ground={"O2": (0.0, 0.0), "O4": (3.5, 0.0)})
    machine.add(
        makers.bar("crank", 1.0, mass=1.0, guess=1.0),
        makers.bar("rocker", 2.0, mass=1.0, guess=1.7),
        mbody.Revolute("O2", "ground.O2", "crank.A"),
        mbody.Revolute("O4", "ground.O4", "rocker.A"),
        mbody.Distance("rod", "crank.B", "rocker.B", length=3.0),
        *drivers,
    )
    return machine


def test_a_driver_that_cannot_reach_beside_a_rod():
    """The rocker comes no lower than where crank and rod are stretched, 4 from O2."""
    lowest = math.pi - math.acos((3.5**2 + 2.0**2 - 4.0**2) / (2.0 * 3.5 * 2.0))
    assert abs(lowest - 1.5887) < 1e-4
    with pytest.raises(
        mbody.SolveError, match=rf"0\.2 rad at t = 0 s: it comes within {lowest - 0.2:.3g} rad"
    ):
        mbody.kinematics(rod_four_bar(mbody.AngleDriver("motor", "rocker", 0.2)))
