"""Circles of wheels and pulleys at one instant, and the rectangle that a mechanism takes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.model.joints import CamFollower, Gear, Joint, RackPinion, Rolling
from mbody.model.loads import PistonPressure, ReciprocatingCylinder, Tyre
from mbody.views.body_shapes import outlines
from mbody.views.cam_outlines import outline
from mbody.views.cylinders import barrel
from mbody.views.tyres import tyre_circle

if TYPE_CHECKING:
    from mbody.model.coupling import Coupling
    from mbody.views.pose import Pose

__all__ = ["bounds", "pulleys", "wheels"]

Array = np.ndarray


def wheels(joint: Joint, pose: Pose) -> list[tuple[str, float]]:
    """The circles of a joint: pitch circles, rollers, the circle around a cam.

    Each is the field of the centre's marker, and the radius.
    """
    if isinstance(joint, CamFollower):
        way = outline(joint, pose) - pose.place(joint, "i")
        return [("i", float(np.hypot(*way.T).max())), ("j", pose.number(joint, "roller"))]
    if isinstance(joint, Gear):
        return [(side, pose.number(joint, f"radius_{side}")) for side in "ij"]
    if isinstance(joint, RackPinion):
        return [("j", pose.number(joint, "radius"))]
    if isinstance(joint, Rolling):
        found = [("j", pose.number(joint, "radius"))]
        if joint.on_radius is not None:
            found.append(("i", pose.number(joint, "on_radius")))
        return found
    return []


def pulleys(coupling: Coupling, pose: Pose) -> dict[int, tuple[Array, float]]:
    """Centres and radii of the bodies that a coupling turns, by the number of the term.

    Among lengths the factor of an angle is a radius; otherwise the radius is 0.
    """
    found = {}
    for n, term in enumerate(coupling.parts):
        if not term.ends:
            radius = abs(pose.number(coupling, f"{n}.factor")) if coupling.lengths else 0.0
            found[n] = (pose.pivot(*term.bodies), radius)
    return found


def bounds(pose: Pose) -> Array:
    """The corners (2, 2) of the rectangle around a mechanism with its wheels and cylinders."""
    places = [node for nodes in pose.nodes.values() for node in nodes]
    places += [pose.centre(body.name) for body in pose.mechanism.bodies]
    circles = [
        (pose.place(joint, field), radius)
        for joint in pose.joints
        for field, radius in wheels(joint, pose)
    ]
    corners, solid = outlines(pose)
    places, circles = places + corners, circles + solid
    for coupling in pose.mechanism.couplings:
        circles += pulleys(coupling, pose).values()
    circles += [tyre_circle(load, pose) for load in pose.mechanism.loads if isinstance(load, Tyre)]
    for centre, radius in circles:
        places += [centre - radius, centre + radius]
    for load in pose.mechanism.loads:
        if isinstance(load, (PistonPressure, ReciprocatingCylinder)):
            own = barrel(load, pose, 0.0)
            places += [own.head, own.mouth]
    if not places:
        places = [np.zeros(2)]
    return np.array([np.min(places, axis=0), np.max(places, axis=0)])
