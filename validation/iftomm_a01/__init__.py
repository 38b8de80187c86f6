"""The simple pendulum of the IFToMM benchmark library, released level, in closed form."""

from __future__ import annotations

import numpy as np

import mbody
from mbody import gallery
from validation.case import Row, Source

__all__ = ["build", "rows"]

EXACT = Source("iftomm_a01", "Jacobi's elliptic functions, forty digits (references)")
ENERGY = Source("iftomm_a01", "kinetic energy against the work of gravity, integrated beside")

#: Place of the bob [m] at times [s].
XY = {
    1.0: (0.986291751131875319, -0.165010853125541168),
    2.0: (-0.793566195343321747, -0.608483930443791515),
    5.0: (-0.942305435043757355, -0.334754338414000581),
    9.99: (-0.316436469913032291, -0.948613704575776519),
    10.0: (-0.275087462476116860, -0.961419205099125064),
}
REASON = "errors of steps of 1e-12 grow as t: 4.2 periods, 300 steps"


def build() -> mbody.Mechanism:
    """The gallery's model."""
    return gallery.load("simple_pendulum")


def rows() -> list[Row]:
    run = mbody.simulate(build(), times=[0.0, *XY])
    P = run.point("pendulum.P")
    found = []
    for n, (t, (x, y)) in enumerate(XY.items(), start=1):
        found += [
            EXACT.absolute(f"x({t:g} s)", P.x[n], x, 1e-9, REASON, "m"),
            EXACT.absolute(f"y({t:g} s)", P.y[n], y, 1e-9, REASON, "m"),
        ]
    balance = np.abs(run.energy.balance).max() / run.energy.size
    return [*found, ENERGY.absolute("balance, relative", balance, 0.0, 1e-10, REASON)]
