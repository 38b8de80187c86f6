"""Standard output and standard error that are closed, full, or no longer read."""

from __future__ import annotations

import contextlib
import csv
import os
import sys
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from typing import IO, Any


class UsageError(ValueError):
    """The command was not understood."""

    element: str | None = None


def opened() -> None:
    """Give a process streams where it was started without: what is printed to a closed output is
    refused by the system, and a file that is opened later does not take the place of either.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            # of output for reading only: printing fails, as it would to what is closed
            kind = os.O_WRONLY if number == 2 else os.O_RDONLY
            made = os.open(os.devnull, kind)
            if made != number:
                os.dup2(made, number)
                os.close(made)
    sys.stdin = sys.stdin or _stream(0, "r")
    sys.stdout = sys.stdout or _stream(1, "w")
    sys.stderr = sys.stderr or _stream(2, "w")


def _stream(number: int, mode: str) -> IO[str]:
    return open(number, mode, encoding="utf-8", errors="replace", closefd=False)


def message(text: str, *, end: str = "\n") -> None:
    """Print to standard error, if it is open."""
    if sys.stderr is not None:
        try:
            print(text, end=end, file=sys.stderr, flush=True)
        except (OSError, ValueError):
            silenced(sys.stderr)


def silenced(stream: Any = None) -> None:
    """Lead a stream, by default standard output, to nowhere: what is left of it cannot be written,
    and the end of the process would report it once more.
    """
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, (sys.stdout if stream is None else stream).fileno())
        os.close(nowhere)


# -- Tables of results: written to a file, or printed in place of the summary --------------------

#: In place of the name of a file: the table is printed, and no summary.
PRINTED = "-"


def check_printed(args: Any) -> None:
    """Refuse a table and data in one place, before an analysis runs."""
    if args.excel and (not args.csv or args.csv == PRINTED):
        raise UsageError("--excel goes with --csv FILE: it marks a file for spreadsheets")
    from mbody.files.tables import SPREADSHEETS

    if args.csv and args.csv.lower().endswith(SPREADSHEETS):
        other = f"take --xlsx {args.csv}" if hasattr(args, "xlsx") else "name it .csv"
        raise UsageError(
            f"--csv writes text, and '{args.csv}' is a file of a spreadsheet: {other}; with "
            "--excel they read CSV too"
        )
    if args.json and args.csv == PRINTED:
        raise UsageError("--json and --csv - print to the same place: give --csv a file")


def write_rows(
    args: Any, head: Sequence[str], rows: Iterable[Sequence[Any]], what: str = ""
) -> None:
    """A table with a line of headings, printed or in the file of --csv; `what` the message of a
    file adds.
    """
    from mbody.files.tables import writing

    path: str = args.csv
    printed = path == PRINTED
    with nullcontext(sys.stdout) if printed else writing(path, mark=args.excel) as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(head)
        lines.writerows(rows)
    if not printed:
        message(f"wrote {path}{what}")
