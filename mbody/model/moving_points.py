"""Which points of a mechanism results show: those that move."""

from __future__ import annotations

from mbody.model.joints import Revolute
from mbody.model.mechanism import Mechanism

__all__ = ["moving_points"]


def moving_points(mechanism: Mechanism) -> list[str]:
    """Points of links that are not pinned to the ground, such as "coupler.P"; of a pin that on the
    first of its links.

    >>> import mbody
    >>> moving_points(mbody.makers.four_bar(1, 3, 2, 3.5))
    ['crank.A', 'coupler.B']
    """
    order = {name: n for n, name in enumerate(["ground", *(b.name for b in mechanism.bodies)])}
    again: set[str] = set()
    for joint in mechanism.joints:
        if isinstance(joint, Revolute):
            sides = sorted((joint.i, joint.j), key=lambda marker: order[marker.body])
            names = [f"{marker.body}.{marker.point}" for marker in sides]
            again |= set(names if sides[0].body == "ground" else names[1:])
    names = [f"{body.name}.{point}" for body in mechanism.bodies for point in body.points]
    return [name for name in names if name not in again]
