"""Rows of random batches with friction and contacts equal single analyses, doubts included."""

import numpy as np
import pytest

import mbody
from mbody.analysis.driven.driven import analyse_system_at
from mbody.model.simulation import Instants
from tests.batch_rows import KINDS, compared, compared_free, free_batch, random_batch

#: Of every kind; of friction one that jams; designs of redundant joints that do not fit or close,
#: and one at a dead centre.
FEW = (0, 1, 2, 3, 13, 14, 18, 74, 127, 286)


#: Of every kind; designs of some end by an event, or fail.
FEW_FREE = (0, 1, 2, 3, 4, 11)


@pytest.mark.parametrize("seed", FEW)
def test_random_batches(seed):
    found = compared(random_batch(seed))
    assert found.wrong == []


@pytest.mark.parametrize("seed", FEW_FREE)
def test_random_batches_of_free_motions(seed):
    assert compared_free(free_batch(seed)).wrong == []


def test_a_batch_that_is_stopped():
    """What was reached is kept; designs that were not begun have no instants."""
    designs = mbody.assemble(mbody.gallery.load("simple_pendulum")).with_values(l=[1.0, 2.0, 3.0])

    def interrupt(t):
        if t > 0.5:
            raise KeyboardInterrupt

    run = mbody.simulate(designs, 500.0, instants=501, progress=interrupt)
    assert run.status.startswith("stopped: 3 of 3 designs, as design 0: ")
    assert run.design(2).status == "stopped: before it began" and not len(run.design(2))
    angle = run["pendulum"].angle
    reached = int(np.isfinite(angle[0]).sum())
    assert 1 < reached < 501 and np.isnan(angle[1:]).all()


def test_the_text_of_a_batch_says_when_its_designs_first_and_last_have_an_event():
    falls = {"gravity.y": [-9.81, -19.62]}
    ball = mbody.assemble(mbody.gallery.load("bouncing_ball")).with_values(falls)
    first, last = (f"{(2.0 / g) ** 0.5:.6g}" for g in (19.62, 9.81))
    said = f"impact of floor in 2 of 2 designs at t = {first} … {last} s, 2 times"
    assert said in str(mbody.simulate(ball, 0.46))


def test_a_motion_of_designs_goes_on():
    """Each from its own end, to the last bit as without a stop; what failed stays so."""
    machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)).without("motor")
    values = {"crank.mass": [1.0, 1.5, 2.0], "coupler.B.x": [3.0, 3.0, 9.0]}
    designs = mbody.assemble(machine).with_values(values)
    begin = mbody.engineering.close_loops(designs, rates={"crank": 5.0})
    first = mbody.simulate(designs, 0.25, start=begin, instants=3)
    run = mbody.simulate(designs, 0.5, start=first, instants=3)
    whole = mbody.simulate(designs, 0.5, start=begin, instants=5)
    assert np.ptp(whole["crank"].angle[:2], axis=1).min() > 1.0
    # at the end of a step the motion itself, within one what steps leave between its ends
    assert np.array_equal(run["crank"].angle[:2, 1:], whole["crank"].angle[:2, 3:])
    for joined in (run, first.then(run)):
        assert joined.status.startswith("failed: 1 of 3 designs, as design 2: loops do not close")
        assert np.isnan(joined["crank"].angle[2]).all()
        with pytest.raises(mbody.SolveError, match=r"^loops do not close"):
            joined.design(2)
    joined = first.then(run)["crank"].angle
    assert joined[:2] == pytest.approx(whole["crank"].angle[:2], abs=1e-8)


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
