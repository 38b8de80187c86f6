"""Programs of users pass type checkers, and what is wrong in them is found."""

import importlib.util
import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT

PROGRAMS = Path(__file__).parent / "user_programs"
WRONG = PROGRAMS / "wrong.py"


def mypy(program: Path) -> set[int]:
    """Lines of a program on which `mypy --strict` finds an error."""
    options = ["--strict", "--follow-imports=silent", "--config-file=", "--no-error-summary"]
    cache = f"--cache-dir={ROOT / '.mypy_cache' / 'users'}"
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, cache, str(program)],
        cwd=PROGRAMS,
        env={**os.environ, "MYPYPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert not done.stderr
    found = re.findall(r"^.*?:(\d+): error: (.*)$", done.stdout, re.MULTILINE)
    assert bool(found) == (done.returncode == 1), done.stdout
    return report(found)


def pyright(programs: tuple[Path, ...], folder: Path) -> dict[str, set[int]]:
    """Lines of programs on which pyright finds an error in its standard mode, by file name."""
    settings = {
        "typeCheckingMode": "standard",
        "extraPaths": [str(ROOT)],
        "include": [str(program) for program in programs],
        "reportUnusedExpression": False,
    }
    (folder / "pyrightconfig.json").write_text(json.dumps(settings))
    command = [sys.executable, "-m", "basedpyright", "--outputjson", "-p", str(folder)]
    done = subprocess.run(
        [*command, "--pythonpath", sys.executable], capture_output=True, text=True
    )
    told = json.loads(done.stdout)
    assert told["summary"]["filesAnalyzed"] == len(programs)
    errors = [one for one in told["generalDiagnostics"] if one["severity"] == "error"]
    found: dict[str, set[int]] = {}
    for program in programs:
        own = [one for one in errors if Path(one["file"]).name == program.name]
        lines = [(one["range"]["start"]["line"] + 1, one["message"]) for one in own]
        found[program.name] = report(lines)
    return found


def report(errors: list[tuple[str, str]] | list[tuple[int, str]]) -> set[int]:
    """The lines of errors, which are printed for a test that fails."""
    print(*errors, sep="\n")
    return {int(line) for line, _ in errors}


def marked() -> set[int]:
    lines = WRONG.read_text(encoding="utf-8").splitlines()
    return {n for n, line in enumerate(lines, 1) if line.endswith("# wrong")}


@pytest.mark.slow
def test_mypy():
    assert mypy(PROGRAMS / "annotated.py") == set()
    assert mypy(WRONG) == marked()


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("basedpyright") is None, reason="basedpyright is not installed"
)
def test_pyright(tmp_path):
    right = PROGRAMS / "annotated.py"
    found = pyright((right, WRONG), tmp_path)
    assert found == {right.name: set(), WRONG.name: marked()}


def test_the_program_runs():
    runpy.run_path(str(PROGRAMS / "annotated.py"), run_name="__main__")
