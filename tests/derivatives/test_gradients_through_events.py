"""Gradients of motions through events, impacts and friction, against complex steps of small
equations of motion of their own, and of large ones against differences.
"""

import functools
import math

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Event,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Spring,
    Stop,
    TorsionDamper,
)
from tests.support import contact_models as models
from tests.support.complex_events import derivatives, followed

RTOLS = (1e-8, 1e-10, 1e-12)


def errors(make, measures, names, exact, **options):
    """The worst errors of derivatives, as parts of the greatest by each number, at RTOLS."""
    found = []
    for rtol in RTOLS:
        g = mbody.gradient(make(rtol), measures, names, analysis="simulate", **options)
        assert not g.notes
        scale = np.abs(exact).max(axis=0)
        found.append(float((np.abs(g.jacobian - exact) / scale).max()))
    return found, g


def check(found):
    """In proportion to rtol, and 1e-8 at rtol 1e-12."""
    # errors of a step add up over some ten steps and impacts, and tangents grow by each
    assert found[0] < 1e-5 and found[1] < 1e-7 and found[2] < 1e-8, found
    assert found[2] < 1e-2 * found[0] or found[2] < 1e-12, found


def ball(rtol, until=1.7):
    machine = mbody.gallery.load("bouncing_ball")
    start = {"ball": {"y": 1.03}}
    machine.simulation = SimulationSettings(until, start, rtol=rtol, instants=3)
    return machine


def thrown(numbers, until):
    """Height and rate after rebounds, in closed form, and when these are."""
    e, g, y = numbers
    t, v = np.sqrt(2.0 * (y - 0.03) / g), np.sqrt(2.0 * g * (y - 0.03))
    times = [t]
    while (times[-1] + 2.0 * e * v / g).real < until:
        v = e * v
        times.append(times[-1] + 2.0 * v / g)
    v, rest = e * v, until - times[-1]
    return np.array([v * rest - 0.5 * g * rest**2 + 0.03, v - g * rest]), times


def test_a_bouncing_ball():
    """Three impacts in closed form: the height, the rate, and when it struck."""
    exact, times = derivatives(lambda p: thrown(p, 1.7), [0.8, 9.81, 1.03])
    sign = np.array([1.0, -1.0, 1.0])
    names = ["e", "gravity.y", "start.ball.y"]
    found, g = errors(ball, ["last(ball.y)", "last(ball.vy)"], names, exact * sign)
    check(found)
    struck = [one for one in g.events if one.name == "impact"]
    assert len(struck) == len(times) == 2
    for one, row in zip(struck, times * sign, strict=True):
        assert one.contact == "floor"
        # times of the gap's zero are located to 1e-12 of a step
        assert [one.by[name] for name in names] == pytest.approx(row, rel=1e-9)


def pendulum(rtol, until=2.0):
    start = {"bob": {"angle": -0.2, "omega": 0.0}}
    machine = Mechanism(
        "pendulum", simulation=SimulationSettings(until, start, rtol=rtol, instants=3)
    )
    machine.add(
        Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.0), guess=-0.2),
        Revolute("O", "ground", "bob"),
        Gravity("gravity", y=-9.81),
        TorsionDamper("damper", "bob", coefficient=0.2),
        Stop("buffer", "bob.angle + 1.4 rad", restitution=0.7),
    )
    return machine


MU, MU_S, SPEED, K, MASS = 0.25, 0.4, 0.15, 60.0, 1.0


def on_a_belt(rtol, until=3.5):
    machine = Mechanism("stick and slip", ground={"O": (0.0, 0.0), "W": (-2.0, 0.0)})
    machine.add(
        Body("belt", mass=2.0, inertia=1.0, points={"O": (0.0, 0.0)}),
        Prismatic("track", "ground.O", "belt.O"),
        mbody.CoordinateDriver("motor", "ground.O", "belt.O", mbody.laws.ConstantSpeed(0.0, SPEED)),
        Body("block", mass=MASS, inertia=1.0, points={"C": (0.0, 0.0)}),
        Prismatic("guide", "belt.O", "block.C", friction=MU, static=MU_S),
        Spring("spring", "ground.W", "block.C", stiffness=K, free_length=2.0),
        Gravity("gravity", y=-9.81),
    )
    start = {"block": {"x": 0.0, "vx": SPEED}}
    machine.simulation = SimulationSettings(until, start, rtol=rtol, instants=3)
    return machine


def ridden(numbers, until):
    """Sticks from x = 0 on; slips where the spring pulls more than static friction."""
    mu, mu_s, u, k, m = numbers
    g = 9.81

    def stick(y):
        return np.array([u, 0.0 * u])

    def slip(y):
        return np.array([y[1], -k / m * y[0] + mu * g])

    def let_go(y):
        return mu_s * m * g - k * y[0]

    def caught(y):
        return u - y[1]

    # where it slips back its rate begins at that of the belt: the event counts once it fell
    modes = {
        "stick": (stick, {"slip": (let_go, lambda y: np.array([y[0], u - 0.0]))}),
        "slip": (slip, {"stick": (caught, lambda y: np.array([y[0], u]))}),
    }
    return followed(modes, "stick", [0.0, u], until, count=20000)


@pytest.mark.slow
def test_stick_and_slip():
    """Of a pair of a joint: the spring tears it off, the belt catches it again."""
    names = ["guide.friction", "guide.static", "spring.stiffness", "block.mass"]
    exact, times = derivatives(lambda p: ridden(p, 3.5), [MU, MU_S, SPEED, K, MASS])
    assert len(times) >= 4
    kept = [0, 1, 3, 4]
    measures = ["last(block.x)", "last(block.vx)"]
    found, g = errors(on_a_belt, measures, names, exact[:, kept])
    check(found)
    changes = [one for one in g.events if one.contact == "guide"]
    for one, row in zip(changes, times, strict=True):
        exact_row = pytest.approx(row[kept], rel=1e-8, abs=1e-10)
        assert [one.by[name] for name in names] == exact_row


def test_a_speed_by_which_what_sticks_does_not_any_more():
    """The belt faster than the block, which begins with its speed: no derivative, from then on."""
    names = ["motor.law.speed", "guide.friction"]
    g = mbody.gradient(on_a_belt(1e-8), "last(block.x)", names, analysis="simulate")
    assert np.isnan(g.jacobian).tolist() == [[True, False]]
    assert any("by 'motor.law.speed': other numbers move apart" in note for note in g.notes)


def block(rtol, until=0.9):
    machine = mbody.from_toml(models.BLOCK)
    tilt = -0.5 * math.atan2(0.1, 0.4)
    c, s = math.cos(tilt), math.sin(tilt)
    start = {"block": {"x": -(0.1 * c + 0.4 * s), "y": 0.4 * c - 0.1 * s, "angle": tilt}}
    machine.simulation = SimulationSettings(until, start, rtol=rtol, instants=3)
    return machine


def rocked(numbers, until):
    """Housner's block with any inertia: the angle about either corner, and its rate."""
    inertia, g = numbers
    b, h = 0.1, 0.4
    R, alpha = math.hypot(b, h), math.atan2(b, h)
    about = inertia + R * R
    ratio = (inertia + h * h - b * b) / about

    def rates(sign):
        return lambda y: np.array([y[1], -sign * g * R / about * np.sin(alpha - sign * y[0])])

    def turned(y):
        return np.array([y[0], ratio * y[1]])

    modes = {
        "left": (rates(-1.0), {"right": (lambda y: -y[0], turned)}),
        "right": (rates(1.0), {"left": (lambda y: y[0], turned)}),
    }
    return followed(modes, "left", [-0.5 * alpha, 0.0], until)


def test_a_block_that_rocks():
    """One impact with a change of the corner on which it stands."""
    exact, times = derivatives(lambda p: rocked(p, 0.9), [(0.01 + 0.16) / 3.0, 9.81])
    exact, times = exact * [1.0, -1.0], times * [1.0, -1.0]
    names = ["block.inertia", "gravity.y"]
    assert len(times)
    found, g = errors(block, ["last(block.angle)", "last(block.omega)"], names, exact)
    check(found)
    struck = [one for one in g.events if one.name == "impact"]
    for one, row in zip(struck, times, strict=True):
        assert [one.by[name] for name in names] == pytest.approx(row, rel=1e-8)


def test_an_end_at_an_event():
    """A pendulum that ends where it is level: its time, and its rate there, which moves with it."""
    machine = pendulum(1e-12)
    machine = Mechanism(
        "pendulum",
        simulation=SimulationSettings(
            3.0,
            {"bob": {"angle": 0.0, "omega": 0.0}},
            rtol=1e-12,
            instants=3,
            events=[Event("bob.angle + 1 rad", stop=True, name="there")],
        ),
    )
    machine.add(
        Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.0)),
        Revolute("O", "ground", "bob"),
        Gravity("gravity", y=-9.81),
    )
    names = ["bob.mass", "bob.inertia", "start.bob.angle"]
    g = mbody.gradient(machine, ["last(bob.omega)", "last(bob.angle)"], names, analysis="simulate")

    def energy(p):
        m, inertia, angle = p
        whole = inertia + m * 0.49
        return [-np.sqrt(2.0 * m * 9.81 * 0.7 * (np.sin(angle) + np.sin(1.0)) / whole)], []

    exact, _ = derivatives(energy, [1.3, 0.2, 0.0])
    np.testing.assert_allclose(g.jacobian[0], exact[0], rtol=1e-9)
    np.testing.assert_allclose(g.jacobian[1], 0.0, atol=1e-10)
    (one,) = g.events
    assert one.name == "there"
    _, times = derivatives(
        lambda p: followed(
            {"on": (lambda y: _falls(y, p), {"off": (lambda y: y[0] + 1.0, lambda y: y)})}
            | {"off": (lambda y: _falls(y, p), {})},
            "on",
            [p[2], 0.0],
            one.t + 0.1,
        ),
        [1.3, 0.2, 0.0],
    )
    assert [one.by[name] for name in names] == pytest.approx(times[0], rel=1e-8)


def _falls(y, p):
    return np.array([y[1], -p[0] * 9.81 * 0.7 * np.cos(y[0]) / (p[1] + p[0] * 0.49)])


def difference(system, run_of, name, part):
    """By four places, with a part of the number as step, and by steps half as long: what these
    differ by is the band.
    """
    value, found = float(system.values[name]), []

    @functools.cache  # places that are one step away and two steps of half the length
    def at(place):
        return run_of(system.with_values({name: place}))

    for step in (part * abs(value), 0.5 * part * abs(value)):
        low, near, up, most = (at(value + k * step) for k in (-2, -1, 1, 2))
        found.append((8.0 * (up - near) - (most - low)) / (12.0 * step))
    return found[1], np.abs(found[0] - found[1])


@pytest.mark.slow
def test_a_woodpecker():
    """Two impacts, a lift-off, a slip and a stick: against differences with their own band."""
    machine = mbody.gallery.load("woodpecker")
    system = mbody.assemble(machine)
    start = mbody.simulate(system, 0.004, rtol=1e-13)
    how = {"until": 0.17, "start": start, "rtol": 1e-13, "instants": 3}
    names = ["mu", "e", "bird.mass", "spring.stiffness"]
    measures = ["last(sleeve.y)", "last(bird.angle)", "last(bird.omega)"]
    g = mbody.gradient(system, measures, names, analysis="simulate", **how)
    kinds = {one.name for one in g.events}
    assert kinds == {"impact", "open", "stick"} and not g.notes

    def last(other):
        run = mbody.simulate(other, **how)
        return np.array([run["sleeve"].y[-1], run["bird"].angle[-1], run["bird"].omega[-1]])

    for k, name in enumerate(names):
        numeric, band = difference(system, last, name, 1e-5)
        size = np.abs(numeric).max()
        # besides, 1e-12 of a motion over a step of 1e-5
        assert (np.abs(g.jacobian[:, k] - numeric) <= band + 1e-6 * size).all(), name


def two_balls(lower, upper):
    """Which strike their floors at one time, the walls of one piece."""
    machine = Mechanism("two balls", simulation=SimulationSettings(1.0, {}, rtol=1e-10, instants=3))
    for name, height in (("a", lower), ("b", upper)):
        machine.add(
            Body(name, mass=1.0, inertia=1.0, guess=(0.0, height, 0.0)),
            Stop(f"floor {name}", f"{name}.y", restitution=0.5),
        )
    machine.add(Gravity("gravity", y=-9.81))
    return machine


def test_two_impacts_at_one_time():
    """By gravity, which moves both alike, there is a derivative; a mass changes nothing."""
    g = mbody.gradient(
        two_balls(1.0, 1.0),
        ["last(a.y)", "last(b.y)"],
        ["gravity.y", "a.mass"],
        analysis="simulate",
    )
    exact, _ = derivatives(lambda p: thrown([0.5, p[0], 1.03], 1.0), [9.81])
    np.testing.assert_allclose(g.jacobian[:, 0], -exact[0, 0], rtol=1e-8)
    np.testing.assert_allclose(g.jacobian[:, 1], 0.0, atol=1e-12)


def test_a_motion_that_ends_at_an_impact():
    """Just after it but for rounding: no derivative, and a sentence that says so."""
    ball = mbody.gallery.load("bouncing_ball")
    impact = mbody.simulate(ball, until=0.5).events[0].t
    with pytest.raises(mbody.SolveError, match=r"ends, but for rounding, where something changes"):
        mbody.gradient(ball, "last(ball.vy)", "e", "simulate", until=impact + 1e-14)
    after = mbody.gradient(ball, "last(ball.vy)", "e", "simulate", until=impact + 1e-9)
    # v⁺ = −e v⁻
    v = -float(mbody.simulate(ball, until=impact).measure("ball.vy")[-1])
    assert after["last(ball.vy)"]["e"] == pytest.approx(v, rel=1e-6)


def swinging(mass, rtol=1e-10):
    machine = Mechanism("pendulum", ground={"O": (0, 0)})
    machine.add(
        Body("a", mass=mass, inertia=0.05, cg=(0.25, 0.02), points={"O": (0, 0)}),
        Revolute("O", "ground.O", "a.O", limits=(-1.0, 1.1)),
        Gravity("g", y=-9.81),
    )
    machine.simulation = SimulationSettings(1.3, {"a": {"angle": 0.3, "omega": 1.0}}, rtol=rtol)
    return machine


@pytest.mark.parametrize("until", [0.3, 0.9])
def test_joints_with_limits(until):
    """Before the limit is struck and after, against differences of two runs."""

    def ends(mass):
        return mbody.simulate(swinging(mass, 1e-12), until, rtol=1e-12)["a"].omega[-1]

    h = 1e-5
    exact = (ends(1.2 + h) - ends(1.2 - h)) / (2.0 * h)
    measure = "last(a.omega)"
    found = mbody.gradient(swinging(1.2), measure, ["a.mass"], analysis="simulate", until=until)
    # differences lose h² of a third derivative and rtol / h of rounding
    assert found[measure]["a.mass"] == pytest.approx(exact, rel=1e-6)
    assert (until > 0.5) == any(one.contact for one in mbody.simulate(swinging(1.2), until).events)
