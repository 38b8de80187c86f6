"""The table of a result: every history that it has by name, in the units that are wanted."""

import json
import math
import pickle

import numpy as np
import pytest

import mbody
from mbody.quantities.evaluate import convert
from mbody.views.page_data import scene_data
from mbody.views.scene import scene

#: Models with what tables have of elements: loads, couplings, contacts, friction, states, inputs.
MODELS = ("norton_fourbar", "v_twin", "sliding_ladder", "mud_pump_motor", "cam_follower")


def run_of(name):
    model = mbody.gallery.load(name)
    if model.simulation is None:
        return mbody.kinetostatics(model, turn=True, instants=4)
    return mbody.simulate(model, instants=4)


@pytest.mark.parametrize("name", MODELS)
def test_columns_are_what_measures_of_their_names_are(name):
    run = run_of(name)
    table = run.table()
    assert [one.name for one in table] == list(dict.fromkeys(table.names)), "a name stands once"
    for one in table:
        if one.role == "measure" or one.key.startswith("effort_"):
            continue
        found = run.measure(one.name)
        assert np.array_equal(one.values, found, equal_nan=True), one
        own = run.mechanism.units.of(one.dimension)
        assert one.unit == ("" if one.quantity == "number" else own)


def test_units_are_those_that_are_wanted():
    run = run_of("norton_fourbar")
    wanted = {"angle": "deg", "speed": "rpm", "force": "N", "torque": "N*m", "length": "mm"}
    plain, table = run.table(), run.table(wanted)
    assert plain.names == table.names
    units = {"rad": "deg", "rad/s": "rpm", "lbf": "N", "lbf·in": "N·m", "in": "mm"}
    seen = set()
    for one, other in zip(plain, table, strict=True):
        if one.unit not in units:
            assert (one.unit, one.values.tolist()) == (other.unit, other.values.tolist())
            continue
        seen.add(one.unit)
        assert other.unit == units[one.unit]
        exact = convert(one.values, one.unit.replace("·", "*"), other.unit.replace("·", "*"))
        # degrees are rounded to fifteen digits
        assert other.values == pytest.approx(exact, rel=5e-15, abs=1e-300), one
    assert seen == set(units)


def test_magnitudes_roles_and_what_is_determined():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    machine.add(mbody.Spring("spring", "ground", "rocker.B", stiffness=20.0))
    run = mbody.kinetostatics(machine)
    table = run.table()
    size = math.hypot(table["A.fx"].values[0], table["A.fy"].values[0])
    assert table["A.force"].values[0] == pytest.approx(size, rel=1e-15)
    roles = {one.owner: one.role for one in table}
    assert (roles["A"], roles["spring"], roles["motor"], roles["crank"], roles["t"]) == (
        "joint", "load", "driver", "body", "time",
    )  # fmt: skip
    assert all(one.unique for one in table)
    motion = mbody.kinematics(machine).table()
    assert {one.key for one in motion if one.role == "joint"} == {"angle", "rate"}
    assert {one.key for one in motion if one.role == "driver"} == {"value", "rate", "acceleration"}
    still = mbody.statics(machine).table()
    assert {one.key for one in still if one.role == "driver"} == {"effort", "value"}


def test_forces_that_nothing_determines_are_marked():
    machine = mbody.Mechanism("beam on three pins", ground={"A": (0, 0), "B": (1, 0), "C": (2, 0)})
    points = {"A": (-1.0, 0.0), "B": (0.0, 0.0), "C": (1.0, 0.0)}
    machine.add(
        mbody.Body("beam", mass=1.0, inertia=1.0, points=points, guess=(1.0, 0.0, 0.0)),
        *(mbody.Revolute(name, f"ground.{name}", f"beam.{name}") for name in "ABC"),
        mbody.Gravity("weight", y=-9.81),
    )
    run = mbody.statics(machine)
    table, columns = run.table(), run.columns()
    assert [table[f"A.{key}"].unique for key in ("fx", "fy", "force")] == [False, False, False]
    assert table["A.angle"].unique is True
    assert columns["A.unique"].tolist() == [0.0]
    assert not any(name.endswith(".unique") for name in run_of("norton_fourbar").columns())


#: Units of results by quantity, each another than that of SI.
CHOSEN = {
    "length": "mm", "time": "ms", "angle": "deg", "speed": "rpm", "velocity": "cm/s",
    "force": "kN", "torque": "N*mm", "power": "kW", "acceleration": "mm/s^2",
    "angular acceleration": "deg/s^2",
}  # fmt: skip


def _numbers(tree, path=()):
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from _numbers(value, (*path, key))
    elif isinstance(tree, list):
        for value in tree:
            yield from _numbers(value, path)
    elif isinstance(tree, float):
        yield path, tree


def test_chosen_units_are_those_of_all_data_and_of_their_head():
    machine = mbody.gallery.load("stick_slip")
    plain = mbody.simulate(machine, 2.0, instants=9).data()
    machine.output_units = CHOSEN
    found = mbody.simulate(machine, 2.0, instants=9).data()
    dimensions = {
        "x": "length", "y": "length", "angle": "angle", "vx": "velocity", "vy": "velocity",
        "omega": "angular velocity", "ax": "acceleration", "ay": "acceleration",
        "alpha": "angular acceleration", "fx": "force", "fy": "force", "torque": "torque",
        "t": "time",
    }  # fmt: skip
    by_group = {"energy": "torque", "losses": "power", "contacts": "force"}
    seen = set()
    for (path, one), (other, value) in zip(_numbers(plain), _numbers(found), strict=True):
        assert path == other
        dimension = by_group.get(path[0]) or dimensions.get(path[-1])
        if dimension is None or path[0] in ("checks", "stats"):
            continue
        units = plain["units"][dimension], found["units"][dimension]
        exact = convert(one, *(unit.replace("·", "*") for unit in units))
        assert value == pytest.approx(exact, rel=1e-14, abs=1e-300), path
        seen.add(dimension)
    assert seen >= {"length", "velocity", "acceleration", "force", "torque", "power", "time"}


@pytest.mark.parametrize("name", ["norton_fourbar", "v_twin", "mud_pump_sixbar", "quick_return"])
def test_sheet_report_and_page_show_numbers_and_units_of_the_columns(name, tmp_path):
    model = mbody.gallery.load(name)
    model.output_units = {"torque": "N*m", "force": "N", "speed": "rpm", "power": "W"}
    run = mbody.kinetostatics(model, turn=True, instants=13)
    shown = run.table({"angle": "deg"})
    driver = model.drivers[0].name
    (body, *_) = (one.name for one in model.bodies)

    def near(text, value, size):
        # six digits of the greatest of a column are shown
        return abs(float(text.replace("−", "-")) - value) <= 5.1e-6 * size

    effort, power, omega = (
        shown[one] for one in (f"{driver}.effort", f"{driver}.power", f"{body}.omega")
    )
    k = int(np.argmax(np.abs(effort.values)))
    sheet = str(run.take([k])).splitlines()
    start = next(n for n, line in enumerate(sheet) if line.startswith("DRIVERS"))
    cells, units = sheet[start + 3].split(), sheet[start + 1].split()
    assert units[:2] == [effort.unit, power.unit] == ["N·m", "W"]
    assert near(cells[2], effort.values[k], abs(effort.values[k]))
    assert near(cells[3], power.values[k], abs(power.values[k]))
    start = next(n for n, line in enumerate(sheet) if line.startswith("LINKS"))
    at = sheet[start].split().index("ω") - 1  # beside the name, which is two words below
    assert sheet[start + 1].split()[at] == omega.unit == "rpm"
    rates = np.array([shown[f"{one.name}.omega"].values[k] for one in model.bodies])
    for n, rate in enumerate(rates):
        assert near(sheet[start + 4 + n].split()[at + 2], rate, np.abs(rates).max())

    page = json.loads(json.dumps(scene_data(scene(run), [f"{driver}.effort", f"{body}.omega"])))
    for plot, column in zip(page["plots"], (effort, omega), strict=True):
        assert plot["unit"] == column.unit
        size = np.abs(column.values).max()
        assert np.allclose(plot["values"], column.values, rtol=0.0, atol=1e-6 * size)
    measured = [one for one in shown if one.role == "measure"]
    assert {one.name: page["measures"][one.name][0] for one in measured} == {
        one.name: one.unit for one in measured
    }

    mbody.report(run, ["loads"]).save(tmp_path / "report.md")
    text = (tmp_path / "report.md").read_text(encoding="utf-8").replace("\\", "").splitlines()
    for column in (effort, *measured):
        start = column.owner if column is not effort else driver
        cells = [one.strip() for one in row_of_table(text, start)]
        assert cells[-1] == column.unit
        for value in (np.nanmin(column.values), np.nanmax(column.values)):
            assert any(
                near(one, value, np.nanmax(np.abs(column.values)))
                for one in cells[1:-1]
                if one and one.replace("−", "").replace(".", "").isdigit()
            ), (column, cells)


def row_of_table(text, name):
    """Cells of the row of Markdown that begins with a name."""
    rows = (line.strip("|").split("|") for line in text if line.startswith("|"))
    return next(row for row in rows if row[0].strip().split(",")[0].split(" ")[0] == name)


def test_what_was_printed_is_packed_and_follows_other_units():
    """The sheet keeps its table: not in a copy for another process, nor when units change."""
    run = mbody.kinetostatics(mbody.gallery.load("norton_fourbar"))
    text = str(run)
    assert str(pickle.loads(pickle.dumps(run))) == text
    run.mechanism.output_units = {"length": "mm"}
    line = next(line for line in str(run).splitlines() if line.startswith("crank.A "))
    # 5 in at 60 deg, with four decimals or more
    assert float(line.split()[1]) == pytest.approx(5.0 * 25.4 * 0.5, abs=1e-3)
