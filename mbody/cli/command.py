"""Arguments, streams, errors and exit status of the command."""

from __future__ import annotations

import contextlib
import gc
import json
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from mbody._version import __version__
from mbody.cli.interrupts import STATUS, interrupt
from mbody.cli.parser import parser_of, verbs
from mbody.cli.streams import UsageError, message, opened, silenced
from mbody.errors import ModelError, SolveError, at_the_command

#: New objects after which cycles are looked for: reading a large file makes millions, and none.
OBJECTS = 200_000


def run_command(argv: Sequence[str] | None = None) -> int:
    """Run the command and give its exit status; see `mbody.cli.main`."""
    if argv is None:
        interrupt.take_over()
        opened()
    arguments = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        # a terminal without Greek letters shows question marks, and no traceback
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # none is suppressed
    try:
        status = _exit_status(arguments)
        if sys.stdout is not None:
            sys.stdout.flush()
        return status
    except BrokenPipeError:
        # the reader has gone, as in `mbody demo | head`: nothing is left to report
        silenced()
        return 1
    except OSError as error:
        silenced()
        message(f"mbody: cannot write the output ({error.strerror or error})")
        return 1
    except KeyboardInterrupt:
        message("mbody: stopped")
        return STATUS
    except MemoryError:
        message("mbody: there is not enough memory for this: request less at once")
        return 1
    finally:
        interrupt.done()


def _exit_status(arguments: list[str]) -> int:
    """The exit status of a command; errors are reported."""
    try:
        return _run(arguments)
    except (ModelError, UsageError) as error:
        _report(error, "--json" in arguments)
        return 2
    except SolveError as error:
        _report(error, "--json" in arguments)
        return 1


def _run(arguments: list[str]) -> int:
    args = parsed(arguments)
    if args is None:
        return 0
    gc.set_threshold(OBJECTS)
    # the function of a command is imported only now: help is there at once
    module, _, function = args.answer.partition(".")
    answer: Callable[[Any], int] = getattr(import_module(f"mbody.cli.{module}"), function)
    with at_the_command():
        return answer(args)


def parsed(words: Sequence[str]) -> Namespace | None:
    """The arguments of a command line; None where it has been answered: --help, --version."""
    asked = words[1:2] if words[:1] == ["help"] else words[:1]
    if asked and asked[0] in ("--version", "-V"):
        print(f"mbody {__version__}")
        return None
    if not asked or asked[0] in ("-h", "--help"):
        from mbody.cli.help_pages import overview

        print(overview())
        return None
    if asked[0] not in verbs():
        from mbody.cli.parser import refusal_of_verb

        raise UsageError(refusal_of_verb(words))
    verb = verbs()[asked[0]]
    if words[0] == "help" or not {"-h", "--help"}.isdisjoint(words[1:]):
        from mbody.cli.help_pages import help_of

        print(help_of(verb))
        return None
    known = verb.long_options()
    options = [word for word in words[1:] if word.startswith("--") and word != "--"]
    unknown = [word for word in options if word[2:].partition("=")[0] not in known]
    if not unknown:
        found, unknown = parser_of(verb).parse_known_args(words[1:])
    if unknown:
        from mbody.cli.parser import refusal_of_words

        raise UsageError(refusal_of_words(verb, unknown, words[1:]))
    return found


def _report(error: Exception, as_json: bool) -> None:
    """An error as a sentence, or as data."""
    if as_json:
        from mbody.files.results import error_data

        print(json.dumps(error_data(error), ensure_ascii=False))
    else:
        message(f"mbody: {error}")
