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
    ModelError,
    Prismatic,
    Revolute,
    assemble,
    from_toml,
    kinetostatics,
    statics,
    to_toml,
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


def test_the_axis_may_lie_anywhere():
    """The whole machine turned and moved: the efforts are the same."""
    turn, x, y = 0.7, 3.0, -2.0
    c, s = math.cos(turn), math.sin(turn)
    machine = Mechanism("moved", ground={"O": (c * 0.3 - s * 0.1 + x, s * 0.3 + c * 0.1 + y)})
    for element in arm(SlenderRod(0.5 * math.pi), inertia=1.0):
        if element.name == "motor":
            element = AngleDriver("motor", "arm", turn - 0.4)
        if element.name == "field":
            element = CentrifugalField("field", Marker("ground", (x, y), 0.5 * math.pi + turn), 5.0)
        machine.add(element)
    here = kinetostatics(arm(SlenderRod(0.5 * math.pi), inertia=1.0)).effort("motor")
    assert_allclose(kinetostatics(machine).effort("motor"), here, rtol=1e-12)


# -- numbers, batches, files -------------------------------------------------------------------


def test_numbers_reach_the_kernel():
    """Each changed number gives what a new description gives; a batch is its designs."""
    system = assemble(arm(SlenderRod(0.5 * math.pi), inertia=1.0))
    for name, value, fresh in (
        ("field.speed", 7.0, arm(SlenderRod(0.5 * math.pi), inertia=1.0, omega=7.0)),
        ("arm.inertia", 0.6, arm(SlenderRod(0.5 * math.pi), inertia=0.6)),
        ("arm.spread.angle", 0.3, arm(SlenderRod(0.3), inertia=1.0)),
        ("arm.mass", 5.0, arm(SlenderRod(0.5 * math.pi), inertia=1.0, mass=5.0)),
    ):
        changed = kinetostatics(system.with_values({name: value})).effort("motor")
        assert_allclose(changed, kinetostatics(fresh).effort("motor"), rtol=ROUNDING)
        if name != "field.speed":
            assert abs(changed[0] / kinetostatics(system).effort("motor")[0] - 1.0) > 0.01
    speeds, angles = np.linspace(1.0, 9.0, 20), np.linspace(0.0, 3.0, 20)
    both = system.with_values({"field.speed": speeds, "arm.spread.angle": angles})
    efforts = kinetostatics(both).effort("motor")[:, 0]
    for design in (0, 7, 19):
        alone = kinetostatics(both.design(design)).effort("motor")
        assert_allclose(efforts[design], alone[0], rtol=ROUNDING)


def test_a_changed_inertia_that_contradicts_the_spread_is_refused():
    system = assemble(arm(SecondMoments(0.3, 0.1), inertia=0.4))
    with pytest.raises(ModelError, match=r"xx \+ yy of its spread is 0.4, its inertia 0.5"):
        system.with_values({"arm.inertia": [0.4, 0.5]})
    together = system.with_values({"arm.inertia": 0.5, "arm.spread.xx": 0.4})
    fresh = kinetostatics(arm(SecondMoments(0.4, 0.1), inertia=0.5))
    assert_allclose(kinetostatics(together).effort("motor"), fresh.effort("motor"), rtol=ROUNDING)


FILE = """
[parameters]
a = "0.5 m"
M = "3 kg"
w = "300 rpm"
[ground]
points = { O = ["0.3 m", 0] }
[bodies.plate]
mass = "M"
inertia = "M*(a^2 + a^2/4)/3"
cg = [0, 1]
spread = { xx = "M*a^2/3", yy = "M*a^2/12" }
[joints]
O = { revolute = ["ground.O", "plate"] }
[drivers]
motor = { angle = "plate", law = -30 }
[loads]
field = { centrifugal_field = { body = "ground", angle = 90 }, speed = "w" }
"""


def test_files_carry_it():
    machine = from_toml(FILE)
    assert from_toml(to_toml(machine)) == machine
    assert machine["field"].speed.value == pytest.approx(10.0 * math.pi, rel=1e-15)
    # a parameter moves the spread along with the inertia
    larger = kinetostatics(assemble(machine).with_values(a=0.8)).effort("motor")
    fresh = kinetostatics(from_toml(FILE.replace("0.5 m", "0.8 m"))).effort("motor")
    assert_allclose(larger, fresh, rtol=ROUNDING)
    assert abs(larger[0] / kinetostatics(machine).effort("motor")[0] - 1.0) > 0.05
    free = FILE.replace('speed = "w"', 'momentum = "3 kg*m^2/s", inertia = "0.2 kg*m^2"')
    assert from_toml(to_toml(from_toml(free))) == from_toml(free)


def test_the_summary_tells_it():
    told = str(kinetostatics(arm("point")))
    assert "speed 5 rad/s about the axis in ground, on every mass" in told


def test_a_weight_is_a_mass_too():
    machine = arm("point")
    parts = [e for e in machine if e.name != "arm"]
    heavy = Mechanism("heavy", ground=machine.ground.points, g=9.81)
    heavy.add(Body("arm", weight=3.0 * 9.81, cg=(0.0, 1.0), spread="point"), *parts)
    here, there = (kinetostatics(m).effort("motor") for m in (machine, heavy))
    assert_allclose(there, here, rtol=ROUNDING)


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
