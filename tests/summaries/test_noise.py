"""Summaries show no rounding as if it were a result, and tables have the requested angles."""

import csv
import io
import math

import numpy as np
import pytest

import mbody
from mbody import cli, gallery, makers
from mbody.analysis.driven.driven import analyse_at
from mbody.model.simulation import Measure


def line(run, first):
    return next(one for one in str(run).splitlines() if one.startswith(first)).split()


def test_a_mean_that_vanishes_is_zero():
    """The torque of cranks that carry no work is symmetric: its mean is 0, to rounding 7e-14."""
    machine = gallery.load("parallel_cranks")
    run = analyse_at(machine, "kinetostatics")
    cells = line(run, "T12")
    assert float(cells[4]) == 0.0 and float(cells[3]) > 1.0
    assert 0.0 < abs(run.effort("motor").mean()) < 1e-9


def test_efforts_that_are_rounding_are_zero():
    run = mbody.kinetostatics(gallery.load("rotating_mass"), turn=True)
    assert np.abs(run.effort("motor")).max() > 0.0  # 1e-14 beside forces of hundreds
    assert {float(cell) for cell in line(run, "T12")[2:7]} == {0.0}


@pytest.mark.parametrize(
    ("of", "unit"),
    [
        ("A.fx - A.fx*(1 + 1e-13)", "kN"),
        ("coupler.x - coupler.x*(1 + 1e-13)", "mm"),
        ("motor.power - motor.power*(1 + 1e-13)", "kW"),
        ("rocker.alpha - rocker.alpha*(1 + 1e-13)", ""),
        ("rocker.angle - rocker.angle*(1 + 1e-13)", ""),
    ],
)
def test_measures_that_are_rounding_are_zero(of, unit):
    """In any unit, at one instant too, where nothing but the mechanism itself is beside it."""
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    machine.measures["noise"] = Measure(of, unit)
    for options in ({}, {"turn": True}):
        run = mbody.kinetostatics(machine, **options)
        assert np.abs(run.measure("noise")).max() > 0.0
        assert float(line(run, "noise")[1]) == 0.0


def test_a_small_measure_is_no_rounding():
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    machine.measures["small"] = Measure("A.fx*1e-6")
    run = mbody.kinetostatics(machine)
    assert float(line(run, "small")[1]) == pytest.approx(float(run.measure("small")[0]), rel=1e-5)


def test_tables_have_the_angles_that_are_asked_for(capsys, tmp_path):
    def table(*words):
        assert cli.main(["kinetostatics", "norton_fourbar", "--csv", "-", *words]) == 0
        head, row = csv.reader(io.StringIO(capsys.readouterr().out))
        return dict(zip(head, map(float, row), strict=True))

    plain, rad, deg = table(), table("--angle", "rad"), table("--angle", "deg")
    assert plain == rad
    assert deg["crank.angle [deg]"] == pytest.approx(60.0, abs=1e-9)
    assert rad["crank.angle [rad]"] == pytest.approx(math.pi / 3, abs=1e-12)
    assert deg["crank.omega [rad/s]"] == rad["crank.omega [rad/s]"]
    assert len(deg) == len(rad) and not any("[rad]" in name for name in deg)
    path = tmp_path / "run.csv"
    words = ["kinetostatics", "norton_fourbar", "--angle", "deg", "--csv", str(path)]
    assert cli.main(words) == 0
    assert "crank.angle [deg]" in path.read_text("utf-8").partition("\n")[0]
