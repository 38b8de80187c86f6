"""The words of the command: which verb they name, and its arguments.

Only argparse is loaded, and only the verb that is named gets a parser: a command begins at once.
"""

from __future__ import annotations

import argparse
import functools
import math
import re
from typing import Any, NamedTuple, NoReturn

from mbody.cli.streams import UsageError
from mbody.cli.verbs import VERBS

# -- Values of options: numbers, names, files -------------------------------------------------


def table_place(path: str) -> str:
    """Where a table goes: standard output by any of its names is printed to, once."""
    return "-" if path == "/dev/stdout" else path


def printed(path: str) -> str | None:
    """A file of text; standard output by any of its names is no file, and the text is printed.

    >>> printed("-"), printed("a.md")
    (None, 'a.md')
    """
    return None if table_place(path) == "-" else path


def model_file(path: str) -> str:
    """A file of a model that is written beside what is printed.

    >>> model_file("design.toml")
    'design.toml'
    """
    if table_place(path) == "-":
        raise argparse.ArgumentTypeError(
            "the model goes to a file, results are printed: give -o a name, such as design.toml"
        )
    return path


def whole_number(text: str) -> int:
    """A number without a sign.

    >>> whole_number("30")
    30
    """
    if not (text.isascii() and text.isdigit()) or len(text) > 9:
        raise argparse.ArgumentTypeError(f"takes a whole number, not {text[:40]!r}")
    return int(text)


def finite_number(text: str) -> float:
    """A number.

    >>> finite_number("2.5")
    2.5
    """
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise argparse.ArgumentTypeError(f"takes a number, not {text[:40]!r}")
    return found


def names_in(text: str) -> list[str]:
    """Names with commas between them.

    >>> names_in("A, B")
    ['A', 'B']
    """
    found = [part.strip() for part in text.split(",") if part.strip()]
    if not found:
        raise argparse.ArgumentTypeError("takes names with commas between them")
    return found


#: What a value becomes, by its name in the declaration, or by the kind of file.
KINDS = {
    "N": whole_number,
    "R": finite_number,
    **dict.fromkeys(("NAMES", "BODIES", "JOINTS", "ENGINES"), names_in),
    "<table>": table_place,
    "<text>": printed,
    "<model>": model_file,
}

# -- The declarations of `mbody.cli.verbs`, read ----------------------------------------------


class Option(NamedTuple):
    """An argument of a verb.

    `value`: The name of its value in help; "" of a switch.
    `python`: Arguments of Python that it gives.
    `settings`: Those of `argparse` besides.
    `title`: Below which help lists it.
    `other`: Whether it excludes the one above it.
    `text`: Its help, "" where a docstring has it.
    """

    names: tuple[str, ...]
    value: str
    python: tuple[str, ...]
    settings: dict[str, Any]
    title: str
    other: bool
    text: str

    @property
    def required(self) -> bool:
        """Whether it must be given."""
        plain = not self.names[0].startswith("-") and self.settings.get("nargs") in (None, "+")
        return plain or self.settings.get("required", False)


class Verb(NamedTuple):
    """A verb of the command.

    `answer`: The function in `mbody.cli` that answers.
    `functions`: The Python functions that it offers, as paths in `mbody`.
    `about`: What it is for, in a few words.
    `reasons`: Why there is no option, by arguments of Python.
    """

    name: str
    group: str
    answer: str
    functions: tuple[str, ...]
    about: str
    options: list[Option]
    examples: list[str]
    reasons: dict[str, str]

    def long_options(self) -> list[str]:
        """Its options, without their hyphens."""
        return [name[2:] for one in self.options for name in one.names if name.startswith("--")]


@functools.cache
def verbs() -> dict[str, Verb]:
    """All verbs by name."""
    shared: dict[str, Verb] = {}
    found: dict[str, Verb] = {}
    group = ""
    for line in re.sub(r"\n {8}", " ", VERBS).splitlines():
        if line.startswith("= "):
            group = line[2:]
        elif line.startswith("@"):
            name, _, group = line.partition(" ")
            verb = shared[name] = Verb(name, group, "", (), "", [], [], {})
        elif not line.startswith(" "):
            head, _, about = line.partition(": ")
            name, answer, *functions = head.split()
            verb = Verb(name, group, answer, tuple(functions), about, [], [], {})
            found[name] = verb
        else:
            _add(verb, line.strip(), shared)
    return found


def _add(verb: Verb, line: str, shared: dict[str, Verb]) -> None:
    """Add what a line below a verb, or below arguments of several, declares."""
    if line.startswith("@"):
        for name in line.split():
            verb.options.extend(shared[name].options)
            verb.reasons.update(shared[name].reasons)
    elif line.startswith("$ "):
        verb.examples.append(line[2:])
    elif line.startswith("not "):
        names, _, why = line[4:].partition(": ")
        verb.reasons.update(dict.fromkeys(names.split(), why))
    else:
        verb.options.append(_option(line, "" if verb.answer else verb.group))


def _option(line: str, title: str) -> Option:
    """An argument from its declaration."""
    head, _, text = line.removeprefix("or ").partition(": ")
    names: list[str] = []
    settings: dict[str, Any] = {}
    value, target = "", ""
    python: tuple[str, ...] = ()
    for word in head.split():
        if word.startswith("->"):
            target = word[2:]
        elif word.startswith("-") or not names:
            names.append(word)
        elif word == "...":
            settings |= {"action": "append", "default": []}
        elif word == "!":
            settings["required"] = True
        elif word in ("?", "*", "+"):
            settings["nargs"] = word
            if word == "*":
                settings["default"] = []
        elif word.startswith("="):
            settings["default"] = word[1:]
        elif word.startswith("("):
            python = tuple(word[1:-1].split(","))
        elif word.startswith("<"):
            settings["type"] = KINDS[word]
        else:
            value = word
            if word.startswith("{"):
                settings["choices"] = tuple(word[1:-1].split(","))
            elif word in KINDS:
                settings["type"] = KINDS[word]
    if settings.get("type") is names_in:
        settings |= {"action": "extend", "default": []}
    if names[0].startswith("-"):
        target = target or names[-1].lstrip("-").replace("-", "_")
        settings["dest"] = target
        if not value:
            settings["action"] = "store_true"
    elif names[0].isupper():
        value, target = names[0], names[0].lower()
        names[0] = target
    if value and not value.startswith("{"):
        settings["metavar"] = value
    own = python or (target or names[0],)
    return Option(tuple(names), value, own, settings, title, line.startswith("or "), text)


# -- The words of a command line ---------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Errors are raised, so that they are reported like all others.

    `verb`: Whose arguments they are.
    """

    verb: Verb

    def error(self, message: str) -> NoReturn:
        """Raise what is wrong with the arguments."""
        if lacking := re.match(r"the following arguments are required: (.*)", message):
            such = f", as in mbody {self.verb.examples[0]}" if self.verb.examples else ""
            message = f"{self.verb.name} needs {lacking[1]}{such}"
        if said := re.match(r"argument (?:\S+/)?(\S+): (takes .*)", message):
            raise UsageError(f"{said[1]} {said[2]}")
        message = message if len(message) <= 300 else f"{message[:297]}..."
        raise UsageError(f"{message} (see {self.prog} --help)")


def parser_of(verb: Verb) -> argparse.ArgumentParser:
    """The parser of a verb; `answer` of what it parses names the function in `mbody.cli`."""
    made = _Parser(prog=f"mbody {verb.name}", allow_abbrev=False, add_help=False)
    made.verb = verb
    made.set_defaults(answer=verb.answer, command=verb.name)
    either: Any = made
    for n, option in enumerate(verb.options):
        if not option.other:
            excludes = n + 1 < len(verb.options) and verb.options[n + 1].other
            either = made.add_mutually_exclusive_group() if excludes else made
        either.add_argument(*option.names, **option.settings)
    return made
