"""Dotted names of the numbers of a system that there are not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.user_physics import is_plain_field, plain_field

__all__ = ["no_such_number"]


def no_such_number(name: str, machine: Mechanism, values: Mapping[str, Any]) -> str:
    """The sentence of a name that is none of the numbers of a system."""
    element, _, key = name.partition(".")
    if element in machine and is_plain_field(machine[element], key):
        return plain_field(machine[element], key)
    own = [known for known in values if known.partition(".")[0] == element]
    if own:
        return f"there is no number '{name}' to change (there are: {listed(own)})"
    owners = dict.fromkeys(known.partition(".")[0] for known in values)
    return f"there is no number '{name}' to change (there are numbers of: {listed(owners)})"
