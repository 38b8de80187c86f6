"""Least and greatest values within limits: against closed forms, grids of sweeps, differences."""

import json
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import AngleDriver, Body, Mechanism, Revolute
from mbody.cli import main
from mbody.errors import ModelError, SolveError
from mbody.laws import Polynomial
from mbody.optimization.optimize import Optimum
from mbody.sweeps import Steps

TURN = {"over": "turn", "instants": 37}


def norton():
    return mbody.gallery.load("norton_fourbar")


def wheel(mass=2.0):
    """A body on one pin, its mass centre off the axis: the pin force is m e ω² at any angle."""
    machine = Mechanism("wheel", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("disc", mass=mass, inertia=1.0, cg=(0.3, 0.1), points={"O": (0.0, 0.0)}),
        Revolute("O", "ground.O", "disc.O"),
        AngleDriver("motor", "disc", Polynomial((0.0, 10.0))),
    )
    return machine


# -- values -----------------------------------------------------------------------------------


def test_a_closed_form():
    """F = m ω² √(x² + y²): with x ≥ 0.2 and y free the least is at (0.2, 0), a bound that binds."""
    found = mbody.optimize(
        wheel(),
        minimize="peak(O.force)",
        by={"disc.cg.x": (0.2, 1.0), "disc.cg.y": (-1.0, 1.0)},
        starts=3,
        **TURN,
    )
    assert isinstance(found, Optimum) and found.status == "completed"
    assert_allclose(found.objective, 2.0 * 100.0 * 0.2, rtol=1e-8)
    # the root of y² is flat: what is left of y counts by its square
    assert_allclose([found.values["disc.cg.x"], found.values["disc.cg.y"]], [0.2, 0.0], atol=1e-4)
    (active,) = found.active
    assert active.constraint == "disc.cg.x >= 0.2 m" and active.t is None
    assert_allclose(active.multiplier, 200.0, rtol=1e-6)
    assert found.agreeing == found.starts == 3
    low, high = found.band["disc.cg.x"]
    # 1 % more force is 1 % more x, where y is 0
    assert_allclose([low, high], [0.2, 0.202], rtol=1e-4)
    # √(0.2² + y²) = 1.01 · 0.2
    assert_allclose(found.band["disc.cg.y"][1], 0.2 * np.sqrt(1.01**2 - 1.0), rtol=1e-3)


def test_an_aim_that_is_no_number_at_the_start():
    """ln²(ln(F/F₀)) is none below F₀ = 70 N, where the start is, and least, zero, at F = e F₀."""
    found = mbody.optimize(
        wheel(),
        minimize="peak(log(log(O.force/(70 N)))^2)",
        by={"disc.cg.x": (0.2, 1.5)},
        starts=2,
        **TURN,
    )
    assert np.hypot(0.3, 0.1) * 2.0 * 100.0 < 70.0
    # the least is flat: what is left of x counts by its square
    assert_allclose(found.values["disc.cg.x"], np.sqrt((0.35 * np.e) ** 2 - 0.1**2), rtol=1e-3)
    assert found.agreeing == found.starts == 2


def test_greatest_values_and_equations():
    """Greatest F with x + y = 0.5, x, y ≥ 0.1: at a corner, (0.4, 0.1) or (0.1, 0.4)."""
    machine = wheel()
    found = mbody.optimize(
        machine,
        maximize="mean(O.force)",
        by={"disc.cg.x": (0.1, 1.0), "disc.cg.y": (0.1, 1.0)},
        subject_to="first(disc.x + disc.y) = 0.5 m",
        starts=4,
        t=0.0,
    )
    # at t = 0 the link axes are those of the ground
    assert_allclose(found.objective, 200.0 * np.hypot(0.4, 0.1), rtol=1e-6)
    assert abs(found.constraints["first(disc.x + disc.y) = 0.5 m"]) < 1e-6


@pytest.mark.parametrize("limit", ["161 lbf", "165 lbf"])
def test_the_optimum_is_no_worse_than_a_fine_grid(limit):
    by = {"coupler.cg.r": (2.0, 12.0), "coupler.cg.angle": (-1.0, np.pi)}
    text = f"peak(A.force) <= {limit}"
    found = mbody.optimize(
        norton(), minimize="peak(motor.effort)", by=by, subject_to=text, starts=4, **TURN
    )
    grid = mbody.sweep(
        norton(),
        {name: Steps(*pair, 161) for name, pair in by.items()},
        measure=["peak(motor.effort)", "peak(A.force)"],
        **TURN,
    )
    fits = grid["peak(A.force)"] <= float(limit.split()[0])
    best = grid["peak(motor.effort)"][fits].min()
    # a grid of 161 steps misses the corner by up to a step: derivatives of some 30 a step of 0.06
    assert best - 4.0 < found.objective <= best * (1.0 + 1e-9)
    assert found.constraints[text] >= -1e-6 * 161.0
    run = mbody.kinetostatics(found.run.system, turn="motor", instants=37)
    assert_allclose(np.abs(run.effort("motor")).max(), found.objective, rtol=1e-9)


def test_a_multiplier_is_what_one_unit_brings():
    def least(limit):
        return mbody.optimize(
            norton(),
            minimize="peak(motor.effort)",
            by={"coupler.cg.r": (2.0, 12.0), "coupler.cg.angle": (-1.0, np.pi)},
            subject_to=f"peak(A.force) <= {limit} lbf",
            starts=3,
            **TURN,
        )

    step = 1e-3
    here, less, more = least(165.0), least(165.0 - step), least(165.0 + step)
    (active,) = here.active
    # central differences of a step of 1e-3 lbf: curvature counts by 1e-6, searches end to 1e-9
    assert_allclose(active.multiplier, (less.objective - more.objective) / (2.0 * step), rtol=1e-3)
    assert active.unit == "lbf·in/lbf" and active.t is not None


def test_limits_at_all_instants_and_on_the_other_side():
    by = {"coupler.B.x": (10.0, 22.0), "rocker.B.x": (7.0, 16.0), "crank.A.x": (2.0, 6.0)}
    found = mbody.optimize(
        norton(),
        minimize="rms(motor.effort)",
        by=by,
        subject_to=[
            "min(abs(sin(coupler.angle - rocker.angle))) >= 0.7",
            "12 in <= coupler.B.x",
            "max(rocker.angle) >= 150 deg",
        ],
        starts=3,
        **TURN,
    )
    run = found.run
    assert np.abs(np.sin(run["coupler"].angle - run["rocker"].angle)).min() >= 0.7 - 1e-5
    assert run["rocker"].angle.max() >= np.radians(150.0) - 1e-5
    assert run.point("coupler.B").x.min() >= 12.0 - 1e-4
    assert found.objective < found.start_objective


def test_the_description_need_not_turn():
    """A crank longer than its ground allows: other starts do."""
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1, 3, 2), speed=10.0)
    system = mbody.assemble(machine).with_values({"crank.A.x": 1.8})
    with pytest.raises(SolveError):
        mbody.kinetostatics(system, turn="motor")
    found = mbody.optimize(
        system,
        minimize="peak(motor.effort)",
        by={"crank.A.x": (0.5, 2.5), "coupler.B.x": (2.0, 4.0)},
        subject_to="min(abs(sin(coupler.angle - rocker.angle))) >= 0.4",
        starts=3,
        **TURN,
    )
    assert found.start_objective is None
    assert np.isfinite(found.objective) and found.run.status == "completed"


# -- two aims, files, stops ---------------------------------------------------------------------


def test_instants_that_lie_far_apart():
    """Lanes take steps of one length; where those do not lead from one instant to the next, designs
    are judged one by one: several starts, and a band at whose end the aim is 1 % worse.
    """
    engine = mbody.gallery.load("slider_crank")
    how = {"at": {"crank": ["30 deg", "60 deg"]}}
    aim = "peak(motor.effort)"
    found = mbody.optimize(engine, minimize=aim, by={"rod": (1.0, 1.5)}, starts=3, **how)
    assert found.starts == found.agreeing == 3
    low, high = found.band["rod"]
    swept = mbody.sweep(engine, {"rod": [low, high]}, measure=aim, **how)[aim]
    assert high == found.values["rod"] == 1.5
    assert_allclose(swept, [1.01 * found.objective, found.objective], rtol=1e-6)


def test_a_front_of_two_aims():
    found = mbody.optimize(
        norton(),
        minimize=["peak(motor.effort)", "peak(A.force)"],
        by={"coupler.cg.r": (2.0, 12.0), "coupler.cg.angle": (-1.0, np.pi)},
        starts=2,
        points=5,
        **TURN,
    )
    front = np.array([one.objective for one in found.pareto])
    assert 3 <= len(front) <= 5
    assert (np.diff(front[:, 0]) > 0.0).all() and (np.diff(front[:, 1]) < 0.0).all()
    grid = mbody.sweep(
        norton(),
        {"coupler.cg.r": Steps(2.0, 12.0, 81), "coupler.cg.angle": Steps(-1.0, np.pi, 81)},
        measure=["peak(motor.effort)", "peak(A.force)"],
        **TURN,
    )
    effort, force = (grid[name].ravel() for name in grid.names)
    for a, b in front:  # no design of the grid is better in both by more than 1e-6 of its size
        assert not ((effort < a * (1.0 - 1e-6)) & (force < b * (1.0 - 1e-6))).any()
    assert isinstance(found.objective, tuple) and "FRONT" in str(found)


def test_the_optimum_as_a_model_file(tmp_path):
    found = mbody.optimize(
        norton(),
        minimize="peak(motor.effort)",
        by={"coupler.cg.r": ("2 in", "1 ft"), "crank.A.x": (4.0, 5.5)},
        starts=1,
        **TURN,
    )
    found.save(tmp_path / "best.toml")
    again = mbody.kinetostatics(mbody.load(tmp_path / "best.toml"), turn="motor", instants=37)
    least = np.abs(again.effort("motor")).max()
    assert_allclose(least, found.objective, rtol=0.05 * found.loss)
    assert found.objective <= least * (1.0 + 1e-9)
    # a second engine has the same least torque
    result = mbody.crosscheck(found.mechanism)
    assert result.status == "completed"


def test_a_file_has_the_digits_that_matter(tmp_path):
    """Few of them, by the bands, in the units of the file; the limit that binds holds with them."""
    text = "# mine\n" + mbody.gallery.path("norton_fourbar").read_text("utf-8")
    limit = "peak(A.force) <= 165 lbf"
    found = mbody.optimize(
        mbody.from_toml(text),
        minimize="peak(motor.effort)",
        by={"coupler.cg.r": (2.0, 12.0), "coupler.cg.angle": (-1.0, np.pi)},
        subject_to=limit,
        starts=2,
        **TURN,
    )
    assert abs(found.constraints[limit]) < 1e-4 * 165.0  # it binds
    found.save(tmp_path / "best.toml")
    written = (tmp_path / "best.toml").read_text("utf-8")
    assert written.startswith("# mine\n") and "# the open branch" in written
    (line,) = [one for one in written.splitlines() if "cg" in one and one not in text]
    numbers = re.findall(r"[-\d.]+", line)
    assert all(len(one) <= 7 for one in numbers), line
    again = mbody.kinetostatics(mbody.load(tmp_path / "best.toml"), turn="motor", instants=37)
    # margins are those of the search but for the closing of loops, to 1e-12 of the size
    force = np.abs(again.measure(mbody.model.simulation.Measure("A.force"))).max()
    assert 165.0 - force >= min(found.constraints[limit], 0.0) - 165e-12
    least = np.abs(again.effort("motor")).max()
    assert found.objective * (1.0 - 1e-9) <= least <= found.objective * (1.0 + 0.05 * found.loss)


def test_tasks_of_a_file():
    text = (
        mbody.to_toml(norton())
        + """
[optimize.torque]
minimize = "peak(motor.effort)"
by = { "coupler.cg.r" = [2, "12 in"], "coupler.cg.angle" = [-57.29577951308232, "180 deg"] }
subject_to = "peak(A.force) <= 165 lbf"
over = "turn"
instants = 37
starts = 2
"""
    )
    machine = mbody.from_toml(text)
    found = mbody.optimize(machine, "torque")
    other = mbody.optimize(
        norton(),
        minimize="peak(motor.effort)",
        by={"coupler.cg.r": (2.0, 12.0), "coupler.cg.angle": (-1.0, np.pi)},
        subject_to="peak(A.force) <= 165 lbf",
        starts=2,
        **TURN,
    )
    assert_allclose(found.objective, other.objective, rtol=1e-9)
    assert mbody.to_toml(mbody.from_toml(mbody.to_toml(machine))) == mbody.to_toml(machine)
    with pytest.raises(ModelError, match="has no optimization 'least'"):
        mbody.optimize(machine, "least")


def test_ctrl_c_keeps_the_best_so_far():
    def stop(done, of):
        assert of == 5
        if done >= 2:
            raise KeyboardInterrupt

    found = mbody.optimize(
        wheel(),
        minimize="peak(O.force)",
        by={"disc.cg.x": (0.2, 1.0), "disc.cg.y": (-1.0, 1.0)},
        starts=5,
        progress=stop,
        **TURN,
    )
    assert found.status == "stopped: after 2 of 5 searches"
    assert_allclose(found.objective, 40.0, rtol=1e-6)


# -- bad input ----------------------------------------------------------------------------------


def optimized(minimize="peak(motor.effort)", by=None, **more):
    by = {"crank.A.x": (4.0, 6.0)} if by is None else by
    return mbody.optimize(norton(), minimize=minimize, by=by, **{**TURN, "starts": 1, **more})


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ({"by": {"crank.A.x": (6.0, 4.0)}}, "'crank.A.x' goes from 6 to 4 in: give low, then high"),
        ({"by": {"crank.A.x": ("4 lbf", "6 in")}}, "crank.A.x"),
        ({"minimize": "peak(engine.effort)"}, "engine"),
        ({"subject_to": "peak(A.force) <= 2 in"}, "peak"),
        ({"subject_to": "A.force = 2 lbf"}, "cannot be equal to a number"),
    ],
)
def test_bad_input(how, sentence):
    with pytest.raises(ModelError) as error:
        optimized(**how)
    assert sentence in str(error.value)


def test_bounds_without_a_design_that_closes():
    with pytest.raises(SolveError) as error:
        optimized(by={"crank.A.x": (60.0, 80.0)})
    assert "none of 256 designs within the bounds can be analysed" in str(error.value)
    assert "loops do not close" in str(error.value)


def test_limits_that_no_design_meets():
    with pytest.raises(SolveError) as error:
        optimized(subject_to="peak(A.force) <= 1 lbf")
    assert "'peak(A.force) <= 1 lbf' is missed by" in str(error.value)


def test_a_number_that_a_formula_makes():
    machine = mbody.from_toml(
        mbody.to_toml(norton()).replace("[ground]", "[parameters]\nlong = 5\n\n[ground]", 1)
    )
    assert "long" in machine.parameters
    text = mbody.to_toml(machine).replace("A = [5, 0]", 'A = ["long*1 in", 0]')
    if text == mbody.to_toml(machine):
        text = mbody.to_toml(machine).replace("A = [5.0, 0.0]", 'A = ["long*1 in", 0]')
    with pytest.raises(ModelError, match="is made by the formula"):
        mbody.optimize(
            mbody.from_toml(text), minimize="peak(motor.effort)", by={"crank.A.x": (4, 6)}, **TURN
        )


def test_options_of_the_command_are_a_task(capsys):
    """The same search as in Python; a bound without a unit is in that of the model."""
    words = ["--minimize", "peak(motor.effort)", "--by", "coupler.cg.r=2:12 in", "--starts", "2"]
    words += ["--subject-to", "peak(A.force) <= 500 lbf", "--over", "turn", "--seed", "3"]
    assert main(["optimize", "norton_fourbar", *words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["cases"]["task"]
    own = mbody.optimize(
        mbody.gallery.load("norton_fourbar"),
        minimize="peak(motor.effort)",
        by={"coupler.cg.r": (2, "12 in")},
        subject_to="peak(A.force) <= 500 lbf",
        over="turn",
        starts=2,
        seed=3,
    )
    assert found == json.loads(json.dumps(own.data()))


def test_a_design_changes_nothing_else_in_its_file():
    """A number that a formula makes, given one of its own: the parameter gives another one too."""
    text = mbody.to_toml(mbody.gallery.load("norton_fourbar"))
    text = text.replace("[ground]", "[parameters]\na = 5\n\n[ground]", 1)
    text = text.replace("A = [5, 0] }", 'A = ["a", 0] }').replace(
        "B = [10, 0] }", 'B = ["2*a", 0] }'
    )
    described = mbody.assemble(mbody.from_toml(text))
    assert described.values["rocker.B.x"] == 10.0
    how = {"minimize": "peak(A.force)", "over": "turn", "starts": 1}
    own = described.with_values({"crank.A.x": 5.1})
    found = mbody.optimize(own, by={"crank.A.x": (4.8, 5.2)}, **how)
    made = mbody.assemble(mbody.from_toml(mbody.to_toml(found.mechanism))).values
    assert float(made["crank.A.x"]) == pytest.approx(found.values["crank.A.x"], rel=1e-12)
    assert made["rocker.B.x"] == 10.0 and made["a"] == 5.0
    # by the parameter both change, as they do in the analysis
    found = mbody.optimize(described, by={"a": (4.8, 5.2)}, **how)
    made = mbody.assemble(found.mechanism)
    assert float(made.values["rocker.B.x"]) == pytest.approx(2.0 * found.values["a"], rel=1e-12)
    # what the system had of its own goes into the file
    heavy = described.with_values({"rocker.weight": 6.5})
    made = mbody.assemble(mbody.optimize(heavy, by={"a": (4.8, 5.2)}, **how).mechanism)
    assert float(made.values["rocker.weight"]) == pytest.approx(6.5, rel=1e-12)


def test_a_flat_objective_takes_no_more_analyses():
    """The force of a press in its pins changes by parts of a thousand with what is varied: 124
    analyses as long as steps were by its size, not by its change; on a grid none is less.
    """
    press, t = mbody.gallery.load("toggle_press"), np.linspace(0.0, 10.0, 41)
    by = {"pin": ("15 mm", "25 mm"), "upper.mass": (6.0, 20.0)}
    found = mbody.optimize(press, minimize="peak(K.force)", by=by, t=t)
    assert found.evaluations < 60
    grid = {"pin": np.linspace(0.015, 0.025, 5), "upper.mass": np.linspace(6.0, 20.0, 5)}
    least = mbody.sweep(press, grid, measure="peak(K.force)", t=t)["peak(K.force)"].min()
    assert found.objective <= least * (1.0 + 1e-9)


@pytest.mark.parametrize("added", ["", " + 1e6"])
def test_what_is_added_to_an_aim_says_nothing(added):
    """cos u + u/40 of u = F/(10 N) has its least values near π, 3π and 5π, the first the least:
    searches that end at others do not agree with it, whatever is added.
    """
    found = mbody.optimize(
        wheel(),
        minimize=f"max(cos(O.force/(10 N)) + O.force/(400 N){added})",
        by={"disc.cg.x": (0.05, 1.0)},
        starts=6,
        **TURN,
    )
    force = 10.0 * (np.pi - np.arcsin(-1.0 / 40.0) - 2.0 * np.arcsin(1.0 / 40.0))
    assert_allclose(found.values["disc.cg.x"], np.sqrt((force / 200.0) ** 2 - 0.01), rtol=1e-4)
    assert 0 < found.agreeing < found.starts == 6 and not found.active


def test_designs_that_are_as_good():
    """F = 100 N at x = ±√(0.5² − y²), and at any inertia: neither is the only best number."""
    found = mbody.optimize(
        wheel(),
        minimize="max((O.force/(100 N) - 1)^2)",
        by={"disc.cg.x": (-1.0, 1.0), "disc.inertia": (0.5, 2.0)},
        starts=6,
        **TURN,
    )
    assert_allclose(abs(found.values["disc.cg.x"]), np.sqrt(0.24), rtol=1e-4)
    idle, others = found.notes
    assert idle.startswith(
        "'disc.inertia' changes neither the aim nor a limit where searches began"
    )
    assert re.fullmatch(
        r"of 6 searches .* [1-5] ended beyond .*: other designs are as good", others
    )
    assert "6 of 6 searches ended at this value;" in str(found)


def test_wide_bounds_cost_no_figures():
    """A corner of three peaks, far narrower than the bounds, which most designs lie beyond."""
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    ends = [
        mbody.optimize(
            machine,
            minimize="peak(motor.effort)",
            by={"coupler.cg.x": (-3.0 * far, 3.0 * far), "rocker.cg.x": (-far, far)},
            starts=2,
            over="turn",
        )
        for far in (1.0, 1e5)
    ]
    assert_allclose(ends[1].objective, ends[0].objective, rtol=1e-9)
    assert any(note.startswith("only 1 of 2 searches could begin") for note in ends[1].notes)
