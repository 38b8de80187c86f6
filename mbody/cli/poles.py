"""`mbody poles MODEL`: instant centres, and the polygons of velocities and accelerations."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status
from mbody.cli.freebody import motion_or_driven
from mbody.cli.models import model_of
from mbody.cli.option_values import in_degrees

if TYPE_CHECKING:
    from mbody.engineering.instant_centres import InstantCentre, InstantCentres
    from mbody.solution.solution import Solution

__all__ = ["poles"]

#: Of the model length, what is printed as zero.
ROUNDING = 1e-12


def poles(args: Any) -> int:
    """Print the instant centres of all pairs of bodies; as data the polygons too."""
    from mbody.engineering.instant_centres import instant_centres
    from mbody.engineering.motion_polygons import acceleration_polygon, velocity_polygon

    run = motion_or_driven(args, model_of(args), forces=False)
    found = instant_centres(run)
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        machine = run.mechanism
        symbols = unit_symbols(machine.units, args.angle or "rad")
        centres = found.data()
        for one in centres if args.angle == "deg" else ():
            one["direction"] = in_degrees(one["direction"])
        data = heading(machine.name, "poles", symbols, found) | {
            "t": run.t.tolist(),
            "centres": centres,
            "collinearity": found.collinearity(),
            "sentences": [found.sentences(k) for k in range(len(run))],
            "polygons": [velocity_polygon(run).data(), acceleration_polygon(run).data()],
        }
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    else:
        # of a model's own instants the first, of a motion the last, of those that are named all
        shown = [len(run) - 1] if args.to is not None else range(len(run))
        for k in shown if args.at or args.over or args.to is not None else [0]:
            print(_table(run, found, k))
    return exit_status(found, shown=args.json)


def _table(run: Solution, found: InstantCentres, k: int) -> str:
    from mbody.sheets.text_table import Column, paragraph, table

    unit = run.mechanism.units
    floor = ROUNDING * run.system.length
    lines = table(
        [
            Column("CENTRE", [found.symbol(one) for one in found.pairs], text=True),
            Column("of the links", [" and ".join(one.bodies) for one in found.pairs], text=True),
            Column("x", _places(found, "x", k, floor), unit.length),
            Column("y", _places(found, "y", k, floor), unit.length),
            Column("", [_note(one, k) for one in found.pairs], text=True),
        ]
    )
    head = [f"{run.mechanism.name}: t = {run.t[k]:.6g} {unit.time}", ""]
    said = [line for text in (*found.sentences(k), *found.notes) for line in paragraph(text)]
    return "\n".join([*head, *lines, "", *said, *([""] if said else [])])


def _places(found: InstantCentres, axis: str, k: int, floor: float) -> list[str]:
    """Cells of the places, empty where there is none."""
    from mbody.sheets.text_table import numbers

    values = [float(getattr(one, axis)[k]) for one in found.pairs]
    cells = iter(numbers([value for value in values if math.isfinite(value)] or [0.0], floor))
    return [next(cells) if math.isfinite(value) else "" for value in values]


def _note(one: InstantCentre, k: int) -> str:
    if one.kind[k] == "none":
        return "no relative motion"
    if one.kind[k] == "infinite":
        return (
            f"at infinity, towards {math.degrees(one.direction[k]) + 0.0:.3f}° ({one.permanence})"
        )
    return one.permanence
