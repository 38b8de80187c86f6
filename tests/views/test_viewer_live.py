"""The live page: what it solves is what mbody solves, and its picture is that of its numbers."""

import json
import re
import tomllib
from importlib.util import find_spec

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.image.model_image import changeable_numbers
from mbody.live import live_view
from mbody.live.live_view import file_numbers, live_part
from mbody.views.scene import scene, sketched
from mbody.views.shapes import Pose, motion
from tests.support.browser import browser as started
from tests.support.browser import chromium
from tests.support.cases import first_fast
from tests.support.viewer_page import ViewerPage

#: What the page promises, as a part of the peak of each quantity.
CLOSE = 1e-9

live = pytest.mark.skipif(
    find_spec("numba") is None or find_spec("ziglang") is None,
    reason="numba and ziglang build the core for browsers",
)
in_browser = [
    pytest.mark.browser,
    live,
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
]


def marked(test):
    for mark in in_browser:
        test = mark(test)
    return test


# -- numbers and their places in the file ---------------------------------------------------------


@first_fast("name", gallery.names(), 16)
def test_the_cut_text_gives_every_number_that_it_claims(name):
    machine = gallery.load(name)
    system = mbody.assemble(machine)
    found = file_numbers(machine, list(changeable_numbers(system).rules))
    text = found.parts[0]
    for number, part in zip(found.numbers, found.parts[1:], strict=True):
        text += repr(number.value) + part
    again = mbody.assemble(mbody.from_toml(text))
    assert again.values == pytest.approx(system.values, rel=1e-14)
    for number in found.numbers:
        for key, factor in number.factors.items():
            assert number.value * factor == pytest.approx(system.values[key], rel=1e-14, abs=1e-300)


@live
def test_an_arrow_of_either_direction_leaves_numbers_changeable(runs):
    """The effort of the motor changes its sign in a turn, so that its arrow is drawn twice."""
    run = runs["slider_crank"]
    arrows = [one for one in scene(run).shapes if one.look.name.startswith("driver:")]
    assert {one.sign_condition for one in arrows} == {("drive:motor", 1.0), ("drive:motor", -1.0)}
    part = live_part(run)
    assert part["numbers"] and not any(one["why"] for one in part["numbers"])


# -- in a browser ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def runs():
    return {
        "pump": mbody.kinetostatics(gallery.load("mud_pump_sixbar"), turn=True, instants=720),
        **{
            name: motion(gallery.load(name))
            for name in (
                "norton_fourbar",
                "free_fourbar",
                "slider_crank",
                "peaucellier",
                "quick_return",
                "toggle_press",
            )
        },
    }


@pytest.fixture(scope="module")
def browser():
    if chromium() is None:
        pytest.skip("there is no chromium on this machine")
    with started() as found:
        yield ViewerPage(found)


@pytest.fixture(scope="module")
def files(tmp_path_factory, runs):
    folder = tmp_path_factory.mktemp("live")
    for name, run in runs.items():
        live_view(run).save(folder / f"{name}.html")
    return {name: folder / f"{name}.html" for name in runs}


@pytest.fixture
def page(browser, files):
    """Opens a page, and looks afterwards whether it complained or requested anything."""

    def opened(name):
        browser.open(files[name])
        return browser

    yield opened
    assert browser.problems == [] and browser.requests == []


def states(browser, names):
    """What the page has where it stands, by name."""
    found = browser.read(f"{json.dumps(names)}.map((name) => mbody.viewer.main.value(name))")
    return dict(zip(names, found, strict=True))


def quantities(run):
    """Histories of positions, of forces and of efforts, by name."""
    found = {}
    for body in run:
        for key in ("x", "y", "vx", "ay"):
            found[f"{body}.{key}"] = getattr(run[body], key)
        found[f"{body}.angle"] = np.degrees(run[body].angle)
    for joint in run.mechanism.joints:
        reaction = run.reaction(joint.name)
        found |= {f"{joint.name}.fx": reaction.fx, f"{joint.name}.fy": reaction.fy}
    for driver in run.mechanism.drivers:
        found[f"{driver.name}.effort"] = run.effort(driver.name)
    return found


def peaks(run):
    """The greatest of each kind of quantity: of forces of all joints, of places of all bodies."""
    own = quantities(run)
    kinds = {name: name.rpartition(".")[2].replace("y", "x") for name in own}
    most = {}
    for name, values in own.items():
        most[kinds[name]] = max(most.get(kinds[name], 0.0), float(np.abs(values).max()))
    return {name: most[kind] for name, kind in kinds.items()}


def assert_turns_agree(browser, run):
    """All histories of the page with those of a run of as many instants."""
    limits = peaks(run)
    for name, here in quantities(run).items():
        there = np.array(browser.read(f"Array.from(mbody.viewer.main.history({name!r}))"))
        assert np.abs(there - here).max() <= CLOSE * limits[name], name


def middle(browser, name):
    """Where a shape is on the screen."""
    return browser.read(
        "(() => { const b = mbody.viewer.picture.layers.world.querySelector("
        f"'[data-name=\"{name}\"]').getBoundingClientRect();"
        "return [b.left + b.width / 2, b.top + b.height / 2]; })()"
    )


def mouse(browser, kind, x, y):
    held = {"buttons": 1} if kind != "mouseReleased" else {}
    browser.call(
        "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1, **held
    )


@pytest.mark.slow
@marked
def test_a_dragged_crank_has_the_forces_of_mbody(page, runs):
    """By the mouse, over a quarter of a turn; every state against kinetostatics there."""
    browser, run = page("pump"), runs["pump"]
    names, limits, values = list(quantities(run)), peaks(run), []
    radius = browser.read("6 * mbody.viewer.camera.s / mbody.viewer.main.scene.unit")
    x, y = middle(browser, "pin:A")
    mouse(browser, "mousePressed", x + radius, y)
    for degrees in range(0, 91, 15):
        turn = np.radians(degrees)
        mouse(browser, "mouseMoved", x + radius * np.cos(turn), y - radius * np.sin(turn))
        browser.read("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 30)))")
        if not degrees:
            continue
        (value,) = browser.read("Object.values(mbody.viewer.live.present())")
        there = mbody.kinetostatics(
            run.mechanism, drive={"motor": (value, run.driven("motor")[1][0])}
        )
        found = states(browser, names)
        for name, here in quantities(there).items():
            assert abs(found[name] - here[0]) <= CLOSE * limits[name], (degrees, name)
        values.append(value)
    mouse(browser, "mouseReleased", x, y - radius)
    # a pixel of the screen is half a degree of this crank
    assert np.degrees(values) == pytest.approx(range(15, 91, 15), abs=1.5)
    assert browser.read("mbody.viewer.live.message.textContent") == ""


@marked
def test_loads_that_follow_time_are_those_of_the_instant(page, runs):
    """The force on the ram of the shaper goes by time: a dragged crank takes that of its angle."""
    browser, run = page("quick_return"), runs["quick_return"]
    effort, value = run.effort("motor"), run.driven("motor")[0]
    assert np.ptp(run.load("cutting").force) > 0.0
    for k in (40, 120, 200, 310):
        browser.read(f"mbody.viewer.live.walk({{motor: {float(value[k])!r}}})")
        there = browser.read("mbody.viewer.main.value('motor.effort')")
        assert abs(there - effort[k]) <= CLOSE * np.abs(effort).max()


@marked
def test_a_dragged_pin_goes_to_the_pointer_as_near_as_it_can(page):
    browser = page("slider_crank")
    x, y = middle(browser, "block:guide")
    mouse(browser, "mousePressed", x, y)
    for step in range(1, 11):
        mouse(browser, "mouseMoved", x - 4 * step, y - 20)
        browser.read("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 30)))")
    mouse(browser, "mouseReleased", x - 40, y - 20)
    there, _ = middle(browser, "block:guide")
    assert there == pytest.approx(x - 40, abs=0.5)


@marked
def test_numbers_that_change_give_the_turn_of_mbody(page, runs):
    browser, run = page("pump"), runs["pump"]
    assert_turns_agree(browser, run)
    assert browser.read("mbody.viewer.live.set({'coupler.weight': 250, 'crank.inertia': 60})")
    values = {"coupler.weight": 250.0, "crank.inertia": 60.0}
    other = run.system.with_values(values)
    assert_turns_agree(browser, mbody.kinetostatics(other, turn=True, instants=720))
    assert browser.read("mbody.viewer.live.set({AB: 5, ED: 6.5, speed: 90})")
    other = other.with_values({"AB": 5.0, "ED": 6.5, "speed": 90 * 2 * np.pi / 60})
    assert_turns_agree(browser, mbody.kinetostatics(other, turn=True, instants=720))
    rows = browser.read("mbody.viewer.live.table.querySelectorAll('tbody tr').length")
    assert rows > 5 and browser.read("mbody.viewer.state().shown.ghosts")
    browser.read("mbody.viewer.live.reset()")
    assert_turns_agree(browser, run)


LENGTHS = {
    "norton_fourbar": {
        "rocker.B.x": 12.0,
        "crank.A.x": 4.5,
        "ground.O4.x": 17.0,
        "coupler.cg.r": 6,
    },
    "pump": {"AB": 5.0, "ED": 6.5, "DF": 17.0, "AE": 19.0, "cylinder.clearance": 4.0},
    "slider_crank": {"crank": 0.25, "rod": 1.0},
    "toggle_press": {"arm": 0.21, "mu": 0.125, "pin": 0.0195},
}


@marked
@pytest.mark.parametrize("name", LENGTHS)
def test_shapes_are_those_that_mbody_draws_for_the_changed_numbers(page, runs, name):
    """Every outline in the page against one made in Python for the same numbers and position."""
    browser, run = page(name), runs[name]
    # the page has numbers in the units of the file
    factors = browser.read(
        "Object.assign({}, ...mbody.viewer.live.part.numbers.map((one) => one.factors))"
    )
    given = {key: value / factors[key] for key, value in LENGTHS[name].items()}
    assert browser.read(f"mbody.viewer.live.set({json.dumps(given)})")
    there = browser.read(
        "mbody.viewer.main.scene.shapes.map((s) => { const m = mbody.viewer.main,"
        "c = m.scene.carriers[s.c], at = [], wide = c.x ? 3 : 2;"
        "for (let k = 0; k < s.p.length; k += wide) if (s.p[k] !== null)"
        "at.push(m.carried(s.c, s.p, k, wide));"
        "return [s.n, at, s.r ?? 0]; })"
    )
    drawn = scene(run)
    whole = {"t": run.t} if name == "toggle_press" else {"turn": True, "instants": len(run)}
    changed = mbody.kinetostatics(run.system.with_values(LENGTHS[name]), **whole)
    sketch = sketched(Pose(changed, 0), drawn.unit, drawn.small)
    shapes = sorted(sketch.record.shapes, key=lambda shape: shape.look.z)
    assert [name for name, _, _ in there] == [s.look.name.removesuffix(".head") for s in shapes]
    looked = 0
    for (own, points, radius), shape in zip(there, shapes, strict=True):
        if own.startswith(("driver:", "torque:", "support:")) or not own:
            continue  # signs: they have no dimension
        axes = shape.carrier.axes(changed)
        here = shape.carrier.in_world(shape.points, axes, 0)
        points = np.array(points)
        apart = np.hypot(*(points[:, None] - here[None]).T)
        assert abs(radius - shape.radius) < 1e-6 * run.system.length, own
        # corners of round ends lie at other angles: a tenth of a point of the paper
        assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 0.6 * drawn.unit, own
        looked += 1
    assert looked >= 7


@marked
def test_a_free_motion_runs_as_simulate_does(page, runs):
    browser, run = page("free_fourbar"), runs["free_fourbar"]
    assert browser.read("mbody.viewer.live.way.kind") == "run"
    browser.read("mbody.viewer.live.run()")
    browser.wait("mbody.viewer.live.clock > 0.2")
    browser.read("mbody.viewer.live.run()")
    paused = browser.read("mbody.viewer.live.clock")
    assert (
        browser.read("new Promise((done) => setTimeout(() => done(mbody.viewer.live.clock), 100))")
        == paused
    )
    browser.read("mbody.viewer.live.restart()")
    assert browser.read("mbody.viewer.main.here") is None
    browser.read(
        "(() => { const l = mbody.viewer.live; l.model.start({ until: 100 }); l.started = true;"
        "l.clock = 0; for (let k = 0; k < 60; k++) l.onward(1 / 60); })()"
    )
    there = mbody.simulate(run.mechanism, 1.0)
    for name, here in quantities(there).items():
        found = browser.read(f"mbody.viewer.main.value({name!r})")
        # both integrate to 1e-9: the steps are others
        assert found == pytest.approx(here[-1], abs=1e-6 * np.abs(here).max() + 1e-9), name
    assert browser.read("mbody.viewer.live.set({'rocker.weight': 12})")
    other = mbody.simulate(
        run.system.with_values({"rocker.weight": 12.0}), 10.0, times=runs_t(browser)
    )
    there = np.array(browser.read("Array.from(mbody.viewer.main.history('crank.angle'))"))
    # ten seconds of a free motion: rounding grows
    assert np.abs(there - np.degrees(other["crank"].angle)).max() < 1e-6 * 360.0


def runs_t(browser):
    return np.array(browser.read("Array.from(mbody.viewer.main.t)"))


@marked
def test_the_changed_model_file_is_that_of_the_page(page, runs):
    browser = page("pump")
    assert browser.read("mbody.viewer.live.set({AB: 5.25, 'cylinder.delivery': 80, speed: 50})")
    text = browser.read("mbody.viewer.live.file()")
    tables = tomllib.loads(text)
    assert tables["parameters"]["AB"] == "5.25 in" and tables["parameters"]["speed"] == "50 rpm"
    system = mbody.assemble(mbody.from_toml(text))
    names = browser.read("mbody.viewer.live.model.numbers")
    there = browser.read(
        "mbody.viewer.live.model.numbers.map((n) => mbody.viewer.live.model.get(n))"
    )
    for name, value in zip(names, there, strict=True):
        assert value == pytest.approx(system.values[name], rel=1e-14, abs=1e-300), name
    assert_turns_agree(browser, mbody.kinetostatics(system, turn=True, instants=720))


@marked
def test_what_cannot_be_is_a_sentence_and_the_page_stays(page, runs):
    browser = page("peaucellier")
    low, high = browser.read(
        "[0, 1].map((n) => mbody.viewer.live.driveInputs[0].range[n ? 'max' : 'min'])"
    )
    browser.read("mbody.viewer.live.walk({motor: 0.9})")
    good = browser.read("mbody.viewer.main.value('crank.angle')")
    browser.read("mbody.viewer.live.guarded(() => mbody.viewer.live.walk({motor: 8}))")
    said = browser.read("mbody.viewer.live.message.textContent")
    assert "cannot be followed beyond" in said and "dead centre" in said, (low, high, good)
    assert said.endswith("The page stays where it was.")
    angle = browser.read("mbody.viewer.main.value('crank.angle')")
    assert np.isfinite(angle) and float(low) - 30 <= angle <= float(high) + 30
    browser.read("mbody.viewer.live.walk({motor: 0.9})")  # and goes on from there
    assert browser.read("mbody.viewer.main.value('crank.angle')") == pytest.approx(good, abs=1e-6)
    browser = page("pump")
    before = browser.read("mbody.viewer.main.value('motor.effort')")
    assert browser.read("mbody.viewer.live.set({AB: 60})") is False
    assert "AB" in browser.read("mbody.viewer.live.message.textContent")
    assert browser.read("mbody.viewer.live.model.get('AB')") == 6.0
    assert browser.read("mbody.viewer.main.value('motor.effort')") == before
    assert browser.read("mbody.viewer.live.set({'crank.weight': -1})") is False
    said = browser.read("mbody.viewer.live.message.textContent")
    assert said.startswith("'crank.weight' cannot be -1 lbf")


@marked
def test_the_keyboard_drives_the_crank(page):
    browser = page("norton_fourbar")
    browser.read("mbody.viewer.live.driveInputs[0].range.focus()")
    before = browser.read("mbody.viewer.main.value('crank.angle')")
    for _ in range(4):
        browser.key("ArrowRight")
    after = browser.read("mbody.viewer.main.value('crank.angle')")
    assert after == pytest.approx(before + 2.0, abs=0.3)  # half a degree a key
    assert (
        browser.read("mbody.viewer.live.driveInputs[0].range.getAttribute('aria-label')")
        == "motor in deg"
    )


@marked
def test_a_browser_that_cannot_run_the_core_plays_the_recorded_motion(browser, files, tmp_path):
    text = files["norton_fourbar"].read_text("utf-8")
    broken = re.sub(r'"core":"[^"]+"', '"core":"AAAA"', text)
    assert broken != text
    (tmp_path / "broken.html").write_text(broken, "utf-8")
    browser.open(tmp_path / "broken.html")
    assert browser.read("mbody.viewer.live === null && mbody.state().instants") == 361
    assert "cannot solve the model again" in browser.read("mbody.viewer.root.textContent")
