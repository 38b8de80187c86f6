"""A sheet of single numbers: a name, a number and its unit in a row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mbody.sheets.text_table import Column, paragraph, table

__all__ = ["labelled_rows", "noted"]


def labelled_rows(head: str, rows: Sequence[tuple[str, str, str]]) -> list[str]:
    """Lines of a table of names, numbers and units under a head.

    >>> for line in labelled_rows("FLYWHEEL", [("mean speed", "10", "rad/s")]):
    ...     print(line)
    FLYWHEEL          unit
    ───────────────────────
    mean speed   10   rad/s
    """
    names, values, units = (list(part) for part in zip(*rows, strict=True))
    return table(
        [Column(head, names, text=True), Column("", values), Column("unit", units, text=True)]
    )


def noted(result: Any) -> list[str]:
    """Lines of the notes of a result."""
    return [line for note in result.notes for line in paragraph(f"note: {note}")]
