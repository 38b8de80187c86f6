"""A share of the fuzzing for every run of the tests; `python -m tests.fuzz` is the whole."""

import subprocess
import sys

import pytest

from tests.fuzz import KEPT, KINDS, mutate, plain, properties
from tests.support.paths import ROOT


def test_plain_mutations(tmp_path):
    report = plain.Report(tmp_path)
    plain.fuzz(600, 0, report, list(KINDS))
    assert report.inputs.total() == 600 and report.inputs.keys() == KINDS.keys()
    assert all(0 < report.right[kind] < report.inputs[kind] for kind in KINDS), report
    assert not report.failures, report


@pytest.mark.slow
def test_what_is_kept_in_files(tmp_path):
    """A share of `python -m tests.fuzz --kept`."""
    pytest.importorskip("pyarrow")
    from tests.fuzz import kept

    report = plain.Report(tmp_path)
    kept.fuzz(120, 0, report, list(KEPT))
    assert not report.failures, report
    assert all(10 < report.inputs[kind] > report.right[kind] for kind in KEPT), report
    # what somebody sealed anew may be whole, and most folders mend themselves
    assert report.right["resealed"] and report.right["folder"] > report.inputs["folder"] // 3
    # two parts that are the same may change places
    assert report.right["saved"] < report.inputs["saved"] // 10, report


def test_an_input_that_breaks_a_property_is_told_and_saved(tmp_path, monkeypatch, capsys):
    def broken(text: str) -> bool:
        raise KeyError(text)

    monkeypatch.setattr(properties, "formula", broken)
    report = plain.Report(tmp_path)
    report.take("formula", "\ud800+1", False)
    assert report.failures.total() == report.inputs.total() == 1
    (saved,) = tmp_path.iterdir()
    assert saved.read_bytes().decode("utf-8", "surrogatepass") == "\ud800+1"
    assert "FAILED formula: KeyError" in capsys.readouterr().out
    assert "FAILED 1 times" in str(report)


def test_the_same_seed_gives_the_same_inputs():
    def inputs():
        return [plain.made(kind, mutate.Random(f"1:{n}")) for kind in KINDS for n in range(20)]

    assert inputs() == inputs()


@pytest.mark.slow
def test_the_command_counts(tmp_path):
    command = [sys.executable, "-m", "tests.fuzz", "--plain", "--runs", "50", "--save", tmp_path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("50 inputs in") and "no failure" in done.stdout
