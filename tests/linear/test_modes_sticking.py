"""Small motions about states with contacts and frictional joints: closed forms and differences."""

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Contact,
    CoordinateDriver,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Simulator,
    Spring,
)
from mbody.laws import ConstantSpeed

G = 9.81


def conveyor(*, contact, friction=0.3, speed=0.5, mass=2.0, stiffness=50.0, **more):
    """A block on a belt, tied to a wall by a spring."""
    machine = Mechanism("belt", ground={"O": (0, 0), "W": (-1, 0)})
    top = {"top": {"line": {"point": "P"}}}
    feet = {"A": (-0.1, 0), "B": (0.1, 0), "C": (0, 0)}
    machine.add(
        Body("belt", mass=1, points={"P": (0, 0)}, shapes=top),
        Body("block", mass=mass, inertia=0.01, points=feet, cg=(0, 0.05)),
        Prismatic("rail", "ground.O", "belt.P"),
        CoordinateDriver("drive", "ground.O", "belt.P", ConstantSpeed(0, speed)),
        Spring("spring", "ground.W", "block.C", stiffness=stiffness, free_length=1.0),
        Gravity("g", y=-G),
    )
    if contact:
        machine.add(
            Contact("a", "belt.top", "block.A", friction=friction),
            Contact("b", "belt.top", "block.B", friction=friction),
        )
    else:
        machine.add(Prismatic("belting", "belt.P", "block.C", friction=friction, **more))
    return machine


def begun(machine, start, until=1e-3):
    machine.simulation = SimulationSettings(until=until, start=start, instants=2, rtol=1e-12)
    return mbody.simulate(machine)


def at(x, **rates):
    return {"block": {"x": x, "y": 0.0, "angle": 0.0, "vx": 0.0, "vy": 0.0, "omega": 0.0} | rates}


def test_a_block_that_slides_on_a_belt_swings_as_without_friction():
    """Coulomb's friction does not depend on the rate: ω = √(k/m) about x = μ m g/k."""
    machine = conveyor(contact=True)
    run = begun(machine, at(0.3 * 2.0 * G / 50.0))
    (found,) = mbody.modes(machine, at=run)
    (mode,) = found
    # differences of fourth order: a part of 1e-9
    assert mode.frequency == pytest.approx(5.0, rel=1e-8)
    assert mode.damping_ratio == pytest.approx(0.0, abs=1e-8)
    assert found.linear.modes == {"a": "slip-", "b": "slip-"}
    assert "about a state in which a slides, b slides" in found.notes
    assert found.data()["linear"]["modes"] == {"a": "slip-", "b": "slip-"}
    assert "NOTE   about a state in which a slides, b slides" in str(mbody.modes(machine, at=run))


@pytest.mark.parametrize("speed", [0.1, 0.2, 0.6])
def test_friction_that_falls_with_the_rate_drives_the_block(speed):
    """c = μ′(v) m g < 0: stick–slip begins so."""
    low, high, width = 0.2, 0.4, 0.25
    machine = conveyor(contact=False, friction=low, static=high, stribeck=width, speed=speed)
    gauss = np.exp(-((speed / width) ** 2))
    mu, slope = low + (high - low) * gauss, -2.0 * speed / width**2 * (high - low) * gauss
    run = begun(machine, at(mu * 2.0 * G / 50.0))
    linear = mbody.engineering.linearize(machine, at=run)
    assert linear.mass[0, 0] == pytest.approx(2.0, rel=1e-12)
    assert linear.damping[0, 0] == pytest.approx(slope * 2.0 * G, rel=1e-7)
    assert linear.stiffness[0, 0] == pytest.approx(50.0, rel=1e-7)
    (mode,) = mbody.modes(machine, at=run)[0]
    assert mode.words == "oscillates and grows"
    assert mode.decay_rate == pytest.approx(slope * 2.0 * G / 4.0, rel=1e-6)


def test_a_block_that_sticks_on_a_belt_is_not_free():
    machine = conveyor(contact=True, speed=0.0)
    run = begun(machine, at(0.05))
    assert run.mode("a")[-1] == "stick"
    with pytest.raises(mbody.SolveError, match=r"nothing is free in 'belt'.*a sticks, b sticks"):
        mbody.modes(machine, at=run)


def test_a_pendulum_that_sticks_in_its_pin_is_not_free():
    machine = Mechanism("pendulum", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.18, cg=(0.0, -0.4), points={"O": (0.0, 0.0)}),
        Revolute("O", "ground.O", "bob.O", friction=0.75, pin_radius=0.05),
        Gravity("g", y=-G),
    )
    run = begun(machine, {"bob": {"angle": 0.02}})
    assert run.mode("O")[-1] == "stick"
    with pytest.raises(mbody.SolveError, match=r"nothing is free in 'pendulum'.*O sticks"):
        mbody.engineering.linearize(machine, at=run)
    # the analysis of the mechanism itself is that of smooth joints, as its note says
    (hanging, _) = mbody.modes(machine)
    inertia = 0.18 + 2.0 * 0.16
    assert hanging[0].frequency == pytest.approx(np.sqrt(2.0 * G * 0.4 / inertia), rel=1e-8)
    assert any("that of smooth joints" in note for note in hanging.notes)


@pytest.mark.parametrize("ball", [False, True])
def test_a_disc_that_rolls_in_a_bowl(ball):
    """ω² = g/((R − r) (1 + J/(m r²))); on a disc from above it falls: −g/((R + r) …)."""
    machine = Mechanism(
        "bowl",
        ground={"O": (0, 0)},
        ground_shapes={"round": {"disc" if ball else "ring": "O", "radius": 1.0}},
    )
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    machine.add(
        Body("disc", mass=2.0, inertia=0.04, points={"C": (0, 0)}, shapes=rim),
        Contact("track", "ground.round", "disc.rim", friction=0.5),
        Gravity("g", y=-G),
    )
    y = 1.2 if ball else -0.8
    run = begun(machine, {"disc": {"x": 0.0, "y": y, "angle": 0.0}})
    (found,) = mbody.modes(machine, at=run)
    assert found.linear.modes == {"track": "roll"}
    (mode,) = found
    rate = np.sqrt(G / (abs(y) * 1.5))
    if ball:
        assert (mode.words, mode.eigenvalue.real) == ("grows", pytest.approx(rate, rel=1e-7))
    else:
        assert (mode.words, mode.frequency) == ("oscillates", pytest.approx(rate, rel=1e-7))


def test_a_rough_pendulum_in_motion_agrees_with_differences_of_its_accelerations():
    """The state matrix beside differences of the accelerations that steps begin with."""
    machine = Mechanism("pendulum", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.18, cg=(0.0, -0.4), points={"O": (0.0, 0.0)}),
        Revolute("O", "ground.O", "bob.O", friction=0.5, pin_radius=0.05),
        Gravity("g", y=-G),
    )
    run = begun(machine, {"bob": {"angle": 1.0, "omega": 2.0}}, until=0.1)
    linear = mbody.engineering.linearize(machine, at=run)
    assert (linear.about, linear.modes) == ("motion", {"O": "slip+"})
    sim, last = Simulator(machine), run["bob"]
    angle, omega = last.angle[-1], last.omega[-1]

    def alpha(da, dw):
        sim.reset({"bob": {"angle": angle + da, "omega": omega + dw}})
        return sim["bob"].alpha

    h = 1e-4
    slopes = [
        (8.0 * (alpha(a, w) - alpha(-a, -w)) - (alpha(2 * a, 2 * w) - alpha(-2 * a, -2 * w)))
        / (12.0 * h)
        for a, w in ((h, 0.0), (0.0, h))
    ]
    # differences of accelerations to 1e-13 by a step of 1e-4
    assert linear.state_matrix[1] == pytest.approx(slopes, rel=1e-7)
    sim.reset({"bob": {"angle": angle, "omega": omega}})
    assert pytest.approx(linear.state_matrix, rel=1e-6) == sim.state_matrices().A


def test_open_contacts_do_nothing():
    machine = Mechanism("ball", ground={"O": (0, 0)}, ground_shapes={"f": {"line": {"point": "O"}}})
    machine.add(
        Body("ball", mass=2.0, inertia=0.1, points={"C": (0, 0)}),
        Contact("floor", "ground.f", "ball.C", friction=0.5),
        Gravity("g", y=-G),
    )
    linear = mbody.engineering.linearize(machine, at=begun(machine, {"ball": {"y": 1.0}}))
    assert (len(linear.mass), linear.modes) == (3, {"floor": "open"})
    assert np.abs(linear.stiffness).max() == 0.0
    assert np.abs(linear.damping).max() == 0.0
    assert linear.drive @ linear.drive == pytest.approx((2.0 * G) ** 2, rel=1e-12)
