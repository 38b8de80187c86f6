"""Standard output and standard error that are closed, full, or no longer read."""

from __future__ import annotations

import contextlib
import csv
import os
import signal
import sys
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


# -- What is wrong with a command line ---------------------------------------------------------


class UsageError(ValueError):
    """The command was not understood."""

    element: str | None = None


def opened() -> None:
    """Give a process streams where it was started without: what is printed to a closed output is
    refused by the system, and a file that is opened later does not take the place of either.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            # of output for reading only: printing fails, as it would to what is closed
            kind = os.O_WRONLY if number == 2 else os.O_RDONLY
            made = os.open(os.devnull, kind)
            if made != number:
                os.dup2(made, number)
                os.close(made)
    sys.stdin = sys.stdin or _stream(0, "r")
    sys.stdout = sys.stdout or _stream(1, "w")
    sys.stderr = sys.stderr or _stream(2, "w")


def _stream(number: int, mode: str) -> IO[str]:
    return open(number, mode, encoding="utf-8", errors="replace", closefd=False)


def message(text: str, *, end: str = "\n") -> None:
    """Print to standard error, if it is open."""
    if sys.stderr is not None:
        try:
            print(text, end=end, file=sys.stderr, flush=True)
        except (OSError, ValueError):
            silenced(sys.stderr)


def silenced(stream: Any = None) -> None:
    """Lead a stream, by default standard output, to nowhere: what is left of it cannot be written,
    and the end of the process would report it once more.
    """
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, (sys.stdout if stream is None else stream).fileno())
        os.close(nowhere)


# -- Tables of results: written to a file, or printed in place of the sheet --------------------

#: In place of the name of a file: the table is printed, and no sheet.
PRINTED = "-"


def check_printed(args: Any) -> None:
    """Refuse a table and data in one place, before an analysis runs."""
    if args.json and args.csv == PRINTED:
        raise UsageError("--json and --csv - print to the same place: give --csv a file")


def write_rows(
    path: str, head: Sequence[str], rows: Iterable[Sequence[Any]], what: str = ""
) -> None:
    """A table with a line of headings, printed or in a file; `what` the message of a file adds."""
    from mbody.files.writing import writing

    printed = path == PRINTED
    with nullcontext(sys.stdout) if printed else writing(path) as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(head)
        lines.writerows(rows)
    if not printed:
        message(f"wrote {path}{what}")


# -- Ctrl-C, as the command takes it: one line and the status 130, at any moment ---------------
#
# Python's own way is an exception, which arrives wherever the interpreter is: within an import, a
# callback, the end of the process. Here the process ends at once. Only a motion or a sweep that is
# under way stops at its next mark and is kept; Ctrl-C once more ends that too.
#
# Nothing but the standard library is loaded, so that it can be the first thing that a process does.

# `typing` and `threading` take longer to load than a key is pressed
TYPE_CHECKING = False


#: The exit status of shells for a process that Ctrl-C has ended.
STATUS = 130
LINE = b"mbody: stopped\n"


class Interrupt:
    """What happens at Ctrl-C.

    Attributes
    ----------
    requested : bool
        Whether what is under way is to stop at its next mark.
    """

    def __init__(self) -> None:
        self.requested = self.waiting = False

    def take_over(self) -> None:
        """Answer Ctrl-C from now on; only the main thread can, and nothing that is ignored is."""
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            return
        try:
            signal.signal(signal.SIGINT, self)
        except ValueError:  # not in the main thread
            return

    def __call__(
        self,
        number: int,
        frame: Any,
        # at the end of a process the names of a module may be gone
        write: Callable[[int, bytes], int] = os.write,
        end: Callable[[int], Any] = os._exit,
    ) -> None:
        """Answer one Ctrl-C: wait for the next mark, or end the process with one line."""
        if self.waiting and not self.requested:
            self.requested = True
            return
        try:
            write(2, LINE)
        finally:
            end(STATUS)

    def mark(self) -> None:
        """What is under way can stop here with what it has."""
        self.waiting = True
        if self.requested:
            self.requested = False
            raise KeyboardInterrupt

    def done(self) -> None:
        """Nothing is under way any more that could be kept."""
        self.requested = self.waiting = False


#: Of this process.
interrupt = Interrupt()
