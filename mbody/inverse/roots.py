"""Numbers that make rows zero: straight where rows are straight, by Newton's method where not.

`Residuals` are a function of an array of trials (trials, unknowns) that gives (residuals, size),
each (trials, rows): the residual of every row and how large its terms are; NaN where a trial fails.
They know their Jacobian at a place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.bracket import zero_between

Array = np.ndarray

#: Places of a grid that are tried together.
STRIDE = 8


class SingularEquations(Exception):
    """The rows do not determine the unknowns: a direction that they leave open, and whether a
    solution exists at all.
    """

    def __init__(self, direction: Array, solvable: bool) -> None:
        super().__init__("singular")
        self.direction, self.solvable = direction, solvable


@dataclass(frozen=True)
class Affine:
    """rows(u) = residuals + jacobian (u − base), with the size of the terms of each row."""

    base: Array
    residuals: Array
    jacobian: Array
    size: Array

    def __call__(self, u: Array) -> Array:
        """Residual of every row at u: (rows,)."""
        return self.residuals + self.jacobian @ (u - self.base)

    def solve(self, rows: Sequence[int]) -> Array:
        """The unknowns that make as many rows zero."""
        chosen = list(rows)
        size = np.maximum(self.size[chosen], tol.TINY)
        jacobian, residuals = self.jacobian[chosen] / size[:, None], self.residuals[chosen] / size
        u, s, vt = np.linalg.svd(jacobian)
        if s[-1] <= tol.UNKNOWN_OPEN * max(float(s[0]), tol.TINY):
            small = s <= tol.UNKNOWN_OPEN * max(float(s[0]), tol.TINY)
            raise SingularEquations(
                vt[-1], bool(np.abs(u[:, small].T @ residuals).max() < tol.ROW_HOLDS)
            )
        step: Array = np.linalg.solve(jacobian, -residuals)
        return self.base + step


class Residuals(Protocol):
    """Rows as functions of the unknowns."""

    def __call__(self, us: Array) -> tuple[Array, Array]:
        """Values and the size of their terms at places, (places, rows) each."""

    def about(self, u: Array) -> Affine | None:
        """All rows about a place; None where they have no values."""


def affine(rows: Residuals, start: Array) -> Affine | None:
    """The rows as straight functions of the unknowns; None where they are not straight."""
    n = len(start)
    odd = np.array([0.7 + 0.31 * k for k in range(n)]) * (-1.0) ** np.arange(n)
    probes = np.vstack([start, start + np.eye(n), start + odd, start - 900.0 * odd])
    residuals, size = rows(probes)
    if not np.isfinite(residuals).all():
        return None
    jacobian = (residuals[1 : n + 1] - residuals[0]).T
    guessed = residuals[0] + (probes - start) @ jacobian.T
    terms = size.max(axis=0) + np.abs(probes - start) @ np.abs(jacobian).T
    if (np.abs(residuals - guessed) > tol.ROW_HOLDS * terms).any():
        return None
    whole = size[: n + 1].max(axis=0) + np.abs(jacobian).sum(axis=1)
    return Affine(start, residuals[0], jacobian, whole)


def differences(rows: Residuals, u: Array) -> Affine | None:
    """All rows about a place with their Jacobian by differences, of what has no exact derivatives;
    None where they have no values.
    """
    h = tol.DIFFERENCE_STEP_UNKNOWNS * np.maximum(1.0, np.abs(u))
    residuals, size = rows(np.vstack([u, u + np.diag(h)]))
    if not np.isfinite(residuals[0]).all():
        return None
    lost = ~np.isfinite(residuals[1:]).all(axis=1)
    if lost.any():  # at the edge of what can be analysed: look to the other side
        h = np.where(lost, -h, h)
        residuals, size = rows(np.vstack([u, u + np.diag(h)]))
        if not np.isfinite(residuals).all():
            return None
    jacobian = ((residuals[1:] - residuals[0]) / h[:, None]).T
    return Affine(
        u,
        residuals[0],
        jacobian,
        np.maximum(size[0], np.abs(jacobian) @ np.maximum(1.0, np.abs(u))),
    )


def newton(rows: Residuals, chosen: Sequence[int], start: Array) -> Affine | None:
    """Newton's method, its steps shortened where what is left grows."""
    index, n = list(chosen), len(start)
    u, before = start.copy(), np.inf
    best: tuple[float, Affine] | None = None
    for _ in range(40):
        here = rows.about(u)
        if here is None:
            return None
        jacobian, terms = here.jacobian, here.size[index] + tol.TINY
        left = float(np.abs(here.residuals[index] / terms).max())
        if best is None or left < best[0]:
            best = (left, here)
        if left < tol.ROW_REST_ROUNDING or (left < tol.ROW_HOLDS and left >= 0.5 * before):
            break
        before = left
        step, *_ = np.linalg.lstsq(jacobian[index] / terms[:, None], -here.residuals[index] / terms)
        longest = float(np.abs(step / np.maximum(1.0, np.abs(u))).max())
        step *= min(1.0, 2.0 / longest) if longest > 0.0 else 1.0
        for _ in range(12):
            trial, _ = rows((u + step)[None])
            there = np.abs(trial[0][index] / terms).max()
            if (
                there < max((1.0 - tol.UNKNOWN_STEP_GAIN) * left, tol.ROW_REST_ROUNDING)
                and np.isfinite(trial).all()
            ):
                break
            step = 0.5 * step
        u = u + step
        if n and np.abs(step).max() < tol.UNKNOWN_STEP_ROUNDING:
            break
    if best is None or not best[0] < tol.ROW_HOLDS:
        return None
    return best[1]


def scan(rows: Residuals, chosen: int, grid: Array, start: float) -> list[Array]:
    """Starts for Newton's method in one unknown: where a row changes its sign along the grid, and
    where it comes near to zero without.

    The grid is walked from the start to both sides, no further than where trials begin to fail.
    """

    def row(x: float) -> float:
        return float(rows(np.array([[x]]))[0][0, chosen])

    middle = int(np.searchsorted(grid, start))
    residuals = np.full(len(grid), np.nan)
    for side in (np.arange(middle, len(grid)), np.arange(middle - 1, -1, -1)):
        for first in range(0, len(side), STRIDE):
            index = side[first : first + STRIDE]
            residuals[index] = rows(grid[index][:, None])[0][:, chosen]
            if np.isnan(residuals[index]).all():
                break
    found: list[Array] = []
    for k, here in enumerate(residuals):
        if here == 0.0:
            found.append(grid[k : k + 1])
        elif k and here * residuals[k - 1] < 0.0:
            ends, values = (grid[k - 1], grid[k]), (residuals[k - 1], here)
            width = tol.UNKNOWN_BRACKET * max(abs(one) for one in ends)
            found.append(np.array([zero_between(row, ends, values, width).x]))
        elif 0 < k < len(grid) - 1 and abs(here) <= min(
            abs(residuals[k - 1]), abs(residuals[k + 1])
        ):
            found.append(grid[k : k + 1])
    return found


def spread(grids: Sequence[Array], count: int) -> Array:
    """Starts that fill the space of the grids evenly, the same ones always: (count, unknowns)."""
    return np.stack(
        [
            grid[np.minimum((_halton(count, prime) * len(grid)).astype(int), len(grid) - 1)]
            for grid, prime in zip(grids, (2, 3, 5, 7, 11, 13, 17, 19), strict=False)
        ],
        axis=1,
    )


def _halton(count: int, base: int) -> Array:
    """Numbers between 0 and 1 that fill the interval evenly."""
    found = np.zeros(count)
    for n in range(count):
        part, left = 1.0, n + 1
        while left:
            part /= base
            found[n] += part * (left % base)
            left //= base
    return found
