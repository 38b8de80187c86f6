"""``--at NAME=LOW:HIGH:COUNT``: the same instants as values with commas."""

import json

import numpy as np
import pytest

from mbody.cli import main
from mbody.cli.parser import equal_steps


@pytest.mark.parametrize(
    ("text", "first", "last", "count"),
    [
        ("0:360:25", 0.0, 360.0, 25),
        ("5:-5:11", 5.0, -5.0, 11),
        (".1:1e-3:3", 0.1, 1e-3, 3),
        ("-1.5:1.5:4", -1.5, 1.5, 4),
    ],
)
def test_both_ends_and_equal_steps(text, first, last, count):
    values = [float(part) for part in equal_steps("--at x", text)]
    np.testing.assert_allclose(values, np.linspace(first, last, count), rtol=0, atol=1e-15 * 360)
    assert values[0] == first and values[-1] == last and len(values) == count


def test_a_unit_is_that_of_both_ends():
    for text in ("0 in:2 in:3", "0:2 in:3", "0 in:2:3"):
        assert equal_steps("--at x", text) == ["0 in", "1 in", "2 in"]
    assert equal_steps("--at x", "1 N*m:2 N*m:2") == ["1 N*m", "2 N*m"]


def answer(words, capsys):
    assert main([*words, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    return [data[key] for key in ("t", "bodies")]


@pytest.mark.parametrize(
    ("steps", "listed"),
    [
        ("crank=0:360:5", "crank=0,90,180,270,360"),
        ("crank=0 deg:90 deg:3", "crank=0,45,90"),
        ("t=0:0.1:3", "t=0,0.05,0.1"),
        ("t=0 ms:100 ms:3", "t=0,0.05,0.1"),
    ],
)
def test_the_same_as_values_with_commas(steps, listed, capsys):
    found, wanted = (
        answer(["kinematics", "norton_fourbar", "--at", at], capsys) for at in (steps, listed)
    )
    np.testing.assert_allclose(found[0], wanted[0], rtol=1e-14, atol=1e-15)
    for name, body in wanted[1].items():
        for key, values in body.items():
            np.testing.assert_allclose(found[1][name][key], values, rtol=1e-9, atol=1e-9)
