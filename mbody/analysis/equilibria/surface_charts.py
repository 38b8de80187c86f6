"""Charts of a surface of closed positions: coordinates of a tangent plane, and where they lead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbody.analysis.equilibria.jump_points import JumpPoint
from mbody.analysis.equilibria.load_ends import LoadEnds
from mbody.analysis.equilibria.surface_cover import Cover, CoverNode, whole_turns_less
from mbody.analysis.position.many_positions import ClosedPositions
from mbody.analysis.position.tangent_space import Array

__all__ = ["FINEST", "PolarChart", "TangentChart", "hold", "led_to"]

#: Cells of a chart along each axis at its finest, a power of two.
FINEST = 2**12
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
    low, high : array (2,)
        Bounds of the rectangle.

    Attributes
    ----------
    evaluations : int
        How often the drive was evaluated.
    left : list of ((int, int), int)
        Corner and size of cells that were left to other charts.
    samples : dict
        Numbers of the samples at points of the grid where the drive was evaluated.
    zeros : list
        What is known of zeros that the chart leads to, as `ChartZeros` keeps them.
    """

    def __init__(self, cover: Cover, node: CoverNode, low: Array, high: Array) -> None:
        self.cover, self.node, self.evaluations = cover, node, 0
        self.side = self._side()
        self.low, self.step = low, (high - low) / FINEST
        self.left: list[tuple[tuple[int, int], int]] = []
        self.samples: dict[tuple[int, int], int] = {}
        self.zeros: list[Any] = []
        self.zeros_read = 0

    def is_level(self) -> bool:
        """Whether it leads everywhere, and is nowhere steep: so is its border, at least."""
        middles = [(i, j) for i in (0, 1, 2) for j in (0, 1, 2) if (i, j) != (1, 1)]
        y = np.array([self.y(0.5 * i * FINEST, 0.5 * j * FINEST) for i, j in middles])
        found = led_to([self] * len(y), y)
        chords = np.linalg.norm((found.q - self.node.place.q) / self.cover.scale, axis=1)
        return bool(found.good.all() and (chords <= BENT * np.linalg.norm(y, axis=1)).all())

    def y(self, i: float, j: float) -> Array:
        """Coordinates of a point of the grid."""
        return np.asarray(self.low + self.step * [i, j])

    def grid(self, y: Array) -> Array:
        """Where coordinates are on the grid: (…, 2)."""
        return np.asarray((y - self.low) / self.step)

    def left_open(self, at: Array) -> bool:
        """Whether a point of the grid is on the chart, and in no cell that was left to others."""
        if (at < 0.0).any() or (at > FINEST).any():
            return False
        return not any(
            np.abs((at - corner) / size - 0.5).max() <= 0.5 for corner, size in self.left
        )

    def holds(self, q: Array) -> bool:
        """Whether the chart leads to a position, and not to one of another sheet above the same
        place of the tangent plane.
        """
        return bool(hold([self], q[None])[0])

    def turned_little(self, ends: Array, moved: Array) -> Array:
        """By how much the ends of loads move to each other in cells (cells, loads), those of cells
        (cells, 2, 2, loads, 2); `moved` is the same in a chart that has no centre.
        """
        return moved

    def _side(self) -> float:
        """The sign of det [Φ_q; frame], which a chart changes nowhere; 0 with redundant rows."""
        square = np.vstack([self.node.place.rows, self.node.frame])
        return float(np.linalg.slogdet(square)[0]) if len(square) == square.shape[1] else 0.0


class PolarChart(TangentChart):
    """The same around a point where a load jumps, over radius and angle: there the drive is smooth
    in both, down to the radius zero.
    """

    def __init__(self, cover: Cover, point: JumpPoint, ends: LoadEnds) -> None:
        self.centre, self.radius = point.y, point.radius
        low = np.array([INNERMOST * self.radius, BEGINS])
        super().__init__(cover, point.node, low, np.array([self.radius, BEGINS + 2.0 * np.pi]))
        lengths = np.linalg.norm(ends.vectors(point.q), axis=1)
        self.own = lengths < 1e-3 * INNERMOST * self.radius

    def y(self, i: float, j: float) -> Array:
        """Coordinates of a point of the grid."""
        radius, angle = self.low + self.step * [i, j]
        return np.asarray(self.centre + radius * np.array([np.cos(angle), np.sin(angle)]))

    def grid(self, y: Array) -> Array:
        """Where coordinates are on the grid: (…, 2)."""
        x, z = np.moveaxis(y - self.centre, -1, 0)
        angle = BEGINS + (np.arctan2(z, x) - BEGINS) % (2.0 * np.pi)
        return np.asarray((np.stack([np.hypot(x, z), angle], axis=-1) - self.low) / self.step)

    def turned_little(self, ends: Array, moved: Array) -> Array:
        """The same; loads whose ends meet in the centre turn with the angle only."""
        turned = np.linalg.norm(np.diff(ends, axis=2), axis=-1)[:, :, 0]
        lengths = np.linalg.norm(ends, axis=-1)
        part = (turned / np.maximum(lengths.min(axis=2), 1e-300)).max(axis=1)
        return np.where(self.own, part * lengths.min(axis=(1, 2)), moved)


def led_to(charts: Sequence[TangentChart], y: Array) -> ClosedPositions:
    """The positions to which charts lead at coordinates, each at its own (charts, 2)."""
    cover = charts[0].cover
    scale, nodes = cover.scale, [chart.node for chart in charts]
    frames = np.array([node.frame for node in nodes])
    origin = np.array([node.place.q for node in nodes])
    found = cover.many.closed(origin + scale * np.einsum("nf,nfc->nc", y, frames), frames)
    # closing may lead to another sheet, and beside a change point to another circuit
    chords = np.linalg.norm((found.q - origin) / scale, axis=1)
    sides = np.array([chart.side for chart in charts])
    good = found.good & (chords <= STEEP * np.linalg.norm(y, axis=1) + 1e-9)
    return replace(found, good=good & (found.side == sides))


def hold(charts: Sequence[TangentChart], q: Array) -> Array:
    """Whether charts lead to positions, each to its own (charts, coordinates)."""
    if not charts:
        return np.zeros(0, dtype=bool)
    cover = charts[0].cover
    origin = np.array([chart.node.place.q for chart in charts])
    frames = np.array([chart.node.frame for chart in charts])
    way = whole_turns_less((q - origin) / cover.scale)
    found = led_to(charts, np.einsum("nfc,nc->nf", frames, way))
    apart = np.abs(whole_turns_less((found.q - q) / cover.scale)).max(axis=1)
    return np.asarray(found.good & (np.where(found.good, apart, np.inf) < SAME))
