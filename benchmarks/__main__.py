"""``python -m benchmarks [QUESTION…] [--short] [--json] [--save] [--page]``: measure and print."""

import os
import sys


def run() -> int:
    """One thread for every library, which is said before any of them is loaded."""
    for library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    from benchmarks.command import main

    return main()


if __name__ == "__main__":
    sys.exit(run())
