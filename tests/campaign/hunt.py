"""Seeds to workers, findings to files, counts to a table."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Set
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import mbody
from tests.campaign.analyses import ANALYSES, Finding, examine
from tests.campaign.contact_scenes import examine_scene, examine_uneven
from tests.campaign.drawing import random_linkage
from tests.campaign.held import HELD, examine_held, random_mechanism
from tests.campaign.invariance import CHANGES, UNITS, examine_invariance
from tests.campaign.scenes import KINDS, random_scene, uneven_scene

__all__ = ["SUBJECTS", "Tally", "hunt"]

#: What may be drawn: how a seed is examined, and its mechanism.
SUBJECTS: dict[str, tuple[Callable[[int], Finding], Callable[[int, str], mbody.Mechanism]]] = {
    "mechanisms": (examine, lambda seed, name: random_linkage(seed).mechanism(name)),
    "scenes": (examine_scene, lambda seed, name: random_scene(seed).mechanism(name)),
    "uneven": (examine_uneven, lambda seed, name: uneven_scene(seed).mechanism(name)),
    "held": (examine_held, random_mechanism),
    "invariance": (examine_invariance, lambda seed, name: random_scene(seed).mechanism(name)),
}
#: Rows of the table, in this order.
ROWS = tuple(dict.fromkeys((*ANALYSES, *KINDS, *HELD, *CHANGES, *UNITS, "?")))

#: Seconds after which an analysis counts as hanging; seeds that a worker takes at once.
PATIENCE, AT_ONCE = 120, 8
#: The file of a line for every seed that was examined.
SEEDS = "seeds.jsonl"


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

    def resume(self, folder: Path, first: int, end: int) -> frozenset[int]:
        """Count what a hunt before this one kept of the seeds from first to end; these seeds."""
        file, seen = folder / SEEDS, set()
        for line in file.read_text("utf-8").splitlines() if file.exists() else ():
            row = json.loads(line)
            if first <= row["seed"] < end and row["seed"] not in seen:
                seen.add(row["seed"])
                self.add(row["analysis"], **row["parts"])
        self.last = max([self.last, *seen])
        return frozenset(seen)

    def total(self, what: str) -> int:
        """Over all analyses."""
        return sum(count[what] for count in self.counts.values())

    @property
    def failed(self) -> int:
        """What must not be."""
        return sum(self.total(what) for what in ("silent", "hung", "fell"))

    def __str__(self) -> str:
        heads = ("mechanisms", "doubted", "refused", "silent", "hung", "fell")
        lines = ["| analysis | " + " | ".join(heads) + " |", "|---|" + "---:|" * len(heads)]
        for name in [name for name in ROWS if name in self.counts]:
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
    subject: str = "mechanisms",
) -> Tally:
    """Examine `most` seeds, or until `count` mechanisms were looked at, or the time is over.

    Findings other than agreement are written to the folder `to`, a model file and a sentence each,
    and a line for every seed to ``seeds.jsonl`` there: seeds that it has are not examined again.
    Ctrl-C leaves what was done.
    """
    tally, begun = Tally(seed, seed - 1), time.monotonic()
    seen = tally.resume(to, seed, seed + most) if to is not None else frozenset()
    if len(seen) >= most or tally.total("mechanisms") >= count:
        return tally
    with (
        contextlib.suppress(KeyboardInterrupt),
        contextlib.closing(_findings(seed, workers, subject, seen)) as all_,
    ):
        for number, finding, trouble in all_:
            tally.last = max(tally.last, number)
            keep(tally, number, finding, trouble, to, subject)
            done = tally.total("mechanisms")
            if progress is not None:
                progress(done, tally.total("silent"))
            over = time.monotonic() - begun > seconds
            if done >= count or over or number - seed + 1 >= most:
                break
    return tally


def _findings(
    seed: int, workers: int, subject: str, seen: Set[int]
) -> Iterator[tuple[int, Finding | None, str]]:
    """Findings of one seed after the other."""
    seeds = (number for number in range(seed, 2**62) if number not in seen)
    one = partial(tried, subject=subject)
    if workers < 2:
        yield from map(one, seeds)
        return
    pool = multiprocessing.get_context("spawn").Pool(workers)
    try:
        while True:
            some = [next(seeds) for _ in range(AT_ONCE * workers)]
            yield from pool.imap(one, some)
    finally:
        pool.terminate()


def keep(
    tally: Tally,
    seed: int,
    finding: Finding | None,
    trouble: str,
    to: Path | None,
    subject: str = "mechanisms",
) -> None:
    """Count a finding, and write it where it is not agreement."""
    if finding is None:
        kind = "hung" if trouble.startswith("hung") else "fell"
        analysis, parts = "?", {"mechanisms": 1, kind: 1}
        told, model = trouble, None
    else:
        analysis = finding.analysis
        parts = {"doubted": finding.doubted, "refused": finding.refused, "silent": finding.silent}
        kind = next((name for name, number in reversed(parts.items()) if number), "")
        parts["mechanisms"] = finding.count
        told, model = finding.told, finding.model
    tally.add(analysis, **parts)
    if to is None:
        return
    to.mkdir(parents=True, exist_ok=True)
    with (to / SEEDS).open("a", encoding="utf-8") as lines:
        row = {"seed": seed, "analysis": analysis, "parts": parts, "told": told}
        lines.write(json.dumps(row) + "\n")
    if not kind:
        return
    (to / f"{kind}_{seed}.txt").write_text(f"seed {seed}: {told}\n", "utf-8")
    with contextlib.suppress(mbody.ModelError):
        if model is None:
            model = SUBJECTS[subject][1](seed, f"seed {seed}")
        mbody.save(model, to / f"{kind}_{seed}.toml")


class Hung(Exception):
    """An analysis did not end."""


def tried(seed: int, subject: str = "mechanisms") -> tuple[int, Finding | None, str]:
    """A seed's finding; or none, and what went wrong."""

    def late(*_: Any) -> None:
        raise Hung

    timed = hasattr(signal, "SIGALRM")
    if timed:
        signal.signal(signal.SIGALRM, late)
        signal.alarm(PATIENCE)
    try:
        return seed, SUBJECTS[subject][0](seed), ""
    except Hung:
        return seed, None, f"hung: longer than {PATIENCE} s"
    except Exception:  # what fell is a finding, whatever it was
        return seed, None, traceback.format_exc(limit=-4)
    finally:
        if timed:
            signal.alarm(0)
