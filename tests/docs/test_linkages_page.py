"""docs/linkages.md: its code runs and prints what it shows."""

import pytest

from tests.docs.test_readme import differences, printed, steps
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "linkages.md"


def test_the_code_of_the_page_prints_what_it_shows():
    pytest.importorskip("pyarrow")
    namespace = {"__name__": "linkages"}
    done = steps(PAGE.read_text("utf-8"))
    assert len(done) == 4
    for code, shown in done:
        output = printed(code, namespace)
        assert shown is not None, code
        assert not differences(output, shown), output
