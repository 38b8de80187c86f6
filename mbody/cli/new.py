"""`mbody new KIND`: a commented model file to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mbody.cli.streams import message

__all__ = ["new"]


def new(args: Any) -> int:
    """Write a model file of a kind, or print all kinds with the names of their lengths."""
    from mbody.errors import ModelError
    from mbody.files.writing import writing
    from mbody.teaching.new_model import KINDS, new_model

    if args.kind is None:
        for kind, names in KINDS.items():
            print(f"{kind:<12} --lengths {','.join(names)}")
        return 0
    lengths = [part.strip() for part in args.lengths.split(",")] if args.lengths else []
    text = new_model(args.kind, lengths, args.units or "")
    if args.output == "-":
        print(text, end="")
        return 0
    path = Path(args.output or f"{args.kind}.toml")
    if path.exists():
        raise ModelError(f"'{path}' is there already: choose another file with -o")
    with writing(path) as file:
        file.write(text)
    message(f"wrote {path}")
    return 0
