"""`mbody fit MODEL DATA.csv --by NAMES`: numbers from measured histories."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.analyse import exit_status
from mbody.cli.models import model_of
from mbody.cli.usage import UsageError

__all__ = ["fit"]


def fit(args: Any) -> int:
    """Fit the numbers, and print them with their intervals."""
    from mbody.derivatives.fit import fit as solved
    from mbody.solution.heading import heading, unit_symbols

    names = [name.strip() for names in args.by for name in names.split(",")]
    if not names:
        raise UsageError("choose the unknown numbers: --by NAMES")
    offsets = [name.strip() for names in args.offset for name in names.split(",")]
    mechanism = model_of(args)
    found = solved(mechanism, list(args.data), names, args.analysis, offsets=offsets)
    if args.json:
        head = heading(mechanism.name, "fit", unit_symbols(mechanism.units), found)
        print(json.dumps(head | found.data(), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found)
