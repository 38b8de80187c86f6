"""A mechanism with the numbers of a design, as a model file would have them."""

from __future__ import annotations

import itertools
import math
import tomllib
import warnings
from collections.abc import Mapping

import numpy as np

from mbody.errors import ModelError, ModelWarning
from mbody.files.model import from_toml
from mbody.files.model.toml import toml
from mbody.live.file_numbers import file_numbers
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.solution.places import link_poses
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble

__all__ = ["with_numbers"]

#: Numbers that a file gives agree with those of the design to this part.
SAME = 1e-9


def with_numbers(run: Solution, values: Mapping[str, float]) -> Mechanism:
    """The mechanism of a result with other numbers, guesses at its first position.

    Raises
    ------
    ModelError
        For numbers that its file does not have as such.
    """
    machine = run.mechanism
    cut = file_numbers(machine, list(values))
    given: dict[str, float] = {}
    for number in cut.numbers:
        for name, factor in number.factors.items():
            given[name] = values[name] / factor
    missing = [name for name in values if name not in given]
    if missing:
        raise ModelError(
            f"the model file of '{machine.name}' has no number of its own for {listed(missing)}: "
            "name a parameter for it; run.system has the numbers of the optimum",
            missing[0],
        )
    texts = [repr(float(next(given[name] for name in number.factors))) for number in cut.numbers]
    text = "".join(
        part + (number or "") for part, number in itertools.zip_longest(cut.parts, texts)
    )
    tree = tomllib.loads(text)
    for name, (x, y, angle) in link_poses(run.take([0])).items():
        if name in tree["bodies"]:
            shown = f"{math.degrees(angle)!r} deg"
            tree["bodies"][name]["guess"] = {"x": x, "y": y, "angle": shown}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        made = from_toml(toml(tree))
    _check(made, values)
    return made


def _check(made: Mechanism, values: Mapping[str, float]) -> None:
    found = assemble(made).values
    for name, value in values.items():
        if not np.isclose(float(found[name]), value, rtol=SAME, atol=0.0):
            raise ModelError(
                f"the model file of '{made.name}' makes '{name}' of a number that gives others "
                "too: give it one of its own; run.system has the numbers of the optimum",
                name,
            )
