"""Curves walked by pseudo-arclength, and places between the points of a walk."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple, Self, TypeVar

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.bracket import place_between

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """A point of a curve.

    `x`: Its place, without units.
    `along`: Unit tangent in the direction of the walk.
    `side`: Of the sign of the determinant of the curve's equations and the tangent: it changes
      where another branch is crossed, or leapt to, and there alone.
    `frame`: Of the space of dependent equations, in which that sign is taken.
    """

    #: Numbers beside these two that change their sign with the direction.
    odd: ClassVar[tuple[str, ...]] = ()
    x: Array
    along: Array
    side: float
    frame: Array | None

    def crosses(self, other: CurvePoint) -> bool:
        """Whether another branch lies between two neighbours."""
        return self.side * other.side < 0.0

    def reversed(self) -> Self:
        """The point as one comes to it from the other side."""
        names = ("along", "side", *self.odd)
        return replace(self, **{name: -getattr(self, name) for name in names})


P = TypeVar("P", bound=CurvePoint)
#: The point of the curve near a place, None where there is none; given are a point from where one
#: comes, the place, and a direction that the tangent is to go on in.
Close = Callable[[P, Array, Array], P | None]


class Pace(NamedTuple):
    """Lengths of steps, and what a step may change.

    `first`, `longest`, `shortest`: Of steps; no shorter one is tried.
    `turn`: Greatest angle between the tangents of neighbours [rad]. The chord lies between them:
      its angle to the first is half of theirs where the curvature is constant.
    `growth`, `shrink`: Of steps, at most, and of those that fail.
    `leap`: Length down to which leaps are refused.
    """

    first: float
    longest: float
    shortest: float
    turn: float
    growth: float = 2.0
    shrink: float = 0.5
    leap: float = 0.0


#: Part of the greatest angle between tangents that a chord may make with the first of them.
CHORD = 0.6
#: Part of a step by which it goes on at least.
ADVANCE = 0.01


def norm(x: Array) -> float:
    """Euclidean."""
    return math.sqrt(float(x @ x))


def walk(
    here: P,
    close: Close[P],
    pace: Pace,
    leaps: Callable[[P, P], bool] = CurvePoint.crosses,
    longest: Callable[[P, P], float] | None = None,
    size: Callable[[Array], float] = norm,
) -> Iterator[tuple[P, P, bool]]:
    """Neighbours on a curve in order, until no step goes on; predicted by the tangent and by how it
    turned in the step before (Keller 1977).

    A step is refused, and a shorter one tried, where it does not close, or turns by more than the
    pace allows, so that it does not leave its branch. `leaps`: Whether two points cannot be
    neighbours, although they look so; such a step is refused while it is longer than the pace says,
    and then told by the third of what is returned. `longest`: The longest step after two points,
    instead of the pace's. `size`: Of a direction; how steps are measured.
    """
    step, curvature, cosine = pace.first, np.zeros(len(here.along)), math.cos(pace.turn)
    while step >= pace.shortest:
        arc = step / size(here.along)
        bend = arc * curvature
        ahead = here.along + 0.5 * bend if norm(bend) < pace.turn else here.along
        there = close(here, here.x + arc * ahead, here.along)
        leap = False
        if there is not None:
            chord = there.x - here.x
            length = float(chord @ here.along)
            turned = float(there.along @ here.along)
            aside = norm(chord - length * here.along)
            straight = turned >= cosine and aside <= CHORD * pace.turn * length
            straight &= length > ADVANCE * arc  # a corner throws steps back to where they begin
            leap = straight and leaps(here, there)
            if not straight or (leap and step > pace.leap):
                there = None
        if there is None:
            step *= pace.shrink
            continue
        yield here, there, leap
        curvature = (there.along - here.along) / length
        curvature -= float(curvature @ there.along) * there.along
        bound = 0.9 * pace.turn / max(norm(there.along - here.along), tol.TINY)
        step *= min(bound, pace.growth)
        step = min(step, pace.longest if longest is None else longest(here, there))
        here = there


def between(close: Close[P], one: P, other: P, part: float) -> P | None:
    """The point at a part of the chord between two neighbours, from the cubic through both."""
    chord = other.x - one.x
    size = norm(chord)
    first, last = (size * size / float(end.along @ chord) * end.along for end in (one, other))
    left = 1.0 - part
    x = one.x + part * part * (3.0 - 2.0 * part) * chord
    x += part * left * left * first - part * part * left * last
    along = 6.0 * part * left * chord + left * (1.0 - 3.0 * part) * first
    along += part * (3.0 * part - 2.0) * last
    return close(one, x, along / norm(along))


def zero_on(
    close: Close[P],
    one: P,
    other: P,
    value: Callable[[P], float],
    width: float,
    guess: float = math.nan,
) -> tuple[P, P, P]:
    """The point between two neighbours at which a value passes zero, and the ends of its bracket, a
    part of their chord wide.
    """
    ends = {0.0: one, 1.0: other}
    return place_between(lambda part: between(close, one, other, part), value, ends, width, guess)
