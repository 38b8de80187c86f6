"""Outlines as arrays (points, 2): pure geometry, in any unit of length."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbody.core.tolerances import DRAWN_OUTLINE, TINY

Array = np.ndarray


def direction(angle: float) -> Array:
    """The unit vector at an angle [rad] from x."""
    return np.array([math.cos(angle), math.sin(angle)])


def unique(points: Sequence[Any], tolerance: float) -> list[Array]:
    """The points, without those nearer than `tolerance` to one before.

    >>> len(unique([(0, 0), (1, 0), (0, 1e-9)], 1e-6))
    2
    """
    found: list[Array] = []
    for point in map(np.asarray, points):
        if all(np.hypot(*(point - other)) > tolerance for other in found):
            found.append(point)
    return found


def hull(points: Sequence[Any], flat: float = 0.0) -> Array:
    """Corners of the convex hull, counter-clockwise; corners that protrude less than `flat` are
    left out.

    >>> hull([(0, 0), (2, 0), (1, 1e-9), (1, 1), (1, 0.5)], 1e-6).tolist()
    [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]]
    """
    ordered = sorted({(float(x), float(y)) for x, y in points})
    if len(ordered) < 3:
        return np.array(ordered)

    def side(half: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        chain: list[tuple[float, float]] = []
        for c in half:
            while len(chain) > 1:
                a, b = chain[-2], chain[-1]
                across = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
                if across > flat * math.hypot(c[0] - a[0], c[1] - a[1]):
                    break
                chain.pop()
            chain.append(c)
        return chain[:-1]

    return np.array(side(ordered) + side(ordered[::-1]))


def within(point: Any, corners: Array) -> bool:
    """Whether a point lies inside a convex outline, counter-clockwise.

    >>> square = np.array([(0, 0), (2, 0), (2, 2), (0, 2)])
    >>> within((1, 1), square), within((3, 1), square), within((1, 0), square[:2])
    (True, False, False)
    """
    edges, offsets = np.roll(corners, -1, axis=0) - corners, np.asarray(point) - corners
    left = edges[:, 0] * offsets[:, 1] - edges[:, 1] * offsets[:, 0]
    return len(corners) > 2 and bool(np.all(left > 0.0))


def rounded(points: Sequence[Any], radius: float) -> Array:
    """Outline of all that lies within `radius` of the convex hull of the points: a disc about one
    point, a bar with round ends about two, a plate with round corners about more.

    >>> outline = rounded([(0, 0), (3, 0)], 1.0)
    >>> round(float(outline[:, 0].max()), 1), round(float(outline[:, 1].min()), 1)
    (4.0, -1.0)
    """
    corners = hull(points, DRAWN_OUTLINE * radius)
    if len(corners) == 1:
        return arc(corners[0], radius, 0.0, 2.0 * math.pi)
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.arctan2(-edges[:, 0], edges[:, 1])  # of each edge, outward
    parts = []
    for n, corner in enumerate(corners):
        start, end = normals[n - 1], normals[n]
        sweep = (end - start) % (2.0 * math.pi)
        parts.append(arc(corner, radius, start, start + sweep))
    return np.concatenate(parts)


def arc(centre: Any, radius: float, start: float, end: float) -> Array:
    """Points on an arc from the angle `start` to `end` [rad], every nine degrees at least."""
    count = 2 + int(abs(end - start) / math.radians(9.0))
    angles = np.linspace(start, end, count)
    return np.asarray(centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def box(centre: Any, along: float, across: float, angle: float) -> Array:
    """Corners of a rectangle of half sides `along` and `across`, turned by `angle` [rad]."""
    u, n = direction(angle), direction(angle + math.pi / 2.0)
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return np.array([np.asarray(centre) + a * along * u + b * across * n for a, b in corners])


def hatching(start: Any, end: Any, depth: float, gap: float) -> list[Array]:
    """Slanted strokes on the right of the line from `start` to `end`.

    >>> strokes = hatching((0, 0), (4, 0), 0.5, 1.0)
    >>> len(strokes), bool(max(stroke[1, 1] for stroke in strokes) < 0)
    (4, True)
    """
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = math.hypot(*(end - start))
    u = (end - start) / max(length, TINY)
    slant = depth * (np.array([u[1], -u[0]]) - u)
    count = max(1, round(length / gap))
    places = (np.arange(count) + 0.8) / count
    return [
        np.array([start + p * (end - start), start + p * (end - start) + slant]) for p in places
    ]


def zigzag(start: Any, end: Any, width: float, lead: float, coils: int = 7) -> Array:
    """A spring between two points, straight for `lead` at both ends, `width` to each side."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = math.hypot(*(end - start))
    if length == 0.0:
        return np.array([start, end])
    u = (end - start) / length
    n = np.array([-u[1], u[0]])
    lead = min(lead, 0.3 * length)
    places = lead + (length - 2.0 * lead) * (np.arange(2 * coils) + 0.5) / (2 * coils)
    sides = np.where(np.arange(2 * coils) % 2, -width, width)
    teeth = start + places[:, None] * u + sides[:, None] * n
    return np.vstack([start, start + lead * u, teeth, end - lead * u, end])


def spiral(
    centre: Any, inner: float, outer: float, start: float, revolutions: float = 2.25
) -> Array:
    """A torsion spring: a spiral from the inner radius to the outer one."""
    part = np.linspace(0.0, 1.0, 60)
    angles = start + 2.0 * math.pi * revolutions * part
    radius = inner + (outer - inner) * part
    return np.asarray(centre) + (radius * np.array([np.cos(angles), np.sin(angles)])).T
