"""Two aims: the designs of which none is better in both, by bounds of one aim (ε-constraints)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mbody.optimization.aims_and_limits import Aim, Limit, ObjectiveRows
from mbody.optimization.design_evaluation import Evaluation
from mbody.optimization.multi_start import Ended, MultiStart
from mbody.optimization.nonlinear_program import HOLDS, Found
from mbody.optimization.optimum import Optimum, ParetoPoint
from mbody.optimization.results import optimum_of

__all__ = ["pareto_front"]


class _Bounded:
    """The limit that an aim stays below a value, with the sign that makes it least."""

    equal = False

    def __init__(self, aim: Aim, value: float, unit: str) -> None:
        self.aim, self.value, self.unit = aim, value, unit
        self.text = f"{aim.text} {'>=' if aim.greatest else '<='} {aim.sign * value:.6g} {unit}"

    def rows(self, at: Evaluation) -> ObjectiveRows:
        """By how much each instant stays below."""
        own = self.aim.rows(at)
        return ObjectiveRows(self.value - own.values, -own.slopes, own.instants)

    def margin(self, at: Evaluation) -> float:
        """By how much all do."""
        return float(self.rows(at).values.min())


def pareto_front(
    search: MultiStart, aims: Sequence[Aim], limits: Sequence[Limit], points: int, loss: float
) -> Optimum:
    """The front from the best of the first aim to the best of the second, and of its designs the
    one that is nearest to the best of both, each aim by its range on the front.
    """
    first, second = aims
    ends = [search.ended(aim, limits) for aim in aims]
    values = np.array([[_least(aim, end.best.at) for aim in aims] for end in ends])
    scales = [end.program.scale for end in ends]
    found: list[tuple[Found, Ended]] = [(ends[0].best, ends[0]), (ends[1].best, ends[1])]
    low, high = values[1, 1], values[0, 1]
    if high - low > HOLDS * scales[1]:
        place = [ends[0].best.at.x, ends[1].best.at.x]
        for value in np.linspace(high, low, points)[1:-1]:
            bounded = _Bounded(second, float(value), "")
            program = search.program(first, [*limits, bounded])  # type: ignore[list-item]
            tried = [end for x in place if (end := program.search(x)) is not None]
            held = [one for one in tried if one.broken <= HOLDS]
            if held:
                best = min(held, key=lambda one: one.value)
                place[0] = best.at.x
                found.append((best, replace(ends[0], best=best, program=program)))
    both = np.array([[_least(aim, one.at) for aim in aims] for one, _ in found])
    kept = [n for n, own in enumerate(both) if not _beaten(own, both)]
    order = sorted(kept, key=lambda n: tuple(both[n]))
    span = np.maximum(np.ptp(both[order], axis=0), 1e-300)
    near = [float(np.hypot(*((both[n] - both[order].min(axis=0)) / span))) for n in order]
    knee = order[int(np.argmin(near))]
    names = search.ranges.given
    front = tuple(
        ParetoPoint(
            tuple(aim.value(found[n][0].at) for aim in aims),
            dict(zip(names, found[n][0].at.x.tolist(), strict=True)),
        )
        for n in order
    )
    ended = replace(
        found[knee][1],
        starts=sum(end.starts for end in ends),
        agreeing=sum(end.agreeing for end in ends),
    )
    return optimum_of(search, ended, first, limits, loss, front, aims)


def _least(aim: Aim, at: Evaluation) -> float:
    """An aim with the sign that makes it least."""
    return aim.sign * aim.value(at)


def _beaten(own: np.ndarray, every: np.ndarray) -> bool:
    """Whether another design is as good in both aims and better in one."""
    return bool(((every <= own).all(axis=1) & (every < own).any(axis=1)).any())
