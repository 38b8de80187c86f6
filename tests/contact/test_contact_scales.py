"""Contact, friction and impacts of any size and mass: answers in their own units are the same."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody

G = 9.81


def block(mass, length, kinetic, static, rate):
    """A block on a rough floor and a spring, at its greatest displacement; lengths by `length`."""
    machine = mbody.Mechanism(
        "block", ground={"O": (0, 0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    machine.add(
        mbody.Body("b", mass=mass, inertia=mass * length**2, points={"C": (0, 0)}),
        mbody.Contact("f", "ground.floor", "b.C", friction=kinetic, static=static),
        mbody.Gravity("g", y=-G * length),
        mbody.Force("k", "b.C", value=f"-{mass * rate**2!r}*b.x", angle=0.0),
    )
    return machine


@pytest.mark.parametrize("mass", [1e-9, 3e-3, 4.7e5, 1e9])
@pytest.mark.parametrize("length", [1e-5, 1.0, 3e4])
def test_a_block_on_a_spring_stops_by_half_cycles(mass, length):
    """x → −(|x| − 2 μ g/ω²) until |x| ≤ μ_s g/ω²; each half cycle takes π/ω."""
    kinetic, static, rate = 0.15, 0.31, 7.0
    rests, halves = 4.3 * static * G / rate**2, 0
    machine = block(mass, length, kinetic, static, rate)
    start = dict(x=rests * length, y=0.0, angle=0.0, vx=0.0, vy=0.0, omega=0.0)
    machine.simulation = mbody.SimulationSettings(until=1.0, start={"b": start})
    while abs(rests) > static * G / rate**2:
        rests = -math.copysign(abs(rests) - 2.0 * kinetic * G / rate**2, rests)
        halves += 1
    run = mbody.simulate(machine, halves * math.pi / rate + 0.4, rtol=1e-10, instants=5)
    assert run.status == "completed" and not run.doubts
    assert run["b"].x[-1] / length == pytest.approx(rests, abs=1e-8)
    assert run.mode("f")[-1] == "stick"


def ball(mass, length, law):
    """An eccentric disc that falls on a slope."""
    floor = {"line": {"point": "O", "angle": -0.21}}
    machine = mbody.Mechanism("ball", ground={"O": (0, 0)}, ground_shapes={"floor": floor})
    rim = {"disc": "C", "radius": 0.15 * length}
    inertia = 0.006 * mass * length**2
    machine.add(
        mbody.Body(
            "b",
            mass=mass,
            inertia=inertia,
            cg=(-0.02 * length, 0.01 * length),
            points={"C": (0, 0)},
            shapes={"rim": rim},
        ),
        mbody.Gravity("g", y=-G * length),
        mbody.Contact(
            "f", "ground.floor", "b.rim", friction=0.24, static=0.3, restitution=0.7, law=law
        ),
    )
    start = dict(x=0.0, y=0.5 * length, angle=0.3, vx=-0.8 * length, vy=0.0, omega=-6.0)
    machine.simulation = mbody.SimulationSettings(until=1.0, start={"b": start})
    return mbody.simulate(machine, 0.4, rtol=1e-11, instants=5)


@pytest.mark.parametrize("law", ["poisson", "newton"])
@pytest.mark.parametrize(("mass", "length"), [(1e-12, 1e-6), (1e9, 1e4), (1e-9, 1e5)])
def test_an_eccentric_disc_bounces_alike_at_every_size(mass, length, law):
    """All equations are homogeneous in mass and length."""
    one, other = ball(1.0, 1.0, law), ball(mass, length, law)
    assert [e.name for e in one.events] == [e.name for e in other.events]
    for a, b in zip(one.events, other.events, strict=True):
        # instants are found to rtol, and what follows an impact has their error
        assert b.t == pytest.approx(a.t, rel=1e-9)
        assert b.after["b"].omega[0] == pytest.approx(a.after["b"].omega[0], rel=1e-7)


@pytest.mark.parametrize(("mass", "rate"), [(3.0, 12.0), (1e-6, 0.4), (1e7, 5.0)])
def test_a_massless_rim_is_turned_at_once(mass, rate):
    """A wheel without inertia lands: no tangential impulse, it rolls, and loses m v_y²/2."""
    radius, height, fast = 0.25, 0.35, 1.7
    machine = mbody.Mechanism(
        "wheel", ground={"O": (0, 0)}, ground_shapes={"road": {"line": {"point": "O"}}}
    )
    machine.add(
        mbody.Body(
            "w",
            mass=mass,
            inertia=0.0,
            points={"C": (0, 0)},
            shapes={"rim": {"disc": "C", "radius": radius}},
        ),
        mbody.Contact("f", "ground.road", "w.rim", friction=0.9),
        mbody.Gravity("g", y=-G),
    )
    start = dict(x=0.0, y=height, angle=0.0, vx=fast, vy=-1.0, omega=rate)
    machine.simulation = mbody.SimulationSettings(until=1.0, start={"w": start})
    run = mbody.simulate(machine, 0.2, rtol=1e-10, instants=5)
    assert run.status == "completed"
    assert run["w"].vx[-1] == pytest.approx(fast, rel=1e-9)
    assert run["w"].omega[-1] == pytest.approx(-fast / radius, rel=1e-9)
    lost = 0.5 * mass * (1.0 + 2.0 * G * (height - radius))
    assert run.energy.lost["f"][-1] == pytest.approx(lost, rel=1e-8)


@pytest.mark.parametrize("mass", [2e-6, 1.0, 5e6])
def test_impulses_of_a_tumbling_box_lie_in_coulombs_cone(mass):
    """By momentum alone: what the box got at each impact with the slope, which alone touches it."""
    slope, mu = -0.17, 0.35
    floor = {"line": {"point": "O", "angle": slope}}
    machine = mbody.Mechanism("box", ground={"O": (0, 0)}, ground_shapes={"floor": floor})
    corners = {"a": (-0.2, -0.1), "b": (0.25, -0.12), "c": (0.22, 0.15), "d": (-0.2, 0.12)}
    machine.add(
        mbody.Body(
            "box",
            mass=mass,
            inertia=0.03 * mass,
            points=corners,
            shapes={"s": {"polygon": list("abcd")}},
        ),
        mbody.Gravity("g", y=-G),
        mbody.Contact("foot", "ground.floor", "box.s", friction=mu, static=0.4, restitution=0.4),
    )
    start = dict(x=0.0, y=0.8, angle=0.7, vx=1.0, vy=0.0, omega=4.0)
    machine.simulation = mbody.SimulationSettings(until=1.0, start={"box": start})
    run = mbody.simulate(machine, 1.2, rtol=1e-10, instants=5)
    assert run.status == "completed" and not run.doubts
    along, across = (
        np.array([math.cos(slope), math.sin(slope)]),
        np.array([-math.sin(slope), math.cos(slope)]),
    )
    struck = [e for e in run.events if e.name == "impact"]
    assert len(struck) > 3
    for e in struck:
        a, b = e.state["box"], e.after["box"]
        got = np.array([b.vx[0] - a.vx[0], b.vy[0] - a.vy[0]])
        speed = math.hypot(a.vx[0], a.vy[0]) + abs(a.omega[0])
        # velocities have rounding of the greatest of them
        assert abs(got @ along) <= mu * (got @ across) + 1e-13 * speed


def test_newtons_law_that_friction_wedges_is_said():
    """A hinged rod whose tip strikes the floor ahead of its hinge: any rebound slides, and friction
    that opposes it holds more than the impulse throws; the cone holds the tip by Poisson's law.
    """
    for law, ends in (("newton", True), ("poisson", False)):
        floor = {"line": {"point": "F"}}
        machine = mbody.Mechanism(
            "rod", ground={"O": (0, 0), "F": (0, -0.9)}, ground_shapes={"floor": floor}
        )
        machine.add(
            mbody.Body(
                "rod", mass=2.0, inertia=0.2, cg=(0.5, 0), points={"O": (0, 0), "A": (1, 0)}
            ),
            mbody.Revolute("O", "ground.O", "rod.O"),
            mbody.Gravity("g", y=-G),
            mbody.Contact("tip", "ground.floor", "rod.A", friction=2.5, restitution=0.5, law=law),
        )
        start = {"rod": dict(angle=math.radians(-140.0), omega=2.0)}
        machine.simulation = mbody.SimulationSettings(until=1.0, start=start)
        run = mbody.simulate(machine, 0.6, instants=5)
        wedged = "friction wedges what Newton's law of impact would throw back" in run.status
        assert wedged == ends
        if not ends:
            assert run.mode("tip")[-1] == "stick" and abs(run["rod"].omega[-1]) < 1e-9


@pytest.mark.parametrize("pull", [2.0, 6.0])
@pytest.mark.parametrize("light", [1e-9, 1e-3, 1.0])
def test_a_light_box_on_a_heavy_slab_that_is_pulled(light, pull):
    """Without friction below, the slab goes off by `pull` and takes the box along, up to μ g."""
    heavy, mu, g = 1e9, 0.4, 10.0
    corners = {"A": (-1.0, -0.5), "B": (1.0, -0.5), "C": (1.0, 0.5), "D": (-1.0, 0.5)}
    small = {name: (0.2 * x, 0.2 * y) for name, (x, y) in corners.items()}
    shape = {"box": {"polygon": tuple(corners)}}
    shapes = {"floor": {"line": {"point": "O", "angle": 0.0}}}
    made = mbody.Mechanism("slab", ground={"O": (0.0, 0.0)}, ground_shapes=shapes)
    made.add(
        mbody.Body(
            "slab", mass=heavy, inertia=heavy, points={**corners, "O": (0.0, 0.0)}, shapes=shape
        ),
        mbody.Body("box", mass=light, inertia=0.02 * light, points=small, shapes=shape),
        mbody.Contact("below", "ground.floor", "slab.box"),
        mbody.Contact("between", "slab.box", "box.box", friction=mu),
        mbody.Gravity("gravity", y=-g),
        mbody.Force("pull", "slab.O", (heavy + light) * pull if pull < mu * g else heavy * pull),
    )
    start = {"slab": {"y": 0.5}, "box": {"y": 1.1}}
    made.simulation = mbody.SimulationSettings(until=0.2, start=start, instants=3)
    run = mbody.simulate(made)
    along = min(pull, mu * g)
    assert all(
        mode.startswith("stick" if pull < mu * g else "slip") for mode in run.mode("between")
    )
    assert_allclose(run["box"].ax, along, rtol=1e-8)
    assert_allclose(np.abs(run.reaction("between").fx), light * along, rtol=1e-6)
    assert_allclose(np.abs(run.reaction("between").fy), light * g, rtol=1e-6)
    assert_allclose(run["box"].x[-1], 0.5 * along * 0.2**2, rtol=1e-8)
