"""The best design that was found, and how much it can be trusted and moved."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

from mbody.core.presentation import present
from mbody.model.mechanism import Mechanism
from mbody.optimization.design_file import with_numbers
from mbody.solution.doubts import Inherited
from mbody.solution.solution import Solution
from mbody.system.read_only import lock

__all__ = ["Active", "Optimum", "ParetoPoint"]


@dataclass(frozen=True)
class Active:
    """A limit, or a bound of a number, that holds the optimum back.

    Attributes
    ----------
    constraint : str
        Its text.
    multiplier : float
        By how much the objective gets better if the limit gives way by one unit, at first order.
    unit : str
        Of the multiplier.
    t : float or None
        The instant at which it binds; None of bounds and of what all instants make.
    """

    constraint: str
    multiplier: float
    unit: str
    t: float | None

    def data(self) -> dict[str, Any]:
        """``{"constraint", "multiplier", "unit", "t"}``."""
        return {
            "constraint": self.constraint,
            "multiplier": self.multiplier,
            "unit": self.unit,
            "t": self.t,
        }


@dataclass(frozen=True)
class ParetoPoint:
    """One of the designs of which none is better in both aims.

    Attributes
    ----------
    objective : tuple of float
    values : dict
        By number.
    """

    objective: tuple[float, ...]
    values: dict[str, float]

    def data(self) -> dict[str, Any]:
        """``{"objective": [a, b], "values"}``."""
        return {"objective": list(self.objective), "values": dict(self.values)}


@dataclass(frozen=True, eq=False, repr=False)
class Optimum(Inherited):
    """What `mbody.optimize` found.

    Attributes
    ----------
    aim : str
        What is least or greatest, in words.
    aims : tuple of (str, str)
        The same of each aim, with its unit.
    objective, start_objective : float
        Its value at the optimum and of the description; None where that cannot be analysed. Of two
        aims tuples.
    values, start_values : dict
        The numbers by name, in the units of the mechanism, angles in rad.
    units : dict
        Their units; ``"objective"`` has that of the objective, of two aims both, with a comma.
    bounds : dict
        By number its lowest and greatest value.
    constraints : dict
        By text the margin with which each limit holds.
    active : tuple of Active
        What binds, with multipliers.
    starts, agreeing : int
        Searches that ended, and those that ended at this value.
    evaluations : int
        Analyses with derivatives.
    band : dict
        By number from where to where it may go alone, the others held, while the objective gets no
        worse than by the part `loss` of its size and no limit is broken by more than that part.
    loss : float
    pareto : tuple of ParetoPoint
        Of two aims, by the first one; otherwise empty.
    run : Solution
        The analysis of the optimum.
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
    _kept: dict[str, Mechanism] = field(default_factory=dict)

    def __post_init__(self) -> None:
        kept = self._kept
        lock(self)
        object.__setattr__(self, "_kept", kept)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism with the numbers of the optimum, guesses at its first position.

        Raises
        ------
        ModelError
            Where no model file can have such a mechanism; `run.system` is the optimum all the same.
        """
        if "whole" not in self._kept:
            self._kept["whole"] = with_numbers(self.run, self.values)
        return self._kept["whole"]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mechanism as a model file."""
        from mbody.files.model import save

        save(self.mechanism, path)

    def data(self) -> dict[str, Any]:
        """As plain dicts: a case of ``mbody optimize --json``."""
        many = isinstance(self.objective, tuple)
        return {
            "aim": self.aim,
            "objective": list(self.objective) if many else self.objective,
            "start_objective": list(self.start_objective)
            if isinstance(self.start_objective, tuple)
            else self.start_objective,
            "values": dict(self.values),
            "units": dict(self.units),
            "constraints": dict(self.constraints),
            "active": [one.data() for one in self.active],
            "starts": self.starts,
            "agreeing": self.agreeing,
            "evaluations": self.evaluations,
            "band": {name: list(pair) for name, pair in self.band.items()},
            "loss": self.loss,
            "pareto": [one.data() for one in self.pareto],
            "status": self.status,
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        return str(present("sheet", self))

    def __repr__(self) -> str:
        return f"Optimum({self.aim}: {self.objective}, {self.agreeing} of {self.starts} starts)"
