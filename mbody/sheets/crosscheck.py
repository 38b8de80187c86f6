"""The readable sheet of a cross-check: what ``print(mbody.crosscheck(machine))`` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mbody.sheets.names import noted, title
from mbody.sheets.text_table import Column, even, number, paragraph, table

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["sheet"]

#: Quantities of an engine that are shown, where some differ and where all agree: the worst first.
SHOWN, ENOUGH = 16, 8


def sheet(report: Any) -> str:
    """A cross-check as text, at most 100 characters wide.

    Parameters
    ----------
    report : Crosscheck
    """
    run = report.run
    instants = f"{len(run)} instants" if len(run) > 1 else "1 instant"
    about = f"cross-check of {run.analysis}, {instants}"
    lines = title(run.mechanism.name, about, run.mechanism.units)
    for name, opinion in report.opinions.items():
        lines += ["", *_opinion(name, opinion)]
    verdict = "all agree" if report.agrees else "THEY DIFFER"
    doubts = [line for one in report.run.doubts for line in paragraph(one.message, "DOUBT   ")]
    return "\n".join(even([*lines, "", *doubts, f"VERDICT   {verdict}"]))


def _opinion(name: str, opinion: Any) -> list[str]:
    """One engine: its quantities, what it cannot express, how it was used."""
    rows = sorted(opinion.rows, key=_part, reverse=True)
    differ = [row for row in rows if row.verdict != "agrees"]
    shown = SHOWN if differ else ENOUGH
    lines = _table(opinion.engine, rows[:shown])
    more = len(rows) - shown
    summary = f"DIFFERS in {len(differ)} of" if differ else "agrees in"
    summary += f" {len(rows)} quantities"
    summary += f" ({more} not shown, nearer than these)" if more > 0 else ""
    lines += paragraph(summary if rows else "nothing to compare", f"{name}: ")
    for reason in dict.fromkeys(row.reason for row in rows):
        lines += paragraph(reason, "expected: ")
    for one in opinion.not_expressible:
        lines += paragraph(one.why, f"not expressible: {one.element}: ")
    return [*lines, *noted(opinion.notes)]


def _part(row: Any) -> float:
    """The difference as a part of what is expected."""
    return float(row.difference / row.expected) if row.expected else float("inf")


def _table(engine: str, rows: Sequence[Any]) -> list[str]:
    if not rows:
        return [engine]
    return table(
        [
            Column(engine.upper(), [row.quantity for row in rows], text=True),
            Column("ours", [number(row.ours) for row in rows]),
            Column("theirs", [number(row.theirs) for row in rows]),
            Column("difference", [f"{row.difference:.1e}" for row in rows]),
            Column("expected", [f"{row.expected:.1e}" for row in rows]),
            Column("verdict", [row.verdict for row in rows], text=True, whole=True),
        ]
    )
