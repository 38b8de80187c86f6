"""Files of other programs: the imported motion against closed forms and against MuJoCo."""

import json
import math

import numpy as np
import pytest

import mbody
from mbody import ModelError
from mbody.exchange import import_model

#: Closed forms and the engine differ by rounding, some 1e-15 of the size, and by what loops are
#: closed to, 1e-12.
EXACT = 1e-10
T = np.linspace(0.0, 2.0, 41)

FOUR_BAR = """\
ground,input,R,100,100,0,tfft
input,coupler,R,150,180,0,tfff
coupler output R 420.5 330.25 0.000 tfff
output,gnd,r,500,100,0,tfff
coupler,R,300,400,0,tfff
"""


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def joined(first, a, second, b, near):
    """The place at distances a and b of two places, on the side of a third: a dyad of pins."""
    d = second - first
    apart = np.hypot(d[:, 0], d[:, 1])
    along = (a * a - b * b + apart**2) / (2 * apart)
    across = np.sqrt(a * a - along**2)
    u = d / apart[:, None]
    n = np.column_stack([-u[:, 1], u[:, 0]])
    side = np.sign((near - first[0]) @ n[0])
    return first + along[:, None] * u + side * across[:, None] * n


def turned(centre, place, angles):
    """A place turned about a centre by angles from its drawn position."""
    x, y = np.subtract(place, centre)
    c, s = np.cos(angles), np.sin(angles)
    return np.asarray(centre) + np.column_stack([c * x - s * y, s * x + c * y])


def at(run, point):
    history = run.point(point)
    return np.column_stack([history.x, history.y])


def four_bar(centres, crank, pin, angles):
    """Crank pin and coupler pin of a four-bar drawn at places, its crank turned by angles."""
    a = turned(centres[0], crank, angles)
    fixed = np.broadcast_to(np.asarray(centres[1], float), a.shape)
    lengths = math.dist(crank, pin), math.dist(centres[1], pin)
    return a, joined(a, lengths[0], fixed, lengths[1], np.asarray(pin, float))


def carried(a, b, drawn, place):
    """A point of a link whose two pins go from drawn places along two paths."""
    (ax, ay), (bx, by), (px, py) = (*drawn, place)
    z = complex(px - ax, py - ay) / complex(bx - ax, by - ay)
    along = (b - a) @ np.array([1, 1j])
    moved = a @ np.array([1, 1j]) + along * z
    return np.column_stack([moved.real, moved.imag])


def test_pmks_lines_are_a_four_bar(tmp_path):
    made = import_model(write(tmp_path / "bars.txt", FOUR_BAR))
    assert made.form == "PMKS" and made.mechanism.name == "bars"
    run = mbody.kinematics(made.mechanism, T)
    a, b = four_bar([(100, 100), (500, 100)], (150, 180), (420.5, 330.25), T)
    assert at(run, "coupler.B") == pytest.approx(a, abs=EXACT * 500)
    assert at(run, "output.C") == pytest.approx(b, abs=EXACT * 500)
    tracer = carried(a, b, [(150, 180), (420.5, 330.25)], (300, 400))
    assert at(run, "coupler.E") == pytest.approx(tracer, abs=EXACT * 500)
    assert any("no unit of length" in note for note in made.notes)


def test_pmks_address_and_json_are_the_same_mechanism(tmp_path):
    lines = "|".join(FOUR_BAR.strip().splitlines())
    address = f"https://example.org/pmks?set=s3|f0.5&mech={lines.replace(' ', '%20')}|"
    places = {"ground,input": (100, 100), "input,coupler": (150, 180)}
    places |= {"coupler,output": (420.5, 330.25), "output,ground": (500, 100)}
    places |= {"coupler": (300, 400)}
    joints = [
        {"X": x, "Y": y, "Angle": 0.0, "TypeOfJoint": "R", "Links": links.split(",")}
        for links, (x, y) in places.items()
    ]
    data = {"Joints": joints, "Name": "bars", "DrivingIndex": 0, "InputSpeed": 3.0}
    data |= {"GridSize": 16, "Author": "me"}
    file = write(tmp_path / "bars.pmks", json.dumps(data))
    first, second = import_model(address), import_model(file)
    runs = [mbody.kinematics(made.mechanism, T) for made in (first, second)]
    assert np.array_equal(at(runs[0], "coupler.E"), at(runs[1], "coupler.E"))
    assert runs[0]["input"].omega == pytest.approx(3.0, rel=EXACT)
    assert any("'Author'" in note for note in second.notes)
    assert not any("GridSize" in note for note in second.notes)


def test_pmks_slides_turn_and_push(tmp_path):
    # an offset slider-crank: x = r cos φ + √(l² − (r sin φ − h)²)
    text = "ground,input,R,0,0\ninput,rod,R,0,10\nrod,slider,R,12,2\nground,slider,P,12,2,0\n"
    run = mbody.kinematics(import_model(write(tmp_path / "a.txt", text)).mechanism, T)
    phi, rod = math.pi / 2 + T, math.hypot(12, 8)
    x = 10 * np.cos(phi) + np.sqrt(rod**2 - (10 * np.sin(phi) - 2) ** 2)
    assert run.point("slider.C").x == pytest.approx(x, abs=EXACT * 12)
    assert run.point("slider.C").y == pytest.approx(2.0, abs=EXACT * 12)
    # driven along a guide of 30 degrees, which is degrees in text and radians in JSON
    slope = {"a.txt": "30", "b.pmks": str(math.radians(30))}
    along = T / 2
    for name, angle in slope.items():
        lines = [["ground,block", "P", 1, 2, angle], ["block,arm", "R", 1, 2, 0]]
        if name.endswith("txt"):
            text = "\n".join(f"{a},{b},{x},{y},{s}" for a, b, x, y, s in lines) + "\ns=0.5\n"
        else:
            table = [
                {"Links": a.split(","), "TypeOfJoint": b, "X": x, "Y": y, "Angle": s}
                for a, b, x, y, s in lines
            ]
            text = json.dumps({"Joints": table, "InputSpeed": 0.5})
        machine = import_model(write(tmp_path / name, text), "SI").mechanism
        machine = machine.copied()
        machine.add(mbody.AngleDriver("hold", "arm", 0.0))
        run = mbody.kinematics(machine, T)
        assert run.point("block.A").x == pytest.approx(1 + along * math.cos(math.pi / 6), abs=1e-9)
        assert run.point("block.A").y == pytest.approx(2 + along / 2, abs=1e-9)


def test_pmks_pin_in_a_slot_is_a_quick_return(tmp_path):
    text = "ground,input,R,0,0\nlever input,RP,2,0,0\nlever,ground,R,5,0.00\nlever,r,-4,0.00\n"
    run = mbody.kinematics(import_model(write(tmp_path / "q.txt", text)).mechanism, T)
    lever = np.unwrap(np.arctan2(-2 * np.sin(T), 5 - 2 * np.cos(T)))
    assert run["lever"].angle == pytest.approx(lever, abs=EXACT)


def test_pmks_gears_external_internal_and_on_a_carrier(tmp_path):
    train = "ground,a,R,0,0\na,b,G,4,0\nb ground,R,10,0\n"
    run = mbody.kinematics(import_model(write(tmp_path / "g.txt", train)).mechanism, T)
    assert run["b"].omega == pytest.approx(-4 / 6, rel=EXACT)
    # Willis: (ω_ring − ω_arm)/(ω_sun − ω_arm) = −z_sun/z_ring with the ring at rest
    planets = "ground,sun,arm,R,0,0\narm,planet,R,6,0\nsun,planet,G,5,0\nplanet,gnd,G,7,0\n"
    made = import_model(write(tmp_path / "p.txt", planets)).mechanism
    run = mbody.kinematics(made, T)
    assert run["arm"].omega == pytest.approx(5 / (5 + 7), rel=EXACT)
    assert run["planet"].omega == pytest.approx(5 / 12 * (1 - 7 / 1), rel=EXACT)


LINKAGE = """<linkage2><program units="Millimeters" scalefactor="2"/>
{}<selected><connector id="1"/></selected></linkage2>"""
UNIT = 25.4 / 96


def connectors(*rows):
    """Connectors of (id, x, y, attributes, limits)."""
    text = ""
    for id_, x, y, more, *limits in rows:
        inner = "".join(f'<slidelimit id="{one}"/>' for one in limits)
        text += f'<connector id="{id_}" x="{x}" y="{y}" {more}>{inner}</connector>'
    return text


def link(id_, *members, more="", tag="Link"):
    inner = "".join(f'<connector id="{one}"/>' for one in members)
    return f'<{tag} id="{id_}" {more}>{inner}</{tag}>'


def linkage(tmp_path, *parts, units=None):
    return import_model(write(tmp_path / "a.linkage2", LINKAGE.format("".join(parts))), units)


ANCHOR, INPUT = 'anchor="true"', 'anchor="true" input="true" rpm="30"'


def test_linkage_turns_clockwise_in_its_own_unit(tmp_path):
    made = linkage(
        tmp_path,
        connectors((0, 200, -100, INPUT), (1, 200, -65, ""), (2, 300, -50, 'name="B"')),
        connectors((3, 300, -200, ANCHOR), (4, 250, 0, 'draw="true"')),
        link(0, 0, 1) + link(0 + 1, 1, 2, 4) + link(2, 2, 3, tag="element"),
    )
    run = mbody.kinematics(made.mechanism, T)
    drawn = [(200, -100), (300, -200)], (200, -65), (300, -50)
    a, b = four_bar(*drawn, -math.pi * T)
    assert at(run, "link1.P1") == pytest.approx(UNIT * a, abs=EXACT * 100)
    assert at(run, "link2.B") == pytest.approx(UNIT * b, abs=EXACT * 100)
    tracer = UNIT * carried(a, b, [(200, -65), (300, -50)], (250, 0))
    assert at(run, "link1.P4") == pytest.approx(tracer, abs=EXACT * 100)
    assert any("scale factor" in note for note in made.notes)


@pytest.mark.parametrize("units", ["SI", "in-lbf-s"])
def test_linkage_in_other_units(tmp_path, units):
    parts = connectors((0, 0, 0, INPUT), (1, 96, 0, "")), link(0, 0, 1)
    point = linkage(tmp_path, *parts, units=units).mechanism["link0"].points["P1"]
    assert point[0] == pytest.approx({"SI": 0.0254, "in-lbf-s": 1.0}[units], rel=1e-15)


def test_linkage_slider_and_slider_on_an_arc(tmp_path):
    crank = connectors((0, 0, 0, INPUT), (1, 0, 30, "")), link(0, 0, 1), link(1, 1, 2)
    line = connectors(
        (2, 100, 10, 'slider="true"', 3, 4), (3, 60, 10, ANCHOR), (4, 140, 10, ANCHOR)
    )
    run = mbody.kinematics(linkage(tmp_path, *crank, line).mechanism, T)
    phi = math.pi / 2 - math.pi * T
    x = 30 * np.cos(phi) + np.sqrt(100**2 + 20**2 - (30 * np.sin(phi) - 10) ** 2)
    assert at(run, "link1.P2")[:, 0] == pytest.approx(UNIT * x, abs=EXACT * 100)
    # an arc of radius 50 about (100, -40): a rocker in place of the slot
    ends = connectors((3, 60, -10, ANCHOR), (4, 140, -10, ANCHOR))
    arc = connectors((2, 100, 10, 'slider="true" slideradius="-50"', 3, 4)) + ends
    run = mbody.kinematics(linkage(tmp_path, *crank, arc).mechanism, T)
    _, b = four_bar([(0, 0), (100, -40)], (0, 30), (100, 10), -math.pi * T)
    assert at(run, "link1.P2") == pytest.approx(UNIT * b, abs=EXACT * 100)


def test_linkage_anchor_on_which_a_link_slides(tmp_path):
    parts = (
        connectors((0, 0, 0, INPUT), (1, 20, 0, ""), (2, 120, 0, "")),
        connectors((3, 60, 0, 'anchor="true" slider="true"', 1, 2)),
        link(0, 0, 1) + link(1, 1, 2),
    )
    run = mbody.kinematics(linkage(tmp_path, *parts).mechanism, T)
    phi = -math.pi * T
    lever = np.arctan2(-20 * np.sin(phi), 60 - 20 * np.cos(phi))
    assert run["link1"].angle == pytest.approx(lever, abs=EXACT)


def test_linkage_actuator_goes_its_throw_and_back(tmp_path):
    parts = (
        connectors((0, 0, 0, ANCHOR), (1, 40, 0, ""), (2, 0, -30, ANCHOR)),
        link(0, 0, 1) + link(1, 2, 1, more='actuator="true" throw="10" cpm="12"'),
    )
    run = mbody.kinematics(linkage(tmp_path, *parts).mechanism, np.array([0.0, 1.0, 2.0, 3.5]))
    # 12 cycles a minute: 10 out in 2.5 s and back; cosine rule in the triangle of 40 and 30
    length = np.array([50, 54, 58, 56])
    angle = np.arccos((40**2 + 30**2 - length**2) / (2 * 40 * 30)) - math.pi / 2
    assert run["link0"].angle == pytest.approx(angle, abs=EXACT)


@pytest.mark.parametrize(("kind", "sign"), [("gears", -1.0), ("chain", 1.0)])
def test_linkage_ratios_and_welds(tmp_path, kind, sign):
    wheels = f'<ratios><ratio type="{kind}"><link id="0" size="3"/><link id="1" size="2"/></ratio>'
    parts = (
        connectors((0, 0, 0, INPUT), (1, 50, 0, ANCHOR), (2, 60, 10, "")),
        link(0, 0, more='gear="true"') + link(1, 1, more='gear="true"'),
        link(2, 1, 2, more='fastenlink="1"') + wheels + "</ratios>",
    )
    run = mbody.kinematics(linkage(tmp_path, *parts).mechanism, T)
    assert run["link1"].omega == pytest.approx(sign * 1.5 * -math.pi, rel=EXACT)
    assert run["link2"].omega == pytest.approx(run["link1"].omega, rel=EXACT)


@pytest.mark.parametrize(("kind", "planet"), [("gears", 1 + 3 / 2), ("chain", 1 - 3 / 2)])
def test_linkage_planets_about_a_wheel_that_is_fastened_to_an_anchor(tmp_path, kind, planet):
    ratio = f'<ratios><ratio type="{kind}"><link id="4" size="3"/><link id="0" size="2"/></ratio>'
    parts = (
        connectors((2, -40, 0, ANCHOR), (4, 0, 0, INPUT), (6, 50, 0, "")),
        link(3, 2) + link(4, 4, more='gear="true" fastenconnector="2"'),
        link(0, 6, more='gear="true"') + link(5, 4, 6) + ratio + "</ratios>",
    )
    made = linkage(tmp_path, *parts)
    # the link of one anchor alone is no body
    assert {body.name for body in made.mechanism.bodies} == {"link0", "link4", "link5"}
    run = mbody.kinematics(made.mechanism, T)
    assert run["link4"].angle == pytest.approx(0.0, abs=EXACT)
    # Willis with the sun at rest
    assert run["link0"].omega == pytest.approx(-math.pi * planet, rel=EXACT)


def test_linkage_two_anchors_make_a_link_the_ground(tmp_path):
    parts = (
        connectors((0, 0, 0, INPUT), (1, 20, 0, ""), (2, 100, 0, ANCHOR), (3, 60, 80, ANCHOR)),
        connectors((4, 80, 40, ""), (5, 90, 90, 'layer="1"')),
        link(0, 0, 1) + link(1, 2, 3, 4) + link(2, 1, 5 - 1, more='measurementelement="true"'),
    )
    made = linkage(tmp_path, *parts)
    assert [body.name for body in made.mechanism.bodies] == ["link0"]
    assert made.mechanism.ground.points["P4"] == pytest.approx((80 * UNIT, 40 * UNIT))
    assert any("two anchors" in note for note in made.notes)
    assert any("only draw or measure: 5" in note for note in made.notes)


def python_linkage(**more):
    joints = [
        {"id": "O", "type": "ground", "position": [0, 0]},
        {"id": "C", "type": "ground", "position": [4, 0.5]},
        {"id": "A", "type": "revolute", "position": [0.6, 0.8]},
        {"id": "B", "type": "revolute", "position": [3.2, 2.4]},
        {"id": "P", "type": "tracker", "position": [None, None], "ref_joint1_id": "A"}
        | {"ref_joint2_id": "B", "distance": 2.0, "angle": 0.5},
    ]
    crank = {"id": "crank", "type": "driver", "joints": ["O", "A"], "motor_joint": "O"}
    links = [
        {"id": "ground", "type": "ground", "joints": ["O", "C"]},
        crank | {"angular_velocity": 0.7, "initial_angle": math.atan2(0.8, 0.6)} | more,
        {"id": "coupler", "type": "link", "joints": ["A", "B"]},
        {"id": "rocker", "type": "link", "joints": ["B", "C"]},
    ]
    return {"name": "bars", "joints": joints, "links": links, "ground": "ground"}


def test_pylinkage_four_bar_with_a_tracker(tmp_path):
    file = write(tmp_path / "p.json", json.dumps(python_linkage()))
    run = mbody.kinematics(import_model(file).mechanism, T)
    a, b = four_bar([(0, 0), (4, 0.5)], (0.6, 0.8), (3.2, 2.4), 0.7 * T)
    assert at(run, "rocker.B") == pytest.approx(b, abs=EXACT)
    way = b - a
    angle = np.arctan2(way[:, 1], way[:, 0]) + 0.5
    tracked = a + 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert at(run, "coupler.P") == pytest.approx(tracked, abs=EXACT)


def test_pylinkage_starts_at_its_initial_angle_and_swings(tmp_path):
    later = python_linkage(initial_angle=1.4)
    run = mbody.kinematics(import_model(write(tmp_path / "a.json", json.dumps(later))).mechanism, T)
    a, _ = four_bar(
        [(0, 0), (4, 0.5)], (0.6, 0.8), (3.2, 2.4), 1.4 - math.atan2(0.8, 0.6) + 0.7 * T
    )
    assert at(run, "coupler.A") == pytest.approx(a, abs=EXACT)
    swing = {"type": "arc_driver", "arc_start": 0.5, "arc_end": 1.5, "initial_angle": 0.9}
    file = write(tmp_path / "b.json", json.dumps(python_linkage(**swing)))
    t = np.array([0.0, 0.5, 1.0, 2.0, 3.0])
    run = mbody.kinematics(import_model(file).mechanism, t)
    crank = [0.9, 1.25, 1.4, 0.7, 1.0]  # 0.6 up, 1.0 down, and up again
    place = at(run, "crank.A")
    assert np.arctan2(place[:, 1], place[:, 0]) == pytest.approx(crank, abs=1e-9)


def test_any_damage_of_a_file_is_a_sentence(tmp_path):
    """Bytes left out or put in: a model, or an error of ours, and no traceback."""
    rng = np.random.default_rng(7)
    whole = linkage_text() + "\n" + FOUR_BAR
    sources = [linkage_text(), FOUR_BAR, json.dumps(python_linkage()), whole]
    signs = list("<>\"'{}[],:=-.0aR \n")
    for n in range(400):
        text = list(sources[n % len(sources)])
        for _ in range(int(rng.integers(1, 6))):
            place = int(rng.integers(len(text)))
            if rng.random() < 0.5:
                del text[place : place + int(rng.integers(1, 12))]
            else:
                text.insert(place, str(rng.choice(signs)))
        file = write(tmp_path / "odd.txt", "".join(text))
        try:
            import_model(file)
        except ModelError as error:
            assert str(error)


def linkage_text():
    parts = (
        connectors((0, 0, 0, INPUT), (1, 0, 30, ""), (3, 60, 10, ANCHOR), (4, 140, 10, ANCHOR)),
        connectors((2, 100, 10, 'slider="true"', 3, 4), (5, 0, -30, ANCHOR)),
        link(0, 0, 1) + link(1, 1, 2) + link(2, 5, 1, more='actuator="true" throw="9" cpm="-3"'),
        '<ratios><ratio type="gears"><link id="0" size="3"/><link id="1" size="2"/></ratio>',
        "</ratios>",
    )
    return LINKAGE.format("".join(parts))


def test_what_other_formats_have_besides_is_named(tmp_path):
    data = python_linkage(colour="red")
    data["joints"][2]["friction"] = 0.2
    notes = import_model(write(tmp_path / "a.json", json.dumps(data))).notes
    assert "not taken of the joint 'A': 'friction'" in notes
    assert "not taken of the link 'crank': 'colour'" in notes
    joints = [
        {"X": 0, "Y": 0, "TypeOfJoint": "R", "Links": ["ground", "a"], "Stiffness": 3},
        {"X": 1, "Y": 0, "TypeOfJoint": "R", "Links": ["a"]},
    ]
    notes = import_model(write(tmp_path / "a.pmks", json.dumps({"Joints": joints}))).notes
    assert "not taken of the joint A (ground, a): 'Stiffness'" in notes
    crank = connectors((0, 0, 0, INPUT + ' spring="2" alwaysmanual="true"'), (1, 9, 0, ""))
    notes = linkage(tmp_path, crank, link(0, 0, 1)).notes
    assert "not taken of the connector 0: 'spring'" in notes
    assert any("moved by hand" in note for note in notes)


def test_joints_and_links_of_one_name_are_told_apart(tmp_path):
    data = python_linkage()
    data["links"][2]["name"] = "A"
    made = import_model(write(tmp_path / "a.json", json.dumps(data)))
    assert {"A", "A_2"} <= {element.name for element in made.mechanism}
    assert "the joint 'A' is named A_2" in made.notes
