"""What drivers drive, by the motion of the bodies, in any kind of numbers: traced, or dual."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
from mbody.solution.places import place
from mbody.solution.tracing import Untraceable

__all__ = ["driven_motion"]


def driven_motion(result: Any, driver: Any) -> tuple[Any, Any, Any]:
    """Value, rate and acceleration of the coordinate of a driver: an angle, a distance, or a
    displacement along an axis of body i.

    Raises
    ------
    Untraceable
        For a driver of another kind.
    """
    if isinstance(driver, AngleDriver):
        i, j = result[driver.relative_to], result[driver.body]
        return j.angle - i.angle, j.omega - i.omega, j.alpha - i.alpha
    if not isinstance(driver, DistanceDriver | CoordinateDriver):
        raise Untraceable(f"the motion of a {type(driver).__name__}")
    (x, y), (vx, vy), (ax, ay) = _apart(result, driver)
    if isinstance(driver, DistanceDriver):
        length = np.hypot(x, y)
        rate = (x * vx + y * vy) / length
        return length, rate, (vx * vx + vy * vy + x * ax + y * ay - rate * rate) / length
    body = result[driver.i.body]
    angle = body.angle + result.system.numbers.angle(driver, "i")
    c, s, w = np.cos(angle), np.sin(angle), body.omega
    along, across = c * x + s * y, c * y - s * x
    rate = c * vx + s * vy + w * across
    turning = body.alpha * across - w * w * along + 2.0 * w * (c * vy - s * vx)
    return along, rate, c * ax + s * ay + turning


def _apart(result: Any, element: Any) -> list[tuple[Any, Any]]:
    """The way from the place on i to that on j, with both derivatives, world axes."""
    (ix, iy), (jx, jy) = (_motion(result, element, side) for side in "ij")
    return [(b - a, d - c) for a, b, c, d in zip(ix, jx, iy, jy, strict=True)]


def _motion(result: Any, element: Any, side: str) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """x and y of a place, each with both derivatives."""
    body = result[getattr(element, side).body]
    x, y = place(result, element, side)
    px, py, w, alpha = x - body.x, y - body.y, body.omega, body.alpha
    return (
        (x, body.vx - w * py, body.ax - alpha * py - w * w * px),
        (y, body.vy + w * px, body.ay + alpha * px - w * w * py),
    )
