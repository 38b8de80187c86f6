"""A first answer loads what it needs, and goes through few files: counted, not timed."""

import pytest

from tests.work_counts.start import count

#: By first answer the most modules, lines of source and files that a function is called of; beside
#: them something that none of them needs.
MOST = {
    "a four-bar": (105, 30_000, 35),
    "a four-bar's file": (115, 35_000, 50),
    "a pendulum's file": (165, 58_000, 60),
}
UNNEEDED = (
    *("derivatives", "engineering", "engines", "exchange", "image", "inverse", "live"),
    *("optimization", "reports", "summaries", "sweeps", "synthesis", "teaching", "views", "cli"),
    *("files.model.write", "files.results", "files.tables", "stepping", "topologies"),
)


@pytest.mark.parametrize("answer", MOST)
def test_a_first_answer_loads_what_it_needs(answer):
    found = count(answer)
    modules, lines, walked = MOST[answer]
    assert len(found["modules"]) <= modules, found["modules"]
    assert found["lines"] <= lines
    assert len(found["walked"]) <= walked, found["walked"]
    folders = tuple(f"mbody.{name}." for name in UNNEEDED)
    assert not [name for name in found["modules"] if f"{name}.".startswith(folders)]
