"""Rows of random batches with friction and contacts equal single analyses, doubts included."""

import pytest

import mbody
from mbody.analysis.driven.driven import analyse_system_at
from mbody.model.simulation import Instants
from tests.batch_rows import KINDS, compared, random_batch

#: Of every kind; of friction one that jams, of redundant joints one of which a design is refused.
FEW = (0, 1, 2, 3, 13, 18, 74, 127)


@pytest.mark.parametrize("seed", FEW)
def test_random_batches(seed):
    found = compared(random_batch(seed))
    assert found.wrong == []


def test_an_assembly_of_a_batch():
    """That of the first design, on whose branch all are."""
    system = mbody.assemble(mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, speed=1.0))
    run = mbody.kinematics(system.with_values({"coupler.B.x": [3.0, 3.1]}), assembly="crossed")
    for n in range(2):
        alone = mbody.kinematics(run.design(n).system, assembly="crossed")
        assert run["rocker"].angle[n] == pytest.approx(alone["rocker"].angle, abs=1e-12)


def test_instants_of_a_batch_by_request():
    """The first instants, which lead to those requested, are left out of every design."""
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, speed=1.0)
    system, ask = mbody.assemble(machine), Instants(at={"t": [0.5, 0.7]})
    run = analyse_system_at(system.with_values({"crank.A.x": [1.0, 1.1]}), "kinematics", ask)
    alone = analyse_system_at(run.design(1).system, "kinematics", ask)
    assert run["rocker"].angle[1] == pytest.approx(alone["rocker"].angle, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_more_random_batches(kind):
    """`python -m tests.batch_rows` takes three hundred."""
    for seed in range(500 + kind, 560, len(KINDS)):
        assert compared(random_batch(seed)).wrong == [], seed
