"""The kinetic energy of all links, from their histories."""

from __future__ import annotations

import numpy as np

from mbody.solution.solution import Solution

__all__ = ["link_energy"]


def link_energy(run: Solution) -> np.ndarray:
    """½ Σ (m v² + I ω²) at every instant (instants,), of a result of one design.

    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(3, 0, 0), speed=2.0)
    >>> link_energy(mbody.kinematics(machine)).round(12)  # a rod about its end: ½ (m l²/3) ω²
    array([2.])
    """
    bodies = run.mechanism.bodies
    rates = np.array([[run[b.name].vx, run[b.name].vy, run[b.name].omega] for b in bodies])
    places = np.array([run.system.bodies[body.name] for body in bodies])
    mass = np.asarray(run.system.mass[:, 0]).reshape(-1, 3)[places]
    return np.asarray(0.5 * np.einsum("bk,bkt->t", mass, rates**2))
