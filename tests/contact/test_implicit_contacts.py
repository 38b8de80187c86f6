"""Contacts, stops and frictional joints by the implicit method, beside closed forms and dop853."""

import math
from dataclasses import replace

import pytest

import mbody

G = 9.81
#: Of a motion at this rtol events are located to some hundred times as much.
RTOL, NEAR = 1e-10, 1e-8


def ball() -> mbody.Mechanism:
    machine = mbody.Mechanism(
        "ball", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    machine.add(
        mbody.Body("ball", mass=1.0, inertia=0.1, points={"C": (0.0, 0.0)}),
        mbody.Contact("floor", "ground.floor", "ball.C", restitution=0.8),
        mbody.Gravity("gravity", y=-G),
    )
    machine.simulation = mbody.SimulationSettings(until=5.0, start={"ball": {"y": 1.0}})
    return machine


def sprung_box() -> mbody.Mechanism:
    """A box on a rough guide that a spring pulls to and fro until it sticks."""
    machine = mbody.Mechanism("box", ground={"O": (0.0, 0.0), "P": (-2.0, 0.0)})
    machine.add(
        mbody.Body("box", mass=1.5, inertia=0.1, points={"C": (0.0, 0.0)}),
        mbody.Prismatic("guide", "ground.O", "box.C", friction=0.25, static=0.4),
        mbody.Spring("spring", "ground.P", "box.C", stiffness=60.0, free_length=2.0),
        mbody.Gravity("gravity", y=-G),
    )
    machine.simulation = mbody.SimulationSettings(until=4.0, start={"box": {"x": 0.7}})
    return machine


def door(restitution: float = 0.4) -> mbody.Mechanism:
    """A pendulum against a stop at its lowest place: half periods of it, and e of the rate."""
    machine = mbody.Mechanism("pendulum at a stop", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("bob", mass=2.0, inertia=0.18, cg=(0.0, -0.4), points={"O": (0.0, 0.0)}),
        mbody.Revolute("O", "ground.O", "bob.O", limits=(0.0, None), restitution=restitution),
        mbody.Gravity("gravity", y=-G),
    )
    machine.simulation = mbody.SimulationSettings(until=4.0, start={"bob": {"angle": 1.2}})
    return machine


def by(machine: mbody.Mechanism, method: str, rtol: float) -> mbody.Solution:
    machine.simulation = replace(machine.simulation, method=method, rtol=rtol)
    return mbody.simulate(machine)


def test_a_pendulum_strikes_a_stop_as_by_elliptic_integrals():
    """The time from an angle to the lowest place is K(sin φ/2)/ω₀; after an impact ω is −e ω."""
    run = by(door(), "radau5", RTOL)
    rate = math.sqrt(2.0 * G * 0.4 / (0.18 + 2.0 * 0.4**2))

    def quarter(k: float) -> float:
        a, b = 1.0, math.sqrt(1.0 - k * k)
        while abs(a - b) > 1e-15:
            a, b = 0.5 * (a + b), math.sqrt(a * b)
        return math.pi / (2.0 * a)

    k = math.sin(0.6)  # ω at the lowest place is 2 ω₀ k
    t, times = quarter(k) / rate, []
    for _ in range(5):
        times.append(t)
        k *= 0.4
        t += 2.0 * quarter(k) / rate
    strikes = [float(one.t) for one in run.events if one.name == "impact"]
    assert strikes[:5] == pytest.approx(times, abs=NEAR)


def test_a_stiff_damper_leads_a_box_against_a_stop_in_few_steps():
    """ẍ + c ẋ + k x = F with rates of 1 and 2·10⁴ a second, until x is that of the stop."""
    c, k, force, way = 2e4, 2e4, 2e3, 0.05

    def made() -> mbody.Mechanism:
        machine = mbody.Mechanism("box", ground={"O": (0.0, 0.0), "P": (-1.0, 0.0)})
        machine.add(
            mbody.Body("box", mass=1.0, inertia=0.1, points={"C": (0.0, 0.0)}),
            mbody.Prismatic("guide", "ground.O", "box.C", limits=(None, way)),
            mbody.Damper("damper", "ground.P", "box.C", coefficient=c),
            mbody.Spring("spring", "ground.P", "box.C", stiffness=k, free_length=1.0),
            mbody.Force("push", "box.C", force),
        )
        machine.simulation = mbody.SimulationSettings(until=1.0, start={"box": {"x": 0.01}})
        return machine

    implicit, explicit = by(made(), "radau5", 1e-8), by(made(), "dop853", 1e-8)
    fast = -0.5 * (c + math.sqrt(c * c - 4.0 * k))
    slow = k / fast
    # x − F/k = a exp(slow t) + b exp(fast t), of which the second is gone at once
    a = (0.01 - force / k) * fast / (fast - slow)
    expected = math.log((way - force / k) / a) / slow
    assert float(implicit.events[0].t) == pytest.approx(expected, abs=1e-7)
    assert implicit.contact("guide_high")[-1] == pytest.approx(force - k * way, rel=1e-9)
    assert implicit.mode("guide_high")[-1] == "stick"
    assert implicit.stats["steps"] * 20 < explicit.stats["steps"]
