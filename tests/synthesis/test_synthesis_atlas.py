"""The atlas of coupler curves: what its descriptors do not depend on, and designs found by it."""

import numpy as np
import pytest

import mbody
from mbody.cli import main
from mbody.synthesis import Atlas
from mbody.synthesis.linkages import curve_descriptor
from tests.support.synthesis_cases import CLOSED, four_bar, random_four_bar, rows


def curve(rng, count=300):
    whole = np.arange(count) * (2.0 * np.pi / count)
    return four_bar(random_four_bar(rng), whole, rng.choice([-1, 1]))[2]


def test_a_descriptor_is_that_of_the_shape():
    """Place, size, direction, first point and timing change nothing; direction and
    mirror reverse.
    """
    rng = np.random.default_rng(0)
    for _ in range(20):
        path = curve(rng)
        own = curve_descriptor(path)
        moved = 3.7 * np.exp(1.1j) * np.roll(path, 70) + 5.0 - 2.0j
        # points at equal steps of the length are interpolated between 300 others
        assert curve_descriptor(moved) == pytest.approx(own, abs=2e-3)
        assert curve_descriptor(path[::-1]) == pytest.approx(own[::-1], abs=2e-3)
        assert curve_descriptor(path.conj()) == pytest.approx(own[::-1], abs=1e-12)
        assert np.linalg.norm(curve_descriptor(curve(rng)) - own) > 1e-3


def test_a_circle_has_one_order():
    found = curve_descriptor(np.exp(2j * np.pi * np.arange(400) / 400))
    assert found[8] == pytest.approx(1.0, abs=1e-3) and np.delete(found, 8).max() < 1e-3


@pytest.mark.parametrize("kind", ["four_bar", "slider_crank"])
def test_its_own_curves_are_found(kind, tmp_path):
    """By the assembled mechanism: its path, moved and turned round, finds its own place."""
    atlas = Atlas.made(kind, count=200, seed=3)
    atlas.save(tmp_path / "atlas.npz")
    again = Atlas.load(tmp_path / "atlas.npz")
    assert (again.descriptors == atlas.descriptors).all() and again.kind == kind
    for n in (0, 57, 131):
        shape, point = atlas.shapes[n], atlas.points[n]
        if kind == "four_bar":
            crossed = atlas.senses[n] < 0.0
            machine = mbody.makers.four_bar(shape[0], shape[1], shape[2], 1.0, crossed=crossed)
            body, length = "coupler", shape[1]
        else:
            machine = mbody.makers.slider_crank(shape[0], 1.0, offset=shape[1])
            body, length = "rod", 1.0
        run = mbody.kinematics(machine, turn=True, instants=181)
        place = run.measure(f"{body}.A.x") + 1j * run.measure(f"{body}.A.y")
        path = (place + length * point * np.exp(1j * run[body].angle))[:-1]
        moved = rows(-2.0j * path[::-1] + 7.0)
        assert atlas.nearest(moved, 1)[0] == n


@pytest.mark.slow
def test_a_synthesis_from_an_atlas():
    atlas = Atlas.made(count=1600, seed=1)
    found = mbody.synthesize(path=[*CLOSED, CLOSED[0]], atlas=atlas, search=160, count=1)
    assert found[0].error < 0.0035 and found.searched <= 160
    again = mbody.synthesize(path=[*CLOSED, CLOSED[0]], atlas=atlas, search=160, count=1, seed=9)
    assert again[0].values == found[0].values  # nothing else is random


@pytest.mark.slow
def test_the_command(tmp_path, capsys):
    file, table = tmp_path / "atlas.npz", tmp_path / "path.csv"
    assert main(["atlas", "--to", str(file), "--count", "400"]) == 0
    assert "400 curves" in capsys.readouterr().err
    table.write_text("\n".join(f"{x},{y}" for x, y in [*CLOSED, CLOSED[0]]))
    words = ["synthesize", str(table), "--atlas", str(file), "--search", "100", "--count", "1"]
    assert main(words) == 0
    assert "designs tried" in capsys.readouterr().out
