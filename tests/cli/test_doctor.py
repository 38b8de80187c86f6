"""`mbody doctor`: what is installed, and that the kernels compute a number that is known."""

import json

import pytest

from mbody import cli
from mbody.cli import compile

pytestmark = pytest.mark.processor


def test_doctor_runs_a_kernel(capsys):
    assert cli.main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    check = found["kernel_check"]
    assert found["ready"] and check["agrees"] and check["error"] is None
    assert check["value"] == pytest.approx(check["expected"], rel=1e-12)
    assert cli.main(["doctor"]) == 0
    assert "agrees with 243.237590761 lbf·in" in capsys.readouterr().out


def test_kernels_that_do_not_run_are_not_ready(capsys, monkeypatch):
    def broken(*_):
        raise AttributeError("'EntryLibrary' object has no attribute '_reload_init'")

    monkeypatch.setattr("mbody.analysis.driven.driven.kinetostatics", broken)
    assert cli.main(["doctor", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert not found["ready"] and "_reload_init" in found["kernel_check"]["error"]
    assert cli.main(["doctor"]) == 1
    assert "NOT READY: the kernels do not run" in capsys.readouterr().out


def test_a_wrong_number_is_not_ready(capsys, monkeypatch):
    monkeypatch.setattr(compile, "TORQUE", compile.TORQUE * (1.0 + 1e-9))
    assert cli.main(["doctor"]) == 1
    assert "NOT READY: the kernels compute wrongly" in capsys.readouterr().out
