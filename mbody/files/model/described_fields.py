"""What the docstrings of element classes say of their fields."""

from __future__ import annotations

import re

__all__ = ["described"]


def described(cls: type) -> dict[str, str]:
    """The description of each parameter of a class and its bases, from their docstrings; where one
    refers to a base, as "see `RubbingJoint`", with the words of that base.

    >>> from mbody.model.loads import Damper
    >>> described(Damper)["name"]
    'Unique in the mechanism.'
    >>> from mbody.model.joints import Gear
    >>> described(Gear)["backlash"][:45]
    'Play between the teeth along the pitch lines '
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
            several = names.split(",")
            for name in map(str.strip, several):
                found[name] = _whole(words, found.get(name, ""), len(several) > 1)
    return found


def _whole(words: str, of_base: str, shared: bool) -> str:
    """A description with that of a base in place of a reference to it; of a description that
    several parameters share, the base's says which is which.
    """
    found = re.search(r"; see `\w+`\.", words)
    if not of_base or found is None:
        return words
    own, rest = words[: found.start()], words[found.end() :]
    return f"{of_base}{rest}" if shared else f"{own}. {of_base}{rest}"
