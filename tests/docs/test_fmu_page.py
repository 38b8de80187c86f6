"""docs/fmu.md: its commands are understood, its Python runs; FMPy's part in FMPy's environment."""

import re
import shlex
import subprocess

import numpy as np

import mbody
from mbody import gallery
from mbody.cli.command import parsed
from mbody.image.fmu import to_fmu
from mbody.image.model_image import si_unit
from tests.image.test_fmu import FMPY, LINUX, binary, needs_fmpy
from tests.support.paths import ROOT

PAGE = (ROOT / "docs" / "fmu.md").read_text("utf-8")
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE, re.DOTALL)

__all__ = ["binary"]


def test_the_commands_are_understood():
    assert [kind for kind, _ in BLOCKS] == ["sh", "python", "python"]
    lines = [shlex.split(line, comments=True) for line in BLOCKS[0][1].splitlines()]
    found = [parsed(words[1:]) for words in lines]
    assert [(one.command, one.to, one.fmi) for one in found] == [
        ("export", "fmu", None),
        ("export", "fmu", "2.0"),
    ]


def test_the_first_look_runs(capsys):
    exec(BLOCKS[1][1], {})
    assert capsys.readouterr().out.startswith("['r', 'l', 'rod']")


@needs_fmpy
def test_fmpy_runs_the_unit_as_the_page_says(binary, tmp_path):
    made = to_fmu(gallery.load("mud_pump"), "3.0", binaries={LINUX: binary})
    (tmp_path / "pump.fmu").write_bytes(made.content)
    (tmp_path / "page.py").write_text(BLOCKS[2][1])
    done = subprocess.run([FMPY, "-I", "page.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    system = mbody.assemble(gallery.load("mud_pump")).with_values({"speed": 6.0})
    run = mbody.simulate(system, 1.0, instants=101, rtol=1e-10)
    wanted = run.effort("motor").max() * si_unit("lbf*in").factor
    assert abs(float(done.stdout) - wanted) < 1e-8 * np.abs(wanted)
