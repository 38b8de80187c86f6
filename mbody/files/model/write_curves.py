"""Curves of a mechanism as a model file has them."""

from __future__ import annotations

import dataclasses
from typing import Any, Protocol

from mbody.errors import ModelError
from mbody.files.model.cells import alike, word
from mbody.laws import Table, Table2
from mbody.model.curves import NamedCurve
from mbody.quantities import Formula
from mbody.quantities.units import NUMBER, Dimension

__all__ = ["curve_table"]


class NumberWriter(Protocol):
    """What writes numbers of curves: see `mbody.files.model.write`."""

    def text(self, formula: Formula) -> Any:
        """The text of a formula as a file has it, None where it was no text."""

    def curve_number(self, name: str, value: float, dimension: Dimension | None) -> Any:
        """A number of a curve."""


def curve_table(writer: NumberWriter, name: str, named: NamedCurve) -> dict[str, Any]:
    """The table of a curve.

    Raises
    ------
    ModelError
        For a law that is no table.
    """
    law: Any = named.given
    if not isinstance(law, (Table, Table2)):
        raise ModelError(
            f"the curve '{name}' is a {type(law).__name__}, which a model file does not carry: "
            "give it as a Table",
            name,
        )
    dimensions = (*named.takes, named.gives)
    # beside numbers with units plain ones are ratios
    other = NUMBER if any(dimensions) else None
    measures = {key: of or other for key, of in zip("xyz", dimensions, strict=False)}
    found: dict[str, Any] = {}
    for field in dataclasses.fields(law):
        value = getattr(law, field.name)
        if field.name in measures:
            found[field.name] = _row(writer, name, value, measures[field.name])
        elif not alike(value, field.default):
            found[field.name] = word(value)
    return found


def _row(writer: NumberWriter, name: str, row: Any, dimension: Dimension | None) -> Any:
    """Numbers of a curve, text as it was written."""
    if isinstance(row, tuple):
        return [_row(writer, name, one, dimension) for one in row]
    text = writer.text(row) if isinstance(row, Formula) else None
    return writer.curve_number(name, row, dimension) if text is None else text
