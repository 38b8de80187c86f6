"""Makers of common bodies and mechanisms: plain functions that describe what a user could write."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

from mbody.core.tolerances import TINY
from mbody.errors import ModelError
from mbody.laws import ConstantSpeed
from mbody.model.body import Body, GuessLike
from mbody.model.driver import AngleDriver
from mbody.model.element import Point, PointLike, polar
from mbody.model.joints import Prismatic, Revolute
from mbody.model.mechanism import Mechanism
from mbody.quantities import Formula, Scope, text_of
from mbody.quantities.formula import Number, evaluated, number
from mbody.quantities.parse import Binary, Node, Plain
from mbody.quantities.units import UnitSystem, unit_system

__all__ = ["bar", "four_bar", "polar", "slider_crank"]


def bar(
    name: str,
    length: Number,
    *,
    mass: Number = 0.0,
    ends: tuple[str, str] = ("A", "B"),
    points: Mapping[str, PointLike] | None = None,
    guess: GuessLike = None,
) -> Body:
    """A uniform slender bar along its x axis, from end A at the origin to end B.

    Parameters
    ----------
    name : str
        Name of the body.
    length, mass : float or str
        [length], [mass]; the inertia is m l²/12. Text may have units, both or none, and parameters
        of the mechanism, which all numbers of the bar then follow.
    ends : pair of str
        Names of the two end points.
    points : mapping, optional
        More named points in link axes.
    guess : optional
        As of `Body`.

    Raises
    ------
    ModelError
        For a length that is not positive, and as of `Body`.

    Examples
    --------
    >>> bar("rod", 2.0, mass=3.0).inertia
    1.0
    >>> bar("rod", "60 mm", mass="2 kg").inertia.text
    '2 kg * (60 mm)^2 / 12'
    """
    whole, heavy = (
        number(value, key, name, key) for key, value in (("length", length), ("mass", mass))
    )
    # whether a parameter is positive is known in a mechanism only
    if not isinstance(whole, Formula) or not whole.names:
        _check(name, length=float(evaluated(whole, Scope(), name, "length")))
    named: dict[str, PointLike] = {ends[0]: (0.0, 0.0), ends[1]: (whole, 0.0), **(points or {})}
    return Body(
        name,
        mass=heavy,
        inertia=_slender(heavy, whole),
        cg=(_half(whole), 0.0),
        points=named,
        guess=guess,
    )


def _half(length: float | Formula) -> float | Formula:
    """l/2."""
    if isinstance(length, Formula):
        return _formula(Binary("/", length.tree, Plain(Fraction(2))))
    return 0.5 * length


def _slender(mass: float | Formula, length: float | Formula) -> float | Formula:
    """m l²/12, about the mass centre."""
    if isinstance(mass, Formula) or (isinstance(length, Formula) and mass):
        square = Binary("^", _tree(length), Plain(Fraction(2)))
        return _formula(Binary("/", Binary("*", _tree(mass), square), Plain(Fraction(12))))
    return 0.0 if isinstance(length, Formula) else mass * length**2 / 12.0


def _tree(value: float | Formula) -> Node:
    return value.tree if isinstance(value, Formula) else Plain(Fraction(value))


def _formula(tree: Node) -> Formula:
    return Formula(text_of(tree), tree=tree)


def _check(name: str, **lengths: float) -> None:
    """Refuse lengths that are not positive."""
    for field, value in lengths.items():
        if value <= 0.0:
            raise ModelError(f"'{name}': {field} is {value:g}, it must be positive", name)


def _numbers(name: str, units: UnitSystem, dimension: str, **given: Number) -> list[float]:
    """Numbers in a unit system, where text can have units, but no parameters."""
    scope = Scope(units)
    return [
        float(evaluated(number(value, dimension, name, field), scope, name, field))
        for field, value in given.items()
    ]


def _masses(name: str, units: UnitSystem, masses: Any) -> list[float]:
    if not isinstance(masses, (tuple, list)) or len(masses) != 3:
        raise ModelError(f"'{name}': masses must be three numbers, not {masses!r}", name)
    fields = {f"masses[{n}]": mass for n, mass in enumerate(masses)}
    return _numbers(name, units, "mass", **fields)


def _bar_of(name: str, length: float, heavy: float, mass: Number, **more: Any) -> Body:
    """A bar whose mass stays as it was given, text with its unit."""
    return replace(bar(name, length, mass=heavy, **more), mass=mass)


def four_bar(
    crank: Number,
    coupler: Number,
    rocker: Number,
    ground: Number,
    *,
    masses: tuple[Number, Number, Number] | list[Number] = (0.0, 0.0, 0.0),
    start: Number = math.pi / 3.0,
    speed: Number = 0.0,
    crossed: bool = False,
    units: str = "SI",
) -> Mechanism:
    """A four-bar of uniform bars, crank and rocker pivoted at O2 (0, 0) and O4 (ground, 0).

    Parameters
    ----------
    crank, coupler, rocker, ground : float or str
        Link lengths [length]; all numbers may be text with units.
    masses : tuple
        Of crank, coupler, rocker.
    start, speed : float or str
        Angle of the crank [rad] at t = 0 and its constant speed [rad/time].
    crossed : bool
        The other branch.
    units : str
        Name of the unit system.

    Raises
    ------
    ModelError
        For numbers of another dimension, lengths that are not positive, or parameters.

    Examples
    --------
    >>> four_bar("40 mm", "12 cm", 80, 100, units="mm-N-s")["rocker"].points["B"]
    (80.0, 0.0)
    >>> [joint.name for joint in four_bar(1, 3, 2, 3.5).joints]
    ['O2', 'A', 'B', 'O4']
    """
    name, system = "four-bar", unit_system(units)
    lengths = {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground}
    a, b, c, d = _numbers(name, system, "length", **lengths)
    _check(name, crank=a, coupler=b, rocker=c, ground=d)
    heavy = _masses(name, system, masses)
    (angle,) = _numbers(name, system, "angle", start=start)
    _numbers(name, system, "angular velocity", speed=speed)
    ax, ay = a * math.cos(angle), a * math.sin(angle)
    diagonal = math.hypot(d - ax, -ay)
    toward = math.atan2(-ay, d - ax)
    # where the crank's end lies on O4 any angle serves
    cosine = (b**2 + diagonal**2 - c**2) / max(2.0 * b * diagonal, TINY)
    opening = math.acos(max(-1.0, min(1.0, cosine)))
    third = toward - opening if crossed else toward + opening
    bx, by = ax + b * math.cos(third), ay + b * math.sin(third)
    pivots: dict[str, Point] = {"O2": (0.0, 0.0), "O4": (d, 0.0)}
    machine = Mechanism(name, units=units, ground=pivots)
    machine.add(
        _bar_of("crank", a, heavy[0], masses[0], ends=("O2", "A"), guess=angle),
        _bar_of("coupler", b, heavy[1], masses[1], ends=("A", "B"), guess=third),
        _bar_of("rocker", c, heavy[2], masses[2], ends=("O4", "B"), guess=math.atan2(by, bx - d)),
        Revolute("O2", "ground.O2", "crank.O2"),
        Revolute("A", "crank.A", "coupler.A"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("O4", "ground.O4", "rocker.O4"),
        AngleDriver("motor", "crank", ConstantSpeed(angle, speed)),
    )
    return machine


def slider_crank(
    crank: Number,
    rod: Number,
    *,
    offset: Number = 0.0,
    masses: tuple[Number, Number, Number] | list[Number] = (0.0, 0.0, 0.0),
    start: Number = math.pi / 3.0,
    speed: Number = 0.0,
    units: str = "SI",
) -> Mechanism:
    """A slider-crank: the slider moves along x at height `offset`, the crank turns about O (0, 0).

    Parameters
    ----------
    crank, rod, offset : float or str
        [length]; all numbers may be text with units.
    masses : tuple
        Of crank, rod, slider.
    start, speed : float or str
        Angle of the crank [rad] at t = 0 and its constant speed [rad/time].
    units : str
        Name of the unit system.

    Raises
    ------
    ModelError
        For numbers of another dimension, lengths that are not positive, or parameters.

    Examples
    --------
    >>> [body.name for body in slider_crank(1, 3).bodies]
    ['crank', 'rod', 'slider']
    """
    name, system = "slider-crank", unit_system(units)
    a, b, e = _numbers(name, system, "length", crank=crank, rod=rod, offset=offset)
    _check(name, crank=a, rod=b)
    heavy = _masses(name, system, masses)
    (angle,) = _numbers(name, system, "angle", start=start)
    _numbers(name, system, "angular velocity", speed=speed)
    lean = math.asin(max(-1.0, min(1.0, (e - a * math.sin(angle)) / b)))
    machine = Mechanism(name, units=units, ground={"O": (0.0, 0.0), "guide": (0.0, e)})
    machine.add(
        _bar_of("crank", a, heavy[0], masses[0], ends=("O", "A"), guess=angle),
        _bar_of("rod", b, heavy[1], masses[1], ends=("A", "B"), guess=lean),
        Body("slider", mass=masses[2], points={"B": (0.0, 0.0)}),
        Revolute("O", "ground.O", "crank.O"),
        Revolute("A", "crank.A", "rod.A"),
        Revolute("B", "rod.B", "slider.B"),
        Prismatic("guide", "ground.guide", "slider.B"),
        AngleDriver("motor", "crank", ConstantSpeed(angle, speed)),
    )
    return machine
