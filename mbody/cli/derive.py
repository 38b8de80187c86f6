"""`mbody derive MODEL`: the equations of a mechanism."""

from __future__ import annotations

from typing import Any

from mbody.cli.analyse import exit_status
from mbody.cli.freebody import motion_or_driven
from mbody.cli.models import model_of
from mbody.cli.streams import message

__all__ = ["derive"]


def derive(args: Any) -> int:
    """Print the equations of one instant in symbols, then with numbers."""
    from mbody.files.writing import writing
    from mbody.teaching import derivation_as

    run = motion_or_driven(args, model_of(args))
    # of a free motion the end, else the first instant
    instant = -1 if args.to is not None else 0
    if len(run) > 1 and args.to is None:
        message(f"mbody: the first of {len(run)} instants; choose another one with --at")
    text = derivation_as(run, args.form, instant).rstrip("\n")
    if args.output:
        with writing(args.output) as file:
            file.write(text + "\n")
        message(f"wrote {args.output}")
    else:
        print(text)
    return exit_status(run, shown=False)
