"""pymunk (Chipmunk): pins as `PivotJoint`, solved by iterated impulses; of first order.

`error_bias` 0 takes the whole gap back in every step; 30 iterations. What touches is rigid, by
Newton's law of impact; no overlap is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.frame import Engine
from benchmarks.planar import GROUND, Planar

__all__ = ["engine", "space_of"]

#: Radius of what stands for a point [m]; the wall is as much lower.
POINT = 1e-5
#: Half the length of guides and walls [m].
LONG = 99.0


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
    for i, j, stiffness in machine.twists:  # its sense is that of the first body on the second
        space.add(pymunk.DampedRotarySpring(of[i], of[j], 0.0, stiffness, 0.0))
    for body, number in machine.held:
        if number == 2:
            of[body].moment = math.inf
            continue
        ends = ((0.0, -LONG), (0.0, LONG)) if number == 0 else ((-LONG, 0.0), (LONG, 0.0))
        guide = pymunk.GrooveJoint(space.static_body, of[body], *ends, (0.0, 0.0))
        guide.error_bias = 0.0
        space.add(guide)
    touch(machine, space, of)
    return space, bodies


def touch(machine: Planar, space: Any, of: dict[int, Any]) -> None:
    """The wall, a metre thick to both sides, rims and boxes; Chipmunk multiplies the friction of
    both shapes, and what they return.
    """
    import pymunk

    if not machine.rims and not machine.boxes:
        return
    space.collision_slop = 0.0
    low = 1.0 + (0.0 if all(rim.radius for rim in machine.rims) else POINT)
    (x, y), (nx, ny) = machine.wall
    x, y = x - low * nx, y - low * ny
    ends = (x - LONG * ny, y + LONG * nx), (x + LONG * ny, y - LONG * nx)
    wall = pymunk.Segment(space.static_body, *ends, 1.0)
    wall.friction = wall.elasticity = 1.0
    space.add(wall)
    for rim in machine.rims:
        end = pymunk.Circle(of[rim.body], rim.radius or POINT, rim.place)
        end.friction, end.elasticity = rim.friction, rim.restitution
        end.filter = pymunk.ShapeFilter(group=1)
        space.add(end)
    for box in machine.boxes:
        solid = pymunk.Poly.create_box(of[box.body], (box.width, box.height))
        solid.friction = wall.friction = math.sqrt(box.friction)
        space.add(solid)


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
