"""A scene moves its shapes as the mechanism moves: compared with drawings of each instant."""

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.views.film_frames import FilmSet
from mbody.views.scene import MOST, scene, thinned
from mbody.views.shapes import Pose, motion
from mbody.views.sketch import SceneSketch

SHOWN = (
    *("norton_fourbar", "mud_pump", "planetary_train", "cam_follower", "vehicle"),
    *("free_fourbar", "andrews_squeezer", "scissor_lift", "flyball_governor", "quick_return"),
)
#: Far below a pixel: a part of the size of the mechanism.
CLOSE = 1e-9


@pytest.fixture(scope="module")
def runs():
    return {name: motion(gallery.load(name)) for name in SHOWN}


def world(found, shape, k):
    return shape.carrier.in_world(shape.points, shape.carrier.axes(found.run), k)


def drawn_at(run, k, like):
    """The same elements drawn anew at another instant, by name."""
    from mbody.views.acting import load_symbol
    from mbody.views.joint_symbols import joint_symbol, link

    sketch = SceneSketch(Pose(run, k), like.unit, like.small)
    for order, body in enumerate(run.mechanism.bodies):
        link(sketch, body.name, order)
    for joint in run.mechanism.joints:
        joint_symbol(joint, sketch)
    for load in run.mechanism.loads:
        load_symbol(load, sketch)
    found = {}
    for shape in sketch.record.shapes:
        if shape.look.name:
            found.setdefault(shape.look.name, world_at(shape, run, k))
    return found


def world_at(shape, run, k):
    return shape.carrier.in_world(shape.points, shape.carrier.axes(run), k)


@pytest.mark.parametrize("name", SHOWN)
def test_shapes_move_as_a_drawing_of_each_instant_has_them(runs, name):
    found = scene(runs[name])
    size = found.run.system.length
    compared = 0
    for k in (len(found.run) // 5, len(found.run) // 2, len(found.run) - 1):
        anew = drawn_at(found.run, k, found)
        for shape in found.shapes:
            kind = shape.look.name.partition(":")[0]
            # the outlines of links begin at another corner where a hull turns: their middle is
            # compared; what a drawing puts on its best side at each instant is not compared
            if kind in ("pin", "block", "cg", "spring", "rod", "piston", "cylinder", "base"):
                there = anew.get(shape.look.name)
                if there is None or len(there) != len(world(found, shape, k)):
                    continue
                assert np.abs(world(found, shape, k) - there).max() < CLOSE * size, shape.look.name
                compared += 1
            elif kind in ("link", "cam"):
                there = anew[shape.look.name]
                here = world(found, shape, k)
                box = np.array([here.min(axis=0), here.max(axis=0)])
                other = np.array([there.min(axis=0), there.max(axis=0)])
                # arcs have corners at other angles: up to 0.3 % of their radius
                assert np.abs(box - other).max() < 0.02 * found.unit * 4.2 + 2e-3 * size
                compared += 1
    assert compared >= 3


def test_pins_are_where_the_joints_are(runs):
    found = scene(runs["norton_fourbar"])
    pins = {s.look.name[4:]: s for s in found.shapes if s.look.name.startswith("pin:")}
    for joint in ("O2", "A", "B", "O4"):
        at = np.array(found.run.reaction_point(joint)).T
        for k in range(0, 361, 40):
            assert np.hypot(*(world(found, pins[joint], k)[0] - at[k])) < 1e-12 * 20


def test_what_stretches_reaches_from_end_to_end(runs):
    found = scene(runs["andrews_squeezer"])
    (coil,) = (s for s in found.shapes if s.look.name.startswith("spring:"))
    load = found.run.load("spring")
    for k in range(0, len(found.run), 50):
        points = world(found, coil, k)
        assert np.hypot(*(points[-1] - points[0])) == pytest.approx(load.length[k], rel=1e-12)


def test_the_box_holds_all_instants(runs):
    for name in ("norton_fourbar", "scissor_lift", "vehicle"):
        found = scene(runs[name])
        for k in range(0, len(found.run), 7):
            for body in found.run.mechanism.bodies:
                for node in Pose(found.run, k).nodes[body.name]:
                    assert np.all(node >= found.low - 1e-3 * found.run.system.length)
                    assert np.all(node <= found.high + 1e-3 * found.run.system.length)


def test_a_million_instants_are_thinned_and_that_is_said():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    run = mbody.kinematics(machine, turn=True, instants=100_001)
    shown, notes = thinned(run)
    assert len(shown) == MOST
    assert notes == [f"{MOST} of 100001 instants are shown, evenly chosen; results have them all"]
    assert shown.t[0] == run.t[0] and shown.t[-1] == run.t[-1]
    assert np.ptp(np.diff(shown.t)) <= 1.01 * np.diff(run.t).max()


def test_thinning_keeps_the_instants_of_events():
    run = mbody.simulate(gallery.load("bouncing_ball"), 3.0, instants=6001)
    shown, notes = thinned(run)
    assert notes
    for event in run.events[:20]:
        assert np.abs(shown.t - event.t).min() == np.abs(run.t - event.t).min()


def test_arrows_turn_round_with_what_they_show():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1), speed=10.0)
    swing = mbody.laws.Harmonic(mean=0.0, amplitude=2.0, frequency=10.0)
    machine.add(mbody.Torque("load", "rocker", value=swing))
    run = mbody.kinetostatics(machine, turn=True)
    found = scene(run)
    arcs = [s for s in found.shapes if s.look.name == "torque:load"]
    assert {s.sign_condition for s in arcs} == {("load.torque", 1.0), ("load.torque", -1.0)}
    # a motor that turns one way has one arrow, beside its forces that of its torque
    motors = [s for s in found.shapes if s.look.name == "driver:motor"]
    assert {s.sign_condition for s in motors} == {("drive:motor", 1.0), ("drive:motor", -1.0)}
    kinematic = scene(mbody.kinematics(machine, turn=True))
    alone = [s for s in kinematic.shapes if s.look.name == "driver:motor"]
    assert {s.sign_condition for s in alone} == {None}
    shown = {one: FilmSet({"": run}, 40, 320, one, ()) for one in ((), ("forces",))}
    effort = shown[()].stretches[0].value(run.effort("motor"))
    for arc in motors:
        sign = arc.sign_condition[1]
        assert (shown[()].there(arc, 0) == (sign > 0.0)).all()
        assert np.array_equal(shown["forces",].there(arc, 0), sign * effort > 0.0)
    film = FilmSet({"": run}, 40, 320, (), ())
    torque = film.stretches[0].value(run.load("load").torque)
    for arc in arcs:
        assert np.array_equal(film.there(arc, 0), arc.sign_condition[1] * torque > 0.0)
    turning = {}
    for arc in arcs:
        x, y = (world(found, arc, 0) - world(found, arc, 0)[0]).T
        turning[arc.sign_condition[1]] = float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    assert turning[1.0] > 0.0 > turning[-1.0]


@pytest.mark.parametrize("name", ["norton_fourbar", "static_fourbar", "slider_crank"])
def test_a_model_of_one_instant_makes_a_turn(name):
    run = motion(gallery.load(name))
    assert len(run) == 361
    value = run.driven(run.mechanism.drivers[0].name)[0]
    assert abs(value[-1] - value[0]) == pytest.approx(2.0 * np.pi, rel=1e-12)


def test_a_driver_that_cannot_turn_goes_through_its_range():
    run = motion(gallery.load("mud_pump_sixbar_as_scanned"))
    low, high = mbody.driver_range(run.mechanism)
    value = run.driven("motor")[0]
    assert low < value[0] < value[-1] < high
    assert value[-1] - value[0] == pytest.approx(0.98 * (high - low), rel=1e-9)
