"""Pictures of elements: cams, belts, ropes, cylinders, spindles, wheels, rails."""

import math

import numpy as np
import pytest

import mbody
from mbody import gallery, makers
from mbody.laws import ConstantSpeed, Harmonic
from mbody.model.loads import CentrifugalField, PistonPressure, ReciprocatingCylinder
from mbody.views import draw
from mbody.views.joint_symbols import joint_symbol
from mbody.views.sketch import Sketch
from tests.support.odd_mechanisms import ODD, tackle
from tests.support.picture_reader import artists, gap, inside

UP = math.pi / 2.0


@pytest.mark.parametrize("machine", ODD, ids=lambda machine: machine.__name__)
def test_any_mechanism_draws(machine):
    figure = draw(machine())
    assert ODD[machine] <= set(artists(figure))
    assert inside(figure)


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
    machine = mbody.Mechanism("cam", units="mm-N-s", ground={"Q": (80, 30)})
    lift = Harmonic(mean=10.0, amplitude=10.0, frequency=1.0)
    machine.add(
        mbody.Body("shaft", mass=1e-3),
        mbody.Body(
            "follower", mass=1e-3, points={"Q": (80, 0)}, guess=(0, 50, -0.2 if swings else 0.0)
        ),
        mbody.Revolute("O", "ground", "shaft"),
        mbody.CamFollower(
            "contact", mbody.Marker("shaft", (0, 0), UP), "follower", lift, base_radius=40.0, **kind
        ),
        mbody.AngleDriver("motor", "shaft", ConstantSpeed(0.0, 1.0)),
    )
    if swings:
        machine.add(mbody.Revolute("Q", "ground.Q", "follower.Q"))
    else:
        machine.add(
            mbody.Prismatic(
                "guide", mbody.Marker("ground", (0, 0), UP), mbody.Marker("follower", (0, 0), UP)
            )
        )
    return machine


#: An outline of chords of 2° about radii of curvature below 150 mm is 150/8 · (2°)² within.
CHORDS = 0.023


@pytest.mark.slow
@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("swings", [False, True])
@pytest.mark.parametrize(
    "kind", [{"roller": 8.0}, {}, {"flat": True}], ids=["roller", "edge", "flat"]
)
def test_a_cam_touches_its_follower_all_round(kind, swings, clockwise):
    run = mbody.kinematics(cam(swings, clockwise=clockwise, **kind), turn=True, instants=25)
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
    machine = mbody.Mechanism("belt", ground={"A": (0, 0), "B": (6, 1)})
    machine.add(
        mbody.Body("a", mass=1, inertia=1),
        mbody.Body("b", mass=1, inertia=1),
        mbody.Revolute("A", "ground.A", "a"),
        mbody.Revolute("B", "ground.B", "b"),
        mbody.LengthCoupling(
            "belt", [mbody.CouplingTerm(2.0, angle="a"), mbody.CouplingTerm(sign, angle="b")]
        ),
        mbody.AngleDriver("motor", "a", ConstantSpeed(0, 1)),
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
    run = mbody.kinematics(tackle(), t=[0.0, 0.5])
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


def engine(*loads, tilt=0.3):
    """A slider crank on an inclined line of stroke."""
    machine = mbody.Mechanism("engine", ground={"O": (0, 0)})
    machine.add(
        makers.bar("crank", 0.2),
        makers.bar("rod", 0.8),
        mbody.Body("piston", mass=1.0, guess=(0.9, 0.3, tilt)),
        mbody.Revolute("O", "ground.O", "crank.A"),
        mbody.Revolute("A", "crank.B", "rod.A"),
        mbody.Revolute("B", "rod.B", "piston"),
        mbody.Prismatic("guide", mbody.Marker("ground", "O", tilt), "piston"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(tilt, 1.0)),
        *loads,
    )
    return machine


def test_a_piston_moves_in_its_cylinder():
    line = mbody.Marker("ground", "O", 0.3)
    both = {"area": 0.02, "opposite_area": 0.015, "near": 1.0, "far": 0.6, "clearance": 0.05}
    valves = ReciprocatingCylinder("mud", line, "piston", **both, delivery=1e6, bulk_modulus=2e9)
    run = mbody.kinematics(engine(valves), turn=True, instants=9)
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
    towards = PistonPressure("gas", mbody.Marker("ground", "O", 0.3 + math.pi), "piston", **out)
    run = mbody.kinematics(engine(towards), turn=True, instants=9)
    walls = artists(draw(run))["cylinder:gas"].get_xydata()
    place, u = np.array([run["piston"].x[0], run["piston"].y[0]]), (math.cos(0.3), math.sin(0.3))
    assert len(walls) == 4  # open at the rod
    assert min((walls - place) @ u) > 0.0
    # a head that is a place of its own is not overrun
    behind = PistonPressure("gas", mbody.Marker("ground", (1.4, 0.0), math.pi), "piston", **out)
    run = mbody.kinematics(engine(behind, tilt=0.0), turn=True, instants=9)
    drawn = artists(draw(run))
    walls, disc = drawn["cylinder:gas"].get_xydata(), drawn["piston:gas"].get_xy()
    assert run["piston"].x[0] <= disc[:, 0].max() < walls[:, 0].max() <= 1.4 + 1e-12


@pytest.mark.parametrize("given", [{"speed": -12.0}, {"momentum": 24.0}], ids=["speed", "free"])
def test_a_spindle_has_its_speed_and_direction(given):
    machine = mbody.Mechanism("spinning", ground={"O": (0, 0)})
    machine.add(
        mbody.Body("ball", mass=2.0, cg=(1, 0), points={"O": (0, 0)}, spread="point"),
        mbody.Revolute("O", "ground.O", "ball.O"),
        CentrifugalField("field", mbody.Marker("ground", "O", UP), **given),
        mbody.AngleDriver("held", "ball", 0.0),
    )
    drawn = artists(draw(machine))
    axis = drawn["axis:field"].get_xydata()
    assert axis[:, 0] == pytest.approx([0.0, 0.0], abs=1e-12) and axis[0, 1] < 0.0 < axis[1, 1]
    # a free spindle has ω = H/J with J = m x² = 2
    label = drawn["label:field"].get_text()
    assert label.endswith("= −12 rad/s" if "speed" in given else "= 12 rad/s")
    ring = drawn["field:field"].get_xydata()
    front = ring[ring[:, 1] < ring[:, 1].mean()]
    # about an axis that points up the near side of the plane moves to the right
    assert np.sign(front[-1, 0] - front[0, 0]) == (-1.0 if "speed" in given else 1.0)


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
    class Magnet(mbody.Revolute):
        """A pin with a symbol of its own."""

    def symbol(joint, sketch):
        sketch.disc(sketch.pose.place(joint, "j"), sketch.size("block"), name=f"own:{joint.name}")

    machine = mbody.Mechanism("magnet")
    machine.add(mbody.Body("b", mass=1.0), Magnet("M", "ground", "b"))
    assert "pin:M" in artists(draw(machine))
    joint_symbol.register(Magnet)(symbol)
    assert "own:M" in artists(draw(machine))
