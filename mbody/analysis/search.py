"""The search for the unknowns of a question."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Sequence

import numpy as np

from mbody.analysis.answers import Answer, Found
from mbody.analysis.relations import Relation, check_question, relations
from mbody.analysis.roots import HOLDS, Affine, Singular, affine, newton, scan, spread
from mbody.analysis.trials import Trials
from mbody.elements import listed
from mbody.errors import ModelError, SolveError
from mbody.mechanism import Mechanism
from mbody.questions import Question

__all__ = ["Search"]

Array = np.ndarray
#: A place with all rows about it.
Corner = tuple[Affine, tuple[int, ...]]

#: Starts of a search in several unknowns, and how many in a row may find nothing new.
STARTS, IDLE = 40, 16
#: Combinations of side conditions that are tried.
MOST = 2000
#: Two solutions nearer than this, in steps of the unknowns, are one.
SAME = 1e-6


class Search:
    """Finds what meets the conditions of one question of one mechanism."""

    def __init__(self, mechanism: Mechanism, question: Question) -> None:
        check_question(mechanism, question)
        self.mechanism, self.question = mechanism, question
        self.equations, self.sides = relations(question)
        self.trials = Trials(mechanism, question)
        self.wanted = self.trials.wanted

    def rows(self, us: Array) -> tuple[Array, Array]:
        """What is left of conditions, then of side conditions, then the objective."""
        return self.trials.rows([*self.equations, *self.sides], self.question.objective, us)

    def answer(self) -> Answer:
        """All solutions."""
        straight = affine(self.rows, self.trials.start) if self.trials.steady else None
        places = self._straight(straight) if straight else self._curved()
        found, why = [], ""
        for place in places:
            try:
                found.append(self._found(place))
            except (ModelError, SolveError) as error:
                why = why or str(error)
        if not found:
            raise SolveError(why)
        return Answer(self.mechanism, self.question, tuple(found), straight is not None)

    # -- places -------------------------------------------------------------------------------

    def _actives(self) -> list[tuple[int, ...]]:
        """Rows that are to be zero together: all conditions, and side conditions that bind."""
        count, first = len(self.wanted) - len(self.equations), len(self.equations)
        base = tuple(range(first))
        if math.comb(len(self.sides), count) > MOST:
            raise ModelError(
                f"{len(self.sides)} side conditions of which {count} bind are more combinations "
                f"than {MOST}: leave out some"
            )
        chosen = itertools.combinations(range(first, first + len(self.sides)), count)
        return [base + more for more in chosen]

    def _straight(self, straight: Affine) -> list[Affine]:
        """Of linear questions: the one solution, or the best corner."""
        if not self.question.objective:
            rows = tuple(range(len(self.equations)))
            try:
                u = straight.solve(rows)
            except Singular as error:
                raise self._singular(error) from None
            return [self._refined(straight, u, rows)]
        corners = []
        for rows in self._actives():
            with contextlib.suppress(Singular):
                u = straight.solve(rows)
                corners.append((Affine(u, straight(u), straight.slope, straight.size), rows))
        best, rows = self._best(corners)
        return [self._refined(straight, best.base, rows)]

    def _refined(self, straight: Affine, u: Array, rows: Sequence[int]) -> Affine:
        """The solution, corrected by what is left of the rows there."""
        for _ in range(2):
            rest, _ = self.rows(u[None])
            if not np.isfinite(rest).all():
                break
            u = Affine(u, rest[0], straight.slope, straight.size).solve(rows)
        return Affine(u, straight(u), straight.slope, straight.size)

    def _curved(self) -> list[Affine]:
        """Of other questions: all that Newton's method finds from several starts."""
        if not self.question.objective:
            return self._roots(range(len(self.equations)))
        corners = []
        for rows in self._actives():
            arrived = newton(self.rows, rows, self.trials.start)
            if arrived is not None:
                corners.append((arrived, rows))
        return [self._best(corners)[0]]

    def _roots(self, rows: Sequence[int]) -> list[Affine]:
        """Solutions from several starts, the nearest to the first one first."""
        start, grids = self.trials.start, [one.grid for one in self.wanted]
        starts = [start]
        if len(grids) == 1:
            starts += scan(self.rows, rows[0], grids[0], start[0])
        else:
            starts += list(spread(grids, STARTS))
        found: list[Affine] = []
        idle = 0
        for one in starts:
            arrived = newton(self.rows, rows, one)
            if arrived is not None:
                arrived = self._unwound(arrived, rows)
            if arrived is not None and self._is_new(arrived.base, found):
                found.append(arrived)
                idle = 0
            else:
                idle += 1
            if len(grids) > 1 and idle > IDLE:
                break
        if not found:
            raise SolveError(self._nothing(start))
        if len(found) > 1 and not all(
            any(place.slope[k].any() for place in found) for k in rows
        ):  # a condition that holds everywhere
            raise self._singular(Singular(np.ones(len(start)), True))
        return sorted(found, key=lambda place: float(np.abs(place.base - start).sum()))

    def _unwound(self, place: Affine, rows: Sequence[int]) -> Affine:
        """The same without whole turns of drivers, where they make no difference."""
        u = np.array([one.unwound(part) for one, part in zip(self.wanted, place.base, strict=True)])
        if (u == place.base).all():
            return place
        rest, _ = self.rows(u[None])
        index = list(rows)
        same = (np.abs(rest[0][index]) <= SAME * place.size[index]).all()
        return (newton(self.rows, rows, u) if same else None) or place

    def _is_new(self, u: Array, found: list[Affine]) -> bool:
        """Whether a place lies within the bounds and is not among those found."""
        if not all(one.allows(part) for one, part in zip(self.wanted, u, strict=True)):
            return False
        for place in found:
            pairs = zip(self.wanted, u, place.base, strict=True)
            if all(one.apart(a, b) <= SAME * (1.0 + abs(a)) for one, a, b in pairs):
                return False
        return True

    def _best(self, corners: list[Corner]) -> Corner:
        """The corner where the objective is greatest or least among those that are allowed.

        There the slope of the objective is a sum of those of the binding rows, each with the sign
        that keeps it from growing inwards (the conditions of Karush, Kuhn and Tucker).
        """
        sign = 1.0 if self.question.greatest else -1.0
        first, last = len(self.equations), len(self.equations) + len(self.sides)
        best: tuple[float, Affine, tuple[int, ...]] | None = None
        allowed, nearest = False, (math.inf, "")
        for place, rows in corners:
            margins = place.rest[first:last] / np.maximum(place.size[first:last], 1e-300)
            worst = int(margins.argmin())
            if not margins[worst] >= -HOLDS:
                nearest = min(nearest, (-float(margins[worst]), self.sides[worst].text))
                continue
            allowed = True
            pulls, *_ = np.linalg.lstsq(place.slope[list(rows)].T, sign * place.slope[-1])
            if (pulls[first:] > HOLDS * np.abs(pulls).max(initial=0.0)).any():
                continue
            if best is None or sign * place.rest[-1] > best[0]:
                best = (sign * float(place.rest[-1]), place, rows)
        if best is None:
            raise SolveError(self._unbounded() if allowed else self._infeasible(nearest[1]))
        return best[1], best[2]

    # -- results and sentences ----------------------------------------------------------------

    def _found(self, place: Affine) -> Found:
        """The solution at a place.

        Raises
        ------
        SolveError
            Where a side condition is broken, or the analysis fails.
        """
        run = self.trials.run(place.base)
        rest = self.trials.told(run, [*self.equations, *self.sides], self.question.objective)
        first, last = len(self.equations), len(self.equations) + len(self.sides)
        values, units = self._told(place.base)
        margins: dict[str, float] = {}
        binding = []
        for n, one in enumerate(self.sides, start=first):
            margins[one.text] = min(margins.get(one.text, math.inf), float(rest[n]))
            if abs(rest[n]) <= HOLDS * place.size[n]:
                binding.append(one.text)
            elif rest[n] < 0.0:
                raise SolveError(self._broken(one, float(rest[n]), values, units))
        return Found(
            unknowns=values,
            units=units,
            conditions={one.text: float(rest[n]) for n, one in enumerate(self.equations)},
            side_conditions=margins,
            binding=tuple(dict.fromkeys(binding)),
            objective=float(rest[last]) if self.question.objective else None,
            residual=float(np.max(np.abs(rest[:first]) / (place.size[:first] + 1e-300), initial=0)),
            run=run,
        )

    def _told(self, u: Array) -> tuple[dict[str, float], dict[str, str]]:
        """Values of the unknowns and their units, by name."""
        values, units = {}, {}
        for part, one in zip(u, self.wanted, strict=True):
            name = one.unknown.name
            values[name], units[name] = one.told(float(part), self.mechanism)
        return values, units

    def _where(self, values: dict[str, float], units: dict[str, str]) -> str:
        parts = [f"{name} = {v:.6g} {units[name]}".strip() for name, v in values.items()]
        return ", ".join(parts)

    def _broken(
        self, one: Relation, rest: float, values: dict[str, float], units: dict[str, str]
    ) -> str:
        return (
            f"'{one.text}' does not hold where the conditions do, at {self._where(values, units)}: "
            f"it is short by {-rest:.4g} {one.unit(self.mechanism)}".rstrip()
            + "; that limit is reached first: ask for what is greatest within the side conditions"
        )

    def _infeasible(self, text: str) -> str:
        return (
            "nothing meets all conditions and side conditions together: where the others hold "
            f"'{text}' is broken"
        )

    def _unbounded(self) -> str:
        word = "greatest" if self.question.greatest else "least"
        return (
            f"'{self.question.objective}' has no {word} value: the side conditions do not bound "
            "it; add one that does"
        )

    def _singular(self, error: Singular) -> SolveError:
        names = [one.unknown.name for one in self.wanted]
        weights = np.abs(error.direction)
        loose = [n for n, w in zip(names, weights, strict=True) if w > 1e-3 * weights.max()]
        texts = listed(self.question.conditions)
        if error.solvable:
            return SolveError(f"{texts} hold for any {listed(loose)}: nothing determines it")
        return SolveError(
            f"nothing meets {texts}: no value of {listed(loose)} changes what is left of them"
        )

    def _nothing(self, start: Array) -> str:
        """Why no solution was found."""
        rest, _ = self.rows(start[None])
        names = listed(one.unknown.name for one in self.wanted)
        left = [
            f"'{one.text}' is off by {abs(part):.4g}"
            for one, part in zip(self.equations, rest[0], strict=False)
            if np.isfinite(part)
        ]
        told = f" ({', '.join(left)} at the start)" if left else ""
        more = f"; the last trial said: {self.trials.refusal}" if self.trials.refusal else ""
        return (
            f"no value of {names} was found that meets {listed(self.question.conditions)}{told}: "
            f"give another start, or wider bounds{more}"
        )
