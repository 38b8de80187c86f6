"""Charts of a surface of closed positions: coordinates of a tangent plane, the drive over them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.analysis.equilibria.jump_points import JumpPoint, end_vectors
from mbody.analysis.equilibria.surface_cover import Cover, CoverNode
from mbody.analysis.position.tangent_space import Array, Place
from mbody.model.element import Element

__all__ = ["FINEST", "PolarChart", "TangentChart"]

#: Cells of a chart along each axis at its finest, a power of two.
FINEST = 2**12
#: By how much charts overlap beyond halfway to their neighbours.
OVERLAP = 1.15
#: How much longer than its part in the tangent plane a way on the surface may be.
STEEP = 2.0
#: The same of a chart that is to be level.
BENT = 1.15
#: Positions nearer to each other than this are one.
SAME = 1e-6
#: The least radius of a polar chart, as a part of its greatest.
INNERMOST = 1e-5
#: Angle [rad] at which a polar chart begins: no direction of symmetry.
BEGINS = 0.7


class TangentChart:
    """The surface around a place of the cover, over a rectangle of the tangent plane there.

    Parameters
    ----------
    loads : sequence of Element
        Loads whose direction turns quickly where their ends come close.

    Attributes
    ----------
    evaluations : int
        How often the drive was evaluated.
    left : list of ((int, int), int)
        Corner and size of cells that were left to other charts.
    places : dict
        Positions at points of the grid where the drive was evaluated.
    """

    def __init__(self, cover: Cover, node: CoverNode, loads: Sequence[Element] = ()) -> None:
        self.cover, self.node, self.loads, self.evaluations = cover, node, loads, 0
        self.side = self._side(node.place.rows)
        low, high = cover.box(node, OVERLAP)
        self.low, self.step = low, (high - low) / FINEST
        self.left: list[tuple[tuple[int, int], int]] = []
        self.places: dict[tuple[int, int], Place] = {}
        self._drives: dict[tuple[int, int], Array] = {}
        self._ends: dict[tuple[int, int], Array] = {}

    def resize(self, half_width: float) -> None:
        """Make it a square around its place."""
        self.low, self.step = np.full(2, -half_width), np.full(2, 2.0 * half_width / FINEST)

    def is_level(self) -> bool:
        """Whether it leads everywhere, and is nowhere steep: so is its border, at least."""
        middles = [(i, j) for i in (0, 1, 2) for j in (0, 1, 2) if (i, j) != (1, 1)]
        for y in (self.y(0.5 * i * FINEST, 0.5 * j * FINEST) for i, j in middles):
            place = self.place(y)
            if place is None or self.cover.chord(self.node, place.q) > BENT * np.linalg.norm(y):
                return False
        return True

    def y(self, i: float, j: float) -> Array:
        """Coordinates of a point of the grid."""
        return np.asarray(self.low + self.step * [i, j])

    def grid(self, y: Array) -> Array:
        """Where coordinates are on the grid: (2,)."""
        return np.asarray((y - self.low) / self.step)

    def drive(self, i: int, j: int) -> Array:
        """The drive at a point of the grid, in the frame of the chart."""
        if (i, j) not in self._drives:
            self.evaluations += 1
            place = self.place(self.y(i, j))
            self._drives[i, j] = self._drive_of(place)
            if place is not None:
                self.places[i, j] = place
                self._ends[i, j] = end_vectors(self.cover, self.loads, place.q)
        return self._drives[i, j]

    def value(self, y: Array) -> Array:
        """The drive at coordinates; not a number where the chart does not lead."""
        self.evaluations += 1
        return self._drive_of(self.place(y))

    def _drive_of(self, place: Place | None) -> Array:
        return np.full(2, np.nan) if place is None else self.node.frame @ place.push

    def resolved(self, i: int, j: int, size: int) -> bool:
        """Whether a cell is so short that no load turns quickly in it, its drives being known."""
        ends = np.array([[self._ends[i + m, j + n] for n in (0, size)] for m in (0, size)])
        return bool((self._moved(ends) <= np.linalg.norm(ends, axis=-1).min(axis=(0, 1))).all())

    def _moved(self, ends: Array) -> Array:
        """By how much the ends of loads move to each other along the sides of a cell: (loads,)."""
        along = [np.linalg.norm(np.diff(ends, axis=n), axis=-1).max(axis=(0, 1)) for n in (0, 1)]
        return np.asarray(np.hypot(*along))

    def takes(self, q: Array) -> bool:
        """Whether a position lies on the chart, and in no cell that was left to other charts."""
        at = self.grid(self.cover.seen(self.node, q))
        if (at < 0.0).any() or (at > FINEST).any():
            return False
        if any(np.abs((at - corner) / size - 0.5).max() <= 0.5 for corner, size in self.left):
            return False
        return self.holds(q)

    def holds(self, q: Array) -> bool:
        """Whether the chart leads to a position, and not to one of another sheet above the same
        place of the tangent plane.
        """
        there = self.position(self.cover.seen(self.node, q))
        return there is not None and self.cover.manifold.apart(there, q) < SAME

    def place(self, y: Array) -> Place | None:
        """What holds at coordinates; None where the chart does not lead."""
        q = self.position(y)
        there = None if q is None else self.cover.manifold.place(q)
        return there if there is not None and len(there.motions) == 2 else None

    def position(self, y: Array) -> Array | None:
        """The position at coordinates; None where the chart does not lead."""
        manifold, frame = self.cover.manifold, self.node.frame
        q = manifold.closed(self.node.place.q + manifold.scale * (y @ frame), frame)
        if q is None:
            return None
        # closing may lead to another sheet, and beside a change point to another circuit
        chord = (q - self.node.place.q) / manifold.scale
        if np.linalg.norm(chord) > STEEP * np.linalg.norm(y) + 1e-9:
            return None
        return q if self._side(manifold.rows(q)[1]) == self.side else None

    def _side(self, rows: Array) -> float:
        """The sign of det [Φ_q; frame], which a chart changes nowhere; 0 with redundant rows."""
        square = np.vstack([rows, self.node.frame])
        return float(np.linalg.slogdet(square)[0]) if len(square) == square.shape[1] else 0.0


class PolarChart(TangentChart):
    """The same around a point where a load jumps, over radius and angle: there the drive is smooth
    in both, down to the radius zero.
    """

    def __init__(self, cover: Cover, point: JumpPoint, loads: Sequence[Element] = ()) -> None:
        super().__init__(cover, point.node, loads)
        self.centre, self.radius = point.y, point.radius
        self.low = np.array([INNERMOST * self.radius, BEGINS])
        self.step = (np.array([self.radius, BEGINS + 2.0 * np.pi]) - self.low) / FINEST
        lengths = np.linalg.norm(end_vectors(cover, loads, point.q), axis=1)
        self.own = lengths < 1e-3 * INNERMOST * self.radius

    def y(self, i: float, j: float) -> Array:
        """Coordinates of a point of the grid."""
        radius, angle = self.low + self.step * [i, j]
        return np.asarray(self.centre + radius * np.array([np.cos(angle), np.sin(angle)]))

    def grid(self, y: Array) -> Array:
        """Where coordinates are on the grid: (2,)."""
        x, z = y - self.centre
        angle = BEGINS + (np.arctan2(z, x) - BEGINS) % (2.0 * np.pi)
        polar = np.array([np.hypot(x, z), angle])
        return np.asarray((polar - self.low) / self.step)

    def _moved(self, ends: Array) -> Array:
        """The same; loads whose ends meet in the centre turn with the angle only."""
        turned = np.linalg.norm(np.diff(ends, axis=1), axis=-1)
        lengths = np.linalg.norm(ends, axis=-1)
        part = (turned / np.maximum(lengths.min(axis=1, keepdims=True), 1e-300)).max(axis=(0, 1))
        own = part * lengths.min(axis=(0, 1))
        return np.where(self.own, own, super()._moved(ends))
