"""The command: which questions, how much of them, and where the rows go."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from typing import Any

from benchmarks import page, results
from benchmarks.frame import Asked, Row
from benchmarks.questions import QUESTIONS

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> int:
    """Measure what is asked; 0 if every question gave rows."""
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
    asked = parser.parse_args(arguments)
    unknown = [name for name in asked.questions if name not in QUESTIONS]
    if unknown:
        parser.error(f"no question {', '.join(unknown)}: there are {', '.join(QUESTIONS)}")
    if asked.runs is not None and asked.runs < 1:
        parser.error("--runs must be 1 or more")
    if asked.page and not (asked.questions or asked.save):
        page.write()
        return 0
    rows = measured(
        asked.questions or list(QUESTIONS),
        Asked(
            short=asked.short,
            runs=asked.runs or (3 if asked.short else 7),
            longest=asked.longest or (0.5 if asked.short else 20.0),
            progress=lambda line: print(line, file=sys.stderr, flush=True),
        ),
        shown=not asked.json,
        kept=asked.save,
    )
    if asked.json:
        print(json.dumps([row.short() for row in rows], indent=1))
    if asked.page:
        page.write()
    return 0


def measured(questions: list[str], asked: Asked, *, shown: bool, kept: bool) -> list[Row]:
    """Rows of the questions; each is shown and kept as soon as it is answered."""
    rows: list[Row] = []
    for name in questions:
        question: Any = importlib.import_module(f"benchmarks.questions.{name}")
        asked.progress(f"{name}: {question.TITLE}")
        begin = time.perf_counter()
        found = question.measure(asked)
        asked.progress(f"{name}: {time.perf_counter() - begin:.0f} s")
        rows += found
        if kept:
            asked.progress(f"kept in {results.keep(found, short=asked.short)}")
        if shown:
            print(f"\n{question.TITLE}\n\n" + page.table(found))
    return rows
