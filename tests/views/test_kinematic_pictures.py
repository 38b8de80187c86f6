"""Instant centres, polygons and curvature over the gallery: lines of Aronhold and Kennedy, polygons
that close, and the pictures of them.
"""

import functools
import itertools
import json
import math
import re

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.cli import main
from mbody.engineering import acceleration_polygon, instant_centres, velocity_polygon
from mbody.model.joints import Gear, PinSlot, Prismatic, Revolute, Rolling

#: Driven models whose bodies all move, at instants of their own; others are followed in time.
INSTANTS = (0.0, 0.013, 0.11)


#: Models in which nothing turns, and forty of the same.
LEFT_OUT = {"bouncing_ball", "flyball_governor", "porter_governor", "static_fourbar", "vehicle"}
LEFT_OUT |= {"n_windows_40", "pile_of_discs"}
MOVING = [name for name in gallery.names() if name not in LEFT_OUT]


@functools.cache
def moved(name):
    """The run of a model of the gallery."""
    machine = gallery.load(name)
    if machine.drivers and mbody.mobility(machine).driven.freedom == 0:
        return mbody.kinematics(machine, list(INSTANTS))
    return mbody.simulate(machine, 0.05, instants=3)


def homogeneous(one, k):
    if one.kind[k] == "none":
        return None
    if one.kind[k] == "infinite":
        return np.array([math.cos(one.direction[k]), math.sin(one.direction[k]), 0.0])
    return np.array([one.x[k], one.y[k], 1.0])


def test_enough_of_the_gallery_moves():
    assert len(MOVING) >= 28
    for name in MOVING:
        run = moved(name)
        assert any(np.abs(run[body.name].omega).max() > 0.0 for body in run.mechanism.bodies), name


@pytest.mark.parametrize("name", MOVING)
def test_centres_are_on_the_lines_of_aronhold_and_kennedy(name):
    """The distance of every centre from the line through two others of the same three bodies, to
    1e-10 of the size, which is that of the model or of the three places.
    """
    run = moved(name)
    centres = instant_centres(run)
    size, checked = run.system.length, 0
    for three in itertools.combinations(centres.bodies, 3):
        pairs = [centres[pair] for pair in itertools.combinations(three, 2)]
        for k in range(len(run)):
            at = [homogeneous(one, k) for one in pairs]
            if any(one is None for one in at):
                continue
            finite = [one[:2] for one in at if one[2]]
            scale = max([size, *(float(np.hypot(*place)) for place in finite)])
            # what has hardly a rate of its own is not known better than its rate
            rates = [abs(run[a].omega[k] - run[b].omega[k]) for a, b in (p.bodies for p in pairs)]
            swiftest = max(abs(run[body].omega[k]) for body in centres.bodies)
            weak = min((r for r, one in zip(rates, at, strict=True) if one[2]), default=1.0)
            if weak < 1e-4 * swiftest:
                continue
            rows = np.array([[*one[:2] / (scale if one[2] else 1.0), one[2]] for one in at])
            assert abs(np.linalg.det(rows)) < 1e-10, (name, three, k)
            checked += 1
    assert checked or len(centres.bodies) < 3 or name in {"rolling_ball", "stick_slip"}


@pytest.mark.parametrize("name", MOVING)
def test_polygons_close(name):
    """At pins both bodies have one image; slides differ along the guide alone; wheels that roll
    have one velocity at the pitch point; images of links are similar to them.
    """
    run = moved(name)
    v, a = velocity_polygon(run), acceleration_polygon(run)
    greatest = [max(np.hypot(p.x[n], p.y[n]).max() for n in p.x) or 1.0 for p in (v, a)]
    if not np.isfinite(greatest).all():
        pytest.skip("free motion with impacts has no accelerations at them")
    for joint in run.mechanism.joints:
        if joint.name not in v.joints:
            continue
        one, two = v.joints[joint.name]
        dx, dy = v.between(one, two)
        if isinstance(joint, Revolute | Gear | Rolling):
            assert np.hypot(dx, dy).max() < 1e-10 * greatest[0], joint.name
        if isinstance(joint, Revolute):
            assert np.hypot(*a.between(one, two)).max() < 1e-9 * greatest[1], joint.name
        if isinstance(joint, Prismatic | PinSlot):
            line = run[joint.i.body].angle + float(run.system.numbers.angle(joint, "i"))
            across = np.cos(line) * dy - np.sin(line) * dx
            assert np.abs(across).max() < 1e-10 * greatest[0], joint.name
    for body, names in v.links.items():
        if body == "ground":
            assert all(not v.x[n].any() and not v.y[n].any() for n in names)


def names_in(figure):
    found = set()
    for axes in figure.axes:
        found |= {one.get_gid() for one in axes.get_children() if one.get_gid()}
    return found


def test_the_picture_of_a_four_bar():
    run = mbody.kinematics(gallery.load("norton_fourbar"), [0.0])
    figure = mbody.draw(run, poles=True, polygons=True)
    names = names_in(figure)
    assert {f"pole:I{n}" for n in (12, 13, 14, 23, 24, 34)} <= names
    assert {"image:crank.A", "image:coupler.P", "image:pole", "link:coupler"} <= names
    assert sum(name.startswith("kennedy:") for name in names) == 4
    # the mark of I13 is where the centre is
    (mark,) = [p for p in figure.axes[0].patches if p.get_gid() == "pole:I13"]
    assert mark.center == pytest.approx((13.148531213325723, 22.7739241063854), abs=1e-9)
    # the arrow of v_A has the length of the key: 25 rad/s · 5 in, 20 in/s
    polygon = figure.axes[1]
    heads = {
        one.get_gid(): one.get_xy()
        for one in polygon.patches
        if str(one.get_gid()).endswith(".head")
    }
    tip = heads["image:crank.A.head"][0]
    (shaft,) = [line for line in polygon.lines if line.get_gid() == "key"]
    key = heads["key.head"][0][0] - shaft.get_xdata()[0]
    assert np.hypot(*tip) / key * 20.0 == pytest.approx(125.0, rel=1e-9)


def test_coriolis_is_drawn_in_a_slide_on_a_link():
    """A crank's block on a lever: two images at one place, with Coriolis's part between them."""
    run = mbody.kinematics(gallery.load("quick_return"), [0.1])
    figure = mbody.draw(run, poles=True, polygons=True)
    _, velocities, accelerations = (axes for axes in figure.axes if axes.get_label() != "key")
    (sliding,) = [one for one in velocities.lines if one.get_gid() == "sliding:slot"]
    assert len(sliding.get_xdata()) == 2
    (sliding,) = [one for one in accelerations.lines if one.get_gid() == "sliding:slot"]
    corners = np.asarray(sliding.get_xydata())
    assert len(corners) == 3
    # what is left after Coriolis's part is along the lever, of which the joint is the guide
    slot = run.mechanism["slot"]
    angle = float(run[slot.i.body].angle[0] + run.system.numbers.angle(slot, "i"))
    way = corners[2] - corners[1]
    assert abs(way @ [-math.sin(angle), math.cos(angle)]) < 1e-9 * np.hypot(*way)
    assert abs((corners[1] - corners[0]) @ [math.cos(angle), math.sin(angle)]) < 1e-9 * 175.0
    texts = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert "$b_{6}$" in texts or "$b_{6}$" in {t.replace(" ", "") for t in texts}


def test_what_is_at_infinity_is_said():
    run = mbody.kinematics(gallery.load("slider_crank"), [0.1])
    figure = mbody.draw(run, poles=True)
    said = " ".join(text.get_text() for text in figure.texts)
    assert (
        "I14 is at infinity, towards 90°: the motion of slider against ground is parallel to 0°"
        in said
    )
    assert "links: 1 ground, 2 crank, 3 rod, 4 slider" in said


def test_curvature_in_a_picture():
    """The circle of curvature goes through the point and about its centre."""
    run = mbody.kinematics(gallery.load("norton_fourbar"), [0.0])
    figure = mbody.draw(run, inflection=["coupler"], curvature=["coupler.B"], centrodes=["coupler"])
    names = names_in(figure)
    assert {"curvature:coupler.B", "inflection:coupler", "fixed:coupler", "moving:coupler"} <= names
    (line,) = [one for one in figure.axes[0].lines if one.get_gid() == "curvature:coupler.B"]
    # the path of B is a circle of 10 in about O4
    away = np.asarray(line.get_xydata()) - [19.0, 0.0]
    assert np.abs(np.hypot(*away.T) - 10.0).max() < 1e-9
    said = " ".join(text.get_text() for text in figure.texts)
    assert "radius of curvature 10 in" in said and "diameter 131.5 in" in said


def test_a_mechanism_at_rest_moves_at_unit_speed():
    """Centres do not depend on the speed; a note says that there was none."""
    machine = gallery.load("norton_fourbar")
    moving = instant_centres(mbody.kinematics(machine, drive={"motor": (math.radians(60.0), 3.0)}))
    rest = instant_centres(mbody.kinematics(machine, drive={"motor": (math.radians(60.0), 0.0)}))
    for one, two in zip(moving.pairs, rest.pairs, strict=True):
        assert abs(one.x[0] - two.x[0]) < 1e-10 and abs(one.y[0] - two.y[0]) < 1e-10
    assert any("'motor' is at rest" in note for note in rest.notes) and not moving.notes


def test_the_commands(tmp_path, capsys):
    picture = tmp_path / "poles.svg"
    words = [
        "draw",
        "norton_fourbar",
        "--poles",
        "--polygons",
        "--at",
        "crank=60",
        "-o",
        str(picture),
    ]
    assert main(words) == 0
    text = picture.read_text("utf-8")
    assert {'id="pole:I13"', 'id="image:crank.A"'} <= set(re.findall(r'id="[^"]+"', text))
    capsys.readouterr()
    assert main(["poles", "slider_crank", "--at", "crank=60", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [one["quantity"] for one in data["polygons"]] == ["velocity", "acceleration"]
    assert {"symbol", "bodies", "permanence", "kind", "x", "y", "direction"} == set(
        data["centres"][0]
    )
    assert "at infinity" in data["sentences"][0][0]
    assert main(["draw", "norton_fourbar", "--poles", "--strip", "-o", str(picture)]) == 2
    assert "one instant" in capsys.readouterr().err


def test_free_motions_have_their_centres_drawn(tmp_path, capsys):
    """At the release, with centrodes over the motion, and at the end of `--to`; the command of the
    numbers has the same place.
    """
    begun, later = tmp_path / "begun.svg", tmp_path / "later.svg"
    words = ["draw", "free_fourbar", "--poles", "--centrodes", "coupler", "-o", str(begun)]
    assert main(words) == 0
    found = begun.read_text("utf-8")
    assert 'id="pole:I13"' in found and "begins from rest" in found and "fixed centrode" in found
    capsys.readouterr()
    assert main(["draw", "double_pendulum", "--poles", "--to", "0.6", "-o", str(later)]) == 0
    assert 'id="pole:I13"' in later.read_text("utf-8") and "0.6 s" in later.read_text("utf-8")
    capsys.readouterr()
    assert main(["poles", "double_pendulum", "--to", "0.6"]) == 0
    text = capsys.readouterr().out
    assert text.count("CENTRE") == 1 and "t = 0.6 s" in text
