"""The drive at points of charts of a surface, and what single loads are of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbody.analysis.equilibria.load_ends import LoadEnds
from mbody.analysis.equilibria.surface_charts import TangentChart, led_to
from mbody.analysis.equilibria.surface_cover import Cover
from mbody.analysis.position.tangent_space import Array

__all__ = ["SurfaceSamples"]


class SurfaceSamples:
    """Numbered samples, not a number where a chart does not lead.

    Parameters
    ----------
    ends : LoadEnds
        Of the loads whose direction turns quickly where their ends come close.

    Attributes
    ----------
    q : array (samples, coordinates)
    drive : array (samples, 2)
        The drive in the frame of the chart.
    own : array (samples, loads, 2)
        What these loads are of it.
    ends : array (samples, loads, 2)
        From one end of each to the other.
    slopes : array (samples, loads, 2, 2)
        A load that pulls along its line drives by −F u·slopes, u the direction of its ends.
    force : array (samples, loads)
        F.
    """

    def __init__(self, cover: Cover, ends: LoadEnds) -> None:
        self.cover, self.of = cover, ends
        loads, size = len(ends.loads), cover.manifold.size
        self.count = 0
        self._shapes = {
            "q": (size,),
            "drive": (2,),
            "own": (loads, 2),
            "ends": (loads, 2),
            "slopes": (loads, 2, 2),
            "force": (loads,),
        }
        self._kept = {name: np.empty((256, *shape)) for name, shape in self._shapes.items()}
        # the force on the end on j, or that on i where j is the ground
        ground = 3 * ends.bodies[1] >= size
        self._at = 3 * np.where(ground, ends.bodies[0], ends.bodies[1])

    def __getattr__(self, name: str) -> Array:
        if name.startswith("_") or name not in self._shapes:
            raise AttributeError(name)
        return self._kept[name][: self.count]

    def add(self, charts: Sequence[TangentChart], y: Array) -> Array:
        """Evaluate the drive at coordinates of charts, each at its own: numbers of the samples."""
        many, count = self.cover.many, len(charts)
        found = led_to(charts, y)
        new = {name: np.full((count, *shape), np.nan) for name, shape in self._shapes.items()}
        good = np.flatnonzero(found.good)
        q, ways = found.q[good], found.ways[good]
        loads = many.loads(q)
        # frame · P f, P the projection on the free directions: (W Wᵀ)⁻¹ W f
        S = np.linalg.inv(ways @ ways.transpose(0, 2, 1))
        drives = np.einsum("nab,nbc,nlc->nla", S, ways, loads)
        new["q"][good] = q
        new["drive"][good] = drives.sum(axis=1)
        if self.of.loads:
            new["own"][good] = drives[:, self.of.numbers]
            new["ends"][good] = self.of.vectors(q)
            new["slopes"][good] = self.of.slopes(q, ways) @ S[:, None]
            own = loads[:, self.of.numbers]
            every = np.arange(len(self.of.loads))
            new["force"][good] = np.hypot(
                own[:, every, self._at % own.shape[-1]], own[:, every, self._at % own.shape[-1] + 1]
            )
        first, self.count = self.count, self.count + count
        while self.count > len(self._kept["q"]):
            for name, kept in self._kept.items():
                self._kept[name] = np.concatenate([kept, np.empty_like(kept)])
        for name, values in new.items():
            self._kept[name][first : self.count] = values
        for chart in charts:
            chart.evaluations += 1
        return np.arange(first, self.count)

    def leads(self, numbers: Array) -> Array:
        """Whether the charts lead to samples."""
        return np.isfinite(self.q[numbers]).all(axis=-1)
