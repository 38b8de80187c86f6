"""Pictures, films, pages and reports can be read: names apart, signs of print, no rounding."""

import itertools
import re
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image

import mbody
from mbody import gallery, report
from mbody.reports.described import ROWS, Grid, Text, first_rows, parts_of, printed
from mbody.reports.writers import latex, typst_text
from mbody.summaries.text_table import Column
from mbody.views.film_frames import FilmSet, film_names
from mbody.views.page_data import text_runs
from mbody.views.shapes import motion
from tests.support.cases import first_fast

SHOWN = ("names", "forces")


def covered(names, frame):
    """The greatest part of a name in a frame that another one covers."""
    there = [one for one in names if np.isfinite(one.at[frame, 0])]
    worst = 0.0
    for n, one in enumerate(there):
        for other in there[:n]:
            low = np.maximum(one.at[frame] - one.half, other.at[frame] - other.half)
            high = np.minimum(one.at[frame] + one.half, other.at[frame] + other.half)
            area = 4.0 * min(one.half.prod(), other.half.prod())
            worst = max(worst, float(np.clip(high - low, 0.0, None).prod()) / area)
    return worst


# -- films ------------------------------------------------------------------------------------


@first_fast("name", ["flyball_governor", "mud_pump", "quick_return"], 2)
def test_names_of_a_film_do_not_cover_each_other(name):
    film = FilmSet({"": motion(gallery.load(name))}, 24, 640, SHOWN, None)
    names = film_names(film)
    assert max(covered(names, frame) for frame in range(24)) <= 0.26  # COVERED, and rounding
    shown = np.array([np.isfinite(one.at[:, 0]) for one in names[: len(film.main.labels)]])
    assert shown.mean() > 0.75  # what is left out has no room, as where all links lie on a line


def test_names_of_a_film_stay_where_they_were():
    film = FilmSet({"": motion(gallery.load("norton_fourbar"))}, 72, 640, SHOWN, None)
    for name in film_names(film):
        steps = np.hypot(*np.diff(name.at, axis=0).T)
        assert (steps[np.isfinite(steps)] > 30.0).sum() <= 8, name.text


def test_a_name_without_an_arrow_is_left_out(tmp_path):
    run = motion(gallery.load("quick_return"))  # its load is zero for half of the turn
    film = FilmSet({"": run}, 24, 640, ("forces",), None)
    (arrow,) = (one for one in film.arrows if one.text == "cutting")
    (name,) = (one for one in film_names(film) if one.text == "cutting")
    long = np.hypot(*arrow.vector.T) > 2.5
    assert 0 < long.sum() < 24 and not np.isfinite(name.at[~long]).any()
    mbody.animate(run, tmp_path / "a.svg", duration=2.0, rate=12.0, show=("forces",))
    text = (tmp_path / "a.svg").read_text("utf-8")
    assert re.search(r'attributeName="visibility"[^>]*/><text[^>]*><tspan>cutting', text)


def test_colours_that_appear_later_are_in_the_palette_of_a_gif(tmp_path):
    path = tmp_path / "a.gif"
    run = motion(gallery.load("quick_return"))
    mbody.animate(run, path, duration=1.0, rate=10.0, width=480, show=("forces",))
    orange = []
    with Image.open(path) as film:
        for frame in range(film.n_frames):
            film.seek(frame)
            red, green, blue = np.asarray(film.convert("RGB")).astype(int).reshape(-1, 3).T
            orange.append(int(((red > 190) & (green < 120) & (blue < 60)).sum()))
    assert orange[0] == 0 and max(orange) > 20


def test_mass_centres_that_are_not_shown_leave_nothing(tmp_path):
    run = motion(gallery.load("norton_fourbar"))
    film = FilmSet({"": run}, 4, 480, (), ())
    names = [shape.look.name for shape, _ in film.shapes(0)]
    signs = ("cg:", "centre:", "tie:")
    assert not [name for name in names if name.startswith(signs)]
    every = FilmSet({"": run}, 4, 480, ("centres",), ()).shapes(0)
    # disc and two quarters of three links, and a line to two of the centres
    assert len([one for one, _ in every if one.look.name.startswith(signs)]) - 9 in (1, 2, 3)
    nameless = [shape for shape, _ in film.shapes(0) if shape.kind == "polygon"]
    assert all(shape.look.name for shape in nameless if shape.look.fill == shape.look.edge)


def test_names_of_forces_have_their_indices():
    run = motion(gallery.load("scissor_lift"))
    film = FilmSet({"": run}, 2, 640, ("forces",), None)
    (own,) = (one.text for one in film.arrows if ",O" in one.text or "mathrm{O}" in one.text)
    assert text_runs(own) == [["F", ""], ["12,O", "sub"]]


# -- free-body diagrams -----------------------------------------------------------------------


def texts(figure):
    return [one.get_text() for axes in figure.axes for one in axes.texts] + [
        one.get_text() for one in figure.texts
    ]


def test_sentences_of_diagrams_have_the_digits_and_signs_of_their_tables():
    run = mbody.kinetostatics(gallery.load("watt_sixbar"))
    words = [one for one in texts(mbody.views.free_bodies.draw_free_bodies(run)) if "meet" in one]
    numbers = re.findall(r"M = \((\S+) mm, (\S+) mm\)", " ".join(words))
    assert numbers
    for one in (part for pair in numbers for part in pair):
        assert "-" not in one and len(re.sub(r"\D", "", one)) <= 5


def test_moments_that_are_all_rounding_are_zero():
    run = mbody.kinetostatics(gallery.load("scissor_lift"))
    found = texts(mbody.views.free_bodies.draw_free_bodies(run, ["shoe", "pallet"]))
    assert sum("all forces pass through G" in one for one in found) == 2
    assert not any("= 1 of the greatest moment" in one for one in found)


def test_parallel_arrows_of_a_polygon_are_named_on_their_own_side():
    run = mbody.kinetostatics(gallery.load("cam_follower"), turn=True)
    figure = mbody.views.free_bodies.draw_free_bodies(run, ["shaft"], [180])
    polygon = figure.axes[1]
    at = {one.get_gid(): np.array(one.get_position()) for one in polygon.texts if one.get_gid()}
    sides = {one.get_gid(): np.mean(one.get_xdata()) for one in polygon.lines if one.get_gid()}
    middle = 0.5 * (sides["side:F12"] + sides["side:F32"])
    for name in ("F12", "F32"):
        assert (at[f"label:{name}"][0] > middle) == (sides[f"side:{name}"] > middle)


# -- reports ----------------------------------------------------------------------------------


def grids(made, key):
    (chapter,) = (one for one in made.document.chapters if one.key == key)
    return {block.title: block for block in chapter.blocks if isinstance(block, Grid)}


def cells(grid, title):
    return next(list(one.cells) for one in grid.columns if one.title == title)


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("-40 rad/s^2", "−40 rad/s²"),
        ("y = -9.81 m/s^2.", "y = −9.81 m/s²."),
        ("height = -lift; x^2.5", "height = −lift; x^2.5"),
        ("120 lbf*in", "120 lbf·in"),
        ("(-half, 0); M*half^2/3", "(−half, 0); M·half²/3"),
        ("crank 1 : coupler -0.2348", "crank 1 : coupler −0.2348"),
        ("agree to 2.5e-16 of it", "agree to 2.5·10⁻¹⁶ of it"),
        ("3-4-5 cam, --over turn, well-kept, 2026-11-23", None),
        ("e539334f4e067d66, A-1, x-2", None),
    ],
)
def test_signs_of_print(given, shown):
    assert printed(given) == (given if shown is None else shown)
    assert list(parts_of(f"`{given}`")) == [("code", given, "")]  # code stays as it is typed


def test_what_is_always_zero_or_the_same_has_no_place():
    made = report(gallery.load("parallel_cranks"), ["links", "loads"])
    links = grids(made, "links")["Motion of the links"]
    omega = [float(one) for one in cells(links, "peak ω")]
    places = next(column for column in links.columns if column.title == "at crank1").cells
    assert omega[-1] == 0.0 and places[-1] == "" and all(places[:-1])
    train = grids(report(gallery.load("planetary_train"), ["loads"]), "loads")
    table = train["Efforts and measures"]
    assert set(cells(table, "least")) == set(cells(table, "greatest"))
    assert not any(one.title == "at sun" for one in table.filled_columns)


def test_means_that_are_rounding_are_zero():
    """The cam's torque does no work: its mean is the error of the rule that integrates it."""
    made = report(gallery.load("cam_follower"), ["loads", "energy"])
    means = cells(grids(made, "loads")["Efforts and measures"], "mean")
    assert [float(one) for one in means] == [0.0, 57.5, 0.0]
    turning = grids(made, "energy")["Turning moment of motor"]
    assert cells(turning, "value")[:2] == ["0", "0"]
    assert not any("coefficient" in one for one in cells(turning, "quantity"))


def test_forces_that_are_rounding_are_zero():
    """Of a vehicle that stands the driver of its motion has nothing to do."""
    made = report(gallery.load("vehicle"), ["summary", "loads"])
    assert abs(made.run.effort("motion")[0]) < 1e-9
    rows = cells(grids(made, "summary")["Greatest amounts"], "")
    assert not any(row.startswith("force of motion") for row in rows)
    assert cells(grids(made, "loads")["Efforts and measures"], "value")[:3] == ["0", "0", "0"]


def test_long_tables_have_their_first_rows_and_say_so():
    count = 3 * ROWS
    grid = Grid("Numbers", [Column("n", [str(n) for n in range(count)])])
    short, note = first_rows(grid)
    assert len(short.columns[0].cells) == ROWS and f"of {count}" in note.text
    assert first_rows(short) == [short]
    made = report(gallery.load("n_windows_40"), ["inputs", "links", "joints"])
    for chapter in made.document.chapters:
        for block in chapter.blocks:
            if isinstance(block, Grid):
                assert max(len(column.cells) for column in block.columns) <= ROWS
    table = grids(made, "joints")["Forces of the joints"]
    run = made.run
    peaks = sorted(
        (run.reaction(joint.name).magnitude.max() for joint in run.mechanism.joints), reverse=True
    )
    least = min(float(one) for one in cells(table, "peak"))
    assert least == pytest.approx(peaks[ROWS - 1], rel=1e-4)
    assert any(
        isinstance(block, Text) and "of 121" in block.text
        for block in made.document.chapters[-1].blocks
    )


def test_tables_of_a_page_name_their_cells_for_narrow_screens():
    page = report(gallery.load("norton_fourbar"), ["joints", "links"]).html()
    assert 'data-label="peak [lbf]"' in page and 'data-label="Fx there [lbf]"' in page
    assert page.count('role="table"') == 3 == page.count('<div class="table wide"')


def test_columns_of_paper_share_the_page_only_where_they_must():
    short = report(gallery.load("norton_fourbar"), ["summary"]).document
    assert "1fr" not in typst_text(short).split("#grid-table")[-1]
    assert r"p{" not in latex(short, "figures").split(r"\begin{longtable}")[1].splitlines()[0]
    long = report(gallery.load("cam_follower"), ["inputs"]).document
    widths = re.findall(r"p\{([\d.]+)\\linewidth\}", latex(long, "figures"))
    assert widths and "1fr" in typst_text(long)


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="there is no LaTeX")
@pytest.mark.parametrize("name", ["norton_fourbar", "cam_follower", "n_windows_40"])
def test_latex_compiles_and_nothing_is_wider_than_the_page(name, tmp_path):
    text = ["summary", "inputs", "method", "mobility", "links", "joints", "loads", "checks"]
    report(gallery.load(name), [*text, "references", "repeat"]).save(tmp_path / "a.tex")
    command = ["pdflatex", "-interaction=nonstopmode", "a.tex"]
    for _ in range(2):  # widths of tables that go over pages are known in the second run
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
    said = done.stdout.decode("utf-8", "replace")
    if "not found" in said:
        pytest.skip("a package of LaTeX is not installed")
    assert done.returncode == 0
    wide = [float(one) for one in re.findall(r"Overfull \\hbox \(([\d.]+)pt", said)]
    assert max(wide, default=0.0) < 10.0  # points, less than the margin has


def test_a_line_of_a_model_that_begins_with_a_bracket_compiles():
    """After a line break LaTeX takes [ground] for an option, unless something stands before it."""
    text = latex(report(gallery.load("norton_fourbar"), ["repeat"]).document, "figures")
    assert r"\mbox{}[ground]\\" in text
    lines = text.splitlines()
    assert not [
        one
        for before, one in itertools.pairwise(lines)
        if before.endswith(r"\\") and one.lstrip().startswith(("[", "*"))
    ]
