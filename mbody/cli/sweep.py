"""`mbody sweep MODEL`: many designs."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status, question
from mbody.cli.interrupts import interrupt
from mbody.cli.models import model_of, named_values
from mbody.cli.streams import message
from mbody.cli.usage import UsageError
from mbody.errors import ModelError
from mbody.solution.heading import heading

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.model.study import Measure
    from mbody.sweeps import Sweep

__all__ = ["sweep", "values_of"]


def sweep(args: Any) -> int:
    """Run a sweep and print its results."""
    from mbody.sweeps import sweep as solved

    if not args.vary:
        raise UsageError("choose what differs between designs: --vary NAME=LOW:HIGH:COUNT")
    mechanism = model_of(args)
    parameters = {n: values_of(n, text) for n, text in named_values(args.vary, "--vary").items()}
    ask = question(args, mechanism.ask)
    options: dict[str, Any] = (
        {}
        if ask is None
        else {"at": ask.at, "over": ask.over, "instants": ask.instants, "turns": ask.turns}
    )
    options |= {"to": args.to, "progress": lambda done, of: interrupt.mark()}
    measures = args.measure or None
    if args.angle == "deg":
        measures = _in_degrees(mechanism, args.measure or list(mechanism.measures))
    found = solved(mechanism, parameters, args.analysis, measures or None, **options)
    interrupt.done()
    if args.csv:
        _write(found, args.csv)
    if args.json:
        print(json.dumps(_data(found), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found)


def _in_degrees(mechanism: Mechanism, names: Sequence[str]) -> dict[str, Measure]:
    """The measures by name, those of angles that have no unit of their own in degrees."""
    from mbody.model.reductions import outermost
    from mbody.model.study import Measure
    from mbody.quantities.units import DIMENSIONS
    from mbody.solution.measures import check_measure

    rad = mechanism.units.of(DIMENSIONS["angle"])
    found = {}
    for name in names:
        one = mechanism.measures.get(name) or Measure(name)
        by, of, instant = outermost(one.of)
        inner = mechanism.measures.get(of) or Measure(of)
        of = inner.of
        if by:
            of = f"at({of}, {instant})" if by == "at" else f"{by}({of})"
        unit = "" if inner.by else check_measure(mechanism, Measure(of, one.unit).history)
        found[name] = Measure(of, "deg") if unit == rad and not one.unit else one
    return found


def values_of(name: str, text: str) -> Any:
    """What a parameter takes: from one value to another in so many, or one after the other."""
    from mbody.quantities import FormulaError, read
    from mbody.sweeps import Steps

    try:
        low, sign, rest = text.partition(":")
        if not sign:
            return [read(part, None, "deg") for part in text.split(",")]
        high, _, count = rest.partition(":")
        if not (count.strip().isascii() and count.strip().isdigit()) or len(count) > 9:
            raise UsageError(
                f"--vary takes LOW:HIGH:COUNT, or values with commas, not {text[:60]!r}"
            )
        return Steps(read(low, None, "deg"), read(high, None, "deg"), int(count))
    except FormulaError as error:
        raise ModelError(f"--vary {name}: {error}", name) from None


def _data(found: Sweep) -> dict[str, Any]:
    """The result as plain lists; None where a design has no number."""
    columns: dict[str, Any] = {}
    for name, column in found.columns().items():
        rows = column if isinstance(column, list) else column.tolist()
        columns[name] = [_plain(value) for value in rows]
    return heading(found.system.mechanism.name, "sweep", found.units, found) | {"columns": columns}


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return [_plain(part) for part in value.tolist()]
    return None if isinstance(value, float) and value != value else value


def _write(found: Sweep, path: str) -> None:
    """A line for each design; of histories a column for each instant."""
    from mbody.files.writing import writing

    table: dict[str, Any] = {}
    for name, column in found.columns().items():
        if len(column) and hasattr(column[0], "__len__") and not isinstance(column[0], str):
            table |= {
                f"{name}[{n}]": list(part) for n, part in enumerate(zip(*column, strict=True))
            }
        else:
            table[name] = column if isinstance(column, list) else column.tolist()
    with writing(path) as file:
        rows = csv.writer(file)
        rows.writerow(table)
        rows.writerows(zip(*table.values(), strict=True))
    message(f"wrote {path}: {len(found)} designs")
