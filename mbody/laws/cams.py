"""Cam laws: standard rises between dwells, and periodic programs of rises and dwells."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from mbody.core.tolerances import TABLE_CLOSES, TABLE_PERIOD_ROUNDING
from mbody.errors import ModelError
from mbody.laws.base import FixedLaw, Law, law_field, law_number, with_dimension
from mbody.laws.kernels import SHAPES, FloatArray
from mbody.quantities.formula import Converted, NumberField, is_pending, required
from mbody.quantities.units import Dimension


@dataclass(frozen=True)
class Rise(Law):
    """A rise (or, of negative height, a return or fall) between two dwells.

    Constant `base` up to `start`, then `height` is gained within `duration`, then constant.

    Parameters
    ----------
    shape : str
        Peaks of f′, f″, f‴ in units of h/β, h/β², h/β³ (h = height, β = duration):

        ======================  ======  ======  ======
        "cycloidal"             2       6.2832  39.5
        "harmonic"              1.5708  4.9348  jumps   (f″ is not 0 at the ends)
        "3-4-5"                 1.875   5.7735  60
        "4-5-6-7"               2.1875  7.5132  52.5
        "parabolic"             2       4       jumps   (constant acceleration, then deceleration)
        "modified-trapezoidal"  2       4.8881  61.4
        "modified-sine"         1.7596  5.5280  69.5
        ======================  ======  ======  ======
    height : float
        Total change of f.
    start, duration : float
        Start and duration (> 0) of the rise, in units of x.
    base : float
        Value before the rise.

    Notes
    -----
    Where f″ jumps, the value is that to the right. Norton, Cam Design and Manufacturing Handbook.

    >>> Rise("3-4-5", height=2.0, start=0.0, duration=1.0).derivatives(0.25)[1]
    2.109375
    """

    kind: ClassVar[str] = "pieces"

    shape: str
    height: NumberField = law_field(1)
    start: NumberField = law_field(argument=1)
    duration: NumberField = law_field(argument=1)
    base: NumberField = law_field(1, default=0.0)

    def _check(self) -> None:
        if self.shape not in SHAPES:
            raise ModelError(f"Rise: shape must be one of {', '.join(SHAPES)}, not {self.shape!r}")
        if self.duration <= 0.0:
            raise ModelError(
                f"Rise: duration must be positive, it is {self.duration:g}: a fall is "
                "a rise of negative height"
            )

    def numbers(self) -> dict[str, float]:
        """{"height": …, "start": …, "duration": …, "base": …}."""
        return {name: getattr(self, name) for name in ("height", "start", "duration", "base")}

    def parameters(self, numbers: Mapping[str, Any]) -> list[Any]:
        """[height, start, duration, base]."""
        return [numbers[name] for name in ("height", "start", "duration", "base")]

    def table(self) -> FloatArray:
        """[shape code]."""
        return np.array([float(SHAPES.index(self.shape))])

    def turns(self, x: float) -> FloatArray:
        """Start and end of the rise, those after x."""
        places = np.array([self.start, self.start + self.duration])
        return places[places > x]


@dataclass(frozen=True)
class Dwell:
    """A part of a `Cam` program in which the follower rests, `duration` > 0 in units of x.

    >>> Dwell(0.1)
    Dwell(duration=0.1)
    """

    duration: NumberField = required()

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration", law_number(self.duration, "Dwell", "duration"))
        if not is_pending(self.duration) and self.duration <= 0.0:
            raise ModelError(f"Dwell: duration must be positive, it is {self.duration:g}")

    def dimensioned(self, value: Dimension, argument: Dimension) -> Dwell:
        """A copy with the units of its text checked against the dimension of the argument."""
        return Dwell(with_dimension(self.duration, argument, "duration"))


@dataclass(frozen=True)
class Cam(FixedLaw):
    """A cam program: rises, returns and dwells one after another, repeated with the period.

    Parameters
    ----------
    segments : sequence of Rise or Dwell
        In order from x = 0. Each segment begins where the one before it ended. The `start` of a
        rise counts from there: 0 means no dwell before it, a positive number is the length of that
        dwell. Each rise begins at the level that the one before it reached; only the first may have
        a `base`, the level at x = 0. The heights must add up to 0.
    period : float
        The program repeats with it; the time after the last segment is a dwell.

    Raises
    ------
    ModelError
        The program does not close, or lasts longer than the period.

    >>> lift, fall = Rise("cycloidal", 2.0, 0.0, 1.0), Rise("3-4-5", -2.0, 0.0, 1.0)
    >>> cam = Cam([lift, Dwell(0.5), fall], period=4.0)
    >>> cam(np.array([0.5, 1.2, 2.0, 3.0, 4.5]))
    array([1., 2., 1., 0., 1.])
    """

    kind: ClassVar[str] = "pieces"

    segments: Converted[tuple[Rise | Dwell, ...], Sequence[Rise | Dwell]] = required()
    period: NumberField = law_field(argument=1)

    def _read_numbers(self) -> None:
        super()._read_numbers()
        try:
            object.__setattr__(self, "segments", tuple(self.segments))
        except TypeError:
            raise ModelError(
                f"Cam: segments must be a list of Rise and Dwell, not {self.segments!r}"
            ) from None
        for i, segment in enumerate(self.segments):
            if not isinstance(segment, Rise | Dwell):
                raise ModelError(f"Cam: segments[{i}] must be a Rise or a Dwell, not {segment!r}")

    def _check(self) -> None:
        if self.period <= 0.0:
            raise ModelError(f"Cam: period must be positive, it is {self.period:g}")
        if not self._rises:
            raise ModelError("Cam: the program has no rise; use Constant for a law without motion")

    def dimensioned(self, value: Dimension, argument: Dimension) -> Law:
        """A copy with the units of its text checked: rises and dwells of the segments, and the
        period.
        """
        if not self.pending:
            return self
        segments: list[Any] = [segment.dimensioned(value, argument) for segment in self.segments]
        return Cam(segments, with_dimension(self.period, argument, "period"))

    @cached_property
    def _rises(self) -> tuple[Rise, ...]:
        """The rises with their start and base counted from x = 0 and from the level there."""
        end, level, base = 0.0, 0.0, 0.0
        rises: list[Rise] = []
        for i, segment in enumerate(self.segments):
            if isinstance(segment, Dwell):
                end += segment.duration
                continue
            if segment.start < 0.0:
                raise ModelError(
                    f"Cam: segments[{i}] starts {-segment.start:g} before the segment "
                    "before it ends; start counts from that end"
                )
            if segment.base and rises:
                raise ModelError(
                    f"Cam: segments[{i}] has base = {segment.base:g}, but the level is "
                    "taken from the segment before it: leave base out"
                )
            if not rises:
                level = base = segment.base
            rises.append(replace(segment, start=end + segment.start, base=level))
            end += segment.start + segment.duration
            level += segment.height
        size = max((abs(rise.height) for rise in rises), default=0.0)
        if abs(level - base) > TABLE_CLOSES * size:
            raise ModelError(
                f"Cam: the program ends {level - base:+g} from where it began: the "
                "heights of its rises and returns must add up to 0"
            )
        if end > self.period * (1.0 + TABLE_PERIOD_ROUNDING):
            raise ModelError(
                f"Cam: the segments last {end:g} in all, longer than the period {self.period:g}"
            )
        if rises:  # close to the last digit
            rises[-1] = replace(rises[-1], height=base - rises[-1].base)
        return tuple(rises)

    def table(self) -> FloatArray:
        """[period, count, then shape code, height, start, duration, base of each rise]."""
        rows = [[SHAPES.index(r.shape), r.height, r.start, r.duration, r.base] for r in self._rises]
        return np.concatenate([[self.period, len(rows)], np.ravel(rows)])

    def turns(self, x: float) -> FloatArray:
        """Starts and ends of the rises within one period after x."""
        own = [place for r in self._rises for place in (r.start, r.start + r.duration)]
        places = np.append(own, self.period) + self.period * math.floor(x / self.period)
        places = np.append(np.concatenate([places, places + self.period]), x + self.period)
        return np.unique(places[(places > x) & (places <= x + self.period)])
