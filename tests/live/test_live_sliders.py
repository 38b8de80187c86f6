"""Live pages while a slider moves, with several drivers and designs, and of models in JSON."""

import json
import tomllib
from importlib.util import find_spec

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.analysis.driven.free_body import free_body
from mbody.live import live_view
from mbody.model.simulation import Measure
from mbody.solution.measures import shown_measure
from mbody.views.shapes import motion
from mbody.views.sketch import mode_rows
from tests.support.browser import browser as started
from tests.support.browser import chromium
from tests.support.frictional import slider_crank
from tests.support.viewer_page import ViewerPage

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        find_spec("numba") is None or find_spec("ziglang") is None,
        reason="numba and ziglang build the core for browsers",
    ),
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
]

#: What live pages promise, as a part of the peak.
CLOSE = 1e-9

FIVE_BAR = """
name = "Five-bar with two motors"
units = "SI"
ground = { points = { O = [0, 0], C = [0.2, 0] } }

[bodies]
left = { mass = 1.0, inertia = 0.01, points = { O = [0, 0], A = [0.3, 0] }, guess = 120 }
right = { mass = 1.0, inertia = 0.01, points = { C = [0, 0], B = [0.3, 0] }, guess = 60 }
forearm = { mass = 0.5, inertia = 0.01, points = { A = [0, 0], P = [0.35, 0] }, guess = 40 }
other = { mass = 0.5, inertia = 0.01, points = { B = [0, 0], P = [0.35, 0] }, guess = 140 }

[joints]
O = { revolute = ["ground.O", "left.O"] }
C = { revolute = ["ground.C", "right.C"] }
A = { revolute = ["left.A", "forearm.A"] }
B = { revolute = ["right.B", "other.B"] }
P = { revolute = ["forearm.P", "other.P"] }

[drivers]
one = { angle = "left", law = { constant_speed = { value = 120, speed = "20 deg/s" } } }
two = { angle = "right", law = { constant_speed = { value = 60, speed = "-15 deg/s" } } }

[loads]
pull = { force = "10 N", at = "forearm.P", angle = -90 }
"""


def rough_press():
    """A slider-crank with friction in all joints."""
    return slider_crank(masses=(1.0, 2.0, 3.0), length=0.06)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    file = tmp_path_factory.mktemp("json") / "fourbar.json"
    tables = tomllib.loads(mbody.to_toml(gallery.load("norton_fourbar")))
    file.write_text(json.dumps(tables), "utf-8")
    five = mbody.from_toml(FIVE_BAR)
    return {
        "pump": mbody.kinetostatics(gallery.load("mud_pump_sixbar"), turn=True, instants=181),
        "norton": motion(gallery.load("norton_fourbar")),
        "five": mbody.kinetostatics(five, t=np.linspace(0.0, 1.0, 61)),
        "json": mbody.kinetostatics(mbody.load(file), turn=True, instants=91),
        "rough": mbody.kinetostatics(rough_press(), turn=True, instants=73),
        "units": in_other_units(),
    }


def in_other_units():
    """A shaper whose results are in units that its file does not have."""
    machine = gallery.load("quick_return")
    machine.measures |= {"tilt": Measure("lever.angle"), "loss": Measure("motor.power", "hp")}
    machine.output_units = {"force": "kN", "speed": "rpm", "length": "cm"}
    return mbody.kinetostatics(machine, turn=True, instants=73)


@pytest.fixture(scope="module")
def page(runs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("live")
    with started("--hide-scrollbars") as found:
        page = ViewerPage(found)

        def opened(name):
            file = folder / f"{name}.html"
            if not file.exists():
                plots = ("motor.power", "tilt", "A.force") if name == "units" else ()
                live_view(runs[name], plots=plots).save(file)
            page.open(file)
            return page

        yield opened
        assert page.problems == [] and page.requests == []


def number(name):
    """The number of the file that gives a name, in the page."""
    return f"mbody.viewer.live.part.numbers.find((one) => '{name}' in one.factors)"


def slid(browser, name, *values):
    """Move the slider of a number as on a page where the whole motion takes long."""
    browser.read("mbody.viewer.live.took = 100")
    for value in values:
        browser.read(f"mbody.viewer.live.slide({number(name)}, {value!r})")


def value(browser, name):
    return browser.read(f"mbody.viewer.main.value({name!r})")


def assert_turn(browser, run, names):
    for name in names:
        body, _, key = name.rpartition(".")
        here = run.effort(body) if key == "effort" else getattr(run.reaction(body), key)
        there = np.array(browser.read(f"Array.from(mbody.viewer.main.history({name!r}))"))
        assert np.abs(there - here).max() <= CLOSE * np.abs(here).max(), name


def test_while_a_slider_moves_the_shown_instant_is_solved_and_the_page_says_what_is_not(page, runs):
    browser, run, k = page("pump"), runs["pump"], 40
    browser.read(f"mbody.seek({{instant: {k}}})")
    before = browser.read("mbody.viewer.plots[1].curves.get(0).getAttribute('d')")
    slid(browser, "AB", 5.9, 5.8, 5.6, 5.5)
    said = browser.read("mbody.viewer.live.message.textContent")
    assert said == "The picture is solved; diagrams, paths and peaks follow when the slider rests."
    assert browser.read("mbody.viewer.plotBox.classList.contains('stale')")
    assert browser.read("mbody.viewer.plots[1].curves.get(0).getAttribute('d')") == before
    system = run.system.with_values({"AB": 5.5})
    drive = {"motor": (run.driven("motor")[0][k], run.driven("motor")[1][k])}
    there = mbody.kinetostatics(system, drive=drive)
    peak = np.abs(run.effort("motor")).max()
    assert abs(value(browser, "motor.effort") - there.effort("motor")[0]) <= CLOSE * peak
    angle = np.degrees(there["coupler"].angle[0])
    assert value(browser, "coupler.angle") == pytest.approx(angle, abs=1e-7)
    # at rest, after 150 ms without a movement, all is solved; the page is at the instant again
    browser.wait("!mbody.viewer.live.calm")
    assert browser.read("mbody.viewer.live.message.textContent") == ""
    assert not browser.read("mbody.viewer.plotBox.classList.contains('stale')")
    assert browser.read("mbody.viewer.plots[1].curves.get(0).getAttribute('d')") != before
    assert browser.read("mbody.viewer.main.here === null && mbody.state().instant") == k
    again = mbody.kinetostatics(system, turn=True, instants=181)
    assert_turn(browser, again, ("motor.effort", "B.fx", "E.fy", "guide.fy"))


def test_the_slider_itself_does_that_and_its_release_ends_it(page, runs):
    browser = page("pump")
    browser.read("mbody.viewer.live.took = 100")
    browser.read(
        "window.slider = [...mbody.viewer.shadowRoot.querySelectorAll('.live .row input')]"
        ".find((e) => e.getAttribute('aria-label').startsWith('coupler.weight'));"
        "slider.value = 1.2 * slider.value; slider.dispatchEvent(new Event('input'))"
    )
    browser.wait("mbody.viewer.live.calm")
    browser.read("slider.dispatchEvent(new Event('change'))")
    browser.wait("!mbody.viewer.live.calm")
    now = browser.read(f"{number('coupler.weight')}.now")
    other = runs["pump"].system.with_values({"coupler.weight": now})
    again = mbody.kinetostatics(other, turn=True, instants=181)
    assert_turn(browser, again, ("motor.effort", "C.fx"))


def test_what_closes_here_but_makes_no_turn_is_refused_when_the_slider_rests(page, runs):
    browser, run = page("norton"), runs["norton"]
    slid(browser, "crank.A.x", 5.0, 6.5, 8.0, 9.5)
    assert browser.read("mbody.viewer.live.message.textContent").startswith("The picture is solved")
    browser.read("mbody.viewer.live.settle()")
    said = browser.read("mbody.viewer.live.message.textContent")
    assert "cannot be followed beyond" in said and said.endswith("The page stays where it was.")
    assert browser.read(f"{number('crank.A.x')}.now") == run.system.values["crank.A.x"]
    assert_turn(browser, run, ("motor.effort", "A.fx"))
    assert browser.read("mbody.viewer.main.here") is None
    x = browser.read("mbody.viewer.main.scene.shapes.find((s) => s.n === 'pin:A').p[0]")
    slid(browser, "crank.A.x", 4.1)
    browser.read("mbody.viewer.live.settle(); mbody.viewer.live.reset()")
    again = browser.read("mbody.viewer.main.scene.shapes.find((s) => s.n === 'pin:A').p[0]")
    assert again == pytest.approx(x, abs=1e-9)


def test_free_bodies_of_changed_numbers_close_and_are_those_of_mbody(page, runs):
    browser, run = page("norton"), runs["norton"]
    browser.read("mbody.viewer.toggle('free')")
    values = {"crank.weight": 4.0, "coupler.inertia": 1.0, "F_P.value": 50.0}
    factors = {name: browser.read(f"{number(name)}.factors[{name!r}]") for name in values}
    given = {name: one / factors[name] for name, one in values.items()}
    assert browser.read(f"mbody.viewer.live.set({json.dumps(given)})")
    other = mbody.kinetostatics(run.system.with_values(values), turn=True, instants=len(run))
    for k in (0, 77, 200):
        browser.read(f"mbody.seek({{instant: {k}}})")
        for body in run:
            forces, gap, force, moment, greatest = browser.read(
                f"(() => {{ const f = mbody.viewer.free.forces('{body}');"
                "return [f.acting.map((o) => [o.c, o.fx, o.fy]), f.gap, f.force, f.moment,"
                "f.greatest]; })()"
            )
            # what the live page promises, of the peaks that its numbers go by
            peak = other.reaction("A").magnitude.max()
            assert gap <= 10.0 * CLOSE * peak and moment <= 10.0 * CLOSE * peak * greatest / force
            here = {one.cause: one for one in free_body(other, body, k)}
            for cause, fx, fy in forces:
                there = [here[cause].fx, here[cause].fy]
                assert [fx, fy] == pytest.approx(there, abs=10.0 * CLOSE * peak), (body, cause)


def test_what_a_live_page_cannot_solve_has_no_free_body_and_the_page_says_so(page):
    browser = page("pump")
    browser.read("mbody.viewer.toggle('free'); mbody.viewer.free.show('ram')")
    assert browser.read("mbody.viewer.free.message.textContent") == ""
    assert browser.read("mbody.viewer.live.set({'crank.weight': 300})")
    said = browser.read("mbody.viewer.free.message.textContent")
    assert said == (
        "There is no diagram here: cylinder has no value, which this page has for the recorded "
        "instants and numbers only."
    )
    assert browser.read("mbody.viewer.free.diagram.hasAttribute('hidden')")
    browser.read("mbody.viewer.free.show('coupler')")
    assert browser.read("mbody.viewer.free.message.textContent") == ""
    browser.read("mbody.viewer.live.reset(); mbody.viewer.free.show('ram')")
    assert browser.read("mbody.viewer.free.message.textContent") == ""


def mouse(browser, kind, x, y):
    held = {"buttons": 1} if kind != "mouseReleased" else {}
    browser.call(
        "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1, **held
    )


def test_a_pin_of_two_drivers_goes_where_the_pointer_is(page, runs):
    """By the mouse; then the forces there against kinetostatics with both drivers."""
    browser, run = page("five"), runs["five"]
    where = (
        "(() => { const b = mbody.viewer.picture.layers.world.querySelector("
        "'[data-name=\"pin:P\"]').getBoundingClientRect();"
        "return [b.left + b.width / 2, b.top + b.height / 2]; })()"
    )
    x, y = browser.read(where)
    mouse(browser, "mousePressed", x, y)
    for step in range(1, 11):
        mouse(browser, "mouseMoved", x + 3 * step, y + 2 * step)
        browser.read("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 30)))")
    mouse(browser, "mouseReleased", x + 30, y + 20)
    assert browser.read(where) == pytest.approx([x + 30, y + 20], abs=0.5)
    values = browser.read("mbody.viewer.live.present()")
    moved = [abs(values[name] - run.driven(name)[0][0]) for name in ("one", "two")]
    assert min(moved) > 0.01
    there = mbody.kinetostatics(run.mechanism, drive=values)
    for name in ("one", "two"):
        peak = np.abs(run.effort(name)).max()
        assert abs(value(browser, f"{name}.effort") - there.effort(name)[0]) <= CLOSE * peak
    # each has a slider of its own
    browser.read("mbody.viewer.live.walk({two: 1.0})")
    assert browser.read("mbody.viewer.live.present().two") == pytest.approx(1.0)
    assert browser.read("mbody.viewer.live.present().one") == pytest.approx(values["one"])


def test_a_model_in_json_is_live_and_gives_its_changed_file(page, runs):
    browser, run = page("json"), runs["json"]
    assert browser.read("mbody.viewer.live.set({'crank.weight': 4})")
    text = browser.read("mbody.viewer.live.file()")
    again = mbody.assemble(mbody.from_toml(text))
    assert again.values["crank.weight"] == pytest.approx(
        4.0 * browser.read(f"{number('crank.weight')}.factors['crank.weight']"), rel=1e-14
    )
    assert_turn(browser, mbody.kinetostatics(again, turn=True, instants=91), ("motor.effort",))
    assert run.mechanism.name == again.mechanism.name


def test_of_several_designs_only_the_first_is_live_and_the_page_says_so(page, runs, tmp_path):
    first = runs["norton"]
    second = mbody.kinetostatics(first.system.with_values({"crank.A.x": 5.0}), turn=True)
    live_view({"short": first, "long": second}).save(tmp_path / "two.html")
    browser = page("norton")
    assert "designs" not in browser.read("mbody.viewer.root.querySelector('.live').textContent")
    browser.open(tmp_path / "two.html")
    said = browser.read("mbody.viewer.root.querySelector('.live').textContent")
    assert (
        "Of the 2 designs only the first, short, is solved again; the others are recorded." in said
    )
    before = browser.read("Array.from(mbody.viewer.motions[1].history('A.force'))")
    # beside the two the recorded first one stands as soon as it is another
    shown = "mbody.viewer.pictures.filter((p) => !p.root.hidden).map((p) => p.caption.textContent)"
    browser.read("mbody.viewer.arrange('side by side')")
    assert browser.read(shown) == ["short", "long"]
    assert browser.read("mbody.viewer.live.set({'crank.A.x': 4.4})")
    assert browser.read(shown) == ["short", "long", "recorded"]
    assert browser.read("Array.from(mbody.viewer.motions[1].history('A.force'))") == before
    browser.read("mbody.viewer.live.reset()")
    assert browser.read(shown) == ["short", "long"]


def test_bars_of_modes_are_those_of_the_present_numbers(page):
    """Signs of sliding of every frictional joint, as `kinetostatics` has them with another
    length.
    """
    browser = page("rough")
    system = mbody.assemble(rough_press())
    for length in (0.2, 0.15):
        browser.read(f"mbody.viewer.live.change({{'rod.B.x': {length}}})")
        run = mbody.kinetostatics(system.with_values({"rod.B.x": length}), turn=True, instants=73)
        rows = browser.read("mbody.viewer.modes.rows.map(({ name, spans }) => [name, spans])")
        assert [name for name, _ in rows] == list(run.losses)
        here = {row.name: row for row in mode_rows(run, np.degrees(run.driven("motor")[0]))[0]}
        for name, spans in rows:
            own = here[name].spans
            assert [mode for *_, mode in spans] == [span.mode for span in own]
            ends = [[span.low, span.high] for span in own]
            np.testing.assert_allclose([span[:2] for span in spans], ends, atol=1e-6)
        drawn = "mbody.viewer.modes.svg.querySelectorAll('[data-mode]').length"
        assert browser.read(drawn) == sum(len(spans) for _, spans in rows)
    assert len({str(spans) for _, spans in rows}) > 1


QUANTITIES = "motor.power tilt loss A.force ram.x lever.omega lever.angle motor.value motor.effort"


@pytest.mark.parametrize("name", QUANTITIES.split())
def test_recorded_and_solved_numbers_are_in_the_units_that_are_chosen(page, runs, name):
    browser, run = page("units"), runs["units"]
    measure = run.mechanism.measures.get(name, Measure(name))
    values, _, unit = shown_measure(run, measure)
    assert browser.read(f"mbody.viewer.unitOf({name!r})") == unit
    peak = np.abs(values).max()
    for motion_of in ("mbody.viewer.live.motion.recorded", "mbody.viewer.main"):
        history = f"{motion_of}.history({name!r})"
        found = browser.read(f"Array.from({history}, (v) => mbody.viewer.inUnit({name!r}, v))")
        # recorded numbers have seven digits
        assert np.abs(np.array(found) - values).max() <= 1e-6 * peak, motion_of
