"""Searches that Ctrl-C ends, against what was done until then."""

import pytest

from mbody import makers, optimize, synthesize
from mbody.core.searches import Searches
from mbody.synthesis import linkages


def stopping(after, found=lambda n: n):
    """A search that Ctrl-C interrupts after so many."""
    done = []

    def search(*given):
        if len(done) == after:
            raise KeyboardInterrupt
        done.append(given)
        return found(*given)

    return search


def test_what_was_found_is_kept():
    searches = Searches(5)
    assert list(searches.ends(range(5), stopping(3, lambda n: n or None))) == [1, 2]
    assert searches.stopped == "stopped: after 3 of 5 searches"


@pytest.mark.parametrize("known", [False, True])
def test_nothing_found_is_an_interruption_unless_something_is_known(known):
    searches = Searches(5, known=known)
    if known:
        assert list(searches.ends(range(5), stopping(2, lambda n: None))) == []
        assert searches.stopped
    else:
        with pytest.raises(KeyboardInterrupt):
            list(searches.ends(range(5), stopping(2, lambda n: None)))


def test_a_front_keeps_the_designs_before():
    """The ends of the front, and the first of five designs between them."""

    def seen(done, of):
        assert of == 2 * 1 + 5
        if done == 3:
            raise KeyboardInterrupt

    found = optimize(
        makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0),
        minimize=["peak(motor.effort)", "peak(A.force)"],
        by={"coupler.cg.x": (0.0, 3.0), "rocker.cg.x": (-1.0, 1.0)},
        starts=1,
        points=7,
        over="turn",
        progress=seen,
    )
    assert found.status == "stopped: after 3 of 7 searches" and 2 <= len(found.pareto) <= 3


def test_a_synthesis_keeps_the_designs_before(monkeypatch):
    """Two of many starts, whose designs are judged."""
    monkeypatch.setattr(linkages, "refined", stopping(2, linkages.refined))
    points = [(0.0, 0.0), (1.0, 0.1), (2.0, 0.0), (1.0, 1.0), (0.0, 0.0)]
    found = synthesize(path=points, search=200, starts=6, defective=True)
    assert found.notes[-1] == "stopped: after 2 of 6 searches" and 1 <= len(found) <= 2
