"""What a new user does first: positions in a row, options spelled otherwise, files to begin with,
the table of measures.
"""

import json
import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import mbody
from mbody import cli, gallery
from mbody.exchange import other_program
from mbody.files.model import json_schema
from mbody.files.model.problems import SECTIONS
from mbody.model.model_notes import with_changed
from mbody.model.simulation import REDUCTIONS, Instants, Measure
from mbody.teaching import KINDS, new_model
from mbody.views.labels import FreePlaces, Label
from mbody.views.shapes import motion
from tests.support.paths import ROOT


def column(text, name):
    """The numbers of a column of a printed table of comma-separated values."""
    head, *rows = text.splitlines()
    n = [cell.partition(" [")[0] for cell in head.split(",")].index(name)
    return np.array([float(row.split(",")[n]) for row in rows])


@pytest.mark.parametrize("speed", [30.0, -30.0])
@pytest.mark.parametrize("turns", [1, 2])
def test_positions_in_a_row_come_one_after_the_other(speed, turns):
    machine = mbody.makers.slider_crank(0.05, 0.2, masses=(1, 1, 1), speed=speed)
    begin = math.degrees(machine["motor"].law(0.0))
    count = 12 * turns + 1
    degrees = begin + math.copysign(1.0, speed) * np.linspace(0.0, 360.0 * turns, count)
    ask = Instants(at={"crank": [f"{value!r} deg" for value in degrees.tolist()]})
    run = mbody.analysis.driven.driven.analyse_at(machine, "kinetostatics", ask)
    # the same positions by the turn, at equal angles
    turn = mbody.kinetostatics(machine, turn="motor", turns=turns, instants=count)
    # two ways to the same angle, some units in the last place of two turns, over the speed
    np.testing.assert_allclose(run.t, turn.t, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(np.degrees(run["crank"].angle), degrees, rtol=0.0, atol=1e-11)


def test_positions_that_are_not_in_a_row_are_those_of_the_first_turn(capsys):
    words = ["kinematics", "slider_crank", "--set", "speed=60 rpm", "--csv", "-", "--at"]
    # the crank begins at 60 deg, and a degree takes 1/360 s
    for values, wanted in (("crank=0,360", [300, 300]), ("crank=350,70", [290, 10])):
        assert cli.main([*words, values]) == 0
        times = column(capsys.readouterr().out, "t")
        # rounding of one turn
        np.testing.assert_allclose(times, np.array(wanted) / 360, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("by", REDUCTIONS)
def test_the_summary_shows_one_number_of_all_instants_as_it_is(by):
    """The history passes through zero, where a value at an instant is shown as 0."""
    machine = mbody.makers.slider_crank(0.05, 0.2, masses=(1, 1, 1), start=0.0, speed=30.0)
    machine.add(mbody.Force("push", "slider.B", 100.0, angle=math.pi))
    machine.measures["own"] = Measure(f"{by}(abs(motor.effort))")
    run = mbody.kinetostatics(machine, turn="motor", instants=73)
    row = next(line for line in str(run).splitlines() if line.startswith("own "))
    shown, value = float(row.split()[1]), float(run.measure("own")[0])
    scale = abs(run.effort("motor")).max()
    if by in ("min", "first", "last"):  # at a dead centre, rounding of the greatest
        assert abs(value) < 1e-12 * scale and shown == 0.0
    else:
        # printed to six digits
        assert shown == pytest.approx(value, rel=1e-5) and value > 1e-2 * scale


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["animate", "hoekens", "--ratee", "5"], "did you mean --rate? (see mbody animate --help)"),
        (["simulate", "hoekens", "--fast"], "--fast (see mbody simulate --help)"),
    ],
)
def test_an_unknown_option_leads_to_the_help_of_its_command(words, sentence, capsys):
    assert cli.main(words) == 2
    assert capsys.readouterr().err.rstrip().endswith(sentence)


@pytest.mark.parametrize("units", ["SI", "in-lbf-s", "ft-lbf-s", "cm-kN-s"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_new_file_in_other_units_is_the_same_mechanism(kind, units):
    """Every number of a template has a unit: forces and motion are those of the template."""
    own, other = (mbody.from_toml(new_model(kind, units=name)) for name in ("", units))
    assert other.units.name == units and tomllib.loads(new_model(kind, units=units))["measures"]
    for one in (own, other):
        one.measures["pin"] = Measure(f"{next(iter(own.joints)).name}.force", "N")
    runs = [
        mbody.simulate(one, 0.5) if kind == "pendulum" else mbody.kinetostatics(one, turn=True)
        for one in (own, other)
    ]
    newtons = [run.measure("pin") for run in runs]
    # rounding of numbers in other units; of the pendulum the error of its steps
    rel = 1e-6 if kind == "pendulum" else 1e-9
    atol = rel * newtons[0].max()
    np.testing.assert_allclose(newtons[1], newtons[0], rtol=0.0, atol=atol)


def test_kinds_are_printed_with_their_lengths(capsys):
    assert cli.main(["new"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(KINDS)
    assert lines[0].split()[-1] == "a,b,c,d"


def test_no_model_of_the_gallery_is_taken_for_a_file_of_another_program(capsys):
    """Whatever the words of its comments and arrays: a wrong parameter is said to be wrong."""
    for name in gallery.names():
        assert other_program(gallery.model_path(name)) == "", name
    assert cli.main(["kinetostatics", "stephenson_sixbar", "--set", "foo=3"]) == 2
    assert "there is no parameter 'foo'" in capsys.readouterr().err


def test_a_model_file_with_a_load_named_p_is_no_file_of_another_program(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    text = gallery.path("norton_fourbar").read_text(encoding="utf-8")
    file.write_text(text.replace("[loads]", '[loads]\nP = { force = 5, at = "coupler.P" }'))
    assert other_program(file) == ""
    assert cli.main(["kinematics", str(file), "--set", "foo=1"]) == 2
    assert "there is no parameter 'foo'" in capsys.readouterr().err


def test_a_long_label_does_not_hide_a_short_one():
    """Beside a free place that costs more, it stays off a label that it would cover as a whole."""
    places = FreePlaces(1.0)
    short, long = Label("K", [(0.0, 0.0, 0.0)]), Label("a much longer text", [])
    long.spots = [(0.0, 0.0, 0.0), (0.0, 50.0, 20.0)]
    places.set([short, long])
    assert long.at == (0.0, 50.0)


def test_a_fluctuation_and_an_indicator_are_printed_with_their_units():
    machine = mbody.makers.slider_crank(
        "2 in", "8 in", masses=(0, 0, 0), speed=10, units="in-lbf-s"
    )
    machine.add(
        mbody.ReciprocatingCylinder(
            *("pump", "ground", "slider.B"),
            **{"area": "3 in^2", "near": "10 in", "far": "6 in", "clearance": "0.2 in"},
            delivery="300 psi",
            bulk_modulus="300 ksi",
        )
    )
    run = mbody.kinetostatics(machine, turn="motor", instants=1441)
    chart, found = mbody.engineering.indicator(run, "pump"), mbody.engineering.fluctuation(run)

    def printed(result):
        """Numbers and units by name."""
        rows = [
            re.fullmatch(r"(.+?) +(-?[\d.]+) +(\S+)", line) for line in str(result).splitlines()
        ]
        return {row[1]: (float(row[2]), row[3]) for row in rows if row}

    shown = printed(chart)
    stroke, clearance, pressure = 3 * 4, 3 * 0.2, 300
    # a liquid that is compressed by p/K keeps that part of what was in the chamber
    left = (stroke + clearance) * pressure / 300e3
    assert shown["least volume"] == (pytest.approx(clearance, rel=1e-6), "in³")
    # the trapezoidal rule at the opening of the valve: a part of an interval of 1440
    assert shown["delivered"] == (pytest.approx(stroke - left, rel=2e-3), "in³")
    # work on the liquid less that which its springing back returns: p²/2K of the whole and the rest
    elastic = pressure**2 / 2 / 300e3 * stroke
    work = pressure * (stroke - left) + elastic
    assert shown["work on the fluid"] == (pytest.approx(work, rel=2e-3), "lbf·in")
    shown = printed(found)
    # without masses the motor does that work: the same force of the piston, by virtual work
    assert shown["work of a cycle"] == (pytest.approx(work, rel=2e-3), "lbf·in")
    assert "array" not in str(found) + repr(found) + str(chart) + repr(chart)


def test_the_page_of_model_files_names_every_table_and_kind():
    page = (ROOT / "docs" / "model-files.md").read_text(encoding="utf-8")
    tables = [name for name in json_schema()["properties"] if name != "$schema"]
    for name in tables:
        assert any(f"`{form}`" in page for form in (f"[{name}]", f"[{name}.NAME]", name)), name
    for kind in (kind for kinds in SECTIONS.values() for kind in kinds):
        assert f"`{kind}`" in page, kind


GAS = """
[ground]
points = { O = [0, 0] }
[bodies.crank]
inertia = 1
[joints]
O = { revolute = ["ground.O", "crank"] }
[drivers]
motor = { angle = "crank", law = { table = { file = "turn.csv" } } }
[curves]
gas = { file = "gas.csv", periodic = true }
[loads]
gas = { torque = "gas(crank.angle)", body = "crank" }
"""


def test_headings_of_tables_have_units(tmp_path):
    """The same numbers once with units in the headings, once by hand in m, N, rad."""
    (tmp_path / "turn.csv").write_text("time [ms],crank [deg]\n0,0\n500,90\n1000,270\n2000,300\n")
    (tmp_path / "gas.csv").write_text("crank [deg],moment [lbf*in]\n0,10\n90,40\n360,10\n")
    file = tmp_path / "mine.toml"
    file.write_text(GAS)
    run = mbody.kinetostatics(mbody.load(file), [0.0, 0.5, 1.0])
    # rounding of units
    np.testing.assert_allclose(np.degrees(run["crank"].angle), [0, 90, 270], rtol=1e-12, atol=1e-12)
    wanted = np.array([10.0, 40.0]) * 4.4482216152605 * 0.0254
    np.testing.assert_allclose(run.measure("gas.torque")[:2], wanted, rtol=1e-12)


@pytest.mark.parametrize(
    ("value", "noted"), [("60", True), ("60 rpm", False), ("2*3", True), ("0", False)]
)
def test_a_plain_number_in_place_of_one_in_another_unit_is_noted(value, noted, capsys):
    assert cli.main(["kinematics", "slider_crank", "--set", f"speed={value}"]) == 0
    said = "plain numbers for 'speed' are in rad/s, and its own value is"
    assert (said in " ".join(capsys.readouterr().out.split())) == noted


def test_bands_and_derivatives_of_angles_in_degrees(capsys):
    measure = ["span(rocker.angle)", "--over", "turn", "--json"]
    found = {}
    for angle in ("rad", "deg"):
        assert cli.main(["sensitivity", "norton_fourbar", *measure, "--angle", angle]) == 0
        found[angle] = json.loads(capsys.readouterr().out)
    by = [found[angle]["by"]["crank.A.x"]["derivative"] for angle in ("rad", "deg")]
    # a conversion and its rounding
    assert math.degrees(by[0]) == pytest.approx(by[1], rel=1e-13)
    assert math.degrees(found["rad"]["value"]) == pytest.approx(found["deg"]["value"], rel=1e-13)
    words = ["tolerances", "norton_fourbar", *measure[:-1], "--scatter", "crank.A.x=0.1"]
    texts = []
    for angle in ("rad", "deg"):
        assert cli.main([*words, "--count", "99", "--angle", angle]) == 0
        texts.append(capsys.readouterr().out)
    assert " rad\n" in texts[0] and " deg\n" in texts[1]


def test_designs_in_motion_differ_in_any_number(tmp_path):
    """A film of a changed length is that of a model that has the length."""
    machine = mbody.makers.slider_crank(0.05, 0.2, masses=(1, 1, 1), speed=30.0)
    other = mbody.makers.slider_crank(0.04, 0.2, masses=(1, 1, 1), speed=30.0)
    changed = motion(mbody.assemble(machine).with_values({"crank.A.x": 0.04}))
    wanted = motion(other)
    # mass centre and pins are computed in another order: rounding
    np.testing.assert_allclose(changed["slider"].x, wanted["slider"].x, rtol=1e-14)
    file = tmp_path / "mine.toml"
    mbody.save(machine, file)
    vary = ["view", str(file), "--vary", "crank.A.x=4 cm,6 cm", "-o", str(tmp_path / "mine.html")]
    assert cli.main(vary) == 0
    page = (tmp_path / "mine.html").read_text(encoding="utf-8")
    assert "crank.A.x = 4 cm" in page and "crank.A.x = 6 cm" in page


def test_inertias_and_losses_are_in_the_units_that_people_use(capsys):
    words = ["flywheel", "slider_crank", "--coefficient", "0.02", "--units"]
    rows = {}
    for units, unit, size in (("SI", "kg·m²", 1.0), ("mm-N-s", "kg·mm²", 1e-6)):
        assert cli.main([*words, units]) == 0
        found = [line.split() for line in capsys.readouterr().out.splitlines()]
        rows[units] = [size * float(row[-2]) for row in found if row and row[-1] == unit]
    # printed to six digits
    assert len(rows["SI"]) == 2 and rows["mm-N-s"] == pytest.approx(rows["SI"], rel=2e-5)
    machine = mbody.makers.slider_crank(50, 200, masses=("1 kg",) * 3, speed=30, units="mm-N-s")
    rough = with_changed(machine, [replace(machine["A"], friction=0.1, pin_radius=10.0)], [])
    run = mbody.kinetostatics(rough, turn="motor", instants=73)
    line = next(line for line in str(run).partition("FRICTION")[2].splitlines() if line[:1] == "A")
    assert float(line.split()[1]) == pytest.approx(run.losses["A"].max() / 1e3, rel=1e-4)
