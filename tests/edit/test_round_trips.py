"""Changes of a text and back: the bytes of before, and the tables that were asked for."""

import random
import tomllib

import pytest

from mbody import ModelError, gallery
from mbody.edit.document import Document
from mbody.files.model import to_toml
from mbody.files.toml_spans import Spans, spliced, value_at
from tests.files.test_toml_spans import models, pruned


def commented(text):
    """A text with comments in and behind its lines."""
    lines = []
    for n, line in enumerate(text.split("\n")):
        lines += ["# before", line] if n % 3 == 0 else [f"{line}  # behind" if line else line]
    return "\n".join(lines)


def files():
    """Model texts of gallery and documentation, those that `to_toml` writes with comments put in,
    and both with the line ends of Windows.
    """
    texts = {text: None for text in models() if "[" in text}
    for name in gallery.names():
        written = to_toml(gallery.load(name))
        texts[commented(written)] = None
        texts[commented(gallery.path(name).read_text("utf-8"))] = None
    return [*texts, *(text.replace("\n", "\r\n") for text in texts)]


def numbers(tree, path=()):
    """Paths of plain numbers."""
    pairs = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in pairs:
        if isinstance(value, (dict, list)):
            yield from numbers(value, (*path, key))
        elif isinstance(value, float) or type(value) is int:
            yield (*path, key)


def changed_and_undone(text):
    """One number of a model changed and taken back; whether it was a model with one."""
    try:
        document = Document(text, folder=gallery.path("hoekens").parent)
    except ModelError:
        return False
    if document.fault is not None:
        return False
    for path in numbers(document.tree):
        value = value_at(document.tree, path)
        if (
            path[0] in ("bodies", "ground", "loads", "parameters", "g")
            and document.apply({"do": "set", "path": path, "text": repr(value * 1.0001 + 1e-7)})
            is None
        ):
            assert document.text != text
            other = tomllib.loads(document.text)
            value_at(other, path[:-1])[path[-1]] = value
            assert other == tomllib.loads(text)  # nothing else has changed
            assert document.undo() and document.text == text
            return True
    return False


def test_some_files_come_back():
    assert sum(map(changed_and_undone, files()[::17])) >= 5


@pytest.mark.slow
def test_two_hundred_files_come_back():
    assert sum(map(changed_and_undone, files())) >= 200


def random_changes(seed, count):
    """Random changes of texts by splices agree with those of their tables."""
    chance = random.Random(seed)
    texts = [text for text in files() if len(text) < 6000]
    made = 0
    while made < count:
        text = chance.choice(texts)
        for _ in range(25):
            spans, tree = Spans(text), tomllib.loads(text)
            paths = [*spans.entries] or [()]
            path = chance.choice(paths)
            kind = chance.choice(("set", "remove", "add"))
            new = chance.choice((3, "x # y", [1, {"k": "]"}]))
            if kind == "set" and path:
                entry = spans.entries[path]
                value_at(tree, path[:-1])[path[-1]] = 7
                after = spliced(text, [spans.replaced(path, "7")])
                assert len(after) == len(text) - (entry.end - entry.start) + 1
            elif kind == "remove" and path:
                del value_at(tree, path[:-1])[path[-1]]
                after = spans.without(path)
            else:
                tables = [one for one in spans.tables if not any(isinstance(k, int) for k in one)]
                table = chance.choice(tables)
                key = f"new {chance.randint(0, 9)}"
                if key in value_at(tree, table):
                    continue
                value_at(tree, table)[key] = new
                after = spliced(text, [spans.inserted(table, key, new)])
            assert pruned(tomllib.loads(after)) == pruned(tree), (kind, path, text)
            text, made = after, made + 1
    return made


def test_random_changes_of_texts():
    assert random_changes(1, 300) >= 300


@pytest.mark.slow
def test_ten_thousand_changes_of_texts():
    assert random_changes(2, 10_000) >= 10_000
