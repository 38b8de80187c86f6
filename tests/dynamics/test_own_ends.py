"""The end of a motion begins another one: as it is, as text of all digits, as text of few."""

import math
from dataclasses import replace

import pytest

import mbody
from mbody import (
    Body,
    Contact,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    Rope,
    SimulationSettings,
    Spring,
    Torque,
    simulate,
)
from mbody.analysis.initial.close_loops import close_loops

EARTH = Gravity("g", y=-9.81)
RTOL = 1e-8


def on_floor(name, slope=0.0):
    floor = {"floor": {"line": {"point": "O", "angle": -slope}}}
    return Mechanism(name, ground={"O": (0, 0), "F": (-1, 0)}, ground_shapes=floor)


def sliding_block():
    a, machine = math.radians(20.0), on_floor("block", math.radians(20.0))
    feet = {"A": (-0.2, -0.1), "B": (0.2, -0.1)}
    machine.add(Body("b", mass=1, inertia=0.02, points=feet), EARTH)
    machine.add(Contact("a", "ground.floor", "b.A", friction=0.5))
    machine.add(Contact("c", "ground.floor", "b.B", friction=0.5))
    place = {"x": 0.1 * math.sin(a), "y": 0.1 * math.cos(a), "angle": -a, "omega": 0}
    return machine, {"b": {**place, "vx": 1.5 * math.cos(a), "vy": -1.5 * math.sin(a)}}


def rolling_wheel():
    machine = on_floor("wheel")
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    machine.add(
        Body("w", mass=1, inertia=0.05, points={"C": (0, 0)}, shapes=rim),
        Body("rod", mass=0.5, inertia=0.02, cg=(0.3, 0), points={"C": (0, 0)}),
        Revolute("A", "w.C", "rod.C"),
        EARTH,
        Contact("c", "ground.floor", "w.rim", friction=0.4),
        Torque("T", body="w", value=-0.3),
    )
    return machine, {"w": {"x": 0, "y": 0.2, "angle": 0}, "rod": {"angle": -0.2}}


def rough_pendulum():
    machine = on_floor("rough pendulum")
    machine.add(
        Body("bob", mass=2, inertia=0.2, cg=(0, -0.4), points={"O": (0, 0)}),
        Revolute("O", "ground.O", "bob.O", friction=0.75, pin_radius=0.05),
        EARTH,
    )
    return machine, {"bob": {"angle": 0.3}}


def roped():
    machine = on_floor("roped")
    machine.add(
        Body("b", mass=1, inertia=0.01, points={"P": (0, 0)}), Rope("r", "ground.O", "b.P", 1.0)
    )
    machine.add(EARTH)
    return machine, {"b": {"x": 0.5, "y": 0.2, "angle": 0, "vx": 1.0}}


def at_its_stop():
    machine = on_floor("at its stop")
    machine.add(
        Body("s", mass=1, inertia=0.01, points={"P": (0, 0)}),
        Prismatic("g", "ground.O", "s.P", limits=(-0.3, 0.3)),
        Spring("k", "ground.F", "s.P", 40.0, 0.2),
        Force("F", "s", -2.0, angle=0.0),
    )
    return machine, {"s": {"x": 0.25, "vx": -1.0}}


SCENES = (sliding_block, rolling_wheel, rough_pendulum, roped, at_its_stop)


def written(run, form):
    found = {}
    for body in run.mechanism.bodies:
        axes, own = run.point(body.name), run[body.name]
        values = {"x": axes.x, "y": axes.y, "angle": own.angle}
        values |= {"vx": axes.vx, "vy": axes.vy, "omega": own.omega}
        found[body.name] = {key: float(form(float(row[-1]))) for key, row in values.items()}
    return found


@pytest.mark.parametrize("scene", SCENES)
def test_an_end_is_a_start(scene):
    machine, start = scene()
    machine.simulation = SimulationSettings(until=1.2, rtol=RTOL, start=start)
    for middle in (0.31, 0.77):
        whole = simulate(machine, times=[middle, 1.2])
        half = simulate(machine, middle, instants=2)
        assert whole.status == "completed"
        ends = {"run": simulate(machine, start=half, instants=2)}
        ends["bare"] = simulate(machine, start=replace(half, restart=None), instants=2)
        for digits in (17, 9, 6):
            other = machine.copied()
            own = written(half, lambda x, n=digits: f"{x:.{n}g}")
            other.simulation = replace(machine.simulation, start=own, until=1.2 - middle)
            ends[digits] = simulate(other, instants=2)
        for how, run in ends.items():
            near = max(10.0 * RTOL, 300.0 * 10.0**-how if isinstance(how, int) else 0.0)
            assert run.status == "completed", how
            for body in machine.bodies:
                for key in ("x", "y", "angle", "vx", "vy", "omega"):
                    now, then = (getattr(one[body.name], key)[-1] for one in (run, whole))
                    assert now == pytest.approx(then, abs=near * 10.0), (how, body.name, key)


def test_shapes_that_overlap_by_rounding_are_fitted_and_a_note_says_so():
    machine, start = sliding_block()
    start["b"]["y"] -= 3e-5
    machine.simulation = SimulationSettings(until=0.2, start=start)
    run = simulate(machine, instants=3)
    assert run.mode("a") == ["slip+"] * 3 and run.mode("c") == ["slip+"] * 3
    assert any("fitted to contacts: 'c', where 2.8e-05 m overlapped" in n for n in run.notes)
    start["b"]["y"] -= 1e-2
    machine.simulation = SimulationSettings(until=0.2, start=start)
    with pytest.raises(mbody.ModelError, match="overlap by"):
        simulate(machine)


def test_an_end_is_a_start_without_a_joint_and_a_note_says_so():
    def hung(mass, *joints):
        machine = on_floor("hung")
        machine.add(
            Body("bob", mass=mass, inertia=0.02, cg=(1, 0), points={"O": (0, 0)}), *joints, EARTH
        )
        return machine

    pinned = hung(1.0, Revolute("O", "ground.O", "bob.O"))
    pinned.simulation = SimulationSettings(until=0.5, start={"bob": {"angle": -0.3}})
    half = simulate(pinned)
    run, bob = simulate(hung(50.0), 1.0, start=half), half["bob"]
    falls = bob.y[-1] + bob.vy[-1] * 0.5 - 0.5 * 9.81 * 0.25
    assert run["bob"].y[-1] == pytest.approx(falls, rel=1e-9)
    assert run["bob"].omega[-1] == pytest.approx(bob.omega[-1], rel=1e-12)
    assert run.notes == (
        "the motion goes on from one of another model: without 'O', bob.mass = 50 in place of 1",
    )
    assert simulate(pinned, 0.6, start=half).notes == ()


def test_an_end_is_a_start_without_a_contact():
    machine = mbody.gallery.load("sliding_ladder")
    half = simulate(machine, 0.5, instants=2)
    fewer = machine.copied()
    del fewer._elements["top"]
    run = simulate(fewer, 0.6, start=half, instants=3)
    assert run.status == "completed" and "without 'top'" in run.notes[-1]
    assert run["ladder"].angle[0] == half["ladder"].angle[-1]


def test_rates_of_a_motion_at_rest_fit_whatever_rounding_left():
    """A four-bar that creeps by 1e-60: nothing is fast that rates could be compared with."""
    made = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 2.0, 1.0))
    machine = Mechanism("free", ground=made.ground.points)
    machine.add(*made.bodies, *made.joints)
    first = close_loops(machine, guess={"crank": 1.0})
    start = {
        body.name: {"angle": float(first[body.name].angle[0]), "omega": 1e-60 * k}
        for k, body in enumerate(machine.bodies, 1)
    }
    machine.simulation = SimulationSettings(until=1.0, start=start)
    assert simulate(machine, instants=2).status == "completed"
