"""Planted faults: every one is seen by two engines that share no code with what is broken."""

import pytest

from tests.faults.catalogue import FAULTS
from tests.faults.models import MODELS
from tests.faults.plant import seen_by, verdicts


@pytest.mark.parametrize("model", MODELS)
def test_engines_agree_where_nothing_is_planted(model):
    found = verdicts()[model]
    assert {"balance", "oracle", "pinocchio"} <= found.keys() and all(found.values())


@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_two_engines_see_a_fault(fault):
    assert len(seen_by(fault)) >= 2
