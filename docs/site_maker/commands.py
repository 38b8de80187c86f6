"""The page of commands: each verb with its arguments, and those of Python that they stand for."""

from __future__ import annotations

from mbody.cli.help_pages import pairs, sections, summary_of, text_of, usage, written
from mbody.cli.parser import Verb, verbs
from site_maker.elements import escaped

__all__ = ["text"]


def text(_: str) -> str:
    """All commands, each with its arguments."""
    return "\n\n".join(_entry(verb) for verb in verbs().values())


def _entry(verb: Verb) -> str:
    about = summary_of(verb).rstrip(".")
    lines = [f"## mbody {verb.name}", "", f"{escaped(about)}.", ""]
    lines += ["```text", usage(verb), *(f"mbody {one}" for one in verb.examples), "```"]
    rows = [
        f"| {_code(written(option))} | {escaped(text_of(option, verb))} |"
        for options in sections(verb).values()
        for option in options
    ]
    if rows:
        lines += ["", "| argument | meaning |", "|---|---|", *rows]
    if verb.functions:
        lines += ["", "| in Python | here |", "|---|---|"]
    for path, name, options, reason in pairs(verb):
        function = path.rpartition(".")[2]
        here = ", ".join(map(_code, options)) or escaped(reason)
        lines.append(f"| {_code(f'{function}({name}=)')} | {here} |")
    return "\n".join(lines)


def _code(words: str) -> str:
    return "`" + words.replace("|", "\\|") + "`"
