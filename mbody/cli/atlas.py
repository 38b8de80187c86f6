"""`mbody atlas --to FILE`: an atlas of coupler curves, to start a synthesis from."""

from __future__ import annotations

from typing import Any

from mbody.cli.option_values import whole_number
from mbody.cli.streams import message

__all__ = ["atlas"]


def atlas(args: Any) -> int:
    """Make an atlas and write it to a file."""
    from mbody.synthesis import Atlas

    given = {name: whole_number(f"--{name}", getattr(args, name)) for name in ("count", "seed")}
    found = Atlas.made(args.kind, **{name: n for name, n in given.items() if n is not None})
    found.save(args.to)
    message(f"wrote {args.to}: {len(found)} curves")
    return 0
