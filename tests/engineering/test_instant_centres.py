"""Instant centres, centrodes, inflection circles and polygons, against closed forms."""

import itertools
import math

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Marker, Mechanism, PinSlot, Prismatic, Revolute
from mbody.engineering import (
    acceleration_polygon,
    centrodes,
    inflection_circle,
    instant_centres,
    path_curvature,
    velocity_polygon,
)
from mbody.laws import ConstantSpeed


def crossing(a, b, c, d):
    """Where the line a b meets the line c d."""
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = a, b, c, d
    u = np.array([[bx - ax, cx - dx], [by - ay, cy - dy]])
    s = np.linalg.solve(u, [cx - ax, cy - ay])[0]
    return np.array([ax + s * (bx - ax), ay + s * (by - ay)])


def trammel() -> Mechanism:
    """A bar of length 2 with its ends on the x and y axes, which turns at a constant speed."""
    made = Mechanism("trammel", ground={"O": (0.0, 0.0)})
    bar = Body("bar", points={"A": (-1.0, 0.0), "B": (1.0, 0.0)}, guess="150 deg")
    made.add(bar)
    made.add(
        PinSlot("x", "ground.O", "bar.A"),
        PinSlot("y", Marker("ground", "O", angle=0.5 * math.pi), "bar.B"),
        AngleDriver("turn", "bar", ConstantSpeed("150 deg", -0.7)),
    )
    return made


def slider_crank() -> Mechanism:
    made = Mechanism("slider-crank", ground={"O": (0.0, 0.0)})
    made.add(
        Body("crank", points={"O": (0.0, 0.0), "A": (1.0, 0.0)}),
        Body("rod", points={"A": (0.0, 0.0), "B": (3.0, 0.0)}, guess="-15 deg"),
        Body("slider", points={"B": (0.0, 0.0)}),
        Revolute("O", "ground.O", "crank.O"),
        Revolute("A", "crank.A", "rod.A"),
        Revolute("B", "rod.B", "slider.B"),
        Prismatic("guide", "ground.O", "slider.B"),
        AngleDriver("motor", "crank", ConstantSpeed("50 deg", 2.0)),
    )
    return made


def test_the_textbook_four_bar():
    """I13 and I24 are where the lines of links meet (Aronhold, Kennedy)."""
    run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    found = instant_centres(run)
    a, b = ((float(p.x[0]), float(p.y[0])) for p in map(run.point, ("crank.A", "coupler.B")))
    o2, o4 = ((float(p.x[0]), float(p.y[0])) for p in map(run.point, ("ground.O2", "ground.O4")))
    for pair, lines in (
        (("coupler", "ground"), (o2, a, o4, b)),
        (("crank", "rocker"), (o2, o4, a, b)),
    ):
        one = found[pair]
        # rates carry the rounding of a solved position over a distance of 26 in
        assert np.abs([one.x[0], one.y[0]] - crossing(*lines)).max() < 1e-12 * 26.0
        assert one.permanence == "instantaneous"
    assert found["ground", "coupler"] is found["coupler", "ground"]
    assert found["crank", "ground"].permanence == "fixed"
    assert found["crank", "coupler"].permanence == "permanent"
    # worked beside the definitions, to the digits given there
    assert abs(found["coupler", "ground"].y[0] - 22.7739241063854) < 1e-9
    assert abs(found["crank", "rocker"].x[0] + 8.829260758001514) < 1e-9


def test_a_slide_has_its_centre_at_infinity():
    run = mbody.kinematics(slider_crank(), [0.0])
    found = instant_centres(run)
    slide = found["slider", "ground"]
    assert slide.kind == ("infinite",)
    assert slide.permanence == "fixed"
    assert abs(abs(slide.direction[0]) - 0.5 * math.pi) < 1e-14
    assert np.isnan(slide.x).all()
    rod = found["rod", "ground"]
    theta = math.radians(50.0)
    x = math.cos(theta) + math.sqrt(9.0 - math.sin(theta) ** 2)
    assert abs(rod.x[0] - x) < 1e-12
    assert abs(rod.y[0] - x * math.tan(theta)) < 1e-12
    assert found.collinearity() < 1e-14


@pytest.mark.parametrize(
    "name", ["mud_pump_sixbar", "peaucellier", "stephenson_sixbar", "watt_sixbar"]
)
def test_three_bodies_have_their_centres_on_a_line(name):
    """All triples, over a motion; homogeneous coordinates of unit length, to rounding."""
    run = mbody.kinematics(mbody.gallery.load(name))
    assert instant_centres(run).collinearity() < 1e-11


def test_cardans_circles():
    """The centre of a trammel's bar goes round; fixed centrode r = 2, moving one r = 1, inflection
    circle of diameter 2 through the crossing of the axes."""
    run = mbody.kinematics(trammel(), np.linspace(0.0, 0.8, 9))
    found, circle = centrodes(run, "bar"), inflection_circle(run, "bar")
    assert np.abs(np.hypot(found.fixed_x, found.fixed_y) - 2.0).max() < 1e-12
    assert np.abs(np.hypot(found.moving_x, found.moving_y) - 1.0).max() < 1e-12
    assert np.abs(circle.diameter - 2.0).max() < 1e-11
    assert np.hypot(circle.x, circle.y).max() < 1e-11
    # both ends go straight: their paths have no curvature
    assert np.abs(path_curvature(run, "bar.A").curvature).max() < 1e-11
    middle = path_curvature(run, "bar.cg")
    assert np.abs(middle.radius - 1.0).max() < 1e-11
    assert np.hypot(middle.centre_x, middle.centre_y).max() < 1e-11


def test_euler_savary_at_the_pins_of_a_four_bar():
    """PA² = AC · AJ: from the instant centre P to A, from A to its centre of curvature C and, along
    the same line, to the inflection circle J."""
    run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    circle = inflection_circle(run, "coupler")
    pole = np.array([circle.pole_x[0], circle.pole_y[0]])
    other = np.array([circle.x[0], circle.y[0]])
    for name, centre in (("coupler.A", "ground.O2"), ("coupler.B", "ground.O4")):
        a = np.array([run.point(name).x[0], run.point(name).y[0]])
        c = np.array([run.point(centre).x[0], run.point(centre).y[0]])
        ray = (a - pole) / np.linalg.norm(a - pole)
        # the second point in which the ray meets the circle over the diameter from P
        j = pole + ray * float(ray @ (other - pole))
        assert abs((a - pole) @ (a - pole) - (c - a) @ (j - a)) < 1e-10 * float(
            (a - pole) @ (a - pole)
        )
        found = path_curvature(run, name)
        assert np.hypot(found.centre_x[0] - c[0], found.centre_y[0] - c[1]) < 1e-11


@pytest.mark.parametrize("name", ["norton_fourbar", "mud_pump_sixbar", "stephenson_sixbar"])
def test_images_of_links_are_similar_to_them(name):
    run = mbody.kinematics(mbody.gallery.load(name), [0.0])
    v, a = velocity_polygon(run), acceleration_polygon(run)
    checked = 0
    for body, points in v.links.items():
        w, alpha = float(run[body].omega[0]), float(run[body].alpha[0])
        for one, two in itertools.pairwise(name for name in points if " at " not in name):
            p, q = run.point(one), run.point(two)
            way = complex(q.x[0] - p.x[0], q.y[0] - p.y[0])
            for polygon, factor in ((v, 1j * w), (a, 1j * alpha - w * w)):
                side = complex(*(float(part[0]) for part in polygon.between(one, two)))
                size = max(map(abs, (side, factor * way))) or 1.0
                assert abs(side - factor * way) <= 1e-11 * max(size, abs(polygon.x[two][0]))
                checked += 1
    assert checked >= 6
    # both sides of a pin have one image: the polygon closes
    for joint in run.mechanism.joints:
        if not isinstance(joint, Revolute):
            continue
        i, j = (f"{m.body}.{m.point}" for m in (joint.i, joint.j))
        if j in v.x:
            assert np.hypot(*v.between(i, j)).max() < 1e-10 * np.abs([*v.x.values()]).max()


def test_a_release_from_rest_begins_about_the_centres_of_its_accelerations():
    """The ladder about the corner of the perpendiculars; the four-bar as any motion of it; the
    double pendulum as a moment later, when it has velocities (to t², 1e-8 of a rotation).
    """
    ladder = instant_centres(mbody.simulate(mbody.gallery.load("sliding_ladder"), times=[0.0]))
    assert abs(ladder.pairs[0].x[0] - 2.0 * np.cos(1.0)) < 1e-12
    assert abs(ladder.pairs[0].y[0] - 2.0 * np.sin(1.0)) < 1e-12
    assert any("the motion begins from rest" in note for note in ladder.notes)
    free = mbody.gallery.load("free_fourbar")
    begun = instant_centres(mbody.simulate(free, times=[0.0]))
    free.add(AngleDriver("motor", "crank", ConstantSpeed("60 deg", 1.0)))
    driven = instant_centres(mbody.kinematics(free, [0.0]))
    for one in driven.pairs:
        other = begun[one.bodies]
        assert max(abs(one.x[0] - other.x[0]), abs(one.y[0] - other.y[0])) < 1e-11 * 10.0
    run = mbody.simulate(mbody.gallery.load("double_pendulum"), times=[0.0, 1e-4])
    pole = instant_centres(run)["lower", "ground"]
    assert np.hypot(*(np.diff(v)[0] for v in (pole.x, pole.y))) < 1e-5
    assert pole.kind == ("finite", "finite")


def test_what_does_not_move_has_no_centres():
    """A pendulum that hangs, and a pile whose contacts leave a part of 1e-7 of its weight."""
    hanging = mbody.gallery.load("simple_pendulum")
    still = mbody.simulate(hanging, times=[0.0], guess={"pendulum": -np.pi / 2}, rates={})
    with pytest.raises(mbody.ModelError, match="nothing moves in"):
        instant_centres(still)
    with pytest.raises(mbody.ModelError, match="nothing moves in"):
        instant_centres(mbody.simulate(mbody.gallery.load("pile_of_discs"), times=[0.0]))
    with pytest.raises(mbody.ModelError, match="statics computes no velocities"):
        instant_centres(mbody.statics(mbody.gallery.load("norton_fourbar")))
    run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), [0.0])
    with pytest.raises(mbody.ModelError, match="give two of the bodies"):
        instant_centres(run)["coupler", "nothing"]
    with pytest.raises(mbody.ModelError, match="is not in the polygon"):
        velocity_polygon(run, ["crank.A"]).between("crank.A", "coupler.B")
