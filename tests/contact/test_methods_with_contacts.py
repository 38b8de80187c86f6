"""Events of contacts by methods of all kinds: they agree as far as the order of each says."""

import math

import numpy as np
import pytest

import mbody
from mbody import Simulator
from tests.contact.test_implicit_contacts import ball, door, sprung_box
from tests.dynamics.test_stick_slip import pendulum

EVEN = "generalized-alpha"
G = 9.81


def met(made, **options):
    """Times and names of the events of a motion."""
    run = mbody.simulate(made(), instants=2, **options)
    assert run.status == "completed" and not run.doubts
    return np.array([float(e.t) for e in run.events]), [(e.name, e.contact) for e in run.events]


@pytest.mark.parametrize("made", [ball, sprung_box, door], ids=lambda made: made.__name__)
def test_events_agree_as_far_as_the_order_says(made):
    """Of order 5 and adapted steps by what both tolerances leave; of order 2 by a quarter a half
    as long a step, so that what two lengths tell of none is of order 4.
    """
    times, names = met(made, method="dopri5", rtol=1e-10)
    implicit, by_radau = met(made, method="radau5", rtol=1e-10)
    assert by_radau == names
    assert np.abs(implicit - times).max() < 1e-8
    h = 4e-3
    (long, first), (short, second) = (met(made, method=EVEN, step=h * part) for part in (1.0, 0.5))
    assert first == second == names
    off = np.abs(short - times)
    if made is ball:
        # a parabola is exact in any of its steps; in late flights, of a part of a step, rounding of
        # the gap is more and more of the time
        assert off[:30].max() < 1e-12 and off.max() < 1e-8
        return
    assert np.abs((long - times) / (short - times) - 4.0).max() < 0.05
    assert np.abs((4.0 * short - long) / 3.0 - times).max() < h * off.max()


def test_steps_of_one_length_to_a_stop_have_the_period_of_their_method():
    """ẍ = −ω² x by generalised-α turns by θ a step, the eigenvalue e^{iθ} of its own recursion; the
    first impact on a stop at the middle is so late as that says, but for the two cut steps.
    """
    omega, h, rho = 5.0, 2e-3, 0.9
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    beta = 0.25 * (gamma + 0.5) ** 2
    k = omega**2
    # (1 − α_m) â₁ + α_m â₀ = −k ((1 − α_f) q₁ + α_f q₀) with q₁, v₁ by Newmark's formulas
    left = [[1.0, 0.0, -h * h * beta], [0.0, 1.0, -h * gamma], [k * (1.0 - alpha_f), 0.0, 0.0]]
    left[2][2] = 1.0 - alpha_m
    right = [[1.0, h, h * h * (0.5 - beta)], [0.0, 1.0, h * (1.0 - gamma)]]
    right.append([-k * alpha_f, 0.0, -alpha_m])
    values = np.linalg.eigvals(np.linalg.solve(left, right))
    turned = float(abs(np.angle(values[np.abs(values - np.exp(1j * omega * h)).argmin()])))
    machine = mbody.Mechanism("box", ground={"O": (0.0, 0.0), "P": (-1.0, 0.0)})
    machine.add(
        mbody.Body("box", mass=2.0, inertia=0.1, points={"C": (0.0, 0.0)}),
        mbody.Prismatic("guide", "ground.O", "box.C", limits=(0.0, None), restitution=0.5),
        mbody.Spring("spring", "ground.P", "box.C", stiffness=2.0 * k, free_length=1.0),
    )
    machine.simulation = mbody.SimulationSettings(until=0.5, start={"box": {"x": 0.3}})
    run = mbody.simulate(machine, method=EVEN, step=h)
    expected = 0.5 * math.pi * h / turned
    exact = 0.5 * math.pi / omega
    strike = float(run.events[0].t)
    assert strike == pytest.approx(expected, abs=0.05 * abs(expected - exact))


@pytest.mark.parametrize(
    "options",
    [{"method": "radau5", "rtol": 1e-10}, {"method": EVEN, "step": 1e-3}],
    ids=lambda options: options["method"],
)
def test_steps_of_a_simulator_are_those_of_simulate(options):
    """With its events, those of another method, and again from what was saved."""
    sim = Simulator(ball(), **options)
    while sim.t < 1.75:
        sim.step(0.1)
    run = mbody.simulate(ball(), float(sim.t), method="dop853")
    assert [e.name for e in sim.events] == [e.name for e in run.events] == ["impact"] * 3
    times = [[float(e.t) for e in one.events] for one in (sim, run)]
    assert times[0] == pytest.approx(times[1], abs=1e-12)
    state = sim.state
    sim.step(0.1)
    height = float(sim["ball"].y)
    sim.state = state
    sim.step(0.1)
    assert float(sim["ball"].y) == height


@pytest.mark.parametrize(
    ("made", "options"),
    [(pendulum, {"method": "radau5", "rtol": 1e-8}), (door, {"method": EVEN, "step": 2e-3})],
    ids=lambda one: one.__name__ if callable(one) else one["method"],
)
def test_a_motion_goes_on_bit_for_bit(made, options):
    machine = made()
    whole = mbody.simulate(machine, 3.0, times=[0.0, 1.0, 2.0, 3.0], **options)
    part = mbody.simulate(machine, 2.0, times=[0.0, 1.0, 2.0], **options)
    rest = mbody.simulate(machine, 3.0, start=part, times=[2.0, 3.0], **options)
    assert float(rest["bob"].angle[-1]) == float(whole["bob"].angle[-1])
    assert float(rest["bob"].omega[-1]) == float(whole["bob"].omega[-1])


@pytest.mark.parametrize(
    "options",
    [{"method": "dopri5"}, {"method": "radau5"}, {"method": EVEN, "step": 1e-2}],
    ids=lambda options: options["method"],
)
def test_what_rests_at_zero_but_for_rounding_is_no_event(options):
    """A ball that has come to rest has no top any more, whatever rounding makes of its speed."""
    machine = ball()
    start = {"ball": {"y": 0.0, "vy": 0.1}}
    machine.simulation = mbody.SimulationSettings(until=0.6, start=start)
    tops = [mbody.Event("ball.vy", direction=-1, name="top")]
    run = mbody.simulate(machine, events=tops, instants=2, **options)
    names = [e.name for e in run.events]
    bounces = names.count("impact")
    assert names == ["top", "impact"] * bounces + ["top", "rest"]
    speeds = 0.1 * 0.8 ** np.arange(bounces + 1)
    lands = np.cumsum(2.0 * speeds / G)
    times = [float(e.t) for e in run.events if e.name == "top"]
    assert times == pytest.approx((lands - speeds / G).tolist(), abs=1e-9)
