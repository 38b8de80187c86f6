"""Several instants in a drawing; plots over anything, of several designs, of vectors and paths."""

import numpy as np
import pytest

import mbody
from mbody import gallery, kinetostatics
from mbody.views import draw, plot
from mbody.views.free_bodies import force_peak
from mbody.views.plotting import SEVERAL, hodograph, path_plot, polar
from tests.support.cases import first_fast
from tests.support.gallery_runs import run as asked
from tests.support.picture_reader import artists, inside


@pytest.fixture(scope="module")
def turn():
    return kinetostatics(gallery.load("norton_fourbar"), turn=True, instants=73)


def named(axes):
    return {a.get_gid(): a for a in (*axes.lines, *axes.collections) if a.get_gid()}


# -- drawings ---------------------------------------------------------------------------------


def test_overlaid_positions_are_where_they_are(turn):
    figure = draw(turn, [0, 10, 20])
    drawn = artists(figure)
    a = turn.point("crank.A")
    for k, gid in ((0, "pin:A"), (10, "at 10:pin:A"), (20, "at 20:pin:A")):
        assert drawn[gid].center == pytest.approx((a.x[k], a.y[k]))
    assert drawn["link:crank"].get_alpha() is None
    near, far = (drawn[f"at {k}:link:crank"].get_alpha() for k in (10, 20))
    assert 0.1 < far < near < 0.6
    # one ground, and nothing faded above what is in full
    assert sum("support:" in gid for gid in drawn) == 2
    assert drawn["at 10:pin:A"].get_zorder() < drawn["link:coupler"].get_zorder()
    assert inside(figure)


@pytest.mark.parametrize("name", ["mud_pump", "quick_return", "cam_follower", "planetary_train"])
def test_a_strip_has_one_scale(name):
    run = kinetostatics(gallery.load(name), turn=True, instants=9)
    figure = draw(run, [0, 2, 4], strip=True)
    cells = [axes for axes in figure.axes if axes.get_label() != "key"]
    assert len(cells) == 3
    windows = {(axes.get_xlim(), axes.get_ylim()) for axes in cells}
    sizes = {tuple(np.round(axes.get_position().size, 9)) for axes in cells}
    assert len(windows) == len(sizes) == 1
    titles = [text.get_text() for text in figure.texts]
    assert titles[0].startswith(run.mechanism.name[:20]) and len(titles) == 4


# -- plots ------------------------------------------------------------------------------------


def test_over_another_quantity_in_chosen_units(turn):
    figure = plot(turn, "motor.effort [N*m]", "A.force [N]", x="rocker.angle")
    first, second = figure.axes
    curve = named(first)["curve:motor.effort"]
    assert curve.get_xdata() == pytest.approx(np.degrees(turn["rocker"].angle))
    assert curve.get_ydata() == pytest.approx(turn.effort("motor") * 0.1129848290276167)
    assert first.get_ylabel() == "motor.effort [N·m]"
    assert second.get_xlabel() == "rocker.angle [deg]"
    force = named(second)["curve:A.force"].get_ydata()
    assert force == pytest.approx(turn.reaction("A").magnitude * 4.4482216152605)


def designs(values):
    system = mbody.assemble(gallery.load("norton_fourbar"))
    return [kinetostatics(system.with_values({"T_4.value": v}), turn=True) for v in values]


def test_designs_are_curves_and_many_are_a_band():
    runs = designs([0.0, 100.0])
    axes = plot(runs, "motor.effort", labels=["none", "much"]).axes[0]
    found = named(axes)
    for title, run in zip(("none", "much"), runs, strict=True):
        values = found[f"curve:motor.effort:{title}"].get_ydata()
        assert values == pytest.approx(run.effort("motor"))
    runs = designs(np.linspace(0.0, 100.0, SEVERAL + 2))
    axes = plot(runs, "motor.effort").axes[0]
    every = np.array([run.effort("motor") for run in runs])
    corners = named(axes)["band:motor.effort"].get_paths()[0].vertices
    assert corners[:, 1].min() == pytest.approx(every.min())
    assert corners[:, 1].max() == pytest.approx(every.max())
    middle = named(axes)[f"curve:motor.effort:median of {len(runs)}"].get_ydata()
    assert middle == pytest.approx(np.median(every, axis=0))


def test_events_are_marked():
    run = mbody.simulate(gallery.load("bouncing_ball"), 1.0)
    found = [line for line in plot(run, "ball.y").axes[0].lines if "event" in str(line.get_gid())]
    times = sorted(line.get_xdata()[0] for line in found)
    assert times == pytest.approx(sorted(event.t for event in run.events))


def test_vectors_in_world_and_link_axes(turn):
    force = turn.reaction("A", on="crank")
    world = named(hodograph(turn, "A").axes[0])["hodograph:A"].get_xydata()
    assert world == pytest.approx(np.column_stack([force.fx, force.fy]))
    own = named(hodograph(turn, "A", axes="crank").axes[0])["hodograph:A"].get_xydata()
    turned = (force.fx + 1j * force.fy) * np.exp(-1j * turn["crank"].angle)
    assert own == pytest.approx(np.column_stack([turned.real, turned.imag]))
    round_ = named(polar(turn, "A").axes[0])["polar:A"]
    assert round_.get_xdata() == pytest.approx(turn["crank"].angle)
    assert round_.get_ydata() == pytest.approx(force.magnitude)


def test_a_path_has_equal_scales():
    run = mbody.kinematics(gallery.load("hoekens"), turn=True)
    figure = path_plot(run, "coupler.P")
    axes, point = figure.axes[0], run.point("coupler.P")
    assert named(axes)["path:coupler.P"].get_xydata() == pytest.approx(
        np.column_stack([point.x, point.y])
    )
    wide, high = axes.get_position().size * figure.get_size_inches()
    scales = wide / np.ptp(axes.get_xlim()), high / np.ptp(axes.get_ylim())
    assert scales[0] == pytest.approx(scales[1], rel=1e-9)


# -- what is read beside arrows ---------------------------------------------------------------


@first_fast("name", gallery.names(), 10)
def test_labels_keep_off_arrows(name):
    """As boxes of the drawn text against the lines of arrows, in sixty points of each."""
    run = asked(name)
    figure = draw(run, force_peak(run), True)
    figure.canvas.draw()
    renderer, axes = figure.canvas.get_renderer(), figure.axes[0]
    drawn = {a.get_gid(): a for a in (*axes.patches, *axes.lines) if a.get_gid()}
    heads = [gid for gid in drawn if gid.startswith("force:") and gid.endswith(".head")]
    for gid in heads:
        line = drawn[gid.removesuffix(".head")].get_xydata()
        tail, tip = axes.transData.transform(np.vstack([line[0], drawn[gid].get_xy()[0]]))
        points = [tail + p * (tip - tail) for p in np.linspace(0.0, 1.0, 60)]
        for text in axes.texts:
            box = text.get_window_extent(renderer)
            low = box.y0
            if text.get_va() == "center_baseline":  # the box has room below a line that has none
                low = 2.0 * text.get_transform().transform(text.get_position())[1] - box.y1
            covered = sum(box.x0 < x < box.x1 and low < y < box.y1 for x, y in points)
            assert covered <= 3, (text.get_text(), gid, covered)


def test_an_effort_against_the_motion_points_the_other_way(turn):
    def sign(k, forces):
        drawn = artists(draw(turn, k, forces))
        points = drawn["driver:motor"].get_xydata() - drawn["pin:O2"].center
        (x, y), (u, v) = points[:-1].T, points[1:].T
        return np.sign((x * v - y * u).sum())

    effort = turn.effort("motor")
    against, along = int(np.argmin(effort)), int(np.argmax(effort))
    assert effort[against] < 0.0 < effort[along] and turn["crank"].omega[against] > 0.0
    assert (sign(against, False), sign(against, True)) == (1.0, -1.0)
    assert (sign(along, False), sign(along, True)) == (1.0, 1.0)


def test_events_are_named_at_their_instant():
    run = mbody.simulate(gallery.load("bouncing_ball"), 1.0)
    event = run.events[0]
    k = int(np.argmin(np.abs(run.t - event.t)))
    for instant, shown in ((k, True), (k + 3, False)):
        texts = [text.get_text() for text in draw(run, instant).axes[0].texts]
        assert any(event.name in text and "t = " in text for text in texts) == shown
