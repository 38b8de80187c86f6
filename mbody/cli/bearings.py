"""`mbody bearings MODEL`: loads of bearings over a cycle, their spectra and lives."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status
from mbody.cli.freebody import motion_or_driven, named_bodies
from mbody.cli.models import model_of, named_values
from mbody.cli.option_values import whole_number
from mbody.cli.shaking import cycle_run
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.engineering import BearingLoad
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution

__all__ = ["bearings"]

#: Classes of a spectrum that is data.
CLASSES = 10


def bearings(args: Any) -> int:
    """Print the equivalent load and the life of every bearing."""
    from mbody.engineering import bearing_load

    ratings: dict[str, Any] = named_values(args.rating, "--rating")
    classes = whole_number("--spectrum", args.spectrum)
    mechanism = model_of(args)
    # a rating for a joint that is no bearing is refused with those that there are
    wanted = [*dict.fromkeys([*(named_bodies(args.joint) or _revolutes(mechanism)), *ratings])]
    kind = _kind(args.kind)
    run = motion_or_driven(args, mechanism) if args.to else cycle_run(args, mechanism)
    found = {name: bearing_load(run, name, kind, ratings.get(name)) for name in wanted}
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        units = unit_symbols(run.mechanism.units)
        head = heading(run.mechanism.name, "bearings", units, run)
        rows = {
            name: _plain(one.data()) | {"spectrum": one.spectrum(classes or CLASSES)}
            for name, one in found.items()
        }
        print(json.dumps(head | {"bearings": rows}, ensure_ascii=False, allow_nan=False))
    else:
        print(_sheet(run, found, classes))
    return exit_status(run, shown=True)


def _revolutes(mechanism: Mechanism) -> list[str]:
    from mbody.model.joints import Revolute

    names = [one.name for one in mechanism.joints if isinstance(one, Revolute)]
    if not names:
        raise ModelError(f"'{mechanism.name}' has no revolute joint: there is no bearing in it")
    return names


def _kind(text: str) -> str | float:
    """The kind, or an exponent."""
    try:
        return float(text)
    except ValueError:
        return text


def _plain(data: dict[str, Any]) -> dict[str, Any]:
    """What is infinite is null."""
    return {
        key: value if value is None or math.isfinite(value) else None for key, value in data.items()
    }


def _sheet(run: Solution, found: dict[str, BearingLoad], classes: int | None) -> str:
    from mbody.sheets.names import certified, title
    from mbody.sheets.text_table import Column, even, numbers, table

    unit, loads = run.mechanism.units, list(found.values())
    exponent = loads[0].exponent
    words = f"bearings over {loads[0].cycle:.6g} {unit.time}, exponent of life {exponent:.4g}"
    rated = [one for one in loads if one.life is not None]
    columns = [
        Column("BEARING", list(found), text=True),
        Column("equivalent", numbers([one.equivalent for one in loads]), unit.force),
        Column("by time", numbers([one.in_time for one in loads]), unit.force),
        Column("greatest", numbers([one.greatest for one in loads]), unit.force),
        Column("mean", numbers([one.mean for one in loads]), unit.force),
        Column("turns a cycle", numbers([one.revolutions for one in loads])),
    ]
    if rated:
        columns += [
            Column("life", [_life(one.life) for one in loads], "10⁶ rev"),
            Column("life", [_hours(run, one) for one in loads], "h"),
        ]
    lines = [*title(run.mechanism.name, words, unit), "", *table(columns)]
    for name, one in found.items() if classes else ():
        rows = one.spectrum(classes or 1)
        lines += [
            "",
            *table(
                [
                    Column(f"{name}: from", numbers([row[0] for row in rows]), unit.force),
                    Column("to", numbers([row[1] for row in rows]), unit.force),
                    Column("of revolutions", [f"{100.0 * row[2]:.2f}" for row in rows], "%"),
                    Column("of time", [f"{100.0 * row[3]:.2f}" for row in rows], "%"),
                ]
            ),
        ]
    return "\n".join(even([*lines, *certified(run)]))


def _life(revolutions: float | None) -> str:
    if revolutions is None:
        return ""
    return f"{revolutions / 1e6:.5g}" if math.isfinite(revolutions) else "endless"


def _hours(run: Solution, one: BearingLoad) -> str:
    from mbody.quantities.units import unit_system

    if one.time is None:
        return ""
    if not math.isfinite(one.time):
        return "endless"
    return f"{one.time * unit_system(run.mechanism.units).unit('time').factor / 3600.0:.5g}"
