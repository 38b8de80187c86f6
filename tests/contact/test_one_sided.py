"""Contacts that would have to pull, ropes that would have to push, racks that do not fit."""

import math
import re

import numpy as np
import pytest

import mbody
from mbody.analysis.driven.driven import analyse_at
from mbody.laws import ConstantSpeed
from mbody.model.simulation import Instants
from tests.support.cases import first_fast

G, UP = 9.81, 0.5 * math.pi


def told(notes):
    """The greatest force of the wrong direction, its time, and the first time of a note."""
    (note,) = notes
    size, most, first = re.search(
        r"with (\S+) \S+ .*?at t = (\S+) \S+?(?:, first at t = (\S+) \S+)?:", note
    ).groups()
    return float(size), float(most), float(first or most)


def looping(speed):
    """A disc of 1 kg without inertia that rolls inside a ring: its centre on a circle of 0.9 m."""
    machine = mbody.Mechanism("loop")
    machine.add(
        mbody.Body("ball", mass=1.0, guess=(0.0, -0.9, 0.0)),
        mbody.Rolling(
            "track", "ground", "ball", radius=0.1, on_radius=1.0, internal=True, phase=-UP
        ),
        mbody.Gravity("gravity", y=-G),
    )
    machine.simulation = mbody.SimulationSettings(1.5, {"ball": {"vx": speed}})
    return machine


@pytest.mark.parametrize("instants", [2, 3, 50])
@first_fast("speed", [6.5, 6.0, 5.5, 6.6], 2)
def test_a_loop_is_watched_between_the_instants_that_are_kept(instants, speed):
    """N = m v²/ρ + m g cos φ: least at the top, m v₀²/ρ − 5 m g, or where it turns back, m g cos φ
    with v₀² = 2 g ρ (1 − cos φ).
    """
    run = mbody.simulate(looping(speed), instants=instants)
    least = G * (1.0 - speed**2 / (2.0 * G * 0.9))
    if speed**2 > 4.0 * G * 0.9:
        least = speed**2 / 0.9 - 5.0 * G
    if least > 0.0:
        assert run.notes == ()
        return
    size, most, first = told(run.notes)
    # between four samples a step the lowest is met to a part in a thousand
    assert size == pytest.approx(-least, rel=2e-3)
    dense = mbody.simulate(looping(speed), instants=30001)
    pulls = dense.contact("track") < 0.0
    assert most == pytest.approx(dense.t[dense.contact("track").argmin()], abs=0.05)
    assert dense.t[pulls][0] <= first <= dense.t[pulls][0] + 0.05
    assert run.status == "completed" and run.doubts == ()


CAM = """
name = "Eccentric circle with a flat follower"
units = "mm-N-s"
[ground]
points = { O = [0, 0], T = [0, 200] }
[bodies]
cam = { }
follower = { mass = "0.8 kg", guess = [0, 35, 0] }
[joints]
O = { revolute = ["ground.O", "cam"] }
guide = { prismatic = [{ body = "ground", angle = 90 }, { body = "follower", angle = 90 }] }
[joints.contact]
cam_follower = [{ body = "cam", angle = 90 }, "follower"]
base_radius = "30 mm"
flat = true
profile = "12 mm*sin(x)"
[drivers.motor]
angle = "cam"
law = { constant_speed = { value = 0, speed = "40 rad/s" } }
[loads]
spring = { spring = ["ground.T", "follower"], stiffness = "8 N/mm", \
free_length = "170 mm", preload = "20 N" }
"""


def pressing(t, speed=40.0, preload=20.0):
    """m ÿ + k y − preload, y = e sin ωt: the spring pulls up by its preload, pushes by its rate."""
    lift = 12.0 * np.sin(speed * t)
    return -0.8e-3 * speed**2 * lift + 8.0 * lift - preload


def test_a_cam_is_watched_at_and_between_the_instants_asked_for():
    machine = mbody.from_toml(CAM)
    one = analyse_at(machine, "kinetostatics", Instants(at={"t": [0.03]}))
    assert one.contact("contact") == pytest.approx(pressing(0.03), rel=1e-9)
    assert one.notes == ()  # at t = 0, from where it is followed, it pulls
    both = analyse_at(machine, "kinetostatics", Instants(at={"t": [0.03, 0.1]}))
    assert both.notes[0].startswith("contact 'contact' would have to pull 'follower' with ")
    assert "at 1 of 2 instants" in both.notes[0]
    assert told(both.notes)[0] == pytest.approx(-pressing(0.1), rel=1e-6)
    # two instants at which it presses, a dip between them: a turn later
    ends = [0.03, 0.03 + 2.0 * math.pi / 40.0]
    run = mbody.kinetostatics(machine, t=ends)
    assert (run.contact("contact") > 0.0).all()
    assert "between the instants" in run.notes[0]
    t = np.linspace(*ends, 200001)
    size, most, first = told(run.notes)
    assert size == pytest.approx(-pressing(t).min(), rel=1e-6)
    assert most == pytest.approx(t[pressing(t).argmin()], abs=1e-3)
    wrong = t[pressing(t) < 0.0]
    assert wrong[0] <= first <= wrong[0] + 1e-3
    # five turns between two instants
    far = mbody.kinetostatics(machine, t=[0.03, 0.03 + 10.0 * math.pi / 40.0])
    assert told(far.notes)[0] == pytest.approx(size, rel=1e-3)
    assert mbody.kinematics(machine, t=ends).notes == ()


def lowered(amplitude, factor=1.0):
    """A block of 2 kg on a rope over a pulley to a hand that goes up and down as a sin 10 t."""
    machine = mbody.Mechanism("hoist", ground={"top": (0.0, 5.0), "pulley": (2.0, 5.0)})
    up = mbody.Marker("ground", (0.0, 0.0), UP), mbody.Marker("block", (0.0, 0.0), UP)
    hand = mbody.Marker("ground", (2.0, 0.0), UP), mbody.Marker("hand", (0.0, 0.0), UP)
    terms = [
        mbody.CouplingTerm(factor, distance=("ground.top", "block")),
        mbody.CouplingTerm(factor, distance=("ground.pulley", "hand")),
    ]
    machine.add(
        mbody.Body("block", mass=2.0, guess=(0.0, 2.0, 0.0)),
        mbody.Body("hand", mass=1.0, guess=(2.0, 3.0, 0.0)),
        mbody.Prismatic("left", *up),
        mbody.Prismatic("right", *hand),
        mbody.LengthCoupling("rope", terms, 5.0 * factor),
        mbody.CoordinateDriver("pull", hand[0], hand[1], mbody.laws.Harmonic(3.0, amplitude, 10.0)),
        mbody.Gravity("gravity", y=-G),
    )
    return machine


@pytest.mark.parametrize("factor", [1.0, -2.0])
def test_a_rope_that_would_have_to_push_is_told(factor):
    """The block goes by 3 − a sin 10 t: the tension is m (g + 100 a sin 10 t)."""
    still = mbody.kinetostatics(lowered(0.05, factor), t=np.linspace(0.0, 1.0, 5))
    assert still.notes == ()
    a = 0.15
    run = mbody.kinetostatics(lowered(a, factor), t=[0.0, 0.2, 1.0])
    size, most, first = told(run.notes)
    assert run.notes[0].startswith("rope 'rope' would have to push with ")
    assert size == pytest.approx(2.0 * (100.0 * a - G), rel=1e-5)
    begin = (math.pi + math.asin(G / (100.0 * a))) / 10.0
    assert begin <= first <= begin + 0.01 and math.sin(10.0 * most) == pytest.approx(-1.0, abs=1e-3)
    assert run.status == "completed"
    free = mbody.simulate(lowered(a, factor), 1.0, instants=2)
    assert told(free.notes)[0] == pytest.approx(size, rel=2e-3)


def test_a_belt_is_no_rope():
    machine = mbody.Mechanism("belt", ground={"A": (0.0, 0.0), "B": (2.0, 0.0)})
    machine.add(
        mbody.Body("a", mass=1.0, inertia=0.2),
        mbody.Body("b", mass=1.0, inertia=0.3),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        mbody.LengthCoupling(
            "belt", [mbody.CouplingTerm(0.2, angle="a"), mbody.CouplingTerm(-0.1, angle="b")]
        ),
        mbody.AngleDriver("motor", "a", mbody.laws.Harmonic(0.0, 1.0, 3.0)),
    )
    run = mbody.kinetostatics(machine, t=np.linspace(0.0, 2.0, 40))
    assert run.effort("belt").min() < 0.0 < run.effort("belt").max() and run.notes == ()


# -- racks ------------------------------------------------------------------------------------


def rack(height=0.5, direction=0.0, tilt=0.0, radius=0.5):
    """A pinion whose centre is that high above a rack of that direction."""
    machine = mbody.Mechanism(
        "rack", ground={"O": (-height * math.sin(tilt), height * math.cos(tilt))}
    )
    line = mbody.Marker("ground", (0.0, 0.0), tilt), mbody.Marker("rack", (0.0, 0.0))
    machine.add(
        mbody.Body("rack", mass=4.0, guess=(0.0, 0.0, tilt)),
        mbody.Body("pinion", mass=1.0, inertia=0.3),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Prismatic("guide", *line),
        mbody.RackPinion(
            "mesh", mbody.Marker("rack", (0.0, 0.0), direction), "pinion", radius=radius
        ),
        mbody.AngleDriver("motor", "pinion", ConstantSpeed(0.0, 1.0)),
    )
    return machine


def test_a_rack_that_is_not_touched_is_refused():
    with pytest.raises(
        mbody.SolveError, match=r"it is 0\.6 m to the left: move it, or change the radius"
    ):
        mbody.kinematics(rack(0.6))
    system = mbody.assemble(rack()).with_values({"mesh.radius": [0.5, 0.55]})
    batch = mbody.kinematics(system, t=[0.0, 0.1])
    with pytest.raises(mbody.SolveError, match=r"be 0\.55 m to the left .* it is 0\.5 m"):
        batch.design(1)
    found = mbody.sweep(rack(), {"mesh.radius": [0.5, 0.55]}, "kinematics", "last(rack.x)")
    assert list(found.failures) == [1] and "'mesh' does not fit" in found.failures[1]


def test_a_rack_that_is_led_away_is_refused():
    """The rack is lowered under the pinion: it fits at first only."""
    machine = mbody.Mechanism("leaving", ground={"O": (0.0, 0.5)})
    down = mbody.Marker("ground", (0.0, 0.0), UP)
    machine.add(
        mbody.Body("rack", mass=1.0),
        mbody.Body("pinion", mass=1.0, inertia=0.3),
        mbody.Revolute("O", "ground.O", "pinion"),
        mbody.Prismatic("guide", down, mbody.Marker("rack", (0.0, 0.0), UP)),
        mbody.RackPinion("mesh", "rack", "pinion", radius=0.5),
        mbody.CoordinateDriver("lower", down, "rack", ConstantSpeed(0.0, -0.1)),
        mbody.Spring("spring", "ground", mbody.Marker("rack", (1.0, 0.0)), stiffness=1.0),
    )
    assert mbody.kinematics(machine, t=0.0).status == "completed"
    with pytest.raises(mbody.SolveError, match=r"it is 0\.6 m to the left at t = 1 s"):
        mbody.kinematics(machine, t=[0.0, 1.0])
