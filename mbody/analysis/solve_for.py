"""The verb `solve_for`: unknown loads, motions or dimensions that meet conditions."""

from __future__ import annotations

from typing import Any

from mbody.analysis.answers import Answer
from mbody.analysis.search import Search
from mbody.errors import ModelError, brief
from mbody.mechanism import Mechanism
from mbody.questions import Question

__all__ = ["solve_for"]


def solve_for(
    mechanism: Mechanism,
    unknowns: Any,
    conditions: Any = (),
    *,
    side_conditions: Any = (),
    greatest: str = "",
    least: str = "",
    at: Any = None,
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
        For a question that the mechanism cannot be asked.
    SolveError
        When nothing meets the conditions, with the reason; when they leave an unknown open; when
        nothing bounds what is to be greatest.

    Notes
    -----
    The greatest value is sought where as many side conditions bind as unknowns are left: of linear
    questions that is all, of others a greatest value between them would be missed.

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
    question = unknowns
    own = isinstance(unknowns, str) and mechanism.questions.get(unknowns)
    if own and not (conditions or greatest or least):
        question = own
    elif not isinstance(unknowns, Question):
        question = Question(
            unknowns, conditions, side_conditions, greatest, least, analysis, at or {}
        )
    return Search(mechanism, question).answer()
