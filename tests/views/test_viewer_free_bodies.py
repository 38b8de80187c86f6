"""Free-body diagrams in a page: the forces are the Solution's, and their polygons close."""

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.analysis.driven.free_body import free_body, member_forces
from mbody.views.acting import acting_on
from mbody.views.free_bodies import NUMBER
from mbody.views.page import LINKS
from mbody.views.shapes import Pose, motion
from tests.support.browser import browser as started
from tests.support.browser import chromium
from tests.support.cases import first_fast
from tests.support.viewer_page import ViewerPage

in_browser = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="there is no chromium"),
]

#: Histories of a page are rounded to 8 digits of their peaks (`page_data.KEPT`).
RECORDED = 5e-8
#: Joints, a cylinder, gravity, gears with couplings, a cam, rolling, springs in free motion, a
#: driver of a distance, a field that turns.
MODELS = (
    *("norton_fourbar", "mud_pump_sixbar", "scissor_lift", "planetary_train", "cam_follower"),
    *("vehicle", "free_fourbar", "porter_governor", "andrews_squeezer", "quick_return"),
)


@pytest.fixture(scope="module")
def views():
    return {name: mbody.view(motion(gallery.load(name))) for name in MODELS}


def told(view, body, k):
    """What the document says of the forces on a body, worked out here: {(cause, key): values}."""
    document = view.document
    data, scene = document["data"], document["scene"]
    free = scene["free"]

    def history(name):
        owner, _, key = name.rpartition(".")
        if key == "effort":
            return data["efforts"][owner][k]
        tables = (data["bodies"], data["reactions"], data["loads"])
        return next(table[owner][key][k] for table in tables if owner in table)

    def value(one):
        if not isinstance(one, dict):
            return one
        mass, inertia = free["masses"][body]
        by = (
            one.get("by", 1) * (mass if "mass" in one else 1) * (inertia if "inertia" in one else 1)
        )
        by *= history(one["of"]) if "of" in one else 1
        return by * (free["histories"][one["own"]][k] if "own" in one else 1)

    return [
        (one["c"], one["k"], value(one["fx"]), value(one["fy"]), value(one["m"]))
        for one in free["bodies"][body]
    ]


def peaks(run):
    """The greatest force of all links over the motion, which rounding of histories goes by."""
    joints = [run.reaction(joint.name).magnitude for joint in run.mechanism.joints]
    inertia = [np.hypot(*run.inertia(body)[:2]) for body in run]
    loads = [np.abs(run.effort(one.name)) for one in run.mechanism.couplings]
    return max(float(np.nanmax(one)) for one in (*joints, *inertia, *loads))


@first_fast("name", MODELS, 1)
def test_the_forces_of_the_document_are_those_of_free_body(views, name):
    view = views[name]
    run = next(iter(view.runs.values()))
    peak = peaks(run)
    for k in np.linspace(0, len(run) - 1, 7).astype(int):
        for body in run:
            here = {(one.cause, one.kind): one for one in free_body(run, body, int(k))}
            there = {(c, kind): forces for c, kind, *forces in told(view, body, k)}
            for key, one in here.items():
                if key not in there:
                    assert one.force == 0.0 and one.torque == 0.0, (body, key)
                    continue
                fx, fy, _ = there[key]
                close = 4.0 * RECORDED * peak
                assert [fx, fy] == pytest.approx([one.fx, one.fy], abs=close), (body, key, k)


def test_results_without_forces_and_crowds_have_no_diagrams():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    view = mbody.view(mbody.kinematics(machine, turn=True, instants=41))
    assert "free" not in view.document["scene"]
    many = mbody.view(motion(gallery.load("n_windows_40")))
    assert len(next(iter(many.runs.values())).mechanism.bodies) > LINKS
    assert "free" not in many.document["scene"]


# -- in a browser ---------------------------------------------------------------------------------


def marked(test):
    for mark in in_browser:
        test = mark(test)
    return test


@pytest.fixture(scope="module")
def page(views, tmp_path_factory):
    if chromium() is None:
        pytest.skip("there is no chromium on this machine")
    folder = tmp_path_factory.mktemp("free")
    with started("--hide-scrollbars") as found:
        page = ViewerPage(found)

        def opened(name):
            file = folder / f"{name}.html"
            if not file.exists():
                views[name].save(file)
            page.open(file)
            return page

        yield opened
        assert page.problems == [] and page.requests == []


@marked
@first_fast("name", MODELS, 2)
def test_polygons_close_to_what_is_recorded_for_every_link(page, views, name):
    browser, run = page(name), next(iter(views[name].runs.values()))
    peak = peaks(run)
    for k in np.linspace(0, len(run) - 1, 5).astype(int):
        browser.read(f"mbody.seek({{instant: {k}}})")
        for body in run:
            count, gap, moment = browser.read(
                f"(() => {{ const f = mbody.viewer.free.forces('{body}');"
                "return [f.acting.length, f.gap, f.moment]; })()"
            )
            # a sum of so many rounded numbers, and of their moments
            assert gap <= 2.0 * count * RECORDED * peak, (body, k)
            assert moment <= 4.0 * count * RECORDED * peak * run.system.length, (body, k)


@marked
@pytest.mark.parametrize("name", ("norton_fourbar", "scissor_lift", "mud_pump_sixbar"))
def test_the_diagram_shows_what_mbody_freebody_draws(page, views, name):
    """Names in the notation of books, sizes and directions, dashed inertia; both figures."""
    browser, run = page(name), next(iter(views[name].runs.values()))
    browser.read("mbody.viewer.toggle('free')")
    k = len(run) // 3
    browser.read(f"mbody.seek({{instant: {k}}})")
    for body in run:
        browser.read(f"mbody.viewer.free.show('{body}')")
        acting = acting_on(free_body(run, body, k), Pose(run, k))
        rows = browser.read(
            "[...mbody.viewer.free.table.tBodies[0].rows].map((r) => "
            "[...r.cells].map((c) => c.textContent))"
        )
        shown = {row[0].replace(" ", ""): row[1:] for row in rows}
        assert len(shown) == len(rows) == len(acting), body
        for one in acting:
            text = plain(one.text)
            size, turn, where = shown[text]
            assert where == one.where
            value = one.torque if one.force is None else float(np.hypot(*one.force))
            number = float(size.split()[0].replace("−", "-").replace("·10", "e"))
            assert number == pytest.approx(value, rel=2e-5, abs=1e-6 * abs(value)), text
            if one.force is not None:
                assert float(turn.rstrip("°")) == pytest.approx(
                    np.degrees(np.arctan2(one.force[1], one.force[0])) % 360.0, abs=0.011
                )
        (member,) = [one for one in member_forces(run, k) if one.body == body]
        said = browser.read("mbody.viewer.free.kind.textContent")
        if member.kind == "general":
            assert said == ""
        else:
            words = NUMBER.split(member.words.replace(f"'{body}' ", ""))
            assert NUMBER.split(said.replace("−", "-")) == words
        dashes = browser.read(
            "mbody.viewer.free.diagram.querySelectorAll('[stroke-dasharray=\"6 4\"]').length"
        )
        longest = browser.read("mbody.viewer.free.most")
        seen = [
            one
            for one in acting
            if one.dashed and one.force is not None and 80.0 * np.hypot(*one.force) / longest >= 2.6
        ]
        assert dashes >= len(seen)


def plain(text):
    """The notation of books without its signs."""
    for sign, by in (("$", ""), ("_", ""), ("{", ""), ("}", ""), ("\\,", ""), ("\\mathrm", "")):
        text = text.replace(sign, by)
    return text.replace("\\alpha", "α").replace("-", "−").replace(" ", "")


@marked
def test_the_diagram_follows_the_playhead_and_its_scale_can_be_that_of_the_instant(page):
    browser = page("norton_fourbar")
    browser.read("mbody.viewer.root.focus()")
    browser.key("b")
    assert browser.read("mbody.viewer.free.root.hidden") is False
    said = [
        browser.read(
            f"mbody.seek({{instant: {k}}}); mbody.viewer.free.diagram.getAttribute('aria-label')"
        )
        for k in (0, 90)
    ]
    assert said[0] != said[1] and all(
        one.startswith("crank alone with its forces: F12 ") for one in said
    )
    lengths = "Math.max(...mbody.viewer.free.forces().acting.map((f) => Math.hypot(f.fx, f.fy)))"
    browser.read("mbody.seek({instant: 20})")
    for scale, most in (
        ("of this instant", lengths),
        ("of the whole motion", "mbody.viewer.free.most"),
    ):
        browser.read(
            f"mbody.viewer.free.scale.value = '{scale}';"
            "mbody.viewer.free.scale.dispatchEvent(new Event('change'))"
        )
        pixels, force, peak = browser.read(
            "(() => { const f = mbody.viewer.free, b = f.forces().acting.find((o) => o.c === 'A'),"
            "line = [...f.polygon.querySelectorAll('path')].filter((p) => "
            "p.style.stroke === 'var(--force)').map((p) => p.getAttribute('d').match(/[-\\d.]+/g)"
            f".map(Number)); return [line, Math.hypot(b.fx, b.fy), {most}]; }})()"
        )
        # without the head of 10 px, of which the line takes 1.5
        found = [np.hypot(c - a, d - b) + 8.5 for a, b, c, d in pixels]
        assert any(one == pytest.approx(130.0 * force / peak, abs=0.4) for one in found)
    browser.key("b")
    assert browser.read("mbody.viewer.free.root.hidden") is True


@marked
@pytest.mark.parametrize("figure", ("diagram", "polygon"))
@first_fast("name", ("norton_fourbar", "mud_pump_sixbar", "scissor_lift"), 1)
def test_all_names_of_a_free_body_are_seen_and_do_not_cover_each_other(page, name, figure):
    browser = page(name)
    browser.read("mbody.viewer.on.free || mbody.viewer.toggle('free')")
    for body in browser.read("[...mbody.viewer.free.select.options].map((o) => o.value)"):
        browser.read(f"mbody.viewer.free.show({body!r}); 0")
        texts = f"(v) => [...v.free.{figure}.querySelectorAll('text:not(.upright)')]"
        covered, _ = browser.covered(texts)
        # widths of names are estimated, and a small figure with many has no better places
        assert covered.max() < 0.35, body
