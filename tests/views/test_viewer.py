"""The page that plays a motion: its numbers are the Solution's, and it needs nothing else."""

import functools
import hashlib
import json
import re
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.cli import main
from mbody.views.page import MODULE, module_text
from mbody.views.shapes import motion
from tests.support.browser import browser as started
from tests.support.browser import chromium
from tests.support.viewer_page import ViewerPage

#: What the page promises, as a part of the peak of each history.
CLOSE = 1e-6


def scripts(page):
    """The documents of a page."""
    found = re.findall(r'<script type="application/json" id="([\w-]+)">(.*?)</script>', page, re.S)
    return {name: json.loads(text) for name, text in found}


def assert_close(there, here, name):
    there = np.array(there, dtype=float)
    peak = np.nanmax(np.abs(here), initial=0.0)
    assert there.shape == here.shape
    assert np.all(np.isnan(there) | (np.abs(there - here) <= CLOSE * peak)), name


@pytest.fixture(scope="module")
def pump():
    return mbody.kinetostatics(gallery.load("mud_pump_sixbar"), turn=True, instants=720)


def test_the_numbers_of_the_page_are_those_of_the_solution(pump):
    data = scripts(mbody.view(pump).html)["mbody-data"]
    assert data["mbody"] == mbody.__version__ and data["analysis"] == "kinetostatics"
    assert_close(data["t"], pump.t, "t")
    for body in pump:
        for key in ("x", "y", "vx", "vy", "omega", "ax", "ay", "alpha"):
            assert_close(data["bodies"][body][key], getattr(pump[body], key), f"{body}.{key}")
        assert_close(data["bodies"][body]["angle"], np.degrees(pump[body].angle), body)
    for joint in pump.mechanism.joints:
        for key in ("fx", "fy", "torque"):
            here = getattr(pump.reaction(joint.name), key)
            assert_close(data["reactions"][joint.name][key], here, f"{joint.name}.{key}")
    for name, text in data["points"].items():
        assert_close(text["vy"], pump.point(name).vy, name)
    for name in pump.mechanism.measures:
        values = pump.measure(name)
        assert_close(data["measures"][name], values, name)


def test_the_page_says_how_it_was_made_and_has_the_model(pump):
    found = scripts(mbody.view(pump, command="mbody view pump").html)
    made = found["mbody-scene"]["made"]
    assert made["command"] == "mbody view pump"
    assert found["mbody-data"]["digest"] == hashlib.sha256(made["file"].encode()).hexdigest()
    again = mbody.kinetostatics(mbody.from_toml(made["file"]), turn=True, instants=720)
    assert np.allclose(again.effort("motor"), pump.effort("motor"), rtol=1e-9)


def test_a_chosen_diagram_has_its_unit_and_numbers(pump):
    scene = scripts(mbody.view(pump, plots=["crank.angle", "2*B.force"]).html)["mbody-scene"][
        "scene"
    ]
    angle, force = scene["plots"]
    assert (angle["unit"], force["unit"]) == ("deg", "lbf")
    assert_close(angle["values"], np.degrees(pump["crank"].angle), "angle")
    assert_close(force["values"], 2.0 * pump.reaction("B").magnitude, "force")


def test_what_a_model_says_cannot_end_its_script():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    text = mbody.to_toml(machine).replace("four-bar", "</script><script>alert(1)</script>")
    page = mbody.view(mbody.kinematics(mbody.from_toml(text), turn=True)).html
    assert "</script><script>" not in page and page.count("</script>") == 3
    assert scripts(page)["mbody-data"]["model"].startswith("</script>")


def test_a_notebook_shows_the_page_in_a_frame(pump):
    shown = mbody.view(pump)._repr_html_()
    assert (
        shown.startswith('<iframe srcdoc="&lt;!doctype html&gt;') and "<mbody-viewer" not in shown
    )


def test_a_notebook_without_scripts_shows_a_film_and_drawings_as_svg(pump):
    bundle = mbody.view(pump)._repr_mimebundle_()
    assert "<animateTransform" in bundle["image/svg+xml"] and "iframe" in bundle["text/html"]
    drawing = mbody.draw(pump)._repr_mimebundle_()["image/svg+xml"]
    assert drawing.startswith("<?xml") and 'id="link:crank"' in drawing


def test_the_web_component_is_written_beside_its_document(pump, tmp_path):
    mbody.view(pump).save(tmp_path / "pump.json")
    document = json.loads((tmp_path / "pump.json").read_text("utf-8"))
    assert set(document) == {"data", "scene", "others", "made"}
    assert (tmp_path / MODULE).read_text("utf-8") == module_text()
    assert '/*css*/""' not in module_text()


@pytest.mark.slow
def test_the_command_writes_a_page_of_each_kind_of_motion(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["view", "norton_fourbar"]) == 0
    assert main(["view", "free_fourbar", "--to", "0.5", "-o", "free.html"]) == 0
    assert main(["view", "mud_pump", "--vary", "r=5,6", "--over", "turn", "-o", "two.html"]) == 0
    assert main(["view", "slider_crank", "--at", "crank=0,30,60,90", "-o", "at.html"]) == 0
    assert "wrote norton_fourbar.html" in capsys.readouterr().err
    free = scripts((tmp_path / "free.html").read_text("utf-8"))
    assert free["mbody-data"]["analysis"] == "simulate" and free["mbody-data"]["t"][-1] == 0.5
    two = scripts((tmp_path / "two.html").read_text("utf-8"))
    assert [one["scene"]["design"] for one in two["mbody-scene"]["others"]] == ["r = 6"]
    at = scripts((tmp_path / "at.html").read_text("utf-8"))
    angles = at["mbody-data"]["bodies"]["crank"]["angle"]
    # the crank begins at 60 deg: it reaches 0 and 30 deg a turn later
    assert np.allclose(angles, [60, 90, 360, 390], atol=1e-6)


# -- in a browser --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def browser():
    if chromium() is None:
        pytest.skip("there is no chromium on this machine")
    with started("--hide-scrollbars") as found:
        yield ViewerPage(found)


@pytest.fixture(scope="module")
def pages(tmp_path_factory, pump):
    folder = tmp_path_factory.mktemp("pages")

    def page(name):
        file = folder / f"{name}.html"
        if not file.exists():
            run = pump if name == "pump" else motion(gallery.load(name))
            mbody.view(run).save(file)
        return file

    return page


@pytest.mark.browser
def test_the_page_plays_steps_and_seeks_without_error_or_request(browser, pages):
    browser.open(pages("pump"))
    assert browser.read("mbody.state().instants") == 720
    browser.read("mbody.play()")
    browser.wait("mbody.state().instant > 5")
    assert browser.read("mbody.state.playing") is True
    browser.read("mbody.pause()")
    browser.read("mbody.seek({instant: 100})")
    browser.key("ArrowRight")
    assert browser.read("mbody.state().instant") == 101
    browser.key("ArrowLeft")
    browser.key(" ")
    browser.wait("mbody.state().playing")
    browser.key(" ")
    assert browser.read("mbody.state().playing") is False
    browser.key("f")
    assert browser.read("mbody.state().shown.forces") is True
    browser.key("f")
    browser.dark()
    browser.dark(False)
    assert browser.pdf().startswith(b"%PDF")
    assert browser.problems == []
    assert browser.requests == []


@pytest.mark.browser
def test_the_picture_is_where_the_solution_is(browser, pages, pump):
    browser.open(pages("pump"))
    for k in (0, 100, 333, 719):
        browser.read(f"mbody.seek({{instant: {k}}})")
        for body in pump:
            there = browser.read(
                f"Array.from(mbody.viewer.main.pose.slice(5 * {list(pump).index(body) + 1}, "
                f"5 * {list(pump).index(body) + 1} + 3))"
            )
            here = [pump[body].x[k], pump[body].y[k], pump[body].angle[k]]
            assert there == pytest.approx(here, abs=CLOSE * pump.system.length)


@pytest.mark.browser
def test_a_drive_shows_its_torque_beside_forces_and_else_the_way_that_it_turns(
    browser, pages, pump
):
    """As films and drawings with forces; which arrow is there is read from the page itself."""
    browser.open(pages("pump"))
    name = pump.mechanism.drivers[0].name
    shown = (
        "mbody.viewer.pictures[0].drawing.sensed.filter((one) => one[1] === "
        f"'drive:{name}' && one[0].style.display !== 'none').map((one) => one[2])"
    )
    effort, rate = pump.effort(name), pump.driven(name)[1]
    assert effort.min() < 0.0 < effort.max()
    for k in (int(effort.argmin()), int(effort.argmax())):
        browser.read(f"mbody.seek({{instant: {k}}})")
        assert set(browser.read(shown)) == {np.sign(rate[k])}
        browser.key("f")
        assert set(browser.read(shown)) == {np.sign(effort[k])}
        browser.key("f")


@pytest.mark.browser
def test_between_instants_the_picture_is_where_the_motion_is(browser, pages, pump):
    browser.open(pages("pump"))
    t = 0.5 * (pump.t[100] + pump.t[101])
    between = mbody.kinematics(pump.mechanism, t=[0.0, t])
    browser.read("mbody.viewer.main.set(100.5)")
    for n, body in enumerate(pump, 1):
        there = browser.read(f"Array.from(mbody.viewer.main.pose.slice({5 * n}, {5 * n + 2}))")
        here = [between[body].x[1], between[body].y[1]]
        # Hermite's error: h⁴/384 of the fourth derivative, half a degree of crank at 720 instants
        assert there == pytest.approx(here, abs=1e-7 * pump.system.length)


@pytest.mark.browser
def test_the_mouse_over_a_link_shows_its_values(browser, pages):
    browser.open(pages("norton_fourbar"))
    x, y = browser.read(
        "(() => { const b = mbody.viewer.picture.svg.getBoundingClientRect(), m = mbody.viewer;"
        "const l = [...m.picture.layers.world.querySelectorAll('[data-name=\"link:rocker\"]')][0]"
        ".getBoundingClientRect(); return [l.left + l.width / 2, l.top + l.height / 2 + 20]; })()"
    )
    browser.hover(x, y)
    browser.wait("!mbody.viewer.tip.hidden")
    assert "rocker" in browser.read("mbody.viewer.tip.textContent")


@pytest.mark.browser
def test_a_dark_page_prints_light_and_whole(browser, pages):
    browser.open(pages("norton_fourbar"))
    browser.dark()
    browser.call("Emulation.setEmulatedMedia", media="print")
    style = "getComputedStyle(mbody.viewer.root).getPropertyValue('{}').trim()"
    for name in ("--force", "--load", "--drive", "--soft", "--speed", "--c0"):
        color = browser.read(style.format(name))
        assert contrast(color, "#ffffff") > 4.0, (name, color)
    white = "getComputedStyle(document.documentElement).backgroundColor"
    assert browser.read(white) == "rgb(255, 255, 255)"
    browser.size(500, 900)  # a narrow sheet
    wide = "mbody.viewer.picture.svg.getBoundingClientRect().width <= innerWidth"
    assert browser.read(wide) and browser.read("mbody.viewer.picture.svg.hasAttribute('viewBox')")
    browser.size(1280, 900)
    browser.call("Emulation.setEmulatedMedia", media="")
    browser.dark(False)


@pytest.mark.browser
@pytest.mark.parametrize("name", ["flyball_governor", "mud_pump"])
def test_names_do_not_cover_each_other(browser, pages, name):
    browser.open(pages(name))
    browser.read("mbody.viewer.on.forces || mbody.viewer.toggle('forces')")
    covered, seen = browser.covered()
    # a quarter of a name, and what the font differs from its measured width
    assert covered.max() < 0.35 and seen.mean() > 0.5


@pytest.mark.browser
def test_mass_centres_are_switched_off_as_a_whole(browser, pages):
    browser.open(pages("norton_fourbar"))
    shown = (
        "[...mbody.viewer.picture.layers.world.querySelectorAll('[data-name^=\"c\"]')]"
        ".filter((e) => /^(cg|centre):/.test(e.dataset.name) && e.style.display !== 'none').length"
    )
    assert browser.read(shown) == 9
    browser.read("mbody.viewer.toggle('centres')")
    assert browser.read(shown) == 0


@pytest.mark.browser
def test_the_keyboard_alone_reaches_every_control(browser, pages):
    browser.open(pages("norton_fourbar"))
    reached = set()
    for _ in range(40):
        browser.key("Tab")
        reached.add(
            browser.read(
                "(() => { const a = mbody.viewer.shadowRoot.activeElement;"
                "return a ? (a.getAttribute('aria-label') || a.textContent).slice(0, 24) : ''; })()"
            )
        )
    for name in ("Play", "instant", "speed", "zoom in", "Forces", "one instant on", "Model file"):
        assert any(one.startswith(name) for one in reached), (name, reached)
    browser.read("mbody.seek({instant: 10})")
    said = browser.read("mbody.viewer.said.textContent")
    assert said.startswith("instant 11 of 361, angle of crank 70.0°")


def contrast(a, b):
    """Of two colours, by WCAG 2."""

    def light(color):
        color = color.strip().lstrip("#")
        parts = (
            [int(color[n : n + 2], 16) / 255 for n in (0, 2, 4)] if len(color) == 6 else [1, 1, 1]
        )
        linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((light(a), light(b)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.browser
def test_the_web_component_reads_its_document_from_a_server(browser, pump, tmp_path):
    mbody.view(pump).save(tmp_path / "pump.json")
    (tmp_path / "index.html").write_text(
        f'<!doctype html><meta charset=utf-8><link rel=icon href="data:,"><script type=module '
        f'src="{MODULE}"></script><mbody-viewer src="pump.json"></mbody-viewer>',
        "utf-8",
    )

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    handler = functools.partial(Quiet, directory=str(tmp_path))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser.call("Page.navigate", url=f"http://127.0.0.1:{server.server_port}/index.html")
        browser.wait("document.querySelector('mbody-viewer')?.main?.count === 720")
        assert browser.problems == []
        server.shutdown()
