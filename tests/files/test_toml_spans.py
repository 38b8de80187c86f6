"""Where everything of a TOML text stands, and changes in place."""

import random
import tomllib

import pytest

from mbody import gallery
from mbody.files.model.problems import lines_of
from mbody.files.toml_spans import Spans, spliced
from tests.support.paths import ROOT

TEXTS = [
    "a = 1",
    "a.b = [1, 2]\n",
    "\"x y\" = '''q\n]''' # }\n[z.\"a.b\"]\nc = { d = [{ e = 1 }] }",
    'a = { f = \'}\', "g" = "]" } # }\n',
    "a = [ # one\n  1, # ]\n  { b = 2 },\n]\n\n[c]\nd=1979-05-27 07:32:00\n",
    '[[x]]\na = 1\n[x.y]\nb = 2\n[[x]]\n[[x.z]]\nc = \'\'\n[[x.z]]\nc = """"""""\n',
    'a = { b.c = 1, b.d = 2, e = {} }\r\n# c\r\n[f]\r\n\r\ng = """x\r\n"y""""\r\n',
    '"\\u00e9\\\\" = "\\U0001F600"\n[ "" . \'\' ]\n',
]


def models():
    """Texts of the gallery, and model texts of the documentation."""
    yield from (gallery.path(name).read_text("utf-8") for name in gallery.names())
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for block in page.read_text("utf-8").split("```toml\n")[1:]:
            text = block.partition("```")[0]
            try:
                tomllib.loads(text)
            except tomllib.TOMLDecodeError:
                continue
            yield text


def value_at(tree, path):
    for key in path:
        tree = tree[key]
    return tree


def leaves(tree, path=()):
    """Paths of all values that are no tables."""
    for key, value in tree.items():
        if isinstance(value, dict) and value:
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def check_spans(text):
    """Every span of a value reads as the value, none is missing; lines are those of their keys."""
    spans = Spans(text)
    for path, entry in spans.entries.items():
        assert tomllib.loads(f"v = {spans.raw(path)}")["v"] == value_at(spans.tree, path)
        written = text.split("\n")[spans.line(path) - 1]
        assert text[entry.at : entry.start].split("\n")[0].rstrip() in written
    named = {path[:n] for path in spans.entries for n in range(len(path) + 1)} | {*spans.tables}
    for path in leaves(spans.tree):
        assert path in named or isinstance(value_at(spans.tree, path), (dict, list))
    return spans


@pytest.mark.parametrize("text", TEXTS)
def test_values_stand_where_they_are_said_to(text):
    check_spans(text)


def test_values_of_models_of_gallery_and_documentation():
    count = sum(len(check_spans(text).entries) for text in models())
    assert count > 5000


def test_whatever_tomllib_reads_has_spans():
    """Random texts of the signs that matter: refused as by tomllib, or all values are found."""
    chance, good = random.Random(46), 0
    pieces = [
        "a", "b", ".", " = ", "[", "]", "[[", "]]", "{", "}", ", ", "1", "2.5e3", "'x'", '"y"',
        "\"\"\"", "'''", "\n", "\r\n", "# c", " ", "\\", "a = 1\n", "[b]\n", "c = [", "d = { e = ",
        "true", "1979-05-27", "-", "_",
    ]  # fmt: skip
    for _ in range(6000):
        text = "".join(chance.choice(pieces) for _ in range(chance.randint(1, 9)))
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError:
            with pytest.raises(tomllib.TOMLDecodeError):
                Spans(text)
        else:
            check_spans(text)
            good += len(text) > 6
    assert good > 150


@pytest.mark.parametrize("text", TEXTS)
def test_every_entry_can_be_taken_away_and_added_again(text):
    """What is left reads as the tables less that entry, by their deletion in Python."""
    spans = Spans(text)
    for path in [*spans.entries, *spans.tables]:
        if not path or (isinstance(path[-1], int) and path not in spans.entries):
            continue
        tree = tomllib.loads(text)
        above, value = value_at(tree, path[:-1]), value_at(tree, path)
        del above[path[-1]]
        left = spans.without(path)
        assert pruned(tomllib.loads(left)) == pruned(tree)
        if isinstance(path[-1], str) and not isinstance(value, dict) and value != "😀":
            again = spliced(left, [Spans(left).inserted(path[:-1], path[-1], 7)])
            if not any(isinstance(key, int) for key in path):
                above[path[-1]] = 7
                assert pruned(tomllib.loads(again)) == pruned(tree)


def pruned(tree):
    """Without empty tables: of a section nothing may be left but its header, or not that."""
    if isinstance(tree, list):
        return [pruned(one) for one in tree]
    if not isinstance(tree, dict):
        return tree
    inside = {key: pruned(value) for key, value in tree.items()}
    return {key: value for key, value in inside.items() if value != {}}


def test_comments_and_blank_lines_stay_with_what_is_left():
    text = "# head\n\n[a]  # first\nx = 1\n\n# about b\n[b]\ny = 1  # one\nz = 2\n\n[c]\n"
    assert Spans(text).without(("b",)) == "# head\n\n[a]  # first\nx = 1\n\n[c]\n"
    assert Spans(text).without(("b", "y")) == text.replace("y = 1  # one\n", "")
    added = spliced(text, [Spans(text).inserted(("b",), "w", 3)])
    assert added == text.replace("z = 2\n", "z = 2\nw = 3\n")
    made = spliced(text, [Spans(text).section(("b", "d"), {"k": [1, 2]})])
    assert made == text.replace("z = 2\n", "z = 2\n\n[b.d]\nk = [1, 2]\n")
    windows = text.replace("\n", "\r\n")
    assert Spans(windows).without(("b", "y")) == windows.replace("y = 1  # one\r\n", "")
    several = "points = [\n  1, # one,\n  2 # two\n]"
    assert tomllib.loads(Spans(several).without(("points", 1)))["points"] == [1]


def test_problems_have_the_lines_of_their_entries():
    text = "a = [\n  1,\n  [2, 3],\n]\n[b.c]\nd = 1\n"
    paths = [("a",), ("a", 1, 0), ("b",), ("b", "c", "d"), ("b", "e"), ("z",)]
    assert lines_of(text, False, paths) == [1, 3, 5, 6, 5, None]
