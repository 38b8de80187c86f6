"""`mbody kinematics | kinetostatics | statics MODEL`."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from mbody.cli.models import named_values, taken
from mbody.cli.streams import say
from mbody.cli.usage import UsageError
from mbody.errors import ModelError
from mbody.solution.doubts import succeeded

if TYPE_CHECKING:
    from mbody.model.study import Instants
    from mbody.solution.solution import Solution

__all__ = ["analyse", "check_forms", "question", "told_status", "write"]


def analyse(asked: Any) -> int:
    """Run an analysis and show what was asked for."""
    from mbody.analysis.driven.requests import analyse_at as solved

    check_forms(asked)
    mechanism = taken(asked)
    run = solved(mechanism, asked.command, question(asked, mechanism.ask))
    wants_equations = getattr(asked, "equations", False)
    if wants_equations and len(run) > 1:
        raise ModelError("--equations shows one instant: say which, with --at")
    write(run, asked)
    if asked.json:
        told = run.data(asked.angle or "deg")
        if wants_equations:
            told["equations"] = run.equations().data()
        print(json.dumps(told, ensure_ascii=False, allow_nan=False))
    elif wants_equations:
        print(run.equations())
    elif asked.csv != "-":
        print(run)
    return told_status(run, shown=asked.json or (asked.csv != "-" and not wants_equations))


def told_status(result: Any, shown: bool = True) -> int:
    """The exit status of a result; what is in doubt is told on stderr where nothing on stdout
    has `shown` it.
    """
    if not shown:
        for doubt in result.doubts:
            say(f"mbody: doubtful: {doubt.message}")
    return 0 if succeeded(result.status) else 1


def question(asked: Any, own: Instants | None) -> Instants | None:
    """The instants that the arguments ask for, where they leave it open what the model asks."""
    from mbody.model.study import Instants
    from mbody.quantities import FormulaError, read

    if asked.at and asked.over:
        raise UsageError("give --at or --over, not both")
    over = asked.over or (own.over if own and not asked.at else "")
    if asked.instants is not None and not over:
        raise UsageError("--instants goes with --over")
    if asked.over or asked.instants is not None:
        try:
            return Instants(over=over, instants=_whole(asked.instants))
        except ModelError as error:
            raise ModelError(str(error).replace("ask: ", "--", 1)) from None
    at: dict[str, Any] = {}
    for name, text in named_values(asked.at, "--at").items():
        try:
            at[name] = [read(part, None, "deg") for part in text.split(",")]
        except FormulaError as error:
            raise ModelError(f"--at {name}: {error}", name) from None
    return Instants(at=at) if at else own


def _whole(text: str | None) -> int | None:
    if text is None:
        return None
    if not (text.isascii() and text.isdigit()) or len(text) > 12:
        raise UsageError(f"--instants takes a whole number, not {text[:40]!r}")
    return int(text)


def check_forms(asked: Any) -> None:
    """Refuse forms that would be printed into each other, before anything is followed."""
    if asked.json and asked.csv == "-":
        raise UsageError("--json and --csv - print to the same place: give --csv a file")
    if asked.npz == "-":
        raise UsageError("--npz takes a file: its arrays cannot be printed")


def write(run: Solution, asked: Any) -> None:
    """The files that were asked for; what was written is told."""
    angle = asked.angle or "rad"
    if asked.csv == "-":
        from mbody.files.tables import print_csv

        print_csv(run, sys.stdout, angle)
    elif asked.csv:
        run.to_csv(asked.csv, angle)
    if asked.npz:
        run.to_npz(asked.npz)
    for path in (asked.csv, asked.npz):
        if path and path != "-":
            say(f"wrote {path}: {len(run)} instants")
