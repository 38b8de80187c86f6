"""`mbody draw MODEL` and `mbody plot MODEL QUANTITY …`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import question
from mbody.cli.models import model_of
from mbody.cli.streams import message

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.model.mechanism import Mechanism
    from mbody.model.study import Instants
    from mbody.solution.solution import Solution

__all__ = ["draw", "plot"]


def draw(args: Any) -> int:
    """Write a picture of a model at the first of the requested instants."""
    from mbody.views import draw as drawn
    from mbody.views.backend import check_ending

    check_ending(args.output)
    mechanism = model_of(args)
    wanted = question(args, mechanism.ask)
    if mechanism.drivers or args.forces or wanted is not mechanism.ask:
        run = _solved(mechanism, "kinetostatics" if args.forces else "kinematics", wanted)
        figure = drawn(run, 0, args.forces, paths=args.path)
    else:
        figure = drawn(mechanism, paths=args.path)
    return _written(figure, args.output)


def plot(args: Any) -> int:
    """Write diagrams over the turn, or over the requested instants."""
    from mbody.views import plot as plotted
    from mbody.views.backend import check_ending
    from mbody.views.cycle import cycle

    check_ending(args.output)
    mechanism = model_of(args)
    run = _solved(mechanism, "kinetostatics", cycle(mechanism, question(args, mechanism.ask)))
    return _written(plotted(run, *args.quantities), args.output)


def _solved(mechanism: Mechanism, analysis: str, wanted: Instants | None) -> Solution:
    from mbody.analysis.driven.requests import analyse_at as solved

    return solved(mechanism, analysis, wanted)


def _written(figure: Figure, path: str) -> int:
    from mbody.views import save

    save(figure, path)
    message(f"wrote {path}")
    return 0
