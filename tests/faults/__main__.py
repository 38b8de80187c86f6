"""``python -m tests.faults [WORD]``: plant the faults whose names hold WORD; who sees them."""

from __future__ import annotations

import sys

from tests.faults.catalogue import FAULTS, MOVING_FAULTS
from tests.faults.plant import seen_by


def main(words: list[str]) -> int:
    """A line a fault; 1 where one is seen by too few engines."""
    poor = 0
    for fault in (*FAULTS, *MOVING_FAULTS):
        if all(word in fault.name for word in words):
            engines = seen_by(fault)
            poor += len(engines) < (2 if fault in FAULTS else 1)
            print(f"{fault.name:<66} {', '.join(engines) or 'NOBODY'}", flush=True)
    return 1 if poor else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
