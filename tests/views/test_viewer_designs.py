"""Several designs in a page: ghosted in one picture, or beside each other at one scale."""

import numpy as np
import pytest

import mbody
from mbody import gallery
from tests.support.browser import browser as started
from tests.support.browser import chromium
from tests.support.viewer_page import ViewerPage

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
]

CRANKS = (3.0, 4.0, 5.0)


@pytest.fixture(scope="module")
def runs():
    system = mbody.assemble(gallery.load("norton_fourbar"))
    return {
        f"crank {length}": mbody.kinetostatics(
            system.with_values({"crank.A.x": length}), turn=True, instants=181
        )
        for length in CRANKS
    }


@pytest.fixture(scope="module")
def page(runs, tmp_path_factory):
    file = tmp_path_factory.mktemp("designs") / "designs.html"
    mbody.view(runs).save(file)
    with started("--hide-scrollbars") as found:
        page = ViewerPage(found)
        page.open(file)
        yield page
        assert page.problems == [] and page.requests == []


@pytest.fixture(autouse=True)
def ghosted(page):
    yield
    page.size(1280, 900)
    page.read("mbody.viewer.arrange('ghosted')")


def boxes(page):
    """Place and size of the pictures that are seen."""
    return page.read(
        "mbody.viewer.pictures.filter((p) => !p.root.hidden).map((p) => {"
        "const b = p.svg.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })"
    )


def test_designs_are_ghosted_at_first_and_the_choice_has_a_name(page):
    assert len(boxes(page)) == 1 and page.read("mbody.state().designs") == "ghosted"
    assert page.read("getComputedStyle(mbody.viewer.picture.layers.ghosts).display") != "none"
    name = page.read("mbody.viewer.arrangement.getAttribute('aria-label')")
    texts = page.read("[...mbody.viewer.arrangement.options].map((o) => o.textContent)")
    assert name == "several designs" and texts == ["ghosted", "side by side"]


def test_a_key_puts_them_side_by_side_at_one_scale(page):
    page.read("mbody.viewer.root.focus()")
    page.key("d")
    assert page.read("mbody.state().designs") == "side by side"
    assert page.read("mbody.viewer.said.textContent") == "designs side by side"
    found = boxes(page)
    assert len(found) == 3 and len({tuple(np.round(box[2:], 0)) for box in found}) == 1
    places = [(left, top) for left, top, _, _ in found]
    assert len(set(places)) == 3
    # one scale: the ground, alike in all designs, is at one place in every picture
    far = page.read(
        "mbody.viewer.pictures.map((p) => { const b = p.svg.getBoundingClientRect(),"
        "g = p.layers.world.querySelector('[data-name=\"pin:O4\"]').getBoundingClientRect();"
        "return [g.left + g.width / 2 - b.left, g.top + g.height / 2 - b.top]; })"
    )
    assert np.ptp(np.array(far), axis=0) == pytest.approx([0.0, 0.0], abs=0.01)
    ghosts = page.read("mbody.viewer.picture.layers.ghosts.style.display")
    assert ghosts == "none"
    labels = page.read("mbody.viewer.pictures.map((p) => p.svg.getAttribute('aria-label'))")
    assert all(f"crank {one}" in label for one, label in zip(CRANKS, labels, strict=True))
    page.key("d")
    assert len(boxes(page)) == 1 and page.read("mbody.state().designs") == "ghosted"


def test_one_player_moves_all_to_the_same_angle_of_the_crank(page, runs):
    page.read("mbody.viewer.arrange('side by side')")
    page.read("mbody.seek({instant: 57})")
    first = next(iter(runs.values()))
    for n, run in enumerate(runs.values()):
        there = page.read(f"Array.from(mbody.viewer.motions[{n}].pose.slice(10, 13))")
        here = [run["coupler"].x[57], run["coupler"].y[57], run["coupler"].angle[57]]
        # histories of the page are rounded to 5e-8 of their peak
        assert there == pytest.approx(here, abs=1e-6 * run.system.length)
        where = page.read(
            f"(() => {{ const p = mbody.viewer.pictures[{n}], b = p.svg.getBoundingClientRect(),"
            "g = p.layers.world.querySelector('[data-name=\"pin:B\"]').getBoundingClientRect(),"
            "u = mbody.viewer.main.scene.unit, c = mbody.viewer.camera;"
            "return [(g.left + g.width / 2 - b.left - c.x) * u / c.s,"
            "-(g.top + g.height / 2 - b.top - c.y) * u / c.s]; })()"
        )
        x, y = run.reaction_point("B")
        assert where == pytest.approx([x[57], y[57]], abs=1e-3 * first.system.length)
    page.read("mbody.play()")
    page.wait("mbody.state().instant > 62 || mbody.state().instant < 57")
    page.read("mbody.pause()")


def test_arrows_have_one_length_for_one_force_in_all_pictures(page, runs):
    page.read("mbody.viewer.arrange('side by side'); mbody.viewer.toggle('forces')")
    page.read("mbody.seek({instant: 90})")
    for n, run in enumerate(runs.values()):
        pixels = page.read(
            f"(() => {{ const a = mbody.viewer.pictures[{n}].arrows.find((o) => o.name === "
            "'force:F32'), p = a.path.getAttribute('d').match(/[-\\d.]+/g).map(Number);"
            "return Math.hypot(p[6] - (p[0] + p[12]) / 2, p[7] - (p[1] + p[13]) / 2); })()"
        )
        most = page.read("mbody.viewer.most.forces")
        # the longest of all designs has 90 px; corners are written to 0.1 px
        force = run.reaction("A").magnitude[90]
        assert pixels == pytest.approx(90.0 * force / most, abs=0.3)
    page.read("mbody.viewer.toggle('forces')")


def test_zoom_and_drag_move_all_pictures_and_others_can_be_switched_off(page):
    page.read("mbody.viewer.arrange('side by side'); mbody.viewer.zoom(1.5)")
    matrices = page.read(
        "mbody.viewer.pictures.map((p) => p.layers.world.getAttribute('transform'))"
    )
    assert len(set(matrices)) == 1
    page.key("g")
    assert len(boxes(page)) == 1
    page.key("g")
    assert len(boxes(page)) == 3


@pytest.mark.parametrize("picture", range(3))
def test_names_do_not_cover_each_other_side_by_side(page, picture):
    page.read("mbody.viewer.arrange('side by side')")
    page.read("mbody.viewer.on.forces || mbody.viewer.toggle('forces')")
    covered, seen = page.covered(picture=picture)
    # a quarter of a name, and what the font differs from its measured width
    assert covered.max() < 0.35 and seen.mean() > 0.5
    page.read("mbody.viewer.toggle('forces')")
