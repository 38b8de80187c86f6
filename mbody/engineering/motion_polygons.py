"""Velocity and acceleration polygons: the images of points and links from one pole."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.engineering.relative_motion import check_moving
from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution, as_solution
from mbody.system.read_only import lock

__all__ = ["MotionPolygon", "acceleration_polygon", "velocity_polygon"]

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class MotionPolygon(Inherited):
    """The polygon of velocities or accelerations of named points.

    The image of a point is the end of its velocity (acceleration) drawn from the pole, which is
    the image of the ground. The line between two images is the relative velocity. The image of a
    link is similar to the link: turned by 90° and ω times as large in the velocity polygon,
    √(ω⁴ + α²) times as large in that of accelerations.

    Attributes
    ----------
    quantity : str
        "velocity" or "acceleration".
    x, y : dict of str to array (instants,)
        Images of the points by their dotted names, from the pole.
    links : dict of str to tuple of str
        Of every body the points on it: the corners of its image.
    """

    quantity: str = "velocity"
    x: dict[str, Array] = field(default_factory=dict)
    y: dict[str, Array] = field(default_factory=dict)
    links: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lock(self)

    def between(self, first: str, second: str) -> tuple[Array, Array]:
        """The side from the image of one point to that of another: the relative velocity or
        acceleration of the second, x and y.

        Raises
        ------
        ModelError
            For a point that is not in the polygon.
        """
        for name in (first, second):
            if name not in self.x:
                raise ModelError(f"{name!r} is not in the polygon, which has {listed(self.x, 30)}")
        return self.x[second] - self.x[first], self.y[second] - self.y[first]

    def data(self) -> dict[str, Any]:
        """As lists, for JSON."""
        points = {name: {"x": x.tolist(), "y": self.y[name].tolist()} for name, x in self.x.items()}
        links = {name: list(points) for name, points in self.links.items()}
        return {"quantity": self.quantity, "points": points, "links": links}


def velocity_polygon(run: Solution, points: Sequence[str] | None = None) -> MotionPolygon:
    """The velocity polygon.

    Parameters
    ----------
    run : Solution
        Of one design, with velocities.
    points : sequence of str, optional
        Dotted names of points, such as ``"coupler.P"``; by default those at which joints are.

    Returns
    -------
    MotionPolygon
        In lengths by time, arrays (instants,).

    Raises
    ------
    ModelError
        For a batch, an analysis without velocities, or a point that does not exist.

    Notes
    -----
    Source: Uicker, Pennock, Shigley: *Theory of Machines and Mechanisms*, 3.4 and 4.4.

    Examples
    --------
    >>> import mbody
    >>> made = mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0)
    >>> found = velocity_polygon(mbody.kinematics(made, [0.0]))
    >>> x, y = found.between("crank.O2", "crank.A")
    >>> round(float(np.hypot(x, y)[0]), 12)
    2.0
    """
    return _polygon(run, points, "velocity")


def acceleration_polygon(run: Solution, points: Sequence[str] | None = None) -> MotionPolygon:
    """The acceleration polygon; arguments and errors as of `velocity_polygon`.

    Parameters
    ----------
    run : Solution
    points : sequence of str, optional

    Returns
    -------
    MotionPolygon
        In lengths by time squared.

    Raises
    ------
    ModelError

    Examples
    --------
    >>> import mbody
    >>> made = mbody.makers.four_bar(1, 3, 2, 3.5, speed=2.0)
    >>> found = acceleration_polygon(mbody.kinematics(made, [0.0]))
    >>> x, y = found.between("crank.O2", "crank.A")
    >>> round(float(np.hypot(x, y)[0]), 12)
    4.0
    """
    return _polygon(run, points, "acceleration")


def _polygon(run: Solution, points: Sequence[str] | None, quantity: str) -> MotionPolygon:
    run = as_solution(run)
    check_moving(run, f"a {quantity} polygon is")
    names = list(dict.fromkeys(points if points is not None else _joined(run)))
    letter = "v" if quantity == "velocity" else "a"
    histories = {name: run.point(name) for name in names}
    x = {name: getattr(one, f"{letter}x") for name, one in histories.items()}
    y = {name: getattr(one, f"{letter}y") for name, one in histories.items()}
    bodies = dict.fromkeys(name.partition(".")[0] for name in names)
    links = {
        body: tuple(name for name in names if name.partition(".")[0] == body) for body in bodies
    }
    return MotionPolygon(quantity, x, y, links, **inherited(run))


def _joined(run: Solution) -> list[str]:
    """Dotted names of the points at which joints are."""
    markers = itertools.chain.from_iterable(
        joint.places().values() for joint in run.mechanism.joints
    )
    return [f"{one.body}.{one.point}" for one in markers if isinstance(one.point, str)]
