"""The contour of a cam: the curve that touches a roller, an edge or a flat face."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from mbody.model.element import Numbers
    from mbody.model.joints import CamFollower

__all__ = ["cam_contour", "cam_curvature"]


def cam_contour(
    joint: CamFollower, numbers: Numbers, psi: np.ndarray, *, pitch: bool = False
) -> np.ndarray:
    """Points of the contour in the axes of the cam's body.

    Parameters
    ----------
    joint : CamFollower
    numbers : Numbers
        Of its system, of one design.
    psi : (n,) array
        How far the cam has turned where each point touches the follower [rad].
    pitch : bool
        Whether to give the pitch curve in place of the contour: where the centre of the roller or
        the knife edge is, under a flat face the foot of the normal through the cam's centre.

    Returns
    -------
    (n, 2) array
        [length]

    Notes
    -----
    The pitch curve of a roller is R e(χ) from the cam's centre, at χ = β ∓ ψ with β the direction
    of ψ = 0; the contour is inside it by the radius of the roller, along the normal. Under a flat
    face it is the envelope of the lines of the face, h e(χ) ∓ h′ e(χ + π/2).

    Examples
    --------
    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("cam_follower"))
    >>> cam = system.mechanism["contact"]
    >>> cam_contour(cam, system.numbers, np.linspace(0.0, 2.0 * np.pi, 5)).shape
    (5, 2)
    """
    R, slope, _ = np.broadcast_arrays(*joint.radius(numbers, psi))
    sense = -1.0 if joint.clockwise else 1.0
    ray = float(numbers.angle(joint, "i")) - sense * psi
    if pitch:
        along, across = R, np.zeros_like(R)
    elif joint.flat:
        along, across = R, -sense * slope
    else:
        roller, lean = float(numbers[f"{joint.name}.roller"]), np.arctan2(sense * slope, R)
        along, across = R - roller * np.cos(lean), -roller * np.sin(lean)
    c, s = np.cos(ray), np.sin(ray)
    from_centre = np.column_stack([along * c - across * s, along * s + across * c])
    return np.asarray(numbers.place(joint, "i"), dtype=float) + from_centre


def cam_curvature(
    joint: CamFollower, numbers: Numbers, psi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Radii of curvature (n,) of the pitch curve and of the contour [length], negative where they
    are hollow and infinite where they are straight; both those of the contour under a flat face.

    Examples
    --------
    >>> import mbody
    >>> system = mbody.assemble(mbody.gallery.load("cam_follower"))
    >>> cam_curvature(system.mechanism["contact"], system.numbers, np.zeros(1))
    (array([50.]), array([40.]))
    """
    R, R1, R2 = np.broadcast_arrays(*joint.radius(numbers, psi))
    if joint.flat:
        return R + R2, R + R2
    bend, speed = R * R + 2.0 * R1 * R1 - R * R2, (R * R + R1 * R1) ** 1.5
    pitch = np.divide(speed, bend, out=np.full(R.shape, np.inf), where=bend != 0.0)
    return pitch, pitch - float(numbers[f"{joint.name}.roller"])
