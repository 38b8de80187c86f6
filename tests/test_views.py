"""Pictures: what is drawn is where the solution says, and files are written as asked."""

import math
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import mbody
from mbody import (
    AngleCoupling,
    AngleDriver,
    Body,
    CamFollower,
    CoordinateDriver,
    CouplingTerm,
    Damper,
    Distance,
    Fixed,
    Force,
    Gear,
    Gravity,
    LengthCoupling,
    Marker,
    Mechanism,
    PinSlot,
    Prismatic,
    RackPinion,
    Revolute,
    Rolling,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
    cli,
    gallery,
    kinematics,
    kinetostatics,
)
from mbody.analysis.driven.requests import asked
from mbody.laws import ConstantSpeed, Harmonic
from mbody.makers import makers
from mbody.model.joints import CustomJoint
from mbody.model.loads import CentrifugalField, CustomLoad, PistonPressure, ReciprocatingCylinder
from mbody.model.study import Instants
from mbody.sheets.names import force_names
from mbody.views import draw, plot, save
from mbody.views.backend import ENDINGS
from mbody.views.cycle import SMOOTH, cycle
from mbody.views.labels import Label, Places
from mbody.views.plotting import spread
from mbody.views.shapes import hull, rounded
from mbody.views.sketch import Sketch
from mbody.views.symbols import joint_symbol
from tests import pictures

ROOT = Path(__file__).parents[1]
UP = math.pi / 2.0

# -- the reader of a picture ------------------------------------------------------------------


def artists(figure):
    """All named artists of a drawing, by name."""
    axes = figure.axes[0]
    found = [a for a in (*axes.patches, *axes.lines, *axes.texts) if a.get_gid()]
    return {artist.get_gid(): artist for artist in found}


def arrow(drawn, name):
    """Tail and tip of an arrow."""
    tail = drawn[name].get_xydata()[0]
    return tail, drawn[f"{name}.head"].get_xy()[0]


def inside(figure):
    """Whether everything named, and every text, lies within the figure."""
    canvas = figure.canvas
    canvas.draw()
    whole = figure.bbox
    for artist in (*artists(figure).values(), *figure.axes[0].texts):
        box = artist.get_window_extent(canvas.get_renderer())
        assert box.x0 > whole.x0 and box.x1 < whole.x1, artist
        assert box.y0 > whole.y0 and box.y1 < whole.y1, artist
    return True


@pytest.fixture(scope="module")
def norton():
    return kinetostatics(gallery.load("norton_fourbar"))


@pytest.fixture(scope="module")
def turn():
    return kinetostatics(gallery.load("norton_fourbar"), turn=True)


# -- drawings ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", gallery.names())
def test_every_model_of_the_gallery(name):
    machine = gallery.load(name)
    if machine.ask is None:
        run = mbody.simulate(machine, times=[0.0])
    else:
        run = asked(machine, "kinetostatics")
    figure = draw(run, instant=-1)
    drawn = artists(figure)
    # pins lie where the solution has the place on j; several at one place are drawn once
    centres = [np.array(a.center) for gid, a in drawn.items() if gid.startswith("pin:")]
    for joint in run.mechanism.joints:
        if isinstance(joint, Revolute):
            point = run.point(joint.j)
            place = point.x[-1], point.y[-1]
            assert min(np.hypot(*(centre - place)) for centre in centres) < 1e-9 * run.system.length
    for body in run.mechanism.bodies:
        assert f"link:{body.name}" in drawn or f"link:{body.name}:name" in drawn
    assert inside(figure)
    low, high = figure.axes[0].get_window_extent().size
    width, height = np.ptp(figure.axes[0].get_xlim()), np.ptp(figure.axes[0].get_ylim())
    # one scale in x and y; a pixel is the least that a window can differ by
    assert low / width == pytest.approx(high / height, rel=2.0 / min(low, high))


def test_links_reach_over_their_pins(norton):
    drawn = artists(draw(norton))
    for body, joints in {"crank": "O2 A", "coupler": "A B", "rocker": "B O4"}.items():
        outline = drawn[f"link:{body}"].get_path()
        assert all(outline.contains_point(drawn[f"pin:{j}"].center) for j in joints.split())
        far = drawn["pin:O4" if body == "crank" else "pin:O2"].center
        assert not outline.contains_point(far)


def test_arrows_are_the_forces(norton):
    drawn = artists(draw(norton, forces=True))
    names, scales = force_names(norton.mechanism), {}
    for joint in ("O2", "A", "B", "O4"):
        name, on = names[joint]
        reaction = norton.reaction(joint, on)
        tail, tip = arrow(drawn, f"force:{name}")
        vector, force = tip - tail, np.array([reaction.fx[0], reaction.fy[0]])
        scales[name] = np.hypot(*vector) / np.hypot(*force)
        assert vector / scales[name] == pytest.approx(force, rel=1e-9)
        # it begins or ends at its pin, outside the circle
        pin = drawn[f"pin:{joint}"]
        gap = min(np.hypot(*(end - pin.center)) for end in (tail, tip))
        assert pin.radius < gap < 2.0 * pin.radius
        assert f"{np.hypot(*force):.4g} lbf" in drawn[f"told:{name}"].get_text()
    applied = arrow(drawn, "force:F_P")
    angle = math.degrees(math.atan2(*(applied[1] - applied[0])[::-1])) % 360.0
    assert angle == pytest.approx(330.0)
    tail, tip = arrow(drawn, "key")
    told = [t.get_text() for t in drawn["key"].axes.texts if t.get_text() == "100 lbf"]
    assert told and np.hypot(*(tip - tail)) == pytest.approx(100.0 * scales["F12"])
    # rounding of the solution is the only difference of the scales
    assert max(scales.values()) == pytest.approx(min(scales.values()), rel=1e-9)


def test_a_drawing_without_forces_has_the_applied_ones_only(norton):
    drawn = artists(draw(norton))
    assert sorted(gid for gid in drawn if gid.startswith("force:")) == [
        "force:F_P",
        "force:F_P.head",
    ]


def test_arcs_turn_as_the_motor_and_the_torque(norton):
    def sense(run, name, about):
        drawn = artists(draw(run))
        points = drawn[name].get_xydata() - drawn[f"pin:{about}"].center
        (x, y), (u, v) = points[:-1].T, points[1:].T
        return np.sign((x * v - y * u).sum())

    assert sense(norton, "driver:motor", "O2") == 1.0 == sense(norton, "torque:T_4", "O4")
    back = makers.four_bar(1, 3, 2, 3.5, speed=-3.0)
    back.add(Torque("load", "rocker", value=-2.0))
    run = kinematics(back)
    assert sense(run, "driver:motor", "O2") == -1.0 == sense(run, "torque:load", "O4")


def test_paths_are_those_of_the_points(norton, turn):
    path = artists(draw(norton, paths=["coupler.P"]))["path:coupler.P"].get_xydata()
    point = turn.point("coupler.P")
    # 181 instants of the turn are every other of 361; both follow the branch to rounding
    assert path == pytest.approx(np.column_stack([point.x, point.y])[::2], abs=1e-9)
    own = artists(draw(turn, paths="coupler.P"))["path:coupler.P"].get_xydata()
    assert own[:, 0] == pytest.approx(point.x)


def test_what_is_not_analysed_is_analysed():
    by_hand = artists(draw(kinematics(gallery.load("slider_crank"))))
    by_itself = artists(draw(gallery.load("slider_crank")))
    assert by_itself["pin:B"].center == pytest.approx(by_hand["pin:B"].center)
    system = mbody.assemble(gallery.load("slider_crank")).with_values({"crank.A.x": 0.2})
    assert np.hypot(*artists(draw(system))["pin:A"].center) == pytest.approx(0.2)
    loose = Mechanism("a pendulum")
    loose.add(Body("bob", mass=1.0, points={"A": (1.0, 0.0)}, guess=-1.0))
    loose.add(Revolute("O", "ground", "bob"))
    assert {"pin:O", "support:O", "link:bob"} <= set(artists(draw(loose)))


# -- odd mechanisms ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Held(CustomJoint):
    """Keeps an angle between two bodies."""

    rows = "l"

    def physics(self, i, j, p, t):
        zero = (0.0, 0.0)
        blocks = (0.0, 0.0, -1.0, *[0.0] * 5, 1.0, *[0.0] * 3)
        return (j[2] - i[2] - 0.5, 0.0), blocks, zero, zero


class Wind(CustomLoad):
    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, 1.0, 0.0, 0.0


def planetary():
    machine = Mechanism("planetary gear", units="mm-N-s", ground={"O": (0, 0)})
    machine.add(
        Body("sun", mass=1e-3, inertia=1.0),
        Body("arm", mass=1e-3, points={"C": (30, 0)}),
        Body("planet"),
        Revolute("O", "ground.O", "sun"),
        Revolute("P", "ground.O", "arm"),
        Revolute("C", "arm.C", "planet"),
        Gear("mesh", "sun", "planet", radius_i=20, radius_j=10),
        Gear("ring", "ground.O", "planet", radius_i=40, radius_j=10, internal=True),
        AngleDriver("motor", "sun", ConstantSpeed(0, 10)),
        Torque("load", "arm", value=-500),
    )
    return machine


def rack():
    machine = Mechanism("rack", units="mm-N-s", ground={"O": (0, 20)})
    end = Marker("rack", (40, 0))
    machine.add(
        Body("pinion", mass=1e-3),
        Body("rack", mass=1e-3),
        Revolute("O", "ground.O", "pinion"),
        Prismatic("guide", "ground", "rack"),
        RackPinion("mesh", "rack", "pinion", radius=20),
        AngleDriver("motor", "pinion", ConstantSpeed(0.5, -1)),
        Spring("k", Marker("ground", (-90, 0)), Marker("rack", (-40, 0)), stiffness=1.0),
        Damper("c", Marker("ground", (90, 15)), end, coefficient=1.0),
        Force("F", end, 5, angle=math.pi),
    )
    return machine


def wheel():
    machine = Mechanism("wheel and bob")
    machine.add(
        Body("wheel", mass=2),
        Body("bob", mass=1, cg=(0.5, 0), points={"A": (0, 0)}),
        Rolling("road", "ground", "wheel", radius=0.3),
        Revolute("A", "wheel", "bob.A"),
        Gravity("g", y=-9.81),
        TorsionSpring("kt", "bob", by="wheel", stiffness=2.0),
        TorsionDamper("ct", "bob", coefficient=1.0),
        AngleDriver("m", "wheel", ConstantSpeed(0, -1)),
        AngleDriver("m2", "bob", -1.0),
    )
    return machine


def yoke():
    machine = Mechanism("Scotch yoke", units="mm-N-s")
    machine.add(
        Body("crank", points={"A": (30, 0)}),
        Body("yoke", mass=1e-3),
        Revolute("O", "ground", "crank"),
        PinSlot("A", Marker("yoke", (0, 0), math.pi / 2), "crank.A"),
        Prismatic("g", "ground", Marker("yoke", (60, 0))),
        CoordinateDriver("ram", "ground", "yoke", ConstantSpeed(20, -3)),
    )
    return machine


def rods():
    machine = Mechanism("rod, weld and users' own", ground={"O": (0, 0), "W": (4, 0)})
    machine.add(
        Body("a", mass=1, points={"A": (1, 0)}, guess=1.0),
        Body("b", mass=1, points={"B": (0, 2)}, guess=(4, 0, 0)),
        Body("c", mass=1, points={"C": (-1, 1)}, guess=(4, 2, 0.5)),
        Revolute("O", "ground.O", "a"),
        Fixed("weld", "ground.W", "b"),
        Revolute("C", "b.B", "c.C"),
        Held("held", "b", "c"),
        Distance("rod", "a.A", "b.B", length=3.6),
        Wind("wind", "ground", "a.A"),
    )
    return machine


def one():
    machine = Mechanism("one body")
    machine.add(Body("b", mass=1.0))
    return machine


def chain():
    machine, here = Mechanism("chain"), "ground"
    for n in range(60):
        machine.add(
            makers.bar(f"b{n}", 1.0, guess=-1.2 + n / 25), Revolute(f"j{n}", here, f"b{n}.A")
        )
        here = f"b{n}.B"
    return machine


def tackle():
    machine = Mechanism("tackle", ground={"top": (0, 5), "eye": (2, 5), "axis": (3, 5)})
    block = Marker("ground", (0, 0), UP), Marker("block", (0, 0), UP)
    parts = [
        CouplingTerm(2.0, distance=("ground.top", "block")),
        CouplingTerm(0.5, angle="drum"),
        CouplingTerm(1.0, coordinate=(Marker("ground", (2, 0), UP), "block")),
    ]
    machine.add(
        Body("block", mass=1, guess=(0, 1, 0)),
        Body("drum", mass=1, inertia=1),
        Prismatic("guide", *block),
        Revolute("axis", "ground.axis", "drum"),
        LengthCoupling("rope", parts, value=9.0),
        AngleDriver("winch", "drum", ConstantSpeed(0, 1)),
    )
    return machine


def shafts():
    machine = Mechanism("shafts", ground={"A": (0, 0), "B": (3, 0)})
    machine.add(
        makers.bar("a", 1.0),
        makers.bar("b", 1.0),
        Revolute("pin", "ground.A", "a.A"),
        Revolute("pivot", "ground.B", "b.A"),
        AngleCoupling("chain", [CouplingTerm(2.0, angle="a"), CouplingTerm(-1.0, angle="b")]),
        AngleDriver("motor", "a", ConstantSpeed(0.4, 1)),
    )
    return machine


ODD = {
    planetary: {"wheel:mesh.i", "wheel:mesh.j", "wheel:ring.i", "torque:load", "driver:motor"},
    rack: {"rack:mesh", "wheel:mesh.j", "spring:k", "damper:c", "block:guide", "rail:guide"},
    wheel: {"wheel:road.j", "road:road", "spring:kt", "damper:ct", "gravity:g", "driver:m2"},
    yoke: {"block:g", "pin:A", "driver:ram"},
    rods: {"rod:rod", "wall:weld", "joint:held", "load:wind", "at:wind"},
    one: {"link:b", "cg:b"},
    chain: {"pin:j0", "pin:j59"},
    tackle: {"rope:rope.0", "rope:rope.2", "pulley:rope.1", "coupling:rope"},
    shafts: {"belt:chain", "coupling:chain"},
}


@pytest.mark.parametrize("machine", ODD, ids=lambda machine: machine.__name__)
def test_any_mechanism_draws(machine):
    figure = draw(machine())
    assert ODD[machine] <= set(artists(figure))
    assert inside(figure)


def test_wheels_have_their_radii_and_touch():
    drawn = artists(draw(planetary()))
    sun, planet = drawn["wheel:mesh.i"], drawn["wheel:mesh.j"]
    assert (sun.radius, planet.radius, drawn["wheel:ring.i"].radius) == (20.0, 10.0, 40.0)
    assert np.hypot(*np.subtract(sun.center, planet.center)) == pytest.approx(30.0)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_any_size_gives_the_same_picture(size):
    figure = draw(makers.four_bar(size, 3 * size, 2 * size, 3.5 * size))
    whole = draw(makers.four_bar(1.0, 3.0, 2.0, 3.5))
    assert inside(figure)
    # but for the text of the scale
    assert figure.get_size_inches() == pytest.approx(whole.get_size_inches(), rel=1e-6)


# -- cams, ropes, cylinders, spindles ---------------------------------------------------------


def cam(swings=False, **kind):
    """A cam of an eccentric lift, its follower above it or at the end of an arm."""
    machine = Mechanism("cam", units="mm-N-s", ground={"Q": (80, 30)})
    lift = Harmonic(mean=10.0, amplitude=10.0, frequency=1.0)
    machine.add(
        Body("shaft", mass=1e-3),
        Body("follower", mass=1e-3, points={"Q": (80, 0)}, guess=(0, 50, -0.2 if swings else 0.0)),
        Revolute("O", "ground", "shaft"),
        CamFollower(
            "contact", Marker("shaft", (0, 0), UP), "follower", lift, base_radius=40.0, **kind
        ),
        AngleDriver("motor", "shaft", ConstantSpeed(0.0, 1.0)),
    )
    if swings:
        machine.add(Revolute("Q", "ground.Q", "follower.Q"))
    else:
        machine.add(
            Prismatic("guide", Marker("ground", (0, 0), UP), Marker("follower", (0, 0), UP))
        )
    return machine


def gap(point, outline):
    """How far a point is from a closed outline."""
    a = np.asarray(outline)
    way = np.roll(a, -1, axis=0) - a
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    part = np.clip(((point - a) * way).sum(axis=1) / square, 0.0, 1.0)
    return float(np.hypot(*(a + part[:, None] * way - point).T).min())


#: An outline of chords of 2° about radii of curvature below 150 mm is 150/8 · (2°)² within.
CHORDS = 0.023


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("swings", [False, True])
@pytest.mark.parametrize(
    "kind", [{"roller": 8.0}, {}, {"flat": True}], ids=["roller", "edge", "flat"]
)
def test_a_cam_touches_its_follower_all_round(kind, swings, clockwise):
    run = kinematics(cam(swings, clockwise=clockwise, **kind), turn=True, instants=25)
    for k in range(len(run)):
        drawn = artists(draw(run, k))
        outline = drawn["cam:contact"].get_xy()
        contact = np.array([part[k] for part in run.reaction_point("contact")])
        assert gap(contact, outline) < CHORDS
        follower = run["follower"]
        place = np.array([follower.x[k], follower.y[k]])
        if "flat" in kind:
            n = np.array([-np.sin(follower.angle[k]), np.cos(follower.angle[k])])
            highest = ((outline - place) @ n).max()
            assert -CHORDS < highest < 1e-9
            ends = drawn["face:contact"].get_xydata()
            assert (ends - place) @ n == pytest.approx([0.0, 0.0], abs=1e-9)
            assert gap(contact, ends) < 1e-9 and gap(place, ends) < 1e-9
        else:
            assert gap(place, outline) == pytest.approx(kind.get("roller", 0.0), abs=CHORDS)
        if "roller" in kind:
            assert drawn["roller:contact"].center == pytest.approx(place)
            assert drawn["roller:contact"].radius == 8.0
        assert drawn["base:contact"].radius == 40.0
        assert gap(drawn["base:contact"].center, outline) == pytest.approx(40.0, abs=CHORDS)


def test_a_slider_stands_clear_of_the_roller():
    drawn = artists(draw(gallery.load("cam_follower")))
    roller, block = drawn["roller:contact"], drawn["block:guide"].get_xy()
    assert block[:, 1].min() > roller.center[1] + roller.radius
    assert np.mean(block[:4], axis=0)[0] == pytest.approx(roller.center[0], abs=1e-9)


def belt(sign):
    machine = Mechanism("belt", ground={"A": (0, 0), "B": (6, 1)})
    machine.add(
        Body("a", mass=1, inertia=1),
        Body("b", mass=1, inertia=1),
        Revolute("A", "ground.A", "a"),
        Revolute("B", "ground.B", "b"),
        LengthCoupling("belt", [CouplingTerm(2.0, angle="a"), CouplingTerm(sign, angle="b")]),
        AngleDriver("motor", "a", ConstantSpeed(0, 1)),
    )
    return machine


@pytest.mark.parametrize("sign", [-1.0, 1.0], ids=["open", "crossed"])
def test_a_belt_touches_its_wheels(sign):
    figure = draw(belt(sign))
    drawn = artists(figure)
    for name in ("belt:belt", "belt:belt:1"):
        side = drawn[name].get_xydata()
        u = (side[1] - side[0]) / np.hypot(*(side[1] - side[0]))
        across = []
        for n, (centre, radius) in enumerate([((0.0, 0.0), 2.0), ((6.0, 1.0), 1.0)]):
            wheel = drawn[f"pulley:belt.{n}"]
            assert wheel.center == pytest.approx(centre) and wheel.radius == radius
            # the line ends at the foot of the radius
            way = side[n] - centre
            assert way @ u == pytest.approx(0.0, abs=1e-12)
            assert np.hypot(*way) == pytest.approx(radius)
            across.append(u[0] * way[1] - u[1] * way[0])
        # both wheels lie on one side of an open belt
        assert across[1] / across[0] == pytest.approx(-0.5 * sign)
    assert inside(figure)


def test_ropes_reach_from_place_to_place():
    run = kinematics(tackle(), t=[0.0, 0.5])
    figure = draw(run, 1)
    drawn = artists(figure)
    block = run["block"].x[1], run["block"].y[1]
    first = drawn["rope:rope.0"].get_xydata()
    second = drawn["rope:rope.0:1"].get_xydata()
    # two parts side by side
    assert np.hypot(*(second - first)[0]) > 0.01
    assert 0.5 * (first + second) == pytest.approx(np.array([(0.0, 5.0), block]))
    assert drawn["rope:rope.2"].get_xydata() == pytest.approx(np.array([(2.0, 0.0), block]))
    assert drawn["pulley:rope.1"].center == pytest.approx((3.0, 5.0))
    assert drawn["pulley:rope.1"].radius == 0.5
    assert drawn["coupling:rope"].get_text() == "rope" and inside(figure)


def test_shafts_that_turn_together_are_tied():
    drawn = artists(draw(shafts()))
    assert drawn["belt:chain"].get_xydata() == pytest.approx(np.array([(0.0, 0.0), (3.0, 0.0)]))


def engine(*loads, tilt=0.3):
    """A slider crank on an inclined line of stroke."""
    machine = Mechanism("engine", ground={"O": (0, 0)})
    machine.add(
        makers.bar("crank", 0.2),
        makers.bar("rod", 0.8),
        Body("piston", mass=1.0, guess=(0.9, 0.3, tilt)),
        Revolute("O", "ground.O", "crank.A"),
        Revolute("A", "crank.B", "rod.A"),
        Revolute("B", "rod.B", "piston"),
        Prismatic("guide", Marker("ground", "O", tilt), "piston"),
        AngleDriver("motor", "crank", ConstantSpeed(tilt, 1.0)),
        *loads,
    )
    return machine


def test_a_piston_moves_in_its_cylinder():
    line = Marker("ground", "O", 0.3)
    both = {"area": 0.02, "opposite_area": 0.015, "near": 1.0, "far": 0.6, "clearance": 0.05}
    valves = ReciprocatingCylinder("mud", line, "piston", **both, delivery=1e6, bulk_modulus=2e9)
    run = kinematics(engine(valves), turn=True, instants=9)
    u = np.array([math.cos(0.3), math.sin(0.3)])
    places = np.column_stack([run["piston"].x, run["piston"].y])
    for k in range(len(run)):
        drawn = artists(draw(run, k))
        walls, disc = drawn["cylinder:mud"].get_xydata(), drawn["piston:mud"].get_xy()[:4]
        assert len(walls) == 5  # closed where the rod comes out
        ends = np.sort(walls @ u)[[0, -1]]
        assert ends[0] < (disc @ u).min() and (disc @ u).max() < ends[1]
        # what is left beyond the dead centre is the clearance
        way = places[k] @ u
        assert ends[1] - (disc @ u).max() == pytest.approx(0.05 + 1.0 - way)
        assert (disc @ u).min() - ends[0] == pytest.approx(0.05 + way - 0.6)
        rod = drawn["rod:mud"].get_xydata()
        assert rod[0] == pytest.approx(places[k]) and rod[1] == pytest.approx(disc.mean(axis=0))


def test_the_head_is_where_the_line_of_stroke_begins():
    out = {"cycle": "crank", "head_area": 0.02, "head": 1e5}
    towards = PistonPressure("gas", Marker("ground", "O", 0.3 + math.pi), "piston", **out)
    run = kinematics(engine(towards), turn=True, instants=9)
    walls = artists(draw(run))["cylinder:gas"].get_xydata()
    place, u = np.array([run["piston"].x[0], run["piston"].y[0]]), (math.cos(0.3), math.sin(0.3))
    assert len(walls) == 4  # open at the rod
    assert min((walls - place) @ u) > 0.0
    # a head that is a place of its own is not overrun
    behind = PistonPressure("gas", Marker("ground", (1.4, 0.0), math.pi), "piston", **out)
    run = kinematics(engine(behind, tilt=0.0), turn=True, instants=9)
    drawn = artists(draw(run))
    walls, disc = drawn["cylinder:gas"].get_xydata(), drawn["piston:gas"].get_xy()
    assert run["piston"].x[0] <= disc[:, 0].max() < walls[:, 0].max() <= 1.4 + 1e-12


@pytest.mark.parametrize("given", [{"speed": -12.0}, {"momentum": 24.0}], ids=["speed", "free"])
def test_a_spindle_has_its_speed_and_sense(given):
    machine = Mechanism("spinning", ground={"O": (0, 0)})
    machine.add(
        Body("ball", mass=2.0, cg=(1, 0), points={"O": (0, 0)}, spread="point"),
        Revolute("O", "ground.O", "ball.O"),
        CentrifugalField("field", Marker("ground", "O", UP), **given),
        AngleDriver("held", "ball", 0.0),
    )
    drawn = artists(draw(machine))
    axis = drawn["axis:field"].get_xydata()
    assert axis[:, 0] == pytest.approx([0.0, 0.0], abs=1e-12) and axis[0, 1] < 0.0 < axis[1, 1]
    # a free spindle has ω = H/J with J = m x² = 2
    told = drawn["told:field"].get_text()
    assert told.endswith("= −12 rad/s" if "speed" in given else "= 12 rad/s")
    ring = drawn["field:field"].get_xydata()
    front = ring[ring[:, 1] < ring[:, 1].mean()]
    # about an axis that points up the near side of the plane moves to the right
    assert np.sign(front[-1, 0] - front[0, 0]) == (-1.0 if "speed" in given else 1.0)


def test_wheels_on_one_road_have_one_road():
    drawn = artists(draw(gallery.load("vehicle")))
    roads = [drawn[name] for name in drawn if name.startswith("road:")]
    assert len(roads) == 1
    for name in ("front_tyre", "rear_tyre"):
        tyre = drawn[f"wheel:{name}.j"]
        along, high = roads[0].get_xydata().T
        assert along[0] < tyre.center[0] < along[1]
        assert high == pytest.approx(tyre.center[1] - tyre.radius, abs=1e-9)


@pytest.mark.parametrize("order", [1, -1])
def test_rails_on_one_line_are_one_where_they_meet(order):
    def laid(*rails):
        sketch = Sketch(None, None, 1.0, 1.0)
        for n, (start, end, reach) in enumerate(rails[::order]):
            sketch.rail(np.array(start), np.array(end), str(n), reach)
        return [(*rail.start.tolist(), *rail.end.tolist()) for rail in sketch.rails]

    a = (0.0, 0.0), (10.0, 0.0), 0.0
    assert laid(a, ((8.0, 0.0), (20.0, 0.0), 0.0)) == [(0.0, 0.0, 20.0, 0.0)]
    assert len(laid(a, ((12.0, 0.0), (20.0, 0.0), 0.0))) == 2
    assert laid((*a[:2], 3.0), ((12.0, 0.0), (20.0, 0.0), 3.0)) == [(0.0, 0.0, 20.0, 0.0)]
    # hatched on the other side, beside it, or slanting
    assert len(laid(a, (*a[1::-1], 0.0))) == 2
    assert len(laid(a, ((8.0, 1.0), (20.0, 1.0), 0.0))) == 2
    assert len(laid(a, ((0.0, 0.0), (10.0, 1.0), 0.0))) == 2


def test_a_kind_of_ones_own_takes_one_function():
    class Magnet(Revolute):
        """A pin with a symbol of its own."""

    def symbol(joint, sketch):
        sketch.disc(sketch.pose.place(joint, "j"), sketch.size("block"), name=f"own:{joint.name}")

    machine = Mechanism("magnet")
    machine.add(Body("b", mass=1.0), Magnet("M", "ground", "b"))
    assert "pin:M" in artists(draw(machine))
    joint_symbol.register(Magnet)(symbol)
    assert "own:M" in artists(draw(machine))


# -- shapes and labels ------------------------------------------------------------------------


def test_the_outline_is_as_far_as_the_radius():
    corners = np.array([(0.0, 0.0), (4.0, 0.0), (1.0, 3.0), (1.5, 1.0)])
    outline = rounded(corners, 0.5)
    ring = hull(corners)
    for x, y in outline:
        gaps = []
        for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            part = np.clip((np.array([x, y]) - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            gaps.append(np.hypot(*(a + part * (b - a) - (x, y))))
        assert min(gaps) == pytest.approx(0.5)


def test_labels_keep_clear():
    places = Places(1.0)
    places.stroke(np.array([(0.0, -50.0), (0.0, 50.0)]), 0.5)
    spots = [(float(x), 0.0, 0.0) for x in (0, 10, 60)]
    first, second = Label("some text", spots), Label("some text", spots)
    places.set([first, second])
    assert first.at == (60.0, 0.0) and not first.covers
    assert second.at != (60.0, 0.0) and second.covers


def test_names_at_curves_are_spread():
    wanted = [0.3, 0.31, 0.9, 0.32, 0.05]
    found = spread(wanted, 0.1)
    order = np.argsort(found)
    # rounded to nine decimals
    assert np.diff(np.array(found)[order]).min() > 0.1 - 2e-9
    assert found[2] == 0.9 and found[4] == 0.05
    assert [found[n] for n in (0, 1, 3)] == sorted(found[n] for n in (0, 1, 3))


# -- plots ------------------------------------------------------------------------------------


def test_a_plot_shows_the_histories(turn):
    figure = plot(turn, "motor.effort", "A.force", "rocker.angle", "B.force")
    panels = {axes.get_ylabel(): axes for axes in figure.axes}
    assert list(panels) == ["motor.effort [lbf·in]", "force [lbf]", "rocker.angle [deg]"]
    curves = {line.get_gid(): line for axes in figure.axes for line in axes.lines}
    degrees = np.degrees(turn.driven("motor")[0])
    for name, values in {
        "motor.effort": turn.effort("motor"),
        "A.force": turn.reaction("A").magnitude,
        "rocker.angle": np.degrees(turn["rocker"].angle),
    }.items():
        assert curves[f"curve:{name}"].get_xdata() == pytest.approx(degrees)
        assert curves[f"curve:{name}"].get_ydata() == pytest.approx(values)
    assert figure.axes[-1].get_xlabel() == "angle of crank [deg]"
    names = [text for text in panels["force [lbf]"].texts]
    assert [text.get_text() for text in names] == ["A.force", "B.force"]
    # names stand right of the curves and keep apart
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in names]
    assert min(box.x0 for box in boxes) >= panels["force [lbf]"].get_window_extent().x1
    assert not boxes[0].overlaps(boxes[1])
    assert max(box.x1 for box in boxes) < figure.bbox.x1


def test_measures_have_their_units():
    run = kinetostatics(gallery.load("slider_crank"), turn=True)
    figure = plot(run)
    assert [axes.get_ylabel() for axes in figure.axes] == ["thrust [kN]", "turning_moment [kN·m]"]
    thrust = figure.axes[0].lines[0].get_ydata()
    assert thrust == pytest.approx(run.reaction("B").magnitude / 1e3)


def test_the_axis_is_time_where_nothing_turns_on():
    run = kinetostatics(gallery.load("scissor_lift"), t=[0.0, 1.0, 2.0])
    figure = plot(run, "height")
    assert figure.axes[0].get_xlabel() == "t [s]" and figure.axes[0].get_xlim() == (0.0, 2.0)
    back = makers.four_bar(1, 3, 2, 3.5)
    run = kinematics(back, drive={"motor": np.array([1.0, 2.0, 1.5])})
    assert plot(run, "rocker.angle").axes[0].get_xlabel() == "instant"
    run = kinematics(back, drive={"motor": np.array([1.0, 2.0, 2.5])})
    assert plot(run, "rocker.angle").axes[0].get_xlabel() == "angle of crank [deg]"


def test_a_plot_is_smooth_between_the_places_of_a_driver():
    machine = gallery.load("flyball_governor")
    row = cycle(machine, Instants(at={"arm_l": ["10 deg", "70 deg", "40 deg"]})).at["arm_l"]
    # 90 of 180 steps for 60 deg
    assert len(row) == SMOOTH and max(np.diff(row)) == pytest.approx(math.radians(60.0 / 90.0))
    assert [row[0], max(row), row[-1]] == pytest.approx(np.radians([10.0, 70.0, 40.0]))
    # a row that is as long is taken as it is
    known = np.linspace(0.2, 0.9, SMOOTH + 2)
    assert (
        list(cycle(machine, Instants(at={"arm_l": known.tolist()})).at["arm_l"]) == known.tolist()
    )


# -- files and the command --------------------------------------------------------------------

HEADS = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}


@pytest.mark.parametrize("ending", ENDINGS)
def test_files_are_the_same_every_time(ending, norton, turn, tmp_path):
    for n in range(2):
        save(draw(norton, forces=True), tmp_path / f"a{n}.{ending}")
        save(plot(turn, "motor.effort"), tmp_path / f"b{n}.{ending}")
    for name in "ab":
        first, second = ((tmp_path / f"{name}{n}.{ending}").read_bytes() for n in range(2))
        assert first == second and first.startswith(HEADS[ending])


def test_the_command_draws_and_plots(tmp_path, capsys):
    picture, diagram = tmp_path / "a.svg", tmp_path / "b.PNG"
    words = ["draw", "norton_fourbar", "--forces", "--at", "crank=90", "--units", "SI"]
    assert cli.main([*words, "--path", "coupler.P", "-o", str(picture)]) == 0
    text = picture.read_text("utf-8")
    assert {"force:F32", "path:coupler.P", "pin:O4"} <= set(re.findall(r'id="([^"]+)"', text))
    assert cli.main(["plot", "peaucellier", "y_of_Q", "-o", str(diagram)]) == 0
    assert diagram.read_bytes().startswith(HEADS["png"])
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"wrote {picture}\nwrote {diagram}\n")


def test_the_command_draws_what_nothing_drives(tmp_path):
    machine = Mechanism("a pendulum")
    machine.add(Body("bob", points={"A": (1.0, 0.0)}), Revolute("O", "ground", "bob"))
    mbody.save(machine, tmp_path / "m.toml")
    assert cli.main(["draw", str(tmp_path / "m.toml"), "-o", str(tmp_path / "m.svg")]) == 0
    assert 'id="link:bob"' in (tmp_path / "m.svg").read_text("utf-8")


def test_settings_of_the_user_stay_and_do_not_count():
    code = (
        "import matplotlib as m; m.rcParams['font.size'] = 30; m.rcParams['backend'] = 'svg';"
        "had = dict(m.rcParams); import mbody, sys;"
        "figure = mbody.draw(mbody.makers.four_bar(1, 3, 2, 3.5));"
        "print(dict(m.rcParams) == had, 'matplotlib.pyplot' in sys.modules,"
        " *figure.get_size_inches())"
    )
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    same, pyplot, *size = done.stdout.split()
    assert (same, pyplot) == ("True", "False")
    expected = draw(makers.four_bar(1, 3, 2, 3.5)).get_size_inches()
    assert [float(part) for part in size] == pytest.approx(expected)


# -- the pictures of the README ---------------------------------------------------------------


@pytest.fixture(scope="module")
def anew(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    return folder, pictures.make(folder)


def test_the_pictures_are_those_of_the_gallery(anew):
    folder, made = anew
    assert sorted(path.name for path in pictures.FOLDER.iterdir()) == made
    for name in made:
        mine, kept = ((where / name).read_text("utf-8") for where in (folder, pictures.FOLDER))
        # the same things in the same order; digits may differ with matplotlib's version
        assert re.findall(r'id="([a-z]+:[^"]+)"', mine) == re.findall(r'id="([a-z]+:[^"]+)"', kept)
        links = len(gallery.load(name.removesuffix(".svg")).bodies)
        assert len(kept) < 60_000 + 2_500 * max(0, links - 20), name


def test_the_readme_shows_them():
    assert pictures.parts(pictures.README.read_text("utf-8"))[1] == pictures.table()


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 1e4, 1e9])
def test_every_sign_of_a_label_is_drawn(size, caplog, tmp_path):
    """Numbers of any size stand beside symbols, whose fonts lack thin spaces and raised digits."""
    masses = (0.1 * size, 0.3 * size, 0.2 * size)
    lengths = (1000.0, 3000.0, 2000.0, 3500.0)
    machine = mbody.makers.four_bar(*lengths, masses=masses, speed=10.0, units="mm-N-s")
    machine.add(mbody.Torque("T_4", "rocker", value=12345.0 * size))
    with caplog.at_level("WARNING", logger="matplotlib"):
        figure = mbody.draw(mbody.kinetostatics(machine), forces=True)
        figure.savefig(tmp_path / "four_bar.png")
    assert not [one.message for one in caplog.records if "glyph" in one.message]
