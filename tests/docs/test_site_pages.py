"""The tutorial, the recipes and the pages about other programs: all that they say is run."""

import pytest

from tests.support.cases import first_fast
from tests.support.pages import DOCS, follow, missing_lines
from tests.support.paths import ROOT

PAGES = sorted(
    path.relative_to(DOCS).as_posix()
    for folder in ("tutorial", "howto", "explanation", "project")
    for path in (DOCS / folder).rglob("*.md")
    if path.stem not in ("index", "changelog", "contributing", "benchmarks")
)
PAGES += [f"{name}.md" for name in ("index", "derivatives", "motion", "optimization", "results")]
PAGES += ["sweeps.md", "../README.md"]
RECIPES = [page for page in PAGES if page.startswith("howto/recipes/")]


@first_fast("page", PAGES, 13)
def test_a_page_does_what_it_says(page, tmp_path):
    compared = follow((DOCS / page).read_text("utf-8"), tmp_path)
    if page in RECIPES:
        assert compared, "a recipe shows what it prints"


def test_no_page_with_a_program_is_left_out():
    """Others are run by the test of their subject, which names them."""
    tests = "".join(path.read_text("utf-8") for path in (ROOT / "tests").rglob("*.py"))
    for path in DOCS.rglob("*.md"):
        if "```python" in path.read_text("utf-8"):
            name = path.relative_to(DOCS).as_posix()
            assert name in PAGES or f'{path.name}"' in tests, name


OUTPUT = "one 1.0\ntwo 2.0\nthree 3.0\nfour 4.0"


def test_what_is_left_out_is_left_out_and_nothing_else():
    assert not missing_lines(OUTPUT, OUTPUT)
    assert not missing_lines(OUTPUT, "…\nthree 3.0\nfour 4.0")
    assert not missing_lines(OUTPUT, "one 1.0\n…\nthree 3.0\n…")
    assert missing_lines(OUTPUT, "two 2.0\n…")  # is not the first line
    assert missing_lines(OUTPUT, "…\nthree 3.0")  # is not the last one
    assert missing_lines(OUTPUT, "one 1.0\n…\nthree 3.2\n…")
    assert missing_lines(OUTPUT, "…\nthree 3.0\ntwo 2.0\n…")
    assert missing_lines(OUTPUT, "one 1.0\ntwo 2.0")


def test_a_page_that_says_something_wrong_is_found(tmp_path):
    with pytest.raises(AssertionError):
        follow("```python\nprint(1.0)\n```\n\n```text\n2.0\n```\n", tmp_path)
    with pytest.raises(AssertionError):
        follow("```sh\nmbody show hoekens\n```\n\n```text\nnothing\n```\n", tmp_path)
    with pytest.raises(AssertionError):
        follow("```sh\nmbody show no_such_model\n```\n", tmp_path)
