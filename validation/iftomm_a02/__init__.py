"""N windows of the IFToMM benchmark library: through every singular position, at every tolerance.

Each time the rods lie in one line the mechanism loses N ranks and could change its form. The exact
motion is that of one angle, θ'' = −g ((N + 1)/2 + N)/((N + 1)/3 + N) cos θ.
"""

from __future__ import annotations

import math

import mbody
from mbody import gallery, makers
from validation.case import Row, Source

__all__ = ["build", "rows"]

EXACT = Source("iftomm_a02", "the one angle's equation in quadruple precision (references)")

#: θ(10 s) [rad] by N.
THETA = {
    1: -30.343944970943127889,
    2: -30.179800860191205197,
    40: -30.02663741719084110,
}
#: Error allowed at a tolerance of the steps.
ALLOWED = {1e-6: 1e-3, 1e-8: 1e-5, 1e-10: 1e-7, 1e-12: 1e-8}
REASON = "what is asked at that tolerance: errors grow some hundredfold over twenty swings"


def build(count: int = 2) -> mbody.Mechanism:
    """The gallery's model for 2 and 40; one window is a four-bar of equal rods."""
    if count > 1:
        return gallery.load(f"n_windows_{count}")
    window = makers.four_bar(*(1.0, 1.0, 1.0, 1.0), masses=(1.0, 1.0, 1.0), start=math.pi / 2.0)
    machine = mbody.Mechanism("a window", ground=window.ground.points)
    machine.add(*window.bodies, *window.joints, mbody.Gravity("gravity", y=-9.81))
    machine.simulation = mbody.SimulationSettings(
        10.0, {"crank": {"angle": math.pi / 2.0, "omega": -1.0}}
    )
    return machine


def rows() -> list[Row]:
    found = []
    for count, theta in THETA.items():
        machine = build(count)
        post = machine.bodies[0].name
        for rtol, allowed in ALLOWED.items():
            run = mbody.simulate(machine, rtol=rtol, times=[10.0])
            ours = run[post].angle[0]
            told = f"θ(10 s), N = {count}, rtol {rtol:g}"
            found.append(EXACT.absolute(told, ours, theta, allowed, REASON, "rad"))
    return found
