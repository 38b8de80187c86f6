"""The readable sheet of answers: what ``print(mbody.solve_for(machine, ...))`` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.sheets.measured import measures
from mbody.sheets.names import noted
from mbody.sheets.text_table import Column, even, number, numbers, paragraph, table

if TYPE_CHECKING:
    from mbody.analysis.inverse.answers import Answer, AnswerCase

__all__ = ["sheet"]


def sheet(answer: Answer, name: str = "") -> str:
    """An answer as text, at most 100 characters wide.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> machine.add(mbody.Torque("brake", "rocker", value=1.0))
    >>> print(sheet(mbody.solve_for(machine, "brake", "motor.effort = 0")).splitlines()[2])
    conditions: motor.effort = 0
    """
    question = answer.question
    lines = paragraph(f"{answer.mechanism.name}{': ' + name if name else ''}")
    if question.note:
        lines += paragraph(question.note)
    lines += ["", *_requested(answer)]
    for n, found in enumerate(answer.solutions, start=1):
        title = "UNKNOWNS" if len(answer) == 1 else f"SOLUTION {n}"
        lines += ["", *_found(found, title)]
    if answer.doubts:
        lines += ["", *paragraph(answer.status, "STATUS   ")]
    return "\n".join(even([*lines, *noted(answer.notes)]))


def _requested(answer: Answer) -> list[str]:
    question = answer.question
    lines = []
    if question.objective:
        word = "greatest" if question.greatest else "least"
        lines += paragraph(f"{word}: {question.objective}")
    if question.conditions:
        lines += paragraph("conditions: " + ",  ".join(question.conditions))
    if question.side_conditions:
        lines += paragraph("side conditions: " + ",  ".join(question.side_conditions))
    return lines


def _found(found: AnswerCase, title: str) -> list[str]:
    """The unknowns, what binds, the forces of the joints and the measures."""
    names, run = list(found.unknowns), found.run
    lines = table(
        [
            Column(title, names, text=True),
            Column("value", [number(found.unknowns[name]) for name in names]),
            Column("unit", [found.units[name] for name in names], text=True),
        ]
    )
    if found.binding:
        lines += paragraph("binds: " + ",  ".join(found.binding))
    lines += ["", *_joints(found)] if run.mechanism.joints else []
    own = measures(run)
    lines += ["", *own] if own else []
    return [*lines, "", f"RESIDUAL   {found.residual:.1e}   (of the conditions, relative)"]


def _joints(found: AnswerCase) -> list[str]:
    run = found.run
    unit = run.mechanism.units.of("force")
    reactions = [run.reaction(joint.name) for joint in run.mechanism.joints]
    x, y = (np.array([getattr(r, key)[-1] for r in reactions]) for key in ("fx", "fy"))
    floor = 1e-9 * float(np.hypot(x, y).max(initial=0.0))
    return table(
        [
            Column("FORCES", [r.joint for r in reactions], text=True),
            Column("x", numbers(x, floor), unit),
            Column("y", numbers(y, floor), unit),
            Column("i on j", [f"{r.by} on {r.on}" for r in reactions], text=True),
        ]
    )
