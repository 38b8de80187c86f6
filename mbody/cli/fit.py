"""`mbody fit MODEL DATA.csv`: numbers from measured histories, by options or a table [fit]."""

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
    from mbody.files.model.fit_table import fit_settings
    from mbody.solution.heading import heading, unit_symbols

    names = [name.strip() for names in args.by for name in names.split(",")]
    offsets = [name.strip() for names in args.offset for name in names.split(",")]
    mechanism = model_of(args)
    kept = fit_settings(mechanism)
    how = kept.arguments() if kept is not None else {}
    given = {"by": names, "offsets": offsets, "analysis": args.analysis}
    how |= {name: value for name, value in given.items() if value}
    if "by" not in how:
        raise UsageError(
            "choose the unknown numbers: --by NAMES, or by = [...] in a table [fit] of the file"
        )
    found = solved(mechanism, list(args.data), **how)
    if args.json:
        head = heading(mechanism.name, "fit", unit_symbols(mechanism.units), found)
        print(json.dumps(head | found.data(), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found)
