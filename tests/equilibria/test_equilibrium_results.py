"""Rest positions as results: tables, data, the command, questions of a driver."""

import json
import math

import pytest

from mbody import (
    AngleDriver,
    SolveError,
    assemble,
    equilibrium,
    from_toml,
    gallery,
    statics,
    to_toml,
)
from mbody.cli import main
from mbody.engineering import equilibrium_curve
from mbody.model.simulation import Question
from tests.support.rest_examples import four_bar, pendulum, whirling

pytestmark = pytest.mark.processor
g = 9.81


def test_the_tables_fit_and_tell():
    found = equilibrium(gallery.load("flyball_governor"), free="theta")
    curve = equilibrium_curve(
        gallery.load("flyball_governor"), "omega", (230.0, 0.0), free=["theta"]
    )
    for text in (str(found), str(curve)):
        assert max(map(len, text.splitlines())) <= 100
        assert all(line == line.rstrip() for line in text.splitlines())
    assert "6 rest positions" in str(found) and "stiffness" in str(found)
    assert "begin" in str(curve) and "rad/s" in str(curve)


def test_data_are_json():
    found = equilibrium(pendulum())
    told = json.loads(json.dumps(found.data(), allow_nan=False))
    assert [one["stability"] for one in told["positions"]] == ["stable", "unstable"]
    assert told["positions"][0]["statics"]["bodies"]["rod"]["angle"][0] == pytest.approx(-90.0)
    curve = equilibrium_curve(whirling(1.0), "field.speed", (0.0, 10.0))
    assert json.loads(json.dumps(curve.data(), allow_nan=False))["crossings"] == list(
        curve.crossings
    )


def test_the_command(capsys):
    assert main(["equilibrium", "porter_governor", "--free", "theta", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    lean = max(abs(p["statics"]["bodies"]["arm_r"]["angle"][0]) for p in told["positions"][:1])
    # (1 + M/m) g = l ω² cos θ at 120 rpm
    cosine = 4.0 * g / (0.3 * (4.0 * math.pi) ** 2)
    assert lean == pytest.approx(math.degrees(math.acos(cosine)), rel=1e-9)
    assert (
        main(["equilibrium", "porter_governor", "--free", "theta", "--set", "omega=5 rad/s"]) == 0
    )
    assert "lifts above 11.4368 rad/s" in capsys.readouterr().out
    assert main(["equilibrium", "porter_governor"]) == 1
    assert "nothing is free" in capsys.readouterr().err
    assert main(["equilibrium", "porter_governor", "--free", "motor"]) == 2
    assert main(["equilibrium", "porter_governor", "--free", "theta", "--t", "3 m"]) == 2


def test_without_leaves_the_description_alone():
    machine = gallery.load("porter_governor")
    freed = machine.without("theta")
    assert len(machine.drivers) == 1 and not freed.drivers
    assert "theta.law.value" in machine.formulas or "theta.law" in machine.formulas
    assert not any(name.startswith("theta.") for name in freed.formulas)
    assert not freed.questions and gallery.load("porter_governor").questions
    system = assemble(machine)
    assert not system.mechanism.without("theta").drivers
    with pytest.raises(SolveError, match="needs 0 free degrees of freedom"):
        statics(freed)


def test_questions_of_a_driver_go_with_it():
    """What is left can be written and read; a question that does not speak of the driver stays."""
    for name in gallery.names():
        machine = gallery.load(name)
        for driver in machine.drivers:
            freed = machine.without(driver.name)
            assert from_toml(to_toml(freed)) == freed, name
    machine = four_bar(AngleDriver("motor", "crank", 0.5), AngleDriver("second", "rocker", 1.0))
    for key, condition, at in (
        ("motor", "motor.effort = 0", {}),
        ("load", "load.effort = 0", {"motor": 0.3}),
        ("body", "A.fx = 0", {"crank": 0.3}),
        ("other", "A.fx = B.fx", {"second": 0.3}),
    ):
        machine.questions[key] = Question("gravity.y", condition, at=at)
    assert list(machine.without("motor").questions) == ["other"]
