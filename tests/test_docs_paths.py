"""Every path that the pages of the mathematics and of the decisions name is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = ("docs/theory.md", "docs/measurements.md", "DECISIONS.md")

#: A file or a folder of the repository between backticks; of a file also one of its functions.
NAMED = re.compile(r"`((?:mbody|tests|validation|benchmarks|docs)/[\w./*-]*)`")
#: A module of the package by its dotted name, with a name of it perhaps.
DOTTED = re.compile(r"`(mbody\.(?:\w+\.)+\w+)`")


@pytest.mark.parametrize("page", PAGES)
def test_paths_are_there(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    named = set(NAMED.findall(text))
    assert named, "the page names no file"
    assert not sorted(path for path in named if not any(ROOT.glob(path)))


@pytest.mark.parametrize("page", PAGES)
def test_tables_have_a_row_for_each_section(page):
    """The index of the decisions: every number once, in order, in the table and as a heading."""
    text = (ROOT / page).read_text(encoding="utf-8")
    if page != "DECISIONS.md":
        return
    rows = re.findall(r"^\| (\d+) \| (\d{4}-\d\d-\d\d) \|", text, re.MULTILINE)
    heads = re.findall(r"^### (\d+)\. .* \((\d{4}-\d\d-\d\d)\)$", text, re.MULTILINE)
    assert rows == heads
    assert [int(number) for number, _ in rows] == list(range(1, len(rows) + 1))
