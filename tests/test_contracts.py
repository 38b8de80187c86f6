"""Every joint, driver and load obeys its contract; wrong ones are caught, with the right sentence.

An oracle of its own differentiates the physics of the built-in kinds by complex steps, in a process
without compiler.
"""

import dataclasses
import importlib
import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import mbody
from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CamFollower,
    CoordinateDriver,
    CouplingTerm,
    Damper,
    Distance,
    DistanceDriver,
    Fixed,
    Force,
    Gear,
    Gravity,
    Marker,
    Mechanism,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from mbody.kernels.constraints import KINDS
from mbody.kernels.forces import KINDS as ACTION_KINDS
from mbody.kernels.output import PER_PRIMITIVE
from mbody.laws import Cam, ConstantSpeed, Function, Harmonic, Polynomial, Rise, Table
from mbody.model.element import number_field
from mbody.model.joints import CustomJoint
from mbody.model.loads import CentrifugalField, CustomLoad, PistonPressure, ReciprocatingCylinder
from mbody.testing import Check, Report, check_joint, check_load

ROOT = Path(__file__).parents[1]
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


# -- what is built in ------------------------------------------------------------------------------

I, J = Marker("bar", "P", 0.3), Marker("arm", (0.2, 0.5), -0.7)
ON_GROUND = Marker("ground", (1.0, -2.0), 0.4)
GIVEN = Function(swing, swing_rate, swing_acceleration)
OVAL = Harmonic(mean=1.1, amplitude=0.1, frequency=2.0, phase=0.4)
PROGRAM = Cam([Rise("4-5-6-7", 0.3, 0.2, 2.0, base=0.9), Rise("4-5-6-7", -0.3, 0.0, 3.0)], math.tau)

CONSTRAINTS = [
    Revolute("joint", "bar.P", "arm.Q"),
    Revolute("joint", "ground.O", "arm.Q"),
    Revolute("joint", "bar.P", "ground.O"),
    Prismatic("joint", I, J),
    Prismatic("joint", ON_GROUND, J),
    Prismatic("joint", J, ON_GROUND),
    Fixed("joint", I, J),
    Fixed("joint", ON_GROUND, J),
    Distance("joint", I, J, length=1.3),
    Distance("joint", ON_GROUND, J, length=1.3),
    PinSlot("joint", I, J),
    PinSlot("joint", ON_GROUND, J),
    Gear("joint", I, J, radius_i=0.9, radius_j=0.5, phase=0.4),
    Gear("joint", I, J, radius_i=0.9, radius_j=0.5, internal=True),
    Gear("joint", ON_GROUND, J, radius_i=0.3, radius_j=1.1, internal=True),
    RackPinion("joint", I, J, radius=0.6, offset=0.3),
    RackPinion("joint", ON_GROUND, J, radius=0.6),
    Rolling("joint", I, J, radius=0.6, offset=0.3),
    Rolling("joint", ON_GROUND, J, radius=0.6),
    Rolling("joint", J, ON_GROUND, radius=0.6),
    Rolling("joint", I, J, radius=0.6, on_radius=0.9, phase=0.2),
    Rolling("joint", I, J, radius=0.4, on_radius=1.3, internal=True),
    Rolling("joint", ON_GROUND, J, radius=1.4, on_radius=0.3, internal=True),
    CamFollower("joint", I, J, OVAL, roller=0.1),
    CamFollower("joint", J, ON_GROUND, OVAL, base_radius=0.3, clockwise=True),
    CamFollower("joint", ON_GROUND, J, PROGRAM),
    CamFollower("joint", I, J, OVAL, flat=True),
    CamFollower("joint", ON_GROUND, J, Function(oval), flat=True, clockwise=True),
    AngleDriver("driver", "bar", SWING),
    AngleDriver("driver", "bar", SWING, relative_to="arm"),
    AngleDriver("driver", "bar", SHAKY),
    AngleDriver("driver", "bar", GIVEN),
    AngleDriver("driver", "bar", Rise("3-4-5", 0.5, 0.2, 0.6)),
    DistanceDriver("driver", I, J, SWING),
    DistanceDriver("driver", ON_GROUND, J, SHAKY),
    CoordinateDriver("driver", I, J, SWING),
    CoordinateDriver("driver", ON_GROUND, J, Function(swing)),
]

CYCLE = Table(np.linspace(0.0, 2.0 * np.pi, 5), [1.0, 3.0, 2.0, 0.5, 1.0], periodic=True)
CYLINDER = {"area": 0.5, "near": 2.0, "far": -1.0, "clearance": 0.4, "delivery": 1.5}

LOADS = [
    Gravity("load", y=-9.81),
    Gravity("load", x=SWING, y=-9.81),
    CentrifugalField("load", ON_GROUND, speed=3.0),
    CentrifugalField("load", ON_GROUND, speed=SWING),
    CentrifugalField("load", ON_GROUND, momentum=3.0, inertia=0.7),
    Force("load", J, 3.0, angle=0.4),
    Force("load", J, SHAKY, angle=0.4),
    Force("load", J, 3.0, angle=0.4, follows=True),
    Force("load", "arm.Q", Function(swing), angle=0.4, follows=True),
    Torque("load", "arm", value=3.0),
    Torque("load", "arm", by="bar", value=SWING),
    Spring("load", I, J, stiffness=20.0, free_length=0.7, preload=0.3),
    Spring("load", ON_GROUND, J, stiffness=20.0, free_length=0.7),
    Spring("load", I, J, free_length=0.7, law=CURVE),
    Spring("load", I, J, law=Function(hardening)),
    Damper("load", I, J, coefficient=2.0),
    Damper("load", ON_GROUND, J, coefficient=2.0),
    Damper("load", I, J, law=CURVE),
    Damper("load", I, J, law=Function(hardening)),
    TorsionSpring("load", "arm", stiffness=3.0, free_angle=0.2, preload=0.1),
    TorsionSpring("load", "arm", by="bar", law=Function(hardening)),
    TorsionSpring("load", "arm", law=CURVE),
    TorsionDamper("load", "arm", coefficient=0.3),
    TorsionDamper("load", "arm", by="bar", law=CURVE),
    TorsionDamper("load", "arm", law=Polynomial((0.0, 1.0, 0.0, 2.0))),
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
    external = isinstance(element, Gravity | Force | CentrifugalField)
    assert math.isnan(report["action = reaction"].error) == external
    still = not isinstance(element, Damper | TorsionDamper | ReciprocatingCylinder)
    assert report["velocity"].note.startswith("its forces do not") == still
    follower = isinstance(element, Force) and element.follows
    by_angle = isinstance(element, PistonPressure)
    assert (report["conservative"].error < 1e-8) == (still and not follower and not by_angle)


def test_every_kind_is_met():
    machine = Mechanism("all", ground={"O": (0.0, 0.0)})
    points = {"P": (1, 0), "Q": (0, 1)}
    names = ("bar", "arm", "crank")
    bodies = [Body(name, mass=1.0, points=points, spread="point") for name in names]
    machine.add(*bodies)
    parts = [*CONSTRAINTS, *LOADS, AngleCoupling("sum", [CouplingTerm(1.0, angle="bar")])]
    machine.add(*(dataclasses.replace(e, name=f"{e.name} {n}") for n, e in enumerate(parts)))
    layout = mbody.assemble(machine).layout
    assert {KINDS[k] for k in layout.primitive_kind} == {*KINDS} - {"user"}
    assert {ACTION_KINDS[k] for k in layout.action_kind} == {*ACTION_KINDS} - {"user"}


def test_sizes_and_times_are_chosen():
    # in millimetres, with a law that is defined late
    law = Table([100.0, 101.0, 103.0], [400.0, 450.0, 300.0])
    driver = DistanceDriver("cylinder", "bar.P", "arm.Q", law)
    assert check_joint(driver, length=300.0, times=(100.0, 103.0)).worst < 1e-8
    assert check_joint(Distance("rod", "a.P", "b.Q", length=1e-3), length=1e-3).worst < 1e-8
    with pytest.raises(AssertionError, match=r"'cylinder': finite: Φ has .* `times`"):
        check_joint(driver)


def test_a_report_reads():
    report = check_joint(AngleDriver("motor", "crank", 0.5), states=3)
    assert str(report).splitlines()[0] == "AngleDriver 'motor': 3 states, tolerance 1e-08"
    assert "moved, not turned" in str(report)
    assert report["no work"] == Check("no work", 0.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        report.states = 4
    assert Report("x", 1, 1.0, (Check("a", 2.0, required=False), Check("b", math.nan))).worst == 0.0


@pytest.mark.parametrize("check", [check_joint, check_load])
def test_only_elements_are_checked(check):
    with pytest.raises(TypeError, match="takes a"):
        check(Body("bar"))


# -- users' own ------------------------------------------------------------------------------------


def turned(side, x, y):
    return side[3] * x - side[4] * y, side[4] * x + side[3] * y


@dataclass(frozen=True)
class PointOnLine(CustomJoint):
    """Pin in a slot: the place on j stays on the x axis of the marker on i."""

    rows = "l"

    def physics(self, i, j, p, t):
        """Φ = n·d;  γ = ω²n·d − 2ω (k×n)·ḋ − n·(rest of d̈)."""
        pix, piy = turned(i, p[0], p[1])
        pjx, pjy = turned(j, p[2], p[3])
        nx, ny = turned(i, -math.sin(p[4]), math.cos(p[4]))
        w, wj = i[7], j[7]
        dx, dy = j[0] + pjx - i[0] - pix, j[1] + pjy - i[1] - piy
        dvx = j[5] - wj * pjy - i[5] + w * piy
        dvy = j[6] + wj * pjx - i[6] - w * pix
        rest = nx * (w * w * pix - wj * wj * pjx) + ny * (w * w * piy - wj * wj * pjy)
        bi = nx * dy - ny * dx + nx * piy - ny * pix
        blocks = (-nx, -ny, bi, 0, 0, 0, nx, ny, ny * pjx - nx * pjy, 0, 0, 0)
        gamma = w * w * (nx * dx + ny * dy) - 2.0 * w * (nx * dvy - ny * dvx) - rest
        return (nx * dx + ny * dy, 0.0), blocks, (0.0, 0.0), (gamma, 0.0)


@dataclass(frozen=True)
class OwnRevolute(CustomJoint):
    """A pin like the built-in one."""

    rows = "ll"

    def physics(self, i, j, p, t):
        pix, piy = turned(i, p[0], p[1])
        pjx, pjy = turned(j, p[2], p[3])
        wi, wj = i[7] ** 2, j[7] ** 2
        phi = i[0] + pix - j[0] - pjx, i[1] + piy - j[1] - pjy
        blocks = (1, 0, -piy, 0, 1, pix, -1, 0, pjy, 0, -1, -pjx)
        return phi, blocks, (0, 0), (wi * pix - wj * pjx, wi * piy - wj * pjy)


@dataclass(frozen=True)
class Drag(CustomLoad):
    """Air drag F = −c v at a place on j, by the ground."""

    coefficient: float = number_field("damping", 0.5)

    def physics(self, i, j, p, t):
        px, py = turned(j, p[2], p[3])
        fx = -self.coefficient * (j[5] - j[7] * py)
        fy = -self.coefficient * (j[6] + j[7] * px)
        x, y = j[0] + px, j[1] + py
        return -fx, -fy, -(x * fy - y * fx), fx, fy, px * fy - py * fx


@dataclass(frozen=True)
class Attraction(CustomLoad):
    """Inverse-square attraction of two places."""

    strength: float = 2.0

    def physics(self, i, j, p, t):
        pix, piy = turned(i, p[0], p[1])
        pjx, pjy = turned(j, p[2], p[3])
        dx, dy = j[0] + pjx - i[0] - pix, j[1] + pjy - i[1] - piy
        f = self.strength / (dx * dx + dy * dy) ** 1.5
        fx, fy = f * dx, f * dy
        return fx, fy, pix * fy - piy * fx, -fx, -fy, pjy * fx - pjx * fy


@pytest.mark.parametrize(
    "element",
    [
        PointOnLine("slot", I, J),
        PointOnLine("slot", ON_GROUND, J),
        PointOnLine("slot", J, ON_GROUND),
        OwnRevolute("pin", I, J),
    ],
    ids=str,
)
def test_own_joints(element):
    report = check_joint(element)
    assert report.worst < 1e-8
    assert report["pickle"].error == 0.0


def test_own_loads():
    drag, pull = check_load(Drag("drag", "ground", J)), check_load(Attraction("pull", I, J))
    assert max(drag.worst, pull.worst) < 1e-8
    assert drag["dissipation"].note == "it never gives power"
    assert drag["velocity"].note == "its forces depend on velocities"
    assert pull["conservative"].note == "it has a potential"
    assert drag["pickle"].error == pull["pickle"].error == 0.0


def test_a_class_without_a_name_is_not_pickled():
    class Local(OwnRevolute):
        pass

    report = check_joint(Local("pin", I, J), states=2)
    assert math.isnan(report["pickle"].error)
    assert "no name in a module" in report["pickle"].note
    report = check_load(Force("push", J, lambda t: 2.0 * t), states=2)
    assert math.isnan(report["pickle"].error)


def test_own_revolute_is_the_built_in_one():
    run, own = (
        mbody.kinetostatics(machine, t=np.linspace(0.0, 0.6, 30))
        for machine in (four_bar(Revolute), four_bar(OwnRevolute))
    )
    scale = np.abs(run.effort("motor")).max()
    assert np.abs(run.effort("motor") - own.effort("motor")).max() < 1e-11 * scale
    for a, b in zip(forces_at(run, "B"), forces_at(own, "B"), strict=True):
        assert np.abs(a - b).max() < 1e-11 * run.reaction("B").magnitude.max()


def four_bar(kind):
    plain = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
    machine = Mechanism("four-bar", ground=plain.ground.points)
    for element in plain:
        swap = element.name == "B"
        machine.add(kind("B", element.i, element.j) if swap else element)
    return machine


def forces_at(run, joint):
    reaction = run.reaction(joint)
    return reaction.fx, reaction.fy, reaction.torque


def test_pin_in_a_slot_is_a_massless_block_on_a_guide():
    def quick_return(*parts):
        machine = Mechanism("quick return", ground={"O": (0.0, 1.5)})
        machine.add(
            mbody.makers.bar("crank", 1.0, mass=1.0, ends=("O", "A"), guess=0.3),
            mbody.makers.bar("lever", 3.0, mass=2.0, ends=("L", "E"), guess=1.2),
            Revolute("O", "ground.O", "crank.O"),
            Revolute("L", "ground", "lever.L"),
            AngleDriver("motor", "crank", ConstantSpeed(0.3, 4.0)),
            Torque("work", "lever", value=7.0),
            *parts,
        )
        return mbody.kinetostatics(machine, t=np.linspace(0.0, 1.5, 40))

    slot = quick_return(PointOnLine("slot", "lever.L", "crank.A"))
    block = quick_return(
        Body("block"), Revolute("pin", "crank.A", "block"), Prismatic("slot", "lever.L", "block")
    )
    a = 0.3 + 4.0 * slot.t
    lever = np.unwrap(np.arctan2(1.5 + np.sin(a), np.cos(a)))
    assert np.abs(slot["lever"].angle - lever).max() < 1e-12
    scale = np.abs(block.effort("motor")).max()
    assert np.abs(slot.effort("motor") - block.effort("motor")).max() < 1e-11 * scale
    size = block.reaction("slot").magnitude.max()
    for n in (0, 1):
        one, other = forces_at(slot, "slot")[n], forces_at(block, "slot")[n]
        assert np.abs(one - other).max() < 1e-11 * size
    assert slot.checks.virtual_work < 1e-12


# -- wrong ones ------------------------------------------------------------------------------------


def changed(base, change):
    """A class like `base` whose physics is changed afterwards."""

    class Wrong(base):
        def physics(self, i, j, p, t):
            return change(*super().physics(i, j, p, t), i=i, j=j, t=t)

    return Wrong("wrong", I, J)


def wrong_joint(change, base=PointOnLine):
    def apply(phi, blocks, nu, gamma, i, j, t):
        parts = {"phi": phi, "blocks": blocks, "nu": nu, "gamma": gamma}
        parts |= change(**parts, i=i, j=j, t=t)
        return parts["phi"], parts["blocks"], parts["nu"], parts["gamma"]

    return changed(base, apply)


WRONG_JOINTS = {
    r"Φ_q: row 0 has .* ∂Φ/∂θ of 'arm' = ": lambda blocks, **_: {
        "blocks": (*blocks[:8], -blocks[8], *blocks[9:])
    },
    r"Φ_q: row 0 has .* ∂Φ/∂θ of 'bar' = ": lambda blocks, **_: {
        "blocks": (*blocks[:2], 1.01 * blocks[2], *blocks[3:])
    },
    r"γ: row 0 has .* Φ_q a − d²Φ/dt² = ": lambda gamma, i, **_: {
        "gamma": (gamma[0] + 1e-3 * i[7] ** 2, 0.0)
    },
    r"ν: row 0 has 0, but differences of Φ give −∂Φ/∂t = -0\.1": lambda phi, t, **_: {
        "phi": (phi[0] + 0.1 * t, 0.0)
    },
    r"position only: Φ, Φ_q and ν of row 0": lambda phi, i, **_: {"phi": (phi[0] + i[7], 0.0)},
    r"padding: beyond its own rows": lambda phi, **_: {"phi": (phi[0], 1.0)},
    r"'wrong' failed: ValueError: physics gave a number that is not finite": lambda **_: {
        "gamma": (math.inf, 0.0)
    },
    r"'wrong' failed: ZeroDivisionError": lambda **_: {"gamma": (1.0 / 0.0, 0.0)},
}


@pytest.mark.parametrize("sentence", WRONG_JOINTS)
def test_wrong_joints_are_caught(sentence):
    with pytest.raises(AssertionError, match="^Wrong 'wrong': .*" + sentence) as caught:
        check_joint(wrong_joint(WRONG_JOINTS[sentence]))
    assert "state 0 of seed 0: t = 0." in str(caught.value)
    assert "mass centre of 'bar' at (x, y, θ) = (" in str(caught.value)


@dataclass(frozen=True)
class Tackle(CustomJoint):
    """y_j = 2 y_i: right derivatives, but something must pull the difference."""

    def physics(self, i, j, p, t):
        return (j[1] - 2.0 * i[1], 0), (0, -2, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0), (0, 0), (0, 0)


@dataclass(frozen=True)
class AxesOnly(CustomJoint):
    """Equal angles of the bodies' axes, whatever the markers say."""

    rows = "a"

    def physics(self, i, j, p, t):
        return (j[2] - i[2], 0), (0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0), (0, 0), (0, 0)


@dataclass(frozen=True)
class Twice(CustomJoint):
    """The same row twice."""

    rows = "aa"

    def physics(self, i, j, p, t):
        phi = j[2] + p[5] - i[2] - p[4]
        return (phi, phi), (0, 0, -1, 0, 0, -1, 0, 0, 1, 0, 0, 1), (0, 0), (0, 0)


@dataclass(frozen=True)
class Never(CustomJoint):
    """Φ = (θ_j − θ_i)² + 1 has no zero."""

    rows = "a"

    def physics(self, i, j, p, t):
        x, w = j[2] + p[5] - i[2] - p[4], j[7] - i[7]
        block = (0, 0, -2 * x, 0, 0, 0, 0, 0, 2 * x, 0, 0, 0)
        return (x * x + 1.0, 0), block, (0, 0), (-2.0 * w * w, 0)


@dataclass(frozen=True)
class Level(CustomJoint):
    """Both mass centres at one height: the world's y axis is nobody's."""

    def physics(self, i, j, p, t):
        return (j[1] - i[1], 0), (0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0), (0, 0), (0, 0)


class Incomparable(OwnRevolute):
    """Equal to nothing but itself."""

    __eq__ = object.__eq__
    __hash__ = object.__hash__


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        (Tackle, "description: Φ of row 0 must not change"),
        (AxesOnly, "description: Φ of row 0 must not change when the bodies get other axes"),
        (Twice, "full rank: of its 2 rows only 1 are independent"),
        (Never, "closed: no place with Φ = 0 found"),
        (Level, "description"),
        (Incomparable, "equality: it is not equal to its copy"),
    ],
)
def test_joints_that_are_no_joints(kind, sentence):
    with pytest.raises(AssertionError, match=f"^{kind.__name__} 'wrong': {sentence}"):
        check_joint(kind("wrong", I, J))


def test_reactions_that_do_not_balance():
    # the places alone, so that the description is in order: y_j = 2 y_i
    @dataclass(frozen=True)
    class Places(CustomJoint):
        def physics(self, i, j, p, t):
            pix, piy = turned(i, p[0], p[1])
            pjx, pjy = turned(j, p[2], p[3])
            blocks = (0, -2, -2 * pix, 0, 0, 0, 0, 1, pjx, 0, 0, 0)
            gamma = j[7] ** 2 * pjy - 2.0 * i[7] ** 2 * piy
            return (j[1] + pjy - 2.0 * (i[1] + piy), 0), blocks, (0, 0), (gamma, 0)

    with pytest.raises(AssertionError, match=r"'wrong': action = reaction: .* leaves a force of"):
        check_joint(Places("wrong", I, J))


def test_what_a_solution_tells_is_what_is_checked(monkeypatch):
    def tampered(L, W, *rest):
        breakdown(L, W, *rest)
        rest[-1][:, :, 4::PER_PRIMITIVE] += 1e-6

    bench = importlib.import_module("mbody.testing.bench")
    breakdown = bench.breakdown
    monkeypatch.setattr(bench, "breakdown", tampered)
    with pytest.raises(AssertionError, match=r"'pin': action = reaction: .* leaves a moment about"):
        check_joint(Revolute("pin", I, J))


def wrong_load(change):
    return changed(Attraction, lambda *f, i, j, t: change(*f, i, j))


WRONG_LOADS = {
    r"action = reaction: .* leaves a force of .*; it must sum to zero": (
        lambda *f: (0.0, 0.0, 0.0, *f[3:6])
    ),
    r"action = reaction: .* leaves a moment about": lambda *f: (*f[:2], -f[2], *f[3:6]),
    r"world: with the whole world moved, its forces do not go along": (
        lambda *f: tuple((2.0 + math.sin(f[6][0])) * x for x in f[:6])
    ),
    r"description: its forces must not change": (
        lambda *f: tuple((2.0 + math.sin(f[6][2] - f[7][2])) * x for x in f[:6])
    ),
    r"'wrong' failed: ValueError: physics gave 5 numbers, 6 are wanted": lambda *f: f[:5],
}


@pytest.mark.parametrize("sentence", WRONG_LOADS)
def test_wrong_loads_are_caught(sentence):
    with pytest.raises(AssertionError, match="^Wrong 'wrong': .*" + sentence) as caught:
        check_load(wrong_load(WRONG_LOADS[sentence]))
    assert "state 0 of seed 0: t = 0." in str(caught.value)


def test_a_damper_that_pushes():
    with pytest.raises(AssertionError, match=r"'c': dissipation: it gives the power .* only takes"):
        check_load(Damper("c", I, J, law=Polynomial((0.5, 1.0))))


# -- the oracle ------------------------------------------------------------------------------------

PLAIN = r"""
import json
import sys
import traceback

import numpy as np

import mbody
from mbody.kernels import rows
from mbody.testing import check_joint, check_load

assert rows.rows.__class__.__name__ == "function", "this must run without compiler"
H = 1e-30
rng = np.random.default_rng(3)


def side(q, v):
    return *q, np.cos(q[2]), np.sin(q[2]), *v


def physics(kind, q, v, p, f):
    i, j = side(q[:3], v[:3]), side(q[3:], v[3:])
    if kind in ("roller", "face"):
        # the sense of turning is 1 or -1; the law, of period π, is asked at the angle of the ray
        n = 5 if kind == "roller" else 6
        p = (*p[:n], np.sign(p[n]), *p[n + 1 :])
        x, y = getattr(rows, kind + "_ray")(i, j, p)
        angle = 2.0 * np.arctan(y / x) + 0.4
        f = 0.3 * np.sin(angle), 0.6 * np.cos(angle), -1.2 * np.sin(angle)
    return getattr(rows, kind)(i, j, p, f)


def matrix(blocks):
    return np.array(blocks).reshape(2, 2, 3).transpose(1, 0, 2).reshape(2, 6)


def worst(found, expected):
    return float(np.abs(found - expected).max() / max(1.0, np.abs(expected).max()))


result = {}
for kind in rows.KINDS:
    if kind in ("user", "sum"):
        continue
    errors = np.zeros(3)
    for _ in range(50):
        q, v, p = rng.normal(size=6), rng.normal(size=6), tuple(rng.normal(size=7))
        f = rng.normal(size=3)
        _, blocks, nu, gamma = physics(kind, q, v, p, f)
        for m in range(6):
            phi = physics(kind, q + 1j * H * np.eye(6)[m], v, p, f)[0]
            errors[0] = max(errors[0], worst(matrix(blocks)[:, m], np.imag(phi) / H))
        # along the motion q + v s at t + s, where the law has moved on too
        later = f + 1j * H * np.array([f[1], f[2], 0.0])
        phi = physics(kind, q, v, p, later)[0]
        errors[1] = max(errors[1], worst(np.array(nu), -np.imag(phi) / H))
        _, ahead, nu, _ = physics(kind, q + 1j * H * v, v, p, later)
        rate = matrix(ahead) @ v - np.array(nu)
        errors[2] = max(errors[2], worst(np.array(gamma), -np.imag(rate) / H))
    result[kind] = errors.tolist()

machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
try:
    rough = {"coupler": 1.3, "rocker": 2.8}
    run = mbody.kinetostatics(machine, t=[0.0, 0.02, 0.04], guess=rough)
    b = run.reaction("B")
    found = run["rocker"].angle, run["rocker"].alpha, run.effort("motor"), b.fx, b.fy
    result["run"], result["failure"] = [history.tolist() for history in found], ""
except Exception:
    result["failure"] = traceback.format_exc()
result["contracts"] = [
    check_joint(mbody.Revolute("A", "a.P", "b.Q"), states=2).worst,
    check_load(mbody.Spring("s", "a.P", "b.Q", stiffness=2.0), states=2).worst,
]
json.dump(result, sys.stdout)
"""


@pytest.fixture(scope="module")
def plain():
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", PLAIN], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("user", "sum")])
def test_physics_by_complex_step(plain, kind):
    # exact derivatives: what differs is rounding of a few operations on numbers of size one
    blocks, nu, gamma = plain[kind]
    assert blocks < 1e-14
    assert nu < 1e-14
    assert gamma < 1e-14


def test_kernels_without_compiler(plain):
    assert not plain["failure"], plain["failure"]
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
    rough = {"coupler": 1.3, "rocker": 2.8}
    run = mbody.kinetostatics(machine, t=[0.0, 0.02, 0.04], guess=rough)
    b = run.reaction("B")
    found = run["rocker"].angle, run["rocker"].alpha, run.effort("motor"), b.fx, b.fy
    for mine, other in zip(found, plain["run"], strict=True):
        assert np.abs(mine - other).max() < 1e-12 * max(1.0, np.abs(mine).max())


def test_contracts_hold_without_compiler(plain):
    assert max(plain["contracts"]) < 1e-8
