"""The command: which questions, how much of them, and where the rows go."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from typing import Any

from benchmarks import page, results
from benchmarks.frame import Row, Scope
from benchmarks.questions import QUESTIONS

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> int:
    """Measure the questions; returns 0 if every question has rows."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("questions", nargs="*", metavar="QUESTION", help=", ".join(QUESTIONS))
    parser.add_argument("--short", action="store_true", help="fewer runs, sizes and settings")
    parser.add_argument("--json", action="store_true", help="rows as JSON on standard output")
    parser.add_argument("--runs", type=int, help="rounds, by default 7, in the short form 3")
    parser.add_argument("--longest", type=float, help="seconds of the longest single run")
    parser.add_argument("--save", action="store_true", help="keep the rows in benchmarks/results")
    parser.add_argument(
        "--page", action="store_true", help="write README.md and its pictures of all that is kept"
    )
    options = parser.parse_args(arguments)
    unknown = [name for name in options.questions if name not in QUESTIONS]
    if unknown:
        parser.error(f"no question {', '.join(unknown)}: there are {', '.join(QUESTIONS)}")
    if options.runs is not None and options.runs < 1:
        parser.error("--runs must be 1 or more")
    if options.page and not (options.questions or options.save):
        page.write()
        return 0
    rows = measured(
        options.questions or list(QUESTIONS),
        Scope(
            short=options.short,
            runs=options.runs or (3 if options.short else 7),
            longest=options.longest or (0.5 if options.short else 20.0),
            progress=lambda line: print(line, file=sys.stderr, flush=True),
        ),
        shown=not options.json,
        kept=options.save,
    )
    if options.json:
        print(json.dumps([row.short() for row in rows], indent=1))
    if options.page:
        page.write()
    return 0


def measured(questions: list[str], scope: Scope, *, shown: bool, kept: bool) -> list[Row]:
    """Rows of the questions; each is shown and kept as soon as it is answered."""
    rows: list[Row] = []
    for name in questions:
        question: Any = importlib.import_module(f"benchmarks.questions.{name}")
        scope.progress(f"{name}: {question.TITLE}")
        begin = time.perf_counter()
        found = question.measure(scope)
        scope.progress(f"{name}: {time.perf_counter() - begin:.0f} s")
        rows += found
        if kept:
            scope.progress(f"kept in {results.keep(found, short=scope.short)}")
        if shown:
            print(f"\n{question.TITLE}\n\n" + page.table(found))
    return rows
