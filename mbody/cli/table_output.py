"""Tables of results: written to a file, or printed in place of the sheet."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from typing import Any

from mbody.cli.streams import message
from mbody.cli.usage import UsageError

__all__ = ["PRINTED", "check_printed", "write_rows"]

#: In place of the name of a file: the table is printed, and no sheet.
PRINTED = "-"


def check_printed(args: Any) -> None:
    """Refuse a table and data in one place, before an analysis runs."""
    if args.json and args.csv == PRINTED:
        raise UsageError("--json and --csv - print to the same place: give --csv a file")


def write_rows(
    path: str, head: Sequence[str], rows: Iterable[Sequence[Any]], what: str = ""
) -> None:
    """A table with a line of headings, printed or in a file; `what` the message of a file adds."""
    from mbody.files.writing import writing

    printed = path == PRINTED
    with nullcontext(sys.stdout) if printed else writing(path) as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(head)
        lines.writerows(rows)
    if not printed:
        message(f"wrote {path}{what}")
