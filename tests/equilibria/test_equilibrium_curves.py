"""Rest positions in rotating fields, and curves of rest positions, against closed forms."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import (
    Body,
    Distance,
    Force,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Spring,
    Torque,
    TorsionSpring,
    assemble,
    equilibrium,
    gallery,
)
from mbody.engineering import equilibrium_curve
from mbody.model.body import Guess
from mbody.model.loads import CentrifugalField
from tests.support.rest_examples import angles, pendulum, whirling
from tests.support.rest_linkages import FAMILIES

pytestmark = pytest.mark.processor

UPRIGHT = Marker("ground", (0.0, 0.0), 0.5 * math.pi)
g = 9.81
#: Newton ends at rounding; angles are of order one.
ANGLE = 1e-11
#: Differences of fourth order with a step of 1e-3: 1e-12 of the forces, times a few.
STIFF = 1e-10


def test_a_pendulum_in_a_field():
    """Below √(g/l) it hangs, above cos θ = g/(ω² l); both with the stiffness of the book."""
    lifts = math.sqrt(g / 0.5)
    slow = equilibrium(whirling(3.0))
    assert len(slow) == 2
    assert f"lifts above {lifts:.6g} rad/s ({lifts * 30 / math.pi:.6g} rpm)" in slow[0].notes[0]
    assert "hangs as without the field" in slow[0].notes[0]
    fast = equilibrium(whirling(6.0))
    lean = math.acos(g / (36.0 * 0.5))
    assert [one.stability for one in fast] == ["stable", "stable", "unstable", "unstable"]
    assert sorted(angles(fast.stable, "rod")) == pytest.approx(
        [-0.5 * math.pi - lean, -0.5 * math.pi + lean], abs=ANGLE
    )
    hand = 2.0 * (g * 0.5 * math.cos(lean) - 36.0 * 0.25 * math.cos(2.0 * lean))
    assert_allclose(fast[0].stiffness, [[hand]], rtol=STIFF)
    assert not any("lifts" in note for one in fast for note in one.notes)


def test_a_free_spindle_is_stiffer():
    """With H constant, not ω, the plane slows down as the mass goes out: K has one term more."""
    momentum, own = 9.0, 0.3
    machine = pendulum(CentrifugalField("field", UPRIGHT, momentum=momentum, inertia=own))
    found = equilibrium(machine)
    stable = found.stable[0]

    def energy(theta):  # from the vertical
        J = own + 2.0 * (0.5 * np.sin(theta)) ** 2
        return momentum**2 / (2.0 * J) - 2.0 * g * 0.5 * np.cos(theta)

    theta = float(stable["rod"].angle[0]) + 0.5 * math.pi
    h = 1e-3
    a, b, c, d, e = (energy(theta + n * h) for n in (-2, -1, 0, 1, 2))
    # differences of fourth order, h⁴ = 1e-12 of the derivatives
    assert abs(8.0 * (d - b) - (e - a)) / (12.0 * h) < 1e-8
    assert_allclose(stable.stiffness, (-a + 16 * b - 30 * c + 16 * d - e) / (12 * h * h), rtol=1e-7)


def test_both_sides_of_a_governor_hang_in_a_singular_position():
    """There each arm is free by itself to first order."""
    found = equilibrium(gallery.load("porter_governor", {"omega": "100 rpm"}), free="theta")
    hanging = found.stable[0]
    assert len(hanging.motions) == 2
    assert any(note.startswith("singular position") for note in hanging.notes)
    lifts = math.sqrt((6.0 + 18.0) / 6.0 * g / 0.3)
    assert any(f"lifts above {lifts:.6g} rad/s" in note for note in hanging.notes)
    # half the weight on each side; rows that depend on each other are solved softened, to 1e-7
    assert_allclose(hanging.reaction("O_l", on="arm_l").fy, 0.5 * 30.0 * g, rtol=1e-7)


def test_a_curve_round_its_fold():
    """A pendulum under a torque gives way at m g l, and rises on the way back."""
    machine = pendulum(Torque("push", "rod", value=0.0))
    curve = equilibrium_curve(machine, "push.value", (-20.0, 20.0), at=0.0)
    theta = curve["rod"].angle
    assert_allclose(curve.values, 2.0 * g * 0.5 * np.cos(theta), atol=1e-11)
    # quadratic in the error of the angle
    assert_allclose(curve.values[list(curve.folds)], [g, -g], rtol=1e-12)
    assert not curve.crossings
    below = np.sin(theta) < -1e-6
    assert (curve.stable == below).all()
    assert "closes on itself" in curve.notes[0]
    assert curve.unit == "N·m"
    # joint forces at every point
    assert_allclose(curve.reaction("O").fy, 2.0 * g, rtol=1e-11)
    assert_allclose(curve.reaction("O").fx, 0.0, atol=1e-11)


def truss(height=0.2, stiffness=1000.0):
    """Two springs that lean on each other: von Mises' truss."""
    machine = Mechanism("von Mises", ground={"A": (-1.0, 0.0), "B": (1.0, 0.0)})
    free_length = math.hypot(1.0, height)
    top = Marker("top", (0.0, 0.0), 0.5 * math.pi)
    machine.add(
        Body("top", guess=Guess(0.0, 0.0, height)),
        Prismatic("guide", UPRIGHT, top),
        Spring("a", "ground.A", "top", stiffness=stiffness, free_length=free_length),
        Spring("b", "ground.B", "top", stiffness=stiffness, free_length=free_length),
        Force("P", "top", 0.0, angle=-0.5 * math.pi),
    )
    return machine


def test_von_mises_truss_snaps_through():
    """P(y) = 2k (l₀/l − 1) y; folds where l³ = l₀, both ways."""
    start = {"top": (0.0, 0.2, 0.0)}
    curve = equilibrium_curve(truss(), "P.value", (-10.0, 10.0), at=0.0, start=start)
    y, l0 = curve["top"].y, math.hypot(1.0, 0.2)
    assert_allclose(curve.values, 2000.0 * (l0 / np.hypot(1.0, y) - 1.0) * y, atol=1e-9)
    at = math.sqrt(l0 ** (2.0 / 3.0) - 1.0)
    P = 2000.0 * (l0 ** (2.0 / 3.0) - 1.0) * at
    assert_allclose(curve.values[list(curve.folds)], [P, -P], rtol=1e-11)
    assert_allclose(y[list(curve.folds)], [at, -at], rtol=1e-6)  # flat there
    middle = (np.abs(y) < at - 1e-5).nonzero()[0]
    outside = (np.abs(y) > at + 1e-5).nonzero()[0]
    assert not curve.stable[middle].any() and curve.stable[outside].all()
    assert curve.values[-1] == 10.0


def test_a_curve_along_a_length_that_constraints_hold():
    """A rod's length changes: the position follows at once. A weight hangs on two strings."""
    machine = Mechanism("hanging", ground={"A": (-1.0, 0.0), "B": (1.0, 0.0)})
    machine.add(
        Body("weight", mass=2.0, inertia=0.0, guess=(0.3, -1.0, 0.0)),
        Distance("string", "ground.A", "weight", length=1.5),
        Spring("spring", "ground.B", "weight", stiffness=30.0, free_length=0.5),
        TorsionSpring("upright", "weight", stiffness=5.0),
        Gravity("gravity", y=-g),
    )
    curve = equilibrium_curve(machine, "string.length", (1.5, 2.5))
    x, y = curve["weight"].x, curve["weight"].y
    assert_allclose(np.hypot(x + 1.0, y), curve.values, rtol=1e-12)
    # balance across the string, by hand
    length = np.hypot(x - 1.0, y)
    pull = 30.0 * (length - 0.5) / length
    fx, fy = -pull * (x - 1.0), -pull * y - 2.0 * g
    assert_allclose(fx * y - fy * (x + 1.0), 0.0, atol=1e-9)
    # each point again by a search of its own
    system = assemble(machine).with_values({"string.length": float(curve.values[7])})
    again = equilibrium(system).stable[0]
    assert_allclose([again["weight"].x[0], again["weight"].y[0]], [x[7], y[7]], atol=1e-9)


def test_the_pitchfork_of_a_field():
    """ω₀ = √(g/l): the hanging branch crosses the one that leans, cos θ = g/(ω² l)."""
    lifts = math.sqrt(g / 0.5)
    hanging = equilibrium_curve(whirling(1.0), "field.speed", (0.0, 10.0))
    # between points at which the stiffness still differs from zero, by a straight line
    assert_allclose(hanging.values[list(hanging.crossings)], [lifts], rtol=1e-7)
    assert (hanging.stable == (hanging.values < lifts - 1e-6)).all()
    assert hanging.values[-1] == 10.0 and not hanging.folds
    lean = equilibrium_curve(whirling(1.0), "field.speed", (10.0, 0.0), start={"rod": -0.2})
    theta = lean["rod"].angle + 0.5 * math.pi
    assert_allclose(np.cos(theta) * lean.values**2, g / 0.5, rtol=1e-7)
    assert_allclose(lean.values[list(lean.crossings)], [lifts], rtol=1e-7)
    assert not lean.folds
    assert theta[0] > 1.0 and theta[-1] < -1.0  # through the crossing to the other side
    away = np.abs(theta) > 1e-3
    assert lean.stable[away].all()


def test_a_curve_from_a_rest_position():
    machine = whirling(6.0)
    start = next(one for one in equilibrium(machine) if one.stability == "stable")
    curve = equilibrium_curve(machine, "field.speed", (6.0, 8.0), start=start)
    assert_allclose(curve["rod"].angle[0], start["rod"].angle[0], atol=ANGLE)
    assert curve.values[-1] == 8.0
    assert (np.diff(curve.arclength) > 0.0).all()


def test_the_side_of_the_first_point_is_that_of_its_tangent():
    """Two freedoms: a tangent that was turned to where the number grows has the other side, else
    the first step seems to go over to another branch. The end is found again without a curve.
    """
    machine = FAMILIES[2][2](np.random.default_rng([47, 5])).machine
    first = float(assemble(machine).values["s0.free_length"])
    curve = equilibrium_curve(machine, "s0.free_length", (0.2 * first, 3.0 * first), at=first)
    assert curve.values[-1] == 3.0 * first and not curve.doubts
    ends = equilibrium(assemble(machine).with_values({"s0.free_length": 3.0 * first}))
    apart = [
        max(
            abs(math.remainder(float(one[body].angle[0] - curve[body].angle[-1]), math.tau))
            for body in one.solution
        )
        for one in ends
    ]
    assert min(apart) < ANGLE


def test_points_that_are_not_enough():
    machine = pendulum(Torque("push", "rod", value=0.0))
    curve = equilibrium_curve(machine, "push.value", (0.0, 20.0), points=5)
    assert len(curve) == 5 and "5 points were not enough" in curve.notes[0]
