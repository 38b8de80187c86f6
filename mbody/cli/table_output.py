"""Tables of results: written to a file, or printed in place of the sheet."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import IO, Any

from mbody.cli.usage import UsageError

__all__ = ["PRINTED", "check_printed", "table_stream", "write_rows"]

#: In place of the name of a file: the table is printed, and no sheet.
PRINTED = "-"


def check_printed(args: Any) -> None:
    """Refuse a table and data in one place, before an analysis runs."""
    if args.json and args.csv == PRINTED:
        raise UsageError("--json and --csv - print to the same place: give --csv a file")


@contextmanager
def table_stream(path: str) -> Iterator[IO[str]]:
    """Where a table is written: a file, or standard output."""
    from mbody.files.writing import writing

    if path == PRINTED:
        yield sys.stdout
    else:
        with writing(path) as file:
            yield file


def write_rows(path: str, head: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table with a line of headings."""
    with table_stream(path) as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(head)
        lines.writerows(rows)
