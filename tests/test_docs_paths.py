"""Pages on the mathematics, the decisions and their measurements: paths and numbers are right."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = ("docs/theory.md", "docs/measurements.md", "DECISIONS.md")

#: A file or a folder of the repository between backticks; with a star, any of them.
NAMED = re.compile(r"`((?:mbody|tests|validation|benchmarks|docs)/[\w./*-]*)`")


@pytest.mark.parametrize("page", PAGES)
def test_every_path_that_is_named_exists(page):
    named = set(NAMED.findall((ROOT / page).read_text(encoding="utf-8")))
    assert named
    assert not sorted(path for path in named if not any(ROOT.glob(path)))


def test_the_index_of_decisions_is_that_of_their_paragraphs():
    text = (ROOT / "DECISIONS.md").read_text(encoding="utf-8")
    index = re.findall(r"^\| (\d+) \| (\d{4}-\d\d-\d\d) \| (.*) \|$", text, re.MULTILINE)
    heads = re.findall(r"^### (\d+)\. (.*) \((\d{4}-\d\d-\d\d)\)$", text, re.MULTILINE)
    assert index == [(number, date, title) for number, title, date in heads]
    assert [int(number) for number, _, _ in index] == list(range(1, len(index) + 1))


def test_measurements_are_those_of_decisions():
    decisions = (ROOT / "DECISIONS.md").read_text(encoding="utf-8")
    heads = re.findall(r"^### (\d+\. .*) \(\d{4}-\d\d-\d\d\)$", decisions, re.MULTILINE)
    text = (ROOT / "docs" / "measurements.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^## (.*)$", text, re.MULTILINE)) <= set(heads)
