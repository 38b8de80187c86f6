"""What the everyday command prints: whole degrees, a row a design, units beside limits."""

import csv
import json
import math
import re

import numpy as np
import pytest

import mbody
from mbody import cli, gallery
from mbody.quantities.evaluate import short_degrees
from mbody.summaries.text_table import force_names


def test_an_angle_of_the_command_comes_back_as_it_was_given(capsys):
    for angle in (60.0, 75.0, 170.25):
        assert cli.main(["assemblies", "norton_fourbar", f"--at=crank={angle}", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["at"]["motor"] == angle
    rng = np.random.default_rng(3)
    for value in rng.uniform(-10, 10, 200).tolist():
        assert math.radians(short_degrees(value)) == pytest.approx(value, rel=1e-15)


def rows(text):
    """The rows of the table of designs."""
    body = text.partition("DESIGN")[2].partition("─\n")[2]
    found = (line.split() for line in body.partition("\n\n")[0].splitlines())
    return [[float(cell) for cell in line] for line in found]


def test_a_sweep_has_a_row_for_each_design():
    machine = gallery.load("norton_fourbar")
    lengths = [9.5, 10.0, 10.5]
    found = mbody.sweep(
        machine,
        {"rocker.B.x": lengths},
        "kinetostatics",
        ["peak(A.force)"],
        over="motor",
        instants=37,
    )
    shown = rows(str(found))
    assert [row[:2] for row in shown] == [[n, x] for n, x in enumerate(lengths)]
    for length, row in zip(lengths, shown, strict=True):
        system = mbody.assemble(machine).with_values({"rocker.B.x": length})
        run = mbody.kinetostatics(system, turn="motor", instants=37)
        # six digits are printed
        assert row[2] == pytest.approx(run.reaction("A").magnitude.max(), rel=1e-5)
    assert re.search(r"DESIGN +rocker\.B\.x +peak\(A\.force\)\n +in +lbf\n", str(found))


def instants(text):
    """The rows of the table of a few instants: name and unit, then the cells."""
    body = text.partition("INSTANTS")[2].partition("─\n")[2].partition("\n\n")[0]
    return [re.split(r"  +", line.strip()) for line in body.splitlines()]


@pytest.mark.parametrize(
    ("model", "units"),
    [
        ("norton_fourbar", []),
        ("norton_fourbar", ["--units", "torque=N*m,force=kN,speed=rpm"]),
        ("watt_sixbar", []),
    ],
)
def test_a_dozen_positions_have_a_row_each(model, units, capsys):
    """In the order and at the positions that were asked for; cells are those of data."""
    words = ["kinetostatics", model, "--at", "crank=0:330:12", *units]
    assert cli.main(words) == 0
    blocks = capsys.readouterr().out.split("\n\n")
    tables = [block.splitlines() for block in blocks if block.lstrip().startswith("at motor")]
    assert all(len(rows) == 15 and max(map(len, rows)) <= 100 for rows in tables)
    assert cli.main([*words, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    forces = {name: np.hypot(one["fx"], one["fy"]) for name, one in data["reactions"].items()}
    names = force_names(gallery.load(model))
    wanted = {names[name][0]: values for name, values in forces.items()}
    wanted |= {names["motor"][0]: data["efforts"]["motor"]}
    seen = set()
    for head, _, _, *rows in tables:
        cells = np.array([[float(cell) for cell in row.split()] for row in rows])
        np.testing.assert_allclose(cells[:, 0], np.arange(0.0, 360.0, 30.0), atol=1e-3)
        for name, column in zip(re.split(r"  +", head.strip())[1:], cells.T[1:], strict=True):
            if name in wanted:
                seen.add(name)
                # six digits of the greatest in a column
                most = 1e-5 * max(map(abs, wanted[name]))
                np.testing.assert_allclose(column, wanted[name], rtol=0.0, atol=most)
    assert seen == set(wanted)


def test_rows_of_kinematics_are_in_the_units_of_their_heads(capsys):
    words = ["kinematics", "norton_fourbar", "--at", "crank=0:330:12"]
    assert cli.main([*words, "--units", "speed=rpm"]) == 0
    head, units, _, *rows = capsys.readouterr().out.split("\n\n")[1].splitlines()
    names = re.split(r"  +", head.strip())
    assert units.split() == ["deg"] + 3 * ["deg", "rpm"]
    cells = dict(zip(names, np.array([row.split() for row in rows], float).T, strict=True))
    assert cli.main([*words, "--json"]) == 0
    for name, body in json.loads(capsys.readouterr().out)["bodies"].items():
        wanted = np.array(body["omega"]) * 30.0 / np.pi
        most = 1e-5 * np.abs(wanted).max()  # six digits of the greatest in a column
        np.testing.assert_allclose(cells[f"{name} ω"], wanted, rtol=0.0, atol=most)


def test_a_cross_check_says_the_units_of_its_rows(capsys):
    """They are those of the model, whatever results are in."""
    words = ["norton_fourbar", "--units", "torque=N*m,speed=rpm", "--json"]
    assert cli.main(["kinetostatics", *words]) == 0
    run = json.loads(capsys.readouterr().out)
    assert cli.main(["crosscheck", *words, "--against", "oracle"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["units"]["torque"], found["units"]["angular velocity"]) == ("lbf·in", "rad/s")
    ours = {row["quantity"]: row["ours"] for row in found["engines"]["oracle"]["rows"]}
    size = 4.4482216152605 * 0.0254  # N·m a lbf·in
    assert ours["motor.effort"] * size == pytest.approx(run["efforts"]["motor"][0], rel=1e-9)
    rate = run["bodies"]["rocker"]["omega"][0] * math.pi / 30.0
    assert ours["rocker.omega"] == pytest.approx(rate, rel=1e-9)


def test_a_few_instants_have_a_column_each(capsys):
    machine = gallery.load("norton_fourbar")
    assert cli.main(["kinetostatics", "norton_fourbar", "--at", "crank=20,50,80"]) == 0
    found = {row[0]: row[1:] for row in instants(capsys.readouterr().out)}
    assert cli.main(["kinetostatics", "norton_fourbar", "--at", "crank=20,50,80", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    power = [
        m * w
        for m, w in zip(data["efforts"]["motor"], data["bodies"]["crank"]["omega"], strict=True)
    ]
    for name, unit, values in (
        ("motor torque", "lbf·in", data["efforts"]["motor"]),
        ("motor power", "lbf·in/s", power),
        ("rocker ω", "rad/s", data["bodies"]["rocker"]["omega"]),
        ("coupler angle", "deg", data["bodies"]["coupler"]["angle"]),
        ("F32, A", "lbf", np.hypot(data["reactions"]["A"]["fx"], data["reactions"]["A"]["fy"])),
    ):
        assert found[name][0] == unit
        cells = [float(cell) for cell in found[name][1:]]
        # six digits of the greatest in a row, angles to a thousandth
        np.testing.assert_allclose(
            cells, values, rtol=0, atol=max(1e-3, 1e-5 * max(map(abs, values)))
        )
    run = mbody.kinetostatics(machine, turn="motor", instants=7)
    assert "INSTANTS" not in str(run) and "INSTANTS" not in str(mbody.kinetostatics(machine))


def test_points_have_their_velocities_on_the_summary():
    run = mbody.kinetostatics(gallery.load("norton_fourbar"))
    rows = str(run).partition("POINTS")[2].partition("─\n")[2].partition("\n\n")[0].splitlines()
    found = {row.split()[0]: row.replace("@", " ").replace("°", " ").split()[1:] for row in rows}
    # pins on the ground rest, and a pin between links has one row
    assert list(found) == ["crank.A", "coupler.B", "coupler.P"]
    for name, cells in found.items():
        point = run.point(name)
        speed = math.hypot(point.vx[0], point.vy[0])
        assert float(cells[2]) == pytest.approx(speed, rel=1e-5)
        towards = math.degrees(math.atan2(point.vy[0], point.vx[0])) % 360
        assert float(cells[3]) == pytest.approx(towards, abs=1e-3)


def test_kilograms_watts_and_rpm_are_what_people_read(capsys):
    said = {}
    for units in ("mm-N-s", "SI", "cm-kN-s", "in-lbf-s"):
        assert cli.main(["kinetostatics", "norton_fourbar", f"--units={units}"]) == 0
        said[units] = capsys.readouterr().out
    crank = {}
    for units, text in said.items():
        rows = [line.split() for line in text.splitlines()]
        crank[units] = next(row for row in rows if row[:2] == ["2", "crank"])
        drive = next(row for row in rows if row[:2] == ["T12", "motor"])
        assert float(drive[6]) == pytest.approx(25.0 * 30.0 / math.pi, rel=1e-5)
    kilograms, watts = 1.5 / 386 * 4.4482216152605 / 0.0254, 6080.94 * 4.4482216152605 * 0.0254
    for units in ("mm-N-s", "cm-kN-s", "SI"):
        assert float(crank[units][2]) == pytest.approx(kilograms, rel=1e-5)
        drive = next(line.split() for line in said[units].splitlines() if line.startswith("T12"))
        assert float(drive[3]) == pytest.approx(watts, rel=1e-5)


def test_degrees_in_tables_have_no_rounding(capsys):
    how = ["kinematics", "norton_fourbar", "--at", "crank=20,60,380,420,780,1000"]
    assert cli.main([*how, "--csv", "-", "--angle", "deg"]) == 0
    header, *lines = (line.split(",") for line in capsys.readouterr().out.splitlines())
    column = [float(line[header.index("crank.angle [deg]")]) for line in lines]
    assert cli.main([*how, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bodies"]["crank"]["angle"] == column
    assert [angle % 360 for angle in column] == [20, 60, 20, 60, 60, 280]


@pytest.mark.parametrize(
    ("words", "keys"),
    [
        (["shaking", "--shafts", "1"], ("shafts", 0, "angle")),
        (["flywheel", "--coefficient", "0.02"], ("greatest_at",)),
        (["poles", "--at", "crank=60"], ("centres", 3, "direction", 0)),
    ],
)
def test_angles_in_degrees_by_every_command(words, keys, tmp_path, capsys):
    path = tmp_path / "slider_crank.toml"
    assert cli.main(["new", "slidercrank", "-o", str(path)]) == 0
    command, *rest = words
    found = {}
    for unit in ("deg", "rad"):
        assert cli.main([command, str(path), *rest, "--json", "--angle", unit]) == 0
        data = json.loads(capsys.readouterr().out)
        assert data["units"]["angle"] == unit
        for key in keys:
            data = data[key]
        found[unit] = data
    if found["rad"] is None:
        assert found["deg"] is None
    else:
        assert found["deg"] == pytest.approx(math.degrees(found["rad"]), rel=1e-14)


def test_a_sweep_gives_angles_in_degrees(capsys):
    how = ["sweep", "norton_fourbar", "--vary", "rocker.B.x=9.5,10.5", "--over", "turn", "--json"]
    how += ["--measure", "max(rocker.angle)", "--measure", "span(rocker.angle - crank.angle)"]
    how += ["--measure", "peak(A.force)"]
    found = []
    for more in (["--angle", "deg"], []):
        assert cli.main([*how, *more]) == 0
        found.append(json.loads(capsys.readouterr().out)["columns"])
    for name, values in found[1].items():
        if "(" in name:
            factor = math.degrees(1.0) if "angle" in name else 1.0
            np.testing.assert_allclose(found[0][name], np.multiply(values, factor), rtol=1e-14)


def test_angles_among_the_designs_of_a_sweep(capsys, tmp_path):
    """As they are given, in degrees, on the summary; in data and files by --angle."""
    how = ["sweep", "norton_fourbar", "--vary", "coupler.cg.angle=10,25.5,40", "--at", "crank=60"]
    how += ["--vary", "crank.A.x=5,5.5", "--measure", "A.force"]
    assert cli.main(how) == 0
    text = capsys.readouterr().out.partition("DESIGN")[2].splitlines()
    row = next(line.split() for line in text if line.split()[:1] == ["2"])
    assert text[1].split()[:2] == ["deg", "in"] and [float(x) for x in row[1:3]] == [25.5, 5.0]
    given = [10.0, 10.0, 25.5, 25.5, 40.0, 40.0]
    for angle, factor in (("deg", 1.0), ("rad", math.radians(1.0))):
        table = tmp_path / f"{angle}.csv"
        assert cli.main([*how, "--json", "--angle", angle, "--csv", str(table)]) == 0
        data = json.loads(capsys.readouterr().out)
        assert data["units"]["coupler.cg.angle"] == angle and data["units"]["crank.A.x"] == "in"
        np.testing.assert_allclose(data["columns"]["coupler.cg.angle"], np.multiply(given, factor))
        rows = list(csv.DictReader(table.read_text().splitlines()))
        assert [float(one[f"coupler.cg.angle [{angle}]"]) for one in rows] == pytest.approx(
            np.multiply(given, factor).tolist()
        )


@pytest.mark.parametrize("size", [1.0, 1e12])
def test_summaries_of_six_instants_are_as_wide_as_others(size):
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 2, 3), speed=25.0 * size)
    run = mbody.kinetostatics(machine, drive={"motor": (np.linspace(0, 2, 6), 25.0 * size)})
    text = str(run)
    tables = text.count("INSTANTS")
    assert max(map(len, text.splitlines())) <= 100 and tables == (1 if size == 1.0 else 2)
    titles = [line.split()[1:] for line in text.splitlines() if line.startswith("INSTANTS")]
    assert [title for row in titles for title in row] == list("123456")
