"""Model files: round trips to the last bit, text, and what cannot be written."""

import dataclasses
import json
import math
import tomllib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

import mbody
from mbody import gallery
from mbody.makers import polar
from tests.support.linkages import random_linkage, times_within
from tests.support.model_files import SCHEMA
from tests.support.model_text import model_from, text_from
from tests.support.random_machines import machines


def bits(value):
    """All that a value holds, floats to the last bit and the sign of zero."""
    if dataclasses.is_dataclass(value):
        return type(value).__name__, [
            bits(getattr(value, f.name)) for f in dataclasses.fields(value)
        ]
    if isinstance(value, dict):
        return {key: bits(part) for key, part in value.items()}
    if isinstance(value, (tuple, list)):
        return [bits(part) for part in value]
    return float(value).hex() if isinstance(value, float) else value


def whole(machine):
    elements = [
        bits(own) for own in (machine.bodies, machine.joints, machine.drivers, machine.loads)
    ]
    return [bits(machine.ground), machine.g.hex(), *elements, bits(machine.measures)]


@pytest.mark.slow
@settings(max_examples=120, suppress_health_check=list(HealthCheck))
@given(machines())
def test_any_mechanism_comes_back_to_the_last_bit(machine):
    for as_json in (False, True):
        text = text_from(machine, as_json)
        again = model_from(text, as_json)
        assert whole(again) == whole(machine)
        open_angles = {f.angle for f in again.formulas.values()}
        assert again == machine, open_angles
        assert text_from(again, as_json) == text  # and writes the same
        data = json.loads(text) if as_json else tomllib.loads(text)
        SCHEMA.validate(data)


@pytest.mark.parametrize("seed", range(5))
def test_linkages_run_alike_to_the_last_bit(seed, tmp_path):
    """Every kind of joint and load: the same numbers, in the same order, give the same bits."""
    machine, turn = random_linkage(seed, 2, sliders=seed % 2 == 0, extras=seed > 1)
    times = times_within(machine, 0.6 * turn, 4)
    run = mbody.kinetostatics(machine, t=times)
    for ending in ("toml", "json"):
        file = tmp_path / f"model.{ending}"
        mbody.save(machine, file)
        again = mbody.load(file)
        assert again == machine and whole(again) == whole(machine)
        other = mbody.kinetostatics(again, t=times)
        np.testing.assert_array_equal(other.effort("motor"), run.effort("motor"))
        for joint in machine.joints:
            for key in ("fx", "fy", "torque"):
                a, b = (getattr(r.reaction(joint.name), key) for r in (run, other))
                np.testing.assert_array_equal(a, b)


def test_text_stays_text():
    machine = gallery.load("norton_fourbar")
    text = mbody.to_toml(machine)
    for words in (
        'weight  = "1.5 lbf"',
        '"9*cos(45 deg) + 3*cos(100 deg)"',
        '"-40 rad/s^2"',
        "t = 0",
    ):
        assert words in text
    assert "rad" not in text.replace("rad/s", "")


def test_plain_radians_of_python_are_said():
    machine = mbody.Mechanism("m", parameters={"phi": 0.3})
    machine.add(
        mbody.Body("b", points={"A": polar(1.0, "2*phi")}), mbody.Revolute("O", "ground", "b")
    )
    machine.add(mbody.AngleDriver("d", "b", "0.3*sin(2*t)"))
    text = mbody.to_toml(machine)
    assert 'angle = "rad"' in text and mbody.from_toml(text) == machine
    # beside plain degrees of a file, what is in radians says so
    mixture = mbody.from_toml(
        'parameters = { phi = 3 }\n[bodies.c]\npoints.A = { r = 1, angle = "phi" }'
    )
    mixture.add(mbody.Body("b", points={"A": polar(1.0, "2*phi")}))
    again = mbody.from_toml(mbody.to_toml(mixture))
    assert again["b"].points["A"].angle == 6.0
    assert again["c"].points["A"].angle == math.radians(3.0)
