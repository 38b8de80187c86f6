"""Norton's four-bar released at 60° under gravity: ten seconds that never repeat themselves."""

from __future__ import annotations

import numpy as np

import mbody
from mbody import gallery
from validation.case import Row, Source

__all__ = ["build", "rows"]

MINIMAL = Source("free_fourbar", "one coordinate, DOP853 at 3e-14, checked by Radau (references)")
ENERGY = Source("free_fourbar", "energy, by a route that the steps did not take")

THETA, OMEGA = -1.83128264206, 14.743461654  # rad, rad/s after 10 s
REASON = "errors of steps grow a thousandfold in ten seconds, and the reference has twelve digits"


def build() -> mbody.Mechanism:
    """The gallery's model."""
    return gallery.load("free_fourbar")


def rows() -> list[Row]:
    found = []
    for rtol, allowed in ((1e-8, 1e-4), (1e-10, 1e-6), (1e-12, 5e-9)):
        run = mbody.simulate(build(), rtol=rtol, instants=101)
        crank = run["crank"]
        told = f"rtol {rtol:g}"
        found += [
            MINIMAL.absolute(f"θ2(10 s), {told}", crank.angle[-1], THETA, allowed, REASON, "rad"),
            MINIMAL.absolute(
                f"ω2(10 s), {told}", crank.omega[-1], OMEGA, 15 * allowed, REASON, "rad/s"
            ),
            ENERGY.absolute(
                f"balance, {told}",
                np.abs(run.energy.balance).max() / run.energy.size,
                0.0,
                1e2 * rtol,
                "relative to the greatest energy; some hundred steps of that error",
            ),
        ]
    return found
