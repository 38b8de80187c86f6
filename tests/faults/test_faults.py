"""Planted faults: every one is seen by engines that share no code with what is broken."""

from tests.faults.catalogue import FAULTS, MOVING_FAULTS
from tests.faults.models import MODELS
from tests.faults.plant import seen_by, verdicts
from tests.support.cases import first_fast


@first_fast("model", MODELS, 1)
def test_engines_agree_where_nothing_is_planted(model):
    found = verdicts()[model]
    assert {"balance", "oracle", "pinocchio"} <= found.keys() and all(found.values())


@first_fast("fault", FAULTS, 1, ids=[fault.name for fault in FAULTS])
def test_two_engines_see_a_fault(fault):
    assert len(seen_by(fault)) >= 2


@first_fast("fault", MOVING_FAULTS, 1, ids=[fault.name for fault in MOVING_FAULTS])
def test_a_fault_of_a_law_or_a_contact_is_seen_in_a_motion(fault):
    assert seen_by(fault)
