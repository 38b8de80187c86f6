"""`python -m tests.fuzz --runs N [--seed S] [--plain | --kept]`."""

import argparse
import sys
import tempfile
from pathlib import Path

from tests.fuzz import KEPT, KINDS

MISSING = (
    "atheris is not installed: pip install 'mbody-planar[fuzz]' (Linux and macOS), or use "
    "--plain, which needs nothing"
)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description="Fuzz the door.")
    parser.add_argument("--runs", type=int, default=100_000, help="how many inputs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plain", action="store_true", help="without atheris, on any Python")
    parser.add_argument(
        "--kept", action="store_true", help="saved results and sweep folders, which are corrupted"
    )
    parser.add_argument("--kinds", nargs="+", choices=(*KINDS, *KEPT))
    parser.add_argument("--save", type=Path, default=Path(".fuzz"), help="where failures go")
    parser.add_argument("--again", type=Path, help="check one saved input once more")
    asked = parser.parse_args()
    kinds = asked.kinds or list(KEPT if asked.kept else KINDS)
    if asked.kept != any(kind in KEPT for kind in kinds):
        parser.error(f"--kept takes {', '.join(KEPT)}, without it there are {', '.join(KINDS)}")
    if not asked.plain and not asked.kept and not asked.again:
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
        if kind in KEPT:
            from tests.fuzz import kept

            with tempfile.TemporaryDirectory() as folder:
                right = kept.check(kind, text, Path(folder))
        else:
            right = check(kind, text, asked.again.suffix == ".json")
        print("right" if right else "refused")
        return 0
    report = Report(asked.save)
    try:
        if asked.kept:
            from tests.fuzz import kept

            kept.fuzz(asked.runs, asked.seed, report, kinds)
        else:
            if not asked.plain:
                guided(asked.runs, asked.seed, report, kinds)
            fuzz(asked.runs, asked.seed, report, kinds)
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
    print(report)
    return 1 if report.failures else 0


if __name__ == "__main__":
    sys.exit(main())
