"""docs/contact.md: its code runs and prints what it shows, and its file can be read."""

import re

import mbody
from tests.docs.test_readme import differences, printed, steps
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "contact.md"


def test_the_code_of_the_page_prints_what_it_shows():
    namespace = {"__name__": "contact"}
    done = steps(PAGE.read_text("utf-8"))
    assert len(done) == 7
    for code, shown in done:
        output = printed(code, namespace)
        assert shown is not None, code
        assert not differences(output, shown), output


def test_the_file_of_the_page_is_a_model():
    """The ladder of the page begins at rest, slides, and leaves the wall before it lies."""
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    run = mbody.simulate(mbody.from_toml(text))
    assert run.status == "completed"
    assert [(one.name, one.contact) for one in run.events] == [("open", "top")]
    assert run.energy.error < 1e-9
