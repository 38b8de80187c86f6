"""`mbody sweep MODEL`: many designs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status, question
from mbody.cli.angle_measures import measures_in_degrees
from mbody.cli.interrupts import interrupt
from mbody.cli.models import model_of, named_values
from mbody.cli.streams import message
from mbody.cli.table_output import PRINTED, check_printed, write_rows
from mbody.cli.usage import UsageError
from mbody.errors import ModelError
from mbody.solution.heading import heading

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.sweeps import Sweep

__all__ = ["note_plain", "sweep", "values_of"]


def sweep(args: Any) -> int:
    """Run a sweep and print its results."""
    from mbody.sweeps import sweep as solved

    check_printed(args)
    if not args.vary:
        raise UsageError("choose what differs between designs: --vary NAME=LOW:HIGH:COUNT")
    mechanism = model_of(args)
    varied = named_values(args.vary, "--vary")
    parameters = {name: values_of(name, text) for name, text in varied.items()}
    note_plain(mechanism, varied)
    ask = question(args, mechanism.ask)
    options: dict[str, Any] = (
        {}
        if ask is None
        else {"at": ask.at, "over": ask.over, "instants": ask.instants, "turns": ask.turns}
    )
    options |= {"to": args.to, "progress": lambda done, of: interrupt.mark()}
    measures = args.measure or None
    if args.angle == "deg":
        measures = measures_in_degrees(mechanism, args.measure or list(mechanism.measures))
    found = solved(mechanism, parameters, args.analysis, measures or None, **options)
    interrupt.done()
    angle = args.angle or "rad"
    if args.csv:
        _write(found, args.csv, angle)
    if args.json:
        print(json.dumps(_data(found, angle), ensure_ascii=False, allow_nan=False))
    elif args.csv != PRINTED:
        print(found)
    return exit_status(found, shown=args.json or args.csv != PRINTED)


def note_plain(mechanism: Mechanism, varied: Mapping[str, str]) -> None:
    """Note plain values of parameters that the model has in another unit."""
    from mbody.quantities.parameters import plain_otherwise

    for name, text in varied.items():
        plain = all(map(_is_plain, text.split(":")[:2] if ":" in text else text.split(",")))
        own = mechanism.parameters.get(name) if plain else None
        if own is not None and (said := plain_otherwise(name, own, mechanism.units)):
            message(f"note: {said}")


def _is_plain(text: str) -> bool:
    """Whether a value is a number without a unit, and not 0."""
    try:
        return float(text) != 0.0
    except ValueError:
        return False


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


def _data(found: Sweep, angle: str) -> dict[str, Any]:
    """The result as plain lists; None where a design has no number."""
    columns: dict[str, Any] = {}
    for name, column in found.columns(angle).items():
        rows = column if isinstance(column, list) else column.tolist()
        columns[name] = [_plain(value) for value in rows]
    units = {name: found.unit_of(name, angle) for name in found.samples.given_names} | found.units
    return heading(found.system.mechanism.name, "sweep", units, found) | {"columns": columns}


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return [_plain(part) for part in value.tolist()]
    return None if isinstance(value, float) and value != value else value


def _write(found: Sweep, path: str, angle: str) -> None:
    """A line for each design; of histories a column for each instant. Headings have units."""
    units = {name: found.unit_of(name, angle) for name in found.samples.given_names} | found.units
    table: dict[str, Any] = {}
    for name, column in found.columns(angle).items():
        unit = f" [{units[name]}]" if units.get(name) else ""
        if len(column) and hasattr(column[0], "__len__") and not isinstance(column[0], str):
            parts = enumerate(zip(*column, strict=True))
            table |= {f"{name}[{n}]{unit}": list(part) for n, part in parts}
        else:
            table[name + unit] = column if isinstance(column, list) else column.tolist()
    rows = zip(*table.values(), strict=True)
    write_rows(path, list(table), rows, f": {len(found)} designs")
