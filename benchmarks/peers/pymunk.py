"""pymunk (Chipmunk): pins as `PivotJoint`, solved by iterated impulses; of first order.

`error_bias` 0 takes the whole gap back in every step; 30 iterations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.frame import Engine
from benchmarks.planar import GROUND, Planar

__all__ = ["engine", "space_of"]


def space_of(machine: Planar, iterations: int = 30) -> tuple[Any, list[Any]]:
    """The space and its bodies at the start."""
    import pymunk

    space = pymunk.Space()
    space.gravity, space.iterations, space.damping = (0.0, machine.gravity), iterations, 1.0
    bodies = []
    for mass, inertia, pose, rate in zip(
        machine.mass, machine.inertia, machine.pose.tolist(), machine.rate.tolist()
    ):
        body = pymunk.Body(float(mass), float(inertia))
        body.position, body.angle = (pose[0], pose[1]), pose[2]
        body.velocity, body.angular_velocity = (rate[0], rate[1]), rate[2]
        bodies.append(body)
    space.add(*bodies)
    of = {GROUND: space.static_body, **dict(enumerate(bodies))}
    for i, j, on_i, on_j in machine.pins:
        pin = pymunk.PivotJoint(of[i], of[j], on_i, on_j)
        pin.error_bias, pin.collide_bodies = 0.0, False
        space.add(pin)
    return space, bodies


def engine(machine: Planar, until: float, counts: Sequence[int]) -> Engine:
    """So many steps of equal length."""

    def prepare(count: int) -> Callable[[], Any]:
        space, bodies = space_of(machine)
        step = until / count

        def run() -> Any:
            for _ in range(count):
                space.step(step)
            return space, bodies

        return run

    def state(found: Any) -> tuple[np.ndarray, np.ndarray]:
        angles = np.array([body.angle for body in found[1]])
        return angles, np.array([body.angular_velocity for body in found[1]])

    return Engine("pymunk", list(counts), prepare, state)
