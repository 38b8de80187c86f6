"""Pages and reports for those who do not see them, or use no mouse."""

import pytest

import mbody
from mbody import gallery
from mbody.cli import main
from mbody.live import live_view
from mbody.views.shapes import motion
from tests.support.accessibility import violations
from tests.support.browser import browser as started
from tests.support.browser import chromium
from tests.support.viewer_page import ViewerPage

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
]

PAGES = ("recorded", "designs", "live", "free motion", "report", "report of two")

#: Everything of a page is open: diagrams, all arrows, all details, designs side by side.
OPEN = """(() => { const v = mbody.viewer;
for (const key of ['free', 'forces', 'velocities', 'accelerations'])
  if (v.switches[key] && !v.on[key]) v.toggle(key);
for (const one of v.shadowRoot.querySelectorAll('details')) one.open = true;
if (v.motions.length > 1) v.arrange('side by side');
return 0; })()"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")

    def file(name):
        path = folder / f"{name.replace(' ', '_')}.html"
        if path.exists():
            return path
        run = motion(gallery.load("free_fourbar" if name == "free motion" else "norton_fourbar"))
        if name == "designs":
            other = run.system.with_values({"crank.A.x": 5.0})
            mbody.view({"a": run, "b": mbody.kinetostatics(other, turn=True)}).save(path)
        elif name == "live":
            pytest.importorskip("numba", reason="it builds the core for browsers")
            pytest.importorskip("ziglang", reason="it builds the core for browsers")
            live_view(run).save(path)
        elif name.startswith("report"):
            two = ["--compare", "AB=6.5"] if name.endswith("two") else []
            assert main(["report", "mud_pump_sixbar", *two, "-o", str(path)]) == 0
        else:
            mbody.view(run).save(path)
        return path

    return file


@pytest.fixture(scope="module")
def browser():
    with started("--hide-scrollbars") as found:
        yield ViewerPage(found)


def opened(browser, files, name, dark):
    browser.size(1280, 1000)
    if name.startswith("report"):
        browser.browser.open(files(name))
        browser.dark(dark)
        browser.read("document.querySelectorAll('details').forEach((e) => (e.open = true))")
    else:
        browser.open(files(name))
        browser.dark(dark)
        browser.read(OPEN)


@pytest.mark.parametrize("dark", (False, True))
@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing(browser, files, name, dark):
    opened(browser, files, name, dark)
    assert violations(browser.browser) == []
    browser.size(420, 900)  # narrow: no part is wider than the window
    assert violations(browser.browser) == []
    browser.dark(False)
