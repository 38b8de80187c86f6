"""Where formulas of loads and own states jump along a motion: `sign` and `step` of what is zero.

Between two jumps each such function is held at the side on which its argument is, so that the
motion is smooth there; where an argument is zero the derivatives change as at every change of modes
(`mbody.derivatives.dual_walk`). Corners, of `abs`, `min` and `max`, leave forces as they are: they
change nothing there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mbody.analysis.dynamics.events import EventIntegration
from mbody.kernels.accelerations import free_motion
from mbody.kernels.layout import Layout, Work
from mbody.laws.postfix import MAX, SIGN, STEP

__all__ = ["JumpGuard", "JumpWatch", "arguments", "held"]

Array = np.ndarray


@dataclass(frozen=True)
class JumpGuard:
    """The argument of functions that jump where it is zero.

    Attributes
    ----------
    number : int
        Its place among the numbers of the formulas.
    size : float
        Its greatest value along the motion.
    """

    number: int
    size: float = 0.0
    kind: ClassVar[str] = "jump"
    direction: ClassVar[int] = 0
    stop: ClassVar[bool] = False
    name: ClassVar[str] = "jump"


def arguments(layout: Layout) -> list[int]:
    """The places of all numbers of which there is a sign or a step."""
    steps = layout.formula_step
    jumping = np.isin(steps[:, 0], (SIGN, STEP)) if len(steps) else np.zeros(0, dtype=bool)
    return [int(place) for place in np.unique(steps[jumping, 1])] if jumping.any() else []


def held(layout: Layout, sides: Mapping[int, float]) -> tuple[Layout, dict[int, float]]:
    """The layout without the functions of these arguments, and what their values are on the sides,
    1 or −1, on which the arguments are, by place.
    """
    steps, values = layout.formula_step.copy(), dict[int, float]()
    for n, (code, a, _, place) in enumerate(layout.formula_step):
        if code in (SIGN, STEP) and int(a) in sides:
            side = sides[int(a)]
            values[int(place)] = side if code == SIGN else max(side, 0.0)
            # the greater one of a number and itself: a step that changes nothing
            steps[n] = MAX, a, a, a
    return layout.replaced(formula_step=steps), values


class JumpWatch(EventIntegration):
    """Integrates a motion once more, and locates where arguments of jumps are zero."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.jumps = [JumpGuard(place) for place in arguments(self.layout)]
        self.first_jump = len(self.events)
        every: list[Any] = self.events
        every += self.jumps
        self.carried = np.append(self.carried, np.zeros(len(self.jumps), dtype=bool))
        #: When which argument is zero.
        self.crossings: list[tuple[float, int]] = []
        self.greatest = dict.fromkeys((one.number for one in self.jumps), 0.0)
        self.aside: Work = self.work.copied()

    def _values(self, which: list[int], t: Array, pages: Array) -> Array:
        last = self.first_jump + len(self.jumps)
        ours = [k for k, n in enumerate(which) if self.first_jump <= n < last]
        others = [k for k, n in enumerate(which) if not self.first_jump <= n < last]
        found = np.empty((len(which), len(t)))
        found[others] = super()._values([which[k] for k in others], t, pages)
        if ours:
            places = [self.jumps[which[k] - self.first_jump].number for k in ours]
            found[ours] = self._arguments(places, t, pages[:, :, 0])
            for place, row in zip(places, found[ours], strict=True):
                self.greatest[place] = max(self.greatest[place], float(np.abs(row).max()))
        return found

    def _arguments(self, places: list[int], t: Array, pages: Array) -> Array:
        """Values (places, instants) of arguments."""
        system, work = self.system, self.aside
        n, owns = system.coordinates, system.layout.owns
        first = system.own_rows.start
        rows = system.layout.input_row
        found = np.empty((len(places), len(t)))
        for k, page in enumerate(pages):
            work.q[:n, 0], work.v[:n, 0] = page[:n], page[n : 2 * n]
            work.own[:owns, 0] = page[first : first + owns]
            work.signal[rows, 0] = page[first + owns : first + owns + len(rows)]
            work.time[0, 0] = t[k]
            free_motion(self.layout, work, self.regularization, 0)
            found[:, k] = work.formula[places, 0]
        return found

    def _record(self, event: Any, t: float, page: Array) -> None:
        if isinstance(event, JumpGuard):
            self.crossings.append((t, event.number))
        else:
            super()._record(event, t, page)
