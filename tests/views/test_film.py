"""Films: as many frames as requested on one canvas, and everything in them where it belongs."""

import re
import sys
import xml.etree.ElementTree as ET
from unittest import mock

import numpy as np
import pytest
from PIL import Image

import mbody
from mbody import gallery
from mbody.cli import main
from mbody.views.film_frames import MARGIN, FilmSet, painted
from mbody.views.labels import INK, LINK
from mbody.views.shapes import motion

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def four_bar():
    return motion(gallery.load("norton_fourbar"))


@pytest.fixture(scope="module")
def free():
    return mbody.simulate(gallery.load("free_fourbar"), 1.0)


@pytest.mark.parametrize("ending", ["gif", "webp", "apng"])
def test_a_film_has_its_frames_and_duration_on_one_canvas(four_bar, tmp_path, ending):
    path, done = tmp_path / f"turn.{ending}", []
    notes = mbody.animate(
        four_bar,
        path,
        duration=1.2,
        rate=10.0,
        width=320,
        show=("names", "forces"),
        progress=lambda n, of: done.append((n, of)),
    )
    assert notes == [] and done == [(n, 12) for n in range(1, 13)]
    with Image.open(path) as film:
        assert film.n_frames == 12 and film.size[0] == 320
        lasts, size = 0.0, film.size
        for n in range(12):
            film.seek(n)
            film.load()
            lasts += film.info["duration"]
            assert film.size == size
            assert film.convert("RGB").getpixel((2, 2)) == (255, 255, 255) or ending == "webp"
    assert lasts == pytest.approx(1200.0, abs=12.0)


def test_the_same_film_is_the_same_file(four_bar, tmp_path):
    for name in "ab":
        mbody.animate(four_bar, tmp_path / f"{name}.gif", duration=0.4, rate=10.0, width=240)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_links_and_pins_are_painted_where_the_motion_has_them(four_bar):
    film = FilmSet({"": four_bar}, 36, 640, ("centres",), ())
    # a whole turn: its last frame, which is the first, is left out, so that it goes round evenly
    t = four_bar.t[0] + np.arange(36) / 36 * (four_bar.t[-1] - four_bar.t[0])
    exact = mbody.kinematics(four_bar.mechanism, t=t)
    ink, fill = (tuple(int(color[n : n + 2], 16) for n in (1, 3, 5)) for color in (INK, LINK))
    for frame in (0, 7, 20, 35):
        picture = painted(film, frame)
        a, b = exact.point("rocker.B"), exact.point("rocker.O4")
        pin = film.pixels(np.array([a.x[frame], a.y[frame]]))
        column, row = round(pin[0]), film.height - 1 - round(pin[1])
        near = picture[row - 2 : row + 3, column - 2 : column + 3].reshape(-1, 3)
        assert (near == 255).all(axis=1).any()  # the pin is white inside
        middle = film.pixels(
            np.array([0.7 * a.x[frame] + 0.3 * b.x[frame], 0.7 * a.y[frame] + 0.3 * b.y[frame]])
        )
        column, row = round(middle[0]), film.height - 1 - round(middle[1])
        near = picture[row - 1 : row + 2, column - 1 : column + 2].reshape(-1, 3)
        assert any(tuple(one) in (fill, ink) for one in near.tolist())


def test_arrows_have_one_scale_in_all_frames(four_bar):
    film = FilmSet({"": four_bar}, 20, 640, ("forces",), ())
    peak = max(four_bar.reaction(name).magnitude.max() for name in ("O2", "A", "B", "O4"))
    (arrow,) = (one for one in film.arrows if one.text in ("F43", "$F_{43}$"))
    own = four_bar.reaction("B")
    here = film.stretches[0].value(own.magnitude)
    straight = np.hypot(*arrow.vector.T)
    longest = max(np.hypot(*one.vector.T).max() for one in film.arrows)
    # between instants components are straight, a magnitude is a little less
    assert np.abs(straight / longest - here / here.max() * straight.max() / longest).max() < 2e-3
    assert longest == pytest.approx(74.0 * film.point, rel=1e-12)
    assert peak >= own.magnitude.max()


def test_an_svg_film_moves_links_as_the_motion_does(four_bar, tmp_path):
    path = tmp_path / "turn.svg"
    mbody.animate(four_bar, path, duration=3.0, rate=12.0, show=("names", "forces", "paths"))
    root = ET.parse(path).getroot()
    turns = [
        one.get("values").split(";")
        for one in root.iter(f"{SVG}animateTransform")
        if one.get("type") == "rotate"
    ]
    crank = np.unwrap(np.radians([-float(v) for v in turns[0]]))
    assert {len(values) for values in turns} == {37}
    spans = {round(abs(float(v[-1]) - float(v[0])), 1) for v in turns}
    assert 360.0 in spans and 0.0 in spans  # the crank goes round, rocker and coupler come back
    assert len(crank) == 37
    text = path.read_text("utf-8")
    assert "script" not in text and not re.findall(r"https?://(?!www\.w3\.org/2000/svg)", text)


def test_the_command_writes_a_film(tmp_path, capsys):
    path = tmp_path / "free.webp"
    words = ["animate", "free_fourbar", "--to", "0.5", "--duration", "0.5", "--rate", "8"]
    assert main([*words, "--show", "velocities", "-o", str(path)]) == 0
    assert capsys.readouterr().err == f"wrote {path}\n"
    with Image.open(path) as film:
        assert film.n_frames == 4


def test_a_film_that_cannot_be_made_leaves_no_file(tmp_path):
    file = tmp_path / "turn.webp"
    run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"), turn=True)
    with mock.patch.dict(sys.modules, {"PIL": None}), pytest.raises(mbody.ModelError):
        mbody.animate(run, file, duration=0.1)
    assert not file.exists()


@pytest.mark.parametrize(("model", "letters"), [("norton_fourbar", 17.0), ("geneva_drive", None)])
def test_a_long_title_is_smaller_and_fits(model, letters):
    film = FilmSet({"": motion(gallery.load(model))}, 5, 400, (), ())
    size = film.title_size()
    assert size == letters if letters else 9.0 < size < 17.0
    # letters of the usual fonts are half as wide as high
    assert len(film.title()) * size * 0.5 <= 400 - 2 * MARGIN
