"""`mbody shaking MODEL`: shaking force and moment by order, and balance shafts."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import assembly_of, exit_status, question
from mbody.cli.models import model_of
from mbody.cli.option_values import in_degrees
from mbody.cli.usage import UsageError

if TYPE_CHECKING:
    from mbody.engineering import BalanceShaft
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution

__all__ = ["cycle_run", "shaking"]


def shaking(args: Any) -> int:
    """Print the orders of the shaking force."""
    from mbody.engineering import balance_shafts, shaking_orders

    highest = _number(args.orders, "--orders")
    orders = [_number(part, "--shafts") for part in (args.shafts or "").split(",") if part]
    run = cycle_run(args, model_of(args))
    found = shaking_orders(run, args.about, args.driver, highest)
    shafts = balance_shafts(run, orders, args.driver) if orders else ()
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        symbols = unit_symbols(run.mechanism.units, args.angle or "rad")
        plain = [dataclasses.asdict(one) for one in shafts]
        for one in plain if args.angle == "deg" else ():
            one["angle"] = in_degrees(one["angle"])
        head = heading(run.mechanism.name, "shaking", symbols, found)
        data = head | found.data() | {"shafts": plain}
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    else:
        print(found)
        if orders:
            print(_table(run, shafts))
    return exit_status(found, shown=args.json)


def cycle_run(args: Any, mechanism: Mechanism, analysis: str = "kinetostatics") -> Solution:
    """The requested cycle, else that of the model, else a turn of the driver."""
    from mbody.analysis.driven.requests import analyse_at
    from mbody.model.study import Instants

    wanted = question(args, mechanism.ask)
    if not args.at and (wanted is None or not wanted.over):
        wanted = Instants(over="turn")
    return analyse_at(mechanism, analysis, wanted, assembly_of(args))


def _number(text: str, option: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or not value > 0.0:
        raise UsageError(f"{option} takes numbers above 0 such as 2, not {text[:40]!r}")
    return value


def _table(run: Solution, shafts: Sequence[BalanceShaft]) -> str:
    from mbody.sheets.text_table import Column, angles, numbers, table

    if not shafts:
        return "\nno balance shaft is needed for these orders"
    unit = run.mechanism.units
    lines = table(
        [
            Column("SHAFT", [f"{one.order:g}" for one in shafts]),
            Column("", ["with it" if one.sense > 0 else "against it" for one in shafts], text=True),
            Column("m·r", numbers([s.unbalance for s in shafts]), f"{unit.mass}·{unit.length}"),
            Column("angle", angles([one.angle for one in shafts]), "deg"),
            Column("force", numbers([one.force for one in shafts]), unit.force),
        ]
    )
    return "\n".join(["", *lines])
