"""Edits of a drawing: the file that each gives has the numbers that were asked for."""

import math
import random
import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import from_toml, gallery
from mbody.edit.document import Document
from mbody.files.toml_spans import value_at
from tests.support.cases import first_fast

MM = '# mine\nunits = "mm-N-s"  # plain numbers\n'


def drawn(*edits, text=MM):
    """A document after edits, each (kind, arguments)."""
    board = Document(text)
    for kind, arguments in edits:
        fault = board.apply({"do": kind, **arguments})
        assert fault is None, (kind, arguments, fault)
    return board


def at(*places):
    """Places of a link: pairs are new, text is pinned to."""
    return {"at": [{"on": p} if isinstance(p, str) else {"xy": p} for p in places]}


FOUR_BAR = (
    ("link", at((0, 0), (20, 35))),
    ("link", at("link1.B", (90, 60), (55, 90))),
    ("link", at("link2.C", (80, 0))),
    ("ground", {"place": "link1.A"}),
    ("ground", {"place": "link3.E"}),
    ("motor", {"body": "link1", "rate": "90 rpm"}),
    ("force", {"place": "link2.D", "force": "100 N", "angle": 270}),
    ("torque", {"body": "link3", "torque": "2 N*m"}),
    ("mass", {"body": "link2", "mass": "0.4 kg"}),
)
FOUR_BAR_BY_HAND = """
units = "mm-N-s"
[ground]
points = { O2 = [0, 0], O4 = [80, 0] }
[bodies]
crank = { points = { A = [0, 0], B = [20, 35] } }
coupler.mass = "0.4 kg"
coupler.cg = [55, 185/3]
coupler.points = { B = [20, 35], C = [90, 60], P = [55, 90] }
rocker = { points = { C = [90, 60], D = [80, 0] } }
[joints]
O2 = { revolute = ["ground.O2", "crank.A"] }
B = { revolute = ["crank.B", "coupler.B"] }
C = { revolute = ["coupler.C", "rocker.C"] }
O4 = { revolute = ["ground.O4", "rocker.D"] }
[drivers]
motor = { angle = "crank", law = { constant_speed = { value = 0, speed = "90 rpm" } } }
[loads]
F = { force = "100 N", at = "coupler.P", angle = 270 }
T = { torque = "2 N*m", body = "rocker" }
""".replace("185/3", "61.66666666666667")


def turn_of(text):
    return mbody.kinetostatics(mbody.assemble(from_toml(text)), turn=True)


def same_forces(board, by_hand, names):
    """Reactions and the motor's effort over a turn, of two files."""
    one, other = turn_of(board.text), turn_of(by_hand)
    scale = max(float(np.abs(other.reaction(hand).fx).max()) for hand in names.values())
    for own, hand in names.items():
        a, b = one.reaction(own), other.reaction(hand)
        assert_allclose([a.fx, a.fy], [b.fx, b.fy], atol=1e-9 * scale)
    a, b = one.effort("motor"), other.effort("motor")
    assert_allclose(a, b, atol=1e-9 * float(np.abs(b).max()))


def test_a_sixbar_with_a_multi_joint():
    board = drawn(
        *FOUR_BAR,
        ("link", at("link2.C", (150, 100))),
        ("link", at("link4.F", (170, 0))),
        ("ground", {"place": "link5.G"}),
        ("force", {"place": "link5.F", "force": 30, "angle": 180}),
    )
    assert board.state.mobility.freedom == 0
    assert ["link2.C", "link3.C", "link4.C"] in board.groups()
    more = (
        FOUR_BAR_BY_HAND.replace("O4 = [80, 0]", "O4 = [80, 0], O6 = [170, 0]").replace(
            "[joints]",
            "rod = { points = { C = [90, 60], F = [150, 100] } }\n"
            "out = { points = { F = [150, 100], O = [170, 0] } }\n[joints]\n"
            'C2 = { revolute = ["coupler.C", "rod.C"] }\nF6 = { revolute = ["rod.F", "out.F"] }\n'
            'O6 = { revolute = ["ground.O6", "out.O"] }',
        )
        + '\nFF = { force = 30, at = "out.F", angle = 180 }\n'
    )
    same_forces(board, more, {"A": "O2", "B": "B", "E": "O4", "F": "F6", "G": "O6", "C_2": "C2"})


def test_a_gear_pair_and_a_rack():
    board = drawn(
        ("link", at((0, 0), (20, 0))),
        ("link", at((60, 0), (60, 30))),
        ("ground", {"place": "link1.A"}),
        ("ground", {"place": "link2.C"}),
        (
            "joint",
            {
                "kind": "gear",
                "name": "mesh",
                "fields": {"places": ["link1.A", "link2.C"], "radius_i": "20 mm", "radius_j": "40"},
            },
        ),
        ("motor", {"body": "link1"}),
        ("torque", {"body": "link2", "torque": "3 N*m"}),
    )
    assert tomllib.loads(board.text)["joints"]["mesh"] == {
        "gear": ["link1.A", "link2.C"],
        "radius_i": "20 mm",
        "radius_j": 40,
    }
    effort = turn_of(board.text).effort("motor")
    assert_allclose(effort, 1500.0, rtol=1e-12)  # N·mm: half of 3 N·m, of the other sign of turning


def test_a_cam_with_its_follower():
    segments = [
        {"dwell": "90 deg"},
        {"rise": {"shape": "cycloidal", "height": 8, "start": 0, "duration": "90 deg"}},
        {"dwell": "90 deg"},
        {"rise": {"shape": "3-4-5", "height": -8, "start": 0, "duration": "90 deg"}},
    ]
    board = drawn(
        ("link", at((0, 0), (10, 0))),
        ("link", at((0, 30), (0, 60))),
        ("ground", {"place": "link1.A"}),
        (
            "joint",
            {
                "kind": "prismatic",
                "fields": {
                    "prismatic": [
                        {"body": "ground", "angle": 90},
                        {"body": "link2", "point": "C", "angle": 90},
                    ]
                },
            },
        ),
        (
            "joint",
            {
                "kind": "cam_follower",
                "name": "cam",
                "fields": {
                    "cam_follower": [{"body": "link1", "point": "A", "angle": 90}, "link2.C"],
                    "base_radius": 25,
                    "roller": 5,
                    "profile": {"cam": {"period": "360 deg", "segments": segments}},
                },
            },
        ),
        ("motor", {"body": "link1"}),
        (
            "load",
            {
                "kind": "spring",
                "fields": {
                    "spring": [{"xy": [0, 200]}, "link2.D"],
                    "stiffness": 2,
                    "free_length": 170,
                },
            },
        ),
    )
    hand = """
    units = "mm-N-s"
    [bodies]
    shaft = {}
    follower = { points = { T = [0, 30] } }
    [joints]
    O = { revolute = ["ground", "shaft"] }
    guide = { prismatic = [{ body = "ground", angle = 90 }, { body = "follower", angle = 90 }] }
    [joints.cam]
    cam_follower = [{ body = "shaft", angle = 90 }, "follower"]
    base_radius = 25
    roller = 5
    profile = { cam = { period = "360 deg", segments = SEGMENTS } }
    [drivers.motor]
    angle = "shaft"
    law = { constant_speed = { value = 0, speed = "60 rpm" } }
    [loads.spring]
    spring = [{ body = "ground", point = [0, 200] }, "follower.T"]
    stiffness = 2
    free_length = 170
    """.replace("SEGMENTS", str(segments).replace("': ", "' = ").replace("'dwell'", "dwell"))
    same_forces(board, hand, {"A": "O", "cam": "cam"})


# -- moving ----------------------------------------------------------------------------------------


@first_fast("name", gallery.names(), 6)
def test_a_moved_point_is_where_it_was_asked(name):
    """By `kinematics` of the text that would be saved; where not, the edit says so."""
    path = gallery.path(name)
    text = path.read_bytes().decode()
    board = Document(text, path.name, path.parent)
    size = float(board.state.system.length)
    for group in board.groups()[:: max(1, len(board.groups()) // 4)]:
        x, y = board.state.place(group[0])
        goal = x + 0.01 * size, y + 0.006 * size
        edit = {"do": "move", "place": group[0], "xy": goal, "grain": 1e-6 * size}
        if (fault := board.apply(edit)) is not None:
            assert board.text == text and (fault.element or fault.sentence), fault
            continue
        machine = from_toml(board.text, folder=path.parent)
        own = Document(board.text, path.name, path.parent).state  # read anew
        where, second = own.place(group[0]), machine.drivers and machine.ask is None
        if math.dist(where, goal) > 1e-5 * size:
            assert "came to" in board.remark
        elif second and not own.mobility.freedom and not group[0].startswith("ground"):
            here = mbody.kinematics(machine, t=[0.0]).point(group[0])
            assert math.dist((here.x[0], here.y[0]), goal) < 1e-5 * size
        assert board.undo() and board.text == text


def test_a_point_moves_with_all_that_is_pinned_there():
    board = drawn(*FOUR_BAR, ("move", {"place": "link3.C", "xy": [95.27, 61.3], "grain": 0.01}))
    tree = tomllib.loads(board.text)
    for body in ("link2", "link3"):
        assert tree["bodies"][body]["points"]["C"] == [95.27, 61.3]
    assert tree["bodies"]["link2"]["points"]["B"] == [20, 35] and board.remark == ""
    run = mbody.kinematics(mbody.assemble(from_toml(board.text)))
    assert_allclose([run["link3"].x[0], run["link3"].angle[0]], [0, 0], atol=1e-9)


UNITS = """
units = "mm-N-s"
[parameters]
a = "3 cm"
half = "b/2"
b = "0.08 m"
[ground]
points = { O = [0, 0] }
[bodies]
crank = { points = { A = ["40 mm", 0], P = { r = "5 cm", angle = "0.5 rad" }, Q = ["a", "half"] } }
[joints]
O = { revolute = ["ground.O", "crank"] }
[drivers]
motor = { angle = "crank", law = 0 }
"""


@pytest.mark.parametrize(
    ("place", "xy", "lines"),
    [
        ("crank.A", [41.5, 2.25], ['A = ["41.5 mm", 2.25]']),
        ("crank.P", [0, 60], ['P = { r = "6 cm", angle = "1.5708 rad" }']),
        ("crank.Q", [35, 45], ['a = "3.5 cm"', 'b = "0.09 m"', 'Q = ["a", "half"]']),
    ],
)
def test_numbers_keep_their_units_and_formulas(place, xy, lines):
    board = drawn(("move", {"place": place, "xy": xy, "grain": 0.01}), text=UNITS)
    for line in lines:
        assert line in board.text, board.text
    assert_allclose(board.state.place(place), xy, atol=0.01)
    changed = [
        n
        for n, (a, b) in enumerate(zip(UNITS.split("\n"), board.text.split("\n"), strict=True))
        if a != b
    ]
    assert len(changed) == (2 if place == "crank.Q" else 1)


def test_the_assembly_mode_stays():
    """A large move keeps the side of the dyad on which it was drawn."""
    board = drawn(*FOUR_BAR[:6])
    for goal in ((120, 20), (75, 42), (60, 90), (130, 60)):
        assert board.apply({"do": "move", "place": "link2.C", "xy": goal}) is None
        assert_allclose(board.state.place("link3.C"), goal, atol=1e-6)


# -- other edits -----------------------------------------------------------------------------------


def test_a_slot_in_a_link_and_a_motor_between_links():
    board = drawn(
        ("link", at((0, 0), (0, 40))),
        ("link", at((-20, 30), (40, 30))),
        ("ground", {"place": "link1.A"}),
        ("ground", {"place": "link2.C"}),
        ("slot", {"place": "link1.B", "body": "link2", "angle": 0}),
    )
    slot = tomllib.loads(board.text)["joints"]["slot1"]["pin_slot"]
    assert slot == [{"body": "link2", "point": [0, 40], "angle": 0}, "link1.B"]
    assert board.state.mobility.freedom == 1
    arms = drawn(
        ("link", at((0, 0), (0, 40))),
        ("link", at("link1.B", (30, 40))),
        ("ground", {"place": "link1.A"}),
        ("motor", {"joint": "B", "rate": "30 rpm"}),
    )
    driver = tomllib.loads(arms.text)["drivers"]["motor"]
    assert (driver["angle"], driver["relative_to"]) == ("link2", "link1")
    run = mbody.kinematics(from_toml(arms.text + "\n[drivers.hold]\nangle = 'link1'\n"), t=[0, 0.5])
    assert_allclose(run["link2"].angle, [0, math.pi / 2], atol=1e-9)
    slide = drawn(
        ("link", at((5, 2), (30, 40))),
        ("slider", {"place": "link1.A", "angle": 30}),
        ("motor", {"joint": "slot1"}),
        ("motor", {"body": "link1", "rate": "0 rpm"}),
    )
    run = mbody.kinematics(from_toml(slide.text), t=[0, 0.1])
    assert_allclose(np.hypot(np.diff(run["link1"].x), np.diff(run["link1"].y)), 10, rtol=1e-9)


def test_fields_as_they_are_typed():
    board = drawn(*FOUR_BAR)
    for path, text, value in (
        (["bodies", "link2", "mass"], "0.50", 0.5),
        (["bodies", "link2", "points", "C", "0"], "90.5 mm", "90.5 mm"),
        (["name"], "42", "42"),
        (["bodies", "link1", "guess"], "{ angle = 3 }", {"angle": 3}),
        (["gravity", "y"], "-9.81 m/s^2", "-9.81 m/s^2"),
        (["parameters", "w"], "12 N", "12 N"),
        (["loads", "F1", "force"], "2*w", "2*w"),
        (["output_units", "force"], "kN", "kN"),
    ):
        assert board.apply({"do": "set", "path": path, "text": text}) is None, (path, text)
        own = tuple(int(key) if key.isdigit() else key for key in path)
        assert value_at(tomllib.loads(board.text), own) == value
    assert "mass   = 0.50\n" in board.text  # as it was typed
    assert board.apply({"do": "unset", "path": ["bodies", "link2", "mass"]}) is None
    assert "mass" not in tomllib.loads(board.text)["bodies"]["link2"]


@pytest.mark.parametrize(
    "name", ["mud_pump_sixbar", "quick_return", "flyball_governor", "v_twin", "mud_pump_motor"]
)
def test_everything_has_another_name(name):
    """All bodies, joints, drivers, loads, parameters and points are renamed: equal results."""
    path = gallery.path(name)
    board = Document(path.read_text("utf-8"), path.name, path.parent)
    before = board.state
    for section in (
        "bodies",
        "joints",
        "drivers",
        "loads",
        "parameters",
        "states",
        "inputs",
        "measures",
    ):
        for old in list(board.tree.get(section, {})):
            edit = {
                "do": "rename",
                "path": [section, old],
                "to": f"{old}_new" if section[0] in "bjdl" else f"{old}_{section}",
            }
            fault = board.apply(edit)
            assert fault is None, (section, old, fault)
    for body in list(board.tree["bodies"]):
        for point in list(board.tree["bodies"][body].get("points", {})):
            edit = {"do": "rename", "path": ["points", f"{body}.{point}"], "to": f"{point}x"}
            assert board.apply(edit) is None
    state = board.state
    for body in before.mechanism.bodies:
        assert_allclose(state.pose(f"{body.name}_new"), before.pose(body.name), atol=1e-9)
    if before.turn is not None:
        for joint in before.mechanism.joints:
            a, b = before.turn.reaction(joint.name), state.turn.reaction(f"{joint.name}_new")
            assert_allclose(
                b.fx, a.fx, rtol=1e-9, atol=1e-9 * float(np.nanmax(np.abs(a.fx), initial=1e-300))
            )
    assert [one.count("#") for one in board.text.split("\n")] == [
        one.count("#") for one in path.read_text("utf-8").split("\n")
    ]
    while board.undo():
        pass
    assert board.text == path.read_text("utf-8")


def test_deleted_with_what_refers_to_it():
    board = drawn(
        *FOUR_BAR,
        ("set", {"path": ["measures", "m"], "text": "B.force"}),
        ("set", {"path": ["parameters", "w"], "text": "2"}),
        ("set", {"path": ["loads", "F1", "force"], "text": "w*3 N"}),
    )
    assert board.apply({"do": "delete", "names": [["parameters", "w"]]}) is None
    assert "F1" not in board.tree["loads"]
    assert board.undo()
    assert board.apply({"do": "delete", "names": [["points", "link2.D"]]}) is None
    assert "F1" not in board.tree["loads"] and "D" not in board.tree["bodies"]["link2"]["points"]
    assert board.apply({"do": "delete", "names": [["bodies", "link1"]]}) is None
    tree = board.tree
    assert {*tree["joints"]} == {"C", "E"} and tree["drivers"] == {} and tree["measures"] == {}
    assert [*tree["ground"]["points"]] == ["E"] and {*tree["bodies"]} == {"link2", "link3"}
    gone = drawn(
        ("delete", {"names": [["bodies", f"link{n}"] for n in (1, 2, 3)]}),
        text=drawn(*FOUR_BAR).text,
    )
    assert gone.state.system is None and gone.fault is None and gone.text.startswith(MM)


def test_a_number_becomes_a_parameter():
    board = drawn(
        *FOUR_BAR,
        ("parameter", {"path": ["loads", "F1", "force"], "name": "load"}),
        ("parameter", {"path": ["bodies", "link2", "points", "C", 0], "name": "far"}),
    )
    assert board.tree["parameters"] == {"load": "100 N", "far": 90}
    assert board.tree["bodies"]["link2"]["points"]["C"] == ["far", 60]
    same_forces(board, FOUR_BAR_BY_HAND, {"A": "O2", "B": "B", "C": "C", "E": "O4"})


LINKS = [["bodies", "link1"], ["bodies", "link2"], ["bodies", "link3"]]


def test_a_copy_moves_as_its_original():
    board = drawn(*FOUR_BAR, ("copy", {"names": LINKS, "by": [300, 20]}))
    assert board.state.mobility.freedom == 0 and len(board.tree["joints"]) == 8
    run = mbody.kinematics(from_toml(board.text), t=np.linspace(0, 0.5, 7))
    copies = [name for name in board.tree["bodies"] if ["bodies", name] not in LINKS]
    for (_, name), copy in zip(LINKS, copies, strict=True):
        one, two = run[name], run[copy]
        assert_allclose(two.x - one.x, 300, atol=1e-9)
        assert_allclose(two.y - one.y, 20, atol=1e-9)


def test_a_copy_has_its_contacts_and_formulas():
    path = gallery.path("rolling_ball")
    board = Document(path.read_text("utf-8"), path.name, path.parent)
    (ball,) = board.tree["bodies"]
    fields = {"force": f"0.1*{ball}.vx*(1 N*s/m)", "at": ball}
    for edit in (
        {"do": "load", "kind": "force", "fields": fields, "name": "drag"},
        {"do": "copy", "names": [["bodies", ball]], "by": [1, 0]},
    ):
        assert board.apply(edit) is None
    other = next(name for name in board.tree["bodies"] if name != ball)
    for section in ("contacts", "loads"):
        first, second = map(str, board.tree[section].values())
        assert second == first.replace(ball, other) != first


def test_a_mirror_image_moves_as_one():
    """Driven as the mirror image of its motor."""
    board = drawn(
        *FOUR_BAR[:5],
        ("mirror", {"names": LINKS, "line": [[200, 0], [200, 10]]}),
        ("motor", {"body": "link1"}),
    )
    first, second, *_ = (
        name for name in board.tree["bodies"] if name not in ("link1", "link2", "link3")
    )
    angle = math.degrees(board.state.pose(first)[2])
    text = board.text + f'\n[drivers.other]\nangle = "{first}"\n'
    text += f'law = {{ constant_speed = {{ value = {angle}, speed = "-60 rpm" }} }}\n'
    run = mbody.kinematics(from_toml(text), t=np.linspace(0, 0.3, 7))
    one, two = run.point("link2.D"), run.point(f"{second}.D")
    assert_allclose(two.x, 400 - one.x, atol=1e-8)
    assert_allclose(two.y, one.y, atol=1e-8)


# -- random edits ----------------------------------------------------------------------------------


def random_edit(board, chance):
    """An edit of any kind on what is there, some of them impossible."""
    places = [place for group in board.groups() for place in group]
    bodies = [*board.tree.get("bodies", {})]
    joints = [*board.tree.get("joints", {})]
    own = [one for one in places if not one.startswith("ground.")]

    def spot():
        if places and chance.random() < 0.6:
            return {"on": chance.choice(places)}
        return {"xy": [chance.randint(-50, 50), chance.randint(-50, 50)]}

    kinds = [{"do": "link", "at": [spot() for _ in range(chance.choice((2, 2, 3)))]}]
    if own:
        place, body, xy = (
            chance.choice(own),
            chance.choice(bodies),
            [chance.uniform(-50, 50) for _ in "xy"],
        )
        point = place.partition(".")
        kinds += [
            {"do": "ground", "place": place},
            {"do": "move", "place": place, "xy": xy, "grain": 0.1},
            {"do": "move", "place": chance.choice(places), "xy": xy, "along": True},
            {"do": "force", "place": place, "force": "10 N", "angle": chance.randint(0, 360)},
            {"do": "motor", "body": body},
            {"do": "point", "body": body, "xy": xy},
            {"do": "mass", "body": body, "mass": "2 kg"},
            {"do": "unground", "place": place},
            {"do": "delete", "names": [["bodies", body]]},
            {"do": "delete", "names": [["points", place]]},
            {"do": "rename", "path": ["bodies", body], "to": f"n{chance.randint(0, 99)}"},
            {"do": "rename", "path": ["points", place], "to": chance.choice("ABCPQ")},
            {"do": "slider", "place": place, "angle": 30},
            {"do": "join", "place": place, "to": chance.choice(places)},
            {
                "do": "set",
                "path": ["bodies", point[0], "points", point[2], chance.choice((0, 1))],
                "text": chance.choice(("3", "4.5 mm", "2*zz", "", "[1]", "true")),
            },
            {"do": "copy", "names": [["bodies", body]], "by": [7, 9]},
            {
                "do": "mirror",
                "names": [["bodies", one] for one in bodies[:3]],
                "line": [[60, 0], [70, 30]],
            },
            {
                "do": "parameter",
                "path": ["bodies", point[0], "points", point[2], 0],
                "name": f"p{chance.randint(0, 9)}",
            },
            {
                "do": "load",
                "kind": "spring",
                "fields": {"spring": [place, {"xy": xy}], "stiffness": 2, "free_length": 5},
            },
            {"do": "guess", "body": body},
            {
                "do": "units",
                "units": chance.choice(("SI", "mm-N-s", "ell")),
                "convert": chance.random() < 0.5,
            },
        ]
    if joints:
        kinds += [
            {"do": "motor", "joint": chance.choice(joints)},
            {"do": "delete", "names": [["joints", chance.choice(joints)]]},
            {
                "do": "rename",
                "path": ["joints", chance.choice(joints)],
                "to": f"j{chance.randint(0, 99)}",
            },
        ]
    return chance.choice(kinds)


def storm(seed, count, text=MM):
    """Random edits: refused is unchanged, the state is that of the text, undo is exact."""
    chance, board, made = random.Random(seed), Document(text), 0
    for _ in range(count):
        before = board.text
        edit = random_edit(board, chance)
        fault = board.apply(edit)
        if fault is not None:
            assert (
                board.text == before and fault.sentence and "does not fit" not in fault.sentence
            ), (edit, fault, before)
        elif board.text != before:
            made += 1
            assert board.fault is None
        if chance.random() < 0.1 and board.undo():
            made -= 1
    assert "# mine" in board.text
    again = Document(board.text)
    for body in board.tree.get("bodies", {}):
        assert_allclose(again.state.pose(body), board.state.pose(body), atol=1e-12)
    last, steps = board.text, len(board.done)
    while board.undo():
        pass
    assert board.text == text
    for _ in range(steps):
        board.redo()
    assert board.text == last
    return made


def test_random_edits():
    assert storm(1, 30) > 8


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_many_random_edits(seed):
    assert storm(seed, 100) > 25
