"""Synthesis of mechanisms of any topology: known ones are found again, their files run."""

import warnings

import numpy as np
import pytest

import mbody
from mbody.analysis.driven.driven import analyse_system_at
from mbody.cli import main
from mbody.synthesis.models import Refinement, model_demand, model_subject

#: Numbers of Stephenson's six-bar of the gallery that are sought, with what they are there.
SOUGHT = {"crank.A.x": 40.0, "rocker.B.x": 90.0, "radius": 202.0}


def with_point():
    """A four-bar with a point on its coupler, far from the one that made the path."""
    text = mbody.to_toml(mbody.makers.four_bar(0.8, 3.0, 2.2, 3.2, speed=2.0))
    old = "{ A = [0, 0], B = [3, 0] }"
    assert old in text
    return mbody.from_toml(text.replace(old, "{ A = [0, 0], B = [3, 0], P = [0.2, 0.1] }"))


TRUE = {
    "crank.A.x": 1.0,
    "coupler.B.x": 3.0,
    "rocker.B.x": 2.5,
    "coupler.P.x": 1.5,
    "coupler.P.y": 1.0,
}
BY = {
    "crank.A.x": (0.6, "150 cm"),
    "coupler.B.x": (2.5, 4.0),
    "rocker.B.x": (2.0, 3.5),
    "coupler.P.x": (-3.0, 3.0),
    "coupler.P.y": (-3.0, 3.0),
}


def path_of_the_true_one(count=9):
    system = mbody.assemble(with_point()).with_values(TRUE)
    theta = 0.3 + np.arange(count) * 0.6
    run = mbody.kinematics(system, drive={"motor": theta})
    return list(zip(run.measure("coupler.P.x"), run.measure("coupler.P.y"), strict=True)), theta


@pytest.mark.parametrize("timed", [True, False])
def test_a_known_path_is_found_again(timed):
    path, theta = path_of_the_true_one()
    found = mbody.synthesize(
        with_point(),
        path=path,
        of="coupler.P",
        timing=theta if timed else None,
        by=BY,
        search=150,
        starts=4,
        count=1,
    )[0]
    assert found.error < 1e-18
    assert found.values == pytest.approx(TRUE, abs=1e-6)
    assert found.order and found.defects == ()
    machine = mbody.from_toml(mbody.to_toml(found.mechanism))
    run = analyse_system_at(mbody.assemble(machine), "kinematics", machine.ask)
    places = np.column_stack([run.measure("coupler.P.x"), run.measure("coupler.P.y")])
    assert places == pytest.approx(np.array(path), abs=1e-8)


def test_a_six_bar_generates_its_function_again():
    """The dwell of Stephenson's six-bar: the output at nine angles of the crank, of which a
    parameter and two lengths are sought.
    """
    machine = mbody.gallery.load("stephenson_sixbar")
    theta = np.linspace(-2.0, 3.5, 9)
    run = mbody.kinematics(machine, drive={"motor": theta})
    pairs = list(zip(theta, run["output"].angle, strict=True))
    other = mbody.load(mbody.gallery.path("stephenson_sixbar"), parameters={"radius": "196 mm"})
    found = mbody.synthesize(
        other,
        function=pairs,
        of="output.angle",
        by={name: (0.97 * value, 1.02 * value) for name, value in SOUGHT.items()},
        search=60,
        starts=3,
        count=1,
    )[0]
    assert found.error < 1e-18
    assert found.values == pytest.approx(SOUGHT, rel=1e-6)
    again = mbody.kinematics(found.mechanism, drive={"motor": theta})
    assert again["output"].angle == pytest.approx(run["output"].angle, abs=1e-9)


def test_conditions_on_forces_hold_over_the_turn():
    path, theta = path_of_the_true_one()
    machine = with_point()
    machine.add(mbody.Torque("brake", "rocker", value="5 N*m"))
    demand = {"path": path, "of": "coupler.P", "timing": theta, "by": BY}
    few = {"search": 60, "starts": 3, "count": 1, "full_turn": True}
    free = mbody.synthesize(machine, **demand, **few, subject_to="peak(motor.effort) <= 1 kN*m")
    turn = mbody.kinetostatics(free[0].mechanism, turn="motor")
    greatest = np.abs(turn.effort("motor")).max()
    (margin,) = free[0].margins.values()
    assert margin == pytest.approx(1000.0 - greatest, abs=1e-3 * greatest)
    # half of it costs misses, and holds in the mechanism by itself
    limit = 0.5 * greatest
    half = mbody.synthesize(
        machine, **demand, **few, subject_to=f"peak(motor.effort) <= {limit} N*m"
    )
    turn = mbody.kinetostatics(half[0].mechanism, turn="motor")
    # conditions are of 181 instants, here are 361
    assert np.abs(turn.effort("motor")).max() == pytest.approx(limit, rel=1e-3)
    assert half[0].error > 1e3 * free[0].error
    with pytest.raises(mbody.SolveError, match=r"peak\(motor.effort\)"):
        mbody.synthesize(machine, **demand, **few, subject_to="peak(motor.effort) <= 1 mN*m")


def test_exact_derivatives_of_the_refinement():
    """Misses by numbers and by the driver, against central differences of fourth order."""
    path, theta = path_of_the_true_one(5)
    subject = model_subject(with_point(), "coupler.P", True)
    goals = np.array(path).T
    for timing, free in ((theta, 1), (None, 5)):
        demand = model_demand(subject, BY, None, goals, timing, False)
        task = Refinement(demand, {})
        y = np.array([0.9, 3.1, 2.4, 0.5, 0.4, *(theta[:free] + 0.1)])
        exact = task.jacobian(y)
        for n in range(len(y)):
            step = np.zeros(len(y))
            step[n] = 1e-3
            near, far = (task.residual(y + k * step) - task.residual(y - k * step) for k in (1, 2))
            difference = (8.0 * near - far) / 12e-3
            assert difference == pytest.approx(exact[:, n], abs=1e-8)


def test_a_model_in_the_command(tmp_path, capsys):
    path, theta = path_of_the_true_one()
    table = tmp_path / "path.csv"
    rows = [f"{x!r}, {y!r}, {float(a)!r} rad" for (x, y), a in zip(path, theta, strict=True)]
    table.write_text("\n".join(["x, y, timing", *rows]).replace("np.float64(", "").replace(")", ""))
    mbody.save(with_point(), tmp_path / "start.toml")
    words = ["synthesize", str(table), "--model", str(tmp_path / "start.toml")]
    words += ["--point", "coupler.P", "-o", str(tmp_path / "design.toml"), "--search", "60"]
    for name, (low, high) in BY.items():
        words += ["--by", f"{name}={low}:{high}"]
    assert main([*words, "--count", "1"]) == 0
    assert "designs tried" in capsys.readouterr().out
    found = mbody.assemble(mbody.load(tmp_path / "design.toml")).values
    assert {name: found[name] for name in TRUE} == pytest.approx(TRUE, abs=1e-6)


def test_designs_that_are_tried_bring_no_warnings_and_are_distinct():
    """Five points in a flat valley: searches that end in different places of it are one design."""
    machine = mbody.makers.four_bar(2.0, 4.0, 3.5, 4.0, start="30 deg")
    points = [(3, 3), (2.759, 3.363), (2.372, 3.663), (1.890, 3.862), (1.355, 3.943)]
    by = {"crank.A.x": (0.1, 5), "coupler.B.x": (0.1, 10), "rocker.B.x": (0.1, 10)}
    by |= {"ground.O4.x": (0.5, 10)}
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = mbody.synthesize(
            machine,
            path=points,
            timing=np.radians([30, 45, 60, 75, 90]),
            of="coupler.B",
            by=by,
            count=2,
            search=200,
            starts=6,
        )
    assert not told
    rows = [np.array([one.values[name] for name in by]) for one in found]
    for k, row in enumerate(rows):
        assert all(np.abs(row - other).max() > 1e-4 for other in rows[:k])
