"""`python -m mbody` is the command `mbody`."""

import sys

from mbody.cli import main

if __name__ == "__main__":
    sys.exit(main())
