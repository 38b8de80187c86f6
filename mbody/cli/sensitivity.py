"""`mbody sensitivity MODEL MEASURE`: which number changes a measured quantity most."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.analyse import question
from mbody.cli.angle_measures import measures_in_degrees
from mbody.cli.models import model_of

__all__ = ["sensitivity"]


def sensitivity(args: Any) -> int:
    """Take the derivatives of one measured quantity by all numbers, and print them as a table."""
    from mbody.analysis.driven.requests import analyse_system_at
    from mbody.derivatives.gradient import gradient_at
    from mbody.derivatives.named_numbers import checked_names
    from mbody.derivatives.sensitivity import sensitivity_of
    from mbody.model.study import Instants
    from mbody.solution.doubts import succeeded
    from mbody.solution.heading import heading, unit_symbols
    from mbody.system.assembler import assemble

    mechanism = model_of(args)
    ask = question(args, mechanism.ask) or Instants()
    system = assemble(mechanism)
    run = analyse_system_at(system, args.analysis, ask)
    by = [name for names in args.by for name in names.split(",")] or None
    names = checked_names(system, by, "sensitivity")
    wanted: Any = args.measure
    if args.angle == "deg":
        wanted = measures_in_degrees(mechanism, [args.measure])[args.measure]
    gradient = gradient_at(run, [wanted], by, ask.over)
    found = sensitivity_of(run, gradient, names, by is None)
    if args.json:
        units = unit_symbols(mechanism.units)
        head = heading(mechanism.name, "sensitivity", units, found)
        print(json.dumps(head | found.data(), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return 0 if succeeded(found.status) else 1
