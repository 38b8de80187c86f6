"""All errors of a model file at once: file, line, field and a sentence."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import json
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from mbody import laws
from mbody.core.former_names import former
from mbody.core.other_words import KINDS, meant
from mbody.errors import ModelError, brief, remedy
from mbody.model import driver, joints, loads
from mbody.model.element import Element

# -- Elements of a model file, and the words for them ------------------------------------------
# Joints, loads and laws are taken from the classes themselves, so that a new one appears in files,
# in the schema and in the messages as soon as it is written.


def _word(name: str) -> str:
    """``TorsionSpring`` → ``torsion_spring``, ``DCMotor`` → ``dc_motor``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def _elements(module: Any, base: type[Element], ending: str = "") -> dict[str, type[Element]]:
    """Classes of elements by their word, in its alphabetical order."""
    classes = [cls for cls in vars(module).values() if isinstance(cls, type)]
    found = {
        _word(cls.__name__.removesuffix(ending)): cls
        for cls in classes
        if issubclass(cls, base) and cls is not base and not cls.__name__.startswith("Custom")
    }
    return dict(sorted(found.items()))


class Kinds(Mapping[str, type[Element]]):
    """Kinds of elements that most files have none of, by word their ``module:class``: loaded when
    one is asked for.
    """

    def __init__(self, **places: str) -> None:
        self.places = places

    def __getitem__(self, word: str) -> type[Element]:
        module, _, name = self.places[word].partition(":")
        found: type[Element] = getattr(importlib.import_module(module), name)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)


#: Kinds of elements by section of a file.
SECTIONS: dict[str, Mapping[str, type[Element]]] = {
    "joints": _elements(joints, joints.Joint),
    "couplings": Kinds(
        angle="mbody.model.coupling:AngleCoupling", length="mbody.model.coupling:LengthCoupling"
    ),
    "drivers": _elements(driver, driver.Driver, "Driver"),
    "loads": _elements(loads, loads.Load),
    "contacts": Kinds(
        between="mbody.model.contact:Between",
        contact="mbody.model.contact:Contact",
        rope="mbody.model.contact:Rope",
        freewheel="mbody.model.stop:Freewheel",
        stop="mbody.model.stop:Stop",
    ),
}

#: Laws by their word: those of `mbody.laws`, less what is no table of numbers in a file.
LAWS: dict[str, type[laws.Law]] = {
    _word(cls.__name__): cls
    for cls in map(vars(laws).get, dict.fromkeys([*laws.__all__, *vars(laws)]))
    if isinstance(cls, type)
    and issubclass(cls, laws.Law)
    and cls not in (laws.Law, laws.Expression, laws.Function, laws.MeasuredFormula, laws.Table2)
}


def written_fields(cls: type[Element]) -> list[dataclasses.Field[Any]]:
    """The fields of a class of elements that a file has, less its name."""
    every = dataclasses.fields(cls)
    return [one for one in every if one.name != "name" and not one.metadata.get("internal")]


@functools.lru_cache
def _words() -> dict[type, tuple[str, str]]:
    return {cls: (s, kind) for s, kinds in SECTIONS.items() for kind, cls in kinds.items()}


def kind_in(section: str, given: Any) -> str | None:
    """The word by which a table of a section names its kind, the usual one or another."""
    # "angle" is a kind of driver and a field of forces and places: the first kind counts
    words = _words_in(section) if isinstance(given, dict) else ()
    return next((word for word in words if word in given), None)


@functools.cache
def _words_in(section: str) -> tuple[str, ...]:
    """All words for kinds of a section, in the order of the kinds."""
    return tuple(word for kind in SECTIONS[section] for word in (kind, *also_written(kind)))


def also_written(kind: str) -> list[str]:
    """Other words that files take for a kind."""
    return [word for word, one in KINDS.items() if one == kind]


def kind_of(element: Element) -> str | None:
    """The word for an element's kind; None where files have none."""
    return _words().get(type(element), ("", None))[1]


# -- The line of a file that has a key: found only when there is an error to report ------------

KeyPath = tuple[Any, ...]
#: Under which the text of its file is kept with a mechanism, so that copies of that have it too.
TEXT_ATTRIBUTE = "file_text"

#: Whatever in TOML may hold signs that mean nothing there: long texts and comments. One that does
#: not end goes on to the end of the file, so that a search never looks twice at it.
TEXTS = (
    r'"""(?:[^"\\]++|\\.|"{1,2}(?!"))*+(?:"{3,5}|\Z)'
    r"|'{3}(?:[^']++|'{1,2}(?!'))*+(?:'{3,5}|\Z)"
    r"|#[^\n]*+"
)
_JSON = re.compile(r'"(?:[^"\\]++|\\.)*+"|[{}\[\]:,\n]', re.DOTALL)


def lines_of(text: str, is_json: bool, paths: Sequence[KeyPath]) -> list[int | None]:
    r"""The lines, from 1, of the keys at these paths, or of the nearest that contain them.

    >>> lines_of('a = 1\n[b]\nc = 2', False, [("b", "c"), ("b", "d")])
    [3, 2]
    >>> lines_of('{"a": 1,\n"b": {"c": 2}}', True, [("b",)])
    [2]
    """
    if not is_json:
        from mbody.files.toml_spans import Spans

        spans = Spans(text)
        return [spans.line(path) for path in paths]
    holders = {path[:n] for path in paths for n in range(1, len(path) + 1)}
    found: dict[KeyPath, int] = {}
    for place, line in _json_places(text):
        if place in holders:
            found.setdefault(place, line)
    return [
        next((found[path[:n]] for n in range(len(path), 0, -1) if path[:n] in found), None)
        for path in paths
    ]


def _json_places(text: str) -> Iterator[tuple[KeyPath, int]]:
    """Paths of all keys and of all entries of lists."""
    stack: list[Any] = []
    line, last = 1, ""
    for match in _JSON.finditer(text):
        token = match.group()
        if token == "{":
            stack.append(None)
        elif token == "[":
            stack.append(0)
        elif token in "}]":
            if stack:
                stack.pop()
        elif token == "," and stack and isinstance(stack[-1], int):
            stack[-1] += 1
        elif token == ":" and stack:
            stack[-1] = _key(last)
            yield tuple(stack), line
        elif token.startswith('"'):
            last = token
        line += token.count("\n")


def _key(written: str) -> str:
    try:
        return str(json.loads(written))
    except ValueError:
        return written


# -- Limits of model files: hostile ones are refused in bounded time ---------------------------

#: Raises the limits of all model files that a process reads, so many times.
VARIABLE = "MBODY_LIMITS"


@dataclass(frozen=True)
class Limits:
    """How large a model file may be that is read or written.

    The limits keep a hostile file from taking a machine's time; they let chains of more than 10 000
    links pass. Whoever knows a file can raise them.

    `size`: Bytes of the file.
    `values`: Numbers, texts, lists and tables in all.
    `operations`: Operators, brackets and commas of its formulas in all.

    Examples
    --------
    >>> Limits(size=50e6, values=5e6).size
    50000000.0
    >>> Limits().times(10).values
    3000000.0
    """

    size: float = 6e6
    values: float = 300e3
    operations: float = 150e3

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            sound = isinstance(value, int | float) and not isinstance(value, bool)
            if not sound or math.isnan(value) or value <= 0:
                raise ModelError(
                    f"limits: {field.name} must be a positive number, not {brief(value)}"
                )

    def times(self, factor: float) -> Limits:
        """All of them so many times."""
        return Limits(*(getattr(self, field.name) * factor for field in fields(self)))

    def over(self, what: str, **found: float) -> str | None:
        """The sentence of a file that has more than is allowed of one thing, else None.

        >>> Limits().over("it", size=20e6)  # doctest: +ELLIPSIS
        'it has more than 6 MB: raise the limits if you trust it, by limits=...'
        """
        for name, count in found.items():
            most = getattr(self, name)
            if count > most:
                factor = math.ceil(2 * count / getattr(Limits(), name))
                amount = f"{most / 1e6:g} MB" if name == "size" else f"{most:.0f} {WORDS[name]}"
                how = remedy(
                    python=f"by limits=mbody.files.model.Limits({name}={2 * count:.1g}) "
                    "of load and save",
                    command=f"by {VARIABLE}={factor:.0f} before the command",
                )
                return f"{what} has more than {amount}: raise the limits if you trust it, {how}"
        return None


WORDS = {"values": "values", "operations": "operations in its formulas"}


def limits_of(given: Limits | None) -> Limits:
    """The limits that are given, else those of the process."""
    if given is None:
        text = os.environ.get(VARIABLE, "1")
        try:
            return Limits().times(float(text))
        except (ValueError, ModelError):
            raise ModelError(
                f"the environment variable {VARIABLE} must be a positive number, such as 10, not "
                f"{brief(text)}"
            ) from None
    if not isinstance(given, Limits):
        raise ModelError(
            f"limits must be mbody.files.model.Limits(size=..., values=...), not {brief(given)}"
        )
    return given


MOST = 20  # problems that are reported
ENOUGH = 80  # that are looked at, and put in order; the others are counted
LONGEST = 600  # characters of a sentence
TABLES = ("bodies", *SECTIONS, "ground", "gravity", "parameters", "curves", "inputs", "states")
TABLES += ("quantities", "measures", "ask", "simulate")


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong."""

    path: KeyPath
    message: str


def example(path: KeyPath) -> str:
    """Where an example is, of what is wrong in the table of an element behind its kind."""
    if len(path) == 1 and path[0] in TABLES:
        return f" (mbody explain {path[0]} shows one)"
    if len(path) < 3 or path[2] not in SECTIONS.get(str(path[0]), {}):
        return ""
    return f" (mbody explain {path[2]} shows an example)"


def short(value: Any) -> str:
    """A value or a key, without the quotes of a text."""
    text = value if isinstance(value, str) else brief(value, 40)
    return text if len(text) <= 40 else text[:37] + "..."


def _cut(sentence: str) -> str:
    """A sentence without its middle, where it is very long."""
    half = LONGEST // 2
    return sentence if len(sentence) <= LONGEST else f"{sentence[:half]} … {sentence[-half:]}"


def unknown_key(key: Any, known: list[str], given: Mapping[str, Any], path: KeyPath) -> str:
    """Why a key is refused: a former name, a second kind of element, a slip of the pen, another
    word for a section, or one too many.
    """
    if sentence := former(f"[{path[0] if path else key}] {key}"):
        return sentence
    section = str(path[0]) if path else ""
    if section in SECTIONS and kind_in(section, {key: None}):
        first = kind_in(section, {one: None for one in given if one != key})
    else:
        first = None
    if first is not None:
        return f"names a second kind of element beside '{first}': keep one of them"
    if intended := meant(key, [one for one in known if one != "$schema"]):
        return f"there is no such key, did you mean '{intended}'?"
    # the tables of a file are what somebody looks for who has another word for one
    left = sorted(
        (w for w in known if w not in (*given, "$schema")), key=lambda word: word not in TABLES
    )
    more = f", … and {len(left) - MOST} more" if len(left) > MOST else ""
    return f"there is no such key (there are: {', '.join(left[:MOST])}{more})"


def no_kind(section: str, name: str, given: Any) -> str:
    """Why an element is refused whose table names no kind."""
    if name in (*TABLES, "units", "name", "angle"):
        return (
            f"is read as one of [{section}], below whose line it stands: put it above all "
            "tables, or give it a table of its own"
        )
    kinds = [*SECTIONS[section]]
    says = f"names no kind of {section.removesuffix('s')} (there are: {', '.join(kinds)})"
    for key in [*given][:MOST] if isinstance(given, dict) else ():
        if sentence := former(f"[{section}] {key}"):
            return sentence
        if intended := meant(key, [*kinds, *(word for word in KINDS if KINDS[word] in kinds)]):
            return f"{says}: it has '{short(key)}', did you mean '{intended}'?"
    return says


def raise_all(
    problems: list[Problem], text: str, is_json: bool, name: str, count: int | None = None
) -> None:
    """Raise one error with all problems, in the order of the file; `count` is how many there
    are, None where nobody looked further than to the first `ENOUGH`.
    """
    if not problems:
        return
    problems = problems[:ENOUGH]
    lines_found = lines_of(text, is_json, [problem.path for problem in problems])
    entries = [
        (line, ".".join(short(key) for key in problem.path), _cut(problem.message))
        for line, problem in zip(lines_found, problems, strict=True)
    ]
    entries = sorted(dict.fromkeys(entries), key=lambda entry: entry[0] or 0)
    lines = [
        ": ".join(part for part in (f"line {line}" if line else "", field, message) if part)
        for line, field, message in entries[:MOST]
    ]
    if count is None and len(problems) == ENOUGH:
        lines.append("and more")
    elif (left := (count or len(entries)) - MOST) > 0:
        lines.append(f"and {left} more")
    element = next((name for name in map(_element, problems) if name), None)
    whole = f"{name}: {lines[0]}" if len(lines) == 1 else "\n  ".join([f"{name}:", *lines])
    error = ModelError(whole, element)
    error.problems = tuple(entries)
    raise error


def _element(problem: Problem) -> str | None:
    """The name of the element or parameter that a problem is about."""
    section = problem.path[0] if problem.path else None
    if section in ("ground", "gravity"):
        return str(section)
    tables = ("bodies", "parameters", "curves", "inputs", "states", "quantities", "measures")
    return (
        str(problem.path[1]) if section in (*SECTIONS, *tables) and len(problem.path) > 1 else None
    )
