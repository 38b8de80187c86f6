"""Seeds to workers, findings to files, counts to a table."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mbody
from tests.campaign.analyses import ANALYSES, Finding, examine
from tests.campaign.drawing import random_linkage

__all__ = ["Tally", "hunt"]

#: Seconds after which an analysis counts as hanging; seeds that a worker takes at once.
PATIENCE, AT_ONCE = 120, 8


@dataclass
class Tally:
    """What was found, by analysis.

    Attributes
    ----------
    counts : dict of Counter
        By analysis: "mechanisms", "doubted", "refused", "silent", "hung", "fell" (a traceback).
    first, last : int
        Seeds.
    """

    first: int
    last: int = 0
    counts: dict[str, Counter[str]] = field(default_factory=dict)

    def add(self, analysis: str, **more: int) -> None:
        """Count something."""
        self.counts.setdefault(analysis, Counter()).update(more)

    def total(self, what: str) -> int:
        """Over all analyses."""
        return sum(count[what] for count in self.counts.values())

    @property
    def failed(self) -> int:
        """What must not be."""
        return sum(self.total(what) for what in ("silent", "hung", "fell"))

    def __str__(self) -> str:
        heads = ("mechanisms", "doubted", "refused", "silent", "hung", "fell")
        lines = [
            "| analysis | " + " | ".join(heads) + " |",
            "|---|" + "---:|" * len(heads),
        ]
        for name in [name for name in (*ANALYSES, "?") if name in self.counts]:
            cells = " | ".join(str(self.counts[name][head]) for head in heads)
            lines.append(f"| {name} | {cells} |")
        cells = " | ".join(str(self.total(head)) for head in heads)
        lines.append(f"| all, seeds {self.first} to {self.last} | {cells} |")
        return "\n".join(lines)


def hunt(
    count: int,
    seed: int,
    workers: int,
    to: Path | None,
    seconds: float = float("inf"),
    progress: Callable[[int, int], None] | None = None,
    most: int = 2**62,
) -> Tally:
    """Examine `most` seeds, or until `count` mechanisms were looked at, or the time is over.

    Findings other than agreement are written to the folder `to`, a model file and a sentence each.
    Ctrl-C leaves what was done.
    """
    tally, begun = Tally(seed, seed - 1), time.monotonic()
    with (
        contextlib.suppress(KeyboardInterrupt),
        contextlib.closing(_findings(seed, workers)) as all_,
    ):
        for number, finding, trouble in all_:
            tally.last = number
            keep(tally, number, finding, trouble, to)
            done = tally.total("mechanisms")
            if progress is not None:
                progress(done, tally.total("silent"))
            over = time.monotonic() - begun > seconds
            if done >= count or over or number - seed + 1 >= most:
                break
    return tally


def _findings(seed: int, workers: int) -> Iterator[tuple[int, Finding | None, str]]:
    """Findings of one seed after the other."""
    seeds = iter(range(seed, 2**62))
    if workers < 2:
        yield from map(tried, seeds)
        return
    pool = multiprocessing.get_context("spawn").Pool(workers)
    try:
        while True:
            some = [next(seeds) for _ in range(AT_ONCE * workers)]
            yield from pool.imap(tried, some)
    finally:
        pool.terminate()


def keep(tally: Tally, seed: int, finding: Finding | None, trouble: str, to: Path | None) -> None:
    """Count a finding, and write it where it is not agreement."""
    if finding is None:
        kind = "hung" if trouble.startswith("hung") else "fell"
        tally.add("?", mechanisms=1, **{kind: 1})
        told, model = trouble, None
    else:
        parts = {"doubted": finding.doubted, "refused": finding.refused, "silent": finding.silent}
        tally.add(finding.analysis, mechanisms=finding.count, **parts)
        told, model = finding.told, finding.model
        kind = next((name for name, number in reversed(parts.items()) if number), "")
    if not kind or to is None:
        return
    to.mkdir(parents=True, exist_ok=True)
    (to / f"{kind}_{seed}.txt").write_text(f"seed {seed}: {told}\n", "utf-8")
    if model is None:
        model = random_linkage(seed).mechanism(f"seed {seed}")
    with contextlib.suppress(mbody.ModelError):
        mbody.save(model, to / f"{kind}_{seed}.toml")


class Hung(Exception):
    """An analysis did not end."""


def tried(seed: int) -> tuple[int, Finding | None, str]:
    """A seed's finding; or none, and what went wrong."""

    def late(*_: Any) -> None:
        raise Hung

    timed = hasattr(signal, "SIGALRM")
    if timed:
        signal.signal(signal.SIGALRM, late)
        signal.alarm(PATIENCE)
    try:
        return seed, examine(seed), ""
    except Hung:
        return seed, None, f"hung: longer than {PATIENCE} s"
    except Exception:  # what fell is a finding, whatever it was
        return seed, None, traceback.format_exc(limit=-4)
    finally:
        if timed:
            signal.alarm(0)
