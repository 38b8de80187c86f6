"""Find the model that a command names, with the requested parameters and units."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.usage import UsageError
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism

__all__ = ["named_values", "path_of", "model_of"]


def model_of(args: Any) -> Mechanism:
    """The mechanism that the arguments name.

    Raises
    ------
    ModelError
        Where there is no such model, or it is none.
    """
    from mbody.files.model import in_units, load

    mechanism = load(path_of(args.model), parameters=named_values(args.set, "--set"))
    return in_units(mechanism, args.units) if args.units else mechanism


def path_of(model: str) -> Path:
    """The file of a model: one that exists, else one of the gallery."""
    from mbody import gallery

    path = Path(model)
    looks_like_a_file = path.suffix in (".toml", ".json") or len(path.parts) > 1
    if looks_like_a_file or model not in gallery.names():
        try:
            there = path.exists()
        except (OSError, ValueError):
            there = False
        if there or looks_like_a_file:
            return path
    return gallery.path(model)


def named_values(texts: Sequence[str], option: str) -> dict[str, Any]:
    """``["a=2", "b=3 mm"]`` as a mapping of texts.

    >>> named_values(["a=2", "b=3 mm"], "--set")
    {'a': '2', 'b': '3 mm'}
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        name, value = name.strip(), value.strip()
        if not sign or not name or not value:
            raise UsageError(f"{option} takes NAME=VALUE, not {text[:60]!r}")
        if name in found:
            raise ModelError(f"{option} gives '{name}' twice: give it once", name)
        found[name] = value
    return found
