"""Inputs from a random generator alone: the same seed gives the same inputs everywhere."""

import json
from random import Random
from typing import Any

from mbody.files.model import json_schema
from mbody.files.model.toml_text import toml
from tests.fuzz import corpus

SCHEMA = json_schema()
SOUP = (
    "\n",
    "[",
    "]",
    "{",
    "}",
    "=",
    '"',
    "'",
    ".",
    ",",
    "#",
    ":",
    "\\",
    "[[",
    '"""',
    "\\u0000",
    "\r",
)


def formula(random: Random) -> str:
    """A formula of the grammar, or one that was right, with something wrong in it now and then."""
    text = random.choice(corpus.FORMULAS) if random.random() < 0.3 else _sum(random, 4)
    for _ in range(random.choice((0, 0, 0, 1, 1, 2, 5))):
        text = spoilt(random, text, (*corpus.SIGNS, *corpus.NUMBERS, *corpus.NAMES, *corpus.UNITS))
    return text[:2500]


def _sum(random: Random, depth: int) -> str:
    parts = [_part(random, depth) for _ in range(random.choice((1, 1, 2, 3)))]
    signs = random.choice((" + ", " - ", "*", " * ", "/", "^", "**", " / "))
    return signs.join(parts) if random.random() < 0.98 else signs.join(parts * 40)


def _part(random: Random, depth: int) -> str:
    kind = random.random()
    if depth == 0 or kind < 0.35:
        text = random.choice(corpus.NUMBERS)
    elif kind < 0.55:
        text = random.choice(corpus.NAMES)
    elif kind < 0.75:
        text = f"({_sum(random, depth - 1)})"
    else:
        count = random.choice((1, 1, 1, 2, 2, 0, 3))
        inside = ", ".join(_sum(random, depth - 1) for _ in range(count))
        text = f"{random.choice(corpus.FUNCTIONS)}({inside})"
    if random.random() < 0.4:
        text += random.choice((" ", "")) + _unit(random)
    return random.choice(("", "", "", "-", "+", "--")) + text


def _unit(random: Random) -> str:
    unit = random.choice(corpus.UNITS)
    for _ in range(random.choice((0, 0, 0, 1, 1, 2, 30))):
        unit += random.choice(("*", "/", "-", " ", "·")) + random.choice(corpus.UNITS)
        unit += random.choice(("", "", "^2", "²", "^-1", "**3", "^9", "^x"))
    return unit


def spoilt(random: Random, text: str, words: tuple[str, ...]) -> str:
    """A text with one change: something cut, doubled, exchanged or put in."""
    i = random.randrange(len(text) + 1)
    j = min(len(text), i + random.choice((0, 1, 1, 2, 5, 20)))
    piece = random.choice(words) if random.random() < 0.8 else random.choice(corpus.ODD)
    kind = random.randrange(5)
    if kind == 0:
        return text[:i] + piece + text[i:]
    if kind == 1:
        return text[:i] + piece + text[j:]
    if kind == 2:
        return text[:i] + text[j:]
    if kind == 3:
        return text[:i] + text[i:j] * random.choice((2, 3, 50)) + text[j:]
    return (
        text[:i] + chr(random.choice((random.randrange(128), random.randrange(0x11000)))) + text[j:]
    )


def text(random: Random, is_json: bool) -> str:
    """The text of a model with characters changed, or parts of others spliced in."""
    seeds = corpus.tables() if is_json else corpus.models()
    made = random.choice(seeds)
    for _ in range(random.choice((1, 1, 2, 3, 8))):
        kind = random.random()
        if kind < 0.25:
            other = random.choice(seeds)
            i, j = random.randrange(len(made) + 1), random.randrange(len(other))
            made = made[:i] + other[j : j + random.choice((10, 100, 1000))] + made[i:]
        elif kind < 0.45 and not is_json:
            lines = made.split("\n")
            lines.insert(
                random.randrange(len(lines) + 1), random.choice(random.choice(seeds).split("\n"))
            )
            made = "\n".join(lines)
        elif kind < 0.6:
            made = spoilt(random, made, (formula(random), *corpus.FORMULAS))
        else:
            made = spoilt(random, made, (*SOUP, *corpus.NUMBERS, *corpus.NAMES))
    return made


# -- tables ---------------------------------------------------------------------------------------


def tables(random: Random) -> Any:
    """The tables of a model: those of a right one, or made after the schema, then changed."""
    if random.random() < 0.6:
        data = json.loads(random.choice(corpus.tables()))
    else:
        data = of_schema(random, SCHEMA, 6)
    for _ in range(random.choice((0, 1, 1, 2, 3, 6))):
        change(random, data)
    return data


def change(random: Random, data: Any) -> None:
    """One change somewhere in tables, in place."""
    found = list(places(data))
    if not found:
        return
    table, key = random.choice(found)
    kind = random.random()
    if kind < 0.3:
        table[key] = value(random)
    elif kind < 0.55:
        table[key] = formula(random)
    elif kind < 0.65:
        del table[key]
    elif kind < 0.75 and isinstance(table, dict):
        table[spoilt(random, str(key), corpus.NAMES)] = table.pop(key)
    elif kind < 0.8 and isinstance(table, dict):
        table[random.choice((*corpus.NAMES, *corpus.ODD))] = value(random)
    elif kind < 0.85:
        for _ in range(random.choice((1, 2, 40))):
            table[key] = [table[key]] if random.random() < 0.5 else {"a": table[key]}
    else:
        other, name = random.choice(found)
        table[key] = json.loads(json.dumps(other[name] if other is not table else table[key]))


def places(data: Any) -> Any:
    """Every (table or list, key) in tables."""
    keys = data.keys() if isinstance(data, dict) else range(len(data))
    for key in list(keys):
        yield data, key
        if isinstance(data[key], (dict, list)):
            yield from places(data[key])


def value(random: Random) -> Any:
    """Any value that a file may hold."""
    kind = random.random()
    if kind < 0.7:
        return json.loads(json.dumps(random.choice(corpus.VALUES)))
    return random.choice(corpus.ODD) if kind < 0.85 else formula(random)


def of_schema(random: Random, node: dict[str, Any], depth: int) -> Any:
    """A value as the schema wants it; right in its shape, if not in its meaning."""
    if "$ref" in node:
        return of_schema(random, SCHEMA["$defs"][node["$ref"].rpartition("/")[2]], depth)
    for key in ("oneOf", "anyOf"):
        if key in node:
            return of_schema(random, random.choice(node[key]), depth)
    if "const" in node or "enum" in node:
        return random.choice(node.get("enum", [node.get("const")]))
    kind = node.get("type")
    kind = random.choice(kind) if isinstance(kind, list) else kind
    if depth < 0 or kind is None:
        return value(random)
    if kind == "object":
        own, needed = node.get("properties", {}), node.get("required", [])
        share = random.choice((0.2, 0.5, 0.8))
        chosen = [key for key in own if key in needed or random.random() < share]
        made = {key: of_schema(random, own[key], depth - 1) for key in chosen}
        if isinstance(node.get("additionalProperties"), dict):
            for name in random.sample(corpus.NAMES, random.choice((0, 1, 2, 4))):
                made[name] = of_schema(random, node["additionalProperties"], depth - 1)
        return made
    if kind == "array":
        parts = node.get("prefixItems") or [node.get("items", {})] * random.choice((0, 1, 2, 3))
        return [of_schema(random, part, depth - 1) for part in parts]
    if kind == "string":
        places = [f"{a}.{b}" for a in corpus.NAMES[:6] for b in "AB"]
        return random.choice((*corpus.NAMES, *places, formula(random)))
    if kind in ("number", "integer"):
        return random.choice((0, 1, 2, 5, -1, 0.25, 1e9, 1e-9))
    return random.choice((True, False)) if kind == "boolean" else None


def written(data: Any, is_json: bool) -> str:
    """Tables as the text of a file."""
    if is_json:
        return json.dumps(data)
    try:
        return toml(data)
    except AttributeError:  # no table at all
        return str(data)
