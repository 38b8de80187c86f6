"""A short form of the campaign: random mechanisms and analyses against independent truth."""

import numpy as np
import pytest

import mbody
from tests.campaign.analyses import ANALYSES, examine
from tests.campaign.drawing import random_linkage
from tests.campaign.hunt import Tally, hunt

SEEDS = range(60)


@pytest.mark.slow
@pytest.mark.processor
def test_nothing_is_silently_wrong():
    tally = hunt(10**9, SEEDS.start, 1, None, most=len(SEEDS))
    assert tally.failed == 0, str(tally)
    assert tally.total("mechanisms") > 500
    # every analysis had its turn
    assert set(ANALYSES) <= tally.counts.keys()


@pytest.mark.parametrize("seed", range(0, 40, 5))
def test_the_truth_is_true(seed):
    """Its rates and accelerations are the derivatives of its positions."""
    of = random_linkage(seed)
    t, h = np.array([0.3 * of.span]), 1e-4 * of.span
    before, here, after = (of.motion(t + shift) for shift in (-h, 0.0, h))
    for name, rows in here.items():
        size = max(1.0, np.abs(rows).max())
        for n in (0, 1):
            rate = (after[name][n] - before[name][n]) / (2.0 * h)
            change = (after[name][3 + n] - before[name][3 + n]) / (2.0 * h)
            # central differences of step h are off by h²/6 times the third derivative
            assert abs(rate - rows[3 + n]) < 1e-4 * size
            assert abs(change - rows[6 + n]) < 1e-4 * size


def test_a_wrong_result_is_found(monkeypatch):
    """The campaign sees what it hunts: numbers that are off, also of a result that is doubtful."""
    seed = next(s for s in range(1000) if examine_name(s) == "turn")
    assert examine(seed).silent == 0
    right = mbody.kinetostatics

    def wrong(model, **more):
        run = right(model, **more)
        run.record.blocks[0][:, 2, :] += 1e-3
        return run

    monkeypatch.setattr(mbody, "kinetostatics", wrong)
    found = examine(seed)
    assert found.silent + found.doubted == 1 and "position 1" in found.told


def examine_name(seed):
    return examine(seed).analysis


def test_counts_add_up():
    tally = Tally(0)
    tally.add("turn", mechanisms=3, silent=1)
    tally.add("free", mechanisms=2, doubted=1)
    assert (tally.total("mechanisms"), tally.failed) == (5, 1)
    assert "| turn | 3 | 0 | 0 | 1 | 0 | 0 |" in str(tally)


@pytest.mark.parametrize("seed", [77000496, 77001148])
def test_what_a_longer_hunt_found(seed):
    """Teeth of wheels other than those that the phase means, silently."""
    assert examine(seed).silent == 0


def test_a_path_beside_singular_positions_ends():
    """Every position of this linkage is nearly singular: rounding cut its path into steps of a
    millionth of the way, for hours. It is refused in a sentence.
    """
    found = examine(77000099)
    assert found.refused == 1 and "branches of 'turn' meet" in found.told
