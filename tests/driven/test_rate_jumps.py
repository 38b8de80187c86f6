"""Drivers whose rate jumps, as by a table in straight lines: against closed forms of their impulse,
of what they strike, drop and drag.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody.laws import Table

G, CORNER, END = 9.81, 0.5, 1.5
#: Steps of rtol 1e-10 and fewer than a hundred of them.
CLOSE = 1e-8
#: The arm of a pendulum, its mass and inertia about the mass centre.
ARM, BOB, INERTIA = 0.5, 2.0, 0.03
MU, BOX, CART = 0.3, 2.0, 1.0


def straight(*rates):
    """A table of time whose rate is the first one up to the corner, then the second."""
    before, after = rates
    reached = before * CORNER
    values = [0.0, reached, reached + after * 2.5]
    return Table([0.0, CORNER, CORNER + 2.5], values, interpolation="linear")


def pendulum(law, *, by_input=False):
    machine = mbody.Mechanism("pendulum on a cart")
    if by_input:
        machine.add(mbody.Input("u", law))
    machine.add(
        mbody.Body("cart", mass=CART),
        mbody.Body("bob", mass=BOB, inertia=INERTIA, cg=(0.0, -ARM), points={"P": (0.0, 0.0)}),
        mbody.Prismatic("rail", "ground", "cart"),
        mbody.Revolute("pin", "cart", "bob.P"),
        mbody.Gravity("gravity", y=-G),
        mbody.CoordinateDriver("push", "ground", "cart", "u" if by_input else law),
    )
    start = {"bob": {"angle": 0.4, "omega": 0.2}}
    machine.simulation = mbody.SimulationSettings(until=END, rtol=1e-10, start=start)
    return machine


def box_on_cart(rate, *, upright=False, restitution=0.0):
    """A box on a cart that is jerked along or upwards."""
    way = math.pi / 2 if upright else 0.0
    axes = [mbody.Marker(body, (0.0, 0.0), way) for body in ("ground", "cart")]
    machine = mbody.Mechanism("box on a cart")
    machine.add(
        mbody.Body(
            "cart",
            mass=CART,
            points={"A": (-5.0, 0.0), "B": (5.0, 0.0)},
            shapes={"top": {"segment": ("A", "B")}},
        ),
        mbody.Body("box", mass=BOX, inertia=0.02, points={"a": (-0.1, -0.1), "b": (0.1, -0.1)}),
        mbody.Prismatic("rail", *axes),
        mbody.CoordinateDriver("push", *axes, straight(0.0, rate)),
        *(
            mbody.Contact(
                f"at_{end}", "cart.top", f"box.{end}", friction=MU, restitution=restitution
            )
            for end in "ab"
        ),
        mbody.Gravity("gravity", y=-G),
    )
    start = {"box": {"x": 0.0, "y": 0.1, "angle": 0.0}}
    machine.simulation = mbody.SimulationSettings(until=END, rtol=1e-10, start=start)
    return machine


def jump_of(run):
    """The rate of the pendulum just before the corner, and at it."""
    at = np.flatnonzero(np.abs(run.t - CORNER) < 1e-6)
    return run["bob"].omega[at]


@pytest.mark.parametrize("method", ["dop853", "dopri5", "radau5"])
@pytest.mark.parametrize("events", [(), [mbody.Event("bob.x - 5 m")]])
@pytest.mark.parametrize("by_input", [False, True])
def test_a_pendulum_jumps_by_the_impulse_of_its_pin(method, events, by_input):
    """Of the angular momentum about the pin the impulse changes nothing."""
    before, after = 1.0, -0.6
    times = [0.0, CORNER - 1e-9, CORNER, END]
    machine = pendulum(straight(before, after), by_input=by_input)
    run = mbody.simulate(machine, times=times, events=events, method=method)
    first, second = jump_of(run)
    about_pin = INERTIA + BOB * ARM**2
    jump = -BOB * ARM * math.cos(run["bob"].angle[2]) * (after - before) / about_pin
    # between the instants it turns by a nanosecond's acceleration, of some ten rad/s²
    assert_allclose(second - first, jump, rtol=0.0, atol=1e-7)
    assert run.status == "completed"
    assert run.energy.error < CLOSE


def test_the_work_of_the_jerk_is_what_kinetic_energy_gains():
    run = mbody.simulate(pendulum(straight(1.0, -0.6)), times=[0.0, CORNER - 1e-9, CORNER, END])
    gained = np.diff(run.energy.kinetic)[1]
    assert abs(gained) > 0.1
    # gravity works for a nanosecond
    assert_allclose(np.diff(run.energy.by["push"])[1], gained, rtol=0.0, atol=1e-7)


def test_a_motion_that_ends_at_the_corner_goes_on_from_it():
    machine = pendulum(straight(1.0, -0.6))
    whole, half = mbody.simulate(machine), mbody.simulate(machine, CORNER)
    assert half.t[-1] == CORNER
    assert half["cart"].vx[-1] == pytest.approx(-0.6, abs=CLOSE)
    rest = mbody.simulate(machine, END, start=half)
    assert_allclose(rest["bob"].omega[-1], whole["bob"].omega[-1], rtol=CLOSE)
    assert half.energy.error < CLOSE and rest.energy.error < CLOSE


def test_steps_of_a_simulator_end_at_the_corner_and_beyond():
    machine = pendulum(straight(1.0, -0.6))
    led = mbody.Simulator(machine, rtol=1e-10)
    for n in range(1, 16):
        led.until(n / 10)
    assert_allclose(led["bob"].omega, mbody.simulate(machine)["bob"].omega[-1], rtol=CLOSE)
    assert led.solution().energy.error < CLOSE


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_box_is_left_behind_by_a_cart_that_is_jerked_along(method):
    """Nothing presses harder at once, so that friction has no impulse: it slides for v/(μ g)."""
    speed = 1.0
    slides = speed / (MU * G)
    run = mbody.simulate(box_on_cart(speed), method=method)
    assert [(event.name, event.contact) for event in run.events] == [
        ("slip", "at_a"),
        ("slip", "at_b"),
        ("stick", "at_a"),
        ("stick", "at_b"),
    ]
    ends = [CORNER, CORNER, CORNER + slides, CORNER + slides]
    assert_allclose([event.t for event in run.events], ends, atol=CLOSE)
    inside = (run.t >= CORNER) & (run.t <= CORNER + slides)
    assert_allclose(run["box"].vx[inside], MU * G * (run.t[inside] - CORNER), atol=CLOSE)
    lost = sum(run.energy.lost[name][-1] for name in ("at_a", "at_b"))
    assert_allclose(lost, BOX * speed**2 / 2, rtol=CLOSE)
    assert_allclose(run.energy.by["push"][-1], CART * speed**2 / 2 + BOX * speed**2, rtol=CLOSE)
    assert run.status == "completed"


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_box_is_struck_by_a_table_that_is_jerked_up(restitution):
    """It leaves the table with (1 + e) times its speed."""
    speed = 1.0
    run = mbody.simulate(box_on_cart(speed, upright=True, restitution=restitution))
    first = run.events[0]
    assert first.name == "impact" and first.t == CORNER
    assert_allclose(first.after["box"].vy[0], (1.0 + restitution) * speed, rtol=CLOSE)
    assert run.status == "completed" and run.energy.error < CLOSE


def test_a_box_falls_after_a_table_that_is_jerked_down():
    """It meets the table again after 2 v/g."""
    speed = 1.0
    run = mbody.simulate(box_on_cart(-speed, upright=True))
    names = [event.name for event in run.events]
    assert names == ["open", "open", "impact"]
    assert_allclose(run.events[2].t, CORNER + 2.0 * speed / G, rtol=CLOSE)
    assert run.status == "completed" and run.energy.error < CLOSE


@pytest.mark.parametrize(("before", "after", "speed"), [(1.0, 0.2, 1.0), (1.0, 1.7, 1.7)])
def test_a_rope_pulls_a_sledge_and_does_not_push_it(before, after, speed):
    machine = mbody.Mechanism("sledge")
    machine.add(
        mbody.Body("cart", mass=1.0),
        mbody.Body("sledge", mass=2.0),
        mbody.Prismatic("rail", "ground", "cart"),
        mbody.Prismatic("snow", "ground", "sledge"),
        mbody.Rope("rope", "cart", "sledge", length=1.0),
        mbody.CoordinateDriver("push", "ground", "cart", straight(before, after)),
    )
    start = {"sledge": {"x": -1.0, "vx": before}}
    machine.simulation = mbody.SimulationSettings(until=0.6, rtol=1e-10, start=start)
    run = mbody.simulate(machine)
    assert_allclose(run["sledge"].vx[-1], speed, rtol=CLOSE)
    assert run.status == "completed" and run.energy.error < CLOSE


def test_derivatives_go_through_a_jerk_of_what_only_joints_hold():
    """Against differences of motions."""
    machine = pendulum(straight(1.0, -0.6))
    found = mbody.gradient(machine, "last(bob.omega)", ["bob.inertia"], "simulate")
    system, h = mbody.assemble(machine), 1e-5
    ends = [
        mbody.simulate(system.with_values({"bob.inertia": INERTIA + s * h}))["bob"].omega[-1]
        for s in (1.0, -1.0)
    ]
    # h² of the difference, and the rounding of two motions over h
    assert_allclose(found.jacobian[0, 0], (ends[0] - ends[1]) / (2.0 * h), rtol=1e-5)
