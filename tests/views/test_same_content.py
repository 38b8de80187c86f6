"""Paper, film and page draw the same things of a model, each read from its own output."""

import itertools
import re

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.views.film_frames import FilmSet, film_names
from mbody.views.page_data import text_runs
from mbody.views.shapes import motion
from tests.support.cases import first_fast

#: Linkages, sliders, a field that turns, wheels with brakes, a cam, gears, many joints.
MODELS = (
    *("norton_fourbar", "scissor_lift", "braking_vehicle", "quick_return", "slider_crank"),
    *("flyball_governor", "vehicle", "cam_follower", "planetary_train", "n_windows_2"),
)
#: What paper alone has: labels, the key, gravity in it; and what hangs on the size of the picture,
#: the line from a link to its mass centre.
OF_PAPER = re.compile(r"^(name:|label:|link:.*:name$|scale|key|gravity:|tie:)")
#: Shapes that are there for some time only, and arrows too short to be drawn.
AT_TIMES = re.compile(r"^(sticks|driver|torque|contact|cone|friction|force):")


def words(text):
    """A text without signs of mathematics."""
    plain = "".join(part for part, _ in text_runs(text.replace("$\\,$", "\u2009")))
    return plain.replace("\\_", "_").replace("_", "")


def read_number(text):
    """A printed number with its unit: (number, unit)."""
    number, unit = re.fullmatch(r"([−\d.\s\u2009]+(?:·10[⁻⁰-⁹²³¹]+)?)\s(\S+)", text).groups()
    for sign, by in (("−", "-"), ("\u2009", ""), (" ", "")):
        number = number.replace(sign, by)
    return float(number), unit


class Paper:
    def __init__(self, run):
        drawing = mbody.draw(run, instant=0, forces=run.has_forces)
        self.figure = getattr(drawing, "figure", drawing)
        artists = [one for axes in self.figure.axes for one in axes.get_children()]
        gids = {str(one.get_gid()).removesuffix(".head") for one in artists if one.get_gid()}
        self.things = {gid for gid in gids if not OF_PAPER.match(gid)}
        self.texts = [one for axes in self.figure.axes for one in axes.texts]
        said = [words(one.get_text()) for one in self.texts]
        self.names = {re.split(r": | = ", text)[0] for text in said}
        arrows = {gid.removeprefix("force:") for gid in gids if gid.startswith("force:")}
        pairs = [text.split(" = ") for text in said if " = " in text and ": " not in text]
        names = {words(name.replace(",", "").replace("_", "")) for name in arrows}
        self.forces = {
            name: read_number(value) for name, value in pairs if name.replace(",", "") in names
        }

    def overlaps(self):
        """How much of the smaller of two texts the other covers."""
        self.figure.canvas.draw()
        boxes = [one.get_window_extent() for one in self.texts]
        for a, b in itertools.combinations(boxes, 2):
            wide, tall = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
            area = max(wide, 0.0) * max(tall, 0.0)
            yield area / min(a.width * a.height, b.width * b.height)


@first_fast("name", MODELS, 3)
def test_paper_film_and_page_draw_the_same(name):
    run = motion(gallery.load(name))
    paper, scene_page = Paper(run), mbody.view(run).document
    film = FilmSet({"": run}, 3, 640, ("names", "forces", "paths", "centres"), None)
    scene, data = scene_page["scene"], scene_page["data"]
    # the same bodies, joints, loads and arrows
    arrows = {one["n"] for one in scene["forces"]}
    on_page = {one["n"] for one in scene["shapes"]} | arrows
    on_page = {thing for thing in on_page if thing and not OF_PAPER.match(thing)}
    on_film = {one.look.name.removesuffix(".head") for one in film.main.shapes}
    assert on_page - arrows == {thing for thing in on_film if thing and not OF_PAPER.match(thing)}
    assert paper.things <= on_page
    assert all(AT_TIMES.match(thing) for thing in on_page - paper.things)
    assert len(paper.things) > 5
    # the same names
    names = [*scene["labels"], *(one for one in scene["forces"] if one["n"] in paper.things)]
    said = {"".join(part for part, _ in one["t"]).replace("_", "") for one in names}
    assert said <= paper.names
    on_film = {words(one.text) for one in film_names(film)}
    assert said <= on_film
    # the same forces, as the numbers are printed on paper, as lengths in the film with its key
    symbol, size = scene["units"]["force"]
    (key, _, text), *_ = [(*one[:1], one[2], one[1]) for one in film.scales]
    of_key, unit_of_key = read_number(text)
    assert unit_of_key == symbol
    assert len(paper.forces) == len({thing for thing in paper.things if thing.startswith("force:")})
    film_arrows = {words(one.text): one for one in film.arrows}
    for one in scene["forces"]:
        said = "".join(part for part, _ in one["t"]).replace("_", "")
        if said not in paper.forces:
            continue
        if "own" in one:
            histories = [one["own"][axis] for axis in "xy"]
        else:
            table = data["loads"] if one.get("load") else data["reactions"]
            histories = [table[one["of"]][key_of] for key_of in ("fx", "fy")]
        parts, peak = [own[0] for own in histories], np.nanmax(np.abs(np.array(histories, float)))
        force = float(np.hypot(*parts)) / size
        number, unit = paper.forces[said]
        assert (number, unit) == (pytest.approx(force, rel=5.1e-4), symbol), said
        arrow = film_arrows[said]
        vector = arrow.vector[0] * of_key / key
        # histories of a page are rounded to 5e-8 of their peaks
        close = 1e-7 * peak / size
        assert vector == pytest.approx(one["sign"] * np.array(parts) / size, abs=close)
    assert max(paper.overlaps()) < 0.25  # of boxes, which are larger than their letters


def test_no_difference_goes_unseen():
    """A force less on paper, another unit, or a name less is one."""
    run = motion(gallery.load("norton_fourbar"))
    paper = Paper(run)
    assert len(paper.forces) == 5 and {"A", "B", "O2", "O4", "P", "crank", "F32"} <= paper.names
    other = Paper(motion(gallery.load("quick_return")))
    assert paper.forces != other.forces and paper.things != other.things
    assert read_number("107\u2009300 N") == (107300.0, "N")
