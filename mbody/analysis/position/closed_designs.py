"""All designs of a batch closed in one call of the kernels, each from its own pose."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.analysis.position.whole_turns import by_springs
from mbody.kernels.loop_closure import close_designs
from mbody.system.system import System

__all__ = ["close_batch"]


def close_batch(
    system: System, t: float, values: np.ndarray, poses: np.ndarray, small: Any, least: float
) -> np.ndarray:
    """Close every design of a batch at time t; which of them are closed, away from singular
    positions: (designs,).

    Parameters
    ----------
    values : array (designs, drivers)
        Value of every driver, NaN where its law gives it.
    poses : array (designs, coordinates + 3)
        From where; on return where they closed, with the turns that torsion springs choose.
    small : float or array (designs,)
        Size of a correction that is rounding, in model lengths and radians.
    least : float
        A design whose least pivot is a smaller part of its diagonal is not trusted.
    """
    work, state = system.work(), np.empty((len(poses), 2))
    work.time[:] = t
    close_designs(system.layout, work, np.full(len(poses), small), system.par, values, poses, state)
    by_springs(system, poses)
    closes, pivot = state.T
    return np.asarray((closes > 0.0) & (pivot >= least))
