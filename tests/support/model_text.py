"""Models as text in both forms of a model file."""

from typing import Any

from mbody.files.model.read import from_json, from_toml
from mbody.files.model.write import to_json, to_toml
from mbody.model.mechanism import Mechanism

__all__ = ["model_from", "text_from"]


def text_from(machine: Mechanism, as_json: bool) -> str:
    """The mechanism as JSON or as TOML."""
    return to_json(machine) if as_json else to_toml(machine)


def model_from(text: str, is_json: bool, **options: Any) -> Mechanism:
    """The mechanism of a text in JSON or in TOML."""
    return from_json(text, **options) if is_json else from_toml(text, **options)
