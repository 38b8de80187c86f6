"""`mbody motor MODEL`: a motor with its gear against what a driver asks of it."""

from __future__ import annotations

import json
import math
from typing import Any

from mbody.cli.analyse import exit_status
from mbody.cli.models import model_of
from mbody.cli.shaking import cycle_run
from mbody.cli.usage import UsageError

__all__ = ["motor"]


def motor(args: Any) -> int:
    """Print rms and peak torque, the inertia ratio, and the limit that is nearest."""
    from mbody.engineering import MotorCurve, motor_sizing

    curve = MotorCurve(
        _row(args.speed), _row(args.peak), _row(args.continuous), inertia=args.inertia
    )
    ratio = None if args.ratio is None else _number(args.ratio, "--ratio", "12.5")
    efficiency = _number(args.efficiency, "--efficiency", "0.9")
    run = cycle_run(args, model_of(args))
    found = motor_sizing(
        run, curve, args.driver, ratio=ratio, efficiency=efficiency, rest=args.rest
    )
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        units = unit_symbols(run.mechanism.units)
        head = heading(run.mechanism.name, "motor", units, found)
        print(json.dumps(head | found.data(), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found, shown=args.json)


def _row(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def _number(text: str, option: str, such: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"{option} takes a number such as {such}, not {text[:40]!r}")
    return value
