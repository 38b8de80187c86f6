"""The plain mode: inputs from a seed, any Python, no tool."""

import hashlib
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from tests.fuzz import KINDS, mutate, properties


def made(kind: str, random: Random) -> tuple[str, bool]:
    """One input of a kind: a text, and whether it is JSON."""
    if kind == "formula":
        return mutate.formula(random), False
    if kind == "tables":
        is_json = random.random() < 0.5
        return mutate.written(mutate.tables(random), is_json), is_json
    return mutate.text(random, kind == "json"), kind == "json"


def check(kind: str, text: str, is_json: bool) -> bool:
    """Whether an input is right; an error where a property is broken."""
    found = [False]

    def run() -> None:
        found[0] = (
            properties.formula(text) if kind == "formula" else properties.model(text, is_json)
        )

    properties.guarded(run)
    return found[0]


class Report:
    """Counts of a run, and its failures, each saved to a file."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.begin = folder, time.perf_counter()
        self.inputs: Counter[str] = Counter()
        self.right: Counter[str] = Counter()
        self.failures: Counter[str] = Counter()
        self.slowest = (0.0, "")

    def take(self, kind: str, text: str, is_json: bool) -> None:
        """Check one text and count it."""
        raw = text.encode("utf-8", "surrogatepass")
        ending = "txt" if kind == "formula" else "json" if is_json else "toml"
        self.count(kind, lambda: check(kind, text, is_json), text[:60], raw, ending)

    def count(
        self, kind: str, attempt: Callable[[], bool], label: str, raw: bytes, ending: str
    ) -> None:
        """Check one input, by whatever says whether it is right, and count it."""
        start = time.perf_counter()
        try:
            self.right[kind] += attempt()
        except Exception as error:
            self.fail(kind, raw, ending, error)
        self.inputs[kind] += 1
        self.slowest = max(self.slowest, (time.perf_counter() - start, label))

    def fail(self, kind: str, raw: bytes, ending: str, error: Exception) -> None:
        """Count a failure; the first of its kind is reported, and its input saved."""
        at = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{kind}: {type(error).__name__} at {Path(at.filename).name}:{at.lineno}"
        self.failures[place] += 1
        if self.failures[place] > 3:
            return
        name = f"{kind}-{hashlib.sha256(raw).hexdigest()[:12]}.{ending}"
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / name).write_bytes(raw)
        print(f"FAILED {place}: {str(error)[:300]}\n  saved as {self.folder / name}", flush=True)

    def __str__(self) -> str:
        took = time.perf_counter() - self.begin
        parts = [f"{n} {kind} ({self.right[kind]} right)" for kind, n in self.inputs.items()]
        total = self.inputs.total()
        lines = [
            f"{total} inputs in {took:.0f} s ({total / max(took, 1e-9):.0f}/s): {', '.join(parts)}",
            f"slowest {self.slowest[0]:.2f} s: {self.slowest[1]!r}",
            *(f"FAILED {n} times, {place}" for place, n in self.failures.items()),
        ]
        return "\n".join(lines if self.failures else [*lines, "no failure"])


def progress(runs: int, report: Report, every: float = 10.0) -> Iterator[int]:
    """The numbers of the inputs, with a line now and then of how far it is."""
    told = time.perf_counter()
    for n in range(runs):
        yield n
        if time.perf_counter() - told > every:
            told = time.perf_counter()
            print(str(report).split("\n")[0], file=sys.stderr, flush=True)


def fuzz(runs: int, seed: int, report: Report, kinds: list[str]) -> None:
    """So many inputs; input n of a seed is always the same."""
    weights = [KINDS[kind] for kind in kinds]
    for n in progress(runs, report):
        random = Random(f"{seed}:{n}")
        kind = random.choices(kinds, weights)[0]
        report.take(kind, *made(kind, random))
