"""Known mechanisms: model files that are part of mbody, with the numbers of their sources."""

from __future__ import annotations

import atexit
import contextlib
import functools
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.quantities.formula import Number

__all__ = ["load", "model_path", "names", "path"]

LISTED = "'mbody models' lists all, in Python mbody.gallery.names()"


def names() -> tuple[str, ...]:
    """The names of all models, in alphabetical order.

    >>> names()[:2]
    ('andrews_squeezer', 'bouncing_ball')
    """
    files = (file.name for file in resources.files(__name__).iterdir())
    return tuple(sorted(name[:-5] for name in files if name.endswith(".toml")))


@functools.cache
def path(name: str) -> Path:
    """The file of a model, to read or to copy.

    Raises
    ------
    ModelError
        For an unknown name.

    >>> path("hoekens").name
    'hoekens.toml'
    """
    if name not in names():
        from mbody.core.other_words import meant

        beside = [file.name for end in ("toml", "json") for file in Path().glob(f"*.{end}")]
        close = meant(name, [*names(), *beside])
        hint = f"did you mean '{close}'?" if close else LISTED
        raise ModelError(f"the gallery has no model {str(name)[:60]!r}: {hint}")
    file = resources.files(__name__) / f"{name}.toml"
    kept = contextlib.ExitStack()
    atexit.register(
        kept.close
    )  # in a zip file the package needs a temporary copy, removed at the end
    return kept.enter_context(resources.as_file(file))


def model_path(model: str) -> Path:
    """The file of a model: one that exists, else one of the gallery.

    Raises
    ------
    ModelError
        Where there is neither.

    >>> model_path("hoekens").name
    'hoekens.toml'
    """
    file = Path(model)
    looks_like_a_file = file.suffix in (".toml", ".json") or len(file.parts) > 1
    if looks_like_a_file or model not in names():
        try:
            there = file.exists()
        except (OSError, ValueError):
            there = False
        if there or looks_like_a_file:
            return file
    return path(model)


def load(name: str, parameters: Mapping[str, Number] | None = None) -> Mechanism:
    """The mechanism of a model of the gallery.

    Parameters
    ----------
    name : str
        One of `names()`.
    parameters : mapping, optional
        Other values for parameters of the model, numbers or text with units.

    Raises
    ------
    ModelError
        For an unknown name, or an unknown parameter of the model.

    >>> load("rotating_mass", {"m": "5 lb"})["link"].mass
    2.26796185
    """
    from mbody.files import model  # imported here, so that the names do not need the reader

    return model.load(path(name), parameters)
