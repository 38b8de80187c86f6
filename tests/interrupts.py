"""Ctrl-C at random moments of the command: `python -m tests.interrupts --runs 200`.

Each trial begins a command, waits for a random time and interrupts it as a terminal does. It must
end soon, with at most one line on standard error, and no traceback. Before the first line of mbody
is reached the process is Python's own: what it says then is counted apart.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass

from tests.support.paths import ROOT

__all__ = ["ENVIRONMENT", "Told", "trial"]

#: Of the command: as a user has it, whatever the tests run with.
ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
WORDS = (
    ("kinetostatics", "norton_fourbar"),
    ("kinetostatics", "hoekens", "--over", "turn", "--instants", "20000", "--csv", "-"),
    ("simulate", "double_pendulum", "--to", "200"),
    ("simulate", "free_fourbar", "--to", "20", "--json"),
    ("sweep", "norton_fourbar", "--vary", "crank.A.x=4.9:5.1:3000"),
    ("equilibrium", "simple_pendulum"),
    ("check", "watt_sixbar"),
    ("models",),
)
#: Seconds in which a command is interrupted, and in which it then ends.
SPAN, PATIENCE = 4.0, 30.0


@dataclass(frozen=True)
class Told:
    """What came of a trial."""

    words: tuple[str, ...]
    delay: float
    status: int
    err: str

    @property
    def own(self) -> bool:
        """Whether mbody was reached at all, or Python was still beginning."""
        return "mbody" in self.err or ("Traceback" not in self.err and "Fatal" not in self.err)

    @property
    def right(self) -> bool:
        """One line or none, and a status that says what happened."""
        lines = [line for line in self.err.splitlines() if "compiling" not in line]
        clean = not any(word in self.err for word in ("Traceback", "Exception ignored", "Fatal"))
        return not self.own or (
            clean and len(lines) <= 1 and self.status in (0, 1, 130, -signal.SIGINT)
        )


def trial(draw: random.Random) -> Told:
    """One command, interrupted at a random moment."""
    words, delay = draw.choice(WORDS), draw.uniform(0.0, SPAN)
    with subprocess.Popen(
        [sys.executable, "-X", "utf8", "-m", "mbody", *words],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    ) as process:
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        try:
            _, err = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            _, err = process.communicate()
            err += "Exception ignored: it did not end"
    return Told(words, delay, process.returncode, err)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.interrupts")
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    counts: Counter[str] = Counter()
    for n in range(asked.runs):
        told = trial(random.Random(f"{asked.seed}:{n}"))
        if not told.own:
            counts["Python was still beginning"] += 1
        elif not told.right:
            counts["WRONG"] += 1
            print(f"WRONG: {told}", flush=True)
        else:
            counts[f"status {told.status}"] += 1
    print(*(f"{count} {what}" for what, count in sorted(counts.items())), sep=", ")
    return 1 if counts["WRONG"] else 0


if __name__ == "__main__":
    sys.exit(main())
