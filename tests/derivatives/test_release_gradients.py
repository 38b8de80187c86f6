"""Gradients of motions in which drivers are released, against complex steps of small equations of
motion and differences of plain motions.
"""

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Controller,
    CoordinateDriver,
    DistanceDriver,
    Gravity,
    Input,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Spring,
    Torque,
)
from mbody.laws import ConstantSpeed, Harmonic
from tests.derivatives.test_controller_gradients import check_beside_differences
from tests.support.complex_events import derivatives, followed


def pendulum(release, until=1.0, rtol=1e-12, **rough):
    settings = SimulationSettings(until, rtol=rtol, instants=5, release={"motor": release})
    machine = Mechanism("pendulum", simulation=settings)
    machine.add(
        Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.0)),
        Revolute("O", "ground", "bob", **rough),
        AngleDriver("motor", "bob", ConstantSpeed(0.3, 2.0)),
        Gravity("gravity", y=-9.81),
    )
    return machine


@pytest.mark.parametrize("release", [0.0, 0.37])
def test_a_pendulum_that_is_led_and_released(release):
    """By the law, which gives the state at the release, and by numbers of the free motion."""

    def swung(numbers):
        first, speed, mass, inertia = numbers
        whole = inertia + mass * 0.49

        def rates(y):
            return np.array([y[1], -mass * 9.81 * 0.7 * np.cos(y[0]) / whole])

        y = [first + speed * release, speed]
        return followed({"free": (rates, {})}, "free", y, 1.0 - release)

    exact, _ = derivatives(swung, [0.3, 2.0, 1.3, 0.2])
    names = ["motor.law.value", "motor.law.speed", "bob.mass", "bob.inertia"]
    measures = ["last(bob.angle)", "last(bob.omega)"]
    g = mbody.gradient(pendulum(release), measures, names, "simulate")
    # Runge's and Kutta's 4000 steps are exact to some 1e-12
    np.testing.assert_allclose(g.jacobian, exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())
    assert not g.notes


def test_before_and_after_the_release():
    """At the instant of the release the effort is gone, and nothing follows the law any more."""
    machine = pendulum(0.5)
    measures = ["bob.omega", "bob.angle", "motor.effort", "motor.power", "motor.rate"]
    measures += ["motor.value", "motor.acceleration", "bob.alpha"]
    by = ["motor.law.speed", "bob.mass"]
    g = mbody.gradient(machine, measures, by, "simulate")
    rows = dict(zip(measures, g.jacobian, strict=True))
    t = np.linspace(0.0, 1.0, 5)
    weight = 9.81 * 0.7 * np.cos(0.3 + 2.0 * t[:2])
    np.testing.assert_allclose(rows["motor.effort"][:2, 1], weight, rtol=1e-12)
    assert not rows["motor.effort"][2:].any() and not rows["motor.power"][2:].any()
    np.testing.assert_allclose(rows["bob.omega"][:3, 0], 1.0, rtol=1e-12)
    np.testing.assert_allclose(rows["bob.angle"][:3, 0], t[:3], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(rows["bob.omega"][:3, 1], 0.0, atol=1e-15)
    assert rows["bob.omega"][3:].all()
    for own, moved in (("rate", "omega"), ("value", "angle"), ("acceleration", "alpha")):
        # before it, the law's and the motion's: rounding
        np.testing.assert_allclose(rows[f"motor.{own}"], rows[f"bob.{moved}"], atol=1e-12)


SLOPE = Marker("ground", (0.0, 0.1), angle=0.2)


def slider(driver):
    """A block on a slope, drawn by a spring and led along it or from a place."""
    settings = SimulationSettings(1.0, rtol=1e-12, instants=5, release={"motor": 0.4})
    machine = Mechanism("slope", ground={"W": (0.0, -0.8), "S": (0.1, 0.3)}, simulation=settings)
    machine.add(
        Body("block", mass=1.3, inertia=0.2, guess=(0.9, 0.3, 0.2)),
        Prismatic("guide", SLOPE, "block"),
        Gravity("gravity", y=-9.81),
        Spring("spring", "ground.W", "block", stiffness=20.0, free_length=0.5),
        driver,
    )
    return machine


@pytest.mark.parametrize(
    "driver",
    [
        DistanceDriver("motor", "ground.S", "block", Harmonic(0.8, 0.1, 3.0)),
        CoordinateDriver("motor", SLOPE, "block", Harmonic(0.8, 0.1, 3.0)),
    ],
    ids=["distance", "along an axis"],
)
def test_what_other_drivers_drove_moves_on(driver):
    """The history by places of the bodies; derivatives beside differences."""
    machine = slider(driver)
    run = mbody.simulate(machine)
    value, rate, change = run.driven("motor")
    free = run.t >= 0.4
    fine = mbody.simulate(machine, times=np.array([0.75 - 1e-4, 0.75, 0.75 + 1e-4, 1.0]))
    last, here, after = fine.driven("motor")[0][:3]
    x, y, from_x, from_y = run["block"].x, run["block"].y, 0.1, 0.3
    if isinstance(driver, DistanceDriver):
        expected = np.hypot(x - from_x, y - from_y)
    else:
        expected = np.cos(0.2) * x + np.sin(0.2) * (y - 0.1)
    np.testing.assert_allclose(value, expected, rtol=1e-12)
    assert np.abs(value[free] - driver.law.derivatives(run.t[free])[0])[1:].min() > 1e-3
    at = np.flatnonzero(run.t == 0.75)[0]
    # differences over 1e-4 s: of the order of its square, and of rounding by it
    assert rate[at] == pytest.approx((after - last) / 2e-4, rel=1e-6)
    assert change[at] == pytest.approx((after - 2.0 * here + last) / 1e-8, rel=1e-5, abs=1e-4)
    names = ["block.mass", "motor.law.amplitude"]
    check_beside_differences(machine, names, ["motor.value", "motor.rate", "motor.acceleration"])


def test_joints_with_friction_and_a_motion_that_goes_on():
    rough = {"friction": 0.2, "pin_radius": 0.05}
    names = ["motor.law.speed", "bob.mass", "O.friction"]
    check_beside_differences(pendulum(0.37, **rough), names, ["bob.angle", "bob.omega"], 1e-5)
    before = mbody.simulate(pendulum(0.37), 0.5)
    g = mbody.gradient(before.mechanism, "last(bob.angle)", ["bob.mass"], "simulate", start=before)
    free = mbody.Mechanism("free")
    free.add(*before.mechanism.bodies, *before.mechanism.joints, *before.mechanism.loads)
    free.simulation = SimulationSettings(
        0.5,
        {"bob": {"angle": before["bob"].angle[-1], "omega": before["bob"].omega[-1]}},
        rtol=1e-12,
        instants=2,
    )
    wanted = mbody.gradient(free, "last(bob.angle)", ["bob.mass"], "simulate")
    np.testing.assert_allclose(g.jacobian, wanted.jacobian, rtol=1e-9)


def test_two_releases_one_after_the_other():
    settings = SimulationSettings(
        1.2, rtol=1e-12, instants=7, release={"upper": 0.25, "lower": 0.7}
    )
    machine = Mechanism("two arms", ground={"W": (0.0, -0.8)}, simulation=settings)
    machine.add(
        Body("a", mass=1.0, inertia=0.02, cg=(0.2, 0.0), points={"P": (0.5, 0)}),
        Body("b", mass=0.7, inertia=0.02, cg=(0.15, 0.0), points={"Q": (0.4, 0)}, guess=0.0),
        Revolute("O", "ground", "a"),
        Revolute("P", "a.P", "b"),
        AngleDriver("upper", "a", ConstantSpeed(0.1, 0.5)),
        AngleDriver("lower", "b", Harmonic(0.1, 0.2, 3.0)),
        Gravity("gravity", y=-9.81),
        Spring("spring", "ground.W", "b.Q", stiffness=20.0, free_length=0.5),
    )
    names = ["a.mass", "b.mass", "upper.law.speed", "lower.law.amplitude", "lower.law.frequency"]
    measures = ["a.angle", "b.omega", "P.fx", "lower.value", "spring.force"]
    check_beside_differences(machine, names, measures)


def test_a_controller_samples_before_and_after():
    """Its memory, and inputs that wait, go on through the release."""

    class Braking:
        total = 0.0

        def __call__(self, t, rate):
            self.total += rate - 6.0
            return -0.05 * (rate - 6.0) - 0.01 * self.total

    machine = mbody.makers.four_bar(0.1, 0.3, 0.25, 0.35, masses=(0.5, 1.0, 0.8), speed=6.0)
    machine.simulation = SimulationSettings(0.8, rtol=1e-12, instants=5, release={"motor": 0.3})
    machine.add(
        Gravity("gravity", y=-9.81),
        Input("u", "0 N*m"),
        Torque("brake", "crank", value="u"),
        Controller("pi", Braking(), "35 ms", ["crank.omega"], ["u"], delay="10 ms"),
    )
    names = ["crank.mass", "coupler.B.x", "motor.law.speed", "pi.every", "pi.delay"]
    check_beside_differences(machine, names, ["crank.angle", "crank.omega", "A.fx"])
