"""Bundles of the kernels beyond those of `test_lanes`: complex numbers, and zeros in one piece."""

import numpy as np
import pytest

from mbody.compiler.jit import kernel
from mbody.core.bundle import Bundle, ComplexRows, Rows

pytestmark = pytest.mark.numba


class Mixed(Bundle):
    scale: "float"
    rows: "Rows"
    results: "Rows"
    waves: "ComplexRows"


class Plain(Bundle):
    rows: "Rows"
    scale: "float"
    results: "Rows"


class Whole(Bundle):
    scale: "float"
    part: "Plain"
    last: "Rows"


@kernel
def conjugated(M):
    for k in range(M.waves.shape[1]):
        M.waves[0, k] = M.waves[0, k].conjugate()


def test_a_bundle_may_hold_complex_numbers():
    waves = np.array([[1.0 + 2.0j, -3.0j]])
    conjugated(Mixed(scale=1.0, rows=np.zeros((1, 1)), results=np.zeros((1, 1)), waves=waves))
    np.testing.assert_array_equal(waves, [[1.0 - 2.0j, 3.0j]])


@kernel
def doubled_within(M):
    for row in range(M.part.rows.shape[0]):
        M.part.results[row, 0] = M.scale * M.part.scale * M.part.rows[row, 0] + M.last[0, 0]


def test_a_bundle_may_contain_bundles():
    """One of them is exchanged in its place, so that what contains it has the other."""
    parts = [Plain.zeros(((3, 1), (3, 1)), scale=scale) for scale in (2.5, -1.0)]
    whole = Whole(scale=2.0, part=parts[0], last=np.array([[0.25]]))
    for part in parts:
        part.rows[:, 0] = [1.0, -2.0, 0.5]
        whole.attach("part", part)
        doubled_within(whole)
        np.testing.assert_array_equal(part.results, 2.0 * part.scale * part.rows + 0.25)
    assert whole.part is parts[1]
    with pytest.raises(AttributeError, match="a Whole has no 'other'"):
        whole.attach("other", parts[0])
