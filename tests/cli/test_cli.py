"""The command: what it prints, its exit statuses, and that a second run compiles nothing."""

import csv
import io
import json
import math
import subprocess
import sys

import numpy as np
import pytest

import mbody
from mbody import cli, gallery
from mbody.cli.learn import PRINTED
from mbody.core.selection import chosen
from mbody.files.tables import measured_data
from tests.support.cases import first_fast
from tests.support.gallery_tables import tables
from tests.support.paths import ROOT


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-X", "utf8", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8")


@pytest.fixture
def run(capsys):
    """The command's status, output and errors."""

    def run(*arguments: str) -> tuple[int, str, str]:
        status = cli.main(list(arguments))
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


# -- demo, warmup, the process ----------------------------------------------------------------


def test_demo_prints_the_book_and_ours(capsys):
    assert cli.main(["demo"]) == 0
    text = capsys.readouterr().out
    book, _, summary = text.partition("THE BOOK")[2].partition("With the exact masses")
    assert summary.splitlines()[-3].startswith("RESIDUALS   constraint")
    assert summary.splitlines()[-1].endswith("view norton_fourbar --open")
    assert "F12      -117.560   -107.459   159.272 @ 222.430°" in summary
    assert "243.238" in summary
    lines = book.splitlines()
    for name, printed in PRINTED.items():
        shown = [line.split() for line in lines if line.startswith(name)]
        assert len(shown) == len(printed)
        for cells, value in zip(shown, printed, strict=True):
            theirs, ours, difference = map(float, cells[-4:-1] if len(printed) == 1 else cells[2:5])
            assert f"{theirs:.2f}" == f"{value:.2f}"
            assert difference == pytest.approx(ours - theirs, abs=1.01e-4)
            assert abs(difference) < (
                0.005 if "gives" not in cells and "give" not in cells else 0.02
            )
    assert "give 222.509" in book and "give 40.345" in book
    assert "15 of 17 agree to the last printed digit" in book
    assert max(map(len, text.splitlines())) <= 100


@pytest.mark.slow
def test_a_second_process_compiles_nothing():
    """The demo and, after a warm-up, a sweep on lanes load their kernels from the disk."""
    code = (
        "import sys; from mbody.cli import main; status = main(['demo']);"
        "import mbody; from mbody.gallery import load;"
        "mbody.kinetostatics(load('norton_fourbar'), turn=True, instants=400).breakdown('A');"
        "from mbody.core.decorators import compilations;"
        "print(status, compilations(), file=sys.stderr)"
    )
    assert python("-m", "mbody", "warmup").returncode == 0
    second = python("-c", code)
    assert second.stderr.split() == ["0", "0"], second.stderr


#: Prints the kernels that `mbody warmup` has left unbuilt or uncompiled.
LEFT_COLD = """
from mbody.cli.compile import all_kernels
from mbody.cli.compile import warmup
from mbody.core.selection import chosen
warmup()
for name, function in all_kernels().items():
    if chosen().name == "native":
        from mbody.core.native import missing
        there = function not in missing()
    else:
        import sys
        there = getattr(sys.modules[function.__module__], name).signatures
    if not there:
        print("cold:", name)
"""


def test_warmup_leaves_no_kernel_cold():
    """With numba but one evaluation alone, and many, which are there to test and to measure."""
    told = python("-c", LEFT_COLD).stdout
    assert "ready" in told
    cold = {line for line in told.splitlines() if line.startswith("cold")}
    numba = {"cold: free_motion", "cold: law", "cold: repeat"}
    assert cold <= (numba if chosen().name == "numba" else set())


def test_help_loads_no_kernels():
    code = "import sys; from mbody.cli import main; main([]); print('numba' in sys.modules)"
    assert python("-c", code).stdout.split()[-1] == "False"


def test_a_reader_that_leaves_gets_no_traceback():
    code = (
        "import os, sys, mbody.cli as cli, mbody.cli.learn as demo\n"
        "read, write = os.pipe(); os.close(read); os.dup2(write, 1)\n"
        "demo.demo = lambda asked: print('x' * 100000) or 0\n"
        "sys.exit(cli.main(['demo']))"
    )
    done = python("-c", code)
    assert (done.returncode, done.stderr) == (1, "")


def test_a_stop_by_the_user_is_no_traceback(monkeypatch, run):
    def stopped(asked: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr("mbody.cli.learn.demo", stopped)
    assert run("demo") == (130, "", "mbody: stopped\n")


def test_the_module_is_the_command():
    done = python("-m", "mbody", "--version")
    assert (done.returncode, done.stdout.strip()) == (0, f"mbody {mbody.__version__}")


# -- analyses ---------------------------------------------------------------------------------


def test_the_four_bar_as_data(run):
    status, out, err = run("kinetostatics", "norton_fourbar", "--json")
    assert (status, err) == (0, "")
    told = json.loads(out)
    # quadruple precision, references of P1; the four-bar's condition is 70
    assert told["efforts"]["motor"] == [pytest.approx(243.23759076122965, rel=1e-12)]
    on_crank = told["reactions"]["O2"]
    assert (on_crank["i"], on_crank["j"]) == ("ground", "crank")
    assert on_crank["fx"] == [pytest.approx(-117.55959232776144, rel=1e-12)]
    units = {
        "length": "in",
        "force": "lbf",
        "time": "s",
        "mass": "blob",
        "angle": "deg",
        "torque": "lbf·in",
        "power": "lbf·in/s",
        "inertia": "lbf·in·s²",
    }
    assert told["units"].items() >= units.items()
    keys = "mbody model analysis units status doubts notes t bodies points reactions efforts"
    assert list(told)[:12] == keys.split()
    assert list(told)[12:] == ["powers", "unique_efforts", "loads", "measures", "checks"]
    assert told["analysis"] == "kinetostatics" and told["mbody"] == mbody.__version__
    assert told["bodies"]["crank"]["angle"] == [pytest.approx(60.0)]
    motion = ["x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"]
    assert list(told["bodies"]["rocker"]) == motion
    assert list(told["points"]["coupler.P"]) == ["x", "y", "vx", "vy", "ax", "ay"]
    assert told["checks"].pop("energy") is None  # there is one of a motion over time
    assert set(told["checks"]) >= {"constraint", "equilibrium", "virtual_work"}
    assert max(told["checks"][key] for key in ("constraint", "equilibrium", "virtual_work")) < 1e-12


def test_data_in_radians_and_other_units(run):
    _, out, _ = run("kinetostatics", "norton_fourbar", "--json")
    plain = json.loads(out)
    _, out, _ = run("kinetostatics", "norton_fourbar", "--json", "--angle", "rad", "--units", "SI")
    told = json.loads(out)
    assert told["units"]["angle"] == "rad" and told["units"]["torque"] == "N·m"
    assert told["bodies"]["crank"]["angle"] == [pytest.approx(math.radians(60.0))]
    assert told["bodies"]["crank"]["omega"] == pytest.approx(plain["bodies"]["crank"]["omega"])
    torque = 0.3048 / 12 * 4.4482216152605  # an inch times a pound force, exact by definition
    assert told["efforts"]["motor"][0] == pytest.approx(
        plain["efforts"]["motor"][0] * torque, rel=1e-12
    )


@pytest.mark.parametrize("analysis", ["kinematics", "kinetostatics", "statics"])
@first_fast("model", [n for n in gallery.names() if "ask" in tables(n)], 6)
def test_every_model_in_every_analysis(analysis, model, run):
    status, out, err = run(analysis, model, "--json")
    assert (status, err) == (0, ""), err
    told = json.loads(out)
    count = len(told["t"])
    for table in (told["bodies"], told["points"]):
        assert all(len(values) == count for part in table.values() for values in part.values())
    forces = analysis != "kinematics"
    assert bool(told["efforts"]) == forces and bool(told["reactions"]) == forces
    status, summary, _ = run(analysis, model)
    assert status == 0 and max(map(len, summary.splitlines())) <= 100


def test_equations_are_the_books(run):
    status, out, _ = run("kinetostatics", "norton_fourbar_printed", "--equations")
    assert status == 0
    heads = ["F12x", "F12y", "F32x", "F32y", "F43x", "F43y", "F14x", "F14y", "T12"]
    assert next(line for line in out.splitlines() if line.startswith("EQUATIONS")).split()[
        1:10
    ] == (heads)
    _, out, _ = run("kinetostatics", "norton_fourbar_printed", "--equations", "--json")
    told = json.loads(out)["equations"]
    # eq. 11.9 with the book's numbers, as it prints them
    matrix = np.array(told["matrix"])
    assert matrix.shape == (9, 9)
    assert np.round(matrix[2], 2).tolist() == [3.0, 0.0, -1.33, 2.5, 0.0, 0.0, 0.0, 0.0, 1.0]
    assert np.round(matrix[5, 2:6], 2).tolist() == [-8.22, 3.67, 2.86, 10.34]
    assert np.round(matrix[8, 4:8], 2).tolist() == [4.84, 1.24, 4.84, 1.24]
    solved = np.linalg.solve(matrix, told["rhs"])
    assert np.abs(solved - told["values"]).max() < 1e-10 * np.abs(solved).max()


def test_where_a_driver_is(run):
    _, out, _ = run("kinetostatics", "norton_fourbar", "--json", "--at", "crank=90, 240")
    told = json.loads(out)
    assert told["bodies"]["crank"]["angle"] == [pytest.approx(90.0), pytest.approx(240.0)]
    # ω² = 25² − 2 · 40 Δθ by the law of the motor
    turned = np.radians([30.0, 180.0])
    assert told["bodies"]["crank"]["omega"] == pytest.approx(np.sqrt(625.0 - 80.0 * turned))
    _, out, _ = run("kinetostatics", "norton_fourbar", "--json", "--at", f"t={told['t'][1]!r}")
    assert json.loads(out)["efforts"]["motor"] == [pytest.approx(told["efforts"]["motor"][1])]


def test_files(run, tmp_path):
    table, arrays = tmp_path / "a.csv", tmp_path / "a.npz"
    words = ("--over", "turn", "--instants", "9", "--csv", str(table), "--npz", str(arrays))
    status, out, err = run("kinetostatics", "norton_fourbar", *words)
    assert status == 0 and "PEAK FORCES" in out and "9 instants" in err
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    with np.load(arrays) as kept:
        assert kept["motor.effort"].tolist() == [
            float(row[rows[0].index("motor.effort [lbf·in]")]) for row in rows[1:]
        ]
        assert list(kept["columns"]) == rows[0]
    plain = table.read_bytes()
    status, *_ = run("kinetostatics", "norton_fourbar", *words, "--excel")
    assert status == 0 and table.read_bytes() == b"\xef\xbb\xbf" + plain
    assert list(measured_data(table)) == rows[0]
    status, out, _ = run("kinetostatics", "norton_fourbar", "--csv", "-")
    assert status == 0 and len(list(csv.reader(io.StringIO(out)))) == 2


# -- about ------------------------------------------------------------------------------------


def test_check_counts(run):
    _, out, _ = run("check", "parallel_cranks", "--json")
    told = json.loads(out)
    assert (told["of_joints"]["gruebler"], told["of_joints"]["freedom"]) == (0, 1)
    assert told["of_joints"]["redundant"] == 1
    status, out, _ = run("check", "parallel_cranks")
    assert status == 0 and "crank1 turns about O1" in out


def test_models_and_show(run):
    _, out, _ = run("models", "--json")
    told = {entry["model"]: entry for entry in json.loads(out)["models"]}
    assert set(told) == set(gallery.names())
    assert all(entry["title"] and entry["source"] and entry["note"] for entry in told.values())
    _, out, _ = run("models")
    assert all(name in out for name in told) and max(map(len, out.splitlines())) <= 100
    _, out, _ = run("show", "hoekens")
    assert out == gallery.path("hoekens").read_text("utf-8")


def test_doctor_and_schema(run):
    status, out, _ = run("doctor", "--json")
    told = json.loads(out)
    assert status == 0 and told["ready"] and told["needed"]["pint"]
    assert "ready" in run("doctor")[1]
    _, out, _ = run("schema")
    assert json.loads(out)["title"] == "mbody model"
