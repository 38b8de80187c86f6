"""Mechanisms of very many short links, as lines: symbols of their own would hide them.

Links whose typical length on the page is a few points are bare lines, all of them one artist;
joints between them have no symbol, unless they are no plain pins, or on the ground.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.joints import Revolute
from mbody.views.shapes import hull, unique
from mbody.views.style import INK, Z

if TYPE_CHECKING:
    from mbody.model.joints import Joint
    from mbody.views.pose import Pose
    from mbody.views.sketch import Sketch

__all__ = ["are_lines", "link_lines", "with_symbols"]

Array = np.ndarray

#: Bodies from which on, and points of a link's typical length up to which, links are lines.
MANY, SHORT = 200, 8.0
#: Width of the lines [points].
WIDTH = 0.8


def are_lines(pose: Pose, bodies: Sequence[str], unit: float) -> bool:
    """Whether the links of these bodies are drawn as lines, where a point is `unit` long."""
    if len(bodies) < MANY:
        return False
    sizes = [
        np.ptp(np.array(pose.nodes[body]), axis=0).max() for body in bodies if pose.nodes[body]
    ]
    sizes = [size for size in sizes if size > 0.0]
    return bool(sizes) and float(np.median(sizes)) < SHORT * unit


def link_lines(sketch: Sketch, bodies: Sequence[str]) -> None:
    """All links: a line between two places, the outline of more; a body of one place to its mass
    centre.
    """
    pose, gap = sketch.pose, np.full((1, 2), np.nan)
    near = 1e-9 * pose.system.length
    parts: list[Array] = []
    for body in bodies:
        nodes = unique(pose.nodes[body], near)
        if len(nodes) < 2:
            nodes = [*nodes, pose.centre(body)]
        corners = np.array(nodes) if len(nodes) < 3 else hull(nodes, near)
        parts += [corners, corners[:1], gap] if len(corners) > 2 else [corners, gap]
    look: dict[str, Any] = {"name": "links", "weight": 0.0}
    sketch.line(np.vstack(parts), WIDTH, INK, Z["link"], **look)


def with_symbols(joints: Sequence[Joint]) -> list[Joint]:
    """The joints that have symbols where links are lines: those on the ground, and others than
    pins.
    """
    return [
        joint
        for joint in joints
        if not isinstance(joint, Revolute) or "ground" in (joint.i.body, joint.j.body)
    ]
