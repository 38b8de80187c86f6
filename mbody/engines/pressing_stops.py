"""Instants at which no stop presses: other engines have no force along a formula of positions."""

from __future__ import annotations

import numpy as np

from mbody.model.element import listed
from mbody.model.stop import Stop
from mbody.solution.solution import Solution

__all__ = ["without_pressing_stops"]


def without_pressing_stops(run: Solution) -> tuple[Solution, list[str]]:
    """A result without the instants at which a stop presses, and a note where there are such."""
    stops = [one.name for one in run.mechanism.contacts if isinstance(one, Stop)]
    if run.analysis != "simulate" or not stops:
        return run, []
    free = np.all([run.contact(name) == 0.0 for name in stops], axis=0)
    if free.all():
        return run, []
    note = (
        f"forces are not compared at {int((~free).sum())} instants at which {listed(stops)} press"
    )
    return run.take(np.flatnonzero(free)), [note]
