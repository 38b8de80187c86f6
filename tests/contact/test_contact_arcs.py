"""Arcs of discs and rings as shapes: where they begin and end, and their ends as corners."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

import mbody
from mbody import Body, Contact, Gravity, Mechanism, SimulationSettings
from mbody.errors import ModelError
from mbody.files.model import from_toml, to_toml
from mbody.solution.contact_points import contact_points_at

G = 9.81


def bead(shape, start, until, disc=None, restitution=0.0, rtol=1e-12):
    """The motion of a point, or disc, beside one shape of the ground about the origin."""
    machine = Mechanism("bead", ground={"O": (0.0, 0.0)}, ground_shapes={"arc": shape})
    shapes = {} if disc is None else {"rim": {"disc": "C", "radius": disc}}
    touching = "bead.C" if disc is None else "bead.rim"
    machine.add(
        Body("bead", mass=2.0, inertia=0.01, points={"C": (0.0, 0.0)}, shapes=shapes),
        Contact("track", "ground.arc", touching, restitution=restitution),
        Gravity("gravity", y=-G),
    )
    machine.simulation = SimulationSettings(until=until, rtol=rtol, start={"bead": start})
    return mbody.simulate(machine)


QUARTER = {"ring": "O", "radius": 1.0, "begin": "180 deg", "end": "270 deg"}


@pytest.mark.parametrize("disc", [None, 0.25, 0.4, 0.5])
def test_a_bead_leaves_a_quarter_of_a_ring_at_its_end(disc):
    """From rest at its beginning to its lowest place, as a pendulum of 180 deg: K(1/√2) √(l/g);
    then it flies on with √(2 g l).
    """
    length = 1.0 - (disc or 0.0)
    run = bead(QUARTER, {"x": -length, "y": 0.0, "angle": 0.0}, 1.0, disc)
    (leaves,) = (e for e in run.events if e.name == "open")
    assert float(leaves.t) == pytest.approx(ellipk(0.5) * math.sqrt(length / G), abs=1e-10)
    body = leaves.state["bead"]
    assert float(body.x[0]) == pytest.approx(0.0, abs=1e-10)
    assert float(body.y[0]) == pytest.approx(-length, abs=1e-10)
    assert float(body.vx[0]) == pytest.approx(math.sqrt(2.0 * G * length), rel=1e-10)
    fallen = 0.5 * G * (run.t[-1] - float(leaves.t)) ** 2
    assert run["bead"].y[-1] == pytest.approx(-length - fallen, abs=1e-9)
    assert run.mode("track")[-1] == "open" and run.energy.error < 1e-10


def test_what_passes_where_the_arc_is_not_meets_nothing():
    """Through the open half of a ring, either way, and at its back."""
    for x, vy in ((0.3, -2.0), (-0.3, 3.0)):
        half = {"ring": "O", "radius": 1.0, "begin": 0.0, "end": "180 deg"}
        run = bead(half, {"x": x, "y": -1.5, "angle": 0.0, "vy": vy}, 0.2)
        assert not run.events
    lower = {"ring": "O", "radius": 1.0, "begin": "180 deg", "end": "360 deg"}
    falls = bead(lower, {"x": 0.3, "y": 1.5, "angle": 0.0}, 0.8)
    (hit,) = (e for e in falls.events if e.name == "impact")
    assert float(hit.t) == pytest.approx(math.sqrt(2.0 * (1.5 + math.sqrt(0.91)) / G), abs=1e-10)


def test_an_arc_is_changed_by_name_and_goes_through_files():
    text = """
name = "arc"
[ground]
points = { O = [0, 0] }
[ground.shapes]
bowl = { ring = "O", radius = 1, begin = "180 deg", end = "wide" }
[parameters]
wide = "270 deg"
[bodies.bead]
mass = 1
inertia = 1
points = { C = [0, 0] }
[contacts]
track = { contact = ["ground.bowl", "bead.C"] }
[gravity]
y = -9.81
[simulate]
until = 0.75
rtol = 1e-11
start = { bead = { x = -1, y = 0, angle = 0 } }
"""
    machine = from_toml(text)
    assert from_toml(to_toml(machine)) == machine
    system = mbody.assemble(machine)
    ends = []
    for end in (math.radians(270.0), math.radians(250.0)):
        run = mbody.simulate(system.with_values({"ground.bowl.end": end}))
        (leaves,) = (e for e in run.events if e.name == "open")
        ends.append(
            math.atan2(*(float(leaves.state["bead"].y[0]), float(leaves.state["bead"].x[0])))
        )
    np.testing.assert_allclose(np.degrees(ends), [-90.0, -110.0], atol=1e-7)
    with pytest.raises(ModelError, match="end must be above begin, by less than a turn"):
        mbody.assemble(from_toml(text, parameters={"wide": "170 deg"}))


def test_places_of_contact_are_on_the_arc():
    """Where the picture marks them: closed on the arc, none where the circle is cut away."""
    run = bead(QUARTER, {"x": -1.0, "y": 0.0, "angle": 0.0}, 1.0)
    for k, mode in enumerate(run.mode("track")):
        (one,) = contact_points_at(run, k, "track")[:1]
        assert bool(one.closed[0]) == (mode != "open")
        if mode != "open":
            angle = math.degrees(math.atan2(one.place[0, 1], one.place[0, 0])) % 360.0
            assert 180.0 - 1e-6 < angle < 270.0 + 1e-6


def test_two_arcs_touch_where_both_are():
    """A rocker, an arc of a disc on a body, rolls on the flat until its arc ends, then tips over
    its end: the mass centre is lifted by the arc's law, then it turns about the corner.
    """
    floor = {"floor": {"line": {"point": "O"}}}
    half = math.radians(20.0)
    machine = Mechanism("rocker", ground={"O": (0.0, 0.0)}, ground_shapes=floor)
    arc = {"disc": "C", "radius": 0.5, "begin": -math.pi / 2 - half, "end": -math.pi / 2 + half}
    machine.add(
        Body("rocker", mass=1.0, inertia=0.05, points={"C": (0.0, 0.3)}, shapes={"sole": arc}),
        Contact("sole", "ground.floor", "rocker.sole", friction=5.0),
        Gravity("gravity", y=-G),
    )
    start = {"rocker": {"x": 0.0, "y": 0.2, "angle": 0.0, "omega": 2.5, "vx": -0.5, "vy": 0.0}}
    machine.simulation = SimulationSettings(until=0.3, rtol=1e-11, start=start)
    run = mbody.simulate(machine)
    assert run.status == "completed" and run.energy.error < 1e-9
    # energy: rolling to the end of the arc loses none, though the corner takes over
    y, v, w = run["rocker"].y, np.hypot(run["rocker"].vx, run["rocker"].vy), run["rocker"].omega
    rolling = np.abs(run["rocker"].angle) < half
    energy = G * y + 0.5 * v**2 + 0.5 * 0.05 * w**2
    assert rolling.any() and not rolling.all()
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
