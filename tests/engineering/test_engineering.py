"""What a designer makes of a result, against closed forms."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import makers
from mbody.engineering import energy_fluctuation, fluctuation, flywheel, shaking_force
from mbody.laws import ConstantAcceleration, ConstantSpeed
from tests.support.linkages import random_linkage, times_within

TURN = 2.0 * math.pi


def shaft(torque, speed=5.0):
    """A crank alone, whose motor gives that torque against a load."""
    machine = mbody.Mechanism("shaft")
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=2.0),
        mbody.Revolute("O", "ground", "crank"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(0.0, speed)),
        mbody.Torque("load", "crank", value=torque),
    )
    return machine


# -- fluctuation and flywheel -----------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 3, 5])
@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_a_sine(n, speed):
    """T₀ + A sin nθ against T₀: ΔE = 2A/n."""
    T0, A = 40.0, 15.0
    machine = shaft(lambda t: -T0 - A * math.sin(n * speed * t), speed)
    found = fluctuation(mbody.kinetostatics(machine, turn=True, instants=721))
    # the spline's error by its fourth derivative: A n⁴ h⁴ / 384 over an arc of π/n
    off = A * n**4 * (TURN / 720) ** 4 / 384.0 * math.pi / n
    assert found.mean == pytest.approx(T0, rel=1e-13)
    assert abs(found.fluctuation - 2.0 * A / n) < off + 1e-12
    assert found.work == pytest.approx(math.copysign(TURN * T0, speed), rel=1e-13)
    assert found.energy_coefficient == pytest.approx(A / (n * math.pi * T0), rel=1e-6)
    # T_max and T_min at the instants: half a step beside the tops at most
    assert found.torque_coefficient == pytest.approx(2.0 * A / T0, rel=(n * TURN / 1440) ** 2)
    assert math.cos(n * found.at_least) == pytest.approx(1.0, abs=1e-9)
    assert math.cos(n * found.at_greatest) == pytest.approx(-1.0, abs=1e-9)
    assert len(found.energy) == 721 and found.energy[0] == found.energy[-1] == 0.0


def test_extremes_between_instants():
    """Ten instants a wave meet no crossing, and the extremes are found all the same."""
    theta = np.linspace(0.0, TURN, 31) + 0.07
    found = energy_fluctuation(theta, 3.0 * np.cos(3.0 * theta))
    # the spline of ten points a wave is off by (3h)⁴/384 times a few
    assert found.fluctuation == pytest.approx(2.0, rel=(3.0 * TURN / 30) ** 4 / 100.0)
    at_instants = float(np.ptp(found.energy))
    assert at_instants < found.fluctuation - 1e-3
    assert math.sin(3.0 * found.at_greatest) == pytest.approx(1.0, abs=1e-3)


def test_uneven_instants_and_several_turns():
    rng = np.random.default_rng(3)
    inner = np.sort(rng.uniform(0.0, 2.0 * TURN, 1500))
    theta = np.concatenate([[0.0], inner, [2.0 * TURN]])
    found = energy_fluctuation(theta, 7.0 + 2.0 * np.sin(0.5 * theta))
    # the widest gap is some 8 times the mean one
    gap = float(np.diff(theta).max())
    assert found.fluctuation == pytest.approx(8.0, abs=gap**4)
    assert found.mean == pytest.approx(7.0, abs=gap**4)
    assert found.work == pytest.approx(2.0 * TURN * 7.0, abs=14.0 * gap**4)


def test_flywheel():
    """I = ΔE/(C_s ω²); a driver alone has the name of none."""
    run = mbody.kinetostatics(
        shaft(lambda t: -15.0 * math.sin(2.0 * 5.0 * t)), turn=True, instants=721
    )
    inertia = 15.0 / (0.02 * 25.0)
    assert flywheel(run, 0.02) == pytest.approx(inertia, rel=1e-7)
    assert flywheel(run, 0.02, "motor") == flywheel(run, 0.02)


def test_the_flywheel_keeps_the_speed():
    """Energy alone: with that inertia ω² swings by what ΔE makes of it, C_s to second order."""
    A, T0, n, mean, C = 15.0, 40.0, 2, 5.0, 0.02
    run = mbody.kinetostatics(
        shaft(lambda t: -T0 - A * math.sin(n * mean * t)), turn=True, instants=721
    )
    inertia = flywheel(run, C)
    theta = np.linspace(0.0, TURN, 3601)
    # the motor gives T₀ always: I ω²/2 = const − ∫ (T − T₀) dθ
    square = mean**2 - 2.0 / inertia * (A / n) * (1.0 - np.cos(n * theta))
    speed = np.sqrt(square + 2.0 / inertia * A / n)
    assert np.ptp(speed) / speed.mean() == pytest.approx(C, rel=C)


# -- the shaking force ------------------------------------------------------------------------


def test_a_rotating_mass():
    """m r ω² outwards, at the shaft: the moment about the origin is its arm."""
    machine = mbody.Mechanism("rotor", ground={"O": (2.0, 1.0)})
    machine.add(
        mbody.Body("rotor", mass=3.0, cg=(0.2, 0.0)),
        mbody.Revolute("O", "ground.O", "rotor"),
        mbody.AngleDriver("motor", "rotor", ConstantSpeed(0.3, 10.0)),
    )
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 0.5, 11))
    u = np.exp(1j * run["rotor"].angle) * 3.0 * 0.2 * 100.0
    about_origin, about_shaft = shaking_force(run), shaking_force(run, "ground.O")
    assert_allclose(about_origin.fx + 1j * about_origin.fy, u, rtol=1e-13)
    assert_allclose(about_origin.moment, 2.0 * u.imag - 1.0 * u.real, atol=1e-11)
    assert_allclose(about_shaft.moment, 0.0, atol=1e-11)
    assert_allclose(about_origin.magnitude, 60.0, rtol=1e-13)
    assert_allclose(about_origin.direction, np.mod(run["rotor"].angle, TURN), rtol=1e-12)


def assert_same(found, size):
    """Both routes, as parts of the greatest force."""
    for key in ("fx", "fy", "moment"):
        mine, other = getattr(found, key), getattr(found, f"{key}_inertia")
        assert_allclose(mine, other, rtol=0, atol=1e-11 * size)


@pytest.mark.parametrize(
    "linkage", [(0, 3, {}), (0, 3, {"sliders": True}), (1, 4, {"extras": True})], ids=str
)
def test_both_routes_with_loads_of_every_kind(linkage):
    seed, loops, more = linkage
    machine, turn = random_linkage(seed, loops, **more)
    run = mbody.kinetostatics(machine, times_within(machine, 0.9 * turn, 7))
    # forces of some hundreds; equilibrium holds to 1e-13 of them
    assert_same(shaking_force(run, mbody.Marker("ground", (0.3, -0.7))), 1e4)


def test_drivers_of_a_length_push_the_frame():
    """A jack on an arm, and a slide that is pulled: equal and opposite on the frame."""
    machine = mbody.Mechanism("two", ground={"C": (-3.0, 0.5), "S": (0.0, 2.0)})
    machine.add(
        makers.bar("arm", 2.0, mass=4.0, ends=("O", "P"), guess=1.0),
        mbody.Revolute("O", "ground", "arm.O"),
        mbody.DistanceDriver("jack", "ground.C", "arm.P", ConstantSpeed(4.0, 0.3)),
        mbody.Body("block", mass=2.0),
        mbody.Prismatic("guide", mbody.Marker("ground", "S", 0.3), "block"),
        mbody.CoordinateDriver(
            "slide", mbody.Marker("ground", "S", 0.3), "block", ConstantAcceleration(0.1, 1.0, 5.0)
        ),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Spring("spring", "ground.C", "arm.P", stiffness=30.0, free_length=2.0),
    )
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 1.0, 6))
    found = shaking_force(run)
    assert_same(found, 100.0)
    inertia = [sum(run.inertia(name)[k] for name in run) for k in (0, 1)]
    # weight is the one load from outside
    assert_allclose(found.fx, inertia[0], rtol=0, atol=1e-10)
    assert_allclose(found.fy, inertia[1] - 6.0 * 9.81, rtol=0, atol=1e-10)


def test_couplings_push_the_frame_too():
    """A hoist on a slope, whose rope runs over the frame, and a belt; weights are from outside."""
    machine = mbody.Mechanism(
        "hoist", ground={"hook": (0.5, 6.0), "A": (-2.0, 0.0), "B": (1.0, 0.0)}
    )
    slope = mbody.Marker("ground", (0.0, 0.0), 1.1)
    machine.add(
        mbody.Body("block", mass=3.0),
        mbody.Prismatic("slope", slope, "block"),
        mbody.Body("drum", mass=2.0, inertia=0.4, cg=(0.1, 0.0)),
        mbody.Body("wheel", mass=1.0, inertia=0.2),
        mbody.Revolute("A", "ground.A", "drum"),
        mbody.Revolute("B", "ground.B", "wheel"),
        mbody.LengthCoupling(
            "rope",
            [
                mbody.CouplingTerm(2.0, distance=("ground.hook", "block")),
                mbody.CouplingTerm(0.3, angle="drum"),
            ],
            9.0,
        ),
        mbody.AngleCoupling(
            "belt", [mbody.CouplingTerm(1.5, angle="wheel"), mbody.CouplingTerm(-1.0, angle="drum")]
        ),
        mbody.AngleDriver("motor", "wheel", ConstantAcceleration(0.2, 3.0, -4.0)),
        mbody.Gravity("gravity", y=-9.81),
    )
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 0.5, 6))
    found = shaking_force(run, "ground.B")
    assert np.abs(run.effort("rope")).min() > 1.0 and np.abs(run.effort("belt")).min() > 0.1
    assert_same(found, 100.0)
    # Σ −m a and the weights, from the histories alone
    acceleration = sum(m * run[name].ax for name, m in (("block", 3.0), ("drum", 2.0)))
    assert_allclose(found.fx, -acceleration, rtol=0, atol=1e-10)
    acceleration = sum(m * run[name].ay for name, m in (("block", 3.0), ("drum", 2.0)))
    assert_allclose(found.fy, -acceleration - 6.0 * 9.81, rtol=0, atol=1e-10)


def test_a_balanced_mechanism_does_not_shake():
    """Two equal sliders that run against each other."""
    machine = mbody.Mechanism("boxer", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("crank", points={"O": (0, 0), "A": (1, 0), "B": (-1, 0)}),
        mbody.Revolute("O", "ground.O", "crank.O"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(0.4, 9.0)),
    )
    for n, pin, guess in ((1, "A", 0.0), (2, "B", math.pi)):
        machine.add(
            makers.bar(f"rod{n}", 4.0, mass=0.5, ends=("P", "Q"), guess=guess),
            mbody.Body(f"ram{n}", mass=2.0),
            mbody.Revolute(f"{pin}{n}", f"crank.{pin}", f"rod{n}.P"),
            mbody.Revolute(f"Q{n}", f"rod{n}.Q", f"ram{n}"),
            mbody.Prismatic(f"guide{n}", "ground.O", f"ram{n}"),
        )
    run = mbody.kinetostatics(machine, turn=True, instants=37)
    found = shaking_force(run)
    peak = max(run.reaction(f"Q{n}").magnitude.max() for n in (1, 2))
    assert peak > 100.0
    assert found.magnitude.max() < 1e-12 * peak
    assert np.abs(found.moment).max() > 1.0  # the two lines of force are beside each other
    assert_same(found, peak)
