"""``python -m tests.campaign [SUBJECT] [--count N] [--seed S] [--workers W] [--minutes M] [--to
FOLDER]``, of mechanisms, scenes, uneven, held or invariance: a folder goes on where it was left.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tests.campaign.hunt import SUBJECTS, hunt


def main(arguments: list[str] | None = None) -> int:
    """Hunt, print the counts, and exit with 1 where something was silent, hung or fell."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaign", description=__doc__)
    parser.add_argument("subject", choices=SUBJECTS, nargs="?", default="mechanisms")
    parser.add_argument("--count", type=int, default=100_000, help="mechanisms")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=600.0, help="stop after so long")
    parser.add_argument("--to", type=Path, default=Path("campaign"), help="folder of findings")
    asked = parser.parse_args(arguments)
    begun = time.monotonic()

    def progress(done: int, silent: int) -> None:
        seconds = time.monotonic() - begun
        print(f"\r{done} mechanisms, {silent} silent, {seconds:.0f} s", end="", file=sys.stderr)

    seconds = 60.0 * asked.minutes
    tally = hunt(
        asked.count, asked.seed, asked.workers, asked.to, seconds, progress, subject=asked.subject
    )
    print(file=sys.stderr)
    print(tally)
    return 1 if tally.failed else 0


if __name__ == "__main__":
    sys.exit(main())
