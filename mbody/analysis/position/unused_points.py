"""Points that a description gives and nothing uses: often the trace of a joint that is missing."""

from __future__ import annotations

from mbody.model.mechanism import Mechanism

__all__ = ["unused_points"]


def unused_points(mechanism: Mechanism) -> list[str]:
    """Names such as "ground.Q" of points that no element and no measure uses, those of the ground
    first.
    """
    elements = (mechanism.joints, mechanism.couplings, mechanism.drivers, mechanism.loads)
    used = {
        f"{marker.body}.{marker.point}"
        for some in elements
        for element in some
        for marker in element.places().values()
        if isinstance(marker.point, str)
    }
    for contact in mechanism.contacts:
        used |= contact.points()
    for measure in mechanism.measures.values():
        used |= {name.rpartition(".")[0] for name in measure.names}
    bodies = [mechanism.ground, *mechanism.bodies]
    names = [f"{body.name}.{point}" for body in bodies for point in body.points]
    return [name for name in names if name not in used]
