"""The verb `solve_for`: unknown loads, motions or dimensions that meet conditions."""

from __future__ import annotations

from mbody.analysis.inverse.answers import Answer
from mbody.errors import ModelError, brief
from mbody.inverse.solver import Solver
from mbody.model.mechanism import Mechanism
from mbody.model.study import PlacesLike, Question, TextsLike, Unknowns

__all__ = ["solve_for"]


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
    not be. Linear questions are answered by the corners of their polytope, bounds of unknowns
    included. One unknown is searched over its whole range, on the branch of the given
    mechanism: sampled adaptively, with every summit, every place where a side condition begins to
    bind, and every edge of what can be analysed found to rounding. Without bounds the range ends
    where the mechanism cannot be analysed, or far away, and a note says so; the angle of a driver
    is searched a turn to both sides. Several unknowns are sought by climbs from several starts,
    which are checked by samples.

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
