"""docs/synthesis.md: its code runs and prints what it shows."""

import contextlib

import mbody
from tests.docs.test_readme import differences, printed, steps
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "synthesis.md"


def test_the_code_of_the_page_prints_what_it_shows(tmp_path):
    namespace = {"__name__": "synthesis"}
    done = steps(PAGE.read_text("utf-8"))
    assert len(done) == 5
    with contextlib.chdir(tmp_path):
        for code, shown in done:
            output = printed(code, namespace)
            assert shown is not None, code
            assert not differences(output, shown), output
        assert mbody.load("design.toml").name == "four-bar"
