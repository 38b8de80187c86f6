"""First positions that are kept: the same answer each time, and nothing left unsaid."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import mbody
from mbody.analysis.position import closed_position
from mbody.analysis.position.assembly_analysis import closed
from mbody.errors import ModelWarning
from mbody.laws import Function


def four_bar(**options):
    return mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0, **options)


def bits(run):
    return run.record.table(slice(None))


def test_a_repeated_call_gives_the_same_bits():
    system = mbody.assemble(four_bar())
    first = mbody.kinetostatics(system, turn=True)
    assert len(system.closed_positions) == 1
    again = mbody.kinetostatics(system, turn=True)
    assert_array_equal(bits(again), bits(first))
    fresh = mbody.kinetostatics(mbody.assemble(four_bar()), turn=True)
    assert_array_equal(bits(fresh), bits(first))


def test_other_instants_guesses_drivers_and_numbers_have_their_own():
    system = mbody.assemble(four_bar())
    open_ = mbody.kinematics(system, guess={"rocker": 1.2})
    crossed = mbody.kinematics(system, guess={"rocker": -1.2, "coupler": -1.0})
    assert abs(open_["rocker"].angle[0] - crossed["rocker"].angle[0]) > 0.5
    for t in (0.0, 0.1):
        for drive in (None, {"motor": 0.3}):
            one = mbody.kinematics(system, t, drive=drive)
            expected = mbody.kinematics(mbody.assemble(four_bar()), t, drive=drive)
            assert_array_equal(bits(one), bits(expected))
    longer = system.with_values({"crank.A.x": 1.1})
    assert not longer.closed_positions
    assert mbody.kinematics(longer)["coupler"].x[0] != mbody.kinematics(system)["coupler"].x[0]


def test_what_is_kept_is_not_what_is_handed_out():
    """Analyses go on in the workspace that they get."""
    system = mbody.assemble(four_bar())
    first = closed(system, 0.0, {})
    q = first.work.q.copy()
    first.work.q[:] += 1.0
    second = closed(system, 0.0, {})
    assert_array_equal(second.work.q, q)
    second.work.q[:] += 1.0
    assert_array_equal(closed(system, 0.0, {}).work.q, q)


def test_a_guess_on_another_branch_is_said_each_time():
    system = mbody.assemble(four_bar())
    for _ in range(2):
        with pytest.warns(ModelWarning, match="another branch"):
            mbody.kinematics(system, guess={"coupler": 1.5, "rocker": 1.0})


def test_guesses_that_cannot_be_compared_are_closed_anew():
    system = mbody.assemble(four_bar())
    for _ in range(2):
        run = mbody.kinematics(system, guess={"rocker": [3.5, 0.0, 1.2]})
        assert run.status == "completed"
    assert not system.closed_positions


def test_functions_of_the_user_are_asked_again():
    rod = mbody.Mechanism("rod")
    rod.add(mbody.Body("rod", mass=2.0), mbody.Revolute("O", "ground", "rod"))
    law = Function(lambda t: 0.5 + t)
    rod.add(mbody.AngleDriver("motor", "rod", law))
    system = mbody.assemble(rod)
    mbody.kinematics(system)
    assert system.has_user_code and not system.closed_positions


def test_the_last_positions_are_kept(monkeypatch):
    monkeypatch.setattr(closed_position, "KEPT", 3)
    system = mbody.assemble(four_bar())
    for t in np.linspace(0.0, 0.5, 7):
        mbody.kinematics(system, t)
    assert [key[0][0] for key in system.closed_positions] == pytest.approx([1 / 3, 5 / 12, 0.5])
