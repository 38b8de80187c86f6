"""What has no value, no inertia or no way on: sentences, and what is left alone."""

import math

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Force,
    Gravity,
    Marker,
    Mechanism,
    Revolute,
    SimulationSettings,
    Spring,
    Torque,
    TorsionDamper,
    assemble,
    gallery,
    kinematics,
    makers,
)
from mbody.analysis.driven.diagnosis import (
    adjusted,
    branching,
    stuck,
    undetermined,
    valueless,
    weightless,
)
from mbody.analysis.initial.initial_state import initial_state_of
from mbody.engineering import close_loops

G = 9.81


def instant(machine, start=None):
    """System, time, positions and rates of a start."""
    if start is None:
        own = machine.simulation
        start = initial_state_of(assemble(machine), own) if own else close_loops(machine)
    names = [body.name for body in machine.bodies]
    q = [part[-1] for n in names for part in (start[n].x, start[n].y, start[n].angle)]
    v = [part[-1] for n in names for part in (start[n].vx, start[n].vy, start[n].omega)]
    return assemble(machine), float(start.t[-1]), np.array(q), np.array(v)


def flag(*more, **own):
    """A swinging rod with a flag of 1 kg pinned at its mass centre."""
    machine = Mechanism("flag")
    machine.add(
        Body("rod", mass=1.0, inertia=0.1, cg=(0.5, 0.0), points={"P": (1.0, 0.0)}, guess=0.2),
        Body("flag", points={"E": (0.1, 0.0)}, **({"mass": 1.0} | own)),
        Revolute("O", "ground", "rod"),
        Revolute("P", "rod.P", "flag"),
        Gravity("gravity", y=-G),
        *more,
    )
    return machine


TURNING = {
    "torque": Torque("load", "flag", value=1.0),
    # its line passes the pin in the first position: a little beside it turns the flag
    "spring": Spring("load", Marker("ground", (-1.0, 0.0)), "flag.E", stiffness=9.0),
    # no torque at rest
    "damper": TorsionDamper("load", "flag", coefficient=1.0),
    "force": Force("load", "flag.E", 2.0),
}


@pytest.mark.parametrize("load", TURNING.values(), ids=list(TURNING))
def test_what_turns_without_inertia_is_undetermined(load):
    found = undetermined(*instant(flag(load)))
    assert found.element == "flag" and "free to turn, loads turn it" in str(found)
    assert undetermined(*instant(flag(load, inertia=0.01))) is None
    held = flag(load, AngleDriver("hold", "flag", 0.0))
    assert undetermined(*instant(held)) is None


def test_what_nothing_turns_is_left_alone():
    """Points in the air and on pins are ordinary."""
    assert undetermined(*instant(flag())) is None
    assert undetermined(*instant(flag(Force("load", "flag", 2.0)))) is None
    assert undetermined(*instant(gallery.load("bouncing_ball"))) is None
    for name in gallery.names():
        machine = gallery.load(name)
        if machine.simulation:
            assert undetermined(*instant(machine)) is None, name


def test_a_free_body_without_mass_is_undetermined():
    found = undetermined(*instant(flag(mass=0.0)))
    assert found.element == "flag" and "it is free and has no mass" in str(found)


def test_the_load_without_a_value_is_named():
    load = Force("gust", "rod.P", "sqrt(0.5 - t/(1 s))*1 N")
    system, _, q, v = instant(flag(Torque("other", "rod", value=1.0), load))
    found = valueless(system, system.work(), 0.75, q, v)
    assert found.element == "gust" and "load 'gust' has no value at t = 0.75 s" in str(found)


def led(angle):
    """A four-bar led by its rocker, which turns back where crank and coupler are in line."""
    made = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0))
    machine = Mechanism("led", ground=made.ground.points)
    machine.add(*made.bodies, *made.joints, AngleDriver("motor", "rocker", angle))
    return machine


def test_a_driver_that_leads_into_a_dead_centre():
    """In line at 4 = crank + coupler: cos of the rocker's angle by the triangle 3.5, 2, 4."""
    limit = math.pi - math.acos((3.5**2 + 2.0**2 - 4.0**2) / (2.0 * 3.5 * 2.0))
    near = close_loops(led(limit + 1e-9), guess={"crank": 0.524, "coupler": 0.524})
    # 1e-9 of the rocker are 1e-4 of the crank: a square root
    found = stuck(*instant(led(limit + 1e-9), near)[:3])
    assert found.element == "motor"
    assert "'motor' leads 'rocker' into a dead centre" in str(found) and "'A'" in str(found)
    far = close_loops(led(limit + 0.1), guess={"crank": 1.0, "coupler": 0.3})
    assert stuck(*instant(led(limit + 0.1), far)[:3]) is None


def test_a_singular_position_of_joints_alone_is_passed():
    """Windows with their posts level, no driver: nothing to complain of."""
    machine = gallery.load("n_windows_2")
    machine.simulation = SimulationSettings(
        1.0, {f"c{n}": {"angle": 0.0, "omega": 1.0} for n in range(3)}
    )
    assert stuck(*instant(machine)[:3]) is None


def test_a_start_at_rest_where_branches_meet():
    """Three level posts: each may fall by itself to first order, and their rates make them fall."""
    machine = gallery.load("n_windows_2")
    machine.simulation = SimulationSettings(1.0, {f"c{n}": {"angle": 0.0} for n in range(3)})
    (note,) = branching(*instant(machine))
    assert "3 motions are free there to first order, 1 nearby" in note
    moving = {f"c{n}": {"angle": 0.0, "omega": 1.0} for n in range(3)}
    machine.simulation = SimulationSettings(1.0, moving)
    assert branching(*instant(machine)) == ()
    machine.simulation = SimulationSettings(1.0, {f"c{n}": {"angle": 0.5} for n in range(3)})
    assert branching(*instant(machine)) == ()
    still = Mechanism("no load", ground=machine.ground.points)
    still.add(*machine.bodies, *machine.joints)
    still.simulation = SimulationSettings(1.0, {f"c{n}": {"angle": 0.0} for n in range(3)})
    assert branching(*instant(still)) == ()


def test_a_mechanism_without_mass_is_told():
    """By kinetostatics it goes; loads cannot move it, however its drivers hold it."""
    light = gallery.load("peaucellier")
    assert "no body of 'Peaucellier" in str(weightless(assemble(light)))
    with pytest.raises(mbody.SolveError, match="give masses, or follow its drivers"):
        mbody.simulate(light, 0.1)
    assert weightless(assemble(gallery.load("slider_crank"))) is None  # one mass is enough


def test_rates_that_are_rounding_are_not_told():
    """A vehicle at rest, released: its wheels turn by 1e-88 rad/s, then by less."""
    run = mbody.simulate(gallery.load("vehicle"), 0.5, release={"motion": 0.1})
    assert run.notes == ()
    system, _, q, v = instant(makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)))
    before, after = np.concatenate([q, 0.0 * v + 1e-14]), np.concatenate([q, 0.0 * v])
    assert adjusted(system, before, after, 1.0) == ()
    (note,) = adjusted(system, before, after, 1e4)  # long enough for it to be more than rounding
    assert note.endswith("not 1e-14")


def test_a_start_that_is_changed_is_told():
    """Of a four-bar with a shorter crank: how far, and which rate."""
    short, longer = (
        makers.four_bar(crank, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)) for crank in (1.0, 1.1)
    )
    given = kinematics(short, drive={"motor": (1.0, 2.0, 0.0)})
    system, _, *before = instant(short, given)
    before = np.concatenate(before)
    assert adjusted(system, before, before * (1.0 + 1e-9)) == ()
    turned = float(given["crank"].angle[-1]) + 0.05
    other = kinematics(longer, drive={"motor": (turned, 1.5, 0.0)})
    after = np.concatenate(instant(longer, other)[2:])
    (note,) = adjusted(system, before, after)
    assert "'crank' was turned by 2.86 deg" in note  # 0.05 rad
    assert "omega of 'crank' is 1.5 rad/s, not 2" in note and "was moved by " in note
