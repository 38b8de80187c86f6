"""Where ends of elements and link axes are in a solution, and where reactions act.

Histories are arrays (instants,), of a batch (designs, instants); numbers of a batch are
columns beside them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.model.element import Element, Marker, Numbers
from mbody.model.joints import Joint
from mbody.solution.result import Result

__all__ = [
    "Place",
    "column",
    "ends",
    "link_poses",
    "moved",
    "place",
    "reaction_point",
    "reaction_torque",
    "velocity",
]

Array = np.ndarray

#: A body, and a place on it from its mass centre, in the axes of the link.
Place = tuple[str, float, float]


class _DesignColumns:
    """Numbers by dotted name, a column a design in a batch."""

    def __init__(self, at: Numbers) -> None:
        self.at = at

    def __getitem__(self, name: str) -> Any:
        return column(self.at[name])


def column(value: Any) -> Any:
    """A number, or one a design as a column (designs, 1)."""
    return value[:, None] if np.ndim(value) else value


def place(solution: Result, element: Element, side: str) -> tuple[Array, Array]:
    """History of the world place of an end, ``"i"`` or ``"j"``."""
    body = solution[getattr(element, side).body]
    ax, ay = (column(part) for part in solution.system.numbers.arm(element, side))
    c, s = np.cos(body.angle), np.sin(body.angle)
    return body.x + c * ax - s * ay, body.y + s * ax + c * ay


def moved(run: Any, place: Place) -> Array:
    """World places (instants, 2) of a place on a body."""
    name, x, y = place
    body = run[name]
    c, s = np.cos(body.angle), np.sin(body.angle)
    return np.column_stack([body.x + c * x - s * y, body.y + s * x + c * y])


def velocity(solution: Result, element: Element, side: str) -> tuple[Array, Array]:
    """History of the velocity of an end, ``"i"`` or ``"j"``, in world axes."""
    body = solution[getattr(element, side).body]
    x, y = place(solution, element, side)
    return body.vx - body.omega * (y - body.y), body.vy + body.omega * (x - body.x)


def ends(solution: Result, element: Element) -> tuple[Any, Any, Any, Any]:
    """Numbers, the way from the place on i to that on j, and the directions of both markers."""
    at = solution.system.numbers
    (ix, iy), (jx, jy) = place(solution, element, "i"), place(solution, element, "j")
    angles = (
        solution[getattr(element, side).body].angle + column(at.angle(element, side))
        for side in ("i", "j")
    )
    return _DesignColumns(at), (jx - ix, jy - iy), *angles


def reaction_point(solution: Result, element: Any) -> tuple[Array, Array]:
    """Where the force of an element acts: its place on j, or the point of contact."""
    x, y = place(solution, element, "j")
    offset = _offset(solution, element) if element.role == "joint" else None
    return (x, y) if offset is None else (x + offset[0], y + offset[1])


def link_poses(solution: Result) -> dict[str, tuple[float, float, float]]:
    """(x, y, angle) of the link axes of every body at the last instant."""
    found = {}
    for body in solution.mechanism.bodies:
        origin = solution.point(Marker(body.name, (0.0, 0.0)))
        x, y, angle = (float(p[-1]) for p in (origin.x, origin.y, solution[body.name].angle))
        found[body.name] = (x, y, angle)
    return found


def reaction_torque(solution: Result, joint: Joint, fx: Array, fy: Array, torque: Array) -> Array:
    """Torque of a reaction about its reaction point, from that about the place on j."""
    offset = _offset(solution, joint)
    return torque if offset is None else torque - (offset[0] * fy - offset[1] * fx)


def _offset(solution: Result, joint: Joint) -> Any:
    """From a joint's place on j to its reaction point; None for that place itself."""
    if type(joint).reaction_point is Joint.reaction_point:
        return None
    return joint.reaction_point(*ends(solution, joint))
