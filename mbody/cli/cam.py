"""`mbody cam MODEL`: pressure angle, curvature, contour and base circle of a cam."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status
from mbody.cli.models import model_of
from mbody.cli.option_values import whole_number
from mbody.cli.shaking import cycle_run
from mbody.cli.streams import message
from mbody.cli.table_output import PRINTED, check_printed, write_rows
from mbody.cli.usage import UsageError
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.engineering import CamAnalysis
    from mbody.model.mechanism import Mechanism
    from mbody.quantities.types import Number

__all__ = ["cam"]

#: Points of a contour.
POINTS = 361


def cam(args: Any) -> int:
    """Print what limits a cam, and write its contour."""
    from mbody.engineering import cam_analysis

    check_printed(args)
    printed = args.csv == PRINTED
    if args.points is not None and not args.csv:
        raise UsageError("--points goes with --csv")
    points = whole_number("--points", args.points)
    machine = model_of(args)
    try:
        run = cycle_run(args, machine, "kinematics")
    except ModelError:
        if _print_undercut(machine, args):
            return 1
        raise
    found = cam_analysis(run, args.joint, limit=_limit(args.limit))
    if args.csv:
        _write(found, args.csv, POINTS if points is None else points, args.angle or "rad")
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        angle = args.angle or "deg"
        machine = run.mechanism
        head = heading(machine.name, "cam", unit_symbols(machine.units, angle), found)
        print(json.dumps(head | found.data(angle), ensure_ascii=False, allow_nan=False))
    elif not printed:
        print(found)
    return exit_status(found, shown=not printed)


def _print_undercut(machine: Mechanism, args: Any) -> bool:
    """Print where a cam that is refused undercuts; whether that is why it was."""
    from mbody.engineering import cam_undercut

    try:
        found = cam_undercut(machine, args.joint)
    except ModelError:
        return False  # the first error says more
    if not found.undercut:
        return False
    if args.csv:
        message(f"mbody: '{found.joint.name}' undercuts: no contour is written")
    if args.json:
        print(json.dumps(found.data(args.angle or "deg"), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return True


def _limit(text: str | None) -> Number | None:
    """An angle, without a unit in degrees."""
    from mbody.quantities import FormulaError, read

    if text is None:
        return None
    try:
        return read(text, None, "deg")
    except FormulaError as error:
        raise ModelError(f"--limit: {error}") from None


def _write(found: CamAnalysis, path: str, points: int, angle: str) -> None:
    from mbody.quantities.convert import degrees_of

    rows = found.contour(points)
    if angle == "deg":
        rows = rows.copy()
        rows[:, 0] = degrees_of(rows[:, 0])
    unit = found.mechanism.units.length
    names = ("x", "y", "pitch_x", "pitch_y", "radius_of_curvature")
    write_rows(path, [f"psi [{angle}]", *(f"{name} [{unit}]" for name in names)], rows.tolist())
