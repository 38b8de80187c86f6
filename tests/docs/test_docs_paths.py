"""Pages on the mathematics and the design: what they name is there, and they stay short."""

import re

from tests.support.cases import each
from tests.support.paths import ROOT

DESIGN = sorted((ROOT / "docs" / "design").glob("*.md"))
PAGES = [ROOT / "docs" / "theory.md", *DESIGN]

#: A file or a folder of the repository between backticks; with a star, any of them.
NAMED = re.compile(r"`((?:mbody|tests|validation|benchmarks|docs)/[\w./*-]*)`")
#: Lines and columns of a page of the design, at most.
LINES, COLUMNS = 80, 100


def test_every_path_that_is_named_exists():
    named = {
        (page.name, path)
        for page in PAGES
        for path in NAMED.findall(page.read_text(encoding="utf-8"))
    }
    assert len(named) > 100
    assert not sorted((page, path) for page, path in named if not any(ROOT.glob(path)))


@each("page", DESIGN)
def test_a_page_of_the_design_is_short(page):
    lines = page.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= LINES and max(map(len, lines)) <= COLUMNS


def test_the_index_names_every_page_of_the_design():
    index = (ROOT / "docs" / "design" / "index.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\(([\w-]+)\.md\)", index))
    assert linked == {page.stem for page in DESIGN} - {"index"}
