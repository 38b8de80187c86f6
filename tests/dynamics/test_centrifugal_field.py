"""The centrifugal field: against the oracle of mass grains, closed forms and Routh's function."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    AngleDriver,
    Body,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    kinetostatics,
    statics,
)
from mbody.engines.oracle import Reference
from mbody.laws import ConstantSpeed, Polynomial
from mbody.model.body import SecondMoments, SlenderRod
from mbody.model.loads import CentrifugalField
from tests.support.linkages import random_linkage, times_within
from tests.support.oracle_runs import FORCE, assert_forces, forces_of, motion_of

UPRIGHT = Marker("ground", (0.0, 0.0), 0.5 * math.pi)
ROUNDING = 1e-13  # some hundred operations on doubles


# -- the oracle: every grain of mass is pushed outwards ----------------------------------------


def spread_of(body, rng):
    """A random spread that the body's inertia allows."""
    kind = rng.integers(3)
    if not body.inertia:
        return "point"
    if kind == 0:
        return SlenderRod(float(rng.uniform(-3.0, 3.0)))
    part, lean = rng.uniform(0.1, 0.9), rng.uniform(-0.9, 0.9)
    xx, yy = part * body.inertia, (1.0 - part) * body.inertia
    return SecondMoments(xx, yy, lean * math.sqrt(xx * yy))


def spinning(seed, *fields, loops=3):
    """A random linkage whose bodies have spreads, and the fields on it."""
    plain, turn = random_linkage(seed, loops, extras=True)
    rng = np.random.default_rng(seed)
    machine = Mechanism("spinning", ground=plain.ground.points, g=plain.g)
    for element in plain:
        if isinstance(element, Body):
            element = dataclasses.replace(element, spread=spread_of(element, rng))
        machine.add(element)
    machine.add(*fields)
    return machine, turn


AXES = [Marker("ground", (0.3, -0.2), 1.1), Marker("ground", (0.0, 0.7), -2.0)]
FIELDS = {
    "held": CentrifugalField("field", AXES[0], speed=Polynomial((3.0, 2.0, -0.5))),
    "free": CentrifugalField("field", AXES[0], momentum=Polynomial((9.0, 4.0)), inertia=0.7),
}


@pytest.mark.parametrize("kind", FIELDS)
@pytest.mark.parametrize("seed", [1, 5])
def test_against_grains_of_mass(kind, seed):
    """All joint forces of a moving ten-link mechanism, on lanes and on the scalar path."""
    machine, turn = spinning(seed, FIELDS[kind])
    oracle, fine = Reference(machine), times_within(machine, turn, 181)
    run = kinetostatics(machine, t=fine)
    at = slice(None, None, 45)
    q, v, a = (part[at] for part in motion_of(run))
    assert_forces(run, forces_of(oracle, q, v, a, fine[at]), at)
    few = kinetostatics(machine, t=fine[at])
    top = np.abs(run.effort("motor")).max()
    assert_allclose(few.effort("motor"), run.effort("motor")[at], atol=FORCE * top)
    # it is no small part of them
    assert np.abs(run.breakdown("motor")["field"]).max() > 1e-3 * top


def test_the_causes_sum_to_the_whole():
    one = dataclasses.replace(FIELDS["held"], name="one")
    two = dataclasses.replace(FIELDS["free"], name="two", axis=AXES[1])
    machine, turn = spinning(2, one, two)
    run = kinetostatics(machine, t=times_within(machine, turn, 9))
    parts = run.breakdown("motor")
    assert {"one", "two", "inertia"} <= set(parts)
    top = max(np.abs(part).max() for part in parts.values())
    assert_allclose(sum(parts.values()), run.effort("motor"), atol=FORCE * top)
    # power of the loads, its own route
    assert run.checks.virtual_work < 1e-11
    assert run.checks.equilibrium < 1e-11


# -- closed forms ------------------------------------------------------------------------------


def arm(spread, theta=0.4, off=0.3, length=2.0, mass=3.0, inertia=0.0, omega=5.0):
    """An arm hinged beside an upright axis, fixed at θ from it; its mass centre is half way."""
    machine = Mechanism("arm", ground={"O": (off, 0.1)})
    machine.add(
        Body("arm", mass=mass, inertia=inertia, cg=(0.0, 0.5 * length), spread=spread),
        Revolute("O", "ground.O", "arm"),
        AngleDriver("motor", "arm", -theta),
        CentrifugalField("field", UPRIGHT, speed=omega),
    )
    return machine


THETA = [0.0, 0.4, 1.2, 2.5, -0.9]


@pytest.mark.parametrize("theta", THETA)
def test_a_point(theta):
    """m ω² x outwards at the mass centre, nothing else."""
    run = kinetostatics(arm("point", theta))
    x = 0.3 + math.sin(theta)
    force = 3.0 * 25.0 * x
    # the motor pushes back (clockwise is outwards)
    assert_allclose(run.effort("motor"), force * math.cos(theta), atol=ROUNDING * 300.0)
    assert_allclose(run.reaction("O").fx, -force, atol=ROUNDING * 300.0)


@pytest.mark.parametrize("theta", THETA)
def test_a_rod(theta):
    """∫ ω² (off + s sin θ) s cos θ dm over a uniform rod: m ω² cos θ (off l/2 + l² sin θ/3)."""
    length, mass = 2.0, 3.0
    run = kinetostatics(arm(SlenderRod(0.5 * math.pi), theta, inertia=mass * length**2 / 12.0))
    hand = mass * 25.0 * math.cos(theta) * (0.3 * 0.5 * length + length**2 * math.sin(theta) / 3.0)
    assert_allclose(run.effort("motor"), hand, atol=ROUNDING * 300.0)


def test_a_disc_feels_no_moment_and_a_plate_does():
    """A body with equal moments in all directions has none; a 2a × 2b plate has ω² I_xy."""
    disc = kinetostatics(arm(SecondMoments(0.2, 0.2), inertia=0.4))
    point = kinetostatics(arm("point"))
    assert_allclose(disc.effort("motor"), point.effort("motor"), rtol=ROUNDING)
    a, b, mass, theta = 0.5, 0.2, 3.0, 0.4
    xx, yy = mass * a * a / 3.0, mass * b * b / 3.0
    plate = kinetostatics(arm(SecondMoments(xx, yy), theta, inertia=xx + yy))
    # the moment of the books, −ω² I_xy in world axes, which the motor holds against
    world = (xx - yy) * math.sin(-theta) * math.cos(-theta)
    assert_allclose(plate.effort("motor") - point.effort("motor"), 25.0 * world, rtol=1e-10)


@pytest.mark.parametrize("theta", THETA)
def test_a_free_spindle_is_rouths(theta):
    """The motor holds −d/dθ of H²/(2 J(θ)), differentiated here."""
    momentum, own, inertia = 7.0, 0.9, 1.0
    machine = arm(SlenderRod(0.5 * math.pi), theta, inertia=inertia)
    machine = Mechanism("free", ground=machine.ground.points)
    machine.add(
        *(e for e in arm(SlenderRod(0.5 * math.pi), theta, inertia=inertia) if e.name != "field"),
        CentrifugalField("field", UPRIGHT, momentum=momentum, inertia=own),
    )

    def energy(angle):
        J = own + 3.0 * (0.3 + np.sin(angle)) ** 2 + inertia * np.sin(angle) ** 2
        return momentum**2 / (2.0 * J)

    h = 1e-20
    slope = energy(theta + 1j * h).imag / h
    run = kinetostatics(machine)
    assert_allclose(run.effort("motor"), -slope, atol=ROUNDING * 100.0)
    spindle = machine["field"].spindle(run)
    J = own + 3.0 * (0.3 + math.sin(theta)) ** 2 + inertia * math.sin(theta) ** 2
    assert_allclose(spindle.inertia, J, rtol=ROUNDING)
    assert_allclose(spindle.speed, momentum / J, rtol=ROUNDING)
    assert_allclose(spindle.momentum, momentum, rtol=ROUNDING)


def test_a_free_spindle_without_inertia_stands():
    """Everything on the axis: no speed, no force, and no NaN."""
    machine = Mechanism("bead")
    machine.add(
        Body("bead", mass=2.0, spread="point"),
        Prismatic("axis", UPRIGHT, Marker("bead", (0.0, 0.0), 0.5 * math.pi)),
        CentrifugalField("field", UPRIGHT, momentum=3.0),
        Gravity("gravity", y=-9.81),
    )
    machine.add(Body("stop"), Revolute("foot", "ground", "stop"), Revolute("pin", "stop", "bead"))
    machine.add(AngleDriver("motor", "stop", 0.0))
    run = statics(machine)
    assert_allclose(machine["field"].spindle(run).speed, 0.0)
    assert np.isfinite(run.reaction("axis").fx).all()


# -- numbers, batches, files -------------------------------------------------------------------


def test_a_moving_arm_feels_the_field_and_its_own_inertia():
    """The two parts of the effort: I α of the motion, and the field's, which is a static one."""
    machine = Mechanism("moving", ground={"O": (0.3, 0.0)})
    field = CentrifugalField("field", UPRIGHT, speed=5.0)
    law = ConstantSpeed(-0.4, 2.0)
    parts = [e for e in arm("point") if e.name not in ("motor", "field")]
    machine.add(*parts, AngleDriver("motor", "arm", law), field)
    run = kinetostatics(machine, t=np.linspace(0.0, 1.0, 7))
    theta = 0.4 - 2.0 * run.t
    hand = 75.0 * (0.3 + np.sin(theta)) * np.cos(theta)
    assert_allclose(run.effort("motor"), hand, atol=ROUNDING * 300.0)
