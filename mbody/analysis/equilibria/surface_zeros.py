"""Zeros of the drive on a surface: Newton's method from many points of charts at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.equilibria.surface_charts import TangentChart, hold, led_to
from mbody.analysis.equilibria.surface_cover import Cover
from mbody.analysis.position.tangent_space import Array, Place

__all__ = ["SoughtCell", "Corner", "Polish", "SurfaceZeros", "Zero"]

#: A stiffness with a singular value below this part of the greatest is singular, and zeros whose
#: names differ by less than this are one.
SINGULAR, SAME = 1e-7, 1e-7
#: Newton steps in a cell, and the length of one after which the search's own method ends it.
ITERATIONS, NEAR = 15, 1e-6

Polish = Callable[[Place], "Place | None"]
Corner = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Zero:
    """A zero, and whether the stiffness is singular there."""

    place: Place
    name: Array
    singular: bool


@dataclass(frozen=True, eq=False)
class SoughtCell:
    """A cell in which a zero is sought, and coordinates to begin from."""

    chart: TangentChart
    y: Array
    corner: Corner
    size: int


class SurfaceZeros:
    """All that were found on a surface."""

    def __init__(self, cover: Cover, polish: Polish) -> None:
        self.cover, self.polish = cover, polish
        self.every: list[Zero] = []
        self._names = np.empty((0, len(cover.nodes[0].name)))

    def search(self, sought: Sequence[SoughtCell]) -> None:
        """Keep the zeros to which Newton's method leads from points of cells, if it does not lead
        further away than a cell is long.
        """
        if not sought:
            return
        many, scale = self.cover.many, self.cover.scale
        found = led_to([one.chart for one in sought], np.array([one.y for one in sought]))
        ended = list[tuple[int, Place]]()
        left, which = np.flatnonzero(found.good), np.flatnonzero(found.good)
        for n in range(ITERATIONS + 1):
            if not left.size:
                break
            places = many.places(found, which)
            if n == ITERATIONS:
                ended += zip(left.tolist(), places, strict=True)
                break
            kept = [
                k
                for k, (one, place) in enumerate(zip(left.tolist(), places, strict=True))
                if np.isfinite(place.force).all() and self._beside(sought[one], place.q)
            ]
            left, places = left[kept], [places[k] for k in kept]
            if not left.size:
                break
            q, motions, rows, force, drive = (
                np.array([getattr(place, name) for place in places])
                for name in ("q", "motions", "rows", "force", "drive")
            )
            K = many.stiffness(q, motions, rows, force)
            steady = np.isfinite(K).all(axis=(1, 2))
            left, q, motions = left[steady], q[steady], motions[steady]
            step = np.einsum("nab,nb->na", np.linalg.pinv(K[steady], rcond=1e-12), drive[steady])
            found = many.closed(q + scale * np.einsum("na,nac->nc", step, motions), motions)
            short = found.good & (np.linalg.norm(step, axis=1) < NEAR)
            ends = np.flatnonzero(short)
            ended += zip(left[ends].tolist(), many.places(found, ends), strict=True)
            which = np.flatnonzero(found.good & ~short)
            left = left[which]
        for _, place in sorted(ended, key=lambda pair: pair[0]):
            self._keep(place)

    def _beside(self, sought: SoughtCell, q: Array) -> bool:
        at = sought.chart.grid(self.cover.seen(sought.chart.node, q))
        return bool(np.abs((at - sought.corner) / sought.size - 0.5).max() <= 1.5)

    def _keep(self, near: Place) -> None:
        """Keep the zero beside a place where it is new."""
        if not np.isfinite(near.force).all() or self._is_known(self.cover.name(near.q)):
            return
        place = self.polish(near)
        if place is None or len(place.motions) != 2:
            return
        name = self.cover.name(place.q)
        if not self._is_known(name):
            sizes = np.linalg.svd(self.cover.manifold.stiffness(place))[1]
            self.every.append(Zero(place, name, bool(sizes[-1] <= SINGULAR * sizes[0])))
            self._names = np.vstack([self._names, name])

    def _is_known(self, name: Array) -> bool:
        return bool((np.abs(self._names - name).max(axis=1) <= SAME).any())

    def known(self, chart: TangentChart, corner: Corner, size: int, beside: float) -> Zero | None:
        """A zero that was found in a cell, or beside it by a part of its size."""
        self.read([chart])
        for zero, at in chart.zeros:
            if np.abs((at - corner) / size - 0.5).max() <= 0.5 + beside:
                return zero
        return None

    def read(self, charts: Iterable[TangentChart]) -> None:
        """Let charts know the zeros that they lead to, and where these are on their grids: all
        that were found meanwhile at once, on rows without end hundreds.
        """
        new = [chart for chart in dict.fromkeys(charts) if chart.zeros_read < len(self.every)]
        pairs = list[tuple[TangentChart, Zero]]()
        for chart in new:
            far = np.abs(self._names[chart.zeros_read :] - chart.node.name).max(axis=1)
            beside = np.flatnonzero(far <= 4.0 * chart.node.reach) + chart.zeros_read
            pairs += [(chart, self.every[n]) for n in beside]
            chart.zeros_read = len(self.every)
        holding = hold([chart for chart, _ in pairs], np.array([one.place.q for _, one in pairs]))
        for (chart, zero), leads in zip(pairs, holding.tolist(), strict=True):
            if leads:
                at = chart.grid(self.cover.seen(chart.node, zero.place.q))
                chart.zeros.append((zero, at))
