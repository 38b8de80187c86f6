"""`python -m mbody`, and the script `mbody`: the command."""

import os
import sys

from mbody.cli.interrupts import interrupt


def run() -> int:
    """The command with the arguments of the process; gives its exit status."""
    interrupt.take_over()  # before anything is loaded that takes time
    # the matrices of the cross-check are small: further threads of BLAS only wait for work,
    # and double the processor time; read when numpy is loaded
    for library in ("OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    from mbody.cli import main

    return main()


if __name__ == "__main__":
    sys.exit(run())
