"""Full starts as benchmarks state them, rates that contradict, and errors that name the cause."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import (
    AngleDriver,
    Body,
    Gravity,
    Marker,
    Mechanism,
    ModelError,
    Prismatic,
    Revolute,
    SimulationSettings,
    SolveError,
    gallery,
    kinematics,
    kinetostatics,
    load,
    makers,
    mobility,
    simulate,
)
from mbody.engineering import close_loops
from mbody.engines.oracle import Reference
from mbody.laws import ConstantSpeed
from mbody.model.driver import CoordinateDriver
from tests.errors import starting

MOVING = ("andrews_squeezer", "double_pendulum", "free_fourbar", "simple_pendulum")


def full_start(run, digits, instant=-1):
    """Every place and rate of every body at an instant, to so many digits."""
    start = {}
    for body in run.mechanism.bodies:
        origin, own = run.point(Marker(body.name, (0.0, 0.0))), run[body.name]
        whole = {
            "x": origin.x,
            "y": origin.y,
            "angle": own.angle,
            "vx": origin.vx,
            "vy": origin.vy,
            "omega": own.omega,
        }
        start[body.name] = {
            key: float(f"{part[instant]:.{digits}g}") for key, part in whole.items()
        }
    return start


def belt(**start):
    """A block on a belt that a motor moves at 0.1 m/s."""
    machine = Mechanism("belt")
    up = math.radians(90.0)
    machine.add(
        Body("belt", guess=(0.0, 0.0, 0.0)),
        Body("block", mass=1.0, guess=(0.0, 1.0, 0.0)),
        Prismatic("guide", "ground", "belt"),
        Prismatic("slot", Marker("belt", (0.0, 0.0), up), Marker("block", (0.0, 0.0), up)),
        CoordinateDriver("motor", "ground", "belt", ConstantSpeed(0.0, 0.1)),
    )
    machine.simulation = SimulationSettings(1.0, start)
    return machine


def test_a_full_start_where_a_driver_moves():
    """Nothing holds the block along the belt: it keeps its rates."""
    run = simulate(belt(block={"x": 0.0, "y": 1.0, "vx": 0.1, "vy": 0.25}))
    assert run.status == "completed" and run.notes == ()
    assert_allclose(run["block"].x, 0.1 * run.t, rtol=0, atol=1e-12)
    assert_allclose(run["block"].y, 1.0 + 0.25 * run.t, rtol=0, atol=1e-12)


def test_a_rate_that_a_driver_contradicts_is_named():
    with pytest.raises(SolveError, match=r"do not fit .*'motor'.*block\.vx = 0\.1 m/s, not 0\.3"):
        simulate(belt(block={"x": 0.0, "y": 1.0, "vx": 0.3, "vy": 0.0}))
    with pytest.raises(SolveError, match=r"do not fit 'motor'.*belt\.vx = 0\.1 m/s, not 0\.3"):
        simulate(belt(belt={"x": 0.0, "vx": 0.3}))


@pytest.mark.parametrize("digits", [17, 6, 4])
@pytest.mark.parametrize("name", MOVING)
def test_a_full_start_of_so_many_digits(name, digits):
    machine = gallery.load(name)
    middle = simulate(machine, 0.02, instants=2, rtol=1e-10)
    start = full_start(middle, digits)
    machine.simulation = SimulationSettings(0.01, start, instants=2)
    run = simulate(machine)
    size = 0.6 * 10.0 ** (1 - digits)
    for body in machine.bodies:
        for key, scale in (("x", run.system.length), ("y", run.system.length), ("angle", 1.0)):
            wanted = getattr(middle[body.name], key)[-1]
            # rounding of each number is half a unit of its last digit; some joints make three of it
            near = 10.0 * size * max(scale, abs(wanted)) + 1e-12
            assert getattr(run[body.name], key)[0] == pytest.approx(wanted, abs=near)
    assert run.checks.constraint < 1e-12 * (1.0 + run.system.length)
    fitted = [note for note in run.notes if "were fitted to joints and drivers" in note]
    # joints of a pendulum that is rounded by itself may still fit to nine digits
    assert len(fitted) <= 2 and (bool(fitted) or digits == 17 or name == "simple_pendulum")
    if digits == 17:
        assert not fitted


@pytest.mark.parametrize("off", [2e-4, 0.3])
def test_the_oracle_agrees_which_velocities_are_the_nearest(off):
    """Least squares on the null space of the oracle's own Φ_q; what is far off is refused."""
    made = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 2.0, 1.0))
    machine = Mechanism("free", ground=made.ground.points)
    machine.add(*made.bodies, *made.joints)
    names = [body.name for body in machine.bodies]
    first, oracle = close_loops(machine), Reference(machine)
    q = np.array([getattr(first[n], key)[0] for n in names for key in ("x", "y", "angle")])
    turning = np.linalg.svd(oracle.phi_q(q, 0.0))[2][-1][2::3]
    given = 2.0 * turning / turning[0] + off * np.array([1.0, -1.0, 0.5])
    nearest = turning * (turning @ given) / (turning @ turning)
    start = {
        name: {"angle": float(first[name].angle[0]), "omega": float(rate)}
        for name, rate in zip(names, given, strict=True)
    }
    machine.simulation = SimulationSettings(0.1, start, instants=2)
    machine.add(Gravity("gravity", y=-9.81))
    if off > 1e-3:
        with pytest.raises(SolveError, match="the rates of the start do not fit") as caught:
            simulate(machine)
        for name, value in zip(names, nearest, strict=True):
            assert f"{name}.omega = {value:.6g} rad/s" in str(caught.value)
        return
    run = simulate(machine)
    assert_allclose([run[name].omega[0] for name in names], nearest, rtol=0, atol=1e-10)
    (note,) = run.notes
    change = float(np.abs(nearest - given).max())
    assert note.startswith(
        f"the rates of the start were fitted to joints and drivers: by {change:.2g}"
    )


def test_places_that_contradict_are_named_with_the_nearest():
    start = starting.full(rocker=0.05)
    machine = starting.four_bar(motor=False)
    machine.simulation = SimulationSettings(0.1, start)
    with pytest.raises(SolveError, match=r"rocker\.angle = .* deg \(not ") as caught:
        simulate(machine)
    assert caught.value.element == "rocker"


def test_a_rate_whose_place_is_only_guessed_does_not_hold_it():
    """A guess is rough: it chooses the branch, and holds nothing that follows from what is said."""
    machine = starting.four_bar(motor=False)
    found = close_loops(starting.four_bar(), drive={"motor": (1.0, 2.0)})
    omega = float(found["coupler"].omega[0])
    machine.simulation = SimulationSettings(
        0.1, {"crank": {"angle": 1.0}, "coupler": {"omega": omega}}, instants=2
    )
    run = simulate(machine)
    assert run["crank"].angle[0] == pytest.approx(1.0, abs=1e-12)
    assert run["crank"].omega[0] == pytest.approx(2.0, rel=1e-9)


# -- joints that nearly repeat each other, distances of 0, points that nothing uses --------------


@pytest.mark.parametrize("off", [1e-6, 1e-5, 1e-4, -3e-6])
@pytest.mark.parametrize("analysis", [kinematics, kinetostatics])
def test_a_third_crank_that_is_off(analysis, off):
    with pytest.raises(SolveError, match="nearly repeat each other") as caught:
        analysis(starting.three_cranks(off), t=0.0)
    told = str(caught.value)
    assert "'A2'" in told and "'O2'" in told and "make the lengths agree" in told
    gap = float(told.split("a gap of about ")[1].split()[0])
    assert 0.03 * abs(off) < gap < abs(off)
    with pytest.raises(SolveError, match="nearly repeat each other"):
        mobility(starting.three_cranks(off))


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_a_block_drawn_through_its_pulley(rtol):
    """It is there after √(2·1/a), a = 2 g/3, at 0.5531 s."""
    with pytest.raises(SolveError, match="the distance that 'line' measures") as caught:
        simulate(starting.rope(), 2.0, rtol=rtol)
    assert caught.value.element == "line" and "dry friction" not in str(caught.value)
    told = float(str(caught.value).split("t = ")[1].split()[0])
    assert told == pytest.approx(math.sqrt(3.0 / 9.81), abs=0.02)
    assert caught.value.solution is not None


def test_a_ground_joint_that_is_forgotten():
    with pytest.raises(SolveError, match=r"nothing uses the point 'ground\.O4': join it") as caught:
        kinematics(starting.unjoined("O4"), t=0.0)
    assert "2 degrees left" in str(caught.value)
    # what is only traced is no joint that is missing
    machine = starting.four_bar(motor=False)
    with pytest.raises(SolveError, match="add a driver") as caught:
        kinematics(machine, t=0.0)
    assert "nothing uses" not in str(caught.value)


def test_a_point_of_a_measure_is_used(tmp_path):
    text = """
[ground]
points = { O = [0, 0], Q = [3, 0] }
[bodies]
crank = { guess = 30, points = { A = [1, 0] } }
rod = { guess = 0, points = { B = [2, 0] } }
[joints]
O = { revolute = ["ground.O", "crank"] }
A = { revolute = ["crank.A", "rod"] }
[drivers]
motor = { angle = "crank", law = 0 }
"""
    for more, unused in (("", True), ('[measures]\nd = "rod.B.x - ground.Q.x"\n', False)):
        path = tmp_path / "model.toml"
        path.write_text(text + more)
        with pytest.raises((SolveError, ModelError)) as caught:
            kinematics(load(path), t=0.0)
        assert ("'ground.Q'" in str(caught.value)) == unused


def shaken(start):
    """A rotor with its mass off its axis, driven in a frame that is free on a spring."""
    machine = Mechanism("shaken", ground={"O": (0, 0), "foot": (0, -1)})
    up = math.pi / 2
    machine.add(
        Body("frame", mass=20.0, inertia=1.0, points={"C": (0, 0)}),
        Body("rotor", mass=1.0, inertia=0.01, cg=(0.1, 0.0), points={"C": (0, 0)}),
        Prismatic("rail", Marker("ground", (0, 0), up), Marker("frame", (0, 0), up)),
        Revolute("axle", "frame.C", "rotor.C"),
        AngleDriver("motor", "rotor", ConstantSpeed(0.0, 30.0), relative_to="frame"),
        mbody.Spring("spring", "ground.foot", "frame.C", stiffness=500.0, free_length=1.0),
    )
    if start is not None:
        machine.simulation = SimulationSettings(until=0.5, rtol=1e-10, start=start)
    return machine


@pytest.mark.parametrize(
    "start", [None, {}, {"rotor": {"angle": 0.0, "omega": 30.0}}, {"frame": {"y": 0.0, "vy": 0.0}}]
)
def test_a_frame_that_need_not_move_rests_beside_a_driver(start):
    run = simulate(shaken(start), 0.5, rtol=1e-10)
    assert run.notes == ()
    # 21 y″ + 500 y = m e ω² sin ωt from rest
    own, forced, size = math.sqrt(500.0 / 21.0), 30.0, 0.1 * 30.0**2 / (500.0 - 21.0 * 30.0**2)
    t = run.t
    truth = size * (np.sin(forced * t) - forced / own * np.sin(own * t))
    assert_allclose(run["frame"].y, truth, rtol=0, atol=1e-9)
