"""docs/embedding.md: its programs are compiled and run, its commands are understood."""

import ctypes
import re
import shlex
import subprocess

import numpy as np

import mbody
from mbody import gallery
from mbody.cli.command import parsed
from mbody.image.model_image import to_image
from tests.support import embedded
from tests.support.embedded import ADVANCE, DOOR, GOOD, Model
from tests.support.paths import ROOT

PAGE = (ROOT / "docs" / "embedding.md").read_text("utf-8")
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE, re.DOTALL)
C = [text for kind, text in BLOCKS if kind == "c"]
STRICT = (f"-I{DOOR}", "-Wall", "-Wextra", "-Wpedantic", "-Werror")


def written(folder, name, text):
    file = folder / name
    file.write_text(text)
    return file


def test_every_block_is_tried():
    assert [kind for kind, _ in BLOCKS].count("sh") == 2 and len(C) == 3 and len(BLOCKS) == 5


def test_the_commands_are_understood():
    found = []
    for line in "".join(text for kind, text in BLOCKS if kind == "sh").splitlines():
        words = shlex.split(line, comments=True)
        if words[0] == "mbody":
            found.append(parsed(words[1:]))
    assert [one.command for one in found] == ["export", "compile", "compile"]
    assert found[1].images and found[2].fmu


@embedded.needs_core
def test_the_program_prints_mbodys_own_numbers(tmp_path):
    source = written(tmp_path, "program.c", C[0])
    program = embedded.compiled([source, DOOR / "mbody.c"], tmp_path / "program", *STRICT)
    done = subprocess.run([program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and "slider_crank.img cannot be read" in done.stderr
    (tmp_path / "slider_crank.img").write_bytes(to_image(gallery.load("slider_crank")).content)
    done = subprocess.run([program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    t, effort = np.array([line.split() for line in done.stdout.splitlines()], dtype=float).T
    system = mbody.assemble(gallery.load("slider_crank")).with_values({"rod": 1.1})
    own = mbody.kinetostatics(system, t=np.linspace(0.0, t[-1], len(t))).effort("motor")
    assert len(t) == 361
    # six digits are printed, of the times too
    assert np.abs(effort - own).max() < 1e-4 * np.abs(own).max()


@embedded.needs_core
def test_the_functions_control_and_foresee(tmp_path):
    sources = [written(tmp_path, f"part{n}.c", text) for n, text in enumerate(C[1:])]
    parts = embedded.compiled(
        [*sources, DOOR / "mbody.c"], tmp_path / "parts.so", "-shared", *STRICT
    )
    library = embedded.door(tmp_path)
    model = Model(library, to_image(gallery.load("double_pendulum")).content)
    opened = ctypes.CDLL(str(parts))
    opened.foresee.restype = ctypes.c_double
    place, measure = ctypes.c_void_p(model.model), model.entry("lower.angle")
    assert opened.control(place, model.entry("m"), measure, ctypes.c_double(0.05)) == 0
    assert model.now() == 0.05 and model.number(model.entry("m")) > 40.0
    before = list(model.numbers("motion.y"))
    seen = opened.foresee(place, measure, ctypes.c_double(0.1))
    assert model.now() == 0.05 and list(model.numbers("motion.y")) == before
    assert model.advance(0.1) == GOOD and model.history(ADVANCE, "lower.angle") == [seen]
