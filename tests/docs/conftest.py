"""Models of the documentation are written as one writes models: none brings a note on a trap."""

import pytest

from mbody.model.mechanism import Mechanism
from mbody.model.traps import traps

#: Tests that do what a page says.
PAGES = (
    "test_a_page_does_what_it_says",
    "test_the_code_of_a_page_prints_what_it_shows",
    *("test_the_better_crank", "test_the_pendulum"),
)


@pytest.fixture(autouse=True)
def no_traps(request, monkeypatch):
    if getattr(request.node, "originalname", "") not in PAGES:
        yield
        return
    close, seen = Mechanism.closed_with, []

    def closed_with(self, *given):
        seen.append(self)
        return close(self, *given)

    monkeypatch.setattr(Mechanism, "closed_with", closed_with)
    yield
    assert not {note for machine in seen for note in traps(machine)}
