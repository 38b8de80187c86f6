"""Work–precision of Andrews' squeezing mechanism: seven bodies, three loops, 30 ms."""

from __future__ import annotations

import numpy as np

import mbody
from benchmarks.frame import Engine, Row, Scope, available, race
from benchmarks.peers import by_hand, mujoco, ours, pinocchio
from benchmarks.planar import planar
from validation import andrews

__all__ = ["TITLE", "measure"]

TITLE = "Andrews' mechanism, to 0.03 s: max |Δq| / max(1, |q|) of the seven angles"
UNTIL = 0.03
WORKLOAD = "andrews_squeezer to 0.03 s"
REFERENCE = np.array(andrews.ANGLES[UNTIL])
NAMES = ("OF", "FE", "BDE", "GE", "AG", "HE", "AH")


def angles_of(bodies: np.ndarray) -> np.ndarray:
    """The test set's seven angles, or rates, some of which it counts from another link."""
    of = dict(zip(NAMES, bodies))
    first = [of["OF"], of["FE"] - of["OF"], of["BDE"], of["GE"] - of["AG"]]
    return np.array([*first, of["AG"], of["HE"] - of["AH"], of["AH"]])


def error(angle: np.ndarray, rate: np.ndarray) -> float:
    """As a part of each of the test set's angles, or in radians below one."""
    off = np.abs(angles_of(angle) - REFERENCE)
    return float((off / np.maximum(1.0, np.abs(REFERENCE))).max())


def bodies_of(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Absolute angles from the test set's."""
    be, th, ga, ph, de, om, ep = y[:7]
    return np.array([be, be + th, ga, ph + de, de, om + ep, ep]), y[7:]


def measure(scope: Scope) -> list[Row]:
    """All engines that are installed."""
    system = mbody.assemble(mbody.gallery.load("andrews_squeezer"))
    machine = planar(system)
    engines: list[Engine] = [ours.engine(system, UNTIL), ours.engine(system, UNTIL, given=True)]
    if available("scipy"):
        start = np.append(angles_of(machine.pose[:, 2]), np.zeros(7))
        names = "NumPy by hand", "by hand in numba"
        engines += by_hand.engines(by_hand.andrews, *names, start, UNTIL, bodies_of)
        if available("pinocchio"):
            engines.append(pinocchio.engine(machine, UNTIL))
            engines.append(pinocchio.engine(machine, UNTIL, project=True))
    if available("mujoco"):
        counts = (100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000)
        engines.append(mujoco.engine(machine, UNTIL, counts))
    return race("andrews", WORKLOAD, engines, error, scope)
