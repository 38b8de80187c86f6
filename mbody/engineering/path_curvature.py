"""Curvature of the paths of points, the inflection circle, and the pole of accelerations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.core.tolerances import CURVATURE_NONE, RATE_NONE_COORDINATE
from mbody.engineering.motion_polygons import check_moving, relative_motion, relative_path
from mbody.model.element import Marker
from mbody.solution.doubts import Inherited, inherited
from mbody.solution.solution import Solution, as_solution

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class PathCurvature(Inherited):
    """Curvature of a path and its centre: arrays (instants,).

    Attributes
    ----------
    curvature : array
        Signed, positive where the path turns to its left [1/length]; NaN at a cusp, where the point
        stands still.
    radius : array
        1/|curvature|, infinite where the path is straight.
    centre_x, centre_y : arrays
        In the axes of the body on which the path is seen, from the origin of the ground or from the
        mass centre of that body; NaN where the path is straight.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> mbody.engineering.path_curvature(run, "crank.A").curvature
    array([1.])
    """

    curvature: Array
    radius: Array
    centre_x: Array
    centre_y: Array


def path_curvature(
    run: Solution, place: Marker | str, relative_to: str = "ground"
) -> PathCurvature:
    """Curvature of the path that a point describes on a body.

    Parameters
    ----------
    run : Solution
        Of one design, with accelerations.
    place : Marker or str
        The point, such as ``"coupler.P"``.
    relative_to : str
        The body on which its path is seen.

    Returns
    -------
    PathCurvature
        κ = (v × a)/|v|³.

    Raises
    ------
    ModelError
        For a batch, an analysis without accelerations, a body or a point that does not exist.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.0, 0.5])
    >>> path_curvature(run, "crank.A").radius
    array([1., 1.])
    """
    run = as_solution(run)
    check_moving(run, "the curvature of a path is")
    position, v, a = relative_path(run, run.point(place), relative_to)
    speed = np.abs(v)
    speed = np.where(speed > RATE_NONE_COORDINATE * speed.max(initial=0.0), speed, np.nan)
    curvature = (np.conj(v) * a).imag / speed**3
    bent = np.where(np.abs(curvature) * run.system.length > CURVATURE_NONE, curvature, np.nan)
    # numbers that are none stand for cusps and straight paths
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = position + 1j * v / speed / bent
        radius = 1.0 / np.abs(curvature)
    return PathCurvature(curvature, radius, centre.real, centre.imag, **inherited(run))


@dataclass(frozen=True, eq=False)
class InflectionCircle(Inherited):
    """The circle of the points whose paths have a point of inflection: arrays (instants,).

    All places are in the axes of the body that is taken as fixed, from the origin of the ground or
    from that body's mass centre; NaN where both bodies do not turn against each other.

    Attributes
    ----------
    pole_x, pole_y : arrays
        The instant centre, on the circle.
    x, y : arrays
        The inflection pole, opposite to the instant centre on the circle.
    diameter : array
    acceleration_pole_x, acceleration_pole_y : arrays
        The point without acceleration.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> found = mbody.engineering.inflection_circle(run, "coupler")
    >>> across = np.hypot(found.x - found.pole_x, found.y - found.pole_y)
    >>> bool(abs(across - found.diameter)[0] < 1e-9)
    True
    """

    pole_x: Array
    pole_y: Array
    x: Array
    y: Array
    diameter: Array
    acceleration_pole_x: Array
    acceleration_pole_y: Array


def inflection_circle(run: Solution, body: str, relative_to: str = "ground") -> InflectionCircle:
    """The inflection circle of a body's motion.

    Its diameter runs from the instant centre P to P + a_P/ω², a_P the acceleration of the body's
    point at P.

    Parameters
    ----------
    run : Solution
        Of one design, with accelerations.
    body : str
        The moving body.
    relative_to : str
        The body that is taken as fixed.

    Returns
    -------
    InflectionCircle

    Raises
    ------
    ModelError
        For a batch, an analysis without accelerations, or a body that does not exist.

    Notes
    -----
    Source: Uicker, Pennock, Shigley: *Theory of Machines and Mechanisms*, 4.13 (inflection circle,
    Euler–Savary); Bottema, Roth: *Theoretical Kinematics* (1979), VIII.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), [0.3])
    >>> found = inflection_circle(run, "coupler")
    >>> bool(found.diameter[0] > 0)
    True
    """
    run = as_solution(run)
    check_moving(run, "an inflection circle is")
    m = relative_motion(run, body, relative_to)
    rotation, pole = 1j * m.alpha - m.omega**2, m.instant_centre(RATE_NONE_COORDINATE)
    omega = np.where(np.isnan(pole.real), np.nan, m.omega)
    # numbers that are none stand for bodies that do not turn
    with np.errstate(divide="ignore", invalid="ignore"):
        opposite = pole + (m.acceleration + rotation * (pole - m.place)) / omega**2
        still = m.place - m.acceleration / np.where(rotation != 0.0, rotation, np.nan)
    return InflectionCircle(
        pole.real,
        pole.imag,
        opposite.real,
        opposite.imag,
        np.abs(opposite - pole),
        still.real,
        still.imag,
        **inherited(run),
    )
