"""``python -m validation [CASE…] [--json]``: the table of all rows; exit code 1 on a miss."""

from __future__ import annotations

import argparse
import json
import sys

from validation.case import Row, cases

KEYS = ("case", "quantity", "ours", "reference", "error", "tolerance", "reason", "source", "passed")


def table(rows: list[Row]) -> str:
    """Rows in columns."""
    head = ("quantity", "ours", "reference", "error", "tolerance", "", "reason", "source")
    lines = [head]
    for row in rows:
        reference = row.printed or f"{row.reference:.10g}"
        lines.append(
            (
                row.quantity,
                f"{row.ours:.10g}",
                f"{reference} {row.unit}".strip(),
                f"{row.error:.1e}",
                f"{row.tolerance:.1e}",
                "ok" if row.passed else "MISS",
                row.reason,
                row.source,
            )
        )
    wide = [max(len(line[k]) for line in lines) for k in range(len(head))]
    return "\n".join(
        "  ".join(text.ljust(w) for text, w in zip(line, wide, strict=True)).rstrip()
        for line in lines
    )


def main(arguments: list[str] | None = None) -> int:
    """Print the rows of the cases asked for."""
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
        print(json.dumps({"rows": [{key: getattr(row, key) for key in KEYS} for row in rows]}))
    else:
        for name, part in found.items():
            print(f"{name}\n\n{table(part)}\n")
        print(
            f"{len(rows)} rows of {len(found)} cases: {len(rows) - len(missed)} hold, "
            f"{len(missed)} missed"
        )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
