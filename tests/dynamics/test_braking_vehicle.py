"""The vehicle of the book, braked forward in time: wheels that roll, slip and lock.

Forward is x. The wheels have inertia, no mass of their own; closed forms take it into account.
"""

import functools

import numpy as np
import pytest

from mbody import Body, Contact, Controller, Force, Mechanism, Revolute, from_toml, simulate
from tests.support.cases import first_fast

G, WEIGHT, FRONT, REAR, HEIGHT, RADIUS, MU = 386.4, 4000.0, 40.0, 50.0, 25.0, 14.5, 0.8
BASE, MASS, SPEED = FRONT + REAR, WEIGHT / G, 1056.0

MODEL = """
name   = "Vehicle braking"
units  = "in-lbf-s"
g      = "g"

[parameters]
g       = "32.2 ft/s^2"
mu      = 0.8
inertia = "20 lbf*in*s^2"

[inputs]
front = "0 lbf*in"
rear  = "0 lbf*in"

[ground]
points = { O = [0, 0] }
[ground.shapes]
road = { line = { point = "O", angle = 0 } }

[bodies.chassis]
weight  = "4000 lbf"
inertia = "4000 lbf*(30 in)^2/g"
points  = { F = ["40 in", "-10.5 in"], R = ["-50 in", "-10.5 in"] }
guess   = { x = 0, y = "25 in", angle = 0 }

[bodies.front_wheel]
inertia = "inertia"
points  = { O = [0, 0] }
shapes  = { tyre = { disc = "O", radius = "14.5 in" } }
guess   = { x = "40 in", y = "14.5 in" }

[bodies.rear_wheel]
inertia = "inertia"
points  = { O = [0, 0] }
shapes  = { tyre = { disc = "O", radius = "14.5 in" } }
guess   = { x = "-50 in", y = "14.5 in" }

[joints]
front_hub   = { revolute = ["chassis.F", "front_wheel.O"] }
rear_hub    = { revolute = ["chassis.R", "rear_wheel.O"] }
front_brake = { clutch = ["chassis.F", "front_wheel.O"], torque = "front" }
rear_brake  = { clutch = ["chassis.R", "rear_wheel.O"], torque = "rear" }

[contacts]
front_tyre = { contact = ["ground.road", "front_wheel.tyre"], friction = "mu" }
rear_tyre  = { contact = ["ground.road", "rear_wheel.tyre"], friction = "mu" }

[drivers]
motion = { coordinate = ["ground", "chassis"], law = "88 ft/s*t" }

[gravity]
y = "-g"
"""


def vehicle(inertia=20.0, static=None):
    text = MODEL.replace("20 lbf*in*s^2", f"{inertia} lbf*in*s^2")
    if static is not None:
        text = text.replace('friction = "mu"', f'friction = "mu", static = {static}')
    return from_toml(text)


def braked(until, front, rear, machine=None, **more):
    rates = {"front_wheel": -SPEED / RADIUS, "rear_wheel": -SPEED / RADIUS, "chassis": 0.0}
    more = {"rtol": 1e-10, "release": {"motion": 0.0}, "rates": rates} | more
    inputs = {
        name: value for name, value in (("front", front), ("rear", rear)) if value is not None
    }
    return simulate(machine or vehicle(), until, inputs=inputs, **more)


def locked(which, inertia):
    """Deceleration where the wheels named are locked and slide, the others roll."""
    # the load of the front axle, N L = W c + m a h + J a/r for each wheel that rolls
    spin = inertia / RADIUS * (2 - len(which))
    own = MASS + spin / RADIUS
    if which == {"front"}:
        return MU * WEIGHT * REAR / BASE / (own - MU * (MASS * HEIGHT + spin) / BASE)
    if which == {"rear"}:
        return MU * WEIGHT * FRONT / BASE / (own + MU * (MASS * HEIGHT + spin) / BASE)
    return MU * G


TORQUES = {"front": (45000.0, 0.0), "rear": (0.0, 45000.0), "both": (45000.0, 45000.0)}


@pytest.mark.parametrize("inertia", [20.0, 0.02])
@pytest.mark.parametrize("which", TORQUES)
def test_locked_wheels_slow_it_as_by_hand(which, inertia):
    run = braked(0.5, *TORQUES[which], vehicle(inertia))
    axles = {"front", "rear"} if which == "both" else {which}
    expected = locked(axles, inertia)
    assert run["chassis"].ax[-1] == pytest.approx(-expected, rel=1e-9)
    for axle in ("front", "rear"):
        assert (run.mode(f"{axle}_brake")[-1] == "stick") == (axle in axles)
        rolls = run.mode(f"{axle}_tyre")[-1]
        assert rolls.startswith("slip") == (axle in axles)
    np.testing.assert_allclose(
        run.contact("front_tyre")[-1] + run.contact("rear_tyre")[-1], WEIGHT, rtol=1e-10
    )
    assert run.status == "completed"
    assert float(np.abs(run.energy.balance).max()) < 1e-12 * run.energy.size


def test_with_light_wheels_these_are_the_decelerations_of_the_book():
    found = [locked({"front"}, 0.0), locked({"rear"}, 0.0), locked({"front", "rear"}, 0.0)]
    np.testing.assert_allclose(np.array(found) / G, [4.0 / 7.0, 1163.6363636 / 4000.0, 0.8])


def test_wheels_that_are_braked_gently_roll():
    front, rear = 14500.0, 5800.0
    run = braked(1.0, front, rear)
    expected = (front + rear) / RADIUS / (MASS + 2.0 * 20.0 / RADIUS**2)
    np.testing.assert_allclose(run["chassis"].ax, -expected, rtol=1e-9)
    np.testing.assert_allclose(run["chassis"].x[-1], SPEED - 0.5 * expected, rtol=1e-10)
    assert not run.events


@first_fast("which", TORQUES, 2)
def test_it_stops_where_the_law_of_motion_says(which):
    """From the instant at which the last wheel locks, v²/(2 a)."""
    run = braked(9.0, *TORQUES[which])
    last = max(one.t for one in run.events if one.name == "stick" and one.t < 1.0)
    k = int(np.searchsorted(run.t, last)) + 1
    deceleration = locked({"front", "rear"} if which == "both" else {which}, 20.0)
    x, v = run["chassis"].x[k], run["chassis"].vx[k]
    if which != "rear":
        assert run["chassis"].x[-1] == pytest.approx(x + v**2 / (2.0 * deceleration), rel=1e-9)
        assert abs(run["chassis"].vx[-1]) < 1e-9
    else:
        end = v - deceleration * (run.t[-1] - run.t[k])
        assert run["chassis"].vx[-1] == pytest.approx(end, rel=1e-9)


def test_an_ideal_distribution_locks_both_axles_at_one_torque():
    """By the axle loads at the deceleration μ g, with wheels as light as in the book."""
    front = (REAR + MU * HEIGHT) / BASE
    rise = 1e5  # lbf·in/s of both together
    laws = [f"{part * rise} lbf*in/s*t" for part in (front, 1.0 - front)]
    run = braked(0.6, *laws, vehicle(0.02))
    slips = {one.contact: one.t for one in run.events if one.name == "slip"}
    # the torque at which both reach μ N
    expected = MU * WEIGHT * RADIUS / rise
    assert slips["front_tyre"] == pytest.approx(expected, rel=5e-5)
    assert slips["rear_tyre"] == pytest.approx(expected, rel=5e-5)


def anti_lock(t, wheel, speed, *, least, most):
    """Let go above 15 % slip, press again below 5 %."""
    slip = 1.0 + wheel * RADIUS / max(speed, 1.0)
    return least if slip > 0.10 else most


def test_an_anti_lock_controller_keeps_the_wheels_turning():
    """Rubber that sticks better than it slides: who lets go early stops sooner than who locks."""
    most = 0.95 * WEIGHT * RADIUS
    front = (REAR + 0.8 * HEIGHT) / BASE
    machine = vehicle(20.0, static=0.95)
    for axle, part in (("front", front), ("rear", 1.0 - front)):
        law = functools.partial(anti_lock, least=0.5 * part * most, most=0.97 * part * most)
        reads = [f"{axle}_wheel.omega", "chassis.vx"]
        machine.add(Controller(f"{axle}_abs", law, every="5 ms", reads=reads, sets=[axle]))
    led = braked(1.5, None, None, machine)
    plain = braked(1.5, 2.0 * most, 2.0 * most, vehicle(20.0, static=0.95))
    assert led["chassis"].vx[-1] < plain["chassis"].vx[-1] - 20.0
    turning = -led["front_wheel"].omega[5:] * RADIUS / led["chassis"].vx[5:]
    assert turning.min() > 0.5
    # nothing stops it faster than the static coefficient would
    assert led["chassis"].vx[-1] > SPEED - 0.95 * G * 1.5


@pytest.mark.parametrize(("sign", "arm"), [(1.0, -1.0), (-1.0, 1.0)])
def test_a_shoe_brake_helps_or_hinders_itself(sign, arm):
    """Moments about the lever's pin: F a = N (b ± μ c), the lesser where the drum draws it in."""
    machine = Mechanism("shoe brake", ground={"O": (0.0, 0.0), "A": (-0.3, 0.14)})
    rim = {"rim": {"disc": "O", "radius": 0.1}}
    points = {"A": (0.0, 0.0), "S": (0.3, -0.04), "B": (0.6, 0.0)}
    machine.add(
        Body("drum", mass=5.0, inertia=0.05, points={"O": (0.0, 0.0)}, shapes=rim, guess="0 deg"),
        Body(
            "lever", mass=1e-3, inertia=1e-5, points=points, cg=(0.3, 0.0), guess=(0.0, 0.14, 0.0)
        ),
        Revolute("O", "ground.O", "drum.O"),
        Revolute("A", "ground.A", "lever.A"),
        Force("push", "lever.B", 100.0, angle=-np.pi / 2.0),
        Contact("shoe", "drum.rim", "lever.S", friction=0.3),
    )
    run = simulate(machine, 0.05, rates={"drum": 30.0 * sign, "lever": 0.0}, instants=6)
    pressed = 100.0 * 0.6 / (0.3 + arm * 0.3 * 0.04)
    np.testing.assert_allclose(run.contact("shoe"), pressed, rtol=1e-9)
    np.testing.assert_allclose(run["drum"].alpha, -sign * 0.3 * pressed * 0.1 / 0.05, rtol=1e-9)
