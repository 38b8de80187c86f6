"""The command `mbody`: models in, answers out, for people and for scripts."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from mbody.cli.parser import parser
from mbody.cli.usage import UsageError
from mbody.errors import ModelError, SolveError

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
        0; 1 where an analysis could not give what was asked, or was stopped; 2 for bad input. The
        sentence that says why goes to stderr, or with --json to stdout as data.

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
    arguments = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        # a terminal without Greek letters shows question marks, and no traceback
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        status = _run(arguments)
        sys.stdout.flush()
        return status
    except BrokenPipeError:
        # the reader has gone, as in `mbody demo | head`: nothing to say, and nowhere to say it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (ModelError, UsageError) as error:
        _tell(error, "--json" in arguments)
        return 2
    except SolveError as error:
        _tell(error, "--json" in arguments)
        return 1
    except KeyboardInterrupt:
        print("\nmbody: stopped", file=sys.stderr)
        return 1


def _run(arguments: list[str]) -> int:
    root = parser()
    asked = root.parse_args(arguments)
    if asked.command is None:
        root.print_help()
        return 0
    # what answers is imported only now: help is there at once
    module, _, function = asked.answer.partition(".")
    answer: Callable[[Any], int] = getattr(import_module(f"mbody.cli.{module}"), function)
    return answer(asked)


def _tell(error: Exception, as_json: bool) -> None:
    """An error as a sentence, or as data."""
    if as_json:
        from mbody.io.results import error_data

        print(json.dumps(error_data(error), ensure_ascii=False))
    else:
        print(f"mbody: {error}", file=sys.stderr)
