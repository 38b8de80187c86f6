"""Pictures of contacts and frictional joints: bars of modes, marks, cones, friction circles,
ropes.
"""

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Contact,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    Rope,
    SimulationSettings,
)
from mbody.laws import ConstantSpeed
from mbody.solution.contact_points import contact_points_of
from mbody.views.acting import sign_history
from mbody.views.film_frames import FilmSet
from mbody.views.page_data import scene_data
from mbody.views.scene import scene
from mbody.views.sketch import MODES, mode_rows
from tests.support.picture_reader import arrow, artists

G = 9.81
FLOOR = {"floor": {"line": {"point": "O"}}}


def wheel():
    """A disc that is thrown along a table: it slides, rolls, and falls over the edge."""
    machine = Mechanism(
        "wheel",
        ground={"A": (0.0, 0.0), "B": (1.0, 0.0)},
        ground_shapes={"top": {"segment": ("A", "B")}},
    )
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    machine.add(
        Body("wheel", mass=3.0, inertia=0.06, points={"C": (0.0, 0.0)}, shapes=rim),
        Contact("road", "ground.top", "wheel.rim", friction=0.15),
        Gravity("g", y=-G),
    )
    start = {"wheel": {"x": 0.1, "y": 0.2, "vx": 2.0}}
    machine.simulation = SimulationSettings(until=0.8, start=start, instants=81)
    return mbody.simulate(machine)


def ladder(friction=0.25):
    wall = {"wall": {"line": {"point": "O", "angle": -0.5 * np.pi}}}
    machine = Mechanism("ladder", ground={"O": (0, 0)}, ground_shapes=FLOOR | wall)
    points = {"foot": (-2.0, 0.0), "top": (2.0, 0.0)}
    machine.add(
        Body("ladder", mass=10.0, inertia=40.0 / 3.0, points=points),
        Contact("foot", "ground.floor", "ladder.foot", friction=friction, static=1.2 * friction),
        Contact("top", "ground.wall", "ladder.top", friction=0.15),
        Gravity("g", y=-G),
    )
    start = {"ladder": {"x": 2 * np.cos(1), "y": 2 * np.sin(1), "angle": np.pi - 1}}
    machine.simulation = SimulationSettings(until=1.0, start=start, instants=21)
    return mbody.simulate(machine)


def crank(radius=0.01, friction=0.1):
    rough = {"friction": friction, "pin_radius": radius}
    machine = Mechanism("press", ground={"O": (0, 0)})
    machine.add(
        Body("crank", points={"O": (0, 0), "A": (0.05, 0)}, guess=3.5),
        Body("rod", points={"A": (0, 0), "B": (0.2, 0)}, guess=0.1),
        Body("slider", points={"B": (0, 0)}),
        Revolute("O", "ground.O", "crank.O", **rough),
        Revolute("A", "crank.A", "rod.A", **rough),
        Revolute("B", "rod.B", "slider.B"),
        Prismatic("guide", "ground", "slider.B"),
        AngleDriver("motor", "crank", ConstantSpeed(np.pi, 10)),
        Force("load", "slider.B", 1000.0, angle=np.pi),
    )
    return mbody.kinetostatics(machine, turn=True)


def pendulum():
    machine = Mechanism("pendulum", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.18, cg=(0.0, -0.4), points={"O": (0.0, 0.0)}),
        Revolute("O", "ground.O", "bob.O", friction=0.75, pin_radius=0.05),
        Gravity("g", y=-G),
    )
    machine.simulation = SimulationSettings(until=6.5, start={"bob": {"angle": 1.2}}, instants=66)
    return mbody.simulate(machine)


def angle_between(one, other):
    return abs(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))


# -- bars ----------------------------------------------------------------------------------------


def test_modes_begin_at_located_events():
    """A uniform disc rolls from v/(3 μ g) on, whatever instants are kept."""
    (row,), left_out = mode_rows(wheel())
    assert [span.mode for span in row.spans] == ["slip+", "roll", "slip-", "open"]
    assert left_out == 0
    # J = m r²/2: v − μ g t = r μ g t m r/J = 2 μ g t; to the tolerance of the motion
    assert row.spans[1].low == pytest.approx(2.0 / (3 * 0.15 * G), rel=1e-8)
    ends = [span.low for span in row.spans[1:]]
    assert ends == [span.high for span in row.spans[:-1]]
    assert (row.spans[0].low, row.spans[-1].high) == (0.0, 0.8)


def test_modes_over_the_angle_of_a_crank_change_where_the_rate_does():
    """The rod stands still against the ground never, but turns against the crank one way."""
    run = crank()
    rows = {row.name: row for row in mode_rows(run, np.degrees(run.driven("motor")[0]))[0]}
    assert [span.mode for span in rows["O"].spans] == ["slip+"]
    assert [span.mode for span in rows["A"].spans] == ["slip-"]
    assert rows["O"].spans[0].low == pytest.approx(180.0)


def test_bars_are_below_the_panels_on_the_same_axis():
    figure = mbody.plot(wheel(), "wheel.vx", "wheel.omega")
    *panels, bars, key = figure.axes
    assert len(panels) == 2
    assert bars.get_xlim() == panels[0].get_xlim()
    assert bars.get_position().y1 < panels[-1].get_position().y0
    assert key.get_position().y1 < bars.get_position().y0
    assert [label.get_text() for label in bars.get_yticklabels()] == ["road"]
    gids = [patch.get_gid() for patch in bars.patches]
    assert gids == [f"mode:road:{n}:{m}" for n, m in enumerate(["slip+", "roll", "slip-", "open"])]


def test_bars_read_without_colours():
    """Any two modes differ in hatching, or in lightness or outline without hatching."""
    looks = [(hatch, fill if not hatch else "") for _, fill, _, hatch in MODES.values()]
    assert len(set(looks)) == len(MODES)


def test_bars_are_left_out_where_they_would_be_wrong():
    run = wheel()
    assert len(mbody.plot(run, "wheel.vx", modes=False).axes) == 1
    assert len(mbody.plot(run, "wheel.vx", x="wheel.omega").axes) == 1
    smooth = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), turn=True)
    assert len(mbody.plot(smooth, "motor.effort").axes) == 1


def test_impacts_are_marked_on_the_bar():
    machine = Mechanism("ball", ground={"O": (0, 0)}, ground_shapes=FLOOR)
    machine.add(
        Body("ball", mass=1.0, inertia=0.1, points={"C": (0, 0)}),
        Contact("floor", "ground.floor", "ball.C", restitution=0.5),
        Gravity("g", y=-G),
    )
    machine.simulation = SimulationSettings(until=2.0, start={"ball": {"y": 1.0}}, instants=41)
    run = mbody.simulate(machine)
    (row,), _ = mode_rows(run)
    assert row.impacts[0] == pytest.approx(np.sqrt(2.0 / G), rel=1e-9)
    # each flight takes half as long as that before
    flights = np.diff(row.impacts[:4])
    assert flights == pytest.approx(2 * row.impacts[0] * np.array([0.5, 0.25, 0.125]), rel=1e-8)
    bars = mbody.plot(run, "ball.y").axes[1]
    (marks,) = [line for line in bars.lines if line.get_gid() == "impacts:floor"]
    assert len(marks.get_xdata()) <= len(row.impacts)
    assert marks.get_xdata()[0] == pytest.approx(row.impacts[0])


def test_many_bars_are_those_that_change_most():
    machine = Mechanism("row", ground={"O": (0, 0)}, ground_shapes=FLOOR)
    for n in range(18):
        machine.add(
            Body(f"b{n}", mass=1.0, inertia=0.1, points={"C": (0, 0)}),
            Contact(f"c{n}", "ground.floor", f"b{n}.C", friction=0.5),
        )
    machine.add(Gravity("g", y=-G))
    start = {f"b{n}": {"x": float(n), "y": 0.0 if n else 0.2} for n in range(18)}
    machine.simulation = SimulationSettings(until=0.5, start=start, instants=11)
    rows, left_out = mode_rows(mbody.simulate(machine))
    assert left_out == 2
    assert rows[0].name == "c0"
    assert [span.mode for span in rows[0].spans] == ["open", "stick"]
    assert [row.name for row in rows] == [f"c{n}" for n in range(16)]


# -- cones and circles ---------------------------------------------------------------------------


@pytest.mark.parametrize("instant", [3, 15])
def test_the_force_is_on_the_edge_of_the_cone_while_it_slides(instant):
    drawn = artists(mbody.draw(ladder(), instant, forces=True))
    tail, tip = arrow(drawn, "force:foot")
    corners = [
        line.get_xydata()
        for line in mbody.draw(ladder(), instant, forces=True).axes[0].lines
        if line.get_gid() == "cone:foot" and len(line.get_xydata()) == 3
    ]
    (edges,) = corners
    ways = edges[[0, 2]] - edges[1]
    # drawn to scale, to rounding of the arrow's ends
    assert min(angle_between(tip - tail, way) for way in ways) < 1e-7
    assert angle_between(*ways) == pytest.approx(2 * np.arctan(0.25), rel=1e-9)
    assert ways.sum(axis=0)[0] == pytest.approx(0.0, abs=1e-9)
    # its line goes through the place that touches
    away = edges[1] - tail
    u = (tip - tail) / np.hypot(*(tip - tail))
    assert abs(away[0] * u[1] - away[1] * u[0]) < 1e-9


def test_the_force_is_within_the_cone_of_rest_while_it_sticks():
    run = ladder(friction=2.0)
    assert run.mode("foot")[5] == "stick"
    figure = mbody.draw(run, 5, forces=True)
    drawn = artists(figure)
    tail, tip = arrow(drawn, "force:foot")
    lines = [line for line in figure.axes[0].lines if line.get_gid() == "cone:foot"]
    (edges,) = [line.get_xydata() for line in lines if len(line.get_xydata()) == 3]
    ways = edges[[0, 2]] - edges[1]
    assert angle_between(*ways) == pytest.approx(2 * np.arctan(2.4), rel=1e-9)
    inside = [angle_between(tip - tail, way) for way in ways]
    assert sum(inside) == pytest.approx(2 * np.arctan(2.4), rel=1e-9)
    assert min(inside) > 0.05


@pytest.mark.parametrize("radius", [0.0005, 0.01, 0.2])
def test_the_line_of_a_sliding_pin_touches_the_friction_circle(radius):
    figure = mbody.draw(crank(radius=radius), 40, forces=True)
    (circle,) = [p for p in figure.axes[0].patches if p.get_gid() == "friction:A"]
    scale = circle.radius / (0.1 * radius / np.sqrt(1.01))
    # round, and said in the key where it is not the true size
    digit = scale / 10 ** np.floor(np.log10(scale * (1 + 1e-9)))
    assert min(abs(digit - d) for d in (1, 2, 5)) < 1e-9
    texts = [text.get_text() for text in figure.axes[0].texts]
    said = [text for text in texts if text.startswith("friction circles")]
    assert said == ([] if abs(scale - 1) < 1e-9 else [f"friction circles {scale:.4g} : 1"])
    tail, tip = arrow(artists(figure), "force:F32")
    u, away = (tip - tail) / np.hypot(*(tip - tail)), circle.center - tail
    assert abs(away[0] * u[1] - away[1] * u[0]) == pytest.approx(circle.radius, rel=1e-6)


def test_the_line_of_a_pin_that_sticks_goes_through_its_circle():
    """At rest the force is vertical through the mass centre."""
    run = pendulum()
    assert run.mode("O")[-1] == "stick"
    figure = mbody.draw(run, len(run) - 1, forces=True)
    tail, tip = arrow(artists(figure), "force:F12")
    assert tail[0] == pytest.approx(run["bob"].x[-1], abs=1e-9)
    assert tip[0] == pytest.approx(tail[0], abs=1e-9)
    (circle,) = [p for p in figure.axes[0].patches if p.get_gid() == "friction:O"]
    assert abs(tail[0] - circle.center[0]) < circle.radius


# -- marks -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("part", "words"), [(0.2, "slides"), (0.62, "rolls"), (0.73, "slides"), (0.8, "open")]
)
def test_the_key_names_what_is_drawn(part, words):
    run = wheel()
    k = round(part * (len(run) - 1))
    texts = [text.get_text() for text in mbody.draw(run, k).axes[0].texts]
    assert words in texts
    assert not {"sticks", "slides", "rolls", "open"} - {words} & set(texts)


def test_a_sliding_mark_points_the_way_of_j():
    run = wheel()
    lines = [line for line in mbody.draw(run, 10).axes[0].lines if line.get_gid() == "contact:road"]
    tail, tip, _ = lines[0].get_xydata()
    assert tip[0] > tail[0]  # the wheel slides to the right over the table
    assert tip[1] == pytest.approx(tail[1])


def test_marks_move_with_the_place_that_touches():
    """Of a disc on an edge, two discs, a disc in a ring, and corners of a box."""
    machine = Mechanism(
        "places",
        ground={"O": (0, 0), "R": (5.0, 1.0), "D": (-5.0, 1.0)},
        ground_shapes=FLOOR
        | {"bowl": {"ring": "R", "radius": 0.8}, "ball": {"disc": "D", "radius": 0.5}},
    )
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    corners = {"A": (-0.2, -0.1), "B": (0.2, -0.1), "C": (0.2, 0.1), "D": (-0.2, 0.1)}
    box = {"box": {"polygon": ["A", "B", "C", "D"]}}
    for name in ("one", "two", "three"):
        machine.add(Body(name, mass=1.0, inertia=0.02, points={"C": (0, 0)}, shapes=rim))
    machine.add(
        Body("stone", mass=1.0, inertia=0.02, points=corners, shapes=box),
        Contact("road", "ground.floor", "one.rim", friction=0.3),
        Contact("groove", "two.rim", "ground.bowl", friction=0.3),
        Contact("hill", "ground.ball", "three.rim", friction=0.9),
        Contact("base", "stone.box", "ground.floor", friction=0.3),
        Gravity("g", y=-G),
    )
    lean = np.array([np.sin(0.2), np.cos(0.2)])
    start = {
        "one": {"x": 0.0, "y": 0.2, "vx": 1.0},
        "two": {"x": 5.0 + 0.6 * lean[0], "y": 1.0 - 0.6 * lean[1]},
        "three": {"x": -5.0 + 0.7 * lean[0], "y": 1.0 + 0.7 * lean[1]},
        "stone": {"x": 2.0, "y": 0.1, "vx": 1.0},
    }
    machine.simulation = SimulationSettings(until=0.3, start=start, instants=31, rtol=1e-12)
    run = mbody.simulate(machine)
    found = scene(run)
    checked = 0
    for contact in machine.contacts:
        for n, one in enumerate(contact_points_of(run, contact)):
            shapes = [
                shape
                for shape in found.shapes
                if shape.sign_condition
                and shape.sign_condition[0].startswith(f"touch:{contact.name}:{n}:")
                and shape.kind in ("circle", "polygon")
            ]
            for shape in shapes:
                there = sign_history(run, shape.sign_condition[0]) > 0
                axes = shape.carrier.axes(run)
                for k in np.flatnonzero(there):
                    middle = shape.carrier.in_world(shape.points, axes, k).mean(axis=0)
                    assert middle == pytest.approx(one.place[k], abs=1e-9)
                    checked += 1
    assert checked > 100
    # places by hand: below the disc, on the line of centres, at the corners
    road, groove, hill = (
        contact_points_of(run, machine[name])[0] for name in ("road", "groove", "hill")
    )
    zero = np.zeros(len(run))
    assert road.place == pytest.approx(np.column_stack([run["one"].x, zero]), abs=1e-9)
    for one, body, centre, far in (
        (groove, "two", (5.0, 1.0), 0.8),
        (hill, "three", (-5.0, 1.0), 0.5),
    ):
        way = np.column_stack([run[body].x, run[body].y]) - centre
        u = way / np.hypot(*way.T)[:, None]
        assert one.place == pytest.approx(centre + far * u, abs=1e-8)
        # the force on j: the ring is pressed outwards, as is the disc
        assert ((one.normal * u).sum(axis=1) > 0.999999).all()
        assert ((one.force * one.normal).sum(axis=1) > 0.0).all()
    base = [one for one in contact_points_of(run, machine["base"]) if one.closed.any()]
    assert len(base) == 2
    weight = sum(one.force for one in base)
    assert weight[:, 1] == pytest.approx(np.full(len(run), -G), rel=1e-8)
    assert sum(one.normal for one in base)[:, 1] == pytest.approx(np.full(len(run), -2.0))


def test_a_joint_that_sticks_is_marked_while_it_does():
    run = pendulum()
    names = [p.get_gid() for p in mbody.draw(run, len(run) - 1).axes[0].patches]
    assert "sticks:O" in names
    assert "sticks:O" not in [p.get_gid() for p in mbody.draw(run, 5).axes[0].patches]
    (mark,) = [s for s in scene(run).shapes if s.look.name == "sticks:O"]
    there = sign_history(run, mark.sign_condition[0]) > 0
    assert there.tolist() == [word == "stick" for word in run.mode("O")]


def test_open_contacts_are_dashed_and_ropes_hang():
    machine = Mechanism("dog", ground={"O": (0.0, 1.0), "P": (0, 0)})
    machine.add(
        Body("dog", mass=1.0, inertia=0.1, points={"collar": (0, 0)}),
        Rope("leash", "ground.O", "dog.collar", length=0.8),
        Gravity("g", y=-G),
    )
    start = {"dog": {"x": 0.3, "y": 0.6}}
    machine.simulation = SimulationSettings(until=1.0, start=start, instants=101)
    run = mbody.simulate(machine)
    taut = run.mode("leash").index("stick")
    for k, straight in ((0, False), (taut + 1, True)):
        lines = [x for x in mbody.draw(run, k).axes[0].lines if x.get_gid() == "rope:leash"]
        (rope,) = [line.get_xydata() for line in lines]
        assert (len(rope) == 2) == straight
        length = np.hypot(*np.diff(rope, axis=0).T).sum()
        # a parabola of so much sag is about as long as the rope
        assert length == pytest.approx(0.8, rel=1e-6 if straight else 0.05)
    figure = mbody.draw(wheel(), 80)
    (mark,) = [p for p in figure.axes[0].patches if p.get_gid() == "key:open"]
    assert mark.get_linestyle() != "-"


# -- pages and films -------------------------------------------------------------------------------


def test_a_page_has_bars_forces_and_marks():
    run = wheel()
    data = scene_data(scene(run), ["wheel.vx"])
    (bar,) = data["modes"]
    assert [mode for _, _, mode in bar["spans"]] == ["slip+", "roll", "slip-", "open"]
    # the edge of the table is a place of its own
    force, *_ = [one for one in data["forces"] if one["of"] == "road"]
    own, flat = run.reaction("road"), run["wheel"].x < 0.999
    peak = np.abs(own.fy).max()
    assert np.array(force["own"]["x"])[flat] == pytest.approx(own.fx[flat], abs=1e-6 * peak)
    assert np.array(force["own"]["y"])[flat] == pytest.approx(own.fy[flat], abs=1e-6 * peak)
    assert force["places"]["x"] == pytest.approx(run["wheel"].x, abs=1e-6)
    rolls = [word == "roll" for word in run.mode("road")]
    assert [value > 0 for value in data["senses"]["touch:road:0:roll"]] == rolls
    assert sum(rolls) > 5
    marks = {one["s"][0] for one in data["shapes"] if one["n"] == "contact:road"}
    assert {f"touch:road:0:{mode}" for mode in ("slip+", "roll")} <= marks


def test_films_show_marks_and_with_forces_cones():
    for show, there in ((("names",), False), (("names", "forces"), True)):
        film = FilmSet({"": wheel()}, 41, 480, show, None)
        names = [{shape.look.name for shape, _ in film.shapes(k)} for k in range(41)]
        assert all(("cone:road" in found) == there for found in names[:20])
        assert all("contact:road" in found for found in names[:20])
        assert "contact:road" not in names[-1]
        assert bool([one for one in film.arrows if one.text == "road"]) == there


# -- free bodies and reports -----------------------------------------------------------------------


@pytest.mark.parametrize("instant", [0, 10, 20])
def test_free_bodies_have_the_forces_of_contacts(instant):
    """Newton's laws of the ladder with the forces at both its ends."""
    run = ladder()
    free = mbody.free_body(run, "ladder", instant)
    causes = [one.cause for one in free]
    closed = [name for name in ("foot", "top") if run.mode(name)[instant] != "open"]
    assert causes == [*closed, "g", "inertia"]
    x, y = run["ladder"].x[instant], run["ladder"].y[instant]
    greatest = max(one.force for one in free)
    moment = sum(w.torque + (w.x - x) * w.fy - (w.y - y) * w.fx for w in free)
    # rounding of sums of a handful of terms
    assert abs(sum(w.fx for w in free)) < 1e-12 * greatest
    assert abs(sum(w.fy for w in free)) < 1e-12 * greatest
    assert abs(moment) < 1e-12 * greatest * 2.0


def test_free_bodies_have_the_pull_of_ropes():
    machine = Mechanism("hangs", ground={"O": (0.0, 1.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.1, points={"A": (0, 0)}),
        Rope("rope", "ground.O", "bob.A", length=0.8),
        Gravity("g", y=-G),
    )
    machine.simulation = SimulationSettings(until=0.1, start={"bob": {"y": 0.2}}, instants=3)
    pull, *_ = mbody.free_body(mbody.simulate(machine), "bob", 1)
    assert (pull.cause, pull.fy) == ("rope", pytest.approx(2.0 * G))
    assert (pull.x, pull.y) == pytest.approx((0.0, 0.2))


def reported(run, folder):
    mbody.report(run, without=["opinions"]).save(folder / "report.md")
    return (folder / "report.md").read_text()


def test_a_report_has_modes_shapes_and_contacts(tmp_path):
    text = reported(wheel(), tmp_path)
    assert "Contacts press and do not pull" in text
    assert "ground.top" in text and "wheel.rim" in text
    rows = [line for line in text.splitlines() if line.startswith("| road")]
    # 0.4531 s of 0.8 s slide, then 0.1149 s roll, and the rest, to a tenth of a percent
    assert any("56.6" in row and "14.4" in row for row in rows), rows


def test_a_report_of_rough_joints_says_where_friction_acts(tmp_path):
    text = reported(crank(), tmp_path)
    assert "Coulomb friction acts in O, A," in text
    assert "no friction, other than" not in text
