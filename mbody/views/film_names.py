"""Names in the frames of a film: each where it covers least of arrows, pins, links, other names."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.views.film_frames import FilmSet
from mbody.views.labels import extent
from mbody.views.shapes import direction
from mbody.views.style import INK, SIZE

__all__ = ["TEXT", "FilmName", "film_names"]

Array = np.ndarray

#: Text beside a picture, in pixels a point of the paper.
TEXT = 1.35
#: Turns of a name about its point, the best first.
TURNS = (0.0, 0.8, -0.8, 1.6, -1.6, 2.4, -2.4, math.pi)
#: Costs: of a point of an arrow or a pin, of one of an outline, of another name as a whole, of
#: another place than in the frame before, of a name that is cut off.
ON_ARROW, ON_EDGE, ON_NAME, JUMP, CUT = 0.45, 0.15, 12.0, 0.5, 3.0
#: Part of a name that others may cover before it is left out, and before it is shown again.
COVERED, CLEAR = 0.25, 0.1
#: Circles that no name should cover.
SIGNS = ("pin:", "cg:")
#: Points on such a circle, in parts of its radius.
AROUND = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
#: Pixels between points on arrows and on outlines.
STEP = 9.0


@dataclass
class FilmName:
    """A name in all frames.

    Attributes
    ----------
    text, color : str
    italic : bool
    size : float
        Of its letters, in parts of those of the paper.
    at : array (frames, 2)
        Its middle in pixels, y up; NaN in frames where there is no room for it.
    """

    text: str
    color: str
    italic: bool
    size: float
    at: Array
    half: Array
    spot: int = -1


@functools.lru_cache(maxsize=1)
def film_names(film: FilmSet) -> list[FilmName]:
    """The names of a film: pins, elements and links first, then forces."""
    size, count = TEXT * min(film.point, 1.15), len(film.stretches[0])

    def named(text: str, color: str, italic: bool) -> FilmName:
        half = 0.5 * np.array(extent(text, round(SIZE["text"] * size, 3), italic)) + (2.0, 1.0)
        return FilmName(text, color, italic, size, np.full((count, 2), np.nan), half)

    labels = film.main.labels if "names" in film.show else []
    names = [named(one.text, one.color or INK, one.italic) for one in labels]
    arrows = [one for one in film.arrows if one.text]
    forces = [named(one.text, one.color, False) for one in arrows]
    for frame in range(count if names or forces else 0):
        shown = list(film.labels(frame))
        crowd = _Crowd(film, frame, [anchor for label, anchor, _ in shown if not label.turns])
        for name, (label, anchor, way) in zip(names, shown, strict=True):
            gap = label.gap * film.scale + 1.5 * film.point
            crowd.put(name, frame, _spots(anchor, way, label.turns, gap, name.half))
        for name, one in zip(forces, arrows, strict=True):
            place, vector = film.pixels(one.place[frame]), one.vector[frame]
            if np.hypot(*vector) > 2.5 and np.isfinite(place + vector).all():
                crowd.put(name, frame, _by_arrow(place, vector, name.half))
    return [*names, *forces]


def _spots(anchor: Array, way: Array, turns: bool, gap: float, half: Array) -> Array:
    """Places (n, 3) of a name: x, y and cost, the best first."""
    found: list[tuple[float, float, float]] = []
    if not way.any():
        moves = ((0.0, 0.0), (0.0, 2.2), (0.0, -2.2), (1.4, 0.0), (-1.4, 0.0))
        return np.array([(*(anchor + half * move), 0.5 * any(move)) for move in moves])
    if turns:
        along = np.array([way[1], -way[0]])
        reach, slide = gap + float(half @ np.abs(way)), 2.0 * float(half @ np.abs(along))
        for side in (1.0, -1.0):
            for part in (0.0, 0.5, -0.5, 1.0, -1.0):
                x, y = anchor + side * reach * way + part * slide * along
                found.append((float(x), float(y), 0.6 * (side < 0.0) + 0.5 * abs(part)))
        return np.array(found)
    first = math.atan2(way[1], way[0])
    for far in (0.0, 13.0):
        for turn in TURNS:
            u = direction(first + turn)
            reach = gap + far + float(np.min(half / np.maximum(np.abs(u), 1e-9)))
            x, y = anchor + reach * u
            found.append((float(x), float(y), 0.6 * (1.0 - math.cos(turn)) + 0.8 * (far > 0.0)))
    return np.array(found)


def _by_arrow(place: Array, vector: Array, half: Array) -> Array:
    """Places of the name of an arrow: at its tip, or beside its shaft."""
    u = vector / np.hypot(*vector)
    across = np.array([-u[1], u[0]])
    reach, aside = float(np.min(half / np.maximum(np.abs(u), 1e-9))), float(half @ np.abs(across))
    found = [(*(place + vector + (far + reach) * u), 0.7 * (far > 4.0)) for far in (4.0, 17.0)]
    for far in (4.0, 15.0):
        for part in (0.9, 0.55):
            for side in (1.0, -1.0):
                spot = place + part * vector + side * (far + aside) * across
                found.append((*spot, (0.6 if far > 4.0 else 0.4) + 0.3 * (1.0 - part)))
    return np.array(found)


class _Crowd:
    """What is in a frame already: arrows and pins, outlines of links, names."""

    def __init__(self, film: FilmSet, frame: int, pins: Sequence[Array]) -> None:
        self.size = np.array([film.width, film.height], dtype=float)
        points = [np.reshape(pins, (-1, 2))]
        for one in film.arrows:
            place, vector = film.pixels(one.place[frame]), one.vector[frame]
            if np.isfinite(place + vector).all():
                points.append(_along(place, place + vector))
        edges = [np.zeros((0, 2))]
        for shape, outline in film.shapes(frame):
            if shape.kind == "circle" and shape.look.name.startswith(SIGNS):
                points.append(outline + shape.radius * film.scale * AROUND)
            if shape.kind == "polygon" and shape.look.name.startswith("link:"):
                ends = np.roll(outline, -1, axis=0)
                edges += [_along(a, b) for a, b in zip(outline, ends, strict=True)]
        self.points, self.edges = np.concatenate(points), np.concatenate(edges)
        self.middles, self.halves = np.zeros((0, 2)), np.zeros((0, 2))

    def put(self, name: FilmName, frame: int, spots: Array) -> None:
        """Put a name at the place of least cost, or leave it out of the frame."""
        at, half = spots[:, :2], name.half
        cost = spots[:, 2] + JUMP * ((np.arange(len(spots)) != name.spot) & (name.spot >= 0))
        cost = cost + CUT * ((at < half) | (at > self.size - half)).any(axis=1)
        cost = cost + ON_ARROW * _inside(self.points, at, half)
        cost = cost + ON_EDGE * _inside(self.edges, at, half)
        low = np.maximum(at[:, None] - half, self.middles - self.halves)
        high = np.minimum(at[:, None] + half, self.middles + self.halves)
        areas = 4.0 * np.minimum(half.prod(), self.halves.prod(axis=1))
        covered = (np.clip(high - low, 0.0, None).prod(axis=2) / areas).sum(axis=1)
        best = int(np.argmin(np.round(cost + ON_NAME * covered, 6)))
        was = frame == 0 or np.isfinite(name.at[frame - 1, 0])
        name.spot = best
        if covered[best] > (COVERED if was else CLEAR):
            return
        name.at[frame] = at[best]
        self.middles = np.vstack([self.middles, at[best]])
        self.halves = np.vstack([self.halves, half])


def _along(a: Array, b: Array) -> Array:
    """Points between two places, about a step apart."""
    count = min(int(np.hypot(*(b - a)) / STEP), 60)
    parts = (np.arange(count) + 0.5) / max(count, 1)
    return np.asarray(a + parts[:, None] * (b - a))


def _inside(points: Array, at: Array, half: Any) -> Array:
    """How many points a name at each of these places covers."""
    away = np.abs(points - at[:, None])
    return np.asarray((away < half).all(axis=2).sum(axis=1))
