"""First rates of free motions of which nothing says how fast they begin while drivers move."""

from __future__ import annotations

import numpy as np

from mbody.analysis.freedom.free_motions import free_motions
from mbody.kernels.layout import Work
from mbody.system.rank import dense, dense_rates, rank_of, too_large
from mbody.system.system import System

__all__ = ["unsaid_rates"]

Array = np.ndarray

#: A rate below this part of the fastest is none; bodies that a note names.
STILL, NAMED = 1e-6, 4


def unsaid_rates(
    system: System, work: Work, v: Array, said: Array | None = None
) -> tuple[str, ...]:
    """A sentence of the bodies that begin to move though they are free to rest.

    Drivers that move leave open how fast free bodies do; of all rates that fit those of least norm
    are taken, which is seldom what was meant.

    Parameters
    ----------
    work : Work
        A workspace at the closed position.
    v : array (coordinates,)
        The first rates, without units of length.
    said : array (conditions, coordinates), optional
        Rows of the rates that are prescribed.
    """
    if too_large(system) or not np.abs(dense_rates(system, work)).max(initial=0.0) > 0.0:
        return ()
    G = dense(system, work)[1]
    motions = rank_of(G if said is None else np.vstack([G, said])).motions
    if not len(motions):
        return ()
    rates = (v * system.coordinate_units).reshape(-1, 3)
    fast, unit, found = float(np.abs(v).max(initial=0.0)), system.mechanism.units, []
    for motion in free_motions(system, work.q[:, 0], motions):
        n = system.bodies[motion.leader]
        parts = [(2, "omega", "angular velocity")] if motion.turns else []
        for k, key, dimension in parts or [(0, "vx", "velocity"), (1, "vy", "velocity")]:
            if abs(float(v[3 * n + k])) > STILL * fast:
                value = f"{float(rates[n, k]):.6g} {unit.of(dimension)}"
                found.append(f"'{motion.leader}' begins with {key} = {value}")
    if not found:
        return ()
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    return (
        f"{', '.join(found[:NAMED])}{more}: drivers move, and nothing says how fast what is free "
        "does, so that of all rates the least were taken; say in start of one of its bodies where "
        "it begins and how fast, as by y and vy",
    )
