"""One set of other numbers: the same as a description that has them."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody import ModelError, assemble, kinetostatics
from mbody.engines.oracle import Reference
from tests.support.batches import NUMBERS, TIMES, four_bar, same


@pytest.mark.parametrize("name", NUMBERS)
def test_one_number_is_what_a_description_with_it_has(name):
    argument, value = NUMBERS[name]
    system = assemble(four_bar())
    changed = system.with_values({name: value})
    assert changed.batch is None and float(changed.values[name]) == value
    assert changed.layout is system.layout  # no new symbolic phase
    described = kinetostatics(four_bar(**{argument: value}), TIMES)
    same(kinetostatics(changed, TIMES), described)
    # and it is another mechanism, while the first one is what it was
    before = kinetostatics(system, TIMES).effort("motor")
    assert np.abs(before - described.effort("motor")).max() > 1e-3


def test_all_numbers_at_once_against_the_oracle():
    values = {name: value for name, (_, value) in NUMBERS.items()}
    described = four_bar(**{argument: value for argument, value in NUMBERS.values()})
    run = kinetostatics(assemble(four_bar()).with_values(values), TIMES)
    oracle = Reference(described)
    q = oracle.guess()
    for k, t in enumerate(map(float, TIMES)):
        start = oracle.guess() if k == 0 else q + oracle.velocities(q, t) * (t - TIMES[k - 1])
        q = oracle.close(start, t)
        v = oracle.velocities(q, t)
        wanted = oracle.kinetostatics(q, v, oracle.accelerations(q, v, t), t)
        top = max(np.abs(part).max() for part in wanted["reactions"].values())
        for name, part in wanted["reactions"].items():
            mine = run.reaction(name)
            found = [mine.fx[k], mine.fy[k], mine.torque[k]]
            assert_allclose(found, part, rtol=0, atol=1e-10 * top)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"cranck.mass": 1.0},
            "'cranck.mass' to change (there are numbers of: 'ground', 'crank', ",
        ),
        ({"crank.weight": 1.0}, "there is no number 'crank.weight' to change (there are: 'crank.m"),
        ({"coupler.P.x": 1.0}, "'coupler.P.x' to change (there are: 'coupler.weight'"),
        ({"motor.law.jerk": 1.0}, "(there are: 'motor.law.value', 'motor.law.speed'"),
        ({"crank.mass": math.nan}, "'crank.mass' is nan, it must be finite"),
        ({"crank.mass": [1.0, math.inf]}, "'crank.mass'[1] is inf, it must be finite"),
        ({"crank.mass": -1.5}, "'crank.mass' is -1.5 kg, it must not be negative"),
        ({"coupler.weight": [1.0, -2.0]}, "'coupler.weight' is -2 N, it must not be negative"),
        ({"rocker.inertia": -1e-9}, "'rocker.inertia' is -1e-09 N·m·s², it must not be negative"),
        ({"crank.mass": "heavy"}, "'crank.mass' must be a number or an array, not 'heavy'"),
        ({"crank.mass": [[1.0]]}, "'crank.mass' must be a number or one row of them"),
        ({"crank.mass": []}, "'crank.mass' must be a number or one row of them"),
        (
            {"crank.mass": np.ones(3), "crank.A.x": np.ones(4)},
            "'crank.A.x' has 4 values, others have 3: give arrays of one length",
        ),
    ],
)
def test_sentences_about_values(values, sentence):
    with pytest.raises(ModelError) as caught:
        assemble(four_bar()).with_values(values)
    assert sentence in str(caught.value)
    assert caught.value.element in values
