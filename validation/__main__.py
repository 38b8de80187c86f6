"""``python -m validation [CASE…] [--json]``: the table of all rows; exit code 1 on a miss."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from collections.abc import Callable
from typing import Any

from validation.case import Row, cases

HEAD = ("quantity", "ours", "reference", "", "error", "tolerance")
WIDTH = 110


def table(rows: list[Row]) -> str:
    """Numbers in columns below each source; below them why the tolerance is what it is."""
    head, *lines = columns(rows)
    shown = dict(zip(map(id, rows), lines, strict=True))
    found = [head, "─" * max(map(len, lines))]
    for source, under in together(rows, lambda row: row.source):
        found += ["", source]
        for (reason, cause), alike in together(under, lambda row: (row.reason, row.cause)):
            found += [shown[id(row)] for row in alike]
            found += note(f"tolerance: {reason}")
            if cause:
                found += note(f"cause: {cause}")
    return "\n".join(found)


def columns(rows: list[Row]) -> list[str]:
    """The head and each row, numbers one below the other."""
    parts = [
        [f"  {row.quantity}" for row in rows],
        aligned([ours(row) for row in rows]),
        aligned([row.printed or f"{row.reference:.10g}" for row in rows]),
        [row.unit for row in rows],
        [f"{row.error:.1e}" for row in rows],
        [f"{row.tolerance:.1e}  {'ok' if row.passed else 'MISS'}" for row in rows],
    ]
    wide = [max(map(len, [name, *texts])) for name, texts in zip(HEAD, parts, strict=True)]
    return [
        "  ".join(text.ljust(w) for text, w in zip(line, wide, strict=True)).rstrip()
        for line in [HEAD, *zip(*parts, strict=True)]
    ]


def ours(row: Row) -> str:
    """Ten digits, or two of what should be zero."""
    if row.reference:
        return f"{row.ours:.10g}"
    return f"{row.ours:.1e}" if row.ours else "0"


def aligned(numbers: list[str]) -> list[str]:
    """Decimal points one below the other."""
    before = max(len(number.partition(".")[0]) for number in numbers)
    return [" " * (before - len(number.partition(".")[0])) + number for number in numbers]


def note(text: str) -> list[str]:
    """Indented lines, not too long."""
    return textwrap.wrap(text, WIDTH, initial_indent=" " * 6, subsequent_indent=" " * 8)


def together(rows: list[Row], key: Callable[[Row], Any]) -> list[tuple[Any, list[Row]]]:
    """Rows that have something in common, in the order in which they come first."""
    found: dict[Any, list[Row]] = {}
    for row in rows:
        found.setdefault(key(row), []).append(row)
    return list(found.items())


def main(arguments: list[str] | None = None) -> int:
    """Print the rows of the requested cases."""
    known = cases()
    parser = argparse.ArgumentParser(prog="python -m validation", description=__doc__)
    parser.add_argument("case", nargs="*", help=f"all, unless named: {', '.join(known)}")
    parser.add_argument("--json", action="store_true", help="rows as JSON")
    asked = parser.parse_args(arguments)
    for name in asked.case:
        if name not in known:
            parser.error(f"there is no case '{name}' (there are: {', '.join(known)})")
    found = {name: known[name]() for name in asked.case or known}
    rows = [row for part in found.values() for row in part]
    missed = [row for row in rows if not row.passed]
    if asked.json:
        print(json.dumps({"rows": [row.record() for row in rows]}))
    else:
        for name, part in found.items():
            print(f"{name.upper()}\n\n{table(part)}\n\n")
        print(
            f"{len(rows)} rows of {len(found)} cases: {len(rows) - len(missed)} hold, "
            f"{len(missed)} missed"
        )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
