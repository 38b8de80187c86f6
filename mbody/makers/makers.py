"""Makers of common bodies and mechanisms: plain functions that describe what a user could write."""

from __future__ import annotations

import math
from typing import Any

from mbody.errors import ModelError
from mbody.laws import ConstantSpeed
from mbody.model.body import Body
from mbody.model.driver import AngleDriver
from mbody.model.element import Point
from mbody.model.joints import Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.quantities.number import one_number as number

__all__ = ["bar", "four_bar", "slider_crank"]


def bar(
    name: str,
    length: float,
    *,
    mass: float = 0.0,
    ends: tuple[str, str] = ("A", "B"),
    points: dict[str, Point] | None = None,
    guess: Any = None,
) -> Body:
    """A uniform slender bar along its x axis, from end A at the origin to end B.

    Parameters
    ----------
    name : str
        Name of the body.
    length, mass : float
        [length], [mass]; the inertia is m l²/12.
    ends : pair of str
        Names of the two end points.
    points : dict, optional
        More named points in link axes.
    guess : optional
        As of `Body`.

    Examples
    --------
    >>> bar("rod", 2.0, mass=3.0).inertia
    1.0
    """
    _check(name, length=length)
    named: dict[str, Point] = {ends[0]: (0.0, 0.0), ends[1]: (length, 0.0), **(points or {})}
    return Body(
        name,
        mass=mass,
        inertia=mass * length**2 / 12.0,
        cg=(0.5 * length, 0.0),
        points=named,
        guess=guess,
    )


def _check(name: str, **lengths: Any) -> None:
    """Refuse lengths that are no positive numbers."""
    for field, value in lengths.items():
        if number(value, "length", name, field) <= 0.0:
            raise ModelError(f"'{name}': {field} is {value:g}, it must be positive", name)


def _check_masses(name: str, masses: Any) -> None:
    if not isinstance(masses, (tuple, list)) or len(masses) != 3:
        raise ModelError(f"'{name}': masses must be three numbers, not {masses!r}", name)


def four_bar(
    crank: float,
    coupler: float,
    rocker: float,
    ground: float,
    *,
    masses: tuple[float, float, float] = (0.0, 0.0, 0.0),
    start: float = math.pi / 3.0,
    speed: float = 0.0,
    crossed: bool = False,
    units: str = "SI",
) -> Mechanism:
    """A four-bar of uniform bars, crank and rocker pivoted at O2 (0, 0) and O4 (ground, 0).

    Parameters
    ----------
    crank, coupler, rocker, ground : float
        Link lengths [length].
    masses : tuple
        Of crank, coupler, rocker.
    start, speed : float
        Angle of the crank [rad] at t = 0 and its constant speed [rad/time].
    crossed : bool
        The other branch.
    units : str
        Name of the unit system.

    Examples
    --------
    >>> [joint.name for joint in four_bar(1, 3, 2, 3.5).joints]
    ['O2', 'A', 'B', 'O4']
    """
    _check("four-bar", crank=crank, coupler=coupler, rocker=rocker, ground=ground)
    _check_masses("four-bar", masses)
    start = number(start, "angle", "four-bar", "start")
    speed = number(speed, "angular velocity", "four-bar", "speed")
    ax, ay = crank * math.cos(start), crank * math.sin(start)
    diagonal = math.hypot(ground - ax, -ay)
    toward = math.atan2(-ay, ground - ax)
    # where the crank's end lies on O4 any angle serves
    cosine = (coupler**2 + diagonal**2 - rocker**2) / max(2.0 * coupler * diagonal, 1e-300)
    opening = math.acos(max(-1.0, min(1.0, cosine)))
    third = toward - opening if crossed else toward + opening
    bx, by = ax + coupler * math.cos(third), ay + coupler * math.sin(third)
    machine = Mechanism("four-bar", units=units, ground={"O2": (0.0, 0.0), "O4": (ground, 0.0)})
    machine.add(
        bar("crank", crank, mass=masses[0], ends=("O2", "A"), guess=start),
        bar("coupler", coupler, mass=masses[1], ends=("A", "B"), guess=third),
        bar("rocker", rocker, mass=masses[2], ends=("O4", "B"), guess=math.atan2(by, bx - ground)),
        Revolute("O2", "ground.O2", "crank.O2"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        AngleDriver("motor", "crank", ConstantSpeed(start, speed)),
    )
    return machine


def slider_crank(
    crank: float,
    rod: float,
    *,
    offset: float = 0.0,
    masses: tuple[float, float, float] = (0.0, 0.0, 0.0),
    start: float = math.pi / 3.0,
    speed: float = 0.0,
    units: str = "SI",
) -> Mechanism:
    """A slider-crank: the slider moves along x at height `offset`, the crank turns about O (0, 0).

    Parameters
    ----------
    crank, rod, offset : float
        [length].
    masses : tuple
        Of crank, rod, slider.
    start, speed : float
        Angle of the crank [rad] at t = 0 and its constant speed [rad/time].
    units : str
        Name of the unit system.

    Examples
    --------
    >>> [body.name for body in slider_crank(1, 3).bodies]
    ['crank', 'rod', 'slider']
    """
    _check("slider-crank", crank=crank, rod=rod)
    _check_masses("slider-crank", masses)
    offset = number(offset, "length", "slider-crank", "offset")
    start = number(start, "angle", "slider-crank", "start")
    speed = number(speed, "angular velocity", "slider-crank", "speed")
    sine = (offset - crank * math.sin(start)) / rod
    lean = math.asin(max(-1.0, min(1.0, sine)))
    machine = Mechanism(
        "slider-crank", units=units, ground={"O": (0.0, 0.0), "guide": (0.0, offset)}
    )
    machine.add(
        bar("crank", crank, mass=masses[0], ends=("O", "A"), guess=start),
        bar("rod", rod, mass=masses[1], ends=("A", "B"), guess=lean),
        Body("slider", mass=masses[2], points={"B": (0.0, 0.0)}),
        Revolute("O", "ground.O", "crank.O"),
        Revolute("A", "crank.A", "rod.A"),
        Revolute("B", "rod.B", "slider.B"),
        Prismatic("guide", "ground.guide", "slider.B"),
        AngleDriver("motor", "crank", ConstantSpeed(start, speed)),
    )
    return machine
