"""The command: what it prints, its exit statuses, and that a second run compiles nothing."""

import subprocess
import sys
from pathlib import Path

import pytest

import mbody
from mbody import cli
from mbody.errors import ModelError, SolveError
from mbody.gallery.norton_fourbar import PRINTED

ROOT = Path(__file__).parents[1]


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-X", "utf8", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8")


def test_demo_prints_the_book_and_ours(capsys):
    assert cli.main(["demo"]) == 0
    text = capsys.readouterr().out
    book, _, sheet = text.partition("THE BOOK")[2].partition("With the exact masses")
    assert sheet.splitlines()[-1].startswith("RESIDUALS   constraint")
    assert "F12      -117.560   -107.459   159.272 @ 222.430°" in sheet
    assert "243.238" in sheet
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


def test_a_second_process_compiles_nothing():
    """The demo and, after a warm-up, a sweep on lanes load their kernels from the disk."""
    code = (
        "import sys; from mbody.cli import main; status = main(['demo']);"
        "import mbody; from mbody.gallery.norton_fourbar import build;"
        "mbody.kinetostatics(build(), turn=True, instants=400).breakdown('A');"
        "from mbody._jit import compilations; print(status, compilations(), file=sys.stderr)"
    )
    assert python("-m", "mbody", "warmup").returncode == 0
    second = python("-c", code)
    assert second.stderr.split() == ["0", "0"], second.stderr


def test_warmup_tells_what_it_does(capsys):
    assert cli.main(["warmup"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("kinematics ... ")
    assert lines[-1].startswith("ready: ")


def test_version_and_help(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out.strip() == f"mbody {mbody.__version__}"
    assert cli.main([]) == 0
    assert "demo" in capsys.readouterr().out
    with pytest.raises(SystemExit) as stop:
        cli.main(["dema"])
    assert stop.value.code == 2


def test_help_loads_no_kernels():
    code = "import sys; from mbody.cli import main; main([]); print('numba' in sys.modules)"
    assert python("-c", code).stdout.split()[-1] == "False"


@pytest.mark.parametrize(("error", "status"), [(ModelError, 2), (SolveError, 1)])
def test_errors_are_one_sentence_and_a_status(error, status, monkeypatch, capsys):
    def fails() -> None:
        raise error("loops do not close")

    monkeypatch.setattr(cli, "_demo", fails)
    assert cli.main(["demo"]) == status
    captured = capsys.readouterr()
    assert captured.err == "mbody: loops do not close\n"
    assert captured.out == ""


def test_a_reader_that_leaves_gets_no_traceback():
    code = (
        "import os, sys, mbody.cli as cli\n"
        "read, write = os.pipe(); os.close(read); os.dup2(write, 1)\n"
        "cli._demo = lambda: print('x' * 100000)\n"
        "sys.exit(cli.main(['demo']))"
    )
    done = python("-c", code)
    assert (done.returncode, done.stderr) == (1, "")


def test_the_module_is_the_command():
    done = python("-m", "mbody", "--version")
    assert (done.returncode, done.stdout.strip()) == (0, f"mbody {mbody.__version__}")
