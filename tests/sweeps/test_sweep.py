"""Sweeps: many designs through one analysis, wherever they run and wherever they are kept."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import threading
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import mbody
from mbody import (
    AngleDriver,
    Body,
    Gravity,
    Mechanism,
    Revolute,
    SimulationSettings,
    SolveError,
    Torque,
    cli,
    makers,
)
from mbody.core.lanes import LANES
from mbody.model.simulation import Instants, Measure
from mbody.sweeps import (
    Uniform,
    grid,
    latin_hypercube,
    monte_carlo,
    together,
)
from mbody.sweeps.samples import drawn
from tests.support.cases import first_fast
from tests.support.paths import ROOT
from tests.support.sweep_designs import four_bar, same, scattered, slider_crank

# lanes accept a last correction of 1e-12; times the condition of the loops, below 10
LANE = 1e-11


def pendulum(length=1.0, start=0.3):
    """A thin rod that is released, with a parameter, and a load of one number."""
    machine = Mechanism("pendulum", parameters={"l": length})
    machine.add(
        Body("rod", mass=2.0, inertia=0.1, cg=("l/2", 0.0), points={"O": (0.0, 0.0)}, guess=0.1),
        Revolute("O", "ground", "rod.O"),
        Gravity("gravity", y=-9.81),
        Torque("brake", "rod", value=-0.2),
    )
    machine.simulation = SimulationSettings(
        until=0.5, start={"rod": {"angle": start, "omega": 1.0}}
    )
    return machine


# -- the numbers ------------------------------------------------------------------------------


def test_a_grid_has_the_numbers_of_its_designs_one_by_one():
    cranks, masses = [0.8, 1.0, 1.1], [2.0, 5.0]
    found = mbody.sweep(
        slider_crank(),
        {"crank.A.x": cranks, "rod.mass": masses},
        measure=["A.force", "peak(motor.effort)"],
        turn=True,
        instants=73,
    )
    assert found.axes_of("A.force") == ("crank.A.x", "rod.mass", "instant")
    assert found["A.force"].shape == (3, 2, 73)
    assert list(found.axes) == ["crank.A.x", "rod.mass"]
    system = mbody.assemble(slider_crank())
    for i, crank in enumerate(cranks):
        for j, mass in enumerate(masses):
            one = system.with_values({"crank.A.x": crank, "rod.mass": mass})
            run = mbody.kinetostatics(one, turn=True, instants=73)
            peak = np.abs(run.effort("motor")).max()
            force = run.measure("A.force")
            assert_allclose(found["A.force"][i, j], force, rtol=0, atol=LANE * force.max())
            assert_allclose(found["peak(motor.effort)"][i, j], peak, rtol=LANE)


def test_the_stroke_of_a_slider_crank_is_that_of_the_formula():
    """x = r cos θ + √(l² − r² sin² θ)."""
    samples = monte_carlo({"crank.A.x": Uniform(0.2), "rod.B.x": Uniform(0.3)}, 100, seed=4)
    theta = np.linspace(0.0, 2.0 * math.pi, 91)
    found = mbody.sweep(
        slider_crank(), samples, "kinematics", ["rod.B.x", "max(rod.B.x)"], drive={"motor": theta}
    )
    r, l = (found.parameter(name)[:, None] for name in ("crank.A.x", "rod.B.x"))
    exact = r * np.cos(theta) + np.sqrt(l * l - (r * np.sin(theta)) ** 2)
    assert_allclose(found["rod.B.x"], exact, rtol=0, atol=LANE * 4.5)
    assert_array_equal(found["max(rod.B.x)"], found["rod.B.x"].max(axis=1))


def test_reductions_are_those_of_numpy():
    reductions = {
        "max": lambda a: a.max(axis=1),
        "min": lambda a: a.min(axis=1),
        "peak": lambda a: abs(a).max(axis=1),
        # over the turn: its ends count half
        "rms": lambda a: np.sqrt((0.5 * (a[:, 1:] ** 2 + a[:, :-1] ** 2)).mean(axis=1)),
        "mean": lambda a: (0.5 * (a[:, 1:] + a[:, :-1])).mean(axis=1),
        "first": lambda a: a[:, 0],
        "last": lambda a: a[:, -1],
    }
    asked = {name: f"{name}(motor.effort)" for name in reductions}
    asked |= {"all": "motor.effort", "third": "at(motor.effort, 2)", "greater": "max(A.fx, B.fx)"}
    asked["power"] = (Measure("motor.power", "kW"), "peak")
    found = mbody.sweep(
        slider_crank(), {"rod.mass": [1.0, 2.0]}, measure=asked | {"watt": "motor.power"},
        turn=True, instants=37,
    )  # fmt: skip
    for name, of in reductions.items():
        # sums of 37 numbers of either sign
        assert_allclose(found[name], of(found["all"]), rtol=1e-13, atol=1e-13 * found["peak"].max())
    assert_array_equal(found["third"], found["all"][:, 2])
    assert found["greater"].shape == (2, 37)
    assert found.units["power"] == "kW"
    assert_allclose(1e3 * found["power"], abs(found["watt"]).max(axis=1), rtol=1e-15)


@pytest.mark.parametrize("analysis", ["kinematics", "statics", "kinetostatics"])
def test_the_models_own_ask_and_measures_are_taken(analysis):
    machine = mbody.gallery.load("norton_fourbar")
    found = mbody.sweep(machine, {"rocker.B.x": [10.0, 10.5]}, analysis, "coupler.angle")
    run = mbody.analysis.driven.driven.analyse_at(machine, analysis)
    assert_allclose(found["coupler.angle"][0], run["coupler"].angle[0], rtol=LANE)
    if analysis != "kinematics":
        own = mbody.sweep(machine, {"rocker.B.x": [10.0]}, analysis)
        assert own.names == tuple(machine.measures)
        for name in own.names:
            assert_allclose(own[name], run.measure(name), rtol=LANE)


def test_instants_asked_for_in_the_words_of_a_description():
    """Followed from t = 0, and without the instants before."""
    machine = four_bar()
    found = mbody.sweep(
        machine, {"crank.mass": [1.0, 2.0]}, measure="motor.effort", at={"crank": ["60 deg", 2.0]}
    )
    ask = Instants(at={"crank": ["60 deg", 2.0]})
    run = mbody.analysis.driven.driven.analyse_at(machine, "kinetostatics", ask)
    assert_allclose(found.t, run.t, rtol=1e-15)
    assert_allclose(found["motor.effort"][0], run.effort("motor"), rtol=LANE)


def test_a_free_motion_has_the_numbers_of_the_description_with_these_numbers():
    """Another length is another description, whose motion begins elsewhere; its steps may differ by
    rounding, and so the motion by what is left of its error, of 1e-8 a step."""
    found = mbody.sweep(
        pendulum(), {"l": [0.8, "1.2 m"], "brake": [-0.2, 0.3]}, "simulate", "last(rod.angle)"
    )
    assert found["last(rod.angle)"].shape == (2, 2)
    for n, length in enumerate((0.8, 1.2)):
        run = mbody.simulate(pendulum(length))
        assert_allclose(found["last(rod.angle)"][n, 0], run["rod"].angle[-1], rtol=1e-8)
    assert found["last(rod.angle)"][0, 0] != found["last(rod.angle)"][0, 1]


def test_designs_that_differ_in_a_law_have_times_of_their_own():
    found = mbody.sweep(
        four_bar(), {"motor.law.speed": [5.0, 10.0]}, measure="peak(motor.effort)", turn=True
    )
    peaks = found["peak(motor.effort)"]
    assert_allclose(peaks[1] / peaks[0], 4.0, rtol=LANE)  # no load but inertia: ∝ ω²


def test_redundant_joints_go_one_by_one():
    machine = mbody.gallery.load("parallel_cranks")
    name = f"{machine.joints[0].name}.force"
    body = machine.bodies[0].name
    found = mbody.sweep(machine, {f"{body}.mass": [1.0, 2.0]}, measure=f"peak({name})")
    one = mbody.assemble(machine).with_values({f"{body}.mass": 2.0})
    run = mbody.kinetostatics(one, **mbody.analysis.driven.driven.arguments_at(one, machine.ask)[0])
    assert found[f"peak({name})"][1] == run.measure(name)[-len(found.t) :].max()


# -- what fails -------------------------------------------------------------------------------


def test_a_failed_design_is_a_row_with_its_sentence():
    lengths = np.linspace(0.9, 1.1, 2 * LANES + 3)
    good = mbody.sweep(four_bar(), {"crank.A.x": lengths}, measure="peak(A.force)", turn=True)
    lengths[5], lengths[20] = 30.0, 2.2  # does not close; reaches a dead centre
    bad = mbody.sweep(four_bar(), {"crank.A.x": lengths}, measure="peak(A.force)", turn=True)
    assert sorted(bad.failures) == [5, 20]
    for design, told in bad.failures.items():
        with pytest.raises(SolveError) as error:
            mbody.kinetostatics(bad.design(design), turn=True)
        assert told == str(error.value)
    others = np.delete(np.arange(len(lengths)), [5, 20])
    peaks = [one["peak(A.force)"] for one in (good, bad)]
    assert np.isnan(peaks[1][[5, 20]]).all()
    assert_allclose(peaks[1][others], peaks[0][others], rtol=LANE)
    assert f"2 of {len(bad)} designs failed" in str(bad)


def test_a_number_that_a_body_cannot_have_fails_one_design():
    found = mbody.sweep(four_bar(), {"crank.mass": [1.0, -1.0, 2.0]}, measure="O2.force")
    assert list(found.failures) == [1]
    assert "must not be negative" in found.failures[1]
    assert np.isfinite(found["O2.force"][[0, 2]]).all()


def test_an_invalid_number_leaves_the_lanes_of_others():
    mass = np.linspace(1.0, 2.0, 53)
    wrong = mass.copy()
    wrong[20] = -1.0
    options = {"measure": "peak(A.force)", "turn": True, "instants": 19, "threads": 1}
    whole = mbody.sweep(four_bar(), {"coupler.mass": mass}, **options)
    found = mbody.sweep(four_bar(), {"coupler.mass": wrong}, **options)
    assert list(found.failures) == [20]
    force, expected = found["peak(A.force)"], whole["peak(A.force)"]
    beside = np.arange(16, 32) != 20  # the lanes of the invalid one: alone, to rounding
    assert_array_equal(np.delete(force, np.arange(16, 32)), np.delete(expected, np.arange(16, 32)))
    assert_allclose(force[16:32][beside], expected[16:32][beside], rtol=1e-11)


def test_a_measure_without_a_value_is_told():
    found = mbody.sweep(
        slider_crank(), {"crank.A.x": [0.9, 1.1]}, "kinematics", "sqrt(rod.B.x - 3.37 m)"
    )
    assert list(found.failures) == [0]
    assert "no finite value" in found.failures[0]


def test_ctrl_c_leaves_what_was_done():
    def stop(done, of):
        if done >= 512:
            raise KeyboardInterrupt

    samples = monte_carlo({"crank.A.x": Uniform(0.1)}, 2000, seed=5)
    options = {"measure": "peak(A.force)", "turn": True, "instants": 37, "threads": 2}
    part = mbody.sweep(four_bar(), samples, progress=stop, **options)
    whole = mbody.sweep(four_bar(), samples, **options)
    assert part.status == "stopped: after 512 of 2000 designs"
    assert part.done.sum() == 512
    assert not part.failures
    assert_array_equal(part["peak(A.force)"][part.done], whole["peak(A.force)"][part.done])
    assert np.isnan(part["peak(A.force)"][~part.done]).all()


# -- where it runs, and where it is kept ------------------------------------------------------

QUESTION = {"measure": ["peak(A.force)", "motor.effort"], "turn": True, "instants": 19}


def test_threads_change_no_bit():
    found = [mbody.sweep(four_bar(), scattered(), threads=n, **QUESTION) for n in (1, 2, 5)]
    assert found[0].failures
    same(found[0], found[1])
    same(found[0], found[2])


@first_fast("instants", [2, 19, 20, 37, 73, 361], 1)
def test_a_cut_batch_has_the_same_bits(instants):
    """Lanes go in step: what one design gets may depend on its neighbours, not on the cut, nor on
    designs that failed in the same lanes before.
    """
    question = QUESTION | {"instants": instants}
    whole = mbody.sweep(four_bar(), scattered(), threads=1, **question)
    assert len(whole.failures) > 2
    values = {n: whole.parameter(n)[3 * LANES :] for n in ("crank.A.x", "coupler.mass")}
    part = mbody.sweep(four_bar(), together(values), threads=1, **question)
    for name in whole.names:
        assert_array_equal(whole[name][3 * LANES :], part[name])


def test_a_folder_keeps_the_same_numbers(tmp_path):
    pytest.importorskip("pyarrow")
    inside = mbody.sweep(four_bar(), scattered(), **QUESTION)
    stored = mbody.sweep(four_bar(), scattered(), to=tmp_path / "sweep", **QUESTION)
    same(inside, stored)
    assert stored.done.all()
    frame = stored.to_dataframe()
    assert list(frame.columns) == ["crank.A.x", "coupler.mass", *stored.names, "error", "doubt"]
    assert_array_equal(frame["peak(A.force)"], inside["peak(A.force)"])


#: Of many designs: with more instants they go in lanes, which takes a fifth of the time.
MANY = QUESTION | {"instants": 37}

KILLED = """
import os, signal, sys
sys.path.insert(0, {root!r})
import mbody
from tests.support.sweep_designs import four_bar, scattered
from tests.sweeps.test_sweep import MANY

def kill(done, of):
    if done >= 4096:
        os.kill(os.getpid(), signal.SIGKILL)

mbody.sweep(four_bar(), scattered(10_000), to={folder!r}, progress=kill, **MANY)
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no signal that cannot be caught")
def test_a_killed_sweep_goes_on_without_loss(tmp_path):
    pytest.importorskip("pyarrow")
    folder, root = tmp_path / "sweep", str(ROOT)
    script = KILLED.format(root=root, folder=str(folder))
    ended = subprocess.run([sys.executable, "-c", script], cwd=root, env=os.environ, check=False)
    assert ended.returncode == -signal.SIGKILL
    assert list(folder.glob("*.parquet"))
    (folder / "designs-000004096.part").write_bytes(b"half a file")
    calls = []
    found = mbody.sweep(
        four_bar(),
        scattered(10_000),
        to=folder,
        progress=lambda done, of: calls.append(done),
        **MANY,
    )
    assert len(calls) < 3  # of three files one was there
    same(mbody.sweep(four_bar(), scattered(10_000), **MANY), found)


def test_a_folder_is_of_one_sweep(tmp_path):
    pytest.importorskip("pyarrow")
    options = {"measure": "A.force", "to": tmp_path}
    mbody.sweep(four_bar(), {"crank.mass": [1.0, 2.0]}, **options)
    again = mbody.sweep(four_bar(), {"crank.mass": [1.0, 2.0]}, **options)
    assert again.done.all()
    others = [
        (four_bar(), {"crank.mass": [1.0, 3.0]}, "kinetostatics", "A.force", "samples"),
        (four_bar(), {"rocker.mass": [1.0, 2.0]}, "kinetostatics", "A.force", "parameters"),
        (four_bar(), {"crank.mass": [1.0, 2.0]}, "statics", "A.force", "analysis"),
        (four_bar(), {"crank.mass": [1.0, 2.0]}, "kinetostatics", "B.force", "measures"),
        (makers.four_bar(1, 3, 2, 3), {"crank.mass": [1, 2]}, "kinetostatics", "A.force", "model"),
    ]
    for machine, parameters, analysis, measure, told in others:
        with pytest.raises(mbody.ModelError, match=f"another sweep, with other .*{told}"):
            mbody.sweep(machine, parameters, analysis, measure, to=tmp_path)


@pytest.mark.slow
def test_a_dask_cluster_has_the_same_bits():
    distributed = pytest.importorskip("distributed")
    here = mbody.sweep(four_bar(), scattered(), **QUESTION)
    swing = mbody.gallery.load("double_pendulum")
    motion = swing, latin_hypercube({"upper.mass": (0.9, 1.1)}, 100), "simulate"
    way = {"measure": ["last(lower.angle)", "peak(O.force)"], "until": 0.5}
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=True, dashboard_address=None
    ) as cluster:
        calls = []
        there = mbody.sweep(
            four_bar(),
            scattered(),
            scheduler=cluster.scheduler_address,
            progress=lambda done, of: calls.append(done),
            **QUESTION,
        )
        freely = mbody.sweep(*motion, scheduler=cluster.scheduler_address, **way)
    same(here, there)
    assert calls[-1] == 700
    same(mbody.sweep(*motion, **way), freely)


def test_memory_does_not_grow_with_the_designs():
    """Histories are freed block by block: four times the designs cost their numbers alone."""
    peaks = []
    for count in (2000, 8000):
        samples = monte_carlo({"crank.A.x": Uniform(0.1)}, count, seed=5)
        tracemalloc.start()
        mbody.sweep(four_bar(), samples, measure="peak(A.force)", turn=True, threads=1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # a number each of the sample, its copies while it is drawn, and the answer: 8 of 8 bytes
    assert peaks[1] - peaks[0] < 6000 * 8 * 8


def test_own_code_keeps_to_one_thread():
    """Python of the user is called by the calling thread."""
    seen = set()

    def torque(t):
        seen.add(threading.current_thread())
        return 2.0 * t

    machine = Mechanism("crank")
    machine.add(
        Body("crank", mass=1.0, inertia=1.0, points={"O": (0.0, 0.0)}),
        Revolute("O", "ground", "crank.O"),
        AngleDriver("motor", "crank", 0.0),
        Torque("T", "crank", value=torque),
    )
    found = mbody.sweep(machine, {"crank.mass": [1.0, 2.0]}, measure="motor.effort", t=[0.0, 3.0])
    assert seen == {threading.current_thread()}
    assert_allclose(found["motor.effort"][:, 1], -6.0, rtol=1e-14)


def test_a_grid_is_the_default():
    system = mbody.assemble(four_bar())
    values = {"crank.mass": [1.0, 2.0], "rocker.mass": [3.0, 4.0, 5.0]}
    one, other = drawn(system, values), drawn(system, grid(values))
    assert_array_equal(one.values, other.values)
    assert_array_equal(one.values[:, 0], np.repeat([1.0, 2.0], 3))


@pytest.mark.parametrize("name", ["stephenson_sixbar", "planetary_train", "cam_follower"])
def test_whole_turns_stay_on_the_lanes(name, monkeypatch):
    """Pivots good at the first position alone vanish on the way, and every design went alone."""
    monkeypatch.setattr("mbody.sweeps.job._alone", lambda job, values: pytest.fail("went alone"))
    machine = mbody.gallery.load(name)
    body, joint = machine.bodies[0].name, machine.joints[0].name
    mass = mbody.assemble(machine).values[f"{body}.mass"]
    scatter = monte_carlo({f"{body}.mass": Uniform(0.1 * mass)}, 2 * LANES, seed=1)
    found = mbody.sweep(machine, scatter, measure=f"{joint}.force")
    for design in (0, LANES + 1):
        run = mbody.kinetostatics(found.design(design), turn=True, instants=len(found.t))
        force = run.measure(f"{joint}.force")
        assert_allclose(found[f"{joint}.force"][design], force, rtol=0, atol=LANE * force.max())


def test_the_command_tells_the_same(tmp_path, capsys):
    words = ["sweep", "norton_fourbar", "--over", "turn", "--instants", "19", "--measure"]
    words += ["peak(A.force)", "--measure", "A.fx", "--vary", "rocker.B.x=9.5 in:10.5 in:3"]
    table = tmp_path / "table.csv"
    assert (
        cli.main([*words, "--vary", "coupler.weight=2,3 lbf", "--json", "--csv", str(table)]) == 0
    )
    told = json.loads(capsys.readouterr().out)
    machine = mbody.gallery.load("norton_fourbar")
    parameters = {"rocker.B.x": [9.5, 10.0, 10.5], "coupler.weight": [2.0, 3.0]}
    asked = ["peak(A.force)", "A.fx"]
    found = mbody.sweep(machine, parameters, measure=asked, turn=True, instants=19)
    assert told["status"] == "completed"
    assert told["columns"]["peak(A.force)"] == found["peak(A.force)"].reshape(-1).tolist()
    assert told["columns"]["A.fx"] == found["A.fx"].reshape(6, 19).tolist()
    with table.open(encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert [float(row[head.index("A.fx[18] [lbf]")]) for row in rows] == [
        row[18] for row in told["columns"]["A.fx"]
    ]


def test_the_command_tells_what_failed(capsys):
    words = ["sweep", "norton_fourbar", "--vary", "rocker.B.x=10,60"]
    assert cli.main([*words, "--measure", "A.force", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    told = said["columns"]
    assert told["A.force"][1] is None and "do not close" in told["error"][1]
    assert said["status"] == "completed"
    assert f"failed: 1 of 2 designs, as design 1: {told['error'][1]}" in said["notes"]
    assert cli.main([*words, "--measure", "A.force"]) == 0
    assert "1 of 2 designs failed" in capsys.readouterr().out


def test_progress_is_shown_of_long_sweeps(monkeypatch, capsys):
    """After a while, on standard error, written over at the end."""
    from mbody.analysis.dynamics import interruptions

    monkeypatch.setattr(interruptions, "PATIENCE", -1.0)
    monkeypatch.setattr(interruptions, "BETWEEN", -1.0)
    show = interruptions.counted("designs")
    show(50, 200)
    assert "25 %" in capsys.readouterr().err
    show(200, 200)
    assert capsys.readouterr().err.strip() == ""


def test_pins_with_friction():
    """A sweep keeps the rows of its measures alone, by which nothing can be told to be open."""
    machine = mbody.gallery.load("toggle_press")
    t = [0.0, 5.0, 10.0]
    found = mbody.sweep(machine, {"arm": [0.15, 0.2]}, measure="peak(K.force)", t=t)
    own = [
        mbody.kinetostatics(mbody.assemble(machine).with_values({"arm": arm}), t=t)
        for arm in (0.15, 0.2)
    ]
    forces = [run.reaction("K", on="lower") for run in own]
    wanted = [np.hypot(one.fx, one.fy).max() for one in forces]
    assert found["peak(K.force)"] == pytest.approx(wanted, rel=1e-12)
