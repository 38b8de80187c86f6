"""`mbody export MODEL --to mjcf`."""

from __future__ import annotations

from typing import Any

from mbody.cli.models import taken
from mbody.cli.streams import say

__all__ = ["export"]


def export(asked: Any) -> int:
    """Write a model in the form of another program; what is not in it is told on stderr."""
    from mbody.engines.mjcf import to_mjcf
    from mbody.files.files import writing

    made = to_mjcf(taken(asked))
    if asked.output is None:
        print(made.text, end="", flush=True)
    else:
        with writing(asked.output) as file:
            file.write(made.text)
    for one in made.not_expressible:
        say(f"mbody: '{one.element}' is not in the file: {one.why}")
    for note in made.notes:
        say(f"mbody: {note}")
    if asked.output is not None:
        say(f"wrote {asked.output}")
    return 0
