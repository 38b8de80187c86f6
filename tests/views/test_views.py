"""Pictures: what is drawn is where the solution says, and files are written as requested."""

import math
import re
import subprocess
import sys

import numpy as np
import pytest

import mbody
from mbody import Body, Mechanism, Revolute, Torque, cli, gallery, kinematics, kinetostatics, makers
from mbody.analysis.driven.driven import analyse_at
from mbody.model.simulation import Instants
from mbody.summaries.text_table import force_names
from mbody.views import draw, plot, save
from mbody.views.labels import ENDINGS, FreePlaces, Label
from mbody.views.shapes import SMOOTH, cycle
from tests import pictures
from tests.support.paths import ROOT
from tests.support.picture_reader import arrow, artists, inside


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
        run = analyse_at(machine, "kinetostatics")
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
        assert f"{np.hypot(*force):.4g} lbf" in drawn[f"label:{name}"].get_text()
    applied = arrow(drawn, "force:F_P")
    angle = math.degrees(math.atan2(*(applied[1] - applied[0])[::-1])) % 360.0
    assert angle == pytest.approx(330.0)
    tail, tip = arrow(drawn, "key")
    told = [t.get_text() for t in drawn["key"].axes.texts if t.get_text() == "100 lbf"]
    assert told and np.hypot(*(tip - tail)) == pytest.approx(100.0 * scales["F12"])
    # rounding of the solution is the only difference of the scales
    assert max(scales.values()) == pytest.approx(min(scales.values()), rel=1e-9)


def test_arcs_turn_as_the_motor_and_the_torque(norton):
    def sign(run, name, about):
        drawn = artists(draw(run))
        points = drawn[name].get_xydata() - drawn[f"pin:{about}"].center
        (x, y), (u, v) = points[:-1].T, points[1:].T
        return np.sign((x * v - y * u).sum())

    assert sign(norton, "driver:motor", "O2") == 1.0 == sign(norton, "torque:T_4", "O4")
    back = makers.four_bar(1, 3, 2, 3.5, speed=-3.0)
    back.add(Torque("load", "rocker", value=-2.0))
    run = kinematics(back)
    assert sign(run, "driver:motor", "O2") == -1.0 == sign(run, "torque:load", "O4")


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


def test_labels_keep_clear():
    places = FreePlaces(1.0)
    places.stroke(np.array([(0.0, -50.0), (0.0, 50.0)]), 0.5)
    spots = [(float(x), 0.0, 0.0) for x in (0, 10, 60)]
    first, second = Label("some text", spots), Label("some text", spots)
    places.set([first, second])
    assert first.at == (60.0, 0.0) and not first.covers
    assert second.at != (60.0, 0.0) and second.covers


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
    # names are right of the curves and keep apart
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in names]
    assert min(box.x0 for box in boxes) >= panels["force [lbf]"].get_window_extent().x1
    assert not boxes[0].overlaps(boxes[1])
    assert max(box.x1 for box in boxes) < figure.bbox.x1


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


# -- the pictures of the gallery --------------------------------------------------------------


@pytest.fixture(scope="module")
def anew(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    return folder, pictures.make(folder)


@pytest.mark.slow
def test_the_pictures_are_those_of_the_gallery(anew):
    folder, made = anew
    assert {path.name for path in pictures.FOLDER.iterdir()} == {*made, *pictures.KEPT}
    for name, page in pictures.KEPT.items():
        shown = (pictures.FOLDER.parent / page).read_text("utf-8")
        assert f"pictures/{name}" in shown and name not in made
    for name in (one for one in made if one.endswith(".svg")):
        mine, kept = ((where / name).read_text("utf-8") for where in (folder, pictures.FOLDER))
        # the same things in the same order; digits may differ with matplotlib's version
        assert re.findall(r'id="([a-z]+:[^"]+)"', mine) == re.findall(r'id="([a-z]+:[^"]+)"', kept)
        stem = name.removesuffix(".svg")
        if stem in gallery.names():
            links = len(gallery.load(stem).bodies)
            # some 5 kB a link, with its joints and loads
            assert len(kept) < 70_000 + 2_500 * max(0, links - 20), name
        else:  # diagrams, polygons of vectors, eighteen linkages with their paths
            assert len(kept) < 140_000, name


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 1e4, 1e9])
def test_every_sign_of_a_label_is_drawn(size, caplog, tmp_path):
    """Numbers of any size are beside symbols, whose fonts lack thin spaces and raised digits."""
    masses = (0.1 * size, 0.3 * size, 0.2 * size)
    lengths = (1000.0, 3000.0, 2000.0, 3500.0)
    machine = mbody.makers.four_bar(*lengths, masses=masses, speed=10.0, units="mm-N-s")
    machine.add(mbody.Torque("T_4", "rocker", value=12345.0 * size))
    with caplog.at_level("WARNING", logger="matplotlib"):
        figure = mbody.draw(mbody.kinetostatics(machine), forces=True)
        figure.savefig(tmp_path / "four_bar.png")
    assert not [one.message for one in caplog.records if "glyph" in one.message]


@pytest.mark.parametrize("name", ["geneva_drive", "stick_slip", "sliding_ladder"])
def test_what_is_free_is_drawn_where_its_simulation_begins(name, tmp_path):
    """By the command, with drivers that leave a freedom or none, with forces and without."""
    machine = gallery.load(name)
    first = mbody.simulate(machine, times=[0.0])
    wanted = {path.get_gid(): path.get_extents().bounds for path in draw(first).axes[0].patches}
    drawn = draw(machine)
    found = {path.get_gid(): path.get_extents().bounds for path in drawn.axes[0].patches}
    assert found == wanted and len(found) > 1
    for more in ([], ["--forces"]):
        file = tmp_path / f"picture{len(more)}.svg"
        assert cli.main(["draw", name, "-o", str(file), *more]) == 0
        assert file.read_text(encoding="utf-8").count("<path") > 3
