"""Answers of inverse problems as data."""

from __future__ import annotations

from typing import Any

from mbody.analysis.inverse.answers import Answer, AnswerCase
from mbody.files.results import data

__all__ = ["answer_data"]

#: Histories of one instant that are given as numbers.
AT_THE_INSTANT = ("bodies", "reactions", "efforts", "measures")


def answer_data(answer: Answer, angle: str = "deg") -> dict[str, Any]:
    """An answer as plain dicts: ``{"solutions": [{"unknowns", "units", "conditions",
    "side_conditions", "binding", "residual", "bodies", "reactions", "efforts", "measures"}],
    "status", "doubts", "notes"}``.

    Parameters
    ----------
    answer : Answer
    angle : str
        Unit of angles of bodies and measures, ``"deg"`` or ``"rad"``.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> plain = answer_data(mbody.solve_for(machine, "motor.acceleration", "motor.effort = 0"))
    >>> list(plain["solutions"][0]["unknowns"])
    ['motor.acceleration']
    """
    plain: dict[str, Any] = {
        "solutions": [_data(found, angle) for found in answer.solutions],
        "status": answer.status,
        "doubts": [doubt.data() for doubt in answer.doubts],
        "notes": list(answer.notes),
    }
    if answer.question.note:
        plain["note"] = answer.question.note
    if answer.question.objective:
        key = "greatest" if answer.question.greatest else "least"
        plain[key] = answer.question.objective
    return plain


def _data(found: AnswerCase, angle: str) -> dict[str, Any]:
    """One solution; every history is of one instant, and a number."""
    whole = data(found.run, angle)
    plain: dict[str, Any] = {
        "unknowns": found.unknowns,
        "units": found.units,
        "conditions": found.conditions,
        "side_conditions": found.side_conditions,
        "binding": list(found.binding),
        "residual": found.residual,
    }
    if found.objective is not None:
        plain["objective"] = found.objective
    plain["t"] = whole["t"][0]
    return plain | {key: _last(whole[key]) for key in AT_THE_INSTANT}


def _last(value: Any) -> Any:
    """Lists of one instant as its numbers."""
    if isinstance(value, dict):
        return {key: _last(part) for key, part in value.items()}
    return value[-1] if isinstance(value, list) else value
