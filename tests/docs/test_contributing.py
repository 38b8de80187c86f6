"""CONTRIBUTING names what is there; the joint, the load and the law of docs/extending.md work."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT

CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
TEXT = (ROOT / "docs" / "extending.md").read_text("utf-8")
BLOCK = r"`(mbody/[\w/]+\.py)`:\n\n```python\n(.*?)```"
FILES = dict(re.findall(r"\*\*The file\*\*, " + BLOCK, TEXT, re.DOTALL))
LINES = dict(re.findall(r"\*\*The line\*\*, at the end of " + BLOCK, TEXT, re.DOTALL))
CONTRACTS = re.findall(r"```python\n((?:ParabolicGuide|LeafSpring)\([^`]*)```", TEXT)

MODEL = """
name = "bead on a parabola"

[ground.points]
O = [0.0, 0.0]

[bodies.bead]
mass = "1 kg"
points = { P = [0.0, 0.0] }
guess = [0.4, 0.1, 0.0]

[joints]
guide = { parabolic_guide = ["ground.O", "bead.P"], focal_length = "0.5 m" }

[drivers]
push = { coordinate = ["ground.O", "bead.P"], law = { throw = { height = "0.6 m", at = "3 s" } } }
turn = { angle = "bead", law = 0 }

[loads]
gravity = { gravity = [0, "-9.81 m/s^2"] }
leaf = { leaf_spring = ["ground.O", "bead.P"], law = "20 N/m * x" }
"""

SCRIPT = """
import json, sys
import numpy as np
import mbody
from mbody import Marker
from mbody.laws import Polynomial, Throw
from mbody.model.joints import ParabolicGuide
from mbody.model.loads import LeafSpring
from mbody.testing import check_joint, check_load
from mbody.views.labels import save

model, contracts = json.loads(sys.stdin.read())
guide, leaf = (eval(line) for line in contracts)
found = {"contracts": [check_joint(guide).worst, check_load(leaf).worst]}
found["conservative"] = check_load(leaf)["conservative"].error

open("bead.toml", "w").write(model)
machine = mbody.load("bead.toml")
mbody.save(machine, "again.toml")
found["round trip"] = mbody.load("again.toml") == machine
found["written"] = open("again.toml").read()

run = mbody.kinetostatics(machine, t=[0.0, 1.0, 2.0])
found["x"], found["y"] = run["bead"].x.tolist(), run["bead"].y.tolist()
found["tension"] = run.load("leaf").force.tolist()
found["summary"] = str(run) + str(mbody.kinetostatics(machine, t=[1.0]))
report = mbody.crosscheck(machine, [], ours=run)
found["engines"] = {
    name: [result.agrees, len(result.rows), [one.element for one in result.not_expressible]]
    for name, result in report.opinions.items()
}
free = machine.without("push")
found["energy"] = mbody.simulate(free, until=0.5, instants=3).energy.error
for name in ("bead.png", "bead.svg"):
    save(mbody.draw(run), name)
found["picture"] = open("bead.svg").read()
json.dump(found, sys.stdout)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the package with the three files and the three lines of the text."""
    folder = tmp_path_factory.mktemp("contributing")
    shutil.copytree(ROOT / "mbody", folder / "mbody", ignore=shutil.ignore_patterns("__pycache__"))
    for path, content in FILES.items():
        assert not (folder / path).exists(), path
        (folder / path).write_text(content, "utf-8")
    for path, line in LINES.items():
        assert line.count("\n") == 1, path
        with (folder / path).open("a", encoding="utf-8") as file:
            file.write(line)
    return folder


def run(folder, *arguments, **options):
    settings = {**os.environ, "MBODY_CORE": "plain", "PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=settings,
        capture_output=True,
        text=True,
        encoding="utf-8",
        **options,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def found(folder):
    return json.loads(run(folder, "-c", SCRIPT, input=json.dumps([MODEL, CONTRACTS])))


def test_the_examples_are_a_file_and_a_line_each():
    assert len(FILES) == len(LINES) == 3
    assert len(CONTRACTS) == 2
    homes = {Path(path).parent for path in FILES}
    assert homes == {Path(path).parent for path in LINES}


@pytest.mark.slow
def test_the_contracts_hold(found):
    assert max(found["contracts"]) < 1e-8
    assert found["conservative"] < 1e-8


def test_model_files_know_them(found, folder):
    assert found["round trip"]
    for word in ("parabolic_guide", "leaf_spring", "throw"):
        assert word in found["written"]
    schema = run(folder, "-m", "mbody", "schema")
    assert all(f'"{word}"' in schema for word in ("parabolic_guide", "leaf_spring", "throw"))
    assert "Pin in a parabolic slot" in schema


def test_the_motion_is_that_of_the_definition(found):
    for t, x, y, tension in zip((0, 1, 2), found["x"], found["y"], found["tension"], strict=True):
        assert x == pytest.approx(0.6 * (2.0 * t / 3.0 - t * t / 9.0), abs=1e-12)
        assert y == pytest.approx(x * x / 2.0, abs=1e-12)
        assert tension == pytest.approx(20.0 * y, abs=1e-11)  # across the x axis of the ground
    assert found["energy"] < 1e-6


def test_the_summary_and_the_picture_show_them(found, folder):
    assert "guide" in found["summary"]
    assert "leaf" in found["summary"]
    for name in ("joint:guide", "load:leaf"):  # the general symbols
        assert name in found["picture"]
    assert (folder / "bead.png").stat().st_size > 1000


def test_other_engines_agree(found):
    for name, (agrees, rows, missing) in found["engines"].items():
        assert agrees and rows and not missing, name


def test_every_path_of_the_text_is_there():
    both = CONTRIBUTING + TEXT
    paths = set(re.findall(r"`((?:mbody|tests|validation)/[\w./]*)`", both)) - FILES.keys()
    assert len(paths) > 30
    assert not [path for path in paths if not (ROOT / path).exists()]


def test_newcomers_questions_have_a_path():
    part = CONTRIBUTING.partition("## Where is what")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.+\?) \| (.+) \|$", part, re.MULTILINE)
    assert len(rows) >= 10
    assert all("`mbody/" in answer for _, answer in rows)
