"""Searches from several starts: the description, then the best of a Latin hypercube."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mbody.derivatives.named_numbers import changed
from mbody.errors import ModelError, SolveError
from mbody.optimization.aims_and_limits import Aim, Limit
from mbody.optimization.design_evaluation import Evaluator
from mbody.optimization.motion_evaluation import MotionEvaluator
from mbody.optimization.nonlinear_program import HOLDS, Found, Program
from mbody.optimization.ranges import Ranges
from mbody.optimization.start_designs import Screen, spread_designs

__all__ = ["Ended", "MultiStart"]

#: Designs of the hypercube for each number and each search, and the least number of them.
EACH, LEAST = 24, 256
#: Ends whose values differ by less than this part agree.
AGREE = 1e-4
#: Starts are apart by this part of the ranges, where there are enough.
APART = 0.15


@dataclass(frozen=True)
class Ended:
    """What the searches found.

    Attributes
    ----------
    best : Found
    program : Program
    starts, agreeing : int
    status : str
    notes : tuple of str
    """

    best: Found
    program: Program
    starts: int
    agreeing: int
    status: str
    notes: tuple[str, ...]


@dataclass
class MultiStart:
    """Searches of designs of one system within ranges.

    Attributes
    ----------
    count, seed : int
        Of searches.
    seen : callable or None
        Called with the finished searches and all.
    """

    evaluator: Evaluator | MotionEvaluator
    screen: Screen
    ranges: Ranges
    count: int
    seed: int
    seen: Callable[[int, int], None] | None = None
    done: int = 0
    spread: np.ndarray | None = None
    judged: tuple[np.ndarray, np.ndarray] | None = field(default=None)

    def mark(self) -> None:
        """Where a search may be stopped."""
        if self.seen is not None:
            self.seen(self.done, self.count * len(self.screen.aims))

    def program(self, aim: Aim, limits: Sequence[Limit]) -> Program:
        """What is to be least, within the ranges."""
        bounds = self.ranges.low, self.ranges.high
        return Program(self.evaluator, bounds, aim, limits, self.mark)

    def ended(self, aim: Aim, limits: Sequence[Limit]) -> Ended:
        """The best of all searches.

        Raises
        ------
        SolveError
            Where no design can be analysed, or none meets the limits.
        """
        program, notes = self.program(aim, limits), list(self.ranges.notes)
        status, found = "completed", []
        try:
            starts = self.starts(aim)
            first = program.at(starts[0])
            assert first is not None
            program.measure_by(first)
            notes += self._examined(program, aim, limits, starts)
            for x in starts:
                end = program.search(x)
                if end is not None:
                    found.append(end)
                self.done += 1
                self.mark()
        except KeyboardInterrupt:
            if not found:
                raise
            status = f"stopped: after {len(found)} of {self.count} searches"
        held = [one for one in found if one.broken <= HOLDS]
        if not held:
            raise self._none(min(found, key=lambda one: one.broken), limits)
        best = min(held, key=lambda one: one.value)
        near = AGREE * max(abs(best.value), 1e-9 * program.scale)
        agreeing = sum(one.value <= best.value + near for one in held)
        return Ended(best, program, len(found), agreeing, status, tuple(notes))

    def starts(self, aim: Aim) -> list[np.ndarray]:
        """Where searches begin: the start that was given, then the best of many that are apart.

        Raises
        ------
        SolveError
            Where no design can be analysed.
        """
        ranges = self.ranges
        if self.spread is None or self.judged is None:
            many = max(LEAST, EACH * len(ranges.names), 4 * self.count)
            if not self.screen.by_lanes:
                many = 4 * self.count  # one by one
            self.spread = spread_designs(ranges.low, ranges.high, many, self.seed)
            self.judged = self.screen.judged(self.spread)
        values, margins = self.judged
        first = self.evaluator(ranges.start)
        sound = first is not None and bool(np.isfinite(aim.rows(first).values).all())
        closing = np.isfinite(values).all(axis=1)
        if not sound and not closing.any():
            raise self._unreachable(len(values))
        order = _by_merit(values[:, self.screen.aims.index(aim)], margins, closing)
        chosen = [ranges.start] if sound else []
        width = ranges.high - ranges.low
        for apart in (APART, 0.0):
            for k in order:
                x = self.spread[k]
                far = [np.abs((x - other) / width).max() for other in chosen]
                if len(chosen) < self.count and min(far, default=1.0) > apart:
                    chosen.append(x)
        begun = [x for x in chosen if self.evaluator(x) is not None]
        if not begun:
            raise self._unreachable(len(values))
        return begun[: self.count]

    def _examined(
        self,
        program: Program,
        aim: Aim,
        limits: Sequence[Limit],
        starts: Sequence[np.ndarray],
    ) -> list[str]:
        """Refuse an aim that no number changes; sentences for limits that none changes."""
        ways = [at for at in map(self.evaluator, starts[:3]) if at is not None]
        names, system = list(self.ranges.names), self.evaluator.system
        ranges = self.ranges.high - self.ranges.low

        def moves(rows: list[tuple[np.ndarray, np.ndarray]]) -> bool:
            return any(
                changed(system, names, value, slope).any() and (np.abs(slope) * ranges).any()
                for value, slope in rows
            )

        own = [(rows.values, rows.slopes) for rows in (aim.rows(at) for at in ways)]
        if not moves(own):
            given = ", ".join(f"'{name}'" for name in self.ranges.given)
            raise ModelError(
                f"optimize: none of {given} changes '{aim.text}': its derivatives are zero; vary "
                "other numbers, or choose another aim"
            )
        return [
            _unchanged(limit)
            for limit in limits
            if not moves([(rows.values, rows.slopes) for rows in (limit.rows(at) for at in ways)])
        ]

    def _unreachable(self, count: int) -> SolveError:
        """The error where no design within the bounds can be analysed."""
        ranges = self.ranges
        why = self.evaluator.failure(ranges.start)
        return SolveError(
            f"optimize: none of {count} designs within the bounds can be analysed at all instants "
            f"with derivatives; at the start: {why}; give other bounds"
        )

    def _none(self, nearest: Found, limits: Sequence[Limit]) -> SolveError:
        """The error where no design meets the limits."""
        sizes = nearest.at
        worst = min(limits, key=lambda limit: limit.margin(sizes))
        given, x = self.ranges.given, nearest.at.x
        at = ", ".join(f"{name} = {value:.6g}" for name, value in zip(given, x, strict=True))
        return SolveError(
            f"optimize: no design within the bounds meets all limits: '{worst.text}' is missed by "
            f"{-worst.margin(sizes):.4g} {worst.unit}".rstrip()
            + f" at the nearest, {at}: give it more, or widen the bounds"
        )


def _unchanged(limit: Limit) -> str:
    """The note of a limit that decides nothing."""
    return f"none of the numbers changes '{limit.text}'"


def _by_merit(values: np.ndarray, margins: np.ndarray, closing: np.ndarray) -> np.ndarray:
    """Designs that can be analysed, those that break limits least first, then the better ones."""
    places = np.flatnonzero(closing)
    sizes = np.maximum(np.median(np.abs(margins[places]), axis=0), 1e-300) if len(places) else 1.0
    broken = np.maximum(0.0, -margins[places] / sizes).sum(axis=1)
    return places[np.lexsort((values[places], np.where(broken > 0.0, broken, 0.0)))]
