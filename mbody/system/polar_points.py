"""Points that the user gave by distance and angle."""

from __future__ import annotations

from mbody.model.element import Polar, place_name
from mbody.model.mechanism import Mechanism

__all__ = ["polar_points"]


def polar_points(mechanism: Mechanism) -> frozenset[str]:
    """Dotted names of all points that the user gave by distance and angle."""
    bodies = (*mechanism.bodies, mechanism.ground)
    points: list[tuple[str, object]] = []
    points += [(f"{body.name}.{key}", p) for body in bodies for key, p in body.points.items()]
    points += [(f"{body.name}.cg", body.cg) for body in bodies]
    for element in mechanism:
        inline = {k: m.point for k, m in element.places().items() if not isinstance(m.point, str)}
        points += [(place_name(f"{element.name}.{k}", p), p) for k, p in inline.items()]
    return frozenset(name for name, point in points if isinstance(point, Polar))
