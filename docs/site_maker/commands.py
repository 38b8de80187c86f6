"""The page of commands: usage, arguments and examples, from the parser of the command."""

from __future__ import annotations

import argparse
from typing import Any

from mbody.cli.parser import parser
from site_maker.elements import escaped

__all__ = ["text"]


def text(_: str) -> str:
    """All commands, each with its arguments."""
    made: Any = parser()
    (commands,) = (
        action for action in made._actions if isinstance(action, argparse._SubParsersAction)
    )
    about = {action.dest: action.help for action in commands._choices_actions}
    parts = [_entry(name, about[name], one) for name, one in commands.choices.items()]
    examples = (made.epilog or "").partition("\n")[2]
    return "\n\n".join(["## Examples", f"```text\n{examples}\n```", *parts])


def _entry(name: str, about: str, made: Any) -> str:
    lines = [f"## mbody {name}", "", f"{escaped(about[:1].upper() + about[1:])}.", ""]
    formatter = argparse.HelpFormatter(prog=f"mbody {name}", width=88)
    formatter.add_usage(None, made._actions, made._mutually_exclusive_groups, prefix="")
    lines += ["```text", formatter.format_help().rstrip(), "```", ""]
    shown = [action for action in made._actions if action.dest != "help"]
    if shown:
        lines += ["| argument | meaning |", "|---|---|"]
    for action in shown:
        lines.append(f"| {_argument(action)} | {escaped(_help(action, made))} |")
    if made.epilog:
        lines += ["", "```text", made.epilog.rstrip(), "```"]
    return "\n".join(lines)


def _argument(action: Any) -> str:
    named = ", ".join(action.option_strings)
    value = action.metavar or (action.dest.upper() if action.nargs != 0 else "")
    if action.choices and not action.metavar:
        value = "{" + ",".join(map(str, action.choices)) + "}"
    value = "" if action.nargs == 0 else str(value)
    return "`" + f"{named} {value}".strip().replace("|", "\\|") + "`"


def _help(action: Any, made: Any) -> str:
    return " ".join((made._get_formatter()._expand_help(action) if action.help else "").split())
