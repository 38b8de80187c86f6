"""Cells of charts, many at once: in which of them the drive has no zero, or a single one.

A cell is excluded where some direction separates zero from the drive at its corners by more than
the error of linear interpolation, which second differences bound. Where the ends of a load come
close within a cell its direction is not known between the corners: there the rest of the drive must
be separated from zero by more than the load may give in any direction. Of a load whose ends meet in
a curve that goes through the cell both sides are known: where it outweighs the rest, there is no
zero beside the curve.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.analysis.equilibria.surface_charts import TangentChart
from mbody.analysis.equilibria.surface_samples import SurfaceSamples
from mbody.analysis.position.tangent_space import Array

__all__ = ["ChartCells"]

#: The error of interpolation, as a multiple of what second differences show.
SURE = 2.0
#: Directions among which one that separates zero is sought.
DIRECTIONS = 32
#: Difference from the identity below which a cell holds one zero at most.
ALONE = 0.9
#: How far outside its cell, in parts of it, a zero of the interpolation is followed at least.
FOLLOWED = 0.6
#: Sine of the angle between two directions of ends that are on one line.
ONE_LINE = 0.2
#: Ends at this distance, in model lengths, are on both sides of a crease.
ON_CREASE = 1e-9

_ANGLES = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
WAYS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


def _quarters(grid: Array) -> Array:
    """The corners (cells, 4, 2, 2, …) of the four parts of cells (cells, 3, 3, …)."""
    parts = [grid[:, m : m + 2, n : n + 2] for m in (0, 1) for n in (0, 1)]
    return np.stack(parts, axis=1)


def _bends(grid: Array) -> tuple[Array, Array]:
    """Second differences (cells, 3, …) along both axes of cells (cells, 3, 3, …)."""
    return (
        grid[:, 1, :] - 0.5 * (grid[:, 0, :] + grid[:, 2, :]),
        grid[:, :, 1] - 0.5 * (grid[:, :, 0] + grid[:, :, 2]),
    )


def _separated(corners: Array, bends: Sequence[Array]) -> Array:
    """By how much each direction separates zero from what corners (parts, 2, 2, 2) interpolate:
    (parts, directions); errors are a quarter of the bends of a cell twice as long.
    """
    least = (corners.reshape(len(corners), 4, 2) @ WAYS.T).min(axis=1)
    return np.asarray(least - _error(bends))


def _error(bends: Sequence[Array]) -> Array:
    every = [np.abs(bend @ WAYS.T).max(axis=1) for bend in bends]
    return np.asarray(0.25 * SURE * sum(every))


class ChartCells:
    """The quarters of some cells whose nine samples are known: (cells, 4) each.

    Attributes
    ----------
    empty : array of bool
        Whether there is no zero, those on a crease left out.
    single : array of bool
        Whether there is one zero at most.
    part : array (cells, 4, 2)
        Where the interpolation has its zero, in parts of the quarter from its corner on.
    outside : array of bool
        Whether that is too far away to be in a quarter that has one at most.
    inward : array of int
        The number of a load, among those that are sharp, that drives to its crease from both sides
        of a quarter in which the drive along the crease has a zero; −1 of none.
    turning : array (cells, 4, loads) of bool
        Loads whose direction is not known between the corners.
    """

    def __init__(
        self,
        samples: SurfaceSamples,
        charts: Sequence[TangentChart],
        numbers: Array,
        creased: Array,
    ) -> None:
        self.samples, self.creased = samples, creased
        grid = samples.drive[numbers]
        corners, bends = _quarters(grid), _bends(grid)
        shape = corners.shape[:2]
        flat = corners.reshape(-1, 2, 2, 2)
        every = [np.repeat(bend, 4, axis=0) for bend in bends]
        self._ends(charts, numbers, shape)
        clear = ~self.turning.any(axis=-1)
        gaps = _separated(flat, every).max(axis=1).reshape(shape)
        self.empty = clear & (gaps > 0.0)
        self.inward = np.full(shape, -1)
        self._linear(flat, every, shape)
        self.single &= clear & ~self.empty
        self._creases(numbers, np.argwhere(~clear))

    def _ends(self, charts: Sequence[TangentChart], numbers: Array, shape: tuple[int, ...]) -> None:
        """Which loads turn quickly."""
        grid = self.samples.ends[numbers]  # (cells, 3, 3, loads, 2)
        loads = grid.shape[3]
        ends = _quarters(grid)
        self.turning = np.zeros((*shape, loads), dtype=bool)
        self.crossed = np.zeros((*shape, loads), dtype=bool)
        if not (loads and len(grid)):
            return
        along = [np.linalg.norm(np.diff(ends, axis=n), axis=-1).max(axis=(2, 3)) for n in (2, 3)]
        moved = np.hypot(*along)
        for n, chart in enumerate(charts):
            moved[n] = chart.turned_little(ends[n], moved[n])
        lengths = np.linalg.norm(ends, axis=-1)
        self.turning = moved > lengths.min(axis=(2, 3))
        for load in np.flatnonzero(self.creased):
            d = ends[..., load, :].reshape(*shape, 4, 2)
            long = lengths[..., load].reshape(*shape, 4)
            u = d / np.maximum(long, 1e-300)[..., None]
            line = np.take_along_axis(u, long.argmax(axis=-1)[..., None, None], axis=2)
            across = np.abs(u[..., 0] * line[..., 1] - u[..., 1] * line[..., 0])
            on_line = ((across <= ONE_LINE) | (long <= ON_CREASE)).all(axis=-1)
            signed = (d * line).sum(axis=-1)
            whole = np.einsum("cijx,cqx->cqij", grid[:, :, :, load], line[:, :, 0])
            bent = [
                np.abs(bend).max(axis=1).reshape(shape) for bend in _bends(whole.reshape(-1, 3, 3))
            ]
            least = signed.min(axis=-1) - 0.25 * SURE * (bent[0] + bent[1])
            beside = on_line & (least > 0.0)
            self.turning[..., load] &= ~beside
            self.crossed[..., load] = on_line & ~beside & self.turning[..., load]

    def _linear(self, corners: Array, bends: Sequence[Array], shape: tuple[int, ...]) -> None:
        """Where the mean Jacobian matrix J shows one zero at most: J⁻¹ ∂G/∂y near the identity."""
        count = len(corners)
        along = corners[:, 1, :] - corners[:, 0, :], corners[:, :, 1] - corners[:, :, 0]
        J = np.stack([way.mean(axis=1) for way in along], axis=-1)
        top = np.abs(J).max(axis=(1, 2))
        good = np.abs(np.linalg.det(J)) > 1e-12 * top**2
        B = np.zeros_like(J)
        B[good] = np.linalg.inv(J[good])
        errors, off = [], []
        for way, bend, unit in zip(along, bends, np.eye(2), strict=True):
            error = SURE * np.linalg.norm(np.einsum("nkx,nyx->nky", bend, B), axis=2).max(axis=1)
            turned = np.einsum("nkx,nyx->nky", way, B) - unit
            errors.append(error)
            off.append(np.linalg.norm(turned, axis=2).max(axis=1) + error)
        differs = np.hypot(*off)
        single = good & (differs <= ALONE)
        part = np.full((count, 2), 0.5)
        on = single.copy()
        for _ in range(8):
            x, z = part[on, 0], part[on, 1]
            weights = np.stack([(1.0 - x) * (1.0 - z), (1.0 - x) * z, x * (1.0 - z), x * z], axis=1)
            value = np.einsum("nk,nkx->nx", weights, corners[on].reshape(-1, 4, 2))
            part[on] -= np.einsum("nyx,nx->ny", B[on], value)
            on[on] = np.abs(part[on] - 0.5).max(axis=1) <= 2.0
        # by how much the zero may be beside that of the interpolation
        shift = 0.25 * sum(errors) / np.maximum(1.0 - differs, 1.0 - ALONE)
        outside = np.abs(part - 0.5).max(axis=1) > 0.5 + np.maximum(FOLLOWED, shift)
        self.single = single.reshape(shape)
        self.part = part.reshape(*shape, 2)
        self.outside = outside.reshape(shape)

    def _creases(self, numbers: Array, which: Array) -> None:
        """Exclude quarters in which directions of loads are not known; those with the same loads
        together.
        """
        along = self.samples.of.along
        sets = self.turning[which[:, 0], which[:, 1]]
        for own in np.unique(sets, axis=0):
            turning = np.flatnonzero(own)
            if along[turning].all():
                self._beside(numbers, which[(sets == own).all(axis=1)], turning)

    def _beside(self, numbers: Array, which: Array, turning: Array) -> None:
        """The same of quarters (quarters, 2) in which some loads turn."""
        samples = self.samples
        nine = numbers[which[:, 0]]
        four = _quarters(nine)[np.arange(len(nine)), which[:, 1]].reshape(-1, 4)
        rest = samples.drive[nine] - samples.own[nine][:, :, :, turning].sum(axis=3)
        error = _error(_bends(rest))
        corners = samples.drive[four] - samples.own[four][:, :, turning].sum(axis=2)
        part = corners @ WAYS.T
        force = samples.force[nine.reshape(-1, 9)][:, :, turning]
        spread = np.ptp(force, axis=1)
        # what a load may give in each direction: F |slopes · w|
        slopes = samples.slopes[four][:, :, turning]
        sizes = np.linalg.norm(slopes @ WAYS.T, axis=3).max(axis=1)
        most = (force.max(axis=1) + SURE * spread)[:, :, None] * sizes
        empty = (part.min(axis=1) - error - most.sum(axis=1) > 0.0).any(axis=1)
        for k, load in enumerate(turning):
            ends = samples.ends[four][:, :, load]
            long = np.linalg.norm(ends, axis=2)
            off = long > ON_CREASE
            line = ends[np.arange(len(ends)), long.argmax(axis=1)]
            signed = np.einsum("nkx,nx->nk", ends, line)
            own = samples.own[four][:, :, load]
            given = np.sign(signed)[:, :, None] * (own @ WAYS.T)
            given = np.where(off[:, :, None], given, np.inf).min(axis=1)
            given = given - SURE * spread[:, k, None] * sizes[:, k]
            others = np.abs(part).max(axis=1) + error + most.sum(axis=1) - most[:, k]
            outweighs = self.crossed[which[:, 0], which[:, 1], load] & ~empty
            outweighs &= (given - others > 0.0).any(axis=1)
            empty |= outweighs
            u = ends / np.maximum(long, 1e-300)[:, :, None]
            pull = np.einsum("nka,nkax,nkx->nk", u, slopes[:, :, k], own)
            inward = outweighs & ((pull < 0.0) | ~off).all(axis=1)
            for n in np.flatnonzero(inward):
                across = slopes[n, :, k].mean(axis=0).T @ line[n]
                if _meets(signed[n], corners[n], across):
                    self.inward[tuple(which[n])] = load
        self.empty[which[empty, 0], which[empty, 1]] = True


def _meets(signed: Array, rest: Array, across: Array) -> bool:
    """Whether the drive along a crease, interpolated between four corners (4,) and (4, 2), has a
    zero on it within them, or beside them by a tenth.
    """
    values = np.column_stack([signed, rest @ [-across[1], across[0]]])
    a, b, c, d = values
    J = 0.5 * np.column_stack([c + d - a - b, b + d - a - c])
    top = np.abs(J).max(axis=1)
    if abs(np.linalg.det(J)) <= 1e-12 * float(top.prod()):
        return True
    part = 0.5 - np.linalg.solve(J, values.mean(axis=0))
    return bool(np.abs(part - 0.5).max() <= 0.6)
