"""Contact, friction and impacts of any size and mass: answers in their own units are the same."""

import math

import pytest

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


@pytest.mark.parametrize("e", [0.0, 0.5])
@pytest.mark.parametrize(("mass", "rate"), [(3.0, 12.0), (1e-6, 0.4), (1e7, 5.0)])
def test_a_massless_rim_is_turned_at_once(mass, rate, e):
    """A wheel without inertia lands: no tangential impulse, it rolls, loses (1 − e²) m v_y²/2."""
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
        mbody.Contact("f", "ground.road", "w.rim", friction=0.9, restitution=e),
        mbody.Gravity("g", y=-G),
    )
    start = dict(x=0.0, y=height, angle=0.0, vx=fast, vy=-1.0, omega=rate)
    machine.simulation = mbody.SimulationSettings(until=1.0, start={"w": start})
    run = mbody.simulate(machine, 0.2, rtol=1e-10, instants=5)
    assert run.status == "completed"
    assert run["w"].vx[-1] == pytest.approx(fast, rel=1e-9)
    assert run["w"].omega[-1] == pytest.approx(-fast / radius, rel=1e-9)
    lost = 0.5 * (1.0 - e**2) * mass * (1.0 + 2.0 * G * (height - radius))
    assert run.energy.lost["f"][-1] == pytest.approx(lost, rel=1e-8)


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
