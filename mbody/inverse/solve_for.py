"""The verb `solve_for`: unknown loads, motions or dimensions that meet conditions."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence

import numpy as np

from mbody.analysis.inverse.conditions import (
    Answer,
    AnswerCase,
    Relation,
    check_question,
    relations,
)
from mbody.core import tolerances as tol
from mbody.core.searches import Searches
from mbody.errors import ModelError, SolveError, brief
from mbody.inverse.extremum import Extremum, Unbounded, best_climb, extremum
from mbody.inverse.trials import (
    Affine,
    ConditionRows,
    SingularEquations,
    Trials,
    affine,
    newton,
    scan,
    spread,
)
from mbody.kernels.linear_program import INCONSISTENT, UNBOUNDED
from mbody.model.element import listed
from mbody.model.mechanism import Mechanism
from mbody.model.simulation import PlacesLike, Question, TextsLike, Unknowns
from mbody.solution.doubts import Doubt, doubted, inherited
from mbody.solution.shared_forces import greatest
from mbody.solution.solution import Solution

# -- Sentences of a question: where no solution was found, and what bounds one -----------------

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
        """The word for the sought extremum: greatest or least."""
        return "greatest" if self.question.greatest else "least"

    def at(self, u: float) -> str:
        """A value of the one unknown, given in steps, with its unit."""
        value, unit = self.wanted[0].in_unit(u, self.mechanism)
        return f"{value:.6g} {unit}".strip()

    def values(self, u: Array) -> tuple[dict[str, float], dict[str, str]]:
        """Values of the unknowns and their units, by name."""
        values, units = {}, {}
        for part, one in zip(u, self.wanted, strict=True):
            name = one.unknown.name
            values[name], units[name] = one.in_unit(float(part), self.mechanism)
        return values, units

    def listing(self, values: dict[str, float], units: dict[str, str]) -> str:
        """Values of the unknowns in one line."""
        parts = [f"{name} = {v:.6g} {units[name]}".strip() for name, v in values.items()]
        return ", ".join(parts)

    def side(self, side: int) -> str:
        """A side condition, or a bound, by its number."""
        return self.sides[side].text if 0 <= side < len(self.sides) else "a bound of an unknown"

    def broken(
        self, one: Relation, residual: float, values: dict[str, float], units: dict[str, str]
    ) -> str:
        """Why values that meet the conditions are no solution."""
        where = self.listing(values, units)
        return (
            f"'{one.text}' does not hold where the conditions do, at {where}: "
            f"it is short by {self._short(one, residual)}; that limit is reached first: ask for "
            "what is greatest within the side conditions"
        )

    def worst(self, u: Array | None) -> tuple[str, str]:
        """The side condition that is broken most at a place, and where that is."""
        first, last = len(self.equations), len(self.equations) + len(self.sides)
        if u is None or not self.sides:
            return "", ""
        residuals, size = self._rows(u)
        worst = int(np.argmin(residuals[0, first:last] / np.maximum(size[0, first:last], tol.TINY)))
        one = self.sides[worst]
        short = self._short(one, float(residuals[0, first + worst]))
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
        """Sentence for an unbounded objective of one unknown: the best value is at a pole, or at
        the end of the search.
        """
        trend = "grows" if self.question.greatest else "falls"
        name, where = self.wanted[0].unknown.name, self.at(u)
        if edge:
            return (
                f"'{self.question.objective}' has no {self.word} value: it {trend} without bound "
                f"where '{name}' reaches {where}, beyond which the mechanism cannot be analysed; "
                "add a side condition or a bound that keeps away from there"
            )
        return (
            f"'{self.question.objective}' has no {self.word} value as far as was searched: it "
            f"still {trend} at '{name}' = {where}; add a side condition or a bound"
        )

    def undetermined(self, error: SingularEquations) -> SolveError:
        """Why the conditions do not determine the unknowns."""
        names = [one.unknown.name for one in self.wanted]
        weights = np.abs(error.direction)
        loose = [
            n for n, w in zip(names, weights, strict=True) if w > tol.UNKNOWN_LOOSE * weights.max()
        ]
        texts, one = listed(self.question.conditions), len(self.question.conditions) == 1
        verb, them = ("holds", "that") if one else ("hold", "them")
        if error.solvable:
            said, why = f"{texts} {verb} for any {listed(loose)}", "nothing determines it"
        else:
            said, why = f"nothing meets {texts}", f"no value of {listed(loose)} changes {them}"
        return SolveError(f"{said}: {why}; take unknowns that they depend on")

    def no_root(self, start: Array) -> str:
        """Why no solution was found."""
        residuals, _ = self._rows(start)
        names = listed(one.unknown.name for one in self.wanted)
        parts = [
            f"'{one.text}' is off by {abs(part):.4g}"
            for one, part in zip(self.equations, residuals[0], strict=False)
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
        """Residuals of all relations at a place, and their sizes."""
        relations = [*self.equations, *self.sides]
        return self.trials.rows(relations, self.question.objective, u[None])

    def _unreached(self) -> str:
        """Why no values of the unknowns could be analysed."""
        names = listed(one.unknown.name for one in self.wanted)
        said = self.trials.refusal
        more = f"; the last trial said: {said}" if said else ""
        return f"no value of {names} was found that can be analysed and meets the conditions{more}"

    def _short(self, one: Relation, residual: float) -> str:
        """By how much a side condition is broken, with its unit."""
        unit = one.unit(self.mechanism)
        value, unit = (math.degrees(residual), "deg") if unit == "rad" else (residual, unit)
        return f"{-value:.4g} {unit}".strip()


# -- The search for the unknowns of a question -------------------------------------------------

#: Starts of a search in several unknowns, and how many in a row may find nothing new.
STARTS, STALLED = 40, 16
#: What makes a formula bend where probes may not look.
NONSMOOTH = re.compile(r"\b(abs|min|max)\s*\(")


class Solver:
    """Finds what meets the conditions of one question of one mechanism."""

    def __init__(self, mechanism: Mechanism, question: Question) -> None:
        check_question(mechanism, question)
        self.mechanism, self.question = mechanism, question
        self.equations, self.sides = relations(question)
        self.trials = Trials(mechanism, question)
        self.wanted = self.trials.wanted
        #: What is left of conditions, then of side conditions, then the objective.
        self.rows = ConditionRows(self.trials, [*self.equations, *self.sides], question.objective)
        self.refusals = Refusals(mechanism, question, (self.equations, self.sides), self.trials)
        self.notes: list[str] = []
        self.doubts: list[Doubt] = []

    def answer(self) -> Answer:
        """All solutions."""
        straight = affine(self.rows, self.trials.start) if self._may_be_straight() else None
        places = self._straight(straight) if straight else self._curved()
        found, why = [], ""
        for place in places:
            try:
                found.append(self._answer_case(place))
            except (ModelError, SolveError) as error:
                why = why or str(error)
        if not found:
            raise SolveError(why)
        known = inherited(*(one.run for one in found), of=[self._measured], notes=self.notes)
        answer = Answer(
            self.mechanism, self.question, tuple(found), straight is not None, notes=known["notes"]
        )
        of_runs = [doubt for one in found for doubt in one.run.doubts]
        return doubted(answer, [*self.doubts, *of_runs])

    def _measured(self, run: Solution) -> Array:
        """What is left of the conditions, and the objective."""
        relations = [*self.equations, *self.sides]
        return self.trials.measured(run, relations, self.question.objective)[0]

    def _may_be_straight(self) -> bool:
        """Whether probes can show that all is linear: not where a formula has a nonsmooth point,
        which they may miss.
        """
        formulas = [self.question.objective] if self.question.objective else []
        relations = [*self.equations, *self.sides] if formulas else []
        formulas += [part for one in relations for part in (one.left, one.right)]
        return self.trials.steady and not any(map(NONSMOOTH.search, formulas))

    # -- places -------------------------------------------------------------------------------

    def _straight(self, straight: Affine) -> list[Affine]:
        """Of linear questions: the one solution, or the best corner."""
        if not self.question.objective:
            rows = tuple(range(len(self.equations)))
            try:
                u = straight.solve(rows)
            except SingularEquations as error:
                raise self.refusals.undetermined(error) from None
            place = self._refined(straight, u, rows)
            self._check_bounds(place.base)
            return [place]
        u, rows = self._corner(self._with_bounds(straight))
        if len(rows) < len(self.wanted):
            self.notes.append(
                f"of {len(self.wanted)} unknowns what binds settles {len(rows)}: others may "
                "reach the same value"
            )
        return [self._refined(straight, u, rows)]

    def _corner(self, at: Affine) -> tuple[Array, tuple[int, ...]]:
        """Where the objective of a linear question is best, and the rows that are zero there."""
        first, last = len(self.equations), len(at.residuals) - 1
        own = tuple(range(first))
        size = np.maximum(at.size, tol.TINY)
        jacobian, left = at.jacobian / size[:, None], at.residuals / size
        try:
            begin = at.solve(own)
        except SingularEquations as error:
            raise self.refusals.undetermined(error) from None
        # what the conditions leave: u = begin + free z
        free = np.linalg.svd(jacobian[:first])[2][first:].T if first else np.eye(len(begin))
        limits = jacobian[first:last]
        A, b = -limits @ free, left[first:last] + limits @ (begin - at.base)
        sign = 1.0 if self.question.greatest else -1.0
        found, z, loads = greatest(sign * jacobian[-1] @ free, A, b)
        if found == INCONSISTENT:
            raise SolveError(self.refusals.infeasible(self.refusals.side(self._broken(A, b))))
        if found == UNBOUNDED:
            raise SolveError(self.refusals.unbounded())
        binding = np.flatnonzero(loads > tol.LINEAR_PROGRAM_MULTIPLIER * loads.max(initial=0.0))
        return begin + free @ z, (*own, *(first + binding).tolist())

    def _broken(self, A: Array, b: Array) -> int:
        """The side condition that contradicts others, of those A z ≤ b that no z meets."""
        sides = len(self.sides)
        short = np.where(np.arange(len(b)) < sides, -1.0, 0.0)
        aim = np.append(np.zeros(A.shape[1]), -1.0)
        found, _, loads = greatest(aim, np.column_stack([A, short]), b)
        return -1 if found == INCONSISTENT or not sides else int(loads[:sides].argmax())

    def _with_bounds(self, straight: Affine) -> Affine:
        """The linearized rows with one more for each bound of an unknown, before the objective."""
        residuals, jacobian, size = [], [], []
        for n, one in enumerate(self.wanted):
            for bound, sign in zip(one.bounds, (1.0, -1.0), strict=True):
                if math.isfinite(bound):
                    residuals.append(sign * (straight.base[n] - bound))
                    jacobian.append(sign * np.eye(len(self.wanted))[n])
                    size.append(max(abs(bound), 1.0))
        if not residuals:
            return straight
        last = len(straight.residuals) - 1
        return Affine(
            straight.base,
            np.insert(straight.residuals, [last] * len(residuals), residuals),
            np.insert(straight.jacobian, [last] * len(residuals), jacobian, axis=0),
            np.insert(straight.size, [last] * len(residuals), size),
        )

    def _check_bounds(self, u: Array) -> None:
        """Refuse the only solution where it is beyond a bound."""
        for part, one in zip(u, self.wanted, strict=True):
            if not one.allows(part):
                value, unit = one.in_unit(float(part), self.mechanism)
                low, high = (one.in_unit(bound, self.mechanism)[0] for bound in one.bounds)
                between = f"{low:g} to {high:g} {unit}".rstrip()
                raise SolveError(
                    f"{listed(self.question.conditions)} holds at '{one.unknown.name}' = "
                    f"{value:.6g} {unit}".rstrip()
                    + f" alone, beyond its bounds {between}: widen them"
                )

    def _refined(self, straight: Affine, u: Array, rows: Sequence[int]) -> Affine:
        """The solution, corrected by what is left of the rows there."""
        for _ in range(2):
            residuals, _ = self.rows(u[None])
            if not np.isfinite(residuals).all():
                break
            here = Affine(u, residuals[0], straight.jacobian, straight.size)
            u = self._with_bounds(here).solve(rows)
        return Affine(u, straight(u), straight.jacobian, straight.size)

    def _curved(self) -> list[Affine]:
        """Of other questions: all that Newton's method finds from several starts, or the best."""
        if not self.question.objective:
            return self._roots(range(len(self.equations)))
        u = self._best_of_one() if len(self.wanted) == 1 else self._several()
        place = self.rows.about(u)
        if place is None:  # alone, as between two edges
            residuals, size = self.rows(u[None])
            place = Affine(u, residuals[0], np.zeros((residuals.shape[1], len(u))), size[0])
        return [place]

    def _best_of_one(self) -> Array:
        """The best value of one unknown, over the whole of its range."""
        (one,) = self.wanted
        signs = np.ones(len(self.sides) + 1)
        signs[-1] = 1.0 if self.question.greatest else -1.0

        def values(us: Array) -> tuple[Array, Array]:
            residuals, size = self.rows(us[:, None])
            return residuals * signs, size

        def derivatives(u: float) -> tuple[Array, Array]:
            here = self.rows.about(np.array([u]))
            if here is None:
                return np.full(len(signs), np.nan), np.full(len(signs), np.nan)
            return here.residuals * signs, here.jacobian[:, 0] * signs

        try:
            best = extremum(one, values, derivatives, self._noise())
        except Unbounded as error:
            raise SolveError(self.refusals.endless(error.u, error.edge)) from None
        where = f"{self.refusals.at(best.low)} to {self.refusals.at(best.high)}"
        if best.u is None:
            raise SolveError(self.refusals.nowhere(best.nearest, where))
        self._note_search(best, where)
        return next(filter(self._runs, np.array(best.inwards)[:, None]), np.array([best.u]))

    def _note_search(self, best: Extremum, where: str) -> None:
        """Say what of the range of the one unknown was not searched, and what is not sure."""
        assert best.u is not None
        low, high = self.wanted[0].bounds
        if best.low > low or best.high < high:
            self.notes.append(f"{self.wanted[0].unknown.name} was searched from {where}")
        for a, b in best.gaps:
            low_end, high_end = self.refusals.at(a), self.refusals.at(b)
            self.notes.append(
                f"between {low_end} and {high_end} the mechanism cannot be analysed: "
                "nothing is compared there"
            )
        word, at = self.refusals.word, self.refusals.at(best.u)
        if best.inwards:
            self._doubt(
                f"the {word} '{self.question.objective}' is only come near to: {at} "
                "is the edge of what can be analysed, and nothing beyond it is compared"
            )
        elif self.trials.pivot(np.array([best.u])) < tol.PIVOT_SINGULAR:
            self._doubt(
                f"the {word} '{self.question.objective}' is at {at}, so near to a "
                "singular position that few of its digits are sure: keep away from it by a bound"
            )
        if best.unresolved:
            self._doubt(
                f"'{self.question.objective}' changes too fast between samples: its {word} value "
                "may be a local one; give narrower bounds"
            )

    def _runs(self, u: Array) -> bool:
        """Whether the whole analysis can be made at a place."""
        try:
            self.trials.run(u)
        except (ModelError, SolveError):
            return False
        return True

    def _noise(self) -> Array:
        """Rounding of every side condition and of the objective."""
        texts = [*(one.left for one in self.sides), self.question.objective]
        return tol.QUANTITY_ROUNDING * np.array([self.trials.size_of(text) for text in texts])

    def _several(self) -> Array:
        """The best values of several unknowns, by climbs from several starts."""
        sign = 1.0 if self.question.greatest else -1.0
        found = best_climb(self.rows, len(self.equations), self.wanted, sign)
        if found.u is None:
            raise SolveError(self.refusals.infeasible(*self.refusals.worst(found.nearest)))
        if found.endless:
            raise SolveError(self.refusals.unbounded())
        if not found.sure:
            self._doubt_local(found.starts, found.agreeing)
        self.notes += [found.stopped] if found.stopped else []
        return found.u

    def _doubt_local(self, starts: int, agreeing: int) -> None:
        word = self.refusals.word
        self._doubt(
            f"the {word} '{self.question.objective}' may be a local one: of {starts} climbs "
            f"from different starts {agreeing} end at this value; give narrower bounds, or another "
            "start"
        )

    def _doubt(self, message: str) -> None:
        names = tuple(dict.fromkeys(one.unknown.name.partition(".")[0] for one in self.wanted))
        self.doubts.append(Doubt("incomplete", message, None, names))

    def _roots(self, rows: Sequence[int]) -> list[Affine]:
        """Solutions from several starts, the nearest to the first one first."""
        start, grids = self.trials.start, [one.grid for one in self.wanted]
        starts = [start]
        if len(grids) == 1:
            starts += scan(self.rows, rows[0], grids[0], start[0])
        else:
            starts += list(spread(grids, STARTS))
        found: list[Affine] = []
        searches, stalled = Searches(len(starts)), 0

        def search(start: Array) -> Affine | None:
            nonlocal stalled
            place = newton(self.rows, rows, start)
            place = None if place is None else self._unwound(place, rows)
            new = place is not None and self._is_new(place.base, found)
            stalled = 0 if new else stalled + 1
            return place if new else None

        going = itertools.takewhile(lambda _: len(grids) == 1 or stalled <= STALLED, starts)
        for place in searches.ends(going, search):
            found.append(place)
        self.notes += [searches.stopped] if searches.stopped else []
        if not found:
            raise SolveError(self.refusals.no_root(start))
        if len(found) > 1 and not all(
            any(place.jacobian[k].any() for place in found) for k in rows
        ):  # a condition that holds everywhere
            raise self.refusals.undetermined(SingularEquations(np.ones(len(start)), True))
        return sorted(found, key=lambda place: float(np.abs(place.base - start).sum()))

    def _unwound(self, place: Affine, rows: Sequence[int]) -> Affine:
        """The solution without whole revolutions of drivers, where they make no difference."""
        u = np.array([one.unwound(part) for one, part in zip(self.wanted, place.base, strict=True)])
        if (u == place.base).all():
            return place
        residuals, _ = self.rows(u[None])
        index = list(rows)
        same = (np.abs(residuals[0][index]) <= tol.UNKNOWNS_SAME * place.size[index]).all()
        return (newton(self.rows, rows, u) if same else None) or place

    def _is_new(self, u: Array, found: list[Affine]) -> bool:
        """Whether a place lies within the bounds and is not among those found."""
        if not all(one.allows(part) for one, part in zip(self.wanted, u, strict=True)):
            return False
        for place in found:
            pairs = zip(self.wanted, u, place.base, strict=True)
            if all(one.distance(a, b) <= tol.UNKNOWNS_SAME * (1.0 + abs(a)) for one, a, b in pairs):
                return False
        return True

    # -- results and sentences ----------------------------------------------------------------

    def _answer_case(self, place: Affine) -> AnswerCase:
        """The solution at a place."""
        run = self.trials.run(place.base)
        residuals, _ = self.trials.measured(run, self.rows.relations, self.question.objective)
        first, last = len(self.equations), len(self.equations) + len(self.sides)
        values, units = self.refusals.values(place.base)
        margins: dict[str, float] = {}
        binding = []
        floor = tol.ROW_HOLDS * place.size
        if self.question.objective and self.sides:
            floor[first:] += self._noise()
        for n, one in enumerate(self.sides, start=first):
            margins[one.text] = min(margins.get(one.text, math.inf), float(residuals[n]))
            if abs(residuals[n]) <= floor[n]:
                binding.append(one.text)
            elif residuals[n] < 0.0:
                raise SolveError(self.refusals.broken(one, float(residuals[n]), values, units))
        return AnswerCase(
            unknowns=values,
            units=units,
            conditions={one.text: float(residuals[n]) for n, one in enumerate(self.equations)},
            side_conditions=margins,
            binding=tuple(dict.fromkeys(binding)),
            objective=float(residuals[last]) if self.question.objective else None,
            residual=float(
                np.max(np.abs(residuals[:first]) / (place.size[:first] + tol.TINY), initial=0)
            ),
            run=run,
        )


def solve_for(
    mechanism: Mechanism,
    unknowns: Question | Unknowns,
    conditions: TextsLike = (),
    *,
    side_conditions: TextsLike = (),
    greatest: str = "",
    least: str = "",
    at: PlacesLike | None = None,
    analysis: str = "kinetostatics",
) -> Answer:
    """Unknown load factors, accelerations, speeds, preloads or dimensions that meet conditions.

    Kinetostatics is linear in loads and accelerations: unit responses and one small solve answer
    it. Where the conditions are not straight in the unknowns, Newton's method does, from several
    starts.

    Parameters
    ----------
    mechanism : Mechanism
        Driven so that no freedom is left; a driver whose effort is to be zero holds what is free.
    unknowns : Question, or str, Unknown, list of them, or mapping
        A whole question; the name of one of the mechanism's own (``solve_for(machine, "hold")``
        for [solve.hold] of a file); or what is to be found, in a mapping with starts or with
        ``{"start", "low", "high", "unit"}``. See `Unknown` for the names.
    conditions, side_conditions, greatest, least, at, analysis
        As of `Question`.

    Returns
    -------
    Answer
        Solutions with their values, reactions and residuals, and the side conditions that bind.

    Raises
    ------
    ModelError
        For a question that the mechanism cannot answer.
    SolveError
        When nothing meets the conditions, with the reason; when they leave an unknown open; when
        nothing bounds what is to be greatest, or it grows without bound towards a singular
        position.

    Notes
    -----
    A greatest value is that of the whole feasible set, or the answer says in `doubts` why it may
    not be. Linear questions are answered by a linear program, bounds of unknowns included. One
    unknown is searched over its whole range, on the branch of the given mechanism: sampled
    adaptively, with every summit, every place where a side condition begins to bind, and every edge
    of what can be analysed found to rounding. Without bounds the range ends where the mechanism
    cannot be analysed, or far away, and a note says so; the angle of a driver is searched a
    revolution to both sides. Several unknowns are sought by climbs from several starts, which are
    checked by samples.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> machine.add(mbody.Torque("brake", "rocker", value=1.0))
    >>> answer = mbody.solve_for(machine, "brake", "motor.effort = 0")
    >>> abs(float(answer[0].run.effort("motor")[0])) < 1e-9
    True
    """
    if not isinstance(mechanism, Mechanism):
        raise ModelError(f"solve_for takes a Mechanism, not {brief(mechanism)}")
    own = mechanism.questions.get(unknowns) if isinstance(unknowns, str) else None
    if own is not None and not (conditions or greatest or least):
        question = own
    elif isinstance(unknowns, Question):
        question = unknowns
    else:
        question = Question(
            unknowns, conditions, side_conditions, greatest, least, analysis, at or {}
        )
    return Solver(mechanism, question).answer()
