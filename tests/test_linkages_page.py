"""docs/linkages.md: its code runs and prints what it shows."""

from pathlib import Path

import pytest

from tests.test_readme import differences, printed, steps

PAGE = Path(__file__).parents[1] / "docs" / "linkages.md"


def test_the_code_of_the_page_prints_what_it_shows():
    pytest.importorskip("pyarrow")
    namespace = {"__name__": "linkages"}
    done = steps(PAGE.read_text("utf-8"))
    assert len(done) == 4
    for code, shown in done:
        output = printed(code, namespace)
        assert shown is not None, code
        assert not differences(output, shown), output
