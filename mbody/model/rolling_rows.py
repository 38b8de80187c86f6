"""Rows of round contacts that roll without slip, counted from where they begin to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.model.primitives import ConstraintPrimitive

if TYPE_CHECKING:
    from mbody.model.element import Numbers

__all__ = ["rolling_from"]

#: A position of link axes: x, y [length] and angle [rad].
Pose = tuple[float, float, float]


def rolling_from(
    row: ConstraintPrimitive, at: Numbers, poses: Mapping[str, Pose]
) -> ConstraintPrimitive:
    """The row along a contact, always on, zero where both bodies have these positions.

    On a line u·d + r (θ_j − θ_i) keeps the value that it has there, on a circle the angle between
    n(ψ) and the line of centres.

    Parameters
    ----------
    row : ConstraintPrimitive
        That of a circle on a line or on a circle, as `contact_spots` makes it.
    at : Numbers
        The numbers of the mechanism: the value is that of each design.
    poses : mapping
        Of both bodies by name.
    """
    parameters = list(row.parameters)
    (ix, iy), (jx, jy) = _place(row, 0, at, poses), _place(row, 1, at, poses)
    turned_i, turned_j = poses[row.i][2], poses[row.j][2]
    dx, dy = jx - ix, jy - iy
    if row.kind == "rack":
        ux, uy, radius = parameters[4:]
        c, s = np.cos(turned_i), np.sin(turned_i)
        along = (c * ux - s * uy) * dx + (s * ux + c * uy) * dy + radius * (turned_j - turned_i)
        parameters[0], parameters[1] = parameters[0] + along * ux, parameters[1] + along * uy
    else:
        i, j = parameters[4], parameters[5]
        parameters[6] = np.arctan2(dy, dx) - i * turned_i - j * turned_j
    return replace(row, parameters=parameters, switched=False)


def _place(
    row: ConstraintPrimitive, side: int, at: Numbers, poses: Mapping[str, Pose]
) -> tuple[Any, Any]:
    """Where the arm of the row on one of its bodies ends, in axes of the ground."""
    body = (row.i, row.j)[side]
    x, y, angle = poses[body]
    (cx, cy), c, s = at.point(f"{body}.cg"), np.cos(angle), np.sin(angle)
    ax, ay = cx + row.parameters[2 * side], cy + row.parameters[2 * side + 1]
    return x + c * ax - s * ay, y + s * ax + c * ay
