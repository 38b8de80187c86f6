"""Events of quantities that are zero but for rounding, and crossings that steps end at."""

import math

import pytest
from scipy.optimize import brentq

import mbody
from mbody import Body, Contact, Event, Force, Gravity, Mechanism, SimulationSettings, Spring

G, FRICTION, PUSH, RATE = 9.81, 0.25, 0.3, 3.0


def pushed(length, mass, time):
    """A block on two feet, one of them rough, pushed to and fro at its mass centre by a force that
    its friction holds but for a while; times to 2π/3, in units of so much.
    """
    g, half = G * length / time**2, 0.2 * length
    machine = Mechanism(
        "block", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    machine.add(
        Body(
            "block",
            mass=mass,
            inertia=mass * half**2,
            points={"A": (-half, 0.0), "B": (half, 0.0), "C": (0.0, 0.0)},
        ),
        Contact("A", "ground.floor", "block.A", friction=2.0 * FRICTION),
        Contact("B", "ground.floor", "block.B"),
        Gravity("g", y=-g),
        Force("push", "block.C", f"{PUSH * mass * g!r} N*sin({RATE / time!r} rad/s*t)"),
    )
    until = 2.0 * math.pi / RATE * time
    machine.simulation = SimulationSettings(until=until, start={"block": {"x": 0.0, "y": 0.0}})
    return machine


def slid():
    """When the block begins to slide, has no acceleration, and stops, in the first half period."""
    begins = math.asin(FRICTION / PUSH) / RATE

    def speed(t):
        return PUSH / RATE * (math.cos(RATE * begins) - math.cos(RATE * t)) - FRICTION * (
            t - begins
        )

    none = math.pi / RATE - begins
    return begins, none, brentq(speed, none, none + begins, xtol=1e-15)


@pytest.mark.parametrize(
    ("length", "mass", "time"), [(1, 2, 1), (1e-5, 1e-9, 1e3), (1e5, 1e9, 1e-3)]
)
def test_what_sticks_is_no_event(length, mass, time):
    model = pushed(length, mass, time)
    names = ("ax", "ay", "alpha", "vx", "vy", "omega")
    events = [Event(f"block.{name}", name=name) for name in names]
    events += [Event("A.fx", name="fx"), Event("block.ax*block.alpha", name="product")]
    run = mbody.simulate(model, events=events, instants=3, rtol=1e-10)
    begins, none, stops = slid()
    half = math.pi / RATE
    expected = {
        "ax": [none, none + half],
        "vx": [stops, stops + half],
        "slip": [begins, begins + half],
    }
    for name in (*names, "fx", "product", "slip"):
        found = [one.t / time for one in run.events if one.name == name]
        if name == "fx":  # friction follows the push to and fro, and jumps where what slides stops
            assert len(found) == 1 and abs(found[0] - half) < 1e-9
        else:
            assert found == pytest.approx(expected.get(name, []), abs=1e-9), name


@pytest.mark.parametrize("stiffness", [1e2, 1e5])
def test_what_hangs_at_rest_is_no_event(stiffness):
    machine = Mechanism("hanging", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.1, points={"P": (0.0, 0.0)}),
        Spring("spring", "ground.O", "bob.P", stiffness=stiffness, free_length=1.0),
        Gravity("g", y=-G),
    )
    start = {"bob": {"x": 0.0, "y": -1.0 - 2.0 * G / stiffness}}
    machine.simulation = SimulationSettings(until=1.0, start=start)
    events = [Event(f"bob.{name}") for name in ("ax", "ay", "vx", "vy", "omega")]
    assert not mbody.simulate(machine, events=events, instants=3).events


@pytest.mark.parametrize("method", ["rattle", "generalized-alpha"])
@pytest.mark.parametrize("direction", [1, -1, 0])
def test_a_crossing_that_steps_end_at_is_one(method, direction):
    machine = Mechanism("free")
    machine.add(Body("block", mass=1.0, inertia=1.0))
    start = {"block": {"x": 0.0, "y": 0.0, "vx": 1.0, "vy": -1.0}}
    machine.simulation = SimulationSettings(until=1.0, start=start, method=method, step=0.125)
    events = [
        Event("block.x - 0.5 m", direction=direction, name="rises"),
        Event("block.y + 0.5 m", direction=direction, name="falls"),
    ]
    run = mbody.simulate(machine, events=events, instants=3)
    names = ("rises",) * (direction >= 0) + ("falls",) * (direction <= 0)
    assert [one.name for one in run.events] == list(names)
    assert all(abs(one.t - 0.5) <= 1e-15 for one in run.events)


def test_what_spins_between_looks_strikes():
    """A stick without loads, whose steps may be as long as the motion, flies towards a wall."""
    half, speed, spin, far = 1.0, 0.37, 41.0, 3.0
    machine = Mechanism(
        "stick", ground={"W": (far, 0.0)},
        ground_shapes={"wall": {"line": {"point": "W", "angle": math.pi / 2.0}}},
    )  # fmt: skip
    machine.add(
        Body("stick", mass=1.0, inertia=0.3, points={"P": (half, 0.0), "Q": (-half, 0.0)}),
        Contact("P", "ground.wall", "stick.P", restitution=1.0),
        Contact("Q", "ground.wall", "stick.Q", restitution=1.0),
    )
    start = {"stick": {"x": 0.0, "y": 0.0, "angle": 0.3, "vx": speed, "vy": 0.0, "omega": spin}}
    machine.simulation = SimulationSettings(until=9.0, start=start)
    run = mbody.simulate(machine, instants=3)

    def gap(t):
        return far - speed * t - half * abs(math.cos(0.3 + spin * t))

    steps = [k * 1e-4 for k in range(90_000)]
    first = next(t for t in steps if gap(t + 1e-4) < 0.0)
    assert run.events[0].t == pytest.approx(brentq(gap, first, first + 1e-4), abs=1e-9)
