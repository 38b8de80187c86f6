"""Answers of questions: the solutions that were found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mbody.core.presentation import present
from mbody.model.mechanism import Mechanism
from mbody.model.study import Question
from mbody.solution.doubts import Doubt
from mbody.solution.solution import Solution
from mbody.system.read_only import lock


@dataclass(frozen=True, eq=False)
class AnswerCase:
    """One solution of a question.

    Attributes
    ----------
    unknowns : dict
        Value of every unknown by name, in the unit that `units` says.
    units : dict
        Unit of every unknown.
    conditions : dict
        What is left of every condition, right − left, by its text, in the units of the mechanism.
    side_conditions : dict
        By how much every side condition holds, by its text; zero where it binds.
    binding : tuple of str
        The side conditions that bind.
    objective : float or None
        The greatest or least value, in the units of the mechanism.
    residual : float
        The greatest of what is left of the conditions, as a part of their terms.
    run : Solution
        The analysis with these values: motion, reactions, efforts, measures of the one instant.
    """

    unknowns: dict[str, float]
    units: dict[str, str]
    conditions: dict[str, float]
    side_conditions: dict[str, float]
    binding: tuple[str, ...]
    objective: float | None
    residual: float
    run: Solution = field(repr=False)

    def __post_init__(self) -> None:
        lock(self)


@dataclass(frozen=True, eq=False)
class Answer:
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

    def data(self, angle: str = "deg") -> dict[str, Any]:
        """The solutions as plain dicts, ready for JSON."""
        found: dict[str, Any] = present("data", self, angle)
        return found

    def __str__(self) -> str:
        return str(present("sheet", self))
