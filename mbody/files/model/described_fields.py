"""What the docstrings of element classes say of their fields."""

from __future__ import annotations

import re

__all__ = ["described"]


def described(cls: type) -> dict[str, str]:
    """The description of each parameter of a class and its bases, from their docstrings.

    >>> from mbody.model.loads import Damper
    >>> described(Damper)["name"]
    'Unique in the mechanism.'
    """
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        text = base.__dict__.get("__doc__") or ""
        _, _, rest = text.partition("Parameters\n    ----------\n")
        block = re.split(r"\n    [A-Z][a-z]+\n    -----", rest)[0]
        for names, lines in re.findall(
            r"^    (\S[^:\n]*?)(?: : .*)?\n((?:        .*\n?)+)", block, re.M
        ):
            words = " ".join(lines.split())
            found |= dict.fromkeys((name.strip() for name in names.split(",")), words)
    return found
