"""`python -m tests.fuzz --runs N [--seed S] [--plain]`."""

import argparse
import sys
from pathlib import Path

from tests.fuzz import KINDS

MISSING = (
    "atheris is not installed: pip install 'mbody[fuzz]' (Linux and macOS), or use --plain, which "
    "needs nothing"
)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description="Fuzz the door.")
    parser.add_argument("--runs", type=int, default=100_000, help="how many inputs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plain", action="store_true", help="without atheris, on any Python")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--save", type=Path, default=Path(".fuzz"), help="where failures go")
    parser.add_argument("--again", type=Path, help="check one saved input once more")
    asked = parser.parse_args()
    if not asked.plain and not asked.again:
        try:
            from tests.fuzz.guided import guided
        except ImportError as error:
            if error.name != "atheris":
                raise
            print(MISSING, file=sys.stderr)
            return 2
    from tests.fuzz.plain import Report, check, fuzz

    if asked.again:
        text = asked.again.read_bytes().decode("utf-8", "surrogatepass")
        kind = asked.again.name.partition("-")[0]
        print("right" if check(kind, text, asked.again.suffix == ".json") else "refused")
        return 0
    report = Report(asked.save)
    try:
        if not asked.plain:
            guided(asked.runs, asked.seed, report, asked.kinds)
        fuzz(asked.runs, asked.seed, report, asked.kinds)
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
    print(report)
    return 1 if report.failures else 0


if __name__ == "__main__":
    sys.exit(main())
