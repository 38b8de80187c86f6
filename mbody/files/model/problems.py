"""What is wrong with a model file, all of it at once: file, line, field and a sentence."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import Any

from mbody.errors import ModelError, brief
from mbody.files.model.kinds import SECTIONS
from mbody.files.model.lines import lines_of

__all__ = ["ENOUGH", "Problem", "raise_all", "sentences"]

STUDIES = ("measures", "ask", "simulate")
MOST = 20  # problems that are reported
ENOUGH = 80  # that are looked at, and put in order; the others are counted
LONGEST = 600  # characters of a sentence
TABLES = ("bodies", *SECTIONS, "ground", "gravity", "parameters", "curves", "inputs", "states")
TABLES += STUDIES
#: What others call the sections of a file.
OTHER_WORDS = {
    **dict.fromkeys(("links", "link", "body", "members", "parts", "rigid_bodies"), "bodies"),
    **dict.fromkeys(("pins", "joint", "constraints", "pairs", "connections"), "joints"),
    **dict.fromkeys(("motors", "motor", "driver", "actuators"), "drivers"),
    **dict.fromkeys(("forces", "load", "springs", "dampers", "torques"), "loads"),
    **dict.fromkeys(("belts", "ropes", "coupling"), "couplings"),
    **dict.fromkeys(("frame", "fixed", "base", "world"), "ground"),
    **dict.fromkeys(("variables", "constants", "params", "parameter"), "parameters"),
    **dict.fromkeys(("outputs", "measure", "sensors", "quantities"), "measures"),
    **dict.fromkeys(("input", "controls", "commands", "signals"), "inputs"),
    **dict.fromkeys(("state", "own_states", "odes", "integrators", "filters"), "states"),
    **dict.fromkeys(("simulation", "motion", "run"), "simulate"),
}

Path = tuple[Any, ...]


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong."""

    path: Path
    message: str


def sentences(errors: list[Any], schema: dict[str, Any], data: Any) -> list[Problem]:
    """Problems from what pydantic found, the first of them."""
    return [Problem(_plain(e["loc"]), _sentence(e, schema, data)) for e in errors[:ENOUGH]]


def _plain(location: Path) -> Path:
    """The path as the user wrote it, without the marks of the forms that a field may have."""
    marks = ("<", "[key]")
    return tuple(p for p in location if not (isinstance(p, str) and p.startswith(marks)))


def _sentence(error: Any, schema: dict[str, Any], data: Any) -> str:
    own = (error.get("ctx") or {}).get("error")
    if isinstance(own, ValueError):
        return str(own)
    path, kind = _plain(error["loc"]), error["type"]
    if kind == "extra_forbidden":
        return _unknown(path[-1], _keys(schema, path[:-1], data), _at(data, path[:-1]))
    if kind == "kind":
        given = list(error["input"]) if isinstance(error["input"], dict) else []
        known = error["msg"].split("there are: ")[-1].rstrip(")").split(", ")
        for key in given[:MOST]:
            if close := difflib.get_close_matches(str(key)[:100], known, 1):
                return f"{error['msg']}: it has '{_short(key)}', did you mean '{close[0]}'?"
        return str(error["msg"])
    if kind == "missing" and not isinstance(path[-1], int):
        return "is missing: give it"
    if kind == "literal_error":
        return f"must be {error['ctx']['expected']}, not {brief(error['input'], 40)}"
    sentence = {
        "string_type": "must be text",
        "dict_type": "must be a table",
        "model_type": "must be a table",
        "model_attributes_type": "must be a table",
        "list_type": "must be a list",
        "tuple_type": "must be a list",
        "bool_type": "must be true or false",
        "bool_parsing": "must be true or false",
        "int_type": "must be a whole number",
        "int_parsing": "must be a whole number",
        "int_from_float": "must be a whole number",
    }.get(kind)
    if kind == "missing":
        return "is missing: the list is too short"
    if kind == "too_long":
        sentence = f"must be a list of {error['ctx']['max_length']}"
    message = sentence or error["msg"][0].lower() + error["msg"][1:]
    return f"{message}, not {_short(repr(error['input']))}{_example(path)}"


def _example(path: Path) -> str:
    """Where an example is, of what is wrong in the table of an element behind its kind."""
    if len(path) < 3 or path[2] not in SECTIONS.get(str(path[0]), {}):
        return ""
    return f" (mbody explain {path[2]} shows an example)"


def _short(value: Any) -> str:
    """A value or a key, without the quotes of a text."""
    text = value if isinstance(value, str) else brief(value, 40)
    return text if len(text) <= 40 else text[:37] + "..."


def _cut(sentence: str) -> str:
    """A sentence without its middle, where it is very long."""
    half = LONGEST // 2
    return sentence if len(sentence) <= LONGEST else f"{sentence[:half]} … {sentence[-half:]}"


def _unknown(key: Any, known: list[str], table: Any) -> str:
    """Why a key is refused: a second kind of element, a slip of the pen, another word for a
    section, or one too many.
    """
    kinds = next((kinds for kinds in SECTIONS.values() if key in kinds), {})
    given = table if isinstance(table, dict) else {}
    first = next((kind for kind in kinds if kind in given and kind != key), None)
    if first is not None:
        return f"names a second kind of element beside '{first}': keep one of them"
    meant = OTHER_WORDS.get(str(key).lower(), "")
    close = difflib.get_close_matches(str(key)[:100], known, 1)
    if meant in known or close:
        return f"there is no such key, did you mean '{meant if meant in known else close[0]}'?"
    # the tables of a file are what somebody looks for who has another word for one
    left = sorted((w for w in known if w not in given), key=lambda word: word not in TABLES)
    return f"there is no such key (there are: {', '.join(left[:MOST])})"


def _at(data: Any, path: Path) -> Any:
    for key in path:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _keys(schema: dict[str, Any], path: Path, data: Any) -> list[str]:
    """The keys that the schema knows at a path; of several forms those that fit what is there."""
    nodes = [schema]
    for n, key in enumerate(path):
        nodes = [below for node in nodes for below in _below(node, key, schema)]
        nodes = _fitting(nodes, _at(data, path[: n + 1]), schema)
    found: list[str] = []
    for node in nodes:
        found += [key for key in node.get("properties", {}) if key not in (*found, "$schema")]
    return found


def _forms(node: dict[str, Any], schema: dict[str, Any]) -> list[dict[str, Any]]:
    """A node of the schema, or all forms that it may have."""
    if "$ref" in node:
        return _forms(schema["$defs"][node["$ref"].rpartition("/")[2]], schema)
    parts = node.get("oneOf", node.get("anyOf"))
    return [form for part in parts for form in _forms(part, schema)] if parts else [node]


def _below(node: dict[str, Any], key: Any, schema: dict[str, Any]) -> list[dict[str, Any]]:
    """The schema of a key, or of an entry of a list."""
    if isinstance(key, int):
        items = node.get("prefixItems")
        below = items[key] if items and key < len(items) else node.get("items")
    else:
        below = node.get("properties", {}).get(key, node.get("additionalProperties"))
    return _forms(below, schema) if isinstance(below, dict) else []


def _fitting(
    nodes: list[dict[str, Any]], data: Any, schema: dict[str, Any]
) -> list[dict[str, Any]]:
    if not isinstance(data, dict):
        return nodes
    required = [n for n in nodes if set(n.get("required", [])) & set(data)]
    return required or [n for n in nodes if n.get("type") == "object"]


def raise_all(
    problems: list[Problem], text: str, is_json: bool, name: str, count: int | None = None
) -> None:
    """Raise one error with all problems, in the order of the file; `count` is how many there
    are, None where nobody looked further than to the first `ENOUGH`.

    Raises
    ------
    ModelError
        Where there is a problem. Its `problems` are (line, field, message) of each.
    """
    if not problems:
        return
    problems = problems[:ENOUGH]
    lines_found = lines_of(text, is_json, [problem.path for problem in problems])
    entries = [
        (line, ".".join(_short(key) for key in problem.path), _cut(problem.message))
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
    named = section in (*SECTIONS, "bodies", "parameters", "curves", "inputs", "states", "measures")
    return str(problem.path[1]) if named and len(problem.path) > 1 else None
