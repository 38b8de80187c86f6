"""The symbolic phase in compiled code beside the same rule written out in Python."""

from __future__ import annotations

import numpy as np
import pytest

import mbody
from mbody.core.decorators import PLAIN
from mbody.kernels.loop_closure import violation
from mbody.system.pivoting import choose_pivots, diagonal_blocks
from tests.support.pivot_search import entries_of, lists_of, pivots_of

#: Driven mechanisms, with slots, cams, gears and more than one block.
MODELS = (
    "cam_follower",
    "hoekens",
    "mud_pump_sixbar",
    "norton_fourbar",
    "planetary_train",
    "quick_return",
    "slider_crank",
    "stephenson_sixbar",
    "toggle_press",
    "watt_sixbar",
)


def samples(system, count):
    """Workspaces at positions and of numbers a little off, as sweeps have them."""
    works = []
    for n in range(count):
        work = system.work()
        # generic positions: where all coordinates are zero most of them are singular
        random = np.random.default_rng(n)
        work.q[: system.coordinates, 0] = random.uniform(-1.0, 1.0, system.coordinates)
        work.par[:] += 0.07 * n * np.cos(np.arange(len(work.par)))[:, None]
        violation(system.layout, work)
        works.append(work)
    return works


@pytest.mark.parametrize("name", MODELS)
def test_pivots_and_lists_are_those_of_the_rule_written_out(name):
    system = mbody.assemble(mbody.gallery.load(name))
    works = samples(system, 5)
    here, elsewhere, *rest = works
    along = [work.block[:, 0] for work in rest]
    found = choose_pivots(system.layout, here, elsewhere, along)
    L = system.layout
    rows = np.flatnonzero(here.pad[: 2 * L.nodes, 0] == 0.0)
    entries = entries_of(L, here.block[:, 0], elsewhere.block[:, 0], rows)
    size = len(rows)
    matrices = np.zeros((1 + len(along), size, size))
    steady, present = np.zeros((size, size), bool), np.zeros((size, size), bool)
    for (r, c), (place, value, constant) in entries.items():
        matrices[:, r, c] = [value, *(blocks[place] for blocks in along)]
        steady[r, c], present[r, c] = constant, True
    # without units: rows of angles by a length, welds as their coordinates, columns of angles too
    columns = 1.0 / np.sqrt(here.weight[:size, 0])
    weights = here.regularization_weight[rows, 0]
    units = [
        1.0 / np.sqrt(weight) if weight else columns[min(c for k, c in entries if k == r)]
        for r, weight in enumerate(weights)
    ]
    matrices *= np.array(units)[:, None] / columns
    blocks = diagonal_blocks(present)
    inside = blocks[0][:, None] == blocks[1][None, :]
    pivots, pattern, constant, _ = pivots_of(matrices, steady, present, inside)
    expected = lists_of(entries, rows, pivots, pattern, constant)
    for field, numbers in expected.items():
        assert getattr(found[0], field).tolist() == numbers, field


def test_a_pattern_without_a_transversal_has_no_blocks():
    pattern = np.array([[True, True, False], [True, True, False], [True, True, False]])
    assert diagonal_blocks(pattern) is None


@pytest.mark.skipif(PLAIN, reason="plain Python: some seconds for what takes milliseconds")
def test_blocks_of_a_large_pattern_are_those_of_scipy():
    scipy = pytest.importorskip("scipy.sparse")
    from scipy.sparse.csgraph import connected_components

    random = np.random.default_rng(3)
    for size in (30, 120):
        pattern = random.random((size, size)) < 1.2 / size
        pattern |= np.eye(size, dtype=bool)
        rows = random.permutation(size)
        found = diagonal_blocks(pattern[rows])
        count, labels = connected_components(scipy.csr_array(pattern), connection="strong")
        assert found[1].max() + 1 == count
        same = labels[:, None] == labels[None, :]
        assert (same == (found[1][:, None] == found[1][None, :])).all()
        assert (found[0] == found[1][rows]).all()
