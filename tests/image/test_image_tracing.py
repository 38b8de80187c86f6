"""Traced numbers: programs that the core runs give what NumPy gives; what decides is refused."""

import math

import numpy as np
import pytest

from mbody.core.recorded_numbers import Untraceable
from mbody.laws.kernels import LOG
from mbody.solution.traced_instant import CODES, Recording, Rule

UNARY = [name for name, code in CODES.items() if code <= LOG]


def recorded(**values):
    return Recording({name: Rule(value) for name, value in values.items()})


def evaluated(program):
    """What the operations give, one after the other, by plain Python: the core is another route."""
    slots, inverse = program.slots.copy(), {code: name for name, code in CODES.items()}
    with np.errstate(all="ignore"):
        for code, a, b, to in program.operations:
            name = inverse[code]
            arguments = (slots[a],) if name in UNARY else (slots[a], slots[b])
            slots[to] = getattr(np, name)(*arguments)
    return slots[program.targets]


def test_arrays_of_objects_are_followed_element_by_element():
    recording = recorded(x=2.0, y=3.0)
    a = np.array(list(recording.inputs.values()), dtype=object)
    plain = np.array([2.0, 3.0])
    for function in (np.cos, np.sqrt, np.negative):
        assert np.array_equal(evaluated(recording.program(list(function(a)))), function(plain))
    both = np.hypot(a, a[0]) * np.array([1.0, 2.0]) + a
    assert np.array_equal(
        evaluated(recording.program(list(both))), np.hypot(plain, 2.0) * [1.0, 2.0] + plain
    )
    with_array = np.array([1.0, 2.0]) + a[0]
    assert np.array_equal(evaluated(recording.program(list(with_array))), [3.0, 4.0])


def test_constants_are_folded_and_operations_shared():
    recording = recorded(x=1.5)
    x = recording.inputs["x"]
    same = [np.cos(x) * 2.0, 2.0 * np.cos(x), np.cos(x) * recording.constant(2.0), x * 1.0 + 0.0]
    program = recording.program(same)
    assert len(program.operations) == 2 and len(set(program.targets.tolist())) == 2
    assert program.targets[3] == 0
    folded = recording.constant(4.0)
    assert len(recording.program([np.sqrt(folded) + folded * folded]).operations) == 0


def test_what_is_not_wanted_is_left_out():
    recording = recorded(x=1.5)
    x = recording.inputs["x"]
    kept = x + 1.0
    for n in range(50):
        x = np.sin(x + n)
    assert len(recording.program([kept]).operations) == 1


@pytest.mark.parametrize("differ", [5e-324, 1e-300, 1e-8, 1.0, 1e300])
def test_the_smallest_difference_decides(differ):
    recording = recorded(x=differ)
    x = recording.inputs["x"]
    found = evaluated(recording.program([np.greater(x, 0.0), np.less(x, 0.0), np.sign(-x)]))
    assert found.tolist() == [1.0, 0.0, -1.0]


REFUSED = {
    "float": float,
    "int": int,
    "math": math.sin,
    "if": lambda x: 1.0 if x > 2.0 else 0.0,
    "equal": lambda x: x == 1.0,
    "at most": lambda x: x <= 1.0,
    "remainder": lambda x: x % 2.0,
    "floor": np.floor,
    "any": lambda x: np.any([x, x]),
    "where": lambda x: np.where(x > 1.0, x, 1.0),
    "array of floats": lambda x: np.array([x], dtype=float),
    "max": lambda x: max(x, 1.0),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_needs_a_value_is_refused(name):
    with pytest.raises(Untraceable):
        REFUSED[name](recorded(x=1.5).inputs["x"])


def test_numbers_of_two_recordings_do_not_meet():
    with pytest.raises(Untraceable, match="two recordings"):
        recorded(x=1.0).inputs["x"] + recorded(x=1.0).inputs["x"]


def test_rules_become_bounds():
    recording = Recording(
        {"a": Rule(1.0, "positive"), "b": Rule(0.0, "not negative"), "c": Rule(-1.0)}
    )
    program = recording.program(list(recording.inputs.values()))
    assert program.lowest.tolist() == [0.0, 0.0, -1e300]
    assert program.strict.tolist() == [1, 0, 1]
    assert program.slots.tolist() == [1.0, 0.0, -1.0]
