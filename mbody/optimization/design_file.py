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
    values = {**_overridden(run), **values}
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
    _check(made, {**run.system.values, **values}, list(values))
    return made


def _overridden(run: Solution) -> dict[str, float]:
    """Numbers of the system of a result that its description does not have, formulas aside."""
    system, described = run.system, assemble(run.mechanism).values
    own = {name: float(value) for name, value in system.values.items() if name in described}
    return {
        name: value
        for name, value in own.items()
        if name not in system.formulas and not _same(float(described[name]), value)
    }


def _same(one: float, other: float) -> bool:
    return bool(np.isclose(one, other, rtol=SAME, atol=0.0))


def _check(made: Mechanism, values: Mapping[str, float], named: list[str]) -> None:
    """Refuse a mechanism whose numbers are not those of the result; `named` are of the design."""
    found = assemble(made).values
    wrong = [name for name, value in values.items() if not _same(float(found[name]), value)]
    if not wrong:
        return
    changed = [name for name in named if name in wrong] or named
    others = listed([name for name in wrong if name not in changed][:3])
    also = f" ({others})" if changed != wrong else ""
    raise ModelError(
        f"the model file of '{made.name}' makes {listed(changed)} of a number that gives others "
        f"too{also}: give it one of its own; run.system has the numbers of the optimum",
        changed[0],
    )
