"""Motion of a place on a body."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import Marker, as_marker, listed
from mbody.solution.histories import PointHistory
from mbody.solution.places import column
from mbody.solution.result import Result

__all__ = ["point_history"]


def point_history(solution: Result, place: Marker | str) -> PointHistory:
    """The history of a place on a body; see `Solution.point`.

    Raises
    ------
    ModelError
        For a body or a point that there is not.
    """
    marker = as_marker(place, "point", "place")
    body = solution[marker.body]
    x, y = _local(solution, marker)
    c, s = np.cos(body.angle), np.sin(body.angle)
    px, py = c * x - s * y, s * x + c * y
    w, alpha = body.omega, body.alpha
    return PointHistory(
        str(marker),
        body.x + px,
        body.y + py,
        body.vx - w * py,
        body.vy + w * px,
        body.ax - alpha * py - w * w * px,
        body.ay + alpha * px - w * w * py,
    )


def _local(solution: Result, marker: Marker) -> tuple[Any, Any]:
    """Place of a marker from the mass centre in link axes, a column a design in a batch."""
    system = solution.system
    at = system.numbers
    if isinstance(marker.point, str):
        name = f"{marker.body}.{marker.point}"
        if f"{name}.x" not in system.values and f"{name}.r" not in system.values:
            element: Any = solution.mechanism[marker.body]
            raise ModelError(
                f"body '{marker.body}' has no point '{marker.point}' (it has: "
                f"{listed(element.points)})",
                marker.body,
            )
        x, y = at.point(name)
    elif isinstance(marker.point, tuple):
        x, y = marker.point
    else:
        x, y = (
            marker.point.r * np.cos(marker.point.angle),
            marker.point.r * np.sin(marker.point.angle),
        )
    cx, cy = at.point(f"{marker.body}.cg")
    return column(x - cx), column(y - cy)
