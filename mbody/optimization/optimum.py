"""The best design that was found, and how much it can be trusted and moved."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from mbody.core.presentation import Presented
from mbody.core.tolerances import OPTIMUM_MARGIN_NONE
from mbody.files.model.other_numbers import described_with, same_number
from mbody.model.mechanism import Mechanism
from mbody.solution.declared_result import ColumnTable, ItemTable, Sentence, Value
from mbody.solution.doubts import Inherited
from mbody.solution.histories import link_poses
from mbody.solution.solution import Solution
from mbody.summaries.text_table import number
from mbody.system.assembler import assemble

# -- A mechanism with the numbers of a design, as a model file would have them -----------------

#: Digits of a guess, which only chooses the branch.
GUESS_DIGITS = 4


def _described(run: Solution, values: Mapping[str, float]) -> Mechanism:
    """The mechanism of a result with other numbers, guesses at its first position."""
    poses = link_poses(run.take([0]))
    size = max((abs(part) for x, y, _ in poses.values() for part in (x, y)), default=0.0)
    guesses = {
        name: (_rough(x, size), _rough(y, size), math.radians(_rough(math.degrees(angle), 360.0)))
        for name, (x, y, angle) in poses.items()
    }
    return described_with(run.mechanism, {**_overridden(run), **values}, guesses)


def _rough(value: float, size: float) -> float:
    """A number of a guess to a few digits, by the greatest of its kind.

    >>> _rough(0.123456789, 20.0), _rough(1e-17, 20.0)
    (0.12, 0.0)
    """
    return round(value, GUESS_DIGITS - math.ceil(math.log10(size))) + 0.0 if size else value


def _overridden(run: Solution) -> dict[str, float]:
    """Numbers of the system of a result that its description does not have, formulas aside."""
    system, described = run.system, assemble(run.mechanism).values
    own = {name: float(value) for name, value in system.values.items() if name in described}
    return {
        name: value
        for name, value in own.items()
        if name not in system.formulas and not same_number(described[name], value)
    }


@dataclass(frozen=True)
class Active(Presented):
    """A limit, or a bound of a number, that holds the optimum back.

    `constraint`: Its text.
    `multiplier`: By how much the objective gets better if the limit gives way by one unit, at first
      order.
    `unit`: Of the multiplier.
    `t`: The instant at which it binds; None of bounds and of what all instants make.
    """

    constraint: str
    multiplier: float
    unit: str
    t: float | None


@dataclass(frozen=True)
class ParetoPoint(Presented):
    """One of the designs of which none is better in both aims.

    `values`: By number.
    """

    objective: tuple[float, ...]
    values: dict[str, float]


def _aim(n: int) -> Callable[[ParetoPoint], float]:
    return lambda one: one.objective[n]


def _aims(found: Optimum) -> list[str]:
    """The objectives, before and after."""
    several = isinstance(found.objective, tuple)
    values = found.objective if several else (found.objective,)
    before: Any = found.start_objective if several else (found.start_objective,)
    if found.start_objective is None:
        before = (None,) * len(values)
    return [
        f"{aim} = {number(value)} {unit}".rstrip()
        + (f", before {number(old)}" if old is not None else "")
        for (aim, unit), value, old in zip(found.aims, values, before, strict=True)
    ]


@dataclass(frozen=True, eq=False, repr=False)
class Optimum(Inherited, Presented):
    """Result of `mbody.optimize`.

    `aim`: What is least or greatest, in words.
    `aims` (str, str): The same of each aim, with its unit.
    `objective`, `start_objective`: Its value at the optimum and of the description; None where that
      cannot be analysed. Of two aims tuples.
    `values`, `start_values`: The numbers by name, in the units of the mechanism, angles in rad.
    `units`: Their units; ``"objective"`` has that of the objective, of two aims both, with a comma.
    `bounds`: By number its lowest and greatest value.
    `constraints`: By text the margin with which each limit holds.
    `active`: What binds, with multipliers.
    `starts`, `agreeing`: Searches that ended, and those that ended at this value.
    `evaluations`: Analyses with derivatives.
    `band`: By number from where to where it may go alone, the others held, while the objective gets
      no worse than by the part `loss` of its size and no limit is broken by more than that part.
    `written`: The numbers with the digits that matter, as `save` writes them: with them the limits
      hold as at the optimum, and the objective gets worse by a small part of `loss` at most.
    `pareto`: Of two aims, by the first one; otherwise empty.
    `run`: The analysis of the optimum.
    `case`: Its name, where there are several.
    """

    aim: str
    aims: tuple[tuple[str, str], ...]
    objective: Any
    start_objective: Any
    values: dict[str, float]
    start_values: dict[str, float]
    units: dict[str, str]
    bounds: dict[str, tuple[float, float]]
    constraints: dict[str, float]
    active: tuple[Active, ...]
    starts: int
    agreeing: int
    evaluations: int
    band: dict[str, tuple[float, float]]
    loss: float
    pareto: tuple[ParetoPoint, ...]
    run: Solution
    case: str = ""
    written: dict[str, float] = field(default_factory=dict)
    _cache: dict[str, Mechanism] = field(default_factory=dict)

    about_text = "{0.case}"

    @property
    def declared(self) -> tuple[Any, ...]:
        """Aims, numbers, limits, what binds, and the front."""
        front = [
            Value("", f"{aim} [{unit}]" if unit else aim, "each", _aim(n))
            for n, (aim, unit) in enumerate(self.aims)
        ]
        return (
            "aim objective start_objective units",
            Sentence(_aims),
            ColumnTable(
                (
                    Value("", "before", "each", "start_values"),
                    Value("values", "optimum", "each"),
                    Value("", "unit", "text", "units"),
                    Value("", f"band from ({self.loss:.3g})", "each", lambda one: one.band_ends(0)),
                    Value("", "to", "each", lambda one: one.band_ends(1)),
                ),
                "NUMBERS",
            ),
            ColumnTable(
                (Value("constraints", "margin", "each", floor=OPTIMUM_MARGIN_NONE),), "LIMITS"
            ),
            ItemTable(
                "active",
                (
                    Value("constraint", "BINDS", "text"),
                    Value("multiplier", "per unit", "each"),
                    Value("unit", "unit", "text"),
                    Value("t", "at t", "time"),
                ),
            ),
            "starts agreeing evaluations band loss pareto",
            ItemTable("", tuple(front), "FRONT", lambda one: dict(enumerate(one.pareto))),
            Sentence(
                lambda one: (
                    f"{one.agreeing} of {one.starts} searches ended "
                    + ("at the ends of the front" if one.pareto else "here")
                    + f"; {one.evaluations} analyses with derivatives"
                )
            ),
            "status notes",
        )

    def band_ends(self, end: int) -> dict[str, float]:
        """Lower (0) or upper (1) ends of the bands."""
        return {name: pair[end] for name, pair in self.band.items()}

    def __post_init__(self) -> None:
        kept = self._cache
        super().__post_init__()
        object.__setattr__(self, "_cache", kept)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism with the numbers of the optimum, guesses at its first position.

        Raises
        ------
        ModelError
            Where no model file can have such a mechanism; `run.system` is the optimum all the same.
        """
        if "whole" not in self._cache:
            self._cache["whole"] = _described(self.run, self.values)
        return self._cache["whole"]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mechanism as a model file, with the numbers of `written`: of a model that was
        read from TOML all else stays as it was, comments, order and units.
        """
        from mbody.files.model import save

        save(_described(self.run, self.written or self.values), path)

    def __repr__(self) -> str:
        return f"Optimum({self.aim}: {self.objective}, {self.agreeing} of {self.starts} starts)"
