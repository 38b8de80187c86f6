"""The page of the board: by pointer, keys and fingers, in all sizes, with mistakes."""

import csv
import json
import math

import pytest

from tests.exchange.test_exchange import FOUR_BAR
from tests.support.accessibility import violations
from tests.support.board_page import EMPTY
from tests.support.browser import chromium

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
]
SMALL = """[...document.querySelectorAll('button, input, select')].filter((e) => e.offsetParent
  && (e.offsetHeight < 44 || e.offsetWidth < 44)).map((e) => e.outerHTML.slice(0, 90))"""


def two_links(page):
    page.key("l")
    for place in ((0, 0), (10, 20), (56, 40)):
        page.click(*place)
    page.keys("Escape", "Escape")


def walk(page, here, there):
    """Arrow keys from a place to another on a grid of 2 mm."""
    for n, (less, more) in enumerate((("ArrowLeft", "ArrowRight"), ("ArrowDown", "ArrowUp"))):
        steps = round((there[n] - here[n]) / 2)
        for _ in range(abs(steps) // 10):
            page.key(more if steps > 0 else less, "shift")
        for _ in range(abs(steps) % 10):
            page.key(more if steps > 0 else less)
    return there


def tab(page, name):
    page.read(f"document.querySelector('[data-tab={name}]').click()")
    page.idle()


def test_keys_alone_draw_what_the_pointer_draws(page):
    two_links(page)
    page.key("g")
    page.click(0, 0)
    page.key("m")
    page.click(5, 10)
    page.key("f")
    page.drag((56, 40), (56, 20))
    drawn = page.text
    while page.text != EMPTY:
        page.key("z", "ctrl")
    page.keys("Escape", "Escape", "l", "ArrowUp")
    here = page.read(
        "document.querySelector('.said').textContent.replaceAll('−', '-').split(', ').map(Number)"
    )
    for place in ((0, 0), (10, 20), (56, 40)):
        here = walk(page, here, place)
        page.key("Enter")
    page.keys("Escape", "g")
    here = walk(page, here, (0, 0))
    page.keys("Enter", "m")
    here = walk(page, here, (4, 8))
    page.keys("Enter", "f")
    here = walk(page, here, (56, 40))
    page.key("Enter")
    walk(page, here, (56, 20))
    page.key("Enter")
    assert page.text == drawn


def test_numbers_are_typed_while_drawing(page):
    two_links(page)
    page.key("l")
    page.click(56, 40)
    page.hover(70, 50)
    page.key("3")
    page.write(" cm")
    page.key("Tab")
    page.write("-60")
    page.key("Enter")
    link = page.text.split("[bodies.link3]")[1].split("\n")[1]
    assert "C = [56, 40]" in link
    assert "D = [71, 14.0192378" in link  # 40 - 30 sin 60
    page.hover(80, 10)
    page.key("5")
    page.write(" parsec2")
    page.key("Enter")
    assert "parsec2" in page.messages[0]["text"] and "link4" not in page.text
    page.keys("Escape")


def test_the_place_shown_in_a_diagram_has_the_value_of_the_analysis(page):
    command(page, "Begin from the gallery")
    page.wait("document.querySelector('#menu-title').textContent.startsWith('Begin')")
    page.write("norton_fourbar")
    page.key("Enter")
    page.wait("!!document.querySelector('.diagram output')")
    page.idle()
    said = "document.querySelector('.diagram output').textContent"
    (effort,) = page.run["efforts"]["motor"]
    assert page.read(said) == f"here {effort:.1f}"  # not that of the end of the turn, 155.6
    labels = "[...document.querySelectorAll('.rows label')].map((one) => one.textContent)"
    assert {"motor: value", "motor: speed", "motor: acceleration"} <= {*page.read(labels)}
    title = "[...document.querySelectorAll('.rows label')].map((one) => one.title).join('|')"
    assert "drivers.motor.law.constant_acceleration.speed: Angle of the body" in page.read(title)
    assert page.read("Math.abs(document.querySelector('.diagram .now').getAttribute('x1'))") == 0
    command(page, "Paths and velocities")
    page.idle()
    assert page.read("document.querySelectorAll('.track').length") == 5  # of each point of a link
    assert page.read("[...document.querySelectorAll('.arrows text')].map((one) => "
                     "one.textContent).includes('v A 125 in/s')")  # fmt: skip
    command(page, "Paths and velocities")
    page.key(" ")  # plays: idle does not wait for its end, edits have their turn
    page.wait(f"{said} !== 'here {effort:.1f}'")
    page.idle()
    page.key(" ")
    page.key("Home")
    assert page.read(said) == f"here {effort:.1f}"


def test_a_mistake_is_a_sentence_beside_its_field_and_changes_nothing(page):
    two_links(page)
    page.key("g")
    page.click(0, 0)
    page.key("m")
    page.click(5, 10)
    page.keys("Escape", "Escape")
    before = page.text
    page.fill('[data-path="drivers.motor.law.constant_speed.speed"]', "90 rmp")
    page.key("Enter")
    assert page.text == before
    field = "document.querySelector('[data-path=\"drivers.motor.law.constant_speed.speed\"]')"
    assert page.read(f"{field}.getAttribute('aria-invalid')") == "true"
    assert page.read(f"{field}.value") == "90 rmp"
    said = page.read(
        f"document.getElementById({field}.getAttribute('aria-describedby')).textContent"
    )
    assert "rmp" in said and said == page.messages[0]["text"]
    assert page.messages[0]["element"] == "motor"
    assert page.read("document.querySelectorAll('.faulty').length") == 1
    page.key("Escape")
    assert page.read(f"{field}.value") == "60 rpm"
    assert page.read("document.querySelectorAll('.faulty').length") == 0
    tab(page, "text")
    page.fill("textarea", before.replace("[joints]", "[jointz]"))
    page.key("Enter", "ctrl")
    line = page.text.split("\n").index("[jointz]") + 1
    problems = page.read("document.querySelector('.problems').textContent")
    assert problems.startswith(f"line {line}: ") and "did you mean 'joints'" in problems
    assert page.read("document.querySelector('main').classList.contains('stale')")
    page.read("(document.querySelector('.problems button').click(), 0)")
    marked = "(({ value, selectionStart: a, selectionEnd: b }) => value.slice(a, b))"
    assert page.read(f"{marked}(document.querySelector('textarea'))") == "[jointz]"
    page.key("Escape")
    page.key("z", "ctrl")
    assert page.text == before and page.messages == []


def test_several_are_chosen_moved_copied_renamed_and_deleted(page):
    two_links(page)
    page.click(0, 0)
    page.click(56, 40, held=("shift",))
    page.key("ArrowUp")
    assert "A = [0, 2]" in page.text and "C = [56, 42]" in page.text
    page.key("z", "ctrl")
    page.key("Escape")
    page.drag((-8, -8), (64, 48), held=("shift",))  # a band about both links
    page.key("d", "ctrl")
    assert page.text.count("[bodies.") == 4
    page.key("z", "ctrl")
    page.click(4, 8)
    page.key("F2")
    page.fill("dialog input", "crank")
    page.key("Enter")
    page.idle()
    assert "[bodies.crank]" in page.text and '"crank.B"' in page.text
    page.click(4, 8)
    page.key("Delete")
    assert "crank" not in page.text and "[bodies.link2]" in page.text


def test_dragging_a_link_moves_it_and_a_point_changes_it(page):
    two_links(page)
    page.key("g")
    page.click(0, 0)
    page.key("Escape")
    before = page.text
    middle = "document.querySelector('[data-name=\"link:link1\"]').getBoundingClientRect().x"
    here = page.read(middle)
    page.drag((4, 8), (-4, 8), (-8, 4))
    assert page.text == before
    assert page.read(middle) < here - 20
    page.key("Home")
    assert page.read(middle) == pytest.approx(here, abs=0.5)
    page.drag((56, 40), (60, 44))
    assert "C = [60, 44]" in page.text
    page.drag((60, 44), (0, 0))  # onto the pivot: pinned there
    assert page.text.count("revolute") == 3 and "C = [0, 0]" in page.text


def test_fingers_draw_zoom_and_open_the_menu(page):
    page.size(390, 844, touch=True)
    page.key("0")
    page.key("l")
    page.tap(0, 0)
    page.tap(20, 10)
    assert page.text.count("[bodies.") == 1
    page.keys("Escape", "Escape")
    scale = "mbody.board.screen(1, 0)[0] - mbody.board.screen(0, 0)[0]"
    before, (x, y) = page.read(scale), page.at((10, 20))
    page.touch("touchStart", (x - 30, y), (x + 30, y))
    for n in range(1, 5):
        page.touch("touchMove", (x - 30 - 10 * n, y), (x + 30 + 10 * n, y))
    page.touch("touchEnd")
    page.idle()
    assert page.read(scale) > 1.5 * before
    page.touch("touchStart", page.at((0, 0)))
    page.wait("document.querySelector('dialog').open")
    page.touch("touchEnd")
    assert "Pin to the ground" in page.read("document.querySelector('dialog').innerText")
    page.key("Escape")
    page.size(1280, 800)


@pytest.mark.parametrize("size", ((390, 844), (800, 1100), (1600, 900)))
@pytest.mark.parametrize("dark", (False, True))
def test_all_sizes_light_and_dark_are_for_everyone(page, size, dark, pictures):
    two_links(page)
    page.key("g")
    page.click(0, 0)
    page.key("m")
    page.click(5, 10)
    page.keys("Escape", "Escape")
    touch = size[0] < 1000
    page.size(*size, touch=touch)
    page.dark(dark)
    page.read("new Promise((done) => setTimeout(done, 250))")
    page.key("0")
    for name in ("numbers", "table", "parts", "results", "text"):
        tab(page, name)
        page.picture(pictures / f"{size[0]}_{'dark' if dark else 'light'}_{name}.png")
        assert violations(page.browser) == []
        assert page.read("document.documentElement.scrollWidth <= innerWidth")
        assert not touch or page.read(SMALL) == []
    tab(page, "numbers")
    page.fill(".rows input", "1 parsecc")
    page.key("Enter")
    page.read("(document.getElementById('paper').focus(), 0)")
    command(page, "Add any")  # a form, beside a field with a mistake
    page.wait("!!document.querySelector('.menu.long')")
    assert page.messages and violations(page.browser) == []
    page.keys("Escape", "/")
    assert violations(page.browser) == []
    page.keys("Escape", "l")
    page.click(20, 0)
    page.key("3")
    assert page.read("!!document.activeElement.closest('.typed')")
    assert violations(page.browser) == []
    page.dark(False)
    page.size(1280, 800)


def command(page, words):
    """A command by its name."""
    page.key("/")
    page.write(words)
    page.key("Enter")


def test_a_picture_lies_below_the_drawing_at_scale(page, folder):
    page.picture(folder / "scan.png")
    command(page, "Picture to draw over")
    page.wait("!!document.querySelector('dialog [name=width]')")
    page.fill("dialog [name=width]", "40")
    page.fill("dialog [name=x]", "-10")
    page.key("Enter")
    page.wait("!!document.querySelector('#paper image')")
    page.idle()
    edges = "(({ left, right }) => [left, right])(document.querySelector('#paper image')"
    left, right = page.read(f"{edges}.getBoundingClientRect())")
    assert left == pytest.approx(page.at((-10, 0))[0], abs=0.5)
    assert right == pytest.approx(page.at((30, 0))[0], abs=0.5)
    assert page.text == EMPTY  # it is kept beside the model


def test_the_gallery_is_a_beginning_and_another_assembly_mode_is_taken_on_the_paper(page):
    command(page, "Begin from the gallery")
    page.wait("document.querySelector('#menu-title').textContent.startsWith('Begin')")
    page.write("watt")
    page.key("Enter")
    page.wait("mbody.board.text().includes('Watt')")
    page.idle()
    before = page.text
    page.read("([...document.querySelectorAll('.top button')].find((one) => "
              "one.textContent.endsWith('Modes')).click(), 0)")  # fmt: skip
    page.wait("document.querySelectorAll('#paper [data-mode]').length")
    page.read("(document.querySelector('dialog .list button').click(), 0)")
    page.wait(f"mbody.board.text() !== {json.dumps(before)}")
    assert page.messages == []
    page.key("z", "ctrl")
    assert page.text == before


def entry(page, kinds, name, fields):
    """Add an entry of the file by its form: fields by label, places as they are clicked."""
    command(page, "Add any")
    page.wait("!!document.querySelector('.menu.long')")
    find = "[...document.querySelectorAll('.menu label')].find((one) => one.textContent === {})"
    for n, kind in enumerate(kinds):
        chosen = f"document.querySelectorAll('.menu select')[{n}]"
        page.read(f"({chosen}.value = '{kind}', {chosen}.dispatchEvent(new Event('change')), 0)")
    for label, value in {"name": name, **fields}.items():
        field = f"document.getElementById({find.format(json.dumps(label))}.htmlFor)"
        page.read(f"({field}.focus(), 0)")
        if isinstance(value, tuple):
            page.click(*value)
        else:
            page.write(value)
    page.read("(document.querySelector('.menu form').requestSubmit(), 0)")
    page.idle()


def test_elements_measures_and_units_are_added_by_their_forms(page):
    for places in (((0, 0), (10, 20)), ((50, 0), (60, 20))):
        page.key("l")
        for place in places:
            page.click(*place)
        page.keys("Escape", "Escape")
    page.key("g")
    page.click(0, 0)
    page.click(50, 0)
    page.key("m")
    page.click(5, 10)
    page.key("Escape")
    sizes = {"radius i": "5", "radius j": "1 cm", "friction": "0.3", "value": "100 N"}
    belt = {"belt 1 *": (0, 0), "belt 2 *": (50, 0), **sizes}
    entry(page, ("joints", "belt"), "drive", belt)
    assert page.read("document.querySelector('dialog').open")  # without the distance
    assert "distance" in page.messages[0]["text"] and "belt" not in page.text
    page.keys("Escape")
    entry(page, ("joints", "belt"), "drive", {**belt, "distance": "50"})
    assert not page.read("document.querySelector('dialog').open")
    assert 'belt = ["link1.A", "link2.C"]' in page.text and 'radius_j = "1 cm"' in page.text
    entry(page, ("measures",), "tip", {"of *": "link1.B.y", "unit": "cm"})
    assert 'tip = { of = "link1.B.y", unit = "cm" }' in page.text
    spring = {"spring 1 *": (10, 20), "spring 2 *": (30, 31), "stiffness": "2", "free length": "10"}
    entry(page, ("loads", "spring"), "", spring)
    assert '["link1.B", "ground.' in page.text and "= [30, 31]" in page.text
    assert page.messages == []


def pick(page, words):
    """An entry of the dialog that is open."""
    page.wait(f"document.querySelector('dialog .list')?.innerText.includes({json.dumps(words)})")
    page.read("([...document.querySelectorAll('dialog .list button')].find((one) => "
              f"one.innerText.startsWith({json.dumps(words)})).click(), 0)")  # fmt: skip
    page.idle()


def test_what_comes_from_another_program_is_named_mirrored_measured_and_written(page, folder):
    (folder / "fourbar.pmks").write_text(FOUR_BAR, "utf-8")
    command(page, "Import from")
    pick(page, "fourbar.pmks")
    page.wait("mbody.board.text().includes('[bodies.')")
    assert page.text.count("[bodies.") == 3
    page.read("(document.getElementById('paper').focus(), 0)")
    command(page, "Name a number")
    page.wait("!!document.querySelector('dialog [name=row]')")
    page.fill("dialog [name=name]", "left")
    page.key("Enter")
    page.idle()
    assert "[parameters]\nleft = 100\n" in page.text and 'A = ["left", 100]' in page.text
    page.click(125, 140)
    command(page, "Mirror")
    page.wait("!!document.querySelector('dialog [name=x1]')")
    page.key("Enter")
    page.idle()
    assert "F = [-100, 100]" in page.text.partition("[bodies.")[0]
    turned = "points = { A = [100, -100], B = [150, -180] }\nguess = [0, 0, 180]\n"  # B: -150, 180
    assert turned in page.text
    page.key("z", "ctrl")
    page.key("e")
    page.click(150, 180)
    page.click(500, 100)
    drawn = "[...document.querySelectorAll('.diagram h2')].map((one) => one.textContent)"
    assert "distance_B_D [mm]" in page.read(drawn)
    page.key("s", "ctrl")
    page.key("Enter")
    command(page, "Results as CSV")
    said = page.wait("/written: .*/.exec(document.querySelector('.words').innerText)?.[0]")
    words = "mbody kinetostatics fourbar.toml --over turn --csv fourbar.csv"
    assert said == f"written: fourbar.csv – {words}"
    names, first, *rest = csv.reader((folder / "fourbar.csv").read_text().splitlines())
    column = next(n for n, name in enumerate(names) if name.startswith("distance_B_D"))
    assert len(rest) == 360 and float(first[column]) == pytest.approx(math.hypot(350, 80))


def test_a_point_by_a_parameter_says_its_value_while_it_is_dragged(page):
    tab(page, "text")
    rows = [
        "[parameters]",
        'crank = "2 cm"',
        "[bodies.link]",
        'points = { A = [0, 0], B = ["crank", 0] }',
    ]
    page.fill(
        "textarea", "\n".join([EMPTY, *rows, '[joints]\nA.revolute = ["ground", "link.A"]', ""])
    )
    page.key("Enter", "ctrl")
    tab(page, "numbers")
    page.keys("v", "0")
    page.drag((20, 0), (15, 0), release=False)
    page.idle()
    assert page.read("document.querySelector('.place').textContent") == "crank = 15 mm"
    page.release(15, 0)
    assert 'crank = "1.5 cm"' in page.text
    page.drag((0, 0), (5, 5))  # a pin at the origin of the ground, which has no name
    said = page.read("document.querySelector('.words').innerText")
    assert "'link.A' is pinned to the origin of the ground: name a point there first" in said
    page.key("e")
    page.click(10, 0)
    assert 'angle_link = { of = "link.angle" }' in page.text
