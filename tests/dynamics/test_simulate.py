"""Free motion over time, against other integrators, closed forms, and itself run otherwise."""

import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbody
from mbody import (
    AngleDriver,
    Body,
    CoordinateDriver,
    Damper,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Spring,
    Torque,
    cli,
    from_toml,
    gallery,
    makers,
    simulate,
    to_toml,
)
from mbody.files.model import in_units
from mbody.laws import ConstantSpeed, Harmonic, Table
from tests.support.linkages import random_linkage

G = 9.81


def pendulum(**body):
    machine = Mechanism("pendulum")
    own = {"mass": 2.0, "inertia": 0.3, "cg": (0.8, 0.0), "guess": 0.2} | body
    machine.add(Body("bob", **own), Revolute("O", "ground", "bob"), Gravity("gravity", y=-G))
    return machine


def test_pendulum():
    machine = pendulum()
    run = simulate(machine, 3.0, rtol=1e-10, instants=31)
    k = 2.0 * G * 0.8 / (0.3 + 2.0 * 0.64)
    start = [run["bob"].angle[0], 0.0]
    truth = solve_ivp(
        lambda t, y: [y[1], -k * math.cos(y[0])],
        (0.0, 3.0),
        start,
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        t_eval=run.t,
    )
    # some fifty steps of 1e-10, between them a polynomial of order 7
    assert run["bob"].angle == pytest.approx(truth.y[0], abs=2e-8)
    assert run["bob"].omega == pytest.approx(truth.y[1], abs=5e-8)
    assert run.t[-1] == 3.0 and run.status == "completed"
    # the pin by Newton's law from the motion
    body, pin = run["bob"], run.reaction("O", on="bob")
    assert pin.fx == pytest.approx(2.0 * body.ax, abs=1e-9)
    assert pin.fy == pytest.approx(2.0 * (body.ay + G), abs=1e-9)
    assert np.abs(run.energy.balance).max() < 1e-8 * run.energy.size
    assert run.checks.constraint < 1e-13 and run.checks.virtual_work < 1e-11


def test_a_point_mass_without_inertia():
    """Its own inertia is 0, which nothing may replace: the period of a level release."""
    machine = pendulum(mass=1.0, inertia=0.0, cg=(1.0, 0.0), guess=math.pi)
    machine.simulation = SimulationSettings(1.0, {"bob": {"angle": math.pi}})
    period = 2.36784194757623577
    run = simulate(machine, period, rtol=1e-12, instants=2)
    assert run["bob"].angle[-1] == pytest.approx(math.pi, abs=1e-10)
    assert run["bob"].omega[-1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_the_error_follows_the_tolerance(rtol):
    """Norton's four-bar for a second, beside a run at the tightest tolerance."""
    machine = gallery.load("free_fourbar")
    truth = simulate(machine, 1.0, rtol=1e-13, instants=21)
    run = simulate(machine, 1.0, rtol=rtol, instants=21)
    for name in run:
        apart = np.abs(run[name].angle - truth[name].angle).max()
        assert apart < 100.0 * rtol  # fifty steps of that error
    assert np.abs(run.energy.balance).max() < 100.0 * rtol * run.energy.size


# -- singular positions and redundant rows ----------------------------------------------------


def windows(count):
    machine = gallery.load(f"n_windows_{count}")
    return machine


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize("seed", range(5))
def test_windows_from_anywhere(seed, rtol):
    """Random starts of two windows for 5 s, at least one singular position in most of them."""
    rng = np.random.default_rng([7, seed])
    theta, omega = rng.uniform(-3.0, 3.0), rng.uniform(-6.0, 6.0)
    machine = windows(2)
    driven = machine.copied()
    driven.add(AngleDriver("hold", "c0", theta))
    guess = {f"c{n}": theta for n in range(3)}
    guess |= {f"b{n}": (n + math.cos(theta), math.sin(theta), 0.0) for n in range(2)}
    start = mbody.kinematics(driven, drive={"hold": (theta, omega, 0.0)}, guess=guess)
    run = simulate(machine, 5.0, start=start, rtol=rtol, times=[5.0])
    k = G * (1.5 + 2.0) / (1.0 + 2.0)
    truth = solve_ivp(
        lambda t, y: [y[1], -k * math.cos(y[0])],
        (0.0, 5.0),
        [theta, omega],
        method="DOP853",
        rtol=2.3e-14,
        atol=1e-15,
    )
    # a pendulum near its upright position makes errors a thousandfold
    allowed = {1e-6: 1e-3, 1e-8: 1e-5, 1e-10: 1e-6, 1e-12: 1e-7}[rtol]
    assert run["c0"].angle[0] == pytest.approx(truth.y[0, -1], abs=allowed)


def test_start_at_a_singular_position():
    """All rods in one line at the start: the tangent of the start says the way."""
    machine = windows(2)
    machine.simulation = SimulationSettings(
        1.0, {f"c{n}": {"angle": 0.0, "omega": 7.0} for n in range(3)}
    )
    k = G * 3.5 / 3.0
    truth = solve_ivp(
        lambda t, y: [y[1], -k * math.cos(y[0])],
        (0.0, 1.0),
        [0.0, 7.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
    )
    run = simulate(machine, rtol=1e-10, times=[1.0])
    assert run["c0"].angle[0] == pytest.approx(truth.y[0, -1], abs=1e-6)


def test_a_redundant_crank():
    """Three parallel cranks, from rest at 60°: one row too many, and every change point passed."""
    machine = Mechanism("three cranks")
    for n in range(3):
        machine.add(Body(f"c{n}", mass=1.0, inertia=1 / 12, cg=(0.5, 0.0), guess=math.pi / 3))
    points = {f"P{n}": (2.0 * n - 2.0, 0.0) for n in range(3)}
    machine.add(Body("coupler", mass=2.0, inertia=2 * 16 / 12, points=points, guess=0.0))
    for n in range(3):
        machine.add(
            Revolute(f"g{n}", mbody.Marker("ground", (2.0 * n, 0.0)), f"c{n}"),
            Revolute(f"p{n}", mbody.Marker(f"c{n}", (1.0, 0.0)), f"coupler.P{n}"),
        )
    machine.add(Gravity("gravity", y=-G))
    machine.simulation = SimulationSettings(1.0, {"c0": {"angle": math.pi / 3.0}})
    run = simulate(machine, rtol=1e-9, instants=2)
    # thdd = −(3.5 g/3) cos th, references.json: good to nine digits
    assert run["c0"].angle[-1] == pytest.approx(-2.69002479, abs=2e-7)
    assert run["c0"].omega[-1] == pytest.approx(-5.46003533, abs=2e-6)
    assert run.reaction("g1").unique != (True, True, True)


# -- what moves it ----------------------------------------------------------------------------


def test_a_driver_beside_free_motion():
    """A pendulum on a slide that is shaken: l φ'' = −g sin φ − x'' cos φ."""
    machine = Mechanism("shaken")
    law = Harmonic(0.0, 0.1, 7.0, 0.0)
    machine.add(
        Body("slide", mass=3.0),
        Body("bob", mass=1.0, cg=(0.0, -0.5)),
        Prismatic("guide", "ground", "slide"),
        Revolute("pin", "slide", "bob"),
        CoordinateDriver("shaker", "ground", "slide", law),
        Gravity("gravity", y=-G),
    )
    run = simulate(machine, 4.0, rtol=1e-10, instants=41)
    truth = solve_ivp(
        lambda t, y: [
            y[1],
            -(G * math.sin(y[0]) + law.derivatives(t)[2] * math.cos(y[0])) / 0.5,
        ],
        (0.0, 4.0),
        [run["bob"].angle[0], run["bob"].omega[0]],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
        t_eval=run.t,
    )
    assert run["bob"].angle == pytest.approx(truth.y[0], abs=1e-8)
    # what the shaker gives is what the mechanism has: the balance, and the work by hand
    assert np.abs(run.energy.balance).max() < 1e-8 * run.energy.size
    assert "shaker" in run.energy.by
    assert run.energy.work == pytest.approx(run.energy.by["shaker"], abs=1e-15)


def test_the_torque_of_kinetostatics_makes_the_same_motion():
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=5.0)
    times = np.linspace(0.0, 1.0, 401)
    wanted = mbody.kinetostatics(machine, t=times)
    free = Mechanism("free", ground=machine.ground.points)
    free.add(*machine.bodies, *machine.joints)
    free.add(Torque("motor", "crank", value=Table(times, wanted.effort("motor"))))
    run = simulate(free, 1.0, start=wanted.take([0]), rtol=1e-9, times=times[::40])
    # the table's own error between its points, of third order, is what is left
    for name in run:
        assert run[name].angle == pytest.approx(wanted[name].angle[::40], abs=1e-5)


def test_a_damper_takes_energy():
    """A mass on a spring with a damper: the closed form of a decaying oscillation."""
    machine = Mechanism("oscillator", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("mass", mass=2.0, guess=(1.0, 0.0, 0.0)),
        Prismatic("guide", "ground.O", "mass"),
        Spring(
            "spring", mbody.Marker("ground", (-3.0, 0.0)), "mass", stiffness=50.0, free_length=3.0
        ),
        Damper("damper", mbody.Marker("ground", (-3.0, 0.0)), "mass", coefficient=1.5),
    )
    run = simulate(machine, 4.0, rtol=1e-11, instants=41)
    d, w = 1.5 / 4.0, math.sqrt(25.0 - (1.5 / 4.0) ** 2)
    x = np.exp(-d * run.t) * (np.cos(w * run.t) + d / w * np.sin(w * run.t))
    assert run["mass"].x == pytest.approx(x, abs=1e-9)
    energy = run.energy
    whole = 25.0 * (1.0 - x**2) - energy.kinetic
    assert energy.dissipated == pytest.approx(whole, abs=1e-8)
    assert energy.potential == pytest.approx(25.0 * (x**2 - 1.0), abs=1e-8)
    assert (np.diff(energy.dissipated) >= 0.0).all()


def test_momentum_of_what_floats():
    """Two links in the air without gravity: linear and angular momentum stay."""
    machine = Mechanism("floating")
    machine.add(
        Body("a", mass=1.0, inertia=0.2, points={"P": (0.5, 0.0)}),
        Body("b", mass=2.0, inertia=0.1, points={"P": (-0.3, 0.1)}),
        Revolute("pin", "a.P", "b.P"),
    )
    machine.simulation = SimulationSettings(
        5.0, {"a": {"x": 0.0, "y": 0.0, "angle": 0.3, "vx": 1.0, "omega": 4.0}, "b": {"angle": 1.0}}
    )
    run = simulate(machine, rtol=1e-10, instants=21)
    a, b = run["a"], run["b"]
    px, py = a.vx + 2.0 * b.vx, a.vy + 2.0 * b.vy
    spin = a.x * a.vy - a.y * a.vx + 2.0 * (b.x * b.vy - b.y * b.vx)
    spin = spin + 0.2 * a.omega + 0.1 * b.omega
    for kept in (px, py, spin):
        assert kept == pytest.approx(kept[0], abs=1e-8)


def test_backwards():
    """A conservative motion run back: rates turned round, it returns to where it came from."""
    machine = gallery.load("double_pendulum")
    there = simulate(machine, 1.5, rtol=1e-12, instants=2)
    start = {
        name: {"angle": float(there[name].angle[-1]), "omega": -float(there[name].omega[-1])}
        for name in there
    }
    machine.simulation = SimulationSettings(1.5, start)
    back = simulate(machine, rtol=1e-12, instants=2)
    for name in there:
        assert back[name].angle[-1] == pytest.approx(there[name].angle[0], abs=1e-8)
        assert back[name].omega[-1] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_random_linkages_keep_their_account(seed):
    """Free of their motor, with loads of every kind."""
    machine, _ = random_linkage(seed, loops=2 + seed % 2, sliders=bool(seed % 2))
    free = Mechanism(machine.name, units=machine.units, ground=machine.ground.points)
    free.add(*(e for e in machine if e.name != "motor"))
    start = mbody.kinematics(machine, t=0.0)
    run = simulate(free, 0.2, start=start, rtol=1e-9, instants=5)
    assert np.abs(run.energy.balance).max() < 1e-6 * run.energy.size
    assert run.checks.constraint < 1e-12


# -- requests ---------------------------------------------------------------------------------


def test_instants_between_steps_do_not_change_the_motion():
    machine = gallery.load("free_fourbar")
    few, many = (simulate(machine, 1.0, rtol=1e-9, instants=n) for n in (2, 1001))
    assert few["crank"].angle[-1] == many["crank"].angle[-1]
    assert few.stats["steps"] == many.stats["steps"]
    every = simulate(machine, 1.0, rtol=1e-9, every=0.3)
    assert every.t == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.0])
    # the polynomial between steps is as good as they are
    tight = simulate(machine, 1.0, rtol=1e-13, instants=1001)
    assert many["crank"].angle == pytest.approx(tight["crank"].angle, abs=1e-6)


def test_files_and_the_command(capsys, tmp_path):
    machine = gallery.load("free_fourbar")
    assert from_toml(to_toml(machine)) == machine
    assert in_units(machine, "SI").simulation is not None
    metric = simulate(in_units(machine, "SI"), 1.0, instants=2)
    own = simulate(machine, 1.0, instants=2)
    assert metric["crank"].angle[-1] == pytest.approx(own["crank"].angle[-1], abs=1e-6)
    status = cli.main(["simulate", "free_fourbar", "--to", "1", "--instants", "11", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert status == 0 and told["analysis"] == "simulate" and told["status"] == "completed"
    assert len(told["t"]) == 11 and told["t"][-1] == 1.0
    keys = {"kinetic", "potential", "work", "dissipated", "balance", "by"}
    assert set(told["energy"]) == keys and told["stats"]["steps"] > 10
    assert told["bodies"]["crank"]["angle"][0] == pytest.approx(60.0, abs=1e-9)
    path = tmp_path / "run.csv"
    assert (
        cli.main(["simulate", "free_fourbar", "--to", "1 s", "--every", "0.5", "--csv", str(path)])
        == 0
    )
    assert "ENERGY   balance" in capsys.readouterr().out
    assert len(path.read_text().splitlines()) == 4


def test_a_speed_of_its_own():
    """A rotor that nothing holds keeps turning at its speed."""
    machine = Mechanism("rotor")
    machine.add(Body("rotor", mass=1.0, inertia=2.0), Revolute("O", "ground", "rotor"))
    run = simulate(machine, 10.0, rates={"rotor": 3.0}, instants=3)
    assert run["rotor"].angle == pytest.approx([0.0, 15.0, 30.0], abs=1e-9)
    push = machine.copied()
    push.add(Force("push", mbody.Marker("rotor", (0.5, 0.0)), 4.0, angle=math.pi / 2, follows=True))
    run = simulate(push, 2.0, instants=3)
    assert run["rotor"].omega == pytest.approx(run.t, abs=1e-9)
    assert ConstantSpeed(0.0, 1.0)(2.0) == 2.0


def test_a_near_miss():
    """A coupler 1e-7 too long: at the change point it turns back within a ten-millionth of a turn.

    The reference is the same at rtol 1e-13, and prototypes elsewhere: 4.119706, 3.141592533.
    """
    machine = Mechanism("near miss", ground={"A": (0.0, 0.0), "B": (1.0, 0.0)})
    link = {"mass": 1.0, "inertia": 1.0 / 12.0, "cg": (0.5, 0.0)}
    machine.add(
        Body("crank", points={"P": (1.0, 0.0)}, guess=math.pi / 2.0, **link),
        Body("coupler", points={"P": (1.0 + 1e-7, 0.0)}, guess=0.0, **link),
        Body("rocker", points={"P": (1.0, 0.0)}, guess=math.pi / 2.0, **link),
        *(Revolute(name, *ends) for name, *ends in PINS),
        Gravity("gravity", y=-G),
    )
    machine.simulation = SimulationSettings(
        10.0, {"crank": {"angle": math.pi / 2.0, "omega": -1.0}}
    )
    run = simulate(machine, rtol=1e-10, instants=2)
    assert run["crank"].angle[-1] == pytest.approx(4.119706, abs=2e-6)
    assert run["rocker"].angle[-1] == pytest.approx(3.141592533, abs=1e-9)


PINS = (
    ("A", "ground.A", "crank"),
    ("C", "crank.P", "coupler"),
    ("D", "coupler.P", "rocker.P"),
    ("B", "ground.B", "rocker"),
)
