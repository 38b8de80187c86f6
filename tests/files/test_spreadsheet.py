"""A result as a spreadsheet: its sheets, read back by another program's library."""

import math

import numpy as np
import pytest

import mbody

pandas = pytest.importorskip("pandas")
pytest.importorskip("openpyxl")


@pytest.mark.parametrize("name", ["quick_return", "stick_slip"])
def test_sheets_have_the_numbers_of_the_table_in_the_units_that_people_read(name, tmp_path):
    model = mbody.gallery.load(name)
    model.output_units = {"velocity": "cm/s"}
    simulated = model.simulation is not None
    run = mbody.simulate(model, 1.0, instants=9) if simulated else mbody.kinetostatics(model)
    run.to_xlsx(tmp_path / "run.xlsx")
    sheets = pandas.read_excel(tmp_path / "run.xlsx", sheet_name=None)
    assert list(sheets) == ["instants", "peaks", "model"]
    wanted = {"angle": "deg", "power": "W", "mass": "kg", "velocity": "cm/s"}
    table, instants = run.table(wanted), sheets["instants"]
    names = [one.heading for one in table]
    assert [name for name in instants if not name.endswith(".unique")] == names
    for one in table:
        found = instants[one.heading].to_numpy(float)
        # the file has sixteen digits
        assert found == pytest.approx(one.values, rel=1e-15, abs=0.0, nan_ok=True), one
    peaks = sheets["peaks"].set_index("quantity")
    for one in table:
        if one.name == "t" or not np.isfinite(one.values).any():
            continue
        row, t = peaks.loc[one.name], run.t[np.isfinite(one.values)]
        there = one.values[np.isfinite(one.values)]
        ends = there.min(), there.max()
        assert (row["least"], row["greatest"]) == pytest.approx(ends, rel=1e-15, abs=0.0)
        assert there[np.argmin(np.abs(t - row["greatest at t"]))] == there.max()
        if np.ptp(t) > 0.0:
            mean = np.trapezoid(there, t) / np.ptp(t)
            assert row["mean"] == pytest.approx(mean, rel=1e-9, abs=1e-9 * np.abs(there).max())
        assert row["rms"] >= abs(row["mean"]) - 1e-9 * abs(row["rms"])
        assert (row["unit"] == one.unit) or (one.unit == "" and not isinstance(row["unit"], str))
    said = sheets["model"]
    status = said[(said["of"] == "result") & (said["what"] == "status")]["value"].item()
    assert status == run.status
    assert {"bodies", "joints"} <= set(said["of"])


def test_text_that_begins_as_a_formula_stays_text(tmp_path):
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    machine.name = "=1+1"
    mbody.kinetostatics(machine).to_xlsx(tmp_path / "run.xlsx")
    import openpyxl

    sheet = openpyxl.load_workbook(tmp_path / "run.xlsx")["model"]
    cell = next(row[3] for row in sheet.iter_rows() if row[2].value == "model")
    assert (cell.value, cell.data_type) == ("=1+1", "s")
    assert math.isfinite(sheet.column_dimensions["A"].width)
