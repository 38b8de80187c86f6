"""What the everyday command prints: whole degrees, a row a design, units beside limits."""

import json
import math
import re

import numpy as np
import pytest

import mbody
from mbody import ModelError, Prismatic, Revolute, cli, gallery
from mbody.quantities.convert import short_degrees


def test_an_angle_of_the_command_comes_back_as_it_was_given(capsys):
    for angle in (60.0, 75.0, 170.25):
        assert cli.main(["assemblies", "norton_fourbar", f"--at=crank={angle}", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["at"]["motor"] == angle
    rng = np.random.default_rng(3)
    for value in rng.uniform(-10, 10, 200).tolist():
        assert math.radians(short_degrees(value)) == pytest.approx(value, rel=1e-15)


def rows(text):
    """The rows of the table of designs."""
    body = text.partition("DESIGN")[2].partition("─\n")[2]
    found = (line.split() for line in body.partition("\n\n")[0].splitlines())
    return [[float(cell) for cell in line] for line in found]


def test_a_sweep_has_a_row_for_each_design():
    machine = gallery.load("norton_fourbar")
    lengths = [9.5, 10.0, 10.5]
    found = mbody.sweep(
        machine,
        {"rocker.B.x": lengths},
        "kinetostatics",
        ["peak(A.force)"],
        over="motor",
        instants=37,
    )
    shown = rows(str(found))
    assert [row[:2] for row in shown] == [[n, x] for n, x in enumerate(lengths)]
    for length, row in zip(lengths, shown, strict=True):
        system = mbody.assemble(machine).with_values({"rocker.B.x": length})
        run = mbody.kinetostatics(system, turn="motor", instants=37)
        # six digits are printed
        assert row[2] == pytest.approx(run.reaction("A").magnitude.max(), rel=1e-5)
    assert re.search(r"DESIGN +rocker\.B\.x +peak\(A\.force\)\n +in +lbf\n", str(found))


def test_many_designs_and_histories_have_no_rows():
    machine = gallery.load("norton_fourbar")
    many = mbody.sweep(
        machine, {"rocker.B.x": np.linspace(9.5, 10.5, 31)}, "kinetostatics", ["peak(A.force)"]
    )
    histories = mbody.sweep(
        machine, {"rocker.B.x": [9.5, 10.5]}, "kinetostatics", ["A.force"], over="motor"
    )
    assert "DESIGN" not in str(many) and "DESIGN" not in str(histories)


def test_limits_in_the_wrong_order_have_their_unit():
    with pytest.raises(ModelError, match=r"limits are 0\.5 and 0\.2 rad: give the lesser first"):
        Revolute("A", "ground", "arm", limits=(0.5, 0.2))
    with pytest.raises(ModelError, match=r"limits are 3 and 2: give the lesser first"):
        Prismatic("guide", "ground", "slide", limits=(3, 2))
    machine = mbody.Mechanism("slide", units="mm-N-s")
    machine.add(mbody.Body("slide", mass=1.0), Prismatic("g", "ground", "slide", limits=(1, 2)))
    with pytest.raises(ModelError, match=r"limits are 3 and 2 mm: give the lesser first"):
        mbody.assemble(machine).with_values({"g.limits.low": 3.0})


def test_rows_of_a_request_are_counted_from_one():
    good = [(0.0, 0.1 * n) for n in range(4)]
    with pytest.raises(ModelError, match=r"row 3 of path must have 2 numbers"):
        mbody.synthesize(path=[*good[:2], (1.0,), *good[2:]])
    with pytest.raises(ModelError, match=r"row 2, number 1"):
        mbody.synthesize(path=[good[0], ("long", 1.0), *good[1:]])
