"""Free-body diagrams: forces close, arrows are to scale, labels keep off them, files."""

import math
import re

import numpy as np
import pytest

import mbody
from mbody import free_body, gallery, kinetostatics
from mbody.summaries.text_table import force_names, forces_on
from mbody.views.free_bodies import draw_free_bodies, force_peak
from tests.support.cases import first_fast
from tests.support.gallery_runs import run as asked

#: The sums are of some ten numbers that solve linear equations to rounding, of which the greatest
#: is one; what forces of least norm leave open is solved to rounding too.
CLOSED = 1e-12
#: Impulses of a step act in its middle; discs of a pile that settles move by 3e-13 m until its end
#: and overlap by 2e-12 m, of the 0.2 m that their forces are apart.
CLOSED_STEPS = 1e-11
#: Instants of one model that are looked at: all of a turn of small models, fewer of large ones.
LOOKED = 2600

GALLERY = gallery.names()


def parts(figure, n):
    """Named artists of the n-th part of a figure."""
    axes = figure.axes[n]
    found = [a for a in (*axes.patches, *axes.lines, *axes.texts) if a.get_gid()]
    return {artist.get_gid(): artist for artist in found}


def ends(drawn, name):
    """Tail and tip of an arrow."""
    return drawn[name].get_xydata()[0], drawn[f"{name}.head"].get_xy()[0]


# -- the polygons close ------------------------------------------------------------------------


@first_fast("name", GALLERY, 10)
def test_forces_and_moments_close_at_every_instant(name):
    """Summed here with `math.fsum` about the origin, by which neither the analysis nor the drawing
    balances anything: it takes the mass centre.
    """
    run = asked(name)
    bodies = [body.name for body in run.mechanism.bodies]
    every = max(1, math.ceil(len(bodies) * len(run) / LOOKED))
    assert every == 1 or len(bodies) > 7
    moment = CLOSED if run.stepped is None else CLOSED_STEPS
    for k in range(0, len(run), every):
        for body in bodies:
            forces = free_body(run, body, k)
            # of the greatest force of the link, and of the moments of all of them
            size = max(one.force for one in forces)
            reach = max(math.hypot(one.x, one.y) for one in forces) + run.system.length
            turning = max(size * reach, *(abs(one.torque) for one in forces))
            for key in ("fx", "fy"):
                assert abs(math.fsum(getattr(one, key) for one in forces)) <= CLOSED * size
            moments = [one.torque + one.x * one.fy - one.y * one.fx for one in forces]
            assert abs(math.fsum(moments)) <= moment * turning


# -- names -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["norton_fourbar", "scissor_lift", "mud_pump_sixbar"])
def test_names_are_those_of_the_summary_and_their_opposites(name):
    machine = gallery.load(name)
    summary = force_names(machine)
    number = {body.name: n for n, body in enumerate(machine.bodies, 2)} | {"ground": 1}
    for body in machine.bodies:
        for element, found in forces_on(machine, body.name).items():
            own, on = summary[element]
            if on == body.name:
                assert found == own
            i, j = re.match(r"[FT](?:\((\d+),(\d+)\)|(\d)(\d))", found).group(
                *((1, 2) if "(" in found else (3, 4))
            )
            ends = machine[element]
            both = {ends.i.body, ends.j.body} if hasattr(ends, "i") else {*ends.bodies}
            assert int(j) == number[body.name] and {int(i), int(j)} == {number[b] for b in both}


# -- what is drawn -----------------------------------------------------------------------------


def test_arrows_are_to_scale_and_chain_to_a_closed_polygon():
    run = kinetostatics(gallery.load("norton_fourbar"))
    figure = draw_free_bodies(run, ["coupler"])
    diagram, polygon = parts(figure, 0), parts(figure, 1)
    wrenches = {one.cause: one for one in free_body(run, "coupler")}
    named = {"F23": "A", "F43": "B", "F_P": "F_P", "-ma": "inertia"}
    for drawn, kind in ((diagram, "force"), (polygon, "side")):
        scales = []
        for gid, cause in named.items():
            tail, tip = ends(drawn, f"{kind}:{gid}")
            force = np.array([wrenches[cause].fx, wrenches[cause].fy])
            scales.append(np.hypot(*(tip - tail)) / np.hypot(*force))
            assert (tip - tail) / scales[-1] == pytest.approx(force, rel=1e-9, abs=1e-9)
        assert scales == pytest.approx([scales[0]] * len(scales), rel=1e-9)
    tails, tips = zip(*(ends(polygon, f"side:{gid}") for gid in named), strict=True)
    for tip in tips:
        assert min(np.hypot(*(tip - tail)) for tail in tails) < 1e-10
    # d'Alembert's are dashed, the others are not
    assert diagram["force:-ma"].get_linestyle() == polygon["side:-ma"].get_linestyle() == "--"
    assert diagram["force:F23"].get_linestyle() == "-"
    assert diagram["torque:-Ialpha"].get_linestyle() == "--"


def test_torques_turn_as_they_do():
    run = kinetostatics(gallery.load("norton_fourbar"))
    for body, gid, value in (("crank", "T12", run.effort("motor")[0]), ("rocker", "T_4", 120.0)):
        points = parts(draw_free_bodies(run, [body]), 0)[f"torque:{gid}"].get_xydata()
        (x, y), (u, v) = np.diff(points, axis=0)[:-1].T, np.diff(points, axis=0)[1:].T
        assert np.sign((x * v - y * u).sum()) == np.sign(value)


def test_members_show_their_lines():
    run = mbody.statics(gallery.load("static_fourbar"))
    two, three = (parts(draw_free_bodies(run, [body]), 0) for body in ("coupler", "rocker"))
    coupler = free_body(run, "coupler")
    line = two["action"].get_xydata()
    way = line[-1] - line[0]
    for one in coupler:
        arm = np.array([one.x, one.y]) - line[0]
        assert abs(way[0] * arm[1] - way[1] * arm[0]) < 1e-9 * np.hypot(*way) ** 2
    member = next(m for m in mbody.member_forces(run) if m.body == "rocker")
    assert three["meeting"].center == pytest.approx(member.meeting)


@first_fast("name", GALLERY, 4)
def test_labels_keep_off_arrows_and_each_other(name):
    """As boxes of the drawn text against the lines of arrows."""
    run = asked(name)
    bodies = [body.name for body in run.mechanism.bodies][:6]
    figure = draw_free_bodies(run, bodies, [force_peak(run)])
    figure.canvas.draw()
    renderer, whole = figure.canvas.get_renderer(), figure.bbox
    for n, axes in enumerate(figure.axes):
        boxes, arrows = [], []
        for gid, artist in parts(figure, n).items():
            if gid.startswith("label:"):
                boxes.append((gid, artist.get_window_extent(renderer)))
            elif gid.endswith(".head"):
                line = parts(figure, n).get(gid.removesuffix(".head"))
                ends_of = np.vstack([line.get_xydata()[0], artist.get_xy()[0]])
                arrows.append((gid, axes.transData.transform(ends_of)))
        for gid, box in boxes:
            assert box.x0 > whole.x0 and box.x1 < whole.x1 and box.y0 > whole.y0, gid
            for other, (tail, tip) in arrows:
                middle = [tail + p * (tip - tail) for p in np.linspace(0.0, 1.0, 60)]
                covered = sum(box.x0 < x < box.x1 and box.y0 < y < box.y1 for x, y in middle)
                assert covered <= 2, (bodies[n // 3], gid, other, covered)
            for other, beside in boxes:
                assert gid == other or not box.padded(-1.0).overlaps(beside.padded(-1.0)), gid
