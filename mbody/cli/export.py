"""`mbody export MODEL --to mjcf`."""

from __future__ import annotations

from typing import Any

from mbody.cli.models import model_of
from mbody.cli.streams import message

__all__ = ["export"]


def export(args: Any) -> int:
    """Write a model as a file of another program; what it cannot express is reported."""
    from mbody.engines.mjcf import to_mjcf
    from mbody.files.writing import writing

    made = to_mjcf(model_of(args))
    if args.output is None:
        print(made.text, end="", flush=True)
    else:
        with writing(args.output) as file:
            file.write(made.text)
    for one in made.not_expressible:
        message(f"mbody: '{one.element}' is not in the file: {one.why}")
    for note in made.notes:
        message(f"mbody: {note}")
    if args.output is not None:
        message(f"wrote {args.output}")
    return 0
