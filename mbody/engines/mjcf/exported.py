"""The exported file with its coordinates, units, and numbers as text."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mbody.engines.opinion import Inexpressible
from mbody.engines.spanning_tree import Branch, Tree, tree_motion
from mbody.quantities.units import UnitSystem
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["FileCoordinate", "Exported", "Scale", "branch_coordinates", "numbers", "placed", "safe"]


@dataclass(frozen=True)
class Scale:
    """SI units in one unit of a mechanism."""

    length: float
    mass: float
    time: float

    @staticmethod
    def of(units: UnitSystem) -> Scale:
        """Those of a unit system."""
        return Scale(*(float(units.unit(key).ratio) for key in ("length", "mass", "time")))

    @property
    def force(self) -> float:
        """Newtons."""
        return self.mass * self.length / self.time**2

    @property
    def torque(self) -> float:
        """Newton metres; joules."""
        return self.force * self.length


@dataclass(frozen=True)
class FileCoordinate:
    """One coordinate of the file.

    Attributes
    ----------
    name : str
        Of its joint in the file.
    of : Branch
        Branch of the tree that has the coordinate.
    which : int
        Index in the branch: 0; for a free branch 0, 1, 2 for x, y, angle.
    way : bool
        Whether it is a displacement, not an angle.
    direction : float
        Of a displacement: on the body [rad], for a free branch in the world.
    """

    name: str
    of: Branch
    which: int = 0
    way: bool = False
    direction: float = 0.0


@dataclass(frozen=True)
class Exported:
    """A mechanism as a model file.

    Attributes
    ----------
    text : str
        The file, in SI units.
    not_expressible : tuple of Inexpressible
        Elements, or what they do besides, that it has no words for, and why.
    without : tuple of Inexpressible
        Those of these that are not in the file at all, not even as what they would be without
        friction and always closed.
    notes : tuple of str
        Differences between the file and the mechanism.
    columns : tuple of FileCoordinate
        Its coordinates in order; all are zero at the start.
    stand_ins : tuple of str
        Bodies that have no mass or inertia in the mechanism and a very small one in the file.
    laws : dict
        Field of the law, by the name of the element of an actuator.
    built : frozenset of str
        Names of all elements in the file.
    reversed : frozenset of str
        Torsion springs whose angle has the opposite sign in the file.
    hung : tuple
        (name in the file, branch) of every body, and of the second halves of bodies.
    system : System
    start : Solution
        The pose where all coordinates are zero.
    scale : Scale
    """

    text: str
    not_expressible: tuple[Inexpressible, ...]
    without: tuple[Inexpressible, ...]
    notes: tuple[str, ...]
    columns: tuple[FileCoordinate, ...]
    stand_ins: tuple[str, ...]
    laws: dict[str, str]
    built: frozenset[str]
    reversed: frozenset[str]
    hung: tuple[tuple[str, Branch], ...]
    system: System
    start: Solution
    scale: Scale

    def motion(self, run: Solution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates of the file, rates and accelerations (instants, columns) of a run, in SI
        units.
        """
        tree = Tree(tuple(column.of for column in self.columns), (), ())
        units = np.array([self.scale.length if one.way else 1.0 for one in self.columns])
        q, v, a = (_selected(part, self.columns) for part in tree_motion(tree, run))
        first = _selected(tree_motion(tree, self.start)[0], self.columns)[-1]
        time = self.scale.time
        return (q - first) * units, v * units / time, a * units / time**2

    def __str__(self) -> str:
        return self.text


def _selected(whole: np.ndarray, columns: tuple[FileCoordinate, ...]) -> np.ndarray:
    """Select the coordinate of each column from those of its branch."""
    ends = np.cumsum([column.of.freedom for column in columns])
    index = [
        int(end) - column.of.freedom + column.which
        for end, column in zip(ends, columns, strict=True)
    ]
    return whole[:, index]


def branch_coordinates(branch: Branch) -> tuple[FileCoordinate, ...]:
    """The coordinates of a branch of the tree."""
    if branch.kind == "free":
        name = branch.body
        return (
            FileCoordinate(f"{name}.x", branch, 0, True, 0.0),
            FileCoordinate(f"{name}.y", branch, 1, True, 0.5 * math.pi),
            FileCoordinate(f"{name}.angle", branch, 2),
        )
    if branch.joint is None or branch.kind == "fixed":
        return ()
    if branch.kind == "prismatic":
        return (FileCoordinate(branch.joint.name, branch, 0, True, branch.on_body.angle),)
    return (FileCoordinate(branch.joint.name, branch),)


def numbers(unit: float, *values: float) -> str:
    """Numbers times a unit, as text with all digits; rounding errors of the greatest become zero.

    >>> numbers(2.0, 0.5, -1.0, 1e-20)
    '1 -2 0'
    """
    least = 1e-16 * max(map(abs, values))
    kept = (value if abs(value) > least else 0.0 for value in values)
    return " ".join(repr(float(unit * value) + 0.0).removesuffix(".0") for value in kept)


def safe(body: str) -> str:
    """The name of a body in the file, where ``world`` is the ground's.

    >>> safe("crank"), safe("world")
    ('crank', 'world.body')
    """
    return "world.body" if body == "world" else body


def placed(x: float, y: float, theta: float, at: tuple[float, float]) -> tuple[float, float]:
    """The world place [length] of a place on a body at (x, y) with the angle theta."""
    c, s = math.cos(theta), math.sin(theta)
    return x + c * at[0] - s * at[1], y + s * at[0] + c * at[1]
