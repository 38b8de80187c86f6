"""How far a long motion is, as a line on standard error that is written over."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable

#: Seconds after which a long run shows how far it is, and between two such lines.
PATIENCE, BETWEEN = 1.0, 0.2
#: Signs of the bar.
WIDTH = 32


def shown(until: float) -> Callable[[float], None]:
    """What is called with the time reached, and shows it after a while, until the last time."""
    begun = last = time.monotonic()
    first: float | None = None

    def show(t: float) -> None:
        nonlocal last, first
        now = time.monotonic()
        first = t if first is None else first
        if t >= until and last > begun:
            _over(f"\r{'':{WIDTH + 40}}\r")
        elif now - begun > PATIENCE and now - last > BETWEEN:
            last = now
            done = (t - first) / (until - first) if until > first else 1.0
            _over(f"\r{bar(done)}  t = {t:.6g} of {until:.6g}  ")

    return show


def counted(what: str) -> Callable[[int, int], None]:
    """What is called with how many of a thing are done, and of how many, and shows it after a
    while, in a terminal and in a notebook.
    """
    begun = last = time.monotonic()

    def show(done: int, of: int) -> None:
        nonlocal last
        now = time.monotonic()
        if done >= of and last > begun:
            _over(f"\r{'':{WIDTH + 40}}\r")
        elif now - begun > PATIENCE and now - last > BETWEEN:
            last = now
            _over(f"\r{bar(done / of)}  {done} of {of} {what}  ")

    return show


def _over(text: str) -> None:
    if sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            print(text, end="", file=sys.stderr, flush=True)


def bar(done: float) -> str:
    """A part as a bar.

    >>> bar(0.5)
    '████████████████················  50 %'
    """
    full = round(WIDTH * min(max(done, 0.0), 1.0))
    return f"{'█' * full}{'·' * (WIDTH - full)} {100.0 * done:3.0f} %"
