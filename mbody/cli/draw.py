"""`mbody draw MODEL` and `mbody plot MODEL QUANTITY …`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import question
from mbody.cli.models import taken
from mbody.cli.streams import say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.model.mechanism import Mechanism
    from mbody.model.study import Instants
    from mbody.solution.solution import Solution

__all__ = ["draw", "plot"]


def draw(asked: Any) -> int:
    """Write a picture of a model at the first of the instants asked for."""
    from mbody.views import draw as drawn
    from mbody.views.backend import check_ending

    check_ending(asked.output)
    mechanism = taken(asked)
    wanted = question(asked, mechanism.ask)
    if mechanism.drivers or asked.forces or wanted is not mechanism.ask:
        run = _solved(mechanism, "kinetostatics" if asked.forces else "kinematics", wanted)
        figure = drawn(run, 0, asked.forces, paths=asked.path)
    else:
        figure = drawn(mechanism, paths=asked.path)
    return _written(figure, asked.output)


def plot(asked: Any) -> int:
    """Write diagrams over the turn, or over the instants that are asked for."""
    from mbody.views import plot as plotted
    from mbody.views.backend import check_ending
    from mbody.views.cycle import cycle

    check_ending(asked.output)
    mechanism = taken(asked)
    run = _solved(mechanism, "kinetostatics", cycle(mechanism, question(asked, mechanism.ask)))
    return _written(plotted(run, *asked.quantities), asked.output)


def _solved(mechanism: Mechanism, analysis: str, wanted: Instants | None) -> Solution:
    from mbody.analysis.driven.requests import analyse_at as solved

    return solved(mechanism, analysis, wanted)


def _written(figure: Figure, path: str) -> int:
    from mbody.views import save

    save(figure, path)
    say(f"wrote {path}")
    return 0
