"""Contacts, stops and frictional joints by the implicit method, beside closed forms and dop853."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    Contact,
    Damper,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Spring,
)
from tests.contact.test_contact_references import rod
from tests.dynamics.test_stick_slip import pendulum
from tests.support import contact_models as models
from tests.support.cases import first_fast

G = 9.81
#: Of a motion at this rtol events are located to some hundred times as much.
RTOL, NEAR = 1e-10, 1e-8


def ball() -> Mechanism:
    machine = Mechanism(
        "ball", ground={"O": (0.0, 0.0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    machine.add(
        Body("ball", mass=1.0, inertia=0.1, points={"C": (0.0, 0.0)}),
        Contact("floor", "ground.floor", "ball.C", restitution=0.8),
        Gravity("gravity", y=-G),
    )
    machine.simulation = SimulationSettings(until=5.0, start={"ball": {"y": 1.0}})
    return machine


def sprung_box() -> Mechanism:
    """A box on a rough guide that a spring pulls to and fro until it sticks."""
    machine = Mechanism("box", ground={"O": (0.0, 0.0), "P": (-2.0, 0.0)})
    machine.add(
        Body("box", mass=1.5, inertia=0.1, points={"C": (0.0, 0.0)}),
        Prismatic("guide", "ground.O", "box.C", friction=0.25, static=0.4),
        Spring("spring", "ground.P", "box.C", stiffness=60.0, free_length=2.0),
        Gravity("gravity", y=-G),
    )
    machine.simulation = SimulationSettings(until=4.0, start={"box": {"x": 0.7}})
    return machine


def door(restitution: float = 0.4) -> Mechanism:
    """A pendulum against a stop at its lowest place: half periods of it, and e of the rate."""
    machine = Mechanism("pendulum at a stop", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.18, cg=(0.0, -0.4), points={"O": (0.0, 0.0)}),
        Revolute("O", "ground.O", "bob.O", limits=(0.0, None), restitution=restitution),
        Gravity("gravity", y=-G),
    )
    machine.simulation = SimulationSettings(until=4.0, start={"bob": {"angle": 1.2}})
    return machine


def by(machine: Mechanism, method: str, rtol: float) -> mbody.Solution:
    machine.simulation = replace(machine.simulation, method=method, rtol=rtol)
    return mbody.simulate(machine)


def test_a_ball_bounces_to_rest():
    run = by(ball(), "radau5", RTOL)
    first, e = math.sqrt(2.0 / G), 0.8
    times = [first * (1.0 + 2.0 * sum(e**k for k in range(1, n))) for n in range(1, 11)]
    assert [float(one.t) for one in run.events[:10]] == pytest.approx(times, abs=1e-12)
    # a parabola is exact in any of its steps
    assert run.events[-1].name == "rest"
    assert float(run.events[-1].t) == pytest.approx(first * (1 + e) / (1 - e), abs=1e-11)
    assert abs(float(run["ball"].y[-1])) < 1e-12
    assert float(run.energy.lost["floor"][-1]) == pytest.approx(G, rel=1e-9)


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


@first_fast("made", [pendulum, sprung_box, door], 2, ids=lambda made: made.__name__)
def test_it_changes_modes_as_the_explicit_method_does(made):
    explicit, implicit = by(made(), "dop853", 1e-12), by(made(), "radau5", RTOL)
    assert explicit.status == implicit.status == "completed"
    assert [(e.name, e.contact) for e in implicit.events] == [
        (e.name, e.contact) for e in explicit.events
    ]
    times = [[float(e.t) for e in run.events] for run in (implicit, explicit)]
    assert times[0] == pytest.approx(times[1], abs=NEAR)
    body = next(iter(made().simulation.start))
    for name in ("x", "y", "angle"):
        ways = [np.asarray(getattr(run[body], name)) for run in (implicit, explicit)]
        assert np.abs(ways[0] - ways[1]).max() < NEAR
    assert abs(implicit.energy.error) < NEAR


def test_it_has_an_impact_without_collision():
    """Painlevé's rod: Λ = −D⁻¹ (0, u)."""
    machine = mbody.from_toml(models.ROD)
    start = {"rod": rod(1.0, 0.0, -3.0)}
    machine.simulation = SimulationSettings(until=0.02, start=start)
    run = by(machine, "radau5", RTOL)
    assert [one.name for one in run.events[:2]] == ["inconsistent", "impact"]
    after = run.events[1].after
    c, s = math.cos(1.0), math.sin(1.0)
    D = np.array([[1.0 + 3.0 * c * c, -3.0 * s * c], [-3.0 * s * c, 1.0 + 3.0 * s * s]])
    normal, tangential = np.linalg.solve(D, [0.0, 3.0])
    turning = 3.0 * (-c * normal + s * tangential)
    assert float(after["rod"].omega[0]) == pytest.approx(turning, abs=1e-12)


def test_a_stiff_damper_leads_a_box_against_a_stop_in_few_steps():
    """ẍ + c ẋ + k x = F with rates of 1 and 2·10⁴ a second, until x is that of the stop."""
    c, k, force, way = 2e4, 2e4, 2e3, 0.05

    def made() -> Mechanism:
        machine = Mechanism("box", ground={"O": (0.0, 0.0), "P": (-1.0, 0.0)})
        machine.add(
            Body("box", mass=1.0, inertia=0.1, points={"C": (0.0, 0.0)}),
            Prismatic("guide", "ground.O", "box.C", limits=(None, way)),
            Damper("damper", "ground.P", "box.C", coefficient=c),
            Spring("spring", "ground.P", "box.C", stiffness=k, free_length=1.0),
            mbody.Force("push", "box.C", force),
        )
        machine.simulation = SimulationSettings(until=1.0, start={"box": {"x": 0.01}})
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
