"""Pseudo-arclength continuation of rest positions along one number of a system.

A point is (q, p): a closed position and the number. With c = −Φ_q⁺ Φ_p (how the position follows
the number at once), steps are q̇ = N y + c ṗ, and along the curve −K y + g ṗ = 0, g being the change
of the drive with p. Arclength is without units: lengths by the model length, p by its span.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mbody.analysis.position.tangent_space import Array, Manifold, Place
from mbody.errors import ModelError
from mbody.system.system import System

__all__ = ["Follower", "Point"]

#: Part of the span that differences along the number take.
STEP = 1e-4
#: The same where differences are of fourth order.
FINE = 1e-3
#: First and longest step along the curve, and the shortest.
FIRST, LONGEST, SHORTEST = 0.02, 0.1, 1e-7
#: Cosine of the greatest angle between the directions of neighbours.
STRAIGHT = 0.98
#: Corrections of one step.
CORRECTIONS = 8
#: A correction below this is rounding.
SMALL = 1e-12


@dataclass(frozen=True, eq=False)
class Point:
    """A rest position on the curve.

    Attributes
    ----------
    value : float
        The number, from 0 to 1 along its span.
    direction : array (coordinates + 1,)
        Unit tangent of the curve, the number last.
    stiffness : array (free, free)
        In the free motions of the place.
    arc : float
        Arclength from the first point.
    side : float
        Determinant of the equations of a step, by their size: its sign changes where another branch
        crosses, and there alone.
    size : float
        The greatest of K and of the change of the drive with the number.
    """

    place: Place
    value: float
    direction: Array
    stiffness: Array
    arc: float
    side: float
    size: float

    @property
    def stiffnesses(self) -> Array:
        """Eigenvalues of the stiffness in order, or its determinant where it is not symmetric: one
        passes zero where the stability changes.
        """
        K = self.stiffness
        if np.abs(K - K.T).max() > 1e-6 * np.abs(K).max():
            return np.array([np.linalg.det(K)])
        return np.linalg.eigvalsh(0.5 * (K + K.T))


class Follower:
    """Follows one curve of rest positions of `system` as `parameter` goes over `span`."""

    def __init__(self, system: System, start: Manifold, parameter: str, span: Array) -> None:
        self.system, self.first, self.parameter = system, start, parameter
        self.low, self.width = float(span[0]), float(span[1] - span[0])
        self.scale = start.scale
        self._made: dict[float, Manifold] = {}

    def number(self, value: float) -> float:
        """The number at a place of its span; its ends exactly."""
        return self.low + self.width * value

    def manifold(self, value: float) -> Manifold:
        """Closed positions for one value of the number."""
        if value not in self._made:
            if len(self._made) > 8:
                self._made.clear()
            changed = self.system.with_values({self.parameter: self.number(value)})
            self._made[value] = self.first.other(changed)
        return self._made[value]

    def slopes(self, here: Place, value: float, fine: bool = False) -> tuple[Array, Array]:
        """c = dq/dp on the constraints (coordinates,), and the change g of the drive (free,); by
        differences of fourth order where `fine` asks for all digits.
        """

        def both(at: float) -> Array:
            manifold = self.manifold(at)
            phi, G = manifold.rows(here.q)
            return np.append(phi, manifold.force(here.q) - G.T @ here.multipliers)

        low, high = self._around(value)
        rates = (both(high) - both(low)) / (high - low)
        if fine and self._around(value, 2.0 * FINE) == (value - 2.0 * FINE, value + 2.0 * FINE):
            near = both(value + FINE) - both(value - FINE)
            far = both(value + 2.0 * FINE) - both(value - 2.0 * FINE)
            rates = (8.0 * near - far) / (12.0 * FINE)
        G = self.manifold(value).rows(here.q)[1]
        shift, change = rates[: len(G)], rates[len(G) :]
        follows = np.zeros(len(here.q))
        if np.abs(shift).max(initial=0.0) > 0.0:
            follows = -np.linalg.lstsq(G, shift, rcond=1e-9)[0]
        if follows.any():
            change = change + self.manifold(value).change(here, follows)
        return follows, here.motions @ change

    def _around(self, value: float, step: float = STEP) -> tuple[float, float]:
        """Two values beside one, those that the system takes."""
        low, high = value - step, value + step
        for shifted in (low, high):
            try:
                self.manifold(shifted)
            except ModelError:  # as of a length that must not be negative
                return (low, value) if shifted == high else (value, high)
        return low, high

    def point(self, here: Place, value: float, before: Array | None, arc: float) -> Point:
        """A rest position with the direction of the curve there, onward from the one before."""
        K = self.manifold(value).stiffness(here)
        follows, change = self.slopes(here, value)
        size = max(float(np.abs(K).max()), float(np.abs(change).max()), 1e-300)
        vt = np.linalg.svd(np.column_stack([-K, change]) / size)[2]
        y, rate = vt[-1, :-1], vt[-1, -1]
        direction = np.append(y @ here.motions + rate * follows, rate)
        direction /= np.linalg.norm(direction)
        way = vt[-1]
        if before is not None and direction @ before < 0.0:
            direction, way = -direction, -way
        side = float(np.linalg.det(np.vstack([np.column_stack([-K, change]) / size, way])))
        return Point(here, value, direction, K, arc, side, size)

    def ahead(self, here: Point, step: float) -> Point | None:
        """The point of the curve at that distance along the direction of another."""
        value = here.value + step * float(here.direction[-1])
        q = here.place.q + step * self.scale * here.direction[:-1]
        last = np.inf
        for n in range(CORRECTIONS):
            try:
                manifold = self.manifold(value)
            except ModelError:
                return None
            place = manifold.at(q)
            if place is None or len(place.motions) != len(here.place.motions):
                return None
            K = manifold.stiffness(place)
            follows, change = self.slopes(place, value)
            way = (place.q - here.place.q) / self.scale
            off = step - way @ here.direction[:-1]
            off -= (value - here.value) * float(here.direction[-1])
            across = place.motions @ here.direction[:-1]
            along = follows @ here.direction[:-1] + here.direction[-1]
            size = max(float(np.abs(K).max()), float(np.abs(change).max()), 1e-300)
            A = np.block(
                [[-K / size, change[:, None] / size], [across[None, :], np.array([[along]])]]
            )
            b = np.append(-place.drive / size, off)
            try:
                move = np.linalg.solve(A, b)
            except np.linalg.LinAlgError:
                return None
            length = float(np.linalg.norm(move))
            if not length < 1.0 or (n > 1 and length > last):
                if n > 1 and length < 1e-9:
                    return self.point(place, value, here.direction, here.arc + abs(step))
                return None
            q = place.q + self.scale * (move[:-1] @ place.motions + move[-1] * follows)
            value += float(move[-1])
            if length < SMALL:
                place = self.manifold(value).at(q)
                if place is None:
                    return None
                return self.point(place, value, here.direction, here.arc + abs(step))
            last = length
        return None

    def at_end(self, here: Point, value: float) -> Point | None:
        """The rest position where the number has that value, near a point of the curve."""
        manifold = self.manifold(value)
        rate = float(here.direction[-1])
        part = (value - here.value) / rate if rate else 0.0
        place = manifold.at(here.place.q + part * self.scale * here.direction[:-1])
        for _ in range(CORRECTIONS):
            if place is None:
                return None
            K = manifold.stiffness(place)
            move = np.linalg.lstsq(K, place.drive, rcond=1e-12)[0]
            length = float(np.linalg.norm(move))
            if not length < 1.0:
                return None
            place = manifold.moved(place, move @ place.motions)
            if length < SMALL and place is not None:
                return self.point(place, value, here.direction, here.arc + abs(part))
        return None

    def between(self, here: Point, there: Point, of: Callable[[Point], float]) -> Point:
        """Where what changes its sign between two points of the curve passes zero (Illinois)."""
        low, high = here, there
        first, last = of(low), of(high)
        top = max(abs(first), abs(last))
        while abs(last) > 1e-12 * top and abs(high.arc - low.arc) > 1e-9:
            arc = high.arc - last * (high.arc - low.arc) / (last - first)
            found = self._at(here, there, arc)
            if found is None:
                break
            value = of(found)
            if value * last <= 0.0:
                low, first = high, last
            else:
                first *= 0.5
            high, last = found, value
        return min((low, high), key=lambda point: abs(of(point)))

    def _at(self, here: Point, there: Point, arc: float) -> Point | None:
        """The point of the curve at an arclength, from that of two others that leads there."""
        ends = sorted((here, there), key=lambda end: abs(end.arc - arc))
        for end in ends:
            found = self.ahead(end, arc - end.arc)
            if found is not None:
                return replace(found, arc=arc)
        return None
