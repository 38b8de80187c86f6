"""The profile of a cam for the motion that its follower is to make."""

from __future__ import annotations

import math

import numpy as np

from mbody.errors import ModelError
from mbody.laws import Law, Table

#: Points of the table, both ends included: every quarter of a degree.
POINTS = 1441


def cam_profile(
    lift: Law,
    base_radius: float,
    *,
    roller: float = 0.0,
    offset: float = 0.0,
    arm: float | None = None,
    centre_distance: float | None = None,
) -> Table:
    """The profile of a `CamFollower`, without its `base_radius`, under a roller or a knife edge
    that is not led through the centre of its cam: offset on a guide, or on an arm.

    Parameters
    ----------
    lift : Law
        What the follower is to do, of the angle θ by which the cam has turned counter-clockwise,
        over one turn: the way along the guide [length], or the angle of the arm, away from the cam
        [rad], from 0 on.
    base_radius, roller : float
        Of the base circle, above 0, and of the roller [length].
    offset : float
        Of the guide from the cam's centre [length], to the right of the way of the lift.
    arm, centre_distance : float, optional
        Length of an arm, and the distance of its pivot from the cam's centre [length]; seen from
        the cam the pivot is then on the right of the roller.

    Returns
    -------
    Table
        R(ψ), the pitch curve by how far the cam has turned since its line of 0 pointed at the
        follower; at θ = 0 it does. Give it as the `profile`; `roller` goes to the joint too.

    Raises
    ------
    ModelError
        For lengths between which no follower fits, and a lift at which the follower runs around the
        cam faster than it turns.

    Notes
    -----
    With d from the centre to the roller, d = (offset, S + s) on a guide, S = √((base_radius +
    roller)² − offset²): R = |d|, and ψ = θ − (∠d − ∠d₀). The table is a periodic cubic spline
    through points every quarter of a degree of θ: an error of some 1e-9 of the lift where its
    third derivative does not jump. Source: Norton, *Design of Machinery*, chapter 8.

    Examples
    --------
    >>> from mbody.laws import Harmonic
    >>> lift = Harmonic(mean=0.01, amplitude=-0.01, frequency=1.0, phase=np.pi / 2)
    >>> profile = cam_profile(lift, 0.04, roller=0.01, offset=0.02)
    >>> np.round(profile(np.array([0.0, 2.0 * np.pi])), 9)
    array([0.05, 0.05])
    """
    radius = float(base_radius) + float(roller)
    theta = np.linspace(0.0, math.tau, POINTS)
    s = np.broadcast_to(np.asarray(lift(theta), dtype=float), theta.shape)
    if not (base_radius > 0.0 and roller >= 0.0):
        raise ModelError(
            f"a cam has a base circle above 0 and a roller from 0 on, not {base_radius:g} and "
            f"{roller:g}"
        )
    if (arm is None) != (centre_distance is None):
        raise ModelError("a follower on an arm has an arm and a centre_distance: give both")
    if arm is None or centre_distance is None:
        if not abs(offset) < radius:
            raise ModelError(
                f"a guide at the offset {offset:g} passes the pitch circle of {radius:g}: give a "
                "smaller offset, or a greater base_radius"
            )
        d = offset + 1j * (math.sqrt(radius**2 - offset**2) + s)
    else:
        if not abs(centre_distance - arm) < radius < centre_distance + arm:
            raise ModelError(
                f"an arm of {arm:g} at the distance {centre_distance:g} does not reach a pitch "
                f"circle of {radius:g}: give an arm between {abs(centre_distance - radius):g} and "
                f"{centre_distance + radius:g}"
            )
        # the arm points from the pivot back at the cam, above the line of centres
        cosine = (arm**2 + centre_distance**2 - radius**2) / (2.0 * arm * centre_distance)
        d = centre_distance - arm * np.exp(-1j * (math.acos(cosine) + s))
    turned = np.unwrap(np.angle(d))
    psi = theta - (turned - turned[0])
    if not (np.diff(psi) > 0.0).all():
        n = int(np.diff(psi).argmin())
        raise ModelError(
            f"near {math.degrees(theta[n]):.4g} deg the follower runs around the cam faster than "
            "it turns: give a smaller lift, or a greater base_radius"
        )
    R = np.abs(d)
    if abs(R[-1] - R[0]) > 1e-9 * R.max():
        raise ModelError(
            f"the lift does not close: {s[0]:.6g} at 0 deg, {s[-1]:.6g} at 360 deg: give a law "
            "that repeats after one turn"
        )
    R[-1], psi[-1] = R[0], math.tau
    return Table(psi, R, periodic=True)
