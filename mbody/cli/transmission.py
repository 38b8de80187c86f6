"""`mbody transmission MODEL --output BODY`: how well a force comes through."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.analyse import assembly_of, exit_status, question
from mbody.cli.models import model_of

__all__ = ["transmission"]


def transmission(args: Any) -> int:
    """Print transmission angle, mechanical advantage and velocity ratio, over the turn."""
    from mbody.analysis.driven.requests import analyse_at
    from mbody.analysis.driven.transmission import transmission as found_through
    from mbody.views.cycle import cycle

    mechanism = model_of(args)
    wanted = question(args, mechanism.ask)
    if not args.at and not args.over:
        wanted = cycle(mechanism, wanted)
    run = analyse_at(mechanism, "kinematics", wanted, assembly_of(args))
    found = found_through(run, args.driver, args.output, args.joint)
    if args.json:
        print(json.dumps(found.data(args.angle or "deg"), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found, shown=args.json)
