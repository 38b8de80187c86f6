"""`mbody export MODEL --to mjcf`."""

from __future__ import annotations

import sys
from typing import Any

from mbody.cli.models import taken

__all__ = ["export"]


def export(asked: Any) -> int:
    """Write a model in the form of another program; what is not in it is told on stderr."""
    from mbody.bridges.mjcf import to_mjcf
    from mbody.io.files import writing

    made = to_mjcf(taken(asked))
    if asked.output is None:
        print(made.text, end="")
    else:
        with writing(asked.output) as file:
            file.write(made.text)
    for one in made.not_expressible:
        print(f"mbody: '{one.element}' is not in the file: {one.why}", file=sys.stderr)
    for note in made.notes:
        print(f"mbody: {note}", file=sys.stderr)
    if asked.output is not None:
        print(f"wrote {asked.output}", file=sys.stderr)
    return 0
