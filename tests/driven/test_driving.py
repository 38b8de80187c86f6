"""Some coordinates driven, others free; motors whose torque falls with their speed."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbody
from mbody import makers
from mbody.engineering import close_loops
from mbody.laws import Harmonic

pytestmark = pytest.mark.processor

G = 9.81


def test_a_motor_with_a_torque_speed_line():
    """J ω̇ = T₀ (1 − ω/ω₀) from rest: ω = ω₀ (1 − exp(−T₀ t/(J ω₀)))."""
    machine = mbody.from_toml("""
        [bodies.rotor]
        mass    = 3
        inertia = 0.2

        [joints]
        O = { revolute = ["ground", "rotor"] }

        [loads.motor]
        torsion_damper = "rotor"
        law            = "-12 N*m*(1 - x/(30 rad/s))"
    """)
    run = mbody.simulate(machine, 2.0, rtol=1e-11, instants=21)
    rate = 12.0 / (0.2 * 30.0)
    # some dozens of steps of 1e-11, and the polynomial between them
    exact = 30.0 * (1.0 - np.exp(-rate * run.t))
    assert run["rotor"].omega == pytest.approx(exact, abs=30.0 * 1e-8)
    turned = 30.0 * (run.t - (1.0 - np.exp(-rate * run.t)) / rate)
    assert run["rotor"].angle == pytest.approx(turned, abs=60.0 * 1e-8)
    # what it gives is what the rotor has: counted as a damper that feeds
    assert -run.energy.dissipated == pytest.approx(0.1 * exact**2, abs=90.0 * 1e-8)


def test_such_a_motor_turns_a_slider_crank():
    """Against one equation, J(θ) θ̈ + ½ J′ θ̇² = T₀ (1 − θ̇/ω₀), J by the ram's way x(θ)."""
    r, l, J, m, T, top = 0.1, 0.35, 0.05, 2.0, 6.0, 40.0
    machine = mbody.Mechanism("press")
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=J, points={"A": (r, 0.0)}, guess=0.5),
        mbody.Body("rod", points={"B": (l, 0.0)}, guess=-0.1),
        mbody.Body("ram", mass=m),
        mbody.Revolute("O", "ground", "crank"),
        mbody.Revolute("A", "crank.A", "rod"),
        mbody.Revolute("B", "rod.B", "ram"),
        mbody.Prismatic("guide", "ground", "ram"),
        mbody.TorsionDamper("motor", "crank", law=lambda x: -T * (1.0 - x / top)),
    )
    machine.simulation = mbody.SimulationSettings(
        1.0, {"crank": {"angle": 0.5}}, rtol=1e-10, instants=21
    )
    run = mbody.simulate(machine)

    def slope(t, y):
        s, c = math.sin(y[0]), math.cos(y[0])
        root = math.sqrt(l * l - (r * s) ** 2)
        x1 = -r * s - r * r * s * c / root
        x2 = -r * c - r * r * (c * c - s * s) / root - (r * r * s * c) ** 2 / root**3
        whole = J + m * x1 * x1
        return [y[1], (T * (1.0 - y[1] / top) - m * x1 * x2 * y[1] ** 2) / whole]

    truth = solve_ivp(
        slope, (0.0, 1.0), [0.5, 0.0], method="DOP853", rtol=1e-13, atol=1e-14, t_eval=run.t
    )
    # a few hundred steps of 1e-10 over thirty radians
    assert run["crank"].angle == pytest.approx(truth.y[0], abs=1e-6)
    assert run["crank"].omega == pytest.approx(truth.y[1], abs=1e-5)


def test_a_pendulum_on_an_arm_that_is_turned():
    """l φ̈ = −g sin φ − a·e_φ of the arm's end, which moves on a circle by its law."""
    law = Harmonic(0.3, 0.8, 4.0, 0.0)
    machine = mbody.Mechanism("whip")
    machine.add(
        mbody.Body("arm", points={"P": (0.4, 0.0)}, guess=0.3),
        mbody.Body("bob", mass=1.5, cg=(0.0, -0.5)),
        mbody.Revolute("O", "ground", "arm"),
        mbody.Revolute("P", "arm.P", "bob"),
        mbody.AngleDriver("motor", "arm", law),
        mbody.Gravity("gravity", y=-G),
    )
    run = mbody.simulate(machine, 4.0, rtol=1e-10, instants=41)

    def slope(t, y):
        a, rate, change = law.derivatives(t)
        ax = -0.4 * (math.sin(a) * change + math.cos(a) * rate**2)
        ay = 0.4 * (math.cos(a) * change - math.sin(a) * rate**2)
        return [y[1], -((G + ay) * math.sin(y[0]) + ax * math.cos(y[0])) / 0.5]

    bob = run["bob"]
    truth = solve_ivp(
        slope,
        (0.0, 4.0),
        [bob.angle[0], bob.omega[0]],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        t_eval=run.t,
    )
    # some hundred steps of 1e-10
    assert bob.angle == pytest.approx(truth.y[0], abs=1e-7)
    assert run["arm"].angle == pytest.approx(law(run.t), abs=1e-12)
    assert np.abs(run.energy.balance).max() < 1e-7 * run.energy.size


def test_a_five_bar_with_one_crank_driven():
    """The free crank, made to move as it did, needs no effort, the driven one the same."""
    machine = mbody.Mechanism("five-bar", ground={"A": (0.0, 0.0), "E": (1.0, 0.0)})
    for name, length, guess in (("a", 0.4, 1.2), ("b", 0.9, 0.5), ("c", 0.8, 2.2), ("d", 0.5, 1.9)):
        machine.add(makers.bar(name, length, mass=length, ends=("P", "Q"), guess=guess))
    for name, i, j in (
        ("A", "ground.A", "a.P"),
        ("B", "a.Q", "b.P"),
        ("C", "b.Q", "c.Q"),
        ("D", "d.Q", "c.P"),
        ("E", "ground.E", "d.P"),
    ):
        machine.add(mbody.Revolute(name, i, j))
    machine.add(
        mbody.AngleDriver("motor", "a", Harmonic(1.2, 0.5, 3.0, 0.0)),
        mbody.Gravity("gravity", y=-G),
    )
    run = mbody.simulate(machine, 1.0, rtol=1e-11, instants=21)
    assert np.ptp(run["d"].angle) > 0.3
    both = machine.copied()
    both.add(mbody.AngleDriver("second", "d", 0.0))
    told = {
        driver: tuple(getattr(run[body], part) for part in ("angle", "omega", "alpha"))
        for driver, body in (("motor", "a"), ("second", "d"))
    }
    guess = {body: float(run[body].angle[0]) for body in run}
    wanted = mbody.kinetostatics(both, drive=told, guess=guess)
    peak = np.abs(wanted.effort("motor")).max()
    # positions between steps are good to 1e-9, of accelerations of a hundred
    assert np.abs(wanted.effort("second")).max() < 1e-7 * peak
    assert wanted.effort("motor") == pytest.approx(run.effort("motor"), abs=1e-7 * peak)
    assert wanted.reaction("C").fx == pytest.approx(run.reaction("C").fx, abs=1e-7 * peak)


@pytest.mark.parametrize("machine, rates", [("swing", {"bob": 3.0}), ("bars", {"crank": 2.0})])
def test_a_rate_that_the_joints_allow_is_met(machine, rates):
    """Mass centres beside the pin, closed loops: the body turns exactly as fast as requested."""
    if machine == "swing":
        made = mbody.Mechanism("swing")
        made.add(mbody.Body("bob", mass=1.0, cg=(0.5, 0.0)), mbody.Revolute("O", "ground", "bob"))
    else:
        made = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)).without("motor")
    start = close_loops(made, rates=rates)
    for body, rate in rates.items():
        assert start[body].omega[0] == pytest.approx(rate, rel=1e-14)
    assert start.notes == ()


def test_rates_that_the_joints_do_not_allow_are_told():
    """Of two bodies of one freedom the nearest by least squares, in the run's notes too."""
    made = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)).without("motor")
    ratio = float(close_loops(made, rates={"crank": 1.0})["rocker"].omega[0])
    asked = {"crank": 1.0, "rocker": 9.0}
    start = close_loops(made, rates=asked)
    nearest = (1.0 + 9.0 * ratio) / (1.0 + ratio**2)
    assert start["crank"].omega[0] == pytest.approx(nearest, rel=1e-12)
    (note,) = start.notes
    assert note.startswith("rates: 'crank' turns at ") and "'rocker' turns at " in note
    assert "not at 9" in note and mbody.simulate(made, 0.01, rates=asked).notes == (note,)
    driven = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0))
    assert "'rocker' turns at 0 rad/s, not at 9" in close_loops(
        driven, rates={"rocker": 9.0}
    ).notes[0].replace("-0 ", "0 ")


def test_a_turning_pin_of_a_body_beside_it():
    """What is left open moves least: the link that is not named does not lift its mass centre."""
    made = mbody.Mechanism("two")
    made.add(
        mbody.Body("a", mass=1.0, cg=(0.5, 0.0), guess=0.0),
        mbody.Body("b", mass=1.0, guess=0.0),
        mbody.Revolute("O", "ground", "a"),
        mbody.Revolute("P", mbody.Marker("a", (1.0, 0.0)), "b"),
    )
    start = close_loops(made, rates={"a": 2.0})
    assert start["b"].vy[0] == pytest.approx(2.0, rel=1e-12)
    assert start["b"].omega[0] == pytest.approx(0.0, abs=1e-12)
