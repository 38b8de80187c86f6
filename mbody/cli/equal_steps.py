"""Values in equal steps, as an option names them: LOW:HIGH:COUNT."""

from __future__ import annotations

import re

from mbody.cli.usage import UsageError

__all__ = ["MOST", "equal_steps"]

#: Values of one option.
MOST = 1_000_000

_END = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*?)?\s*")


def equal_steps(option: str, text: str) -> list[str]:
    """The values as text with their unit; those between commas as they are.

    Parameters
    ----------
    option : str
        What errors call it, such as ``"--at crank"``.
    text : str
        ``"0:360:25"``, ``"0 s:5 s:501"``, ``"0:90 deg:4"``, or ``"1,2,3"``.

    Raises
    ------
    UsageError
        For ends that are no numbers of one unit, or a count that is none.

    >>> equal_steps("--at crank", "0:90 deg:4")
    ['0.0 deg', '30.0 deg', '60.0 deg', '90.0 deg']
    >>> equal_steps("--at t", "1,2 s")
    ['1', '2 s']
    """
    if ":" not in text:
        return text.split(",")
    low, high, count = [*text.split(":"), "", ""][:3]
    ends = [_END.fullmatch(part) for part in (low, high)]
    units = {end[2] for end in ends if end and end[2]}
    whole = count.strip()
    steps = int(whole) if whole.isascii() and whole.isdigit() and len(whole) < 9 else 0
    if text.count(":") != 2 or len(units) > 1 or not 2 <= steps <= MOST:
        raise _refused(option, text)
    first, last = (float(end[1]) if end else None for end in ends)
    if first is None or last is None:
        raise _refused(option, text)
    unit = next(iter(units), "")
    values = [first + (last - first) * n / (steps - 1) for n in range(steps - 1)] + [last]
    return [f"{value!r} {unit}".strip() for value in values]


def _refused(option: str, text: str) -> UsageError:
    return UsageError(
        f"{option} takes LOW:HIGH:COUNT, two numbers of one unit and a count from 2 to {MOST}, as "
        f"in 0:360:25, or values with commas, not {text[:60]!r}"
    )
