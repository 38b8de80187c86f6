"""Impacts on stops, against closed forms."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from mbody import (
    Body,
    Event,
    Gravity,
    Mechanism,
    Revolute,
    SimulationSettings,
    Stop,
    gallery,
    simulate,
)
from tests.falling import ball, blocks

G = 9.81


def test_a_rod_falls_on_its_end():
    """Newton's law with the effective mass 1/(1/m + x²/I) of the end, by hand."""
    m, inertia, half, lean, e = 2.0, 0.15, 0.4, 0.5, 0.6
    machine = Mechanism("rod")
    machine.add(
        Body("rod", mass=m, inertia=inertia, points={"P": (-half, 0.0)}, guess=(0.0, 1.0, lean)),
        Gravity("gravity", y=-G),
    )
    run = simulate(machine, 0.6, events=[Stop("rod.P.y", e, "floor")])
    hit = run.events[0]
    drop = 1.0 - half * math.sin(lean)
    assert hit.t == pytest.approx(math.sqrt(2.0 * drop / G), abs=1e-13)
    speed, arm = -math.sqrt(2.0 * G * drop), -half * math.cos(lean)
    impulse = -(1.0 + e) * speed / (1.0 / m + arm**2 / inertia)
    after = hit.after["rod"]
    # slopes by differences of fourth order: 1e-12
    assert after.vy[0] == pytest.approx(speed + impulse / m, abs=1e-10)
    assert after.omega[0] == pytest.approx(arm * impulse / inertia, abs=1e-10)
    assert hit.after.point("rod.P").vy[0] == pytest.approx(-e * speed, abs=1e-10)
    assert hit.state["rod"].vy[0] == pytest.approx(speed, abs=1e-12)
    # what is lost, by Carnot's theorem
    lost = 0.5 * (1.0 - e**2) * speed**2 / (1.0 / m + arm**2 / inertia)
    assert run.energy.dissipated[-1] == pytest.approx(lost, rel=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-9 * run.energy.size


def test_a_double_pendulum_strikes_its_elbow():
    """In its two angles: H(θ) Δω = Jᵀ p, J Δω = −(1 + e) J ω; the joints' impulses drop out."""
    machine = Mechanism("arm")
    a, b, m1, m2, i1, i2 = 0.7, 0.4, 2.0, 1.5, 0.2, 0.1
    machine.add(
        Body("upper", mass=m1, inertia=i1, cg=(0.3, 0.0), points={"E": (a, 0.0)}, guess=0.1),
        Body("lower", mass=m2, inertia=i2, cg=(b, 0.0), guess=(0.7, 0.0, 0.8)),
        Revolute("shoulder", "ground", "upper"),
        Revolute("elbow", "upper.E", "lower"),
        Gravity("gravity", y=-G),
    )
    start = {"upper": {"angle": 0.1}, "lower": {"angle": 0.8, "omega": -3.0}}
    machine.simulation = SimulationSettings(1.0, start)
    stop = Stop("lower.angle - upper.angle", 0.5, "elbow stop")
    run = simulate(machine, 1.0, rtol=1e-11, events=[stop])
    assert run.events
    for hit in run.events:
        one, two = hit.state["upper"], hit.state["lower"]
        assert two.angle[0] == pytest.approx(one.angle[0], abs=1e-11)
        H = np.array(
            [
                [i1 + m1 * 0.09 + m2 * a * a, m2 * a * b * math.cos(two.angle[0] - one.angle[0])],
                [0.0, i2 + m2 * b * b],
            ]
        )
        H[1, 0] = H[0, 1]
        J, omega = np.array([-1.0, 1.0]), np.array([one.omega[0], two.omega[0]])
        way = np.linalg.solve(H, J)
        expected = omega - 1.5 * (J @ omega) * way / (J @ way)
        after = [hit.after["upper"].omega[0], hit.after["lower"].omega[0]]
        assert after == pytest.approx(expected, abs=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-9 * run.energy.size
    gap = run["lower"].angle - run["upper"].angle
    assert gap.min() > -1e-9 and run.checks.constraint < 1e-12


def test_a_point_mass_on_a_rod_without_inertia():
    """What has no inertia of its own rebounds as the joint lets it."""
    machine = gallery.load("simple_pendulum")
    wall = Stop("270 deg - pendulum.angle", 0.5, "wall")
    run = simulate(machine, 1.5, rtol=1e-11, events=[wall])
    hit = run.events[0]
    speed = math.sqrt(2.0 * G)
    assert hit.state["pendulum"].omega[0] == pytest.approx(speed, abs=1e-9)
    assert hit.after["pendulum"].omega[0] == pytest.approx(-0.5 * speed, abs=1e-9)
    # half the speed: a quarter of the height
    top = simulate(machine, 3.0, events=[wall, Event("pendulum.omega", 1, stop=True)])
    assert top.point("pendulum.P").y[-1] == pytest.approx(-0.75, abs=1e-8)


@pytest.mark.parametrize("name", ["free_fourbar", "n_windows_2"])
def test_one_free_motion_is_turned_round(name):
    """v⁺ = −e v⁻ of every link, whatever the coordinate of the stop, with redundant rows too."""
    machine, e = gallery.load(name), 0.6
    stops = {"free_fourbar": "130 deg - rocker.angle", "n_windows_2": "b1.y + 0.5 m"}
    run = simulate(machine, 1.0, rtol=1e-11, events=[Stop(stops[name], e, "buffer")])
    hit = run.events[0]
    for body in run:
        before, after = hit.state[body], hit.after[body]
        for key in ("vx", "vy", "omega"):
            was, now = getattr(before, key)[0], getattr(after, key)[0]
            # free directions by a dense factor, 1e-12 of the greatest rates
            assert now == pytest.approx(-e * was, rel=1e-9, abs=1e-9)
    assert hit.after.checks.constraint < 1e-12
    assert np.abs(run.energy.balance).max() < 1e-8 * run.energy.size
    assert run.energy.by["buffer"][-1] < 0.0


def test_to_and_fro_between_walls():
    """Elastic walls 1 m apart at 3 m/s: a triangle wave."""
    machine = blocks(0.0, speed=3.0)
    walls = [Stop("b0.x + 0.5 m", 1.0, "left"), Stop("0.5 m - b0.x", 1.0, "right")]
    run = simulate(machine, 5.0, instants=301, events=walls)
    wave = np.arcsin(np.sin(3.0 * math.pi * run.t)) / math.pi
    assert run["b0"].x == pytest.approx(wave, abs=1e-11)  # fifteen impacts
    assert run.energy.kinetic == pytest.approx(4.5, abs=1e-11)
    assert len(run.events) == 15


def test_a_row_of_equal_blocks_hands_on_its_speed():
    """Elastic, two of the three touching: only the last leaves."""
    machine = blocks(0.0, 0.3, 0.4)
    gaps = [Stop(f"b{n + 1}.x - b{n}.x - 0.1 m", 1.0, f"gap{n}") for n in range(2)]
    run = simulate(machine, 1.0, events=gaps)
    speeds = [run[f"b{n}"].vx[-1] for n in range(3)]
    assert speeds == pytest.approx([0.0, 0.0, 1.0], abs=1e-10)
    assert [one.name for one in run.events] == ["gap0", "gap1"]
    assert run["b2"].x[-1] == pytest.approx(0.4 + 0.8, abs=1e-10) and run.status == "completed"


def test_into_a_corner():
    """Both stops are struck at one instant."""
    machine = Mechanism("corner")
    machine.add(Body("ball", mass=2.0, inertia=0.3))
    machine.simulation = SimulationSettings(
        1.0, {"ball": {"x": 1.0, "y": 1.0, "vx": -1.0, "vy": -1.0}}
    )
    corner = [Stop("ball.x", 0.5, "wall"), Stop("ball.y", 0.5, "floor")]
    run = simulate(machine, 3.0, events=corner)
    assert [one.t for one in run.events] == pytest.approx([1.0, 1.0], abs=1e-12)
    assert [run["ball"].vx[-1], run["ball"].vy[-1]] == pytest.approx([0.5, 0.5], abs=1e-11)


def test_a_moving_floor():
    """v⁺ = −e v⁻ + (1 + e) w on a floor that goes at w."""
    machine, e = ball(), 0.7
    floor = Stop("ball.y - 0.1 m*sin(6*t/(1 s))", e, "floor")
    run = simulate(machine, 0.6, events=[floor])
    hit = run.events[0]
    t = brentq(lambda t: 1.0 - 0.5 * G * t * t - 0.1 * math.sin(6.0 * t), 0.3, 0.6, xtol=1e-15)
    assert hit.t == pytest.approx(t, abs=1e-13)
    w = 0.6 * math.cos(6.0 * t)
    # the slope in time by differences of 1e-6: rounding of 1e-16/1e-6
    assert hit.after["ball"].vy[0] == pytest.approx(e * G * t + (1.0 + e) * w, abs=1e-8)


def test_bounces_come_to_rest():
    """The sum of all flights, t₁ (1 + e)/(1 − e), less those too low to be resolved, 1e-14 m."""
    for e in (0.0, 0.3, 0.8):
        run = simulate(ball(), 10.0, events=[Stop("ball.y", e, "floor")])
        first = math.sqrt(2.0 / G)
        left = 2.0 * math.sqrt(8.0 * 1e-14 / G) / (1.0 - e)
        assert 0.0 <= first * (1.0 + e) / (1.0 - e) - run.t[-1] <= left + 1e-12
        assert run.status.endswith("what strikes 'floor' comes to rest there")
        assert run["ball"].vy[-1] == pytest.approx(0.0, abs=1e-6)


def test_touching_without_load_is_no_end():
    """A block that leans on a stop at rest stays while another goes on."""
    machine = blocks(0.5, 0.3)
    # 0.3 − 0.1 − 0.2 is not zero in binary numbers
    run = simulate(machine, 2.0, events=[Stop("b1.x - 0.1 m - 0.2 m", 0.5, "wall")])
    assert run.status == "completed" and not run.events
    assert run["b0"].x[-1] == pytest.approx(2.5, abs=1e-12)


def test_what_lies_on_a_stop_rests_at_once():
    run = simulate(ball(height=0.0), 1.0, events=[Stop("ball.y", 0.5, "floor")])
    assert run.t.tolist() == [0.0] and "comes to rest" in run.status and not run.events
