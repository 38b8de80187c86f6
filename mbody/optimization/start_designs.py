"""Designs to begin searches from: a Latin hypercube, judged side by side on lanes."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbody.analysis.driven.batch_continuation import BatchSetup
from mbody.model.reductions import OVER_TIME
from mbody.model.study import Measure
from mbody.optimization.aims_and_limits import Aim, Limit
from mbody.optimization.design_evaluation import Evaluation, Evaluator
from mbody.optimization.motion_evaluation import MotionEvaluator
from mbody.sweeps.columns import MeasuredColumn
from mbody.sweeps.job import Job, side_by_side

__all__ = ["Screen", "spread_designs"]


@dataclass(frozen=True, eq=False)
class _Values:
    """Histories of one design without derivatives, as an `Evaluation` has them."""

    histories: dict[Measure, np.ndarray]

    def history(self, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
        """A quantity, (instants,), and no derivatives."""
        value = self.histories[measure]
        return value, np.zeros((len(value), 0))


class Screen:
    """Judges many designs of one system by an aim and limits.

    Parameters
    ----------
    job : Job or None
        Of the measures that `columns` names; None of motions over time, which go one by one.
    evaluator : Evaluator
        For designs that cannot go side by side.
    known : array (numbers,), optional
        A design that can be analysed where any can; by default that of the description.
    """

    def __init__(
        self,
        job: Job | None,
        evaluator: Evaluator | MotionEvaluator,
        aims: Sequence[Aim],
        limits: Sequence[Limit],
        known: np.ndarray | None = None,
    ) -> None:
        self.job, self.evaluator, self.aims, self.limits = job, evaluator, aims, limits
        self._known = evaluator.present() if known is None else known

    def about(self, at: Evaluation) -> Screen:
        """The same, designs closed from the position of one of them."""
        job = self.job
        if job is not None and isinstance(job.course, BatchSetup):
            near = replace(job.course, pose=at.pose, origin=at.run.system.par[:, 0].copy())
            job = replace(job, course=near)
        return Screen(job, self.evaluator, self.aims, self.limits, at.x)

    @functools.cached_property
    def by_lanes(self) -> bool:
        """Whether designs go side by side. Lanes go from one instant to the next by steps of one
        length: where instants lie far apart, one design gets there and lanes do not.
        """
        if self.job is None:
            return False
        found = side_by_side(self.job, self._known[None])
        return found is not None and (bool(found[1][0]) or self.evaluator(self._known) is None)

    @staticmethod
    def columns(aims: Sequence[Aim], limits: Sequence[Limit]) -> tuple[MeasuredColumn, ...]:
        """The histories that aims and limits are made of."""
        every = [aim.column for aim in aims]
        every += [side for limit in limits for side in (limit.left, limit.right)]
        measures = dict.fromkeys(column.measure for column in every)
        if any(column.by in OVER_TIME for column in every):
            measures[Measure("t", "s")] = None
        return tuple(MeasuredColumn(f"{n}", one) for n, one in enumerate(measures))

    def judged(self, designs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values of the aims, with the signs that make them least, (designs, aims), and margins of
        the limits, (designs, limits); NaN where a design cannot be analysed.
        """
        values = np.full((len(designs), len(self.aims)), np.nan)
        margins = np.full((len(designs), len(self.limits)), np.nan)
        for design, at in enumerate(self._histories(designs)):
            if at is None:
                continue
            values[design] = [aim.sign * aim.value(at) for aim in self.aims]
            margins[design] = [limit.margin(at) for limit in self.limits]
        return values, margins

    def _histories(self, designs: np.ndarray) -> list[Any]:
        job = self.job
        found = side_by_side(job, designs) if job is not None and self.by_lanes else None
        if job is None or found is None:
            return [self.evaluator.plain(x) for x in designs]
        columns, good = found
        measures = [column.measure for column in job.columns]
        made: list[Any] = []
        for design in range(len(designs)):
            own = [column[design].reshape(-1) for column in columns]
            fine = good[design] and all(np.isfinite(row).all() for row in own)
            made.append(_Values(dict(zip(measures, own, strict=True))) if fine else None)
        return made


def spread_designs(low: np.ndarray, high: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Designs within bounds, one in each of so many slices of every number (McKay 1979): (count,
    numbers).
    """
    rng = np.random.default_rng(seed)
    slices = rng.permuted(np.tile(np.arange(count), (len(low), 1)), axis=1).T
    parts = (slices + rng.random((count, len(low)))) / count
    return np.asarray(low + (high - low) * parts)
