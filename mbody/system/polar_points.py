"""Points that the user gave by distance and angle."""

from __future__ import annotations

from mbody.model.element import Polar, place_name
from mbody.model.mechanism import Mechanism

__all__ = ["polar_points"]


def polar_points(mechanism: Mechanism) -> frozenset[str]:
    """Dotted names of all points that the user gave by distance and angle."""
    found: set[str] = set()
    for body in (*mechanism.bodies, mechanism.ground):
        found.update(f"{body.name}.{key}" for key, p in body.points.items() if isinstance(p, Polar))
        if isinstance(body.cg, Polar):
            found.add(f"{body.name}.cg")
    for element in mechanism:
        for key, marker in element.places().items():
            if isinstance(marker.point, Polar):
                found.add(place_name(f"{element.name}.{key}", marker.point))
    return frozenset(found)
