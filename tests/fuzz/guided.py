"""The guided mode: atheris looks for inputs that reach new lines of the door.

It is imported before anything of mbody, so that the door is loaded with counters.
"""

import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from random import Random

import atheris

with atheris.instrument_imports(include=["mbody.quantities", "mbody.files.model"]):
    from tests.fuzz import corpus, mutate
    from tests.fuzz.plain import Report, made

LONGEST = 8192  # bytes of an input
MARKS = {"formula": b"f", "tables": b"s", "toml": b"t", "json": b"j"}


def guided(runs: int, seed: int, report: Report, kinds: Sequence[str]) -> None:
    """Run atheris, which ends the process: its exit status is 1 where an input failed."""
    marks = [MARKS[kind] for kind in kinds]

    def end(status: int) -> None:
        print(report, flush=True)
        os._exit(status)

    def one(data: bytes) -> None:
        mark, raw = (data[:1], data[1:]) if data[:1] in marks else (marks[0], data)
        kind = next(kind for kind, own in MARKS.items() if own == mark)
        try:
            report.take(kind, raw.decode("utf-8", "replace"), kind == "json" or raw[:1] == b"{")
        except KeyboardInterrupt:
            print("stopped", file=sys.stderr)
            end(1)
        if report.inputs.total() >= runs:
            end(1 if report.failures else 0)

    def other(data: bytes, largest: int, own: int) -> bytes:
        """A new input: half of them as the plain mode changes it, half as libFuzzer does."""
        random = Random(own)
        if random.random() < 0.5:
            return bytes(atheris.Mutate(data, largest))
        mark, text = data[:1], data[1:].decode("utf-8", "replace")
        if mark == b"s" or random.random() < 0.2:
            mark = mark if mark in marks else random.choice(marks)
            text = made(next(kind for kind, own in MARKS.items() if own == mark), random)[0]
        else:
            text = mutate.spoilt(random, text, (*mutate.SOUP, *corpus.FORMULAS, *corpus.NUMBERS))
        return (mark + text.encode("utf-8", "replace"))[:largest]

    with tempfile.TemporaryDirectory() as folder:
        for kind, texts in (
            ("formula", corpus.FORMULAS),
            ("tables", corpus.tables()),
            ("toml", corpus.models()),
            ("json", corpus.tables()),
        ):
            for n, text in enumerate(texts if kind in kinds else ()):
                Path(folder, f"{kind}{n}").write_bytes(MARKS[kind] + text.encode())
        options = [f"-seed={seed}", f"-max_len={LONGEST}", "-handle_int=0", "-timeout=60"]
        atheris.Setup([sys.argv[0], *options, folder], one, custom_mutator=other)
        atheris.Fuzz()
