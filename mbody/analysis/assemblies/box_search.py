"""All real roots of the rows of a group, with a certificate.

Boxes of unknowns are shrunk by the rows, as they are and preconditioned by the inverse of the
Jacobian at the middle; excluded where a row cannot vanish; cut by Krawczyk's operator. Newton's
method goes from the middle to a root, and where Krawczyk's operator maps a box about that root,
which covers the whole box at hand, into its inside, there is one root in it and no other
(ε-inflation: Rump 1999). What remains is halved.

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, *Introduction to Interval Analysis*, SIAM 2009,
chapter 8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.analysis.assemblies.loop_rows import OPEN, Box, LoopRows

__all__ = ["BoxRoots", "all_roots"]

#: Width [rad, or a quarter of the reach] of a box that is not halved any more.
SMALL = 1e-6
#: Boxes as narrow as this, and how many of them, are no isolated roots.
NARROW, MANY = 2e-2, 600
#: BoxRoots nearer than this are one [rad].
ONE = 1e-7
#: Of the reach of a displacement, what weighs as a radian.
QUARTER = 4.0
#: Part of the greatest singular value that counts as none: of a preconditioner, of a root.
ROUGH, FINE = 1e-8, 1e-10
NEWTON = 7
INFLATED, LEAST = 1.05, 1e-9


@dataclass(frozen=True)
class BoxRoots:
    """What the search found.

    Attributes
    ----------
    points : array (roots, unknowns)
    low, high : arrays (open, unknowns)
        Boxes neither excluded nor settled.
    boxes : int
        How many were examined.
    spent : bool
        Whether it stopped because the number of boxes allowed was spent.
    """

    points: np.ndarray
    low: np.ndarray
    high: np.ndarray
    boxes: int
    spent: bool = False


def all_roots(rows: LoopRows, most: int, reach: np.ndarray | None = None) -> BoxRoots:
    """All real roots, angles within their turns, displacements up to `reach` (slides,), by default
    those of the rows; after `most` boxes the rest is left open.
    """
    return _BoxSearch(rows, most, reach).run()


class _BoxSearch:
    def __init__(self, rows: LoopRows, most: int, reach: np.ndarray | None) -> None:
        self.rows, self.most = rows, most
        self.reach = rows.reach if reach is None else reach
        n = rows.unknowns
        self.weight = np.concatenate([np.ones(rows.angles), QUARTER / self.reach])
        self.points = np.empty((0, n))
        self.open: list[Box] = []

    def run(self) -> BoxRoots:
        rows, n = self.rows, self.rows.unknowns
        if not n:
            closes = np.abs(rows.values(np.zeros((1, 0)))).max(initial=0.0) <= OPEN * rows.scale
            return BoxRoots(np.zeros((int(closes), 0)), np.empty((0, 0)), np.empty((0, 0)), 0)
        if not rows.angles and len(rows.B) == n:
            only = self._linear()
            if only is not None:
                return BoxRoots(only, np.empty((0, n)), np.empty((0, n)), 1)
        half = np.concatenate([np.pi * rows.turns, self.reach])[None]
        lo, hi, count, spent = -half, half.copy(), 0, False
        while len(lo):
            count += len(lo)
            spent = count > self.most
            narrow = ((hi - lo) * self.weight).max(1).min() < NARROW and len(lo) > MANY
            if spent or narrow:
                self.open.append((lo, hi))
                break
            lo, hi = self._shrunk((lo, hi))
            if len(lo):
                lo, hi = self._unsettled((lo, hi))
            if len(lo):
                lo, hi = self._halved((lo, hi))
        low = np.concatenate([np.empty((0, n)), *(box[0] for box in self.open)])
        high = np.concatenate([np.empty((0, n)), *(box[1] for box in self.open)])
        return BoxRoots(self.points, low, high, count, spent)

    def _linear(self) -> np.ndarray | None:
        """The one root (1, slides) of slides in known directions; None where these are parallel."""
        zero = np.zeros((1, self.rows.slides))
        J = self.rows.jacobian(zero)[0]
        if np.linalg.svd(J, compute_uv=False)[-1] < ROUGH:
            return None
        return -np.linalg.solve(J, self.rows.values(zero)[0])[None]

    def _shrunk(self, box: Box) -> Box:
        rows = self.rows
        lo, hi = box
        every = np.repeat(np.eye(len(rows.B))[None], len(lo), 0)
        alive = self._cut(every, (lo, hi))
        lo, hi = lo[alive], hi[alive]
        for _ in range(2):
            if not len(lo):
                break
            middle = 0.5 * (lo + hi)
            Y = np.linalg.pinv(rows.jacobian(middle), rcond=ROUGH)
            alive = self._cut(Y, (lo, hi))
            lo, hi, middle, Y = lo[alive], hi[alive], middle[alive], Y[alive]
            if not len(lo):
                break
            if len(rows.B) <= rows.unknowns:
                middle = np.clip(middle, lo, hi)
                a, b = rows.krawczyk(Y, middle, (lo, hi))
                lo, hi = np.maximum(lo, a), np.minimum(hi, b)
                alive = (lo <= hi).all(1)
                lo, hi = lo[alive], hi[alive]
        return lo, hi

    def _cut(self, Y: np.ndarray, box: Box) -> np.ndarray:
        """Shrink boxes, in place, by the rows Y f = 0; which may hold a root."""
        rows = self.rows
        spare = OPEN if len(rows.B) > rows.unknowns else 0.0
        return rows.cut(Y, box, np.ones(len(box[0]), dtype=bool), spare)

    def _unsettled(self, box: Box) -> Box:
        """Boxes that are not covered by a box with one root, which is kept."""
        rows, (lo, hi) = self.rows, box
        x = self._newton(0.5 * (lo + hi))
        far = INFLATED * np.maximum(np.abs(x - lo), np.abs(x - hi)) + LEAST
        near = np.isfinite(x).all(1) & (far * self.weight < 2.0).all(1)
        settled = np.zeros(len(lo), dtype=bool)
        if near.any():
            points, half = x[near], far[near]
            Y = np.linalg.pinv(rows.jacobian(points), rcond=FINE)
            a, b = rows.krawczyk(Y, points, (points - half, points + half))
            good = ((a > points - half) & (b < points + half)).all(1)
            settled[np.flatnonzero(near)[good]] = True
            for root in points[good]:
                # with rows to spare a root of their combinations may be none of their own
                if np.abs(rows.values(root[None])).max() <= OPEN * rows.scale:
                    self._keep(root)
        return lo[~settled], hi[~settled]

    def _newton(self, x: np.ndarray) -> np.ndarray:
        rows = self.rows
        for _ in range(NEWTON):
            inverse = np.linalg.pinv(rows.jacobian(x), rcond=FINE)
            step = np.einsum("bij,bj->bi", inverse, rows.values(x))
            x = x - np.clip(step, -1.0 / self.weight, 1.0 / self.weight)
        return x

    def _keep(self, root: np.ndarray) -> None:
        angles = self.rows.angles
        away = self.points - root
        turn = 2.0 * np.pi * self.rows.turns
        away[:, :angles] -= turn * np.round(away[:, :angles] / turn)
        if not len(away) or (np.abs(away) * self.weight).max(1).min() > ONE:
            self.points = np.concatenate([self.points, root[None]])

    def _halved(self, box: Box) -> Box:
        lo, hi = box
        width = (hi - lo) * self.weight
        tiny = width.max(1) < SMALL
        if tiny.any():
            # Krawczyk's operator may have shrunk a box to a point after the rows were looked at
            low, high = lo[tiny], hi[tiny]
            alive = self._cut(np.repeat(np.eye(len(self.rows.B))[None], len(low), 0), (low, high))
            self.open.append((low[alive], high[alive]))
        lo, hi, width = lo[~tiny], hi[~tiny], width[~tiny]
        widest, every = width.argmax(1), np.arange(len(lo))
        half = 0.5 * (lo[every, widest] + hi[every, widest])
        first, second = hi.copy(), lo.copy()
        first[every, widest] = second[every, widest] = half
        return np.concatenate([lo, second]), np.concatenate([first, hi])
