"""Searches from several starts: where they begin, and what they found when they are stopped."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

Start = TypeVar("Start")
End = TypeVar("End")


def latin(count: int, width: int, seed: int) -> np.ndarray:
    """Numbers between 0 and 1, one in each of so many slices of every column (Latin hypercube;
    McKay 1979): (count, width).

    >>> np.sort(np.floor(3.0 * latin(3, 2, 0)), axis=0).tolist()
    [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]
    """
    rng = np.random.default_rng(seed).spawn(1)[0]
    parts = rng.uniform(size=(count, width))
    slices = np.tile(np.arange(1, count + 1), (width, 1))
    for row in slices:
        rng.shuffle(row)
    return np.asarray((slices.T - parts) / count)


def halton(count: int, width: int) -> np.ndarray:
    """Numbers between 0 and 1, the first of which fill the space evenly as well, the same ones
    always: (count, width).

    >>> halton(3, 2).round(3).tolist()
    [[0.5, 0.333], [0.25, 0.667], [0.75, 0.111]]
    """
    most = int(2.0 * width * math.log(width + 2.0)) + 3  # above the last prime that is needed
    primes = [n for n in range(2, most) if all(n % k for k in range(2, math.isqrt(n) + 1))]
    found = np.zeros((width, count))
    for row, base in zip(found, primes, strict=False):
        left, part = np.arange(1, count + 1), 1.0
        while left.any():
            part /= base
            row += part * (left % base)
            left //= base
    return found.T


@dataclass
class Searches:
    """Searches one after the other, which Ctrl-C ends with what was found.

    `count`: Of all searches.
    `seen`: Called with those that are done, and with all.
    `known`: Whether something was found already.
    `stopped`: How they were ended; empty where all are done.
    """

    count: int
    seen: Callable[[int, int], None] | None = None
    known: bool = False
    done: int = 0
    stopped: str = ""

    def mark(self) -> None:
        """The point at which a search may be stopped."""
        if self.seen is not None:
            self.seen(self.done, self.count)

    def ends(self, starts: Iterable[Start], search: Callable[[Start], End | None]) -> Iterator[End]:
        """What was found, without the searches that found nothing.

        Raises KeyboardInterrupt where nothing was found before.
        """
        try:
            for start in starts:
                end = search(start)
                self.done += 1
                if end is not None:
                    self.known = True
                    yield end
                self.mark()
        except KeyboardInterrupt:
            if not self.known:
                raise
            self.stopped = f"stopped: after {self.done} of {self.count} searches"
