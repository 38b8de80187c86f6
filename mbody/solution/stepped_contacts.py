"""Contacts at the kept instants of a motion by steps with impulses, those of groups included."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from mbody.model.element import unknown_name
from mbody.system.system import Locked

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class ClosedPoints:
    """Places that touch at one instant, as arrays (places,).

    `i`, `j`: Dotted names of the shapes; of a rope its own name.
    `x`, `y`: Where, world axes.
    `nx`, `ny`: Normal from i to j.
    `normal`, `tangential`: Pressing force, and friction along (ny, −nx), on j: impulse of the step
      by its length.
    `gap`: In the middle of the step, below zero of what overlaps.
    """

    i: list[str]
    j: list[str]
    x: Array
    y: Array
    nx: Array
    ny: Array
    normal: Array
    tangential: Array
    gap: Array

    def __len__(self) -> int:
        return len(self.i)

    @property
    def force(self) -> tuple[Array, Array]:
        """(x, y) on j."""
        n, t = self.normal, self.tangential
        return n * self.nx + t * self.ny, n * self.ny - t * self.nx


@dataclass(frozen=True, eq=False)
class SteppedContacts(Locked):
    """Contacts of every kept instant, one after the other.

    `laws`: Names of contacts, ropes and groups.
    `shapes`: Dotted names of the shapes.
    `first` (instants + 1,): Where the contacts of each instant begin.
    `which` (contacts, 3): Law, shapes i and j; shapes of ropes are negative.
    `numbers` (contacts, 7): Place (x, y), normal, pressing force, friction, gap.
    `residuals` (1, instants, 5): See `mbody.kernels.finished_instants`, of the equation of a step;
      of a batch (designs, instants, 5), NaN where a design has no instant.
    `designs`: Of a batch, the instants of one design after those of the other.
    `nearer`: How far, at most, a contact came nearer or left in a step by what its sliding changed,
      in parts of its size.
    """

    laws: tuple[str, ...]
    shapes: tuple[str, ...]
    first: Array
    which: Array
    numbers: Array
    residuals: Array
    nearer: float
    designs: int = 0

    def take(self, index: Array) -> SteppedContacts:
        """Only some of the instants."""
        spans = [np.arange(self.first[n], self.first[n + 1]) for n in index]
        rows = np.concatenate([np.empty(0, dtype=np.int64), *spans]).astype(np.int64)
        return replace(
            self,
            first=np.concatenate([[0], np.cumsum([len(span) for span in spans])]).astype(np.int64),
            which=self.which[rows],
            numbers=self.numbers[rows],
            residuals=self.residuals[:, index],
        )

    def touching(self, instant: int, name: str | None = None) -> ClosedPoints:
        """Contact points at an instant, by its number, of one contact or group or of all."""
        rows = np.arange(self.first[instant], self.first[instant + 1])
        if name is not None:
            rows = rows[self.which[rows, 0] == self._number(name)]
        law, i, j = self.which[rows].T
        columns = list(self.numbers[rows].T)
        return ClosedPoints(
            [self.shapes[k] if k >= 0 else self.laws[n] for k, n in zip(i, law, strict=True)],
            [self.shapes[k] if k >= 0 else self.laws[n] for k, n in zip(j, law, strict=True)],
            *columns,
        )

    def pressing(self, name: str) -> Array:
        """The sum of the pressing forces of a contact or group: (instants,)."""
        mine = self.which[:, 0] == self._number(name)
        return self._sums(np.where(mine, self.numbers[:, 4], 0.0))

    def force(self, name: str) -> tuple[Array, Array, Array]:
        """The sum of the forces on the j of a contact or group by its i, and its torque about the
        origin of the world: three arrays (instants,).
        """
        mine = self.which[:, 0] == self._number(name)
        x, y, nx, ny, n, t, _ = (np.where(mine, column, 0.0) for column in self.numbers.T)
        fx, fy = n * nx + t * ny, n * ny - t * nx
        return self._sums(fx), self._sums(fy), self._sums(x * fy - y * fx)

    def _number(self, name: str) -> int:
        if name not in self.laws:
            raise unknown_name("contact", name, self.laws)
        return self.laws.index(name)

    def _sums(self, parts: Array) -> Array:
        # of each instant by itself: differences of one long sum would round
        ends = itertools.pairwise(self.first)
        found = np.array([parts[first:last].sum() for first, last in ends])
        if not self.designs:
            return found
        known = ~np.isnan(self.residuals[:, :, 0])
        return np.where(known, found.reshape(self.designs, -1), np.nan)
