"""Pictures of contacts and frictional joints: bars of modes, marks, cones, friction circles,
ropes.
"""

import numpy as np
import pytest

import mbody
from mbody.laws import ConstantSpeed
from mbody.solution.contact_points import contact_points_of
from mbody.views.acting import sign_history
from mbody.views.page_data import scene_data
from mbody.views.scene import scene
from mbody.views.sketch import MODES, mode_rows
from tests.support.picture_reader import arrow, artists

G = 9.81
FLOOR = {"floor": {"line": {"point": "O"}}}


def wheel():
    """A disc that is thrown along a table: it slides, rolls, and falls over the edge."""
    machine = mbody.Mechanism(
        "wheel",
        ground={"A": (0.0, 0.0), "B": (1.0, 0.0)},
        ground_shapes={"top": {"segment": ("A", "B")}},
    )
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    machine.add(
        mbody.Body("wheel", mass=3.0, inertia=0.06, points={"C": (0.0, 0.0)}, shapes=rim),
        mbody.Contact("road", "ground.top", "wheel.rim", friction=0.15),
        mbody.Gravity("g", y=-G),
    )
    start = {"wheel": {"x": 0.1, "y": 0.2, "vx": 2.0}}
    machine.simulation = mbody.SimulationSettings(until=0.8, start=start, instants=81)
    return mbody.simulate(machine)


def ladder(friction=0.25):
    wall = {"wall": {"line": {"point": "O", "angle": -0.5 * np.pi}}}
    machine = mbody.Mechanism("ladder", ground={"O": (0, 0)}, ground_shapes=FLOOR | wall)
    points = {"foot": (-2.0, 0.0), "top": (2.0, 0.0)}
    machine.add(
        mbody.Body("ladder", mass=10.0, inertia=40.0 / 3.0, points=points),
        mbody.Contact(
            "foot", "ground.floor", "ladder.foot", friction=friction, static=1.2 * friction
        ),
        mbody.Contact("top", "ground.wall", "ladder.top", friction=0.15),
        mbody.Gravity("g", y=-G),
    )
    start = {"ladder": {"x": 2 * np.cos(1), "y": 2 * np.sin(1), "angle": np.pi - 1}}
    machine.simulation = mbody.SimulationSettings(until=1.0, start=start, instants=21)
    return mbody.simulate(machine)


def crank(radius=0.01, friction=0.1):
    rough = {"friction": friction, "pin_radius": radius}
    machine = mbody.Mechanism("press", ground={"O": (0, 0)})
    machine.add(
        mbody.Body("crank", points={"O": (0, 0), "A": (0.05, 0)}, guess=3.5),
        mbody.Body("rod", points={"A": (0, 0), "B": (0.2, 0)}, guess=0.1),
        mbody.Body("slider", points={"B": (0, 0)}),
        mbody.Revolute("O", "ground.O", "crank.O", **rough),
        mbody.Revolute("A", "crank.A", "rod.A", **rough),
        mbody.Revolute("B", "rod.B", "slider.B"),
        mbody.Prismatic("guide", "ground", "slider.B"),
        mbody.AngleDriver("motor", "crank", ConstantSpeed(np.pi, 10)),
        mbody.Force("load", "slider.B", 1000.0, angle=np.pi),
    )
    return mbody.kinetostatics(machine, turn=True)


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


def test_bars_read_without_colours():
    """Any two modes differ in hatching, or in lightness or outline without hatching."""
    looks = [(hatch, fill if not hatch else "") for _, fill, _, hatch in MODES.values()]
    assert len(set(looks)) == len(MODES)


def test_many_bars_are_those_that_change_most():
    machine = mbody.Mechanism("row", ground={"O": (0, 0)}, ground_shapes=FLOOR)
    for n in range(18):
        machine.add(
            mbody.Body(f"b{n}", mass=1.0, inertia=0.1, points={"C": (0, 0)}),
            mbody.Contact(f"c{n}", "ground.floor", f"b{n}.C", friction=0.5),
        )
    machine.add(mbody.Gravity("g", y=-G))
    start = {f"b{n}": {"x": float(n), "y": 0.0 if n else 0.2} for n in range(18)}
    machine.simulation = mbody.SimulationSettings(until=0.5, start=start, instants=11)
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


def test_marks_move_with_the_place_that_touches():
    """Of a disc on an edge, two discs, a disc in a ring, and corners of a box."""
    machine = mbody.Mechanism(
        "places",
        ground={"O": (0, 0), "R": (5.0, 1.0), "D": (-5.0, 1.0)},
        ground_shapes=FLOOR
        | {"bowl": {"ring": "R", "radius": 0.8}, "ball": {"disc": "D", "radius": 0.5}},
    )
    rim = {"rim": {"disc": "C", "radius": 0.2}}
    corners = {"A": (-0.2, -0.1), "B": (0.2, -0.1), "C": (0.2, 0.1), "D": (-0.2, 0.1)}
    box = {"box": {"polygon": ["A", "B", "C", "D"]}}
    for name in ("one", "two", "three"):
        machine.add(mbody.Body(name, mass=1.0, inertia=0.02, points={"C": (0, 0)}, shapes=rim))
    machine.add(
        mbody.Body("stone", mass=1.0, inertia=0.02, points=corners, shapes=box),
        mbody.Contact("road", "ground.floor", "one.rim", friction=0.3),
        mbody.Contact("groove", "two.rim", "ground.bowl", friction=0.3),
        mbody.Contact("hill", "ground.ball", "three.rim", friction=0.9),
        mbody.Contact("base", "stone.box", "ground.floor", friction=0.3),
        mbody.Gravity("g", y=-G),
    )
    lean = np.array([np.sin(0.2), np.cos(0.2)])
    start = {
        "one": {"x": 0.0, "y": 0.2, "vx": 1.0},
        "two": {"x": 5.0 + 0.6 * lean[0], "y": 1.0 - 0.6 * lean[1]},
        "three": {"x": -5.0 + 0.7 * lean[0], "y": 1.0 + 0.7 * lean[1]},
        "stone": {"x": 2.0, "y": 0.1, "vx": 1.0},
    }
    machine.simulation = mbody.SimulationSettings(until=0.3, start=start, instants=31, rtol=1e-12)
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


def test_open_contacts_are_dashed_and_ropes_hang():
    machine = mbody.Mechanism("dog", ground={"O": (0.0, 1.0), "P": (0, 0)})
    machine.add(
        mbody.Body("dog", mass=1.0, inertia=0.1, points={"collar": (0, 0)}),
        mbody.Rope("leash", "ground.O", "dog.collar", length=0.8),
        mbody.Gravity("g", y=-G),
    )
    start = {"dog": {"x": 0.3, "y": 0.6}}
    machine.simulation = mbody.SimulationSettings(until=1.0, start=start, instants=101)
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
