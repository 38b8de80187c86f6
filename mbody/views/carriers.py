"""What carries a shape: a body, a place that holds a direction, or the way between two places.

A shape is kept in the axes of its carrier, so that the motion of the carriers is the motion of the
picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.solution.places import Place, moved

__all__ = ["GROUND_CARRIER", "Carrier", "between", "on", "placed"]

Array = np.ndarray


@dataclass(frozen=True)
class Carrier:
    """Axes that shapes are kept in.

    Attributes
    ----------
    start : Place
        Origin of the axes.
    turn : str
        The body whose angle the axes have; "" where they point from `start` to `end`.
    end : Place or None
        Of what reaches from one place to another.
    stretches : bool
        Whether the shapes become longer with the way, as a spring: a point has then three numbers,
        the part of the way, and how far along and across the way from there.
    lead : float
        Length at both ends that does not stretch.
    """

    start: Place = ("ground", 0.0, 0.0)
    turn: str = "ground"
    end: Place | None = None
    stretches: bool = False
    lead: float = 0.0

    def kept(self, points: Array, run: Any, k: int) -> Array:
        """World points (n, 2) of an instant in these axes: (n, 2), or (n, 3) of what stretches."""
        origin, u, length = (part[k] for part in self.axes(run))
        away = points - origin
        along, across = away @ u, away @ np.array([-u[1], u[0]])
        if not self.stretches:
            return np.column_stack([along, across])
        part = (along - self.lead) / max(float(length) - 2.0 * self.lead, 1e-300)
        part = np.clip(part, 0.0, 1.0)
        return np.column_stack([part, along - part * length, across])

    def shown(self, kept: Array, axes: tuple[Array, Array, Array], k: int) -> Array:
        """World points (n, 2) of an instant, of points in these axes."""
        origin, u, length = (part[k] for part in axes)
        along, across = kept[:, -2], kept[:, -1]
        if self.stretches:
            along = along + kept[:, 0] * length
        return np.asarray(origin + np.outer(along, u) + np.outer(across, (-u[1], u[0])))

    def axes(self, run: Any) -> tuple[Array, Array, Array]:
        """Origin (instants, 2), direction (instants, 2) and length (instants,) of the axes."""
        origin = moved(run, self.start)
        if self.end is None:
            angle = run[self.turn].angle
            return origin, np.column_stack([np.cos(angle), np.sin(angle)]), np.ones(len(run))
        way = moved(run, self.end) - origin
        length = np.hypot(*way.T)
        return origin, way / np.maximum(length, 1e-300)[:, None], length


GROUND_CARRIER = Carrier()


def on(body: str) -> Carrier:
    """The axes of a body."""
    return Carrier((body, 0.0, 0.0), body)


def placed(place: Place, turn: str = "ground") -> Carrier:
    """Axes at a place of one body with the angle of another."""
    return Carrier(place, turn)


def between(start: Place, end: Place, *, stretches: bool = True, lead: float = 0.0) -> Carrier:
    """The way from one place to another."""
    return Carrier(start, "", end, stretches, lead)
