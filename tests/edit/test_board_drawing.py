"""Mechanisms are drawn from nothing in a browser: their numbers are those of models written by
hand in other axes, their forces to 1e-9, and undo comes back to the first byte.
"""

import math

import numpy as np
import pytest

import mbody
from mbody.files.model import from_toml
from tests.support.board_page import EMPTY, BoardPage, served
from tests.support.browser import chromium
from tests.support.paths import ROOT

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
]


def polar(a, b):
    """Length and direction in degrees from a place to another."""
    return math.dist(a, b), math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))


def chain(page, *places):
    page.key("l")
    for place in places:
        page.click(*place)
    page.key("Escape")


def ground(page, *places):
    page.key("g")
    for place in places:
        page.click(*place)


def motor(page, *place):
    page.key("m")
    page.click(*place)


def load(page, place, to):
    page.key("f")
    page.drag(place, to)


def field(page, path, text):
    """Type into a field of the table."""
    page.read("document.querySelector('[data-tab=table]').click()")
    page.idle()
    page.fill(f'[data-path="{path}"]', text)
    page.key("Enter")


# -- drawn, and written by hand: links along their own axes, in other places of the file -----------


def link(name, a, b, first, second, **more):
    """A link from a place to another in axes of its own, with further points (name: place)."""
    length, angle = polar(a, b)
    points = {first: (0.0, 0.0), second: (length, 0.0)}
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    for one, (x, y) in more.items():
        x, y = x - a[0], y - a[1]
        points[one] = (c * x + s * y, c * y - s * x)
    inside = ", ".join(f"{one} = [{x!r}, {y!r}]" for one, (x, y) in points.items())
    return f"bodies.{name} = {{ points = {{ {inside} }}, guess = {angle!r} }}"


def pin(name, i, j=None):
    return f'joints.{name}.revolute = ["{i}.{name}", "{j}.{name}"]'


def turning(body, a, b):
    value = polar(a, b)[1]
    law = f'{{ constant_speed = {{ value = {value!r}, speed = "6.283185307179586 rad/s" }} }}'
    return f'drivers.motor = {{ angle = "{body}", law = {law} }}'


def force(at, angle):
    return f'loads.F1 = {{ force = 0.1e3, at = "{at}", angle = {angle} }}'


def grounded(**places):
    return [f"ground.points.{name} = [{x}, {y}]" for name, (x, y) in places.items()]


def four_bar(page):
    chain(page, (0, 0), (10, 20), (56, 40), (70, 0))
    ground(page, (0, 0), (70, 0))
    motor(page, 5, 10)
    load(page, (56, 40), (56, 20))
    return [
        *grounded(A=(0, 0), D=(70, 0)),
        link("link3", (70, 0), (56, 40), "D", "C"),
        link("link2", (56, 40), (10, 20), "C", "B"),
        link("link1", (0, 0), (10, 20), "A", "B"),
        pin("A", "ground", "link1"), pin("D", "ground", "link3"),
        pin("B", "link1", "link2"), pin("C", "link2", "link3"),
        turning("link1", (0, 0), (10, 20)), force("link2.C", -90),
    ]  # fmt: skip


def stephenson_six_bar(page):
    chain(page, (0, 0), (10, 20))
    page.key("l")
    page.click(10, 20)
    page.click(40, 56, held=("ctrl",))
    page.click(56, 40)
    page.click(70, 0)
    page.key("Escape")
    chain(page, (40, 56), (86, 60))
    ground(page, (0, 0), (70, 0))
    page.key("s")
    page.drag((86, 60), (96, 60))
    motor(page, 5, 10)
    load(page, (86, 60), (66, 60))
    return [
        *grounded(A=(0, 0), E=(70, 0), line=(-7, 60)),
        link("link1", (0, 0), (10, 20), "A", "B"),
        link("link2", (10, 20), (56, 40), "B", "D", C=(40, 56)),
        link("link3", (70, 0), (56, 40), "E", "D"),
        link("link4", (86, 60), (40, 56), "F", "C"),
        pin("A", "ground", "link1"), pin("E", "ground", "link3"), pin("B", "link1", "link2"),
        pin("D", "link2", "link3"), pin("C", "link2", "link4"),
        'joints.slot1.pin_slot = ["ground.line", "link4.F"]',
        turning("link1", (0, 0), (10, 20)), force("link4.F", 180),
    ]  # fmt: skip


def pump(page):
    chain(page, (0, 0), (12, 16), (70, 0))
    ground(page, (0, 0))
    page.key("s")
    page.drag((70, 0), (80, 0))
    motor(page, 6, 8)
    load(page, (70, 0), (50, 0))
    return [
        *grounded(A=(0, 0)),
        link("link1", (0, 0), (12, 16), "A", "B"),
        link("link2", (70, 0), (12, 16), "C", "B"),
        pin("A", "ground", "link1"), pin("B", "link1", "link2"),
        'joints.slot1.pin_slot = ["ground", "link2.C"]',
        turning("link1", (0, 0), (12, 16)), force("link2.C", 180),
    ]  # fmt: skip


def governor(page):
    page.keys("-", "-", "-")  # a step of the grid is 5 mm
    chain(page, (-10, 0), (-40, 25), (-10, 50))
    chain(page, (10, 0), (40, 25), (10, 50))
    chain(page, (-10, 50), (10, 50))
    ground(page, (-10, 0), (10, 0))
    page.key("s")
    page.drag((0, 50), (0, 60))
    page.key("k")
    page.click(0, -15)
    page.click(5, 50)
    motor(page, -25, 12.5)
    field(page, "loads.spring1.free_length", "4 cm")
    return [
        *grounded(A=(-10, 0), D=(10, 0), G=(0, -15)),
        link("link1", (-10, 0), (-40, 25), "A", "B"),
        link("link2", (-10, 50), (-40, 25), "C", "B"),
        link("link3", (10, 0), (40, 25), "D", "E"),
        link("link4", (10, 50), (40, 25), "F", "E"),
        link("link5", (10, 50), (-10, 50), "F", "C", H=(5, 50)),
        pin("A", "ground", "link1"), pin("D", "ground", "link3"), pin("B", "link1", "link2"),
        pin("E", "link3", "link4"), pin("C", "link2", "link5"), pin("F", "link4", "link5"),
        "joints.J1.prismatic = [{ body = 'ground', point = [0, 50], angle = 90 }, "
        "{ body = 'link5', point = [10, 0], angle = -90 }]",
        turning("link1", (-10, 0), (-40, 25)),
        "loads.spring1 = { spring = ['ground.G', 'link5.H'], stiffness = 1, free_length = 40 }",
    ]  # fmt: skip


def cam_and_follower(page):
    chain(page, (0, 0), (10, 0))
    chain(page, (0, 40), (0, 56))
    ground(page, (0, 0))
    page.key("s")
    page.drag((0, 48), (0, 58))
    motor(page, 4, 0)
    load(page, (0, 56), (0, 44))
    page.key("c")
    page.click(0, 0)
    page.click(0, 40)
    page.key("Enter")
    page.idle()
    rise = "{{ rise = {{ shape = 'cycloidal', height = {}, start = 0, duration = 120 }} }}"
    segments = [rise.format(16), "{ dwell = 60 }", rise.format(-16), "{ dwell = 60 }"]
    return [
        *grounded(A=(0, 0)),
        link("link1", (0, 0), (10, 0), "A", "B"),
        link("link2", (0, 40), (0, 56), "C", "D"),
        pin("A", "ground", "link1"),
        "joints.J1.prismatic = [{ body = 'ground', point = [0, 48], angle = 90 }, "
        "{ body = 'link2', point = [8, 0] }]",
        "joints.J2 = { cam_follower = ['link1.A', 'link2.C'], base_radius = 30, roller = 10, "
        f"profile.cam = {{ period = 360, segments = [{', '.join(segments)}] }} }}",
        turning("link1", (0, 0), (10, 0)), force("link2.D", -90),
    ]  # fmt: skip


def gear_train(page):
    chain(page, (0, 0), (0, 10))
    chain(page, (40, 0), (40, 12))
    ground(page, (0, 0), (40, 0))
    page.key("w")
    page.drag((0, 0), (16, 0))
    page.click(40, 0)
    motor(page, 0, 5)
    page.key("t")
    page.click(40, 6)
    return [
        *grounded(A=(0, 0), C=(40, 0)),
        link("link1", (0, 0), (0, 10), "A", "B"),
        link("link2", (40, 0), (40, 12), "C", "D"),
        pin("A", "ground", "link1"), pin("C", "ground", "link2"),
        "joints.J1 = { gear = ['link1.A', 'link2.C'], radius_i = 16, radius_j = 24 }",
        turning("link1", (0, 0), (0, 10)), "loads.T1 = { torque = 1, body = 'link2' }",
    ]  # fmt: skip


def excavator(page):
    chain(page, (0, 0), (60, 40))
    page.key("l")
    page.click(60, 40)
    page.click(66, 52, held=("ctrl",))
    page.click(84, 10)
    page.key("Escape")
    ground(page, (0, 0))
    page.key("y")
    page.click(20, -10)
    page.click(30, 20)
    page.click(42, 28)
    page.click(66, 52)
    load(page, (84, 10), (84, -6))
    lengths = [math.dist((20, -10), (30, 20)), math.dist((42, 28), (66, 52))]
    return [
        *grounded(A=(0, 0), E=(20, -10)),
        link("link1", (60, 40), (0, 0), "B", "A", F=(30, 20), G=(42, 28)),
        link("link2", (84, 10), (60, 40), "D", "B", C=(66, 52)),
        pin("A", "ground", "link1"), pin("B", "link1", "link2"),
        f"drivers.motor1 = {{ distance = ['ground.E', 'link1.F'], law = {lengths[0]!r} }}",
        f"drivers.motor2 = {{ distance = ['link1.G', 'link2.C'], law = {lengths[1]!r} }}",
        force("link2.D", -90),
    ]  # fmt: skip


DRAWN = (four_bar, stephenson_six_bar, pump, governor, cam_and_follower, gear_train, excavator)


def forces(data):
    """All forces and torques of an instant by name."""
    found = {}
    for table in (data["reactions"], data["loads"]):
        for name, one in table.items():
            found |= {f"{name}.{key}": one[key][0] for key in ("fx", "fy") if one.get(key)}
    return found | {f"{name}.effort": one[0] for name, one in data["efforts"].items()}


@pytest.mark.parametrize("draw", DRAWN, ids=lambda one: one.__name__)
def test_what_is_drawn_is_what_is_written_by_hand(page, draw, pictures):
    rows = draw(page)
    page.keys("Escape", "Escape")
    page.key("0")
    page.picture(pictures / f"{draw.__name__}.png")
    drawn, hand = page.text, from_toml("\n".join([EMPTY, *rows]))
    assert page.messages == []
    expected = forces(mbody.kinetostatics(hand).data())
    peak = max(map(abs, expected.values()))
    assert peak > 0.5
    for found in (forces(page.run), forces(mbody.kinetostatics(from_toml(drawn)).data())):
        assert found.keys() == expected.keys()
        for name, value in expected.items():
            np.testing.assert_allclose(
                found[name], value, rtol=1e-9, atol=1e-9 * peak, err_msg=name
            )
    while page.read("!document.querySelector('[aria-keyshortcuts=\"Control+Z\"]').disabled"):
        page.key("z", "ctrl")
    assert page.text == EMPTY


class CountedPage(BoardPage):
    """What the user does is counted: presses, places that are pointed at, keys, thoughts."""

    def __init__(self, browser, address):
        self.presses = self.places = self.strokes = self.thoughts = 0
        super().__init__(browser, address)

    def call(self, method, **parameters):
        if parameters.get("type") == "keyDown" or method == "Input.insertText":
            self.strokes += len(parameters.get("text") or "1")
            self.strokes += parameters.get("modifiers", 0) > 0
            self.thoughts += 1
        return super().call(method, **parameters)

    def drag(self, *places, held=(), **more):
        self.presses += 1
        self.places += len(places)
        self.strokes += len(held)
        self.thoughts += len(places)
        super().drag(*places, held=held, **more)


def test_the_tutorial_counts_what_a_six_bar_and_its_report_take(chrome, tmp_path):
    tutorial = (ROOT / "docs" / "tutorial" / "drawing_board.md").read_text("utf-8")
    command = tutorial.split("```\n")[1].strip()
    with served(tmp_path, *command.split()[2:]) as address:
        page = CountedPage(chrome, address)
        rows = stephenson_six_bar(page)
        page.key("s", "ctrl")
        page.key("/")
        page.write("report")
        page.key("Enter")
        said = page.wait("/written: .*/.exec(document.querySelector('.words').innerText)?.[0]")
        assert said.endswith("sixbar-report.html – mbody report sixbar.toml -o sixbar-report.html")
        assert page.messages == [] and page.text == (tmp_path / "sixbar.toml").read_text("utf-8")
    strokes, thoughts = page.strokes + len(command) + 1, page.thoughts + 2
    seconds = 1.1 * page.places + 0.2 * page.presses + 0.28 * strokes + 1.35 * thoughts
    assert seconds < 180
    counted = (
        f"{page.presses} presses of the mouse at {page.places} places and {strokes} keys: "
        f"{seconds:.0f} s by the keystroke-level model"
    )
    assert counted in " ".join(tutorial.split())
    hand = from_toml("\n".join([EMPTY, *rows]))
    force = mbody.kinetostatics(hand, turn=True).data()["reactions"]["B"]
    report = (tmp_path / "sixbar-report.html").read_text("utf-8")
    assert f">{np.hypot(force['fx'], force['fy']).max():.3f}</td>" in report
