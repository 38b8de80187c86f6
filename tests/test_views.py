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
    AngleDriver,
    Body,
    ConstantSpeed,
    CoordinateDriver,
    CustomJoint,
    CustomLoad,
    Damper,
    Distance,
    Fixed,
    Force,
    Gear,
    Gravity,
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
    makers,
)
from mbody.analysis.asked import asked
from mbody.io.parts import force_names
from mbody.views import draw, plot, save
from mbody.views.backend import ENDINGS
from mbody.views.labels import Label, Places
from mbody.views.plotting import spread
from mbody.views.shapes import hull, rounded
from mbody.views.symbols import joint_symbol
from tests import pictures

ROOT = Path(__file__).parents[1]

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
    run = asked(gallery.load(name), "kinetostatics")
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


ODD = {
    planetary: {"wheel:mesh.i", "wheel:mesh.j", "wheel:ring.i", "torque:load", "driver:motor"},
    rack: {"rack:mesh", "wheel:mesh.j", "spring:k", "damper:c", "block:guide", "rail:guide"},
    wheel: {"wheel:road.j", "road:road", "spring:kt", "damper:ct", "gravity:g", "driver:m2"},
    yoke: {"block:g", "pin:A", "driver:ram"},
    rods: {"rod:rod", "wall:weld", "joint:held", "load:wind", "at:wind"},
    one: {"link:b", "cg:b"},
    chain: {"pin:j0", "pin:j59"},
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
        assert len(kept) < 60_000, name


def test_the_readme_shows_them():
    assert pictures.parts(pictures.README.read_text("utf-8"))[1] == pictures.table()
