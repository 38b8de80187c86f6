"""One result by every writer: the same numbers in the same units, read back by other libraries."""

import csv
import json

import numpy as np
import pytest

import mbody
from mbody.gallery import names

#: Units of output, none of which is that of a model's system.
CHOSEN = {
    "length": "dm", "angle": "rev", "speed": "rpm", "force": "kp", "torque": "kN*mm", "power": "hp",
}  # fmt: skip
#: The models by which every change is tested; the rest of the gallery takes its time.
QUICK = ("norton_fourbar", "sliding_ladder", "cam_follower")
#: Of thousands of bodies, of which all that is here is known by the others.
LEFT_OUT = ("pile_of_discs", "n_windows_40")
MODELS = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in names()
    if name not in LEFT_OUT
]


def analysed(name):
    model = mbody.gallery.load(name)
    model.output_units = CHOSEN
    if model.simulation is not None or not model.drivers:
        return mbody.simulate(model, instants=5)
    try:
        return mbody.kinetostatics(model, turn=True, instants=5)
    except (mbody.ModelError, mbody.SolveError):  # it does not turn
        return mbody.kinetostatics(model)


@pytest.mark.parametrize("name", MODELS)
def test_all_files_of_a_result_have_its_numbers(name, tmp_path):
    pandas, openpyxl = pytest.importorskip("pandas"), pytest.importorskip("openpyxl")
    parquet = pytest.importorskip("pyarrow.parquet")
    run = analysed(name)
    table = {one.heading: one for one in run.table()}
    for form, write in {
        "csv": run.to_csv, "npz": run.to_npz, "json": run.to_json, "xlsx": run.to_xlsx,
        "parquet": run.to_parquet,
    }.items():  # fmt: skip
        write(tmp_path / f"run.{form}")

    def same(values, one, rel=0.0):
        assert np.asarray(values, float) == pytest.approx(
            one.values, rel=rel, abs=0.0, nan_ok=True
        ), one

    frame = pandas.read_csv(tmp_path / "run.csv")
    with (tmp_path / "run.csv").open(encoding="utf-8", newline="") as file:
        head = next(csv.reader(file))
    with np.load(tmp_path / "run.npz") as arrays:
        assert [str(one) for one in arrays["columns"]] == head == list(frame)
        for heading, one in table.items():
            same(frame[heading], one, rel=1e-15)  # as pandas reads decimals
            same(arrays[one.name], one)
    stored = parquet.read_table(tmp_path / "run.parquet")
    assert stored.column_names == head
    assert json.loads(stored.schema.metadata[b"mbody"])["status"] == run.status
    for heading, one in table.items():
        same(stored[heading].to_numpy(), one)
    book = openpyxl.load_workbook(tmp_path / "run.xlsx", read_only=True)
    first, *rows = book["instants"].iter_rows(values_only=True)
    shown = dict(zip(first, zip(*rows, strict=True), strict=True))
    for one in run.table(run.mechanism.shown.names()):
        # the file has sixteen digits
        same([np.nan if v is None else v for v in shown[one.heading]], one, rel=1e-15)
    data = json.loads((tmp_path / "run.json").read_text("utf-8"))
    for one in table.values():
        group = data.get({"body": "bodies", "point": "points"}.get(one.role), {})
        if one.owner in group:
            same(group[one.owner][one.key], one)
            assert data["units"][one.quantity] == one.unit
        elif one.role == "driver" and one.key == "effort":
            found = [np.nan if v is None else v for v in data["efforts"][one.owner]]
            same(found, one)
        elif one.role in ("joint", "contact") and one.key in ("fx", "fy", "torque"):
            found = [np.nan if v is None else v for v in data["reactions"][one.owner][one.key]]
            same(found, one)
            assert data["units"][one.quantity] == one.unit
