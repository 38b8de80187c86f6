"""The command `mbody`: models in, answers out, for people and for scripts."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from mbody.cli.interrupts import STATUS, stop
from mbody.cli.parser import parser
from mbody.cli.streams import opened, say, silenced
from mbody.cli.usage import UsageError
from mbody.errors import ModelError, SolveError, at_the_command

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and give its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments, by default those of the process.

    Returns
    -------
    int
        0; 1 where an analysis could not give what was asked, or was stopped with what it had, or
        where the output cannot be written; 2 for bad input; 130 where Ctrl-C ended it. The sentence
        that says why goes to stderr, or with --json to stdout as data.

    Raises
    ------
    SystemExit
        For --help and --version.

    Examples
    --------
    >>> main([])  # doctest: +ELLIPSIS
    usage: mbody ...
    0
    """
    if argv is None:
        stop.take_over()
        opened()
    arguments = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        # a terminal without Greek letters shows question marks, and no traceback
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        status = _answered(arguments)
        if sys.stdout is not None:
            sys.stdout.flush()
        return status
    except BrokenPipeError:
        # the reader has gone, as in `mbody demo | head`: nothing to say, and nowhere to say it
        silenced()
        return 1
    except OSError as error:
        silenced()
        say(f"mbody: cannot write the output ({error.strerror or error})")
        return 1
    except KeyboardInterrupt:
        say("mbody: stopped")
        return STATUS
    except MemoryError:
        say("mbody: there is not enough memory for this: ask for less at once")
        return 1
    finally:
        stop.done()


def _answered(arguments: list[str]) -> int:
    """The status of a command, its errors told."""
    try:
        return _run(arguments)
    except (ModelError, UsageError) as error:
        _tell(error, "--json" in arguments)
        return 2
    except SolveError as error:
        _tell(error, "--json" in arguments)
        return 1
    except SystemExit:
        # of --help: what was printed is written now, while it can be told that it cannot
        if sys.stdout is not None:
            sys.stdout.flush()
        raise


def _run(arguments: list[str]) -> int:
    root = parser()
    asked = root.parse_args(arguments)
    if asked.command is None:
        root.print_help()
        return 0
    # what answers is imported only now: help is there at once
    module, _, function = asked.answer.partition(".")
    answer: Callable[[Any], int] = getattr(import_module(f"mbody.cli.{module}"), function)
    with at_the_command():
        return answer(asked)


def _tell(error: Exception, as_json: bool) -> None:
    """An error as a sentence, or as data."""
    if as_json:
        from mbody.files.results import error_data

        print(json.dumps(error_data(error), ensure_ascii=False))
    else:
        say(f"mbody: {error}")
