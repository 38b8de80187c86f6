"""The vehicle on springs, braked forward in time: pitch, stopping distance, wheels that lift."""

import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from mbody import (
    Body,
    Clutch,
    Contact,
    CoordinateDriver,
    Damper,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    Spring,
    laws,
    simulate,
)
from tests.dynamics.test_braking_vehicle import (
    BASE,
    FRONT,
    HEIGHT,
    MASS,
    MODEL,
    MU,
    RADIUS,
    REAR,
    SPEED,
    WEIGHT,
    G,
    braked,
    from_toml,
)

PITCH = WEIGHT / G * 30.0**2  # inertia of the chassis, lbf·in·s²
AT = {"front": FRONT, "rear": -REAR}
LOAD = {"front": WEIGHT * REAR / BASE, "rear": WEIGHT * FRONT / BASE}
STIFF = {"front": 360.0, "rear": 300.0}  # lbf/in of an axle
DAMPING, WHEEL, TOP = 60.0, 0.02, 30.0
UP = 0.5 * math.pi


def suspended(brakes):
    """Each axle in an upright of hardly any mass that slides along the chassis on a spring and a
    damper; the springs carry the vehicle level, at the height of the rigid one.
    """
    machine = Mechanism(
        "Vehicle on springs",
        units="in-lbf-s",
        g=G,
        ground={"O": (0.0, 0.0)},
        ground_shapes={"road": {"line": {"point": "O"}}},
    )
    points = {axle: (x, RADIUS - HEIGHT) for axle, x in AT.items()}
    points |= {f"{axle}_top": (x, RADIUS - HEIGHT + TOP) for axle, x in AT.items()}
    machine.add(
        Body("chassis", weight=WEIGHT, inertia=PITCH, points=points, guess=(0.0, HEIGHT, 0.0)),
        Gravity("gravity", y=-G),
        CoordinateDriver("motion", "ground", "chassis", laws.ConstantSpeed(0.0, SPEED)),
    )
    for axle, x in AT.items():
        place = (x, RADIUS, 0.0)
        tyre = {"tyre": {"disc": "O", "radius": RADIUS}}
        machine.add(
            Body(
                f"{axle}_upright",
                weight=0.01,
                inertia=0.01,
                points={"O": (0.0, 0.0)},
                guess=place,
            ),
            Body(
                f"{axle}_wheel",
                inertia=WHEEL,
                points={"O": (0.0, 0.0)},
                shapes=tyre,
                guess=place,
            ),
            Revolute(f"{axle}_hub", f"{axle}_upright.O", f"{axle}_wheel.O"),
            Prismatic(
                f"{axle}_guide", Marker("chassis", axle, UP), Marker(f"{axle}_upright", "O", UP)
            ),
            Clutch(
                f"{axle}_brake",
                f"{axle}_upright.O",
                f"{axle}_wheel.O",
                torque=brakes.get(axle, 0.0),
            ),
            Contact(f"{axle}_tyre", "ground.road", f"{axle}_wheel.tyre", friction=MU),
            Spring(
                f"{axle}_spring",
                f"chassis.{axle}_top",
                f"{axle}_upright.O",
                stiffness=STIFF[axle],
                free_length=TOP + LOAD[axle] / STIFF[axle],
            ),
            Damper(
                f"{axle}_damper",
                f"chassis.{axle}_top",
                f"{axle}_upright.O",
                coefficient=DAMPING,
            ),
        )
    return machine


def stopped(brakes, until, machine=None, **more):
    rates = {"chassis": 0.0}
    for axle in AT:
        rates |= {f"{axle}_upright": 0.0, f"{axle}_wheel": -SPEED / RADIUS}
    more = {"rtol": 1e-9, "release": {"motion": 0.0}, "rates": rates} | more
    return simulate(machine or suspended(brakes), until, **more)


def settled(brakes):
    """Heave, pitch, deceleration and axle loads once it no longer swings, by dense equations:
    both axle loads, springs along the chassis, friction of wheels that are locked or torques of
    those that roll.
    """

    def missing(z):
        y, angle, a, *loads = z
        s, c = math.sin(angle), math.cos(angle)
        found, force = [], 0.0
        for load, (axle, x) in zip(loads, AT.items(), strict=True):
            # the hub stays on the guide: its height gives how far the spring is pressed in
            travel = (RADIUS - y - x * s - (RADIUS - HEIGHT) * c) / c
            spring = LOAD[axle] + STIFF[axle] * travel
            along = MU * load if brakes[axle] == "locked" else brakes[axle] / RADIUS
            # what the tyre gives the upright: across the guide the chassis, along it the spring
            found.append(load * c + along * s - spring)
            force += along
        moment = 0.0
        for load, (axle, x) in zip(loads, AT.items(), strict=True):
            travel = (RADIUS - y - x * s - (RADIUS - HEIGHT) * c) / c
            along = MU * load if brakes[axle] == "locked" else brakes[axle] / RADIUS
            # of all forces at the road about the mass centre
            hub = x * c - (RADIUS - HEIGHT + travel) * s
            moment += load * hub - along * y
        return [*found, sum(loads) - WEIGHT, force - MASS * a, moment]

    return fsolve(missing, [HEIGHT, -0.01, 100.0, LOAD["front"], LOAD["rear"]], xtol=1e-13)


@pytest.mark.parametrize(
    "brakes",
    [
        {"front": 9000.0, "rear": 4000.0},
        {"front": "locked", "rear": 0.0},
        {"front": 0.0, "rear": "locked"},
        {"front": "locked", "rear": "locked"},
    ],
)
def test_it_settles_where_dense_equations_say(brakes):
    torques = {axle: 9e4 if one == "locked" else one for axle, one in brakes.items()}
    run = stopped(torques, 3.0)
    assert run.status == "completed"
    y, angle, a, front, rear = settled(brakes)
    # it swings with some 8 rad/s, a third of the critical damping: exp(−8) of it is left
    left = 5e-3
    assert run["chassis"].angle[-1] == pytest.approx(angle, abs=left * abs(angle))
    assert run.contact("front_tyre")[-1] == pytest.approx(front, rel=left)
    assert run.contact("rear_tyre")[-1] == pytest.approx(rear, rel=left)
    assert run["chassis"].ax[-1] == pytest.approx(-a, rel=left)
    assert run["chassis"].y[-1] == pytest.approx(y, abs=left)
    assert angle < 0.0  # it dives
    assert float(np.abs(run.energy.balance).max()) < 1e-7 * run.energy.size


def test_stiff_springs_are_the_rigid_vehicle_and_soft_ones_stop_as_far():
    """Both axles locked slide with μ g whatever the springs: the way is that of the rigid one but
    for what it swings.
    """
    rigid = braked(4.0, 9e4, 9e4)
    run = stopped({"front": 9e4, "rear": 9e4}, 4.0)
    ways = []
    for one in (rigid, run):
        wheel = one["front_wheel"]  # the chassis swings on, and the locked wheels roll with it
        ways.append(wheel.x[-1] - wheel.x[0])
        assert wheel.vx[-1] == pytest.approx(0.0, abs=1e-3 * SPEED)
        assert one.mode("front_tyre")[-1] == "roll" and one.mode("front_brake")[-1] == "stick"
    ideal = SPEED**2 / (2.0 * MU * G)
    assert ways[0] == pytest.approx(ideal, rel=0.02)
    assert ways[1] == pytest.approx(ways[0], rel=0.02)


@pytest.mark.parametrize("height", [45.0, 60.0, 75.0])
def test_a_tall_vehicle_lifts_its_rear_wheels(height):
    """With the front axle braked more and more the rear wheels have no load from a = g b/h on, if
    the front ones do not slip before.
    """
    text = MODEL.replace('y = "25 in", angle = 0', f'y = "{height} in", angle = 0')
    text = text.replace('"-10.5 in"]', f'"{RADIUS - height} in"]')
    machine = from_toml(text.replace('"20 lbf*in*s^2"', '"0.02 lbf*in*s^2"'))
    rise = 1e5  # lbf·in/s
    run = braked(0.6, f"{rise} lbf*in/s*t", 0.0, machine)
    lifts = [event for event in run.events if event.contact == "rear_tyre" and event.name == "open"]
    if FRONT / height < MU:
        # the wheels have 2e-5 of the inertia of the vehicle
        assert lifts[0].t == pytest.approx(WEIGHT * FRONT / height * RADIUS / rise, rel=1e-4)
        assert run["chassis"].angle[-1] < 0.0 and run.mode("rear_tyre")[-1] == "open"
    else:
        assert not lifts and run.contact("rear_tyre").min() > 0.0
        assert run.mode("front_tyre")[-1].startswith("slip")
