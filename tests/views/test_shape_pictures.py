"""Pictures of the shapes that contacts are between."""

import numpy as np
import pytest

from mbody import Body, Gravity, Mechanism, simulate
from mbody.views.body_shapes import bounds
from mbody.views.scene import scene
from mbody.views.shapes import Pose


def machine():
    found = Mechanism(
        "shapes",
        ground={"O": (0, 0), "S": (1.6, 0.9), "T": (2.4, 0.5), "R": (-1.3, 1.2), "D": (0.5, 1.6)}
        | {"P": (0.9, 0), "Q": (1.3, 0), "V": (1.3, 0.3)},
        ground_shapes={
            "floor": {"line": {"point": "O", "angle": 0.0}},
            "bowl": {"ring": "R", "radius": 0.6},
            "chute": {"segment": ["S", "T"]},
            "wedge": {"polygon": ["P", "Q", "V"]},
            "peg": {"disc": "D", "radius": 0.12},
        },
    )
    rim = {"rim": {"disc": "O", "radius": 0.3}}
    found.add(
        Body(
            "wheel",
            mass=1.0,
            inertia=0.02,
            points={"O": (0, 0)},
            shapes=rim,
            guess=(-0.4, 3.3, 0.4),
        ),
        Body(
            "stone",
            mass=1.0,
            inertia=0.02,
            points={"A": (-0.2, -0.1), "B": (0.2, -0.1), "C": (0.1, 0.15)},
            shapes={"edge": {"polygon": ["A", "B", "C"]}},
            guess=(0.4, 3.1, 0.0),
        ),
        Body(
            "ladder",
            mass=1.0,
            inertia=0.1,
            points={"A": (-0.5, 0), "B": (0.5, 0)},
            shapes={"side": {"segment": ["A", "B"]}},
            guess=(1.9, 3.3, 1.2),
        ),
        Gravity("weight", y=-9.81),
    )
    return found


@pytest.fixture(scope="module")
def run():
    return simulate(machine(), 0.3, instants=7)


def test_every_shape_is_drawn_and_carried_by_its_body(run):
    shapes = {one.look.name: one for one in scene(run).shapes if one.look.name}
    for name in ("wheel.rim", "stone.edge", "ladder.side"):
        assert shapes[f"shape:{name}"].carrier.start[0] == name.partition(".")[0]
    for name in ("floor", "bowl", "chute", "wedge", "peg"):
        assert f"shape:ground.{name}" in shapes
    # a disc or a polygon is the picture of its body, a line is not
    assert "link:ladder" in shapes
    assert not {"link:wheel", "link:stone"} & set(shapes)


def test_an_endless_line_reaches_under_the_whole_motion(run):
    (floor,) = [one for one in scene(run).shapes if one.look.name == "shape:ground.floor"]
    xs = np.array(floor.points)[:, 0]
    assert xs.min() < -1.9 and xs.max() > 2.4  # the bowl is the widest on one side, the chute
    np.testing.assert_allclose(np.array(floor.points)[:, 1], 0.0, atol=1e-12)


def test_shapes_count_for_the_space_of_a_picture(run):
    low, high = bounds(Pose(run, 0))
    assert low[0] == pytest.approx(-1.9) and low[1] == pytest.approx(0.0)
    assert high[1] == pytest.approx(3.6 + 0.166, abs=0.2)


def test_the_ground_is_hatched_on_its_solid_side(run):
    """Edges of a polygon of the ground have their right, the hatched side, towards its middle."""
    edges = [one for one in scene(run).shapes if one.look.name == "shape:ground.wedge"]
    middle = np.array([3.5, 0.3]) / 3.0
    assert len(edges) == 3
    for one in edges:
        (ax, ay), (bx, by) = np.array(one.points)
        assert (bx - ax) * (middle[1] - ay) - (by - ay) * (middle[0] - ax) < 0.0
