"""Sentences speak the user's language: radians in Python, options and degrees outside."""

import pytest

import mbody
import mbody.engineering
from mbody import AngleDriver, Body, ModelError, Revolute, cli, gallery, makers
from mbody.files.model import from_toml
from tests.support.model_text import model_from, text_from

ARM = """
[bodies.a]
mass = 1
inertia = 1
[joints]
O = { revolute = ["ground", "a"] }
"""
TABLE = """
[drivers]
m = { angle = "a", law = { table = { x = [0, 1, 2], y = [0, 30, 90] } } }
"""


def at_the_command(text, words, tmp_path, capsys):
    path = tmp_path / "model.toml"
    path.write_text(text)
    status = cli.main([part if part != "MODEL" else str(path) for part in words.split()])
    return status, capsys.readouterr().err


CASES = [
    ("simulate MODEL", "give --to TIME", lambda m: mbody.simulate(m), "give until"),
    (
        "kinematics MODEL --at a=100",
        "no further than 90 deg, at t = 2; it does not reach 100 deg",
        lambda m: mbody.kinematics(m, turn=True),
        "no further than 1.5708 rad, at t = 2; it does not reach 6.28319 rad",
    ),
    (
        "simulate MODEL --to 1 --step 0.1",
        "leave out --step",
        lambda m: mbody.simulate(m, 1.0, step=0.1),
        "leave out step",
    ),
    (
        "simulate MODEL --to 1 --method rattle",
        "give --step H",
        lambda m: mbody.simulate(m, 1.0, method="rattle"),
        "give step",
    ),
    ("equilibrium MODEL", "--free m", lambda m: mbody.equilibrium(m), "free=['m']"),
]


@pytest.mark.parametrize(("words", "told", "verb", "in_python"), CASES)
def test_remedies_work_where_the_user_stands(words, told, verb, in_python, tmp_path, capsys):
    status, err = at_the_command(ARM + TABLE, words, tmp_path, capsys)
    assert status in (1, 2) and told in err, err
    with pytest.raises((ModelError, mbody.SolveError)) as caught:
        verb(from_toml(ARM + TABLE))
    assert in_python in str(caught.value) and "--" not in str(caught.value)


# -- [simulate] every -------------------------------------------------------------------------

EVERY = ARM + "[simulate]\nuntil = 1\nevery = 0.25\nstart = { a = { angle = 0, omega = 1 } }\n"


def test_every_stands_in_files():
    machine = from_toml(EVERY)
    assert mbody.simulate(machine).t.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert len(mbody.simulate(machine, instants=3)) == 3
    for as_json in (False, True):
        assert model_from(text_from(machine, as_json), as_json) == machine


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("every = '3 kg'", "time"),
        ("every = 'x'", "every"),
        ("every = 0.1\ninstants = 5", "give instants or every, not both"),
    ],
)
def test_every_is_looked_at(line, words):
    with pytest.raises(ModelError, match=words):
        from_toml(f"{ARM}[simulate]\nuntil = 1\n{line}\n")


# -- arguments --------------------------------------------------------------------------------


def test_progress_may_be_shown(capsys, monkeypatch):
    monkeypatch.setattr("mbody.analysis.dynamics.interruptions.PATIENCE", -1.0)
    monkeypatch.setattr("mbody.analysis.dynamics.interruptions.BETWEEN", -1.0)
    machine = gallery.load("double_pendulum")
    plain = mbody.simulate(machine, 30.0, progress=False)
    assert capsys.readouterr().err == ""
    run = mbody.simulate(machine, 30.0, progress=True)
    assert "t = " in capsys.readouterr().err
    assert (run.t == plain.t).all()


def test_the_fluctuation_of_a_result():
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    run = mbody.kinetostatics(machine, turn=True)
    found = mbody.engineering.energy_fluctuation(run).fluctuation
    assert found == mbody.engineering.fluctuation(run).fluctuation
    with pytest.raises(ModelError, match="takes angles and torques, or a result"):
        mbody.engineering.energy_fluctuation([0.0, 1.0])


def test_an_arm_is_turned():
    """The mechanism of these tests is one."""
    machine = from_toml(ARM)
    machine.add(AngleDriver("m", "a", 0.5))
    assert isinstance(machine["a"], Body) and isinstance(machine["O"], Revolute)
    assert mbody.kinematics(machine)["a"].angle[0] == pytest.approx(0.5)
