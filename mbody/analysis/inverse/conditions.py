"""Inverse questions: their conditions, and what answers them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.driven.driven import check_instants
from mbody.core.presentation import Presented
from mbody.errors import ModelError, brief
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import resolve_number
from mbody.model.simulation import Instants, Measure, Question, Unknown
from mbody.quantities import convert
from mbody.quantities.formula import range_given, value_given
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.solution.doubts import Doubt
from mbody.solution.measures import check_measure, checked_sides, sides
from mbody.solution.solution import Solution
from mbody.system.system import Locked

# -- Answers of questions: the solutions that were found ---------------------------------------


@dataclass(frozen=True, eq=False)
class AnswerCase(Locked):
    """One solution of a question.

    `unknowns`: Value of every unknown by name, in the unit that `units` says.
    `units`: Unit of every unknown.
    `conditions`: What is left of every condition, right − left, by its text, in the units of the
      mechanism.
    `side_conditions`: By how much every side condition holds, by its text; zero where it binds.
    `binding`: The side conditions that bind.
    `objective`: The greatest or least value, in the units of the mechanism.
    `residual`: The greatest of what is left of the conditions, as a part of their terms.
    `run`: The analysis with these values: motion, reactions, efforts, measures of the one instant.
    """

    unknowns: dict[str, float]
    units: dict[str, str]
    conditions: dict[str, float]
    side_conditions: dict[str, float]
    binding: tuple[str, ...]
    objective: float | None
    residual: float
    run: Solution = field(repr=False)


@dataclass(frozen=True, eq=False)
class Answer(Presented):
    """All solutions of a question that were found, those nearest to the start first.

    Attributes
    ----------
    question : Question
    solutions : tuple of AnswerCase
    straight : bool
        Whether all is linear in the unknowns: the solution is then the only one.
    notes : tuple of str
        What is to be known of the search, as its range; doubts stand here as well.
    status : str
        ``"completed"``, or ``"doubtful: …"`` with the first doubt.
    doubts : tuple of Doubt
        Why a greatest or least value may be a local one, or a result is in doubt.

    Examples
    --------
    >>> import mbody
    >>> arm = mbody.Mechanism("arm")
    >>> arm.add(mbody.Body("arm", mass=2.0, cg=(0.5, 0.0)), mbody.Revolute("O", "ground", "arm"))
    >>> arm.add(mbody.AngleDriver("motor", "arm", 0.0), mbody.Gravity("gravity", y=-9.81))
    >>> arm.add(mbody.Torque("hold", "arm", value=0.0))
    >>> answer = mbody.solve_for(arm, unknowns=["hold"], conditions="motor.effort = 0")
    >>> round(answer[0].unknowns["hold"], 6), answer.straight
    (9.81, True)
    """

    mechanism: Mechanism
    question: Question
    solutions: tuple[AnswerCase, ...]
    straight: bool
    notes: tuple[str, ...] = ()
    status: str = "completed"
    doubts: tuple[Doubt, ...] = ()

    def __len__(self) -> int:
        return len(self.solutions)

    def __getitem__(self, index: int) -> AnswerCase:
        return self.solutions[index]


# -- Conditions between measured quantities: equations and inequalities as text ----------------

_SIGN = re.compile(r"<=|>=|==|[=<>≤≥]")


@dataclass(frozen=True)
class Relation:
    """left = right, or left <= right.

    `text`: As it was written; an absolute value below a bound makes two relations of one text.
    `left`, `right`: Formulas of histories.
    `equal`: Whether it is an equation.
    """

    text: str
    left: str
    right: str
    equal: bool

    def unit(self, mechanism: Mechanism) -> str:
        """The unit of what is left of it; refuses names that the mechanism has not, and sides that
        do not measure the same.
        """
        return mechanism.units.of(checked_sides(mechanism, self.text, self.left, self.right))

    def __call__(self, run: Solution) -> tuple[np.ndarray, np.ndarray]:
        """right − left and the size of its terms, of every design: arrays (designs,)."""
        left, right = sides(run, self.left, self.right)
        a, b = (np.reshape(part, (-1, len(run)))[:, -1] for part in (left, right))
        return b - a, np.maximum(np.abs(a), np.abs(b))


def relation(text: str, *, equal: bool) -> list[Relation]:
    """The relations that a text says.

    >>> [(r.left, r.right) for r in relation("abs(A.fx) <= 2 N", equal=False)]
    [('A.fx', '2 N'), ('-(A.fx)', '2 N')]
    """
    signs = _SIGN.findall(text)
    wanted = "an equation such as 'motor.effort = 0'"
    if not equal:
        wanted = "an inequality such as 'road.fy >= 0'"
    if len(signs) != 1 or (signs[0] in ("=", "==")) != equal:
        raise ModelError(f"{brief(text, 100)} is not {wanted}")
    left, right = (part.strip() for part in text.split(signs[0]))
    if not left or not right:
        raise ModelError(f"{brief(text, 100)} is not {wanted}: a side of it is empty")
    if signs[0] in (">", ">=", "≥"):
        left, right = right, left
    inner = _magnitude(left)
    if equal or not inner:
        return [Relation(text, left, right, equal)]
    return [Relation(text, inner, right, False), Relation(text, f"-({inner})", right, False)]


def _magnitude(text: str) -> str:
    """The argument of ``abs(…)``, where that is the whole text; else ""."""
    if not (text.startswith("abs(") and text.endswith(")")):
        return ""
    depth = 0
    for n, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if depth == 0 and sign == ")" and n < len(text) - 1:
            return ""
    return text[4:-1].strip()


def relations(question: Question) -> tuple[list[Relation], list[Relation]]:
    """The conditions of a question, and its side conditions."""
    equations = [one for text in question.conditions for one in relation(text, equal=True)]
    sides = [one for text in question.side_conditions for one in relation(text, equal=False)]
    return equations, sides


def _check_unknown(mechanism: Mechanism, unknown: Unknown) -> None:
    """Refuse what is none of its numbers, and bounds and a unit of something else."""
    dimension = resolve_number(mechanism, unknown.name)[1]
    search_range(mechanism, unknown, dimension)
    if unknown.unit and dimension is not None:
        try:
            convert(1.0, mechanism.units.of(dimension), unknown.unit)
        except ModelError as error:
            raise ModelError(f"unknown '{unknown.name}': {error}", unknown.name) from None


def search_range(
    mechanism: Mechanism, unknown: Unknown, dimension: Dimension | None
) -> tuple[float | None, float, float]:
    """Start, if there is one, and bounds of an unknown in the units of the mechanism."""
    scope, verb, start = mechanism.parameters.scope(), "solve_for", None
    if unknown.start is not None:
        start = value_given(unknown.start, dimension, scope, verb, unknown.name)
    given = (
        -math.inf if unknown.low is None else unknown.low,
        math.inf if unknown.high is None else unknown.high,
    )
    low, high = range_given(given, dimension, scope, verb, unknown.name, equal=True, endless=True)
    return start, low, high


def _is_bounded(mechanism: Mechanism, unknown: Unknown) -> bool:
    """Whether an unknown has a bound, or is the angle of a driver, the same after a revolution."""
    if unknown.low is not None or unknown.high is not None:
        return True
    name, dimension = resolve_number(mechanism, unknown.name)
    owner, _, key = name.partition(".")
    return key == "value" and dimension == DIMENSIONS["angle"] and mechanism[owner].role == "driver"


def check_question(mechanism: Mechanism, question: Question) -> None:
    """Refuse a question that names what the mechanism has not, gives numbers of something else, or
    has too few conditions.
    """
    equations, sides = relations(question)
    check_instants(mechanism, Instants(at=question.at))
    for unknown in question.unknowns:
        _check_unknown(mechanism, unknown)
    for one in (*equations, *sides):
        one.unit(mechanism)
    if question.objective:
        check_measure(mechanism, Measure(question.objective))
    wanted, given = len(question.unknowns), len(equations)
    if question.objective and given >= wanted:
        raise ModelError(
            f"{wanted} unknowns and {given} conditions leave nothing to be greatest or least: "
            "leave out conditions, or ask without"
        )
    if (
        question.objective
        and not sides
        and not any(_is_bounded(mechanism, one) for one in question.unknowns)
    ):
        raise ModelError(
            f"nothing bounds '{question.objective}': give side conditions, or bounds of the "
            "unknowns"
        )
    if not question.objective and given != wanted:
        raise ModelError(
            f"{wanted} unknown{'s' * (wanted > 1)} want as many conditions, there "
            f"{'is' if given == 1 else 'are'} {given}: add or leave out some, or say what is to be "
            "greatest"
        )
