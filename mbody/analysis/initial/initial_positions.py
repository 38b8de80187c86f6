"""First positions by what is said of them, where more is said than is free: the nearest position
that joints and drivers allow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.errors import SolveError
from mbody.system.layout import Work
from mbody.system.rank import dense, shortest
from mbody.system.system import System

__all__ = ["Fitted", "Spot", "fitted_note", "fitted_places", "misplaced"]

Array = np.ndarray

#: Corrections, and what they end with, in model lengths and radians.
CORRECTIONS, CLOSED = 30, 1e-14
#: A singular value below this part of the greatest is zero: near a singular position as well.
ZERO = 1e-6
#: Places may be changed by so much, in model lengths and radians: a start with four digits.
SAID = 1e-3
#: Changes below this are rounding of numbers with all their digits.
TOLD = 1e-9
#: Places that a sentence names.
NAMED = 4


@dataclass(frozen=True)
class Spot:
    """A place that is said of a body: `key` is x or y of the origin of its axes, or angle."""

    body: str
    key: str
    value: float

    @property
    def name(self) -> str:
        """Such as "crank.angle"."""
        return f"{self.body}.{self.key}"

    def of(self, system: System, q: Array) -> tuple[float, Array]:
        """The coordinate at a position, and its change by coordinates without units of length, both
        in model lengths and radians.
        """
        first = 3 * system.bodies[self.body]
        row = np.zeros(system.coordinates)
        if self.key == "angle":
            row[first + 2] = 1.0
            return float(q[first + 2]), row
        cx, cy = system.numbers.point(f"{self.body}.cg")
        c, s = np.cos(q[first + 2]), np.sin(q[first + 2])
        x, y = c * cx - s * cy, s * cx + c * cy
        k = int(self.key == "y")
        row[first + k] = 1.0
        row[first + 2] = (-x if k else y) / system.length
        return float(q[first + k] - (x, y)[k]) / system.length, row

    def size(self, system: System) -> float:
        """The unit of `of`."""
        return 1.0 if self.key == "angle" else system.length

    def words(self, system: System, value: float) -> str:
        """Such as "crank.angle = 30 deg"."""
        if self.key == "angle":
            return f"{self.name} = {np.degrees(value):.7g} deg"
        return f"{self.name} = {value:.7g} {system.mechanism.units.length}"


@dataclass(frozen=True, eq=False)
class Fitted:
    """The nearest position to what is said.

    Attributes
    ----------
    q : array (coordinates + 3,)
        The position, the ground last.
    off : array (spots,)
        What is said less what it is there, in model lengths and radians.
    """

    q: Array
    off: Array

    @property
    def near(self) -> bool:
        """Whether what is said differs by no more than rounding of digits."""
        return bool(np.abs(self.off).max(initial=0.0) <= SAID)


def fitted_places(system: System, work: Work, said: Sequence[Spot], first: Array) -> Fitted | None:
    """The nearest position to what is said, from a first one (coordinates + 3,); None where the
    loops do not close near it.

    Parameters
    ----------
    work : Work
        A workspace, its signals set.
    """
    n = system.coordinates
    scale = np.tile([system.length, system.length, 1.0], system.layout.bodies)
    work.q[:, 0] = first
    wanted = np.array([spot.value / spot.size(system) for spot in said])
    for _ in range(CORRECTIONS):
        q = work.q[:n, 0]
        phi, G = dense(system, work)
        if not np.isfinite(G).all():
            return None
        told = [spot.of(system, q) for spot in said]
        off = wanted - np.array([value for value, _ in told])
        P = np.array([row for _, row in told]).reshape(-1, n)
        u, sizes, vt = np.linalg.svd(G)
        rank = int((sizes > ZERO * sizes.max(initial=1e-300)).sum())
        step = -vt[:rank].T @ ((u.T @ phi)[:rank] / sizes[:rank])
        free = vt[rank:]
        step = step + shortest(P @ free.T, off - P @ step, ZERO) @ free
        length = float(np.abs(step).max(initial=0.0))
        work.q[:n, 0] += scale * step * min(1.0, 0.5 / max(length, 1e-300))
        if length <= CLOSED * (1.0 + float(np.abs(q / scale).max())):
            break
    phi = dense(system, work)[0]
    if not np.abs(phi).max(initial=0.0) <= 1e-10:
        return None
    q = work.q[:n, 0]
    off = wanted - np.array([spot.of(system, q)[0] for spot in said])
    return Fitted(work.q[:, 0].copy(), off)


def fitted_note(system: System, said: Sequence[Spot], found: Fitted) -> tuple[str, ...]:
    """By how much places were changed, where that is more than rounding."""
    worst = int(np.abs(found.off).argmax())
    size = abs(float(found.off[worst]))
    if size <= TOLD:
        return ()
    spot = said[worst]
    unit = "deg" if spot.key == "angle" else system.mechanism.units.length
    change = np.degrees(size) if spot.key == "angle" else size * system.length
    return (
        f"the places of the start were fitted to joints and drivers: by {change:.2g} {unit} at "
        f"most, of {spot.name}",
    )


def misplaced(system: System, said: Sequence[Spot], found: Fitted) -> SolveError:
    """The sentence of places that joints and drivers do not allow together."""
    order = np.argsort(-np.abs(found.off))
    wrong = [int(n) for n in order if abs(found.off[n]) > 0.1 * SAID]
    parts = []
    for n in wrong[:NAMED]:
        spot = said[n]
        value = spot.value - spot.size(system) * float(found.off[n])
        given = np.degrees(spot.value) if spot.key == "angle" else spot.value
        parts.append(f"{spot.words(system, value)} (not {given:.7g})")
    more = f" and {len(wrong) - NAMED} more" if len(wrong) > NAMED else ""
    return SolveError(
        "the places of the start do not fit together: the nearest position that joints and drivers "
        f"allow has {', '.join(parts)}{more}; correct them, or leave out places that follow from "
        "others",
        said[wrong[0]].body,
    )
