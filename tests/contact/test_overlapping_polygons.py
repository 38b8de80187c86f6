"""What overlaps at the beginning: polygons, convex or not, against crossings of a ray."""

import math

import numpy as np
import pytest

import mbody
from mbody import Body, Contact, Mechanism, SimulationSettings
from mbody.cli import main
from mbody.errors import ModelError
from tests.support.cases import first_fast

#: An L, a star of three points with notches, and a thin wedge.
SHAPES = {
    "L": [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)],
    "star": [
        (r * math.cos(a), r * math.sin(a))
        for r, a in zip([2.0, 0.5] * 3, np.arange(6) * math.pi / 3.0, strict=True)
    ],
    "wedge": [(0.0, 0.0), (4.0, -0.4), (4.0, 0.4)],
}


def to_shape(corners, place):
    """The distance of a place from a polygon, negative within: rays that cross, and segments."""
    x, y = place
    inside, least = False, math.inf
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
        dx, dy = bx - ax, by - ay
        part = min(max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        least = min(least, math.hypot(x - ax - part * dx, y - ay - part * dy))
    return -least if inside else least


@pytest.mark.parametrize("radius", [0.0, 0.3])
@first_fast("name", SHAPES, 2)
def test_what_overlaps_is_refused_and_nothing_else(name, radius):
    corners = SHAPES[name]
    points = {f"P{n}": place for n, place in enumerate(corners)}
    machine = Mechanism(name, ground=points, ground_shapes={"block": {"polygon": tuple(points)}})
    shapes = {"rim": {"disc": "C", "radius": radius}} if radius else {}
    machine.add(
        Body("bead", mass=1.0, inertia=1.0, points={"C": (0.0, 0.0)}, shapes=shapes),
        Contact("touch", "ground.block", "bead.rim" if radius else "bead.C"),
    )
    seen = set()
    random = np.random.default_rng(3)
    low, high = np.min(corners, axis=0) - 0.6, np.max(corners, axis=0) + 0.6
    for place in random.uniform(low, high, (14, 2)):
        apart = to_shape(corners, place) - radius
        start = {"bead": {"x": place[0], "y": place[1], "angle": 0.0}}
        try:
            machine.simulation = SimulationSettings(until=1e-3, start=start, instants=2)
            mbody.simulate(machine)
            seen.add("apart")
            assert apart > -1e-9, place
        except ModelError as error:
            seen.add("overlaps")
            assert apart < 0.0, place
            assert f"overlap by {-apart:.6g} " in str(error)
    assert seen == {"apart", "overlaps"}


@pytest.mark.parametrize("beside", [1e-2, 3.4e-3, 1e-6])
@pytest.mark.parametrize("rounding", [0.0, 7e-15, -7e-15])
def test_what_lies_beside_a_corner_overlaps_nothing(beside, rounding):
    """A line of an edge and its end are as far as the other edge there, but for rounding."""
    corners = {"A": (-21.5, 55.9), "B": (29.5, 55.9), "C": (29.5, 84.7), "D": (-21.5, 84.7)}
    machine = Mechanism(
        "corner", ground=corners, ground_shapes={"block": {"polygon": tuple(corners)}}
    )
    machine.add(
        Body("bead", mass=1.0, inertia=1.0, points={"C": (0.0, 0.0)}),
        Contact("touch", "ground.block", "bead.C"),
    )
    own = {"x": -21.5 - beside, "y": 55.9 + rounding, "angle": 0.0}
    machine.simulation = SimulationSettings(until=1e-3, start={"bead": own}, instants=2)
    assert mbody.simulate(machine).status == "completed"


def test_a_disc_in_an_inner_corner_overlaps_nothing():
    """It touches both edges there."""
    corners = SHAPES["L"]
    points = {f"P{n}": place for n, place in enumerate(corners)}
    machine = Mechanism("L", ground=points, ground_shapes={"block": {"polygon": tuple(points)}})
    rim = {"rim": {"disc": "C", "radius": 0.25}}
    machine.add(
        Body("bead", mass=1.0, inertia=1.0, points={"C": (0.0, 0.0)}, shapes=rim),
        Contact("touch", "ground.block", "bead.rim"),
    )
    own = {"x": 1.25, "y": 1.25, "angle": 0.0}
    machine.simulation = SimulationSettings(until=1e-3, start={"bead": own}, instants=2)
    assert mbody.simulate(machine).status == "completed"


OVERLAP = """
[ground]
points = { O = [0, 0] }
shapes = { floor = { line = { point = "O" } } }
[bodies.wheel]
mass    = "1 kg"
inertia = "0.1 kg*m^2"
points  = { C = [0, 0] }
shapes  = { rim = { disc = "C", radius = "0.5 m" } }
[contacts]
foot = { contact = ["ground.floor", "wheel.rim"] }
[simulate]
until = 0.1
start = { wheel = { y = "0.4 m" } }
"""


@pytest.mark.parametrize("method", [["dop853"], ["moreau", "--step", "1 ms"]])
def test_overlap_is_bad_input_of_the_command(method, tmp_path, capsys):
    model = tmp_path / "overlap.toml"
    model.write_text(OVERLAP)
    assert main(["simulate", str(model), "--method", *method]) == 2
    assert "by 0.1 m" in " ".join(capsys.readouterr().err.split())
