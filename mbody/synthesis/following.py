"""Designs are followed: the assembled mechanism goes through all points, and what it does is told
from what it should do: order, branch and circuit defects.

A design has a circuit defect where some of its positions can be reached only by taking a joint
apart, a branch defect where the driver meets a dead centre between them, and an order defect where
it passes them in another order (Erdman and Sandor, *Mechanism Design*, 1984, section 8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.errors import SolveError
from mbody.model.mechanism import Mechanism
from mbody.synthesis.linkage_kinds import Kind
from mbody.system.assembler import assemble
from mbody.system.system import System

__all__ = ["Followed", "Positions", "followed"]

#: Angle of the carrier by which a position is the one that was meant [rad].
SAME = 1e-6
#: Instants of the motion of which the transmission angle and conditions are taken.
MOTION = 181
#: A whole turn less rounding.
TURN = 2.0 * math.pi - 1e-9


@dataclass(frozen=True, eq=False)
class Positions:
    """A design with the positions that it is to go through: a row of numbers, crank angles, the
    sense in which the loop is closed at each; `fixed` where the turns between them are given;
    `plane` is the angle of the axes of a plane that is guided to those of the carrier.
    """

    kind: Kind
    x: np.ndarray
    theta: np.ndarray
    senses: np.ndarray
    fixed: bool = False
    plane: float | None = None

    def described(self, theta: np.ndarray, units: str) -> Mechanism:
        """The mechanism as a description, its crank at the first of some angles."""
        return self.kind.mechanism(self.x, theta, float(self.senses[0]), units, self.plane)

    @property
    def carriers(self) -> np.ndarray:
        """Directions e^{iφ} of the axes of the carrier at the positions."""
        at = zip(self.theta, self.senses, strict=True)
        found = [self.kind.poses(self.x, np.array([angle]), sense)[0][0] for angle, sense in at]
        return np.array(found) * np.exp(1j * (self.plane or 0.0))


@dataclass(frozen=True, eq=False)
class Followed:
    """How the mechanism went through its positions.

    Attributes
    ----------
    system : System
    theta : array (points,)
        Crank angles as they were passed.
    order : bool
    defects : tuple of str
    run : Solution or None
        At the points, where all were reached.
    motion : Solution or None
        Of the whole turn, or from the first point to the last.
    """

    system: System
    theta: np.ndarray
    order: bool
    defects: tuple[str, ...]
    run: Any
    motion: Any


def followed(positions: Positions, units: str) -> Followed:
    """Drive the crank from the first position through the others, and judge what it meets."""
    name, carriers, stop = positions.kind.carrier, positions.carriers, ""
    for theta, in_order in _ways(positions):
        system = assemble(positions.described(theta, units))
        try:
            run = kinematics(system, drive={"motor": theta})
        except SolveError as error:
            stop = stop or str(error).partition(";")[0]
            continue
        off = np.abs(np.exp(1j * run[name].angle) - carriers) > SAME
        doubts = [one.message for one in run.doubts if one.kind == "branch"]
        if off.any() or doubts:
            stop = stop or (doubts[0] if doubts else "")
            continue
        defects = () if in_order else ("order: the crank turns back between the points",)
        return Followed(system, theta, in_order, defects, run, _motion(positions, system, theta))
    theta = next(_ways(positions))[0]
    system = assemble(positions.described(theta, units))
    return Followed(system, theta, False, (_defect(positions, stop),), None, None)


def _ways(positions: Positions) -> Any:
    """Crank angles through all points, and whether they go one way within a turn."""
    theta = positions.theta
    steps = np.diff(theta)
    if positions.fixed:
        one_way = bool((steps > 0.0).all() or (steps < 0.0).all()) and abs(steps.sum()) < TURN
        yield theta, bool(one_way)
        return
    forward, backward = np.mod(steps, 2.0 * math.pi), -np.mod(-steps, 2.0 * math.pi)
    for turns in sorted((forward, backward), key=lambda turns: abs(turns.sum())):
        if abs(turns.sum()) < TURN:
            yield theta[0] + np.concatenate([[0.0], np.cumsum(turns)]), True
    shortest = np.mod(steps + math.pi, 2.0 * math.pi) - math.pi
    yield theta[0] + np.concatenate([[0.0], np.cumsum(shortest)]), False


def _defect(positions: Positions, stop: str) -> str:
    kind, senses = positions.kind, positions.senses
    circuits = kind.circuit(positions.x, positions.theta, senses)
    if others := _points(circuits != circuits[0]):
        return f"circuit: {others} on another circuit than the first"
    if others := _points(senses != senses[0]):
        return f"branch: {others} beyond a dead centre of the crank, on another branch"
    return f"branch: {stop or 'the crank does not reach all points'}"


def _points(there: np.ndarray) -> str:
    """The numbers of some of the points, in words; empty where there are none."""
    numbers = [str(n + 1) for n in np.flatnonzero(there)]
    if not numbers:
        return ""
    return f"point {numbers[0]} is" if len(numbers) == 1 else f"points {', '.join(numbers)} are"


def _motion(positions: Positions, system: System, theta: np.ndarray) -> Any:
    if positions.kind.turns(positions.x):
        way = theta[0] + np.linspace(0.0, 2.0 * math.pi, MOTION)
    else:
        whole = np.linspace(0.0, len(theta) - 1.0, MOTION)
        way = np.interp(whole, np.arange(len(theta)), theta)
    return kinematics(system, drive={"motor": way})
