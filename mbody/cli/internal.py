"""`mbody internal MODEL --body LINK`: internal loads and stress along a link."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.analyse import exit_status
from mbody.cli.freebody import motion_or_driven
from mbody.cli.models import model_of
from mbody.cli.streams import message
from mbody.cli.usage import UsageError

__all__ = ["internal"]


def internal(args: Any) -> int:
    """Print the greatest internal loads of a link, and draw their diagrams."""
    from mbody.engineering import internal_loads
    from mbody.views.backend import check_ending

    if args.output:
        check_ending(args.output)
    along = None if args.along is None else [word.strip() for word in args.along.split(",")]
    if along is not None and len(along) != 2:
        raise UsageError(f"--along takes two points such as A,B, not {args.along[:60]!r}")
    run = motion_or_driven(args, model_of(args))
    found = internal_loads(run, args.body, along, lumped=args.lumped)
    if args.output:
        from mbody.views import save
        from mbody.views.internal_diagram import internal_diagram

        save(internal_diagram(found), args.output)
        message(f"wrote {args.output}")
    if args.json:
        from mbody.solution.heading import heading, unit_symbols

        machine = run.mechanism
        head = heading(machine.name, "internal", unit_symbols(machine.units), found)
        print(json.dumps(head | found.data(), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found, shown=args.json)
