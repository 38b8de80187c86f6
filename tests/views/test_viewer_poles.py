"""Instant centres, centrodes and polygons on a page: those of the analysis, where they belong."""

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.engineering import acceleration_polygon, centrodes, instant_centres, velocity_polygon
from mbody.views.page import plain_runs
from mbody.views.shapes import motion
from tests.support.browser import browser as started
from tests.support.browser import chromium
from tests.support.viewer_page import ViewerPage

MODELS = ("norton_fourbar", "quick_return", "stephenson_sixbar", "cam_follower")
#: Histories of a page have 4 digits after that of the unit of the picture, polygons 5 digits.
DRAWN = 1e-3


@pytest.fixture(scope="module")
def views():
    return {name: mbody.view(motion(gallery.load(name))) for name in MODELS}


def numbers(values):
    return np.array([np.nan if v is None else v for v in values])


@pytest.mark.parametrize("name", MODELS)
def test_the_document_has_the_centres_and_polygons_of_the_analysis(views, name):
    view = views[name]
    run, scene = next(iter(view.runs.values())), view.document["scene"]
    found, unit = instant_centres(run), scene["unit"]
    assert scene["poles"]["centres"]
    for one in scene["poles"]["centres"]:
        pair = found[one["of"][0], one["of"][1]]
        x, y = numbers(one["x"]), numbers(one["y"])
        there = np.isfinite(x)
        assert np.abs(x - pair.x)[there].max() < DRAWN * unit
        assert np.abs(y - pair.y)[there].max() < DRAWN * unit
        if "on" in one:  # the moving centrode, by the function of its own
            moving = next(body for body in one["of"] if body != "ground")
            assert scene["bodies"][one["on"]] == moving
            own = centrodes(run, moving)
            assert np.abs(numbers(one["u"]) - own.moving_x)[there].max() < DRAWN * unit
            assert np.abs(numbers(one["v"]) - own.moving_y)[there].max() < DRAWN * unit
    for polygon in (velocity_polygon(run), acceleration_polygon(run)):
        own = scene["poles"]["polygons"][polygon.quantity]
        peak = max(np.hypot(x, polygon.y[key]).max() for key, x in polygon.x.items())
        for point in own["points"]:
            for point_name in point["n"]:
                assert np.abs(numbers(point["x"]) - polygon.x[point_name]).max() < 1e-4 * peak
                assert np.abs(numbers(point["y"]) - polygon.y[point_name]).max() < 1e-4 * peak
        names = [name for point in own["points"] for name in point["n"]]
        assert sorted(names) == sorted(polygon.x)


@pytest.mark.parametrize("name", MODELS[:3])
def test_paper_and_page_have_the_same_letters_and_lines_in_polygons(views, name):
    view = views[name]
    run = next(iter(view.runs.values()))
    figure = mbody.draw(run, len(run) // 6, polygons=True)
    for axes, polygon in zip(
        figure.axes[1:3], view.document["scene"]["poles"]["polygons"].values(), strict=True
    ):
        texts = [one.get_text() for one in axes.texts]
        letters = [one["t"] for one in polygon["points"]]
        assert letters == [plain_runs(text) for text in texts if plain_runs(text) in letters]
        lines = {str(one.get_gid()).partition(":")[0] for one in axes.lines}
        assert ("sliding" in lines) == any(polygon["slides"])
        if "parts" in lines:
            assert polygon["parts"]
        parts = [
            text for one in [*polygon["parts"], *polygon["slides"]] for text in one.get("t", "")
        ]
        assert {text for text in texts if text in "ntC"} <= {*parts}


def test_where_nothing_moves_and_in_crowds_there_are_none():
    still = mbody.view(mbody.statics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), t=[0.0, 1.0]))
    many = mbody.view(motion(gallery.load("n_windows_40")))
    for view in (still, many):
        assert "poles" not in view.document["scene"]


@pytest.mark.browser
@pytest.mark.skipif(chromium() is None, reason="there is no chromium")
def test_marks_and_images_are_where_the_analysis_has_them(views, tmp_path):
    with started("--hide-scrollbars") as found:
        page = ViewerPage(found)
        for name in MODELS[:3]:
            file = tmp_path / f"{name}.html"
            views[name].save(file)
            page.open(file)
            page.key("i")
            page.key("y")
            run = next(iter(views[name].runs.values()))
            k = len(run) // 6
            page.read(f"mbody.seek({{instant: {k}}})")
            centres = instant_centres(run)
            marks = page.read(
                """mbody.viewer.picture.poles.all.filter((one) => one.dot.style.display !== "none")
                .map((one) => [one.of, +one.dot.getAttribute("cx"), +one.dot.getAttribute("cy")])"""
            )
            assert len(marks) >= 4
            for of, x, y in marks:
                pair = centres[of[0], of[1]]
                where = page.read(f"mbody.viewer.picture.screen([{pair.x[k]}, {pair.y[k]}])")
                assert [x, y] == pytest.approx(where, abs=0.5), of
            # arrows of the polygons end where their images are, at one scale
            assert page.read("mbody.viewer.polygons.root.hidden") is False
            assert page.read("mbody.viewer.polygons.root.querySelectorAll('svg path').length") > 6
            page.key("i")
            page.key("y")
            assert page.read("mbody.viewer.polygons.root.hidden") is True
            assert page.read("mbody.viewer.picture.poles.marks.style.display") == "none"
        assert page.problems == [] and page.requests == []
