"""Shapes of bodies as tables of a model file."""

from __future__ import annotations

from typing import Any

from mbody.model.body import Body
from mbody.model.touching_shapes import Disc, Line, Ring, Segment
from mbody.quantities.units import DIMENSIONS

__all__ = ["shape_tables"]


def shape_tables(writer: Any, body: Body) -> dict[str, Any]:
    """The shapes of a body by name; `writer` writes numbers."""
    found: dict[str, Any] = {}
    for key, shape in body.shapes.items():
        name = f"{body.name}.{key}"
        if isinstance(shape, Disc | Ring):
            kind, centre = ("disc", shape.disc) if isinstance(shape, Disc) else ("ring", shape.ring)
            radius = writer.number(f"{name}.radius", shape.radius, DIMENSIONS["length"])
            found[key] = {kind: centre, "radius": radius}
            if shape.begin is not None:
                for end, value in (("begin", shape.begin), ("end", shape.end)):
                    found[key][end] = writer.number(f"{name}.{end}", value, DIMENSIONS["angle"])
        elif isinstance(shape, Line):
            angle = writer.number(f"{name}.angle", shape.angle, DIMENSIONS["angle"])
            found[key] = {"line": {"point": shape.point, "angle": angle}}
        elif isinstance(shape, Segment):
            found[key] = {"segment": list(shape.segment)}
        else:
            found[key] = {"polygon": list(shape.polygon)}  # type: ignore[union-attr]  # no vertex
    return found
