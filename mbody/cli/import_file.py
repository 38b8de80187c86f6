"""`mbody import FILE -o model.toml`."""

from __future__ import annotations

from typing import Any

from mbody.cli.streams import message

__all__ = ["import_file"]


def import_file(args: Any) -> int:
    """Write a model file from another program's; what was assumed or left out is reported."""
    from mbody.exchange import import_model
    from mbody.files.model import save, to_toml

    made = import_model(args.file, args.units)
    if args.output is None:
        print(to_toml(made.mechanism), end="", flush=True)
    else:
        save(made.mechanism, args.output)
    for note in made.notes:
        message(f"mbody: {note}")
    if args.output is not None:
        message(f"wrote {args.output}: {made.mechanism.name}, from a file of {made.form}")
    return 0
