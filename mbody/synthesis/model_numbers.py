"""A mechanism with other numbers, as a description that can be written to a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from mbody.errors import ModelError
from mbody.files.model import from_toml, to_toml
from mbody.live.file_numbers import CutFile, file_numbers
from mbody.model.closed_mechanism import with_others
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.study import Instants

__all__ = ["NumberedModel"]


class NumberedModel:
    """The file of a mechanism in which some numbers can be set.

    Raises
    ------
    ModelError
        For a mechanism that no file can contain, and for numbers that no single number of its file
        makes.
    """

    def __init__(self, mechanism: Mechanism, names: Sequence[str]) -> None:
        self.mechanism = mechanism
        self.file: CutFile = file_numbers(mechanism, list(names))
        there = {name for number in self.file.numbers for name in number.factors}
        if missing := [name for name in names if name not in there]:
            raise ModelError(
                f"synthesize: {listed(missing)} is not one number of the file of "
                f"'{mechanism.name}': give it one of its own, or a parameter",
                missing[0],
            )

    def mechanism_with(
        self, values: Mapping[str, float], guesses: Mapping[str, Any], ask: Instants
    ) -> Mechanism:
        """The mechanism with other numbers, first poses and instants that it asks for."""
        text = self.file.parts[0]
        for number, part in zip(self.file.numbers, self.file.parts[1:], strict=True):
            name, factor = next(iter(number.factors.items()))
            text += repr(values[name] / factor) + part
        made = from_toml(text)
        bodies = [replace(body, guess=guesses[body.name]) for body in made.bodies]
        posed = with_others(made, set(), bodies)
        posed.ask = ask
        return from_toml(to_toml(posed))
