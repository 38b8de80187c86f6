"""Every built-in joint, driver and load obeys its contract."""

import dataclasses
import math

import numpy as np
import pytest

import mbody
from mbody.kernels.constraints import KINDS
from mbody.kernels.forces import KINDS as ACTION_KINDS
from mbody.laws import Cam, Function, Harmonic, Polynomial, Rise, Table
from mbody.model.loads import CentrifugalField, PistonPressure, ReciprocatingCylinder
from mbody.testing import check_joint, check_load
from tests.support.own_elements import ON_GROUND, I, J

SWING = Harmonic(mean=1.5, amplitude=0.4, frequency=3.0)
CURVE = Table([-9.0, -2.0, 0.0, 1.0, 3.0, 9.0], [-5.0, -1.0, 0.0, 0.2, 2.0, 9.0])
SHAKY = Table(np.linspace(0.0, 1.0, 12), 1.5 + 0.1 * np.sin(7.0 * np.arange(12)))


def swing(t):
    return 1.5 + 0.3 * np.sin(2.0 * t)


def swing_rate(t):
    return 0.6 * np.cos(2.0 * t)


def swing_acceleration(t):
    return -1.2 * np.sin(2.0 * t)


def oval(x):
    return 1.2 + 0.1 * np.cos(2.0 * x)


def hardening(x):
    return 3.0 * x + x**3


GIVEN = Function(swing, swing_rate, swing_acceleration)
OVAL = Harmonic(mean=1.1, amplitude=0.1, frequency=2.0, phase=0.4)
PROGRAM = Cam([Rise("4-5-6-7", 0.3, 0.2, 2.0, base=0.9), Rise("4-5-6-7", -0.3, 0.0, 3.0)], math.tau)

CONSTRAINTS = [
    mbody.Revolute("joint", "bar.P", "arm.Q"),
    mbody.Revolute("joint", "ground.O", "arm.Q"),
    mbody.Revolute("joint", "bar.P", "ground.O"),
    mbody.Prismatic("joint", I, J),
    mbody.Prismatic("joint", ON_GROUND, J),
    mbody.Prismatic("joint", J, ON_GROUND),
    mbody.Fixed("joint", I, J),
    mbody.Fixed("joint", ON_GROUND, J),
    mbody.Distance("joint", I, J, length=1.3),
    mbody.Distance("joint", ON_GROUND, J, length=1.3),
    mbody.PinSlot("joint", I, J),
    mbody.PinSlot("joint", ON_GROUND, J),
    mbody.Gear("joint", I, J, radius_i=0.9, radius_j=0.5, phase=0.4),
    mbody.Gear("joint", I, J, radius_i=0.9, radius_j=0.5, internal=True),
    mbody.Gear("joint", ON_GROUND, J, radius_i=0.3, radius_j=1.1, internal=True),
    mbody.RackPinion("joint", I, J, radius=0.6, offset=0.3),
    mbody.RackPinion("joint", ON_GROUND, J, radius=0.6),
    mbody.Rolling("joint", I, J, radius=0.6, offset=0.3),
    mbody.Rolling("joint", ON_GROUND, J, radius=0.6),
    mbody.Rolling("joint", J, ON_GROUND, radius=0.6),
    mbody.Rolling("joint", I, J, radius=0.6, on_radius=0.9, phase=0.2),
    mbody.Rolling("joint", I, J, radius=0.4, on_radius=1.3, internal=True),
    mbody.Rolling("joint", ON_GROUND, J, radius=1.4, on_radius=0.3, internal=True),
    mbody.CamFollower("joint", I, J, OVAL, roller=0.1),
    mbody.CamFollower("joint", J, ON_GROUND, OVAL, base_radius=0.3, clockwise=True),
    mbody.CamFollower("joint", ON_GROUND, J, PROGRAM),
    mbody.CamFollower("joint", I, J, OVAL, flat=True),
    mbody.CamFollower("joint", ON_GROUND, J, Function(oval), flat=True, clockwise=True),
    mbody.AngleDriver("driver", "bar", SWING),
    mbody.AngleDriver("driver", "bar", SWING, relative_to="arm"),
    mbody.AngleDriver("driver", "bar", SHAKY),
    mbody.AngleDriver("driver", "bar", GIVEN),
    mbody.AngleDriver("driver", "bar", Rise("3-4-5", 0.5, 0.2, 0.6)),
    mbody.DistanceDriver("driver", I, J, SWING),
    mbody.DistanceDriver("driver", ON_GROUND, J, SHAKY),
    mbody.CoordinateDriver("driver", I, J, SWING),
    mbody.CoordinateDriver("driver", ON_GROUND, J, Function(swing)),
]

CYCLE = Table(np.linspace(0.0, 2.0 * np.pi, 5), [1.0, 3.0, 2.0, 0.5, 1.0], periodic=True)
CYLINDER = {"area": 0.5, "near": 2.0, "far": -1.0, "clearance": 0.4, "delivery": 1.5}

LOADS = [
    mbody.Gravity("load", y=-9.81),
    mbody.Gravity("load", x=SWING, y=-9.81),
    CentrifugalField("load", ON_GROUND, speed=3.0),
    CentrifugalField("load", ON_GROUND, speed=SWING),
    CentrifugalField("load", ON_GROUND, momentum=3.0, inertia=0.7),
    mbody.Force("load", J, 3.0, angle=0.4),
    mbody.Force("load", J, SHAKY, angle=0.4),
    mbody.Force("load", J, 3.0, angle=0.4, follows=True),
    mbody.Force("load", "arm.Q", Function(swing), angle=0.4, follows=True),
    mbody.Torque("load", "arm", value=3.0),
    mbody.Torque("load", "arm", by="bar", value=SWING),
    mbody.Spring("load", I, J, stiffness=20.0, free_length=0.7, preload=0.3),
    mbody.Spring("load", ON_GROUND, J, stiffness=20.0, free_length=0.7),
    mbody.Spring("load", I, J, free_length=0.7, law=CURVE),
    mbody.Spring("load", I, J, law=Function(hardening)),
    mbody.Damper("load", I, J, coefficient=2.0),
    mbody.Damper("load", ON_GROUND, J, coefficient=2.0),
    mbody.Damper("load", I, J, law=CURVE),
    mbody.Damper("load", I, J, law=Function(hardening)),
    mbody.TorsionSpring("load", "arm", stiffness=3.0, free_angle=0.2, preload=0.1),
    mbody.TorsionSpring("load", "arm", by="bar", law=Function(hardening)),
    mbody.TorsionSpring("load", "arm", law=CURVE),
    mbody.TorsionDamper("load", "arm", coefficient=0.3),
    mbody.TorsionDamper("load", "arm", by="bar", law=CURVE),
    mbody.TorsionDamper("load", "arm", law=Polynomial((0.0, 1.0, 0.0, 2.0))),
    PistonPressure("load", I, J, "crank", 0.5, 0.4, head=CYCLE, rod=0.3, phase=0.2),
    PistonPressure("load", ON_GROUND, J, "arm", 0.5, 0.4, head=2.0, rod=Function(hardening)),
    ReciprocatingCylinder("load", I, J, bulk_modulus=3.0, **CYLINDER),
    ReciprocatingCylinder("load", J, ON_GROUND, opposite_area=0.3, bulk_modulus=3.0, **CYLINDER),
    ReciprocatingCylinder("load", ON_GROUND, J, exponent=1.3, ambient=1.0, **CYLINDER),
]


def titles(elements):
    return [f"{type(e).__name__}-{n}" for n, e in enumerate(elements)]


@pytest.mark.parametrize("element", CONSTRAINTS, ids=titles(CONSTRAINTS))
def test_constraints(element):
    report = check_joint(element)
    assert report.worst < 1e-8
    assert report["Φ_q"].error < 1e-11  # differences of sixth order leave rounding over the step
    assert report["pickle"].error == 0.0
    asked = {check.name for check in report.checks if not math.isnan(check.error)}
    assert {"action = reaction", "world", "description", "full rank", "γ"} <= asked


@pytest.mark.parametrize("element", LOADS, ids=titles(LOADS))
def test_loads(element):
    report = check_load(element)
    assert report.worst < 1e-8
    assert report["pickle"].error == 0.0
    external = isinstance(element, mbody.Gravity | mbody.Force | CentrifugalField)
    assert math.isnan(report["action = reaction"].error) == external
    still = not isinstance(element, mbody.Damper | mbody.TorsionDamper | ReciprocatingCylinder)
    assert report["velocity"].note.startswith("its forces do not") == still
    follower = isinstance(element, mbody.Force) and element.follows
    by_angle = isinstance(element, PistonPressure)
    assert (report["conservative"].error < 1e-8) == (still and not follower and not by_angle)


def test_every_kind_is_met():
    machine = mbody.Mechanism("all", ground={"O": (0.0, 0.0)})
    points = {"P": (1, 0), "Q": (0, 1)}
    names = ("bar", "arm", "crank")
    bodies = [mbody.Body(name, mass=1.0, points=points, spread="point") for name in names]
    machine.add(*bodies)
    parts = [
        *CONSTRAINTS,
        *LOADS,
        mbody.AngleCoupling("sum", [mbody.CouplingTerm(1.0, angle="bar")]),
    ]
    parts.append(mbody.AngleDriver("follow", "bar", "0.5*arm.angle"))
    machine.add(*(dataclasses.replace(e, name=f"{e.name} {n}") for n, e in enumerate(parts)))
    layout = mbody.assemble(machine).layout
    # rates of slipping have no Φ: tests of friction difference them in time
    slipping = {"face_slip", "roller_slip", "belt"}
    # those of what touches are differenced in tests/contact
    slipping |= {"clearance", "slipping", "contour"}
    assert {KINDS[k] for k in layout.primitive_kind} == {*KINDS} - {"user"} - slipping
    assert {ACTION_KINDS[k] for k in layout.action_kind} == {*ACTION_KINDS} - {"user"}


@pytest.mark.parametrize("check", [check_joint, check_load])
def test_only_elements_are_checked(check):
    with pytest.raises(TypeError, match="takes a"):
        check(mbody.Body("bar"))
