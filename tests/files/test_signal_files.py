"""Inputs, auxiliary states and formulas in model files and in all that reads descriptions: each
number by a second route, SciPy or another of ours that shares no code with the first.
"""

import csv
import io
import json
import math
import sys
import types

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbody
from mbody import Input, Torque
from mbody.cli import main
from mbody.files.model import from_toml, json_schema, to_toml
from mbody.files.model.read import from_json
from mbody.files.model.write import to_json

MODEL = """\
name = "loop"

[parameters]
target = "30 deg"
kp = "20 N*m/rad"

[inputs]
u = "1.5 N*m"
wave = "0.5 N*m*sin(3 rad/s*t)"
steps = { table = { x = [0, 1], y = ["1 N*m", "2 N*m"], outside = "hold" } }
gain = 2

[bodies.arm]
mass = "2 kg"
inertia = "0.1 kg*m^2"
cg = [0.2, 0]
points = { A = [1, 0] }

[joints]
O = { revolute = ["ground", "arm"] }

[states]
i = { rate = "target - arm.angle", start = "0.1 rad*s" }
lag = { rate = "(u + wave - lag)/(0.2 s)", start = "steady", size = "1 N*m" }

[loads]
spring = { spring = ["ground", "arm.A"], stiffness = "3 N/m", free_length = "20 cm" }
pull = { force = "-3 N/m*spring.length*gain", at = "arm.A" }

[loads.motor]
torque = "kp*(target - arm.angle) + 8 N*m/rad/s*i - 2 N*m*s/rad*arm.omega + lag"
body = "arm"

[measures]
error = "target - arm.angle"

[simulate]
until = "1 s"
"""


@pytest.fixture(scope="module")
def machine():
    return from_toml(MODEL)


@pytest.fixture(scope="module")
def run(machine):
    return mbody.simulate(machine, rtol=1e-10)


# -- files -----------------------------------------------------------------------------------------


def test_a_file_comes_back_the_same_from_toml_and_from_json(machine):
    assert from_toml(to_toml(machine)) == machine
    assert from_json(to_json(machine)) == machine
    assert to_toml(from_toml(to_toml(machine))) == to_toml(machine)
    assert "5 inputs" not in repr(machine) and "4 inputs, 2 states" in repr(machine)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('u = "1.5 N*m"', 'u = "1.6 N*m"'),
        ("gain = 2", 'gain = "2 m"'),
        ("0.5 N*m*sin", "0.6 N*m*sin"),
        ('"target - arm.angle", start', '"target - 2*arm.angle", start'),
        ('start = "0.1 rad*s"', 'start = "0.2 rad*s"'),
        ('start = "0.1 rad*s"', 'start = "steady"'),
        ('size = "1 N*m"', 'size = "2 N*m"'),
        ("8 N*m/rad/s*i", "9 N*m/rad/s*i"),
    ],
)
def test_mechanisms_differ_by_their_inputs_states_and_formulas(machine, old, new):
    assert old in MODEL
    changed = MODEL.replace(old, new).replace("*gain", "" if "2 m" in new else "*gain")
    assert from_toml(changed) != machine


def test_the_schema_takes_what_is_read_and_refuses_what_is_not():
    jsonschema = pytest.importorskip("jsonschema")
    tables = json.loads(to_json(from_toml(MODEL)))
    jsonschema.validate(tables, json_schema())
    tables["states"]["i"]["begin"] = 1
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tables, json_schema())


def test_the_motion_of_a_file_is_that_of_scipy(run):
    kp, target, gain = 20.0, math.radians(30.0), 2.0

    def rates(t, y):
        angle, omega, i, lag = y
        # about the pin, J = 0.1 + 2*0.2²; the spring passes through it, the pull at A is along x
        pull = -3.0 * 1.0 * gain
        torque = kp * (target - angle) + 8.0 * i - 2.0 * omega + lag - math.sin(angle) * pull
        drive = 1.5 + 0.5 * math.sin(3.0 * t)
        return [omega, torque / 0.18, target - angle, (drive - lag) / 0.2]

    start = [0.0, 0.0, 0.1, 1.5]  # lag begins steady: u + wave at 0
    found = solve_ivp(rates, (0.0, 1.0), start, "DOP853", run.t, rtol=1e-12, atol=1e-13).y
    # the error of one motion at rtol 1e-10 and of SciPy's
    assert np.allclose(run["arm"].angle, found[0], rtol=0, atol=2e-9)
    assert np.allclose(run.measure("i"), found[2], rtol=0, atol=2e-9)
    assert np.allclose(run.measure("lag"), found[3], rtol=0, atol=2e-9)


# -- numbers ---------------------------------------------------------------------------------------


def test_a_sweep_over_an_input_and_a_start_is_that_of_single_motions(machine):
    found = mbody.sweep(
        machine,
        {"u": ["1 N*m", "2 N*m"], "i.start": [0.0, 0.2]},
        "simulate",
        ["last(arm.angle)", "last(i)", "last(u)"],
        rtol=1e-9,
    )
    assert not found.failures
    columns = found.columns()
    for n in range(4):
        values = {"u": columns["u"][n], "i.start": columns["i.start"][n]}
        alone = mbody.simulate(mbody.assemble(machine).with_values(values), rtol=1e-9)
        # lanes and single motions choose their own steps: each within the tolerance of a motion
        assert columns["last(arm.angle)"][n] == pytest.approx(alone["arm"].angle[-1], abs=2e-8)
        assert columns["last(i)"][n] == pytest.approx(alone.measure("i")[-1], abs=2e-8)
        assert columns["last(u)"][n] == values["u"]


# -- results ---------------------------------------------------------------------------------------


def test_the_summary_of_an_instant_has_the_formula_of_a_load(machine):
    held = from_toml(MODEL + '\n[drivers]\nm = { angle = "arm", law = "1 rad/s*t" }\n')
    run = mbody.kinetostatics(held)
    assert "kp*(target - arm.angle)" in str(run)
    assert any("keeps its start, 0.1 s·rad, in kinetostatics" in note for note in run.notes)
    assert any("'lag' is not made steady" in note for note in run.notes)
    # the effort holds the arm against the formula, summed by hand, and the pull on the turning arm
    target = math.radians(30.0)
    torque = 20.0 * target + 8.0 * 0.1 - 2.0 * 1.0 + 0.0
    assert run.effort("m")[0] == pytest.approx(-torque, rel=1e-12)


def test_a_saved_run_comes_back_and_goes_on(machine, run, tmp_path):
    mbody.save_run(run, tmp_path / "run.npz")
    again = mbody.load_run(tmp_path / "run.npz")
    for name in ("u", "wave", "i", "lag"):
        assert np.array_equal(again.measure(name), run.measure(name))
    on, over = (mbody.simulate(machine, 2.0, start=one, rtol=1e-10) for one in (run, again))
    assert np.array_equal(on.measure("i"), over.measure("i"))
    assert np.array_equal(on["arm"].angle, over["arm"].angle)


# -- the command -----------------------------------------------------------------------------------


def test_the_command_takes_histories(tmp_path, capsys):
    path, history = tmp_path / "m.toml", tmp_path / "u.csv"
    path.write_text(MODEL)
    history.write_text("t,u\n0,1\n0.5,3\n1,2\n")
    words = ["simulate", str(path), "--instants", "5", "--csv", "-"]
    words += ["--input", f"u=@{history}", "--input", "wave=1 lbf*ft"]
    assert main(words) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [float(row["u [N·m]"]) for row in rows] == [1.0, 2.0, 3.0, 2.5, 2.0]
    foot_pound = 0.45359237 * 9.80665 * 0.3048
    assert float(rows[0]["wave [N·m]"]) == pytest.approx(foot_pound, rel=1e-15)


# -- other instants, joined motions ----------------------------------------------------------------


def test_other_instants_are_what_the_motion_would_have_kept(machine):
    few, many = (mbody.simulate(machine, instants=n) for n in (3, 41))
    found = few.at(many.t)
    whole = slice(None)
    assert np.array_equal(found.record.table(whole), many.record.table(whole))
    assert np.array_equal(found.energy.balance, many.energy.balance)
    assert few.at([0.9, 0.1]).t.tolist() == [0.9, 0.1]
    assert found.status == "completed" and few.at(0.25)["arm"].omega.shape == (1,)


def test_other_instants_through_events_releases_and_inputs():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=4.0)
    machine.add(mbody.Gravity("gravity", y=-9.81), Input("u", "0 N*m"))
    machine.add(Torque("push", "rocker", value="u"))
    t, u = [0, 0.3, 0.6, 2], [0, 5, -5, 0]
    history = mbody.laws.Table(t, u, interpolation="hold", outside="hold")
    options = {
        "release": {"motor": 0.4},
        "events": [mbody.Event("rocker.omega", name="turning")],
        "inputs": {"u": history},
    }
    few, many = (mbody.simulate(machine, 1.5, instants=n, **options) for n in (4, 31))
    found = few.at(many.t)
    assert np.array_equal(found["rocker"].angle, many["rocker"].angle)
    assert np.array_equal(found.measure("u"), many.measure("u"))
    assert [one.t for one in few.events] == [one.t for one in many.events]


def test_motions_are_joined_and_followed_again(machine):
    first = mbody.simulate(machine, 0.6)
    second = mbody.simulate(machine, 1.0, start=first)
    whole, straight = first.then(second), mbody.simulate(machine, 1.0)
    assert len(whole) == len(first) + len(second) - 1
    at = np.array([0.2, 0.5, 0.8, 1.0])
    a, b = whole.at(at), straight.at(at)
    assert np.array_equal(a["arm"].angle, b["arm"].angle)  # a motion goes on bit for bit
    assert np.array_equal(a.measure("lag"), b.measure("lag"))
    # the account of energy is one: the work of both parts, to the rounding of their sums
    ours, theirs = (one.energy.by["motor"] for one in (whole, straight))
    size = straight.energy.size
    assert ours[-1] == pytest.approx(theirs[-1], abs=1e-12 * size)
    assert np.allclose(a.energy.by["motor"], b.energy.by["motor"], atol=1e-12 * size)
    assert whole.stats["steps"] >= first.stats["steps"] + second.stats["steps"]


def test_what_a_dataset_is_made_of(run, monkeypatch):
    made = {}

    class Dataset:
        def __init__(self, parts, coords, attrs):
            made.update(parts=parts, coords=coords, attrs=attrs)

    monkeypatch.setitem(sys.modules, "xarray", types.SimpleNamespace(Dataset=Dataset))
    run.to_xarray()
    dimension, values, attributes = made["parts"]["lag"]
    assert (dimension, attributes) == ("t", {"units": "N·m"})
    assert np.array_equal(values, run.measure("lag"))
    assert made["coords"]["t"][0] == "t" and "t" not in made["parts"]
    assert made["attrs"]["model"] == "loop"
