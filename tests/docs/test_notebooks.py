"""The notebooks of the site: kept without outputs, run from end to end, right by value."""

import contextlib
import io
import json
import math

import pytest

from tests.support.pages import DOCS

pytest.importorskip("matplotlib")

NOTEBOOKS = sorted(DOCS.glob("*/*.ipynb"))


def cells(path):
    return [cell for cell in json.loads(path.read_text("utf-8"))["cells"]]


def run(name, folder):
    """What the cells leave behind, and what they print."""
    namespace = {"__name__": "notebook"}
    with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()) as stream:
        for cell in cells(DOCS / "tutorial" / f"{name}.ipynb"):
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), name, "exec"), namespace)
    return namespace, stream.getvalue()


def test_there_are_two():
    assert len(NOTEBOOKS) >= 2


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(path):
    for cell in cells(path):
        if cell["cell_type"] == "code":
            assert not cell["outputs"] and cell["execution_count"] is None


def test_the_pendulum(tmp_path):
    found, _ = run("released", tmp_path)
    # the time to fall a quarter is K(1/√2) √(2/3) √(l/g), K by the mean of Gauss
    a, b = 1.0, math.sqrt(0.5)
    for _ in range(8):
        a, b = (a + b) / 2, math.sqrt(a * b)
    quarter = math.pi / (2 * a) * math.sqrt(2 / 3 / 9.81)
    assert found["first"].t == pytest.approx(quarter, rel=1e-8)
    assert found["fine"]["rod"].omega[-1] == pytest.approx(found["expected"], rel=1e-8)
    assert found["fine"].reaction("O").fy[-1] == pytest.approx(2.5 * 9.81, rel=1e-7)
    # about the lowest point I θ̈ + c θ̇ + m g l/2 θ = 0 with I = 1/3
    damped = math.sqrt(1.5 * 9.81 - 0.3**2)
    assert found["damped"]["rod"].angle[-1] == pytest.approx(-math.pi / 2, abs=0.2)
    assert f"{damped:.5f}" in str(found["found"])


def test_the_better_crank(tmp_path):
    found, printed = run("a_better_crank", tmp_path)
    torque = found["torque"]
    assert found["best"].objective <= torque.min() * (1 + 1e-9) < found["best"].start_objective
    again = found["mbody"].kinetostatics(found["mbody"].from_toml(found["text"]), turn=True)
    assert abs(again.effort("motor")).max() == pytest.approx(found["best"].objective, rel=1e-3)
    assert "[bodies.coupler]" in printed
