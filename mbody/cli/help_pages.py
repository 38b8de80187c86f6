"""Help: all verbs on one screen, and one verb, in words of the docstrings of its functions.

Sources are read, nothing of them is imported: help is there at once.
"""

from __future__ import annotations

import ast
import functools
import re
import shutil
import textwrap
from collections.abc import Iterator
from importlib.resources import files
from typing import NamedTuple

from mbody.cli.parser import Option, Verb, verbs

#: Columns of help, and those of the names of options.
WIDTH, NAMES = 100, 26


class Documentation(NamedTuple):
    """A function, as its source says it.

    `summary`: The first paragraph of its docstring.
    `texts`: What the docstring says of its arguments.
    `defaults`: Defaults by argument, None where there is none.
    """

    summary: str
    texts: dict[str, str]
    defaults: dict[str, object]


@functools.cache
def documentation(path: str) -> Documentation:
    """The documentation of a function or class of mbody, such as "sweeps.run.sweep"."""
    *folders, file, name = path.split(".")
    owner = ""
    if file[0].isupper():
        *folders, file, owner = (*folders, file)
    source = files("mbody").joinpath(*folders, f"{file}.py").read_text(encoding="utf-8")
    where: ast.AST = ast.parse(source)
    for wanted in (owner, name) if owner else (name,):
        where = next(
            one
            for one in ast.iter_child_nodes(where)
            if isinstance(one, ast.FunctionDef | ast.ClassDef) and one.name == wanted
        )
    assert isinstance(where, ast.FunctionDef | ast.ClassDef)
    doc = ast.get_docstring(where) or ""
    return Documentation(_plain(doc.partition("\n\n")[0]), _parameters(doc), _defaults(where))


def _defaults(node: ast.FunctionDef | ast.ClassDef) -> dict[str, object]:
    """The arguments of a function, or the fields of a class, with their defaults."""
    found: dict[str, object] = {}
    if isinstance(node, ast.ClassDef):
        fields = [one for one in node.body if isinstance(one, ast.AnnAssign)]
        return {one.target.id: None for one in fields if isinstance(one.target, ast.Name)}
    given = node.args
    plain = [*given.posonlyargs, *given.args]
    values = [None] * (len(plain) - len(given.defaults)) + list(given.defaults)
    for one, value in [
        *zip(plain, values, strict=True),
        *zip(given.kwonlyargs, given.kw_defaults, strict=True),
    ]:
        found[one.arg] = value.value if isinstance(value, ast.Constant) else None
    more = [one.arg for one in (given.vararg, given.kwarg) if one is not None]
    return {name: value for name, value in found.items() if name not in ("self", "cls")} | (
        dict.fromkeys(more)
    )


def _parameters(doc: str) -> dict[str, str]:
    """What a docstring says of each argument."""
    found: dict[str, str] = {}
    section = re.search(r"\nParameters\n-+\n(.*?)(\n\n|\Z)", doc, re.DOTALL)
    entry = r"^(\S.*?) : .*\n((?: +.*\n?)*)"
    for head, text in re.findall(entry, section[1], re.M) if section else ():
        found |= dict.fromkeys(re.split(r",\s*", head), _plain(text))
    return found


def _plain(text: str) -> str:
    """A docstring without its marks."""
    return " ".join(text.replace("`", "").replace('"', "").split())


def text_of(option: Option, verb: Verb) -> str:
    """What help says of an argument: its own text, or the first sentence of the docstring."""
    if option.text:
        return option.text
    for path in verb.functions:
        known = documentation(path)
        for name in option.python:
            if known.texts.get(name):
                text = re.split(r"\.(?: |$)|: by default", known.texts[name])[0]
                default = known.defaults.get(name)
                shown = type(default) in (int, float, str) and default != "" and "defa" not in text
                return text[:1].lower() + text[1:] + (f" ({default})" if shown else "")
    return ""


def summary_of(verb: Verb) -> str:
    """What a verb does, in the words of its function."""
    alone = len(verb.functions) == 1
    summary = documentation(verb.functions[0] if alone else f"cli.{verb.answer}").summary
    return summary[:1].upper() + summary[1:]


def columns() -> int:
    """Columns of help: those of the terminal, at most 100."""
    return max(60, min(WIDTH, shutil.get_terminal_size((WIDTH, 40)).columns))


# -- One verb ----------------------------------------------------------------------------------


def usage(verb: Verb) -> str:
    """A verb with what must be given."""
    words = [f"mbody {verb.name}"]
    for option in verb.options:
        if not option.names[0].startswith("-"):
            more = " …" if option.settings.get("nargs") in ("*", "+") else ""
            word = f"{option.value}{more}"
            words.append(word if option.required else f"[{word}]")
        elif option.required:
            words.append(f"{option.names[0]} {option.value}")
    return " ".join([*words, "[options]"] if any(map(_may_be_given, verb.options)) else words)


def _may_be_given(option: Option) -> bool:
    return option.names[0].startswith("-") and not option.required


def written(option: Option) -> str:
    """The names of an argument and that of its value."""
    if not option.names[0].startswith("-"):
        return option.value
    more = " …" if option.settings.get("action") == "append" else ""
    return f"{', '.join(option.names)} {option.value}".rstrip() + more


def sections(verb: Verb) -> dict[str, list[Option]]:
    """The arguments of a verb below their titles: what it works on, its own, those of several."""
    found: dict[str, list[Option]] = {"": [], "Options": []}
    for option in verb.options:
        title = option.title if option.names[0].startswith("-") else ""
        if not title and option.names[0].startswith("-"):
            title = "Output" if option.settings["dest"] in ("output", "csv", "key") else "Options"
        found.setdefault(title, []).append(option)
    order = ["", "Options", "Instants", "Model", "Output"]
    return {title: found[title] for title in order if found.get(title)}


def help_of(verb: Verb) -> str:
    """Everything about a verb."""
    wide = columns()
    lines = [f"usage: {usage(verb)}", "", *textwrap.wrap(f"{summary_of(verb)}".rstrip("."), wide)]
    for title, options in sections(verb).items():
        lines += ["", *([f"{title}:"] if title else [])]
        for option in options:
            lines += _entry(written(option), text_of(option, verb), wide)
    if verb.examples:
        lines += ["", *(f"  mbody {one}" for one in verb.examples)]
    return "\n".join(lines)


def _entry(head: str, text: str, wide: int) -> list[str]:
    """An argument and its text beside, or below where its name is long."""
    lines = textwrap.wrap(text, wide - NAMES, break_on_hyphens=False) or [""]
    if len(head) + 4 > NAMES:
        return [f"  {head}", *(" " * NAMES + line for line in lines)]
    return [f"  {head:{NAMES - 2}}{lines[0]}".rstrip(), *(" " * NAMES + line for line in lines[1:])]


# -- All verbs ---------------------------------------------------------------------------------

#: The width of the name of a group, of a verb, and of its words.
GROUP, NAME, ABOUT = 10, 15, 30

OPENING = """\
usage: mbody COMMAND MODEL [options]         mbody COMMAND --help says more of each

Planar multibody dynamics: motion and every joint force.
A MODEL is a file, or a name in the list of mbody models.
"""
ENDING = """
  mbody demo                                          a first result
  mbody kinetostatics norton_fourbar --at crank=60    all forces at one position
  mbody new fourbar                                   a model file to begin with"""


def overview() -> str:
    """All verbs in their groups, two in a line."""
    lines = [*OPENING.splitlines(), ""]
    groups: dict[str, list[Verb]] = {}
    for verb in verbs().values():
        groups.setdefault(verb.group, []).append(verb)
    for group, found in groups.items():
        rows = (len(found) + 1) // 2
        for n in range(rows):
            pair = found[n::rows]
            cells = [f"{one.name:{NAME}}{one.about:{ABOUT}}" for one in pair]
            lines.append(f"{group if n == 0 else '':{GROUP}}{''.join(cells)}".rstrip())
    return "\n".join([*lines, *ENDING.splitlines()])


def pairs(verb: Verb) -> Iterator[tuple[str, str, list[str], str]]:
    """The arguments of Python of a verb: function, argument, its options, or why there is none."""
    for path in verb.functions:
        for name in documentation(path).defaults:
            reason = verb.reasons.get(name, "")
            options = [written(one) for one in verb.options if name in one.python and not reason]
            yield path, name, options, reason
