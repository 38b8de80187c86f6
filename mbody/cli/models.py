"""Find the model that a command names, with the requested parameters and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.usage import UsageError
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism

__all__ = ["model_of", "model_in", "named_values", "path_of"]


def model_of(args: Any) -> Mechanism:
    """The mechanism that the arguments name.

    Raises
    ------
    ModelError
        Where there is no such model, or it is none.
    """
    from mbody.files.model import in_units

    mechanism = model_in(path_of(args.model), named_values(args.set, "--set"))
    return in_units(mechanism, args.units) if args.units else mechanism


def model_in(path: Path, parameters: Mapping[str, str] | None = None) -> Mechanism:
    """The mechanism of a file, with other values of its parameters.

    Raises
    ------
    ModelError
        As of `load`; for a file of another program with the command that imports it.
    """
    from mbody.files.model import load

    try:
        return load(path, parameters=parameters or {})
    except ModelError:
        from mbody.exchange import other_program  # which takes as long to load as an analysis

        if whose := other_program(path):
            raise ModelError(
                f"'{path.name}' is a file of {whose}, not a model: make one of it, mbody import "
                f"{path.name} -o {path.stem}.toml"
            ) from None
        raise


def path_of(model: str) -> Path:
    """The file of a model: one that exists, else one of the gallery."""
    from mbody.gallery import model_path

    return model_path(model)


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
