"""What the page gets of a document: numbers of mbody itself, in every state without an error."""

import json
import math

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.edit.board_state import board_state, drag_state, modes_of, number_of
from mbody.edit.document import Document
from mbody.edit.places import Dragging
from tests.edit.test_board_server import FOURBAR

NAMES = pytest.mark.parametrize("name", gallery.names())
#: Takes seconds, and differs from a smaller one by nothing.
LARGE = "n_windows_40"


def opened(name):
    file = gallery.path(name)
    return Document(file.read_text("utf-8"), name, file.parent)


def state_of(document, unit=0.3):
    state = board_state(document, unit)
    return json.loads(json.dumps(state, allow_nan=False))


@NAMES
def test_numbers_are_those_of_mbody_itself(name):
    document, machine = opened(name), gallery.load(name)
    state = state_of(document)
    report = mbody.mobility(machine)
    assert state["free"]["count"] == report.freedom
    assert list(state["free"]["redundant"]) == list(report.redundant)
    assert state["fault"] is None and state["text"] == document.text
    if state["run"] is not None:
        own = mbody.kinetostatics(machine).data()
        assert state["run"] == own
        for joint, site in state["sites"].items():
            if joint in own["reactions"] and site["body"] != "ground":
                x, y, angle = state["bodies"][site["body"]]["pose"]
                u, v = site["arm"]
                place = x + u * math.cos(angle) - v * math.sin(angle)
                run = mbody.kinetostatics(machine)
                assert place == pytest.approx(float(run.reaction_point(joint)[0][0]), abs=1e-9)
    run = document.state.run
    for body, one in state["bodies"].items():
        x, y, angle = one["pose"]
        for point, (u, v) in one["points"].items():
            there = run.point(f"{body}.{point}")
            c, s = math.cos(angle), math.sin(angle)
            assert (x + c * u - s * v, y + s * u + c * v) == pytest.approx(
                (float(there.x[0]), float(there.y[0])), abs=1e-9 * run.system.length
            )


@NAMES
def test_rows_have_the_values_of_the_mechanism(name):
    """Of every number of the file that has a name in the mechanism, value and unit."""
    document = opened(name)
    state, system, count = state_of(document), mbody.assemble(gallery.load(name)), 0
    for row in state["rows"]:
        assert row["text"] in document.text and document.spans.raw(tuple(row["path"]))
        if row["value"] is None:
            continue
        try:
            key, value = number_of(document, state["rows"], row["path"], row["value"])
        except mbody.ModelError:
            continue
        count += 1
        assert value == pytest.approx(float(system.values[key]), rel=1e-9, abs=1e-12), row
    assert count > 0.3 * len(state["rows"]) or name == LARGE


HEAD = 'units = "mm-N-s"\n'
LINK = "[bodies.link1]\npoints = { A = [0, 0], B = [30, 0] }\n"
PINNED = "[ground]\npoints = { A = [0, 0] }\n[joints]\nA = { revolute = ['ground.A', 'link1.A'] }\n"
MOTOR = (
    '[drivers]\nmotor = { angle = "link1", law = { constant_speed = { value = 0, speed = 1 } } }\n'
)
STATES = {
    "nothing": ("", "Empty page"),
    "a unit": (HEAD, "Empty page"),
    "ground alone": (
        "[ground]\npoints = { A = [1, 2], B = { r = 3, angle = 90 } }\n",
        "Empty page",
    ),
    "a loose link": (HEAD + LINK, "Not joined to the ground: link1"),
    "a pendulum": (HEAD + LINK + PINNED, "1 motion still free"),
    "a motor": (HEAD + LINK + PINNED + MOTOR, "Driven: the motor decides"),
    "a motor of a loose link": (HEAD + LINK + MOTOR, "Not joined to the ground: link1"),
    "a structure": (HEAD + LINK + PINNED.replace("revolute", "fixed"), "Nothing can move"),
    "held twice": (
        FOURBAR.split("[drivers]")[0] + 'A_2 = { revolute = ["ground.A", "crank.A"] }\n',
        "Held twice",
    ),
    "dead centre": (FOURBAR.replace("[30, 0]", "[60, 0]"), "Driven"),
}


@pytest.mark.parametrize("name", STATES)
def test_every_half_drawn_state_is_one(name):
    text, say = STATES[name]
    document = Document(text)
    state = state_of(document)
    assert state["fault"] is None and say in state["free"]["say"]
    assert all(len(pin["xy"]) == 2 for pin in state["pins"])
    assert modes_of(document.state)["complete"] in (True, False)
    kinds = {one["kind"] for one in state["messages"]}
    assert ("trouble" in kinds) == (name == "dead centre"), state["messages"]


def test_a_text_with_mistakes_shows_the_last_good_picture():
    document = Document(FOURBAR)
    before = state_of(document)
    for text in (
        FOURBAR.replace("100 N", "100 NN"),
        "[bodies",
        FOURBAR.replace("coupler", "rod", 1),
    ):
        assert document.apply({"do": "text", "text": text}) is None
        state = state_of(document)
        assert state["fault"]["sentence"] and state["scene"] == before["scene"]
        (fault,) = (one for one in state["messages"] if one["kind"] == "fault")
        assert fault["text"] == state["fault"]["sentence"]


def test_deep_and_large_files_are_refused_in_a_sentence():
    for text in ("a = " + "[" * 5000 + "]" * 5000, "[x" + ".x" * 5000 + "]", "a" * 7_000_000):
        state = state_of(Document(text))
        assert 10 < len(state["fault"]["sentence"]) < 1000
        assert "Empty page" in state["free"]["say"]


def test_where_a_driver_can_go():
    state = state_of(
        Document(FOURBAR.replace("[30, 0]", "[60, 0]").replace("value = 60", "value = 70"))
    )
    low, high = state["drivers"]["motor"]["range"]
    # the triangle of the ground, the crank and the two others in line
    reach = math.degrees(math.acos((60**2 + 100**2 - 150**2) / (2 * 60 * 100)))
    assert high == pytest.approx(reach, abs=1e-6) and low < 70 < high
    assert state_of(Document(FOURBAR))["drivers"]["motor"]["range"] is None


def test_a_driver_that_does_not_go_round_has_curves_over_its_range():
    text = FOURBAR.replace("[30, 0]", "[60, 0]").replace("value = 60", "value = 70")
    state = state_of(Document(text))
    (plot,) = state["plots"]
    low, high = state["drivers"]["motor"]["range"]
    assert plot["xunit"] in ("deg", "°")
    assert (plot["x"][0], plot["x"][-1]) == pytest.approx(
        (low + 0.01 * (high - low), high - 0.01 * (high - low)), abs=1e-3
    )
    k = 120
    one = mbody.kinetostatics(mbody.from_toml(text), drive={"motor": [math.radians(plot["x"][k])]})
    assert plot["y"][k] == pytest.approx(float(one.effort("motor")[0]), rel=1e-4)


@pytest.mark.parametrize("guess", [80, -30])
def test_over_its_range_a_driver_stays_on_the_branch_of_the_drawing(guess):
    """With −30° the loops close on the other branch where the range begins."""
    text = FOURBAR.replace("[30, 0]", "[60, 0]").replace("value = 60", "value = 40")
    state = Document(text.replace("80 deg", f"{guess} deg")).state
    assert len(state.motion) == 181 and state.motion is state.motion
    b, c, d = (state.motion.point(place) for place in ("crank.B", "rocker.C", "rocker.D"))
    sides = (c.x - b.x) * (d.y - b.y) - (c.y - b.y) * (d.x - b.x)
    (bx, by), (cx, cy), (dx, dy) = map(state.place, ("crank.B", "rocker.C", "rocker.D"))
    home = (cx - bx) * (dy - by) - (cy - by) * (dx - bx)
    assert (np.sign(sides) == np.sign(home)).all() and abs(home) > 1.0


def test_a_link_half_drawn_leaves_a_driven_mechanism_where_it_was():
    board = opened("hoekens")  # with a question for a whole turn
    before = board_state(board, 0.3)
    assert board.apply({"do": "link", "at": [{"xy": [30, 90]}, {"xy": [60, 95]}]}) is None
    now = board_state(board, 0.3)
    assert now["run"] is None and now["free"]["count"] == 3
    for name, old in before["bodies"].items():
        assert now["bodies"][name]["pose"] == pytest.approx(old["pose"], abs=1e-9)
    places = [list(one["xy"]) for one in now["pins"] if one["places"][0].startswith("link1.")]
    assert places == [pytest.approx([30, 90]), pytest.approx([60, 95])]
    assert now["drivers"]["motor"]["value"] == pytest.approx(before["drivers"]["motor"]["value"])


def test_velocities_and_paths_are_those_of_the_links():
    document = opened("norton_fourbar")
    assert not {"velocities", "paths"} & state_of(document).keys()
    state = json.loads(json.dumps(board_state(document, 0.3, motions=True), allow_nan=False))
    # the crank is 5 in long, at 60 degrees with 25 rad/s
    speed = [-125 * math.sin(math.pi / 3), 125 * math.cos(math.pi / 3)]
    assert state["velocities"]["crank.A"] == pytest.approx(speed, rel=1e-6)
    assert state["velocities"]["coupler.A"] == pytest.approx(speed, rel=1e-6)
    path = state["paths"]["coupler.A"]
    assert np.hypot(path["x"], path["y"]) == pytest.approx(5.0, rel=1e-6)
    assert [path["x"][0], path["y"][0]] == pytest.approx([2.5, 5 * math.sin(math.pi / 3)])
    swing = state["paths"]["rocker.B"]
    assert np.hypot(np.subtract(swing["x"], 19), swing["y"]) == pytest.approx(10.0, rel=1e-6)


def test_results_and_labels_are_those_that_people_read():
    text = gallery.path("norton_fourbar").read_text("utf-8")
    document = Document(text + '\n[output_units]\ntorque = "N*m"\n', "fourbar")
    state = state_of(document)
    found = {name: (value, unit) for name, value, unit in state["results"]}
    (effort,) = state_of(opened("norton_fourbar"))["run"]["efforts"]["motor"]  # in lbf·in
    assert found["motor.effort"] == (pytest.approx(effort * 0.45359237 * 9.80665 * 0.0254), "N·m")
    fx, fy = (state["run"]["reactions"]["A"][key][0] for key in ("fx", "fy"))
    assert found["A.force"] == (pytest.approx(math.hypot(fx, fy)), "lbf")
    assert (state["units"]["torque"], state["units"]["length"]) == ("N·m", "in")
    labels = {tuple(row["path"]): row["label"] for row in state["rows"]}
    assert labels["bodies", "coupler", "points", "P", 0] == "P: x"
    assert labels["bodies", "coupler", "points", "B", 1] == "coupler.B: y"
    assert labels["loads", "F_P", "angle"] == "F_P: angle"


def test_arrows_stay_in_the_output_units_while_something_is_dragged():
    """Forces and velocities; lengths are those of the file."""
    text = gallery.path("norton_fourbar").read_text("utf-8")
    units = '\n[output_units]\nforce = "N"\nvelocity = "mm/s"\n'
    shown, plain = (Document(text + more, "fourbar") for more in (units, ""))
    drags = [drag_state(Dragging(one.state), 0.3, None, True) for one in (shown, plain)]
    states = [board_state(one, 0.3, True) for one in (shown, plain)]
    pound, inch = 0.45359237 * 9.80665, 25.4
    for one, other in (drags, states):
        for table in ("reactions", "loads"):
            for name, own in other["run"][table].items():
                for key in own.keys() & {"fx", "fy"}:  # a torque has none
                    size = pytest.approx(pound * own[key][0], rel=1e-8, abs=1e-8)
                    assert one["run"][table][name][key] == [size], name
        for place, v in other["velocities"].items():
            faster = [inch * part for part in v]
            assert one["velocities"][place] == pytest.approx(faster, rel=1e-6, abs=1e-3)
    assert drags[0]["poses"] == drags[1]["poses"]
    symbols = states[0]["units"]
    assert (symbols["force"], symbols["velocity"], symbols["length"]) == ("N", "mm/s", "in")
