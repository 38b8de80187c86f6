"""The bouncing ball: instants of impacts, heights of rebounds, and where they accumulate."""

from __future__ import annotations

import mbody
from mbody import gallery
from validation.case import Row, Source

__all__ = ["build", "rows"]

EXACT = Source("bouncing_ball", "Newton's law of impact in closed form (references)")
ENERGY = Source("bouncing_ball", "kinetic energy against the work of gravity and of the impacts")

#: First impact, where impacts accumulate [s], height after ten of them, whole way [m].
FIRST, LAST = 0.4515236409857309, 4.063712768871579
TENTH, WAY = 0.011529215046068483, 4.555555555555556
REASON = "parabolas are met to rounding, impacts to 1e-12 of a step"
RESTITUTION = 0.8


def build() -> mbody.Mechanism:
    """The gallery's model."""
    return gallery.load("bouncing_ball")


def rows() -> list[Row]:
    run = mbody.simulate(build())
    impacts = [one for one in run.events if one.name == "impact"]
    rest = next(one for one in run.events if one.name == "rest")
    tops = [float(one.state.measure("height")[0]) for one in run.events if one.name == "top"]
    balance = abs(run.energy.balance).max() / run.energy.size
    # heights are a geometric series
    left = 2.0 * RESTITUTION ** (2 * len(impacts)) / (1.0 - RESTITUTION**2)
    summed = "flights after the last impact are summed as a series"
    why = "the ways of these flights, as a geometric series"
    return [
        EXACT.absolute("first impact", impacts[0].t, FIRST, 1e-12, REASON, "s"),
        EXACT.absolute("end of all impacts", rest.t, LAST, 1e-10, summed, "s"),
        EXACT.absolute("height after ten impacts", tops[9], TENTH, 1e-12, REASON, "m"),
        EXACT.absolute("whole way", 1.0 + 2.0 * sum(tops), WAY, 1e-12 + left, why, "m"),
        ENERGY.absolute("balance, relative", balance, 0.0, 1e-13, REASON),
    ]
