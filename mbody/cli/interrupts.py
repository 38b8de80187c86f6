"""Ctrl-C, as the command takes it: one line and the status 130, at any moment.

Python's own way is an exception, which arrives wherever the interpreter is: within an import, a
callback, the end of the process. Here the process ends at once. Only a motion or a sweep that is
under way stops at its next mark and is kept; Ctrl-C once more ends that too.

Nothing but the standard library is loaded, so that it can be the first thing that a process does.
"""

from __future__ import annotations

import os
import signal

# `typing` and `threading` take longer to load than a key is pressed
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


#: The exit status of shells for a process that Ctrl-C has ended.
STATUS = 130
LINE = b"mbody: stopped\n"


class Interrupt:
    """Handler of Ctrl-C.

    `requested`: Whether what is under way is to stop at its next mark.
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
        """A point where the work can stop with the results it has.

        Raises KeyboardInterrupt where Ctrl-C requested it since the last mark.
        """
        self.waiting = True
        if self.requested:
            self.requested = False
            raise KeyboardInterrupt

    def done(self) -> None:
        """Nothing is under way any more that could be kept."""
        self.requested = self.waiting = False


#: Of this process.
interrupt = Interrupt()
