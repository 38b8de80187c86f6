"""Outlines of cams: the curve that touches a roller, an edge or a flat face."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mbody.engineering.cam_contour import cam_contour

if TYPE_CHECKING:
    from mbody.model.joints import CamFollower
    from mbody.views.pose import Pose

__all__ = ["base_circle", "face", "outline"]

Array = np.ndarray

#: Places of a turn at which an outline has a corner: every two degrees.
CORNERS = 181


def _radius(joint: CamFollower, pose: Pose) -> tuple[Array, Array, Array]:
    """ψ over a turn, with the radius of the pitch curve, or the support function, and its slope."""
    psi = np.linspace(0.0, math.tau, CORNERS)
    R, slope, _ = np.broadcast_arrays(*joint.radius(pose.system.numbers, psi))
    return psi, R, slope


def outline(joint: CamFollower, pose: Pose) -> Array:
    """Points (corners, 2) of the cam at this instant."""
    psi = np.linspace(0.0, math.tau, CORNERS)
    numbers, turned = pose.system.numbers, pose.angle(joint.i.body)
    x, y = (cam_contour(joint, numbers, psi) - numbers.place(joint, "i")).T
    c, s = math.cos(turned), math.sin(turned)
    return pose.place(joint, "i") + np.column_stack([c * x - s * y, s * x + c * y])


def base_circle(joint: CamFollower, pose: Pose) -> float:
    """The radius of the base circle: as given, else the least radius of the profile."""
    if joint.base_radius is not None:
        return pose.number(joint, "base_radius")
    return float(_radius(joint, pose)[1].min()) - pose.number(joint, "roller")


def face(joint: CamFollower, pose: Pose, more: float) -> Array:
    """The ends (2, 2) of a flat face: the range of the contact, with the marker's place."""
    centre, angle = pose.place(joint, "i"), pose.direction(joint, "j")
    u = np.array([math.cos(angle), math.sin(angle)])
    n = np.array([-u[1], u[0]])
    way = pose.place(joint, "j") - centre
    offset = float(np.abs(_radius(joint, pose)[2]).max())
    along = np.array([way @ u, (pose.reaction_point(joint) - centre) @ u, offset, -offset])
    foot = centre + (way @ n) * n
    return np.array([foot + (along.min() - more) * u, foot + (along.max() + more) * u])
