"""What is dragged is where a position analysis has it, and no link changes while it moves."""

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.edit.places import Dragging, DrawingState
from mbody.files.model.read import from_toml
from mbody.views.drawing import first_position


def dragging(model):
    system = mbody.assemble(model)
    own = system.mechanism, system, first_position(system), mbody.mobility(system)
    return Dragging(DrawingState(*own))


def where(drag, name):
    return np.array(drag.now.place(name))


def arm(drag, name):
    return np.array(drag.now.arm(*name.split(".")))


def gaps(drag):
    """Distances of the two places of each pin, by the poses alone."""
    pins = [one for one in drag.now.mechanism.joints if isinstance(one, mbody.Revolute)]
    places = [(drag.now.place(str(pin.i)), drag.now.place(str(pin.j))) for pin in pins]
    return [float(np.hypot(*np.subtract(i, j))) for i, j in places]


@pytest.mark.parametrize("name", ["norton_fourbar", "stephenson_sixbar", "hoekens"])
def test_a_crank_follows_the_pointer_and_all_forces_are_those_of_its_angle(name):
    drag = dragging(gallery.load(name))
    crank = drag.now.mechanism.bodies[0]
    pivot, pin = (f"{crank.name}.{point}" for point in list(crank.points)[:2])
    centre, first = where(drag, pivot), where(drag, pin)
    radius = np.hypot(*(first - centre))
    angle = np.arctan2(*(first - centre)[::-1])
    for n in range(1, 14):  # once round in steps of half a radian
        to = centre + radius * np.array([np.cos(angle + 0.5 * n), np.sin(angle + 0.5 * n)])
        for _ in range(4):
            drag.move(crank.name, arm(drag, pin), to)
        assert np.hypot(*(where(drag, pin) - to)) < 1e-3 * radius
    assert drag.away and max(gaps(drag)) < 1e-9 * drag.drawn.system.length
    (driver,) = drag.values
    home = float(mbody.kinetostatics(drag.now.mechanism).driven(driver)[0][0])
    path = np.linspace(home, drag.values[driver], 200)
    rate, acceleration = (float(one[0]) for one in drag.now.run.driven(driver)[1:])
    direct = mbody.kinetostatics(drag.now.mechanism, drive={driver: (path, rate, acceleration)})
    effort = float(drag.now.run.effort(driver)[0])
    assert effort == pytest.approx(float(direct.effort(driver)[-1]), rel=1e-8, abs=1e-9)
    assert not drag.home().away


def test_beyond_reach_the_nearest_place_is_taken():
    drag = dragging(gallery.load("norton_fourbar"))
    centre, pin = where(drag, "crank.O2"), "crank.A"
    radius = np.hypot(*(where(drag, pin) - centre))
    to = centre + 7.0 * radius * np.array([np.cos(1.2), np.sin(1.2)])
    for _ in range(12):
        drag.move("crank", arm(drag, pin), to)
    assert np.allclose(where(drag, pin), centre + (to - centre) / 7.0, atol=1e-3 * radius)


def loose_chain():
    machine = mbody.Mechanism("chain", ground={"O": (0.0, 0.0)})
    machine.add(mbody.Body("one", points={"O": (0.0, 0.0), "A": (2.0, 0.0)}))
    machine.add(mbody.Body("two", points={"A": (0.0, 0.0), "B": (1.5, 0.0)}, guess=1.0))
    machine.add(mbody.Revolute("O", "ground.O", "one.O"), mbody.Revolute("A", "one.A", "two.A"))
    return machine


def test_a_chain_without_a_motor_is_dragged_by_its_free_motions():
    drag = dragging(loose_chain())
    assert len(drag.hands) == 2
    for n in range(1, 30):
        to = [(1.5 + 0.5 * np.sin(n)) * np.cos(0.3 * n), 2.0 * np.sin(0.3 * n)]
        for _ in range(6):
            drag.move("two", arm(drag, "two.B"), to)
        assert np.allclose(where(drag, "two.B"), to, atol=2e-3)
        assert max(gaps(drag)) < 1e-12


@pytest.mark.parametrize(
    ("name", "places"),
    [
        ("norton_fourbar", ["coupler.B", "rocker.B"]),
        ("stephenson_sixbar", ["coupler.P", "link.P"]),  # one of them in polar coordinates
        ("stephenson_sixbar", ["ground.O4", "rocker.O4"]),
    ],
)
def test_a_point_goes_where_it_is_dragged_and_its_links_get_these_numbers(name, places):
    drag = dragging(gallery.load(name))
    to = where(drag, places[0]) + 0.03 * drag.drawn.system.length
    drag.point(places, to, [])
    assert not drag.stopped and max(gaps(drag)) < 1e-9 * drag.drawn.system.length
    # a second route: a system with these numbers alone
    direct = mbody.kinetostatics(drag.drawn.system.with_values(drag.changed))
    for place in places:
        here = to
        if not place.startswith("ground."):
            history = direct.point(place)
            here = [float(history.x[0]), float(history.y[0])]
        assert np.allclose(here, to, atol=1e-9 * drag.drawn.system.length), place
    driver = next(iter(drag.values))
    assert float(drag.turn.effort(driver)[0]) == pytest.approx(float(direct.effort(driver)[0]))


def test_a_point_given_by_a_parameter_is_brought_nearest():
    drag = dragging(gallery.load("mud_pump_sixbar"))
    name = next(iter(drag.now.mechanism.parameters))
    first = float(drag.drawn.system.values[name])
    drag.number(name, 1.1 * first)
    body, point = next(
        (b.name, p)
        for b in drag.now.mechanism.bodies
        for p in b.points
        if not np.allclose(
            where(drag, f"{b.name}.{p}"), where(dragging(drag.now.mechanism), f"{b.name}.{p}")
        )
    )
    goal = where(drag, f"{body}.{point}")
    again = dragging(drag.now.mechanism)
    for _ in range(6):
        again.point([f"{body}.{point}"], goal, [name])
    assert again.changed[name] == pytest.approx(1.1 * first, rel=1e-6)


def test_numbers_with_which_the_loops_do_not_close_are_refused_and_nothing_changes():
    drag = dragging(gallery.load("norton_fourbar"))
    before = where(drag, "coupler.B")
    drag.number("ground.O4.x", 900.0)
    assert drag.stopped and not drag.changed
    assert np.array_equal(where(drag, "coupler.B"), before)


#: A four-bar of a size, with masses and a crank by parameters.
SIZED = """\
units = "SI"
[parameters]
long = "{size!r} m"
tilt = "20 deg"
none = "0 m"
speed = "3 rad/s"
start = "50 deg"
[ground.points]
A = [0, 0]
D = [{ground!r}, 0]
[bodies.crank]
points = {{ A = [0, 0], B = [{size!r}, 0] }}
mass = {mass!r}
[bodies.coupler]
points = {{ B = [0, 0], C = [{coupler!r}, 0], P = {{ r = "2*long + none", angle = "tilt" }} }}
mass = {mass!r}
cg = {{ r = "long", angle = "tilt" }}
[bodies.rocker]
points = {{ D = [0, 0], C = [{rocker!r}, 0] }}
guess = 60
[joints]
A = {{ revolute = ["ground.A", "crank.A"] }}
B = {{ revolute = ["crank.B", "coupler.B"] }}
C = {{ revolute = ["coupler.C", "rocker.C"] }}
D = {{ revolute = ["ground.D", "rocker.D"] }}
[drivers]
motor = {{ angle = "crank", law = {{ constant_speed = {{ value = "start", speed = "speed" }} }} }}
"""


def sized(size, mass):
    lengths = {"ground": 4.0 * size, "coupler": 3.5 * size, "rocker": 3.0 * size}
    return dragging(from_toml(SIZED.format(size=size, mass=mass, **lengths)))


def dragged(size, mass):
    """Poses and efforts of some drags, in units of the size and mass."""
    drag, found = sized(size, mass), []
    force = mass * size

    def note():
        assert not drag.stopped, drag.stopped
        for body in drag.now.mechanism.bodies:
            found.extend(np.array(drag.now.pose(body.name)) / (size, size, 1.0))
        found.append(float(drag.now.run.effort("motor")[0]) / (force * size))

    for x in (0.5, 0.1, -0.6):
        drag.move("crank", arm(drag, "crank.B"), (x * size, 0.9 * size))
        note()
    for x, y in ((0.2, 0.1), (0.3, 0.25)):
        place = where(dragging(drag.now.mechanism), "coupler.P") + size * np.array([x, y])
        drag.home().point(["coupler.P"], place, ["long", "none", "tilt"])
        note()
        drag.home().point(
            ["coupler.C", "rocker.C"], where(drag, "rocker.C") + size * np.array([0, y]), []
        )
        note()
    for name, value in (("long", 1.1 * size), ("tilt", 0.5), ("speed", 4.0), ("start", 1.9)):
        drag.home().number(name, value)
        note()
    return np.array(found)


@pytest.mark.parametrize(("size", "mass"), [(1e-6, 1e-6), (1e-3, 1e6), (1e3, 1e-6), (1e6, 1e6)])
def test_drags_are_the_same_in_all_sizes(size, mass):
    assert np.allclose(dragged(size, mass), dragged(1.0, 1.0), rtol=1e-7, atol=1e-8)


def test_a_drag_in_steps_ends_where_one_step_does():
    """What the drop writes is what was shown, whatever the pointer passed."""
    for name, group, by in (
        ("quick_return", ["ground.A", "lever.A"], []),
        ("mud_pump_sixbar", ["ground.F"], ["AE", "ED", "AB", "BC", "EC"]),
    ):
        drag, once = (dragging(gallery.load(name)) for _ in "ab")
        start, away = where(drag, group[0]), 0.03 * drag.drawn.system.length * np.array([0.6, -0.8])
        for part in (0.5, 2.0, 1.0, 1.0, 1.0):
            drag.point(group, start + part * away, by)
        for _ in range(6):
            once.point(group, start + away, by)
        for number in once.changed:
            assert drag.changed[number] == pytest.approx(once.changed[number], rel=1e-6, abs=1e-9)
