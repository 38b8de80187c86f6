"""`mbody solve MODEL [NAME]`: the questions of a model, answered."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.models import taken
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed

__all__ = ["solve"]

NONE = "no solution:"


def solve(asked: Any) -> int:
    """Answer one question of a model, or all of them; 1 where one has none, or a doubt."""
    from mbody._version import __version__
    from mbody.analysis.inverse.solve_for import solve_for
    from mbody.files.answers import answer_data
    from mbody.files.results import error_data
    from mbody.sheets.answers import sheet

    mechanism = taken(asked)
    questions = mechanism.questions
    if not questions:
        raise ModelError(
            f"'{mechanism.name}' asks nothing: give its file a table [solve.NAME] with unknowns "
            "and conditions"
        )
    if asked.name and asked.name not in questions:
        raise ModelError(
            f"'{mechanism.name}' has no question '{asked.name[:60]}' (it has: {listed(questions)})",
            asked.name,
        )
    cases: dict[str, Any] = {}
    texts, failed = [], False
    for name in [asked.name] if asked.name else questions:
        try:
            answer = solve_for(mechanism, questions[name])
        except SolveError as error:
            failed = True
            cases[name] = {"solutions": [], **error_data(error)}
            texts.append("\n".join([f"{mechanism.name}: {name}", "", NONE, str(error)]))
        else:
            failed |= bool(answer.doubts)
            cases[name] = answer_data(answer, asked.angle or "deg")
            texts.append(sheet(answer, name))
    if asked.json:
        told = {"mbody": __version__, "model": mechanism.name, "analysis": "solve", "cases": cases}
        print(json.dumps(told, ensure_ascii=False, allow_nan=False))
    else:
        print("\n\n\n".join(texts))
    return 1 if failed else 0
