"""`python -m mbody`, and the script `mbody`: the command."""

import sys

from mbody.cli.interrupts import interrupt

__all__ = ["run"]


def run() -> int:
    """The command with the arguments of the process; gives its exit status."""
    interrupt.take_over()  # before anything is loaded that takes time
    from mbody.cli import main

    return main()


if __name__ == "__main__":
    sys.exit(run())
