"""`mbody solve MODEL [NAME]`: the questions of a model, answered."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.models import model_of
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed

__all__ = ["solve"]

NONE = "no solution:"


def solve(args: Any) -> int:
    """Answer one question of a model, or all of them; 1 where one has none, or a doubt."""
    from mbody.files.answers import answer_data
    from mbody.files.results import error_data
    from mbody.inverse.solve_for import solve_for
    from mbody.sheets.answers import sheet
    from mbody.solution.doubts import Doubt, Inherited, inherited
    from mbody.solution.heading import heading, unit_symbols

    mechanism = model_of(args)
    questions = mechanism.questions
    if not questions:
        raise ModelError(
            f"'{mechanism.name}' has no questions: give its file a table [solve.NAME] with "
            "unknowns and conditions"
        )
    if args.name and args.name not in questions:
        raise ModelError(
            f"'{mechanism.name}' has no question '{args.name[:60]}' (it has: {listed(questions)})",
            args.name,
        )
    cases: dict[str, Any] = {}
    texts: list[str] = []
    doubts: list[Doubt] = []
    notes: list[str] = []
    for name in [args.name] if args.name else questions:
        try:
            answer = solve_for(mechanism, questions[name])
        except SolveError as error:
            doubts.append(Doubt("incomplete", f"{name}: {error}"))
            cases[name] = {"solutions": [], **error_data(error)}
            texts.append("\n".join([f"{mechanism.name}: {name}", "", NONE, str(error)]))
        else:
            doubts += answer.doubts
            notes += answer.notes
            cases[name] = answer_data(answer, args.angle or "deg")
            texts.append(sheet(answer, name))
    if args.json:
        units = unit_symbols(mechanism.units, args.angle or "deg")
        whole = Inherited(**inherited(Inherited(doubts=tuple(doubts)), notes=notes))
        head = heading(mechanism.name, "solve", units, whole)
        print(json.dumps(head | {"cases": cases}, ensure_ascii=False, allow_nan=False))
    else:
        print("\n\n\n".join(texts))
    return 1 if doubts else 0
