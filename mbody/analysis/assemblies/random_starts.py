"""Assembly modes by Newton's method from many random poses: for what has no certificate.

The poses are always the same ones, so that results are. Modes may be missing.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mbody.analysis.position.assembly_analysis import raise_user_error, set_drive
from mbody.analysis.position.initial_guess import placed
from mbody.kernels.loop_closure import close
from mbody.system.rank import dense
from mbody.system.system import System

__all__ = ["modes_by_random_starts", "same_pose"]

#: Poses that are tried.
STARTS = 240
#: A correction that is rounding, and an open row, in model lengths and radians.
ROUNDING, OPEN = 1e-13, 1e-9
#: Poses nearer than this are one, in model lengths and radians.
ONE = 1e-6


def modes_by_random_starts(system: System, drive: dict[str, float], t: float) -> np.ndarray:
    """Poses (modes, coordinates + 3) that were found, in the order of their numbers."""
    work = system.work()
    values = set_drive(system, work, t, drive)
    bodies = [body.name for body in system.mechanism.bodies]
    found: list[np.ndarray] = []
    for n in range(STARTS):
        random = np.random.default_rng(n)
        guess = {name: float(random.uniform(-np.pi, np.pi)) for name in bodies}
        start = placed(system, guess, values)
        if n % 2:  # slides anywhere
            off = random.normal(size=len(start)) * system.length
            off[2::3] = 0.0
            off[-3:] = 0.0
            start = start + off
        work.q[:, 0] = start
        good, _, _ = close(
            system.runtime(), work, 0.0, ROUNDING * (1.0 + float(system.extent(start)))
        )
        raise_user_error(system)
        if not good or not np.isfinite(work.q).all():
            continue
        if np.abs(dense(system, work)[0]).max(initial=0.0) > OPEN:
            continue
        pose = work.q[:, 0].copy()
        if not any(same_pose(system, pose, other) for other in found):
            found.append(pose)
    return np.array(found).reshape(len(found), system.coordinates + 3)


def same_pose(
    system: System, one: np.ndarray, other: np.ndarray, meshed: Collection[int] = ()
) -> bool:
    """Whether two poses are one, whole turns aside; angles of `meshed` bodies do not count."""
    n = system.coordinates
    apart = (one - other)[:n] / system.coordinate_units
    apart[2::3] = np.remainder(apart[2::3] + np.pi, 2.0 * np.pi) - np.pi
    for body in meshed:
        if 3 * body + 2 < n:
            apart[3 * body + 2] = 0.0
    return bool(np.abs(apart).max(initial=0.0) < ONE)
