"""`mbody flywheel MODEL --coefficient C`: the turning moment over a cycle, and its flywheel."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status
from mbody.cli.models import model_of
from mbody.cli.option_values import in_degrees
from mbody.cli.shaking import cycle_run
from mbody.cli.usage import UsageError

if TYPE_CHECKING:
    from mbody.engineering import FlywheelProof

__all__ = ["flywheel"]


def flywheel(args: Any) -> int:
    """Print the fluctuation and the flywheel, and prove it by the free motion."""
    from mbody.engineering import size_flywheel

    text = args.coefficient
    try:
        coefficient = float(text)
    except ValueError:
        coefficient = math.nan
    if not math.isfinite(coefficient):
        raise UsageError(f"--coefficient takes a number such as 0.02, not {text[:40]!r}")
    run = cycle_run(args, model_of(args))
    found = size_flywheel(run, coefficient, args.driver)
    proof = found.simulated() if args.simulate else None
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        symbols = unit_symbols(run.mechanism.units, args.angle or "rad")
        data = heading(run.mechanism.name, "flywheel", symbols, found) | found.data()
        for key in ("least_at", "greatest_at") if args.angle == "deg" else ():
            data[key] = in_degrees(data[key])
        if proof is not None:
            data["simulated"] = {"coefficient": proof.coefficient, "status": proof.status}
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    else:
        print(found)
        if proof is not None:
            print(_line(proof))
    return exit_status(found, shown=args.json)


def _line(proof: FlywheelProof) -> str:
    return f"\nsimulated over a cycle: fluctuation of the speed {proof.coefficient:.6g}"
