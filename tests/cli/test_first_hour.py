"""A first hour with the command, step by step: a compressor from a textbook, by someone who has
read the README and ``mbody --help``. Each step is what is typed and what the answer must contain;
slips of the hand are steps too, and what they are told leads on.
"""

import contextlib
import csv
import io
import math
import re
import shlex

import numpy as np
import pytest
from openpyxl import load_workbook

from mbody import cli

R, L, SPEED = 0.040, 0.120, 900.0 * math.pi / 30.0

#: What is typed, the exit status, and what stands in the answer. `edit` is what the user changes in
#: the file with an editor: a pattern and what is put in its place.
STEPS = [
    ("--help", 0, "kinetostatics  motion, all joint forces"),
    ("demo", 0, "FORCES"),
    ("new", 0, "slidercrank  --lengths r,l,offset"),
    ("new slider-crank -o pump.toml", 0, "wrote pump.toml"),
    ("check pump.toml", 0, "3 moving links, 4 joints, 1 driver, 1 independent loop"),
    ("forces pump.toml", 2, "did you mean kinetostatics"),
    ("kinetostatics pump.toml --at crank=60", 0, "rod on crank"),
    ('edit speed  = "600 rpm" -> speed  = "900 rpm"', 0, ""),
    ("edit prismatic = -> slider = ", 0, ""),
    ('edit mass   = "0.6 kg" -> mass   = "0,6 kg"', 0, ""),
    ("check pump.toml", 2, "bodies.piston.mass: '0,6 kg' is not a formula: write a decimal point"),
    ('edit "0,6 kg" -> "0.6 kgs"', 0, ""),
    ("check pump.toml", 2, "kg"),
    ('edit "0.6 kgs" -> "600 g"', 0, ""),
    ('edit ["rod.B", "piston.B"] -> ["rod.C", "piston.B"]', 0, ""),
    ("check pump.toml", 2, "refers to point 'C' of 'rod', which is not there (it has: 'A', 'B')"),
    ('edit ["rod.C", "piston.B"] -> ["rod.B", "piston.B"]', 0, ""),
    ("kinetostatics pump.toml --turn", 2, "did you mean --over"),
    ("kinetostatics pump.toml --over turn", 0, "PEAK FORCES"),
    ("kinetostatics pump.toml --over turn --units torque=N*m,power=kW,speed=rpm", 0, "900"),
    ("kinetostatics pump.toml --over turn --csv pump.xlsx", 2, "--xlsx pump.xlsx"),
    ("kinetostatics pump.toml --over turn -o pump.xlsx", 0, "wrote pump.xlsx: 361 instants"),
    ("kinetostatics pump.toml --at crank=0:330:12 --csv rows.csv", 0, "wrote rows.csv"),
    ("fbd pump.toml", 2, "did you mean freebody"),
    ("freebody pump.toml --at crank=60", 0, "wrote pump-freebody.svg"),
    ("draw pump.toml --forces", 0, "wrote pump.svg"),
    ("plot pump.toml torque O.force", 0, "wrote pump-plot.svg"),
    ("report pump.toml --over turn -o pump.md", 0, "wrote pump.md"),
    ("sweep pump.toml 'l=100 mm:160 mm:4'", 2, "did you mean --vary l=100 mm:160 mm:4"),
    ("sweep pump.toml --vary 'l=100 mm:160 mm:4' --over turn", 0, "sweep of 4 designs over l"),
    ("sensitivity pump.toml 'peak(O.force)' --over turn", 0, "N/kg"),
    ("kinetostatics pump.toml --set 'rod.mass=0.5 kg' --set ground.O.y=1", 0, "FORCES"),
]


def typed(words):
    """The exit status of a command line, and all that it prints."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
        try:
            status = cli.main(shlex.split(words))
        except SystemExit as end:
            status = end.code or 0
    return status, told.getvalue()


@pytest.fixture(scope="module")
def hour(tmp_path_factory):
    """The folder, and status and text of every answer in the order of the steps."""
    folder, answers = tmp_path_factory.mktemp("hour"), []
    file = folder / "pump.toml"
    with contextlib.chdir(folder):
        for words, *_ in STEPS:
            if words.startswith("edit "):
                old, _, new = words.removeprefix("edit ").partition(" -> ")
                text = file.read_text(encoding="utf-8")
                assert text.count(old) == 1, words
                file.write_text(text.replace(old, new), encoding="utf-8")
                answers.append((0, ""))
            else:
                answers.append(typed(words))
    return folder, answers


def test_every_step_is_answered(hour):
    for (words, status, wanted), answer in zip(STEPS, hour[1], strict=True):
        assert answer[0] == status and wanted in answer[1], f"mbody {words}\n{answer}"
        assert "Traceback" not in answer[1]


def test_what_it_says_is_right(hour):
    """Stroke, speed of the piston at mid-stroke and the pin force, by the closed form of a
    slider-crank whose only forces are that of the gas and those of inertia.
    """
    folder, answers = hour
    with open(folder / "rows.csv", newline="") as file:
        rows = list(csv.reader(file))
    head = [cell.partition(" [")[0] for cell in rows[0]]
    table = {name: np.array([float(r[k]) for r in rows[1:]]) for k, name in enumerate(head)}
    theta = np.radians(np.arange(0, 331, 30))
    beta = np.arcsin(R * np.sin(theta) / L)
    x = 1e3 * (R * np.cos(theta) + L * np.cos(beta))
    v = -1e3 * R * SPEED * np.sin(theta + beta) / np.cos(beta)
    # sixteen printed digits, and a loop that is closed to rounding
    np.testing.assert_allclose(table["piston.x"], x, rtol=1e-12)
    np.testing.assert_allclose(table["piston.vx"], v, rtol=1e-11, atol=1e-9)
    # F_x of the rod's pin moves the piston against the gas
    accelerating = 0.6e-3 * table["piston.ax"] + 500.0
    np.testing.assert_allclose(np.abs(table["B.fx"]), np.abs(accelerating), rtol=1e-10)
    # the sheet of a spreadsheet has the torque in the chosen unit of its measure
    sheet = load_workbook(folder / "pump.xlsx", read_only=True)["instants"]
    cells = list(sheet.iter_rows(values_only=True))
    k = cells[0].index("torque [N·m]")
    (whole,) = (
        answer[1]
        for (words, *_), answer in zip(STEPS, answers, strict=True)
        if words.endswith("--units torque=N*m,power=kW,speed=rpm")
    )
    greatest = max(row[k] for row in cells[1:])
    told = re.search(r"^torque +(\S+) +(\S+) +N·m", whole, re.MULTILINE)
    assert float(told[2]) == pytest.approx(greatest, rel=1e-5)  # six printed digits
