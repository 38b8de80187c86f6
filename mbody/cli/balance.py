"""`mbody balance MODEL`: counterweights and springs that balance a mechanism."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status, question
from mbody.cli.models import model_of, named_values
from mbody.cli.streams import message
from mbody.cli.usage import UsageError

if TYPE_CHECKING:
    from mbody.engineering import ForceBalance, SpringBalance

__all__ = ["balance"]


def balance(args: Any) -> int:
    """Find counterweights or stiffnesses, print them, and write the balanced model."""
    from mbody.engineering import force_balance, spring_balance
    from mbody.files.model import save

    on = named_values(args.on, "--on")
    springs = [name for names in args.springs for name in names.split(",")]
    if bool(on) == bool(springs):
        raise UsageError(
            "choose what is to balance: --on LINK=RADIUS for counterweights, or --springs NAMES"
        )
    mechanism = model_of(args)
    ask = question(args, None)
    options: dict[str, Any] = {}
    if ask is not None:
        options = {"at": ask.at}
        if ask.over:
            options = {"over": ask.over, "instants": ask.instants, "turns": ask.turns}
    found: ForceBalance | SpringBalance
    found = (
        force_balance(mechanism, on, **options)
        if on
        else spring_balance(mechanism, springs, **options)
    )
    if args.output:
        save(found.mechanism, args.output)
        message(f"wrote {args.output}")
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        head = heading(mechanism.name, "balance", unit_symbols(mechanism.units), found)
        print(json.dumps(head | found.data(), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found)
