"""The command with outputs that are closed, full or read no more, and Ctrl-C at any moment."""

import functools
import json
import os
import random
import signal
import subprocess
import sys
import time

import pytest

import mbody
from mbody import ModelError, SolveError, cli, gallery, makers
from mbody.analysis.driven import time_grid
from tests.interrupts import ENVIRONMENT, trial
from tests.support.cases import first_fast
from tests.support.paths import ROOT

posix = pytest.mark.skipif(os.name != "posix", reason="streams of Unix")
linux = pytest.mark.skipif(sys.platform != "linux", reason="files of Linux")


def shell(words, streams, **options):
    """The command with its streams led elsewhere by a shell."""
    line = f'exec "$0" -X utf8 -m mbody {words} {streams}'
    return subprocess.run(
        ["bash", "-c", line, sys.executable],
        cwd=ROOT,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=120,
        **options,
    )


#: What prints a summary, a table, text with notes beside it, names, help, and an error.
VERBS = [
    "kinetostatics norton_fourbar",
    "kinetostatics hoekens --over turn --csv -",
    "export norton_fourbar --to mjcf",
    "models",
    "--help",
    "check hoekns",
]


@posix
@first_fast("words", VERBS, 1)
def test_a_closed_output(words):
    done = shell(words, ">&-")
    told = [line for line in done.stderr.splitlines() if "compiling" not in line]
    assert done.returncode == (2 if words == "check hoekns" else 1)
    assert len(told) == 1 and told[0].startswith("mbody: "), done.stderr
    assert "Bad file descriptor" in told[0] or "hoekns" in words


@linux
@first_fast("words", VERBS, 1)
def test_a_full_output(words):
    done = shell(words, "> /dev/full")
    told = [line for line in done.stderr.splitlines() if "compiling" not in line]
    assert done.returncode == (2 if words == "check hoekns" else 1)
    assert len(told) == 1 and told[0].startswith("mbody: "), done.stderr
    assert "No space left" in told[0] or "hoekns" in words


@functools.cache
def without_errors(words):
    return shell(words, "2> /dev/null")


@pytest.mark.slow
@posix
@pytest.mark.parametrize("words", ["export norton_fourbar --to mjcf", "check hoekns"])
@pytest.mark.parametrize("streams", ["2>&-", "2> /dev/full"])
def test_nobody_reads_the_errors(words, streams):
    if "full" in streams and sys.platform != "linux":
        pytest.skip("a file of Linux")
    done, plain = shell(words, streams), without_errors(words)
    assert done.returncode == plain.returncode
    # residuals of rounding may come out in another way, and no error takes the place of an answer
    assert len(done.stdout.splitlines()) == len(plain.stdout.splitlines())
    if words == "check hoekns":
        assert done.stdout == ""


@posix
def test_nothing_is_open():
    done = shell("kinetostatics norton_fourbar", "<&- >&- 2>&-")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "")


@posix
@first_fast("words", [VERBS[1], "kinetostatics norton_fourbar --csv /dev/stdout"], 1)
def test_a_reader_that_leaves(words):
    done = shell(words, "| true")
    told = [line for line in done.stderr.splitlines() if "compiling" not in line]
    assert told == [], done.stderr


@posix
def test_files_are_written_though_nothing_can_be_printed(tmp_path):
    table = tmp_path / "run.csv"
    done = shell(f"kinetostatics norton_fourbar --csv {table}", ">&-")
    assert done.returncode == 1 and len(table.read_text().splitlines()) == 2


@posix
def test_a_pipe_that_is_a_file(tmp_path):
    """A table that goes to a pipe by name, of which the reader leaves."""
    done = shell("kinetostatics hoekens --over turn --csv /dev/stderr", "2>&1 >/dev/null | true")
    assert done.stderr == ""


# -- Ctrl-C -----------------------------------------------------------------------------------


@pytest.mark.slow
@posix
def test_ctrl_c_at_any_moment():
    """A share of `python -m tests.interrupts`."""
    for n in range(6):
        told = trial(random.Random(n))
        assert told.right, told


def stopped(words, seconds):
    """What a command did that Ctrl-C stopped after so many seconds: status, output, errors."""
    with subprocess.Popen(
        [sys.executable, "-X", "utf8", "-m", "mbody", *words],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # what runs in the background of a shell ignores Ctrl-C, and so would what it starts
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    return process.returncode, out, err


@pytest.mark.slow
@posix
def test_ctrl_c_keeps_a_motion(tmp_path):
    """Stopped at its next mark, shown and saved, with the status of what was stopped."""
    kept = tmp_path / "run.npz"
    words = ["simulate", "double_pendulum", "--to", "100000", "--rtol", "1e-12"]
    for seconds in (2.5, 10.0):  # a slow machine has not begun to move it sooner
        status, out, err = stopped([*words, "--save", str(kept)], seconds)
        if status != 130:
            break
    else:
        pytest.skip("this machine had not begun to move it")
    assert status == 1, err
    assert "by the user" in out and "Traceback" not in err
    assert mbody.load_run(kept).status.endswith("by the user")


# -- sizes ------------------------------------------------------------------------------------


def test_names_are_there_without_kernels():
    """Nothing is compiled, nor is the compiler loaded, to list the models."""
    code = (
        "import sys; from mbody.cli import main; main(['models']);"
        "print('numba' in sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stderr.split() == ["False"]


def test_the_heads_of_models_are_those_that_are_loaded(capsys):
    assert cli.main(["models", "--json"]) == 0
    for head in json.loads(capsys.readouterr().out)["models"]:
        machine = gallery.load(head["model"])
        assert (head["title"], head["source"], head["note"]) == (
            machine.name,
            machine.source,
            machine.note,
        )


@pytest.mark.parametrize("count", [10**9, 10**12, 10**15])
def test_very_many_instants_are_told_with_their_size(count, monkeypatch):
    machine = makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    monkeypatch.setattr(time_grid, "memory", lambda: 64e9)
    with pytest.raises(ModelError, match=rf"{count} instants of '.*' take [0-9.e+]+ GB, this"):
        mbody.kinematics(machine, turn=True, instants=count)


def test_instants_of_a_motion_are_weighed_too(monkeypatch):
    machine = gallery.load("simple_pendulum")
    monkeypatch.setattr(time_grid, "memory", lambda: 1e8)
    with pytest.raises(ModelError, match=r"1000000 instants of .* take 0\.\d+ GB, this machine"):
        mbody.simulate(machine, 1.0, instants=1_000_000)


def test_the_size_is_that_of_the_arrays():
    """What is weighed is what is kept, and not much more."""
    machine = makers.four_bar(1, 3, 2, 3.5, speed=10.0)
    run = mbody.kinematics(machine, turn=True, instants=100_000)
    kept = run.record.table(slice(None)).nbytes + run.t.nbytes
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(time_grid, "memory", lambda: float(kept))
        with pytest.raises(ModelError):
            mbody.kinematics(machine, turn=True, instants=100_000)
        patch.setattr(time_grid, "memory", lambda: 2.0 * kept)
        mbody.kinematics(machine, turn=True, instants=100_000)


def test_a_lack_of_memory_is_a_line(monkeypatch, capsys):
    def greedy(asked):
        raise MemoryError

    monkeypatch.setattr("mbody.cli.learn.demo", greedy)
    assert cli.main(["demo"]) == 1
    assert (
        capsys.readouterr().err
        == "mbody: there is not enough memory for this: request less at once\n"
    )


def test_an_error_of_the_system_is_a_line(monkeypatch, capsys):
    def full(asked):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mbody.cli.learn.demo", full)
    assert cli.main(["demo"]) == 1
    assert "cannot write the output (No space left on device)" in capsys.readouterr().err


@pytest.mark.parametrize(("error", "status"), [(ModelError, 2), (SolveError, 1)])
def test_errors_without_a_place_to_tell_them(error, status, monkeypatch, capsys):
    def fails(asked):
        raise error("loops do not close")

    monkeypatch.setattr("mbody.cli.learn.demo", fails)
    monkeypatch.setattr(sys, "stderr", None)
    assert cli.main(["demo"]) == status
    assert capsys.readouterr().out == ""
