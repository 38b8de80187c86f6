"""A spatial model and the plane in which it moves: all hinges across it, all slides in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from mbody.core.tolerances import FILE_AXES_PARALLEL
from mbody.exchange.imported import refusal

Array = np.ndarray


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

    def sign(self, axis: Array) -> float:
        """1 where a hinge turns counter-clockwise about its axis, −1 where clockwise."""
        return 1.0 if axis @ self.normal > 0.0 else -1.0

    def rotation_angle(self, matrix: Array) -> float:
        """The angle of a rotation about the normal."""
        x, y = self.flat(matrix @ self.x)
        return float(np.arctan2(y, x))

    def lies_in(self, axis: Array) -> bool:
        """Whether a direction lies in the plane."""
        return abs(float(axis @ self.normal)) <= FILE_AXES_PARALLEL

    def is_across(self, axis: Array) -> bool:
        """Whether a direction is the normal or its opposite."""
        return float(np.hypot(*self.flat(axis))) <= FILE_AXES_PARALLEL


def plane_of(hinges: list[Any], slides: list[Any], gravity: Array) -> Plane:
    """The plane of a model. `hinges`, `slides`, `gravity` (3,)."""
    if hinges:
        normal = hinges[0]
    else:
        others = [*slides[1:], gravity, np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])]
        normal = next(
            n for n in (np.cross(slides[0], v) for v in others) if n @ n > FILE_AXES_PARALLEL**2
        )
    normal = normal / np.linalg.norm(normal)
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = up - (up @ normal) * normal
    y /= np.linalg.norm(y)
    x = np.cross(y, normal)
    main = 0 if abs(x[0]) > FILE_AXES_PARALLEL else 1
    return Plane(x if x[main] > 0.0 else -x, y)


def check_axes(plane: Plane, name: str, axis: Array, *, hinge: bool) -> None:
    """Refuse a joint that leaves the plane."""
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


class Spatial(Protocol):
    """A compiled spatial model, its plane and names."""

    mujoco: Any
    model: Any
    data: Any
    plane: Plane
    gravity: Array
    names: dict[int, str]
    points: dict[int, dict[str, tuple[float, float]]]
    shapes: dict[int, dict[str, Any]]
    notes: list[str]

    def name(self, kind: str, index: int) -> str:
        """The name of an object in its file, a number where it has none."""

    def label(self, kind: str, index: int) -> str:
        """The same as a name of a point or a part of one."""

    def element(self, kind: str, index: int) -> str:
        """The name of the element that an object is, of no other; a note where it is changed."""

    def unique(self, wanted: str) -> str:
        """A name that no element has yet."""

    def is_off(self, feature: str) -> bool:
        """Whether a flag of the file switches a feature off."""

    def root(self, body: int) -> int:
        """The body that carries a body."""

    def parent(self, body: int) -> str:
        """The name of what the joints of a body are on."""

    def moving(self) -> list[int]:
        """The bodies that move against their carriers."""

    def offset(self, body: int, at: np.ndarray) -> tuple[float, float]:
        """A point of space in the plane axes of a body."""

    def place(self, body: int, label: str, at: np.ndarray) -> str:
        """A named point of a body."""

    def on_joint(self, joint: int) -> list[int]:
        """The actuators of a joint."""

    def on_tendon(self, tendon: int) -> list[int]:
        """The actuators of a tendon."""

    def target_of(self, actuator: int) -> tuple[str, int]:
        """The joint or tendon of an actuator."""

    def constrained_tendons(self) -> list[int]:
        """The tendons whose length is kept."""
