"""Whether the balance of energy of a motion supports it: the one place that judges it.

The balance is what a motion's energy changed beside what loads and drivers gave, by a route that
its steps did not take. A step may err by `rtol` of each coordinate, and so by that part of the
energy that takes part, or of what the forces do along the size of the model; steps add up. Steps of
one length have no tolerance: a motion by them can be trusted where it keeps a certain part of the
energy. Efforts of drivers may jump where the motion does not, and the work of a jump comes
out as well as the steps resolve it; a motion that follows drivers does not depend on that.
"""

from __future__ import annotations

import math

import numpy as np

from mbody.kernels.output import PER_PRIMITIVE
from mbody.kernels.residuals import TERM
from mbody.model.simulation import EVEN
from mbody.solution.doubts import Doubt
from mbody.solution.solution import Solution

__all__ = ["energy_doubts"]

#: What a step may err by, in tolerances: in the gallery and in random mechanisms, by all methods at
#: 1e-3 … 1e-12, none errs by a fifth of that.
OF_A_STEP = 5.0
#: The part of the energy that steps of one length, and motions with drivers, may err by.
EVENLY, DRIVEN = 0.05, 0.15
#: Rounding of an account, and of a step.
ROUNDING = 1e-13


def energy_doubts(run: Solution, method: str, rtol: float) -> list[Doubt]:
    """A doubt where the balance of energy of a motion is out of proportion; else none.

    Parameters
    ----------
    run : Solution
        Of `simulate`.
    method, rtol : str, float
        How it was followed.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.simulate(mbody.gallery.load("double_pendulum"), 1.0)
    >>> energy_doubts(run, "dop853", 1e-8)
    []
    """
    energy = run.energy
    if energy is None or not len(run):
        return []
    steps = max(1, (run.stats or {}).get("steps", 1))
    size, forces = energy.size, _force(run) * run.system.length
    part = ROUNDING * steps
    if method in EVEN:
        part = max(part, EVENLY)
    else:
        part = max(part, OF_A_STEP * rtol * steps)
        if any(run.released.get(one.name, math.inf) > run.t[0] for one in run.system.drivers):
            part = max(part, DRIVEN)
    allowed = part * size + (OF_A_STEP * rtol * steps + ROUNDING) * forces
    off = np.abs(energy.balance)
    beyond = np.flatnonzero(off > allowed)
    if not len(beyond):
        return []
    units = run.mechanism.units
    t, worst, unit = float(run.t[beyond[0]]), float(off.max()), units.of("torque")
    remedy = "ask for a smaller rtol, or look at what the motion runs into there"
    if method in EVEN:
        remedy = "take shorter steps"
    message = (
        f"the balance of energy is out by {worst:.3g} {unit}, of {size:.3g} {unit} that took part: "
        f"from t = {t:.6g} {units.time} on by more than steps like these err by; {remedy}"
    )
    return [Doubt("energy", message, t)]


def _force(run: Solution) -> float:
    """The greatest force of joints and drivers at an ordinary instant; of steps with impulses the
    greatest term of their equation.
    """
    if run.stepped is not None:
        return float(np.median(run.stepped.residuals[0, :, TERM]))
    first = 3 * run.system.coordinates
    primitives = run.record.table(slice(first, first + PER_PRIMITIVE * len(run.system.owners)))
    if not primitives.size:
        return 0.0
    forces = np.abs(primitives.reshape(len(run), -1, PER_PRIMITIVE)[:, :, 2:4]).max(axis=(1, 2))
    return float(np.median(forces))
