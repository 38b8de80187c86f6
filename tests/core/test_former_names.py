"""Former names end in a sentence with the new one, wherever they are written."""

import importlib

import pytest

import mbody
from mbody import ModelError
from mbody.core.former_names import FORMER, former

PENDULUM = """
[bodies.arm]
mass = 1
cg = [1, 0]
[joints]
O = { revolute = ["ground", "arm"] }
"""


def written(name: str) -> object:
    home, _, last = name.rpartition(".")
    return getattr(importlib.import_module(home), last)


def test_a_former_public_name_says_where_it_is_now():
    for name, now in FORMER.items():
        if name.startswith("mbody."):
            with pytest.raises(AttributeError, match=now.replace(".", r"\.")):
                written(name)
            assert written(now) is not None


def test_former_arguments_and_keys():
    with pytest.raises(ModelError, match=r"machine.add\(mbody.Input"):
        mbody.Mechanism(inputs={"u": 0})
    with pytest.raises(ModelError, match=r"mbody.Stop\(.*event with stop = true"):
        mbody.simulate(mbody.from_toml(PENDULUM), 1.0, stops=[])
    with pytest.raises(ModelError, match=r"\[contacts\] floor = "):
        mbody.from_toml(PENDULUM + "[simulate]\nstops = { floor = 'arm.y' }\n")
    with pytest.raises(ModelError, match="now it is centrifugal_field"):
        mbody.from_toml(PENDULUM + "[loads]\nf = { rotating_field = {}, speed = 1 }\n")


def test_a_name_that_never_was_has_pythons_own_sentence():
    assert former("mbody.nothing") is None
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = mbody.nothing
