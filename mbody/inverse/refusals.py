"""Sentences of a question: where no solution was found, and what bounds one."""

from __future__ import annotations

import math

import numpy as np

from mbody.analysis.inverse.conditions import Relation
from mbody.errors import SolveError
from mbody.inverse.roots import SingularEquations
from mbody.inverse.trials import Trials
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.study import Question

__all__ = ["Refusals"]

Array = np.ndarray


class Refusals:
    """Says why a question of a mechanism has no solution, in the units of the mechanism."""

    def __init__(
        self,
        mechanism: Mechanism,
        question: Question,
        conditions: tuple[list[Relation], list[Relation]],
        trials: Trials,
    ) -> None:
        self.mechanism, self.question, self.trials = mechanism, question, trials
        self.equations, self.sides = conditions
        self.wanted = trials.wanted

    @property
    def word(self) -> str:
        """What of the objective is sought."""
        return "greatest" if self.question.greatest else "least"

    def at(self, u: float) -> str:
        """A value of the one unknown, given in steps, with its unit."""
        value, unit = self.wanted[0].shown(u, self.mechanism)
        return f"{value:.6g} {unit}".strip()

    def values(self, u: Array) -> tuple[dict[str, float], dict[str, str]]:
        """Values of the unknowns and their units, by name."""
        values, units = {}, {}
        for part, one in zip(u, self.wanted, strict=True):
            name = one.unknown.name
            values[name], units[name] = one.shown(float(part), self.mechanism)
        return values, units

    def listing(self, values: dict[str, float], units: dict[str, str]) -> str:
        """Values of the unknowns in one line."""
        parts = [f"{name} = {v:.6g} {units[name]}".strip() for name, v in values.items()]
        return ", ".join(parts)

    def side(self, side: int) -> str:
        """A side condition, or a bound, by its number."""
        return self.sides[side].text if 0 <= side < len(self.sides) else "a bound of an unknown"

    def broken(
        self, one: Relation, rest: float, values: dict[str, float], units: dict[str, str]
    ) -> str:
        """Why values that meet the conditions are no solution."""
        where = self.listing(values, units)
        return (
            f"'{one.text}' does not hold where the conditions do, at {where}: "
            f"it is short by {self._short(one, rest)}; that limit is reached first: ask for what "
            "is greatest within the side conditions"
        )

    def worst(self, u: Array | None) -> tuple[str, str]:
        """The side condition that is broken most at a place, and where that is."""
        first, last = len(self.equations), len(self.equations) + len(self.sides)
        if u is None or not self.sides:
            return "", ""
        rest, size = self._rows(u)
        worst = int(np.argmin(rest[0, first:last] / np.maximum(size[0, first:last], 1e-300)))
        one = self.sides[worst]
        short = self._short(one, float(rest[0, first + worst]))
        return one.text, f" by {short} at {self.listing(*self.values(u))}"

    def infeasible(self, text: str, where: str = "") -> str:
        """Why no values of the unknowns are allowed."""
        if not text:
            return self._unreached()
        return (
            "nothing meets all conditions and side conditions together: where the others hold "
            f"'{text}' is broken{where}; loosen one of them, or the bounds"
        )

    def nowhere(self, nearest: float, where: str) -> str:
        """Why one unknown has no value that is allowed."""
        if math.isnan(nearest):
            return self._unreached()
        text, short = self.worst(np.array([nearest]))
        name = self.wanted[0].unknown.name
        return (
            f"no value of '{name}' from {where} meets all side conditions: the nearest breaks "
            f"'{text}'{short}; loosen it, or the bounds"
        )

    def unbounded(self) -> str:
        """Why the objective has no greatest or least value."""
        return (
            f"'{self.question.objective}' has no {self.word} value: the side conditions do not "
            "bound it; add one that does"
        )

    def endless(self, u: float, edge: bool) -> str:
        """The same of one unknown: the best value is at a pole, or where the search ends."""
        way = "grows" if self.question.greatest else "falls"
        name, where = self.wanted[0].unknown.name, self.at(u)
        if edge:
            return (
                f"'{self.question.objective}' has no {self.word} value: it {way} without bound "
                f"where '{name}' reaches {where}, beyond which the mechanism cannot be analysed; "
                "add a side condition or a bound that keeps away from there"
            )
        return (
            f"'{self.question.objective}' has no {self.word} value as far as was searched: it "
            f"still {way} at '{name}' = {where}; add a side condition or a bound"
        )

    def undetermined(self, error: SingularEquations) -> SolveError:
        """Why the conditions do not determine the unknowns."""
        names = [one.unknown.name for one in self.wanted]
        weights = np.abs(error.direction)
        loose = [n for n, w in zip(names, weights, strict=True) if w > 1e-3 * weights.max()]
        texts, one = listed(self.question.conditions), len(self.question.conditions) == 1
        verb, them = ("holds", "that") if one else ("hold", "them")
        if error.solvable:
            said, why = f"{texts} {verb} for any {listed(loose)}", "nothing determines it"
        else:
            said, why = f"nothing meets {texts}", f"no value of {listed(loose)} changes {them}"
        return SolveError(f"{said}: {why}; take unknowns that they depend on")

    def no_root(self, start: Array) -> str:
        """Why no solution was found."""
        rest, _ = self._rows(start)
        names = listed(one.unknown.name for one in self.wanted)
        parts = [
            f"'{one.text}' is off by {abs(part):.4g}"
            for one, part in zip(self.equations, rest[0], strict=False)
            if np.isfinite(part)
        ]
        left = f" ({', '.join(parts)} at the start)" if parts else ""
        more = f"; the last trial said: {self.trials.refusal}" if self.trials.refusal else ""
        conditions = listed(self.question.conditions)
        return (
            f"no value of {names} was found that meets {conditions}{left}: "
            f"give another start, or wider bounds{more}"
        )

    def _rows(self, u: Array) -> tuple[Array, Array]:
        """What is left of all relations at a place, and their sizes."""
        relations = [*self.equations, *self.sides]
        return self.trials.rows(relations, self.question.objective, u[None])

    def _unreached(self) -> str:
        """Why no values of the unknowns could be analysed."""
        names = listed(one.unknown.name for one in self.wanted)
        said = self.trials.refusal
        more = f"; the last trial said: {said}" if said else ""
        return f"no value of {names} was found that can be analysed and meets the conditions{more}"

    def _short(self, one: Relation, rest: float) -> str:
        """By how much a side condition is broken, with its unit."""
        unit = one.unit(self.mechanism)
        value, unit = (math.degrees(rest), "deg") if unit == "rad" else (rest, unit)
        return f"{-value:.4g} {unit}".strip()
