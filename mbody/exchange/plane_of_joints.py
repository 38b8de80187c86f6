"""The plane in which a spatial model moves: all hinges across it, all slides in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.exchange.drawn_linkage import refusal

__all__ = ["Plane", "check_axes", "plane_of"]

Array = np.ndarray
#: Sine of the angle by which axes may lean: files have rounded directions.
LEAN = 1e-6


@dataclass(frozen=True)
class Plane:
    """Two axes of unit length, and the normal that they turn about.

    The normal is chosen so that the x axis of the plane is that of the file, or else its y axis.
    """

    x: Array
    y: Array

    @property
    def normal(self) -> Array:
        """The direction about which angles are counter-clockwise."""
        return np.cross(self.x, self.y)

    def flat(self, vector: Array) -> tuple[float, float]:
        """The two components of a vector in the plane."""
        return float(vector @ self.x), float(vector @ self.y)

    def sense(self, axis: Array) -> float:
        """1 where a hinge turns counter-clockwise about its axis, −1 where clockwise."""
        return 1.0 if axis @ self.normal > 0.0 else -1.0

    def turned(self, matrix: Array) -> float:
        """The angle of a rotation about the normal."""
        x, y = self.flat(matrix @ self.x)
        return float(np.arctan2(y, x))

    def lies_in(self, axis: Array) -> bool:
        """Whether a direction lies in the plane."""
        return abs(float(axis @ self.normal)) <= LEAN

    def is_across(self, axis: Array) -> bool:
        """Whether a direction is the normal or its opposite."""
        return float(np.hypot(*self.flat(axis))) <= LEAN


def plane_of(hinges: list[Any], slides: list[Any], gravity: Array) -> Plane:
    """The plane of a model.

    Parameters
    ----------
    hinges, slides : list of (3,) array
        Unit axes of all joints, at the first position.
    gravity : (3,) array
        Chooses the plane of a model that has one slide alone.
    """
    if hinges:
        normal = hinges[0]
    else:
        others = [*slides[1:], gravity, np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])]
        normal = next(n for n in (np.cross(slides[0], v) for v in others) if n @ n > LEAN**2)
    normal = normal / np.linalg.norm(normal)
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = up - (up @ normal) * normal
    y /= np.linalg.norm(y)
    x = np.cross(y, normal)
    main = 0 if abs(x[0]) > LEAN else 1
    return Plane(x if x[main] > 0.0 else -x, y)


def check_axes(plane: Plane, name: str, axis: Array, *, hinge: bool) -> None:
    """Refuse a joint that leaves the plane.

    Raises
    ------
    ModelError
        For a hinge that is not across it, a slide that is not in it.
    """
    fits = plane.is_across(axis) if hinge else plane.lies_in(axis)
    if not fits:
        given = ", ".join(f"{part:.4g}" for part in axis)
        across = ", ".join(f"{part:.4g}" for part in plane.normal)
        what = "is not parallel to" if hinge else "is not across"
        raise refusal(
            name,
            f"its axis ({given}) {what} the hinges' axis ({across}): only mechanisms that move in "
            "one plane are read",
        )
